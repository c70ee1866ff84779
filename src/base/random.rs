//! Stateless random numbers: a number is a hash of what it is for.
//!
//! `hash(seed, pixel, sample, dimension)` gives every decision of every sample its own number, whatever thread or order
//! asks for it. The mixer is the finaliser of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014), which passes the
//! avalanche tests that matter here.

/// Mixes 64 bits so that each output bit depends on every input bit.
#[inline]
pub fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Combines a running hash with one more word.
#[inline]
pub fn combine(hash: u64, word: u64) -> u64 {
    mix(hash.wrapping_add(0x9e37_79b9_7f4a_7c15) ^ word.wrapping_mul(0xd6e8_feb8_6659_fd93))
}

/// Uniform number in [0, 1) from the upper 24 bits of a hash: exact in `f32`.
#[inline]
pub fn unit_f32(hash: u64) -> f32 {
    (hash >> 40) as f32 * (1.0 / (1u32 << 24) as f32)
}

/// Hash of a sequence of words, for seeds and content keys.
pub fn hash_words(words: impl IntoIterator<Item = u64>) -> u64 {
    words.into_iter().fold(0x616e_696d, combine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_uniform_and_uncorrelated_between_neighbours() {
        let n = 1 << 16;
        let (mut sum, mut cross) = (0.0f64, 0.0f64);
        for i in 0..n {
            let a = unit_f32(combine(7, i)) as f64;
            let b = unit_f32(combine(7, i + 1)) as f64;
            assert!((0.0..1.0).contains(&a));
            sum += a;
            cross += (a - 0.5) * (b - 0.5);
        }
        assert!((sum / n as f64 - 0.5).abs() < 0.005);
        assert!((cross / n as f64).abs() < 0.002);
    }

    #[test]
    fn order_of_words_matters() {
        assert_ne!(hash_words([1, 2]), hash_words([2, 1]));
        assert_ne!(hash_words([0]), hash_words([0, 0]));
    }
}
