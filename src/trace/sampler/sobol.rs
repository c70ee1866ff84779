//! Sobol points, scrambled by Owen's rule, whose error is spread over the screen as blue noise.
//!
//! All samples of a block of pixels are one sequence: pixels take turns along a Z-order curve, and digits of the
//! running number, to the base of four, are permuted at every level by a hash of the digits above (Ahmed and Wonka,
//! "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels", SIGGRAPH Asia
//! 2020). What neighbours take is then stratified together, and their errors cancel. Every pair of dimensions is the
//! first pair of Sobol's sequence with permutations and a scramble of its own, so that there is no end of good pairs at
//! any depth of a path; a key stands for the pair. Scrambling follows Laine and Karras (EGSR 2011) with the constants
//! of Vegdahl (2021).

use crate::trace::simd::{LANES, Lanes, U32x8, Wide};

/// Pixels along the side of a block, as a power of two.
pub const BLOCK_BITS: u32 = 5;

/// The 24 orders of four digits, two bits each.
const ORDERS: [u8; 24] = orders();

const fn orders() -> [u8; 24] {
    let (mut found, mut n, mut code) = ([0; 24], 0, 0u32);
    while code < 256 {
        let digits = [code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6 & 3];
        let seen = 1 << digits[0] | 1 << digits[1] | 1 << digits[2] | 1 << digits[3];
        if seen == 15 {
            found[n] = code as u8;
            n += 1;
        }
        code += 1;
    }
    found
}

/// The same, four to a word.
const PACKED: [u32; LANES] = {
    let (mut packed, mut n) = ([0; LANES], 0);
    while n < ORDERS.len() {
        packed[n / 4] |= (ORDERS[n] as u32) << (8 * (n % 4));
        n += 1;
    }
    packed
};

/// Place of a pixel along the Z-order curve of its block.
pub fn curve([x, y]: [u32; 2]) -> u32 {
    let spread = |n: u32| (0..BLOCK_BITS).fold(0, |sum, bit| sum | (n >> bit & 1) << (2 * bit));
    spread(x) | spread(y) << 1
}

/// Digits to the base of four that number so many samples.
pub fn digits(samples: u32) -> u32 {
    (32 - samples.saturating_sub(1).leading_zeros()).div_ceil(2)
}

/// Mixes 32 bits (Wellons' lowbias32).
#[inline]
fn mix32(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// The number's digits, permuted from the first of `count` on, each by what stands above it.
#[inline]
fn permuted(number: u32, count: u32, key: u32) -> u32 {
    let mut result = 0;
    for level in (0..count).rev() {
        let digit = number >> (2 * level) & 3;
        // A leading one keeps equal prefixes of different lengths apart.
        let above = (number >> (2 * level) >> 2) | 1 << (2 * (count - 1 - level));
        let hash = mix32(above.wrapping_mul(0x9e37_79b9) ^ key);
        let order = ORDERS[((u64::from(hash) * 24) >> 32) as usize];
        result = result << 2 | u32::from(order >> (2 * digit) & 3);
    }
    result
}

/// Flips every bit by a hash of the bits above it.
#[inline]
fn scrambled(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// The second coordinate of Sobol's sequence; the first has the number's bits reversed.
#[inline]
fn second(mut number: u32) -> u32 {
    // Columns of Pascal's triangle modulo 2, all at once: a butterfly of the bits.
    number ^= (number & 0xaaaa_aaaa) >> 1;
    number ^= (number & 0xcccc_cccc) >> 2;
    number ^= (number & 0xf0f0_f0f0) >> 4;
    number ^= (number & 0xff00_ff00) >> 8;
    number ^= number >> 16;
    number.reverse_bits()
}

fn unit(x: u32) -> f32 {
    // The upper 24 bits: exact, and below 1.
    (x >> 8) as f32 * (1.0 / (1u32 << 24) as f32)
}

/// The point of sample `number` of the block, in the pair of dimensions that `key` stands for.
#[inline]
pub fn pair(number: u32, count: u32, key: u64) -> [f32; 2] {
    let (low, high) = (key as u32, (key >> 32) as u32);
    let number = permuted(number, count, low);
    let (x, y) = (number.reverse_bits(), second(number));
    [unit(scrambled(x, high)), unit(scrambled(y, high.rotate_left(16) ^ low))]
}

/// As [`pair`], one dimension.
#[inline]
pub fn single(number: u32, count: u32, key: u64) -> f32 {
    let number = permuted(number, count, key as u32);
    unit(scrambled(number.reverse_bits(), (key >> 32) as u32))
}

/// As [`mix32`].
#[inline(always)]
fn mix_words<W: U32x8>(x: W) -> W {
    let x = x.xor(x.shr::<16>()).wrapping_mul(W::splat(0x7feb_352d));
    let x = x.xor(x.shr::<15>()).wrapping_mul(W::splat(0x846c_a68b));
    x.xor(x.shr::<16>())
}

#[inline(always)]
fn times_24<W: U32x8>(x: W) -> W {
    x.shl::<4>().wrapping_add(x.shl::<3>())
}

/// The lowest digit of `rest`, permuted by what stands above it; `top` is the one that leads that.
#[inline(always)]
fn permuted_digit<W: U32x8>(rest: W, top: W, key: u32) -> W {
    let hash = mix_words(rest.shr::<2>().or(top).wrapping_mul(W::splat(0x9e37_79b9)).xor(W::splat(key)));
    // 24 times the hash, of which the upper word counts: by halves.
    let low = times_24(hash.and(W::splat(0xffff))).shr::<16>();
    let index = times_24(hash.shr::<16>()).wrapping_add(low).shr::<16>();
    let shift = index.and(W::splat(3)).shl::<3>().wrapping_add(rest.and(W::splat(3)).shl::<1>());
    index.shr::<2>().permute(&PACKED).shr_by(shift).and(W::splat(3))
}

/// Numbers of eight samples of a block.
pub struct SobolIndices {
    each: [u32; LANES],
    /// Digits of a pixel's samples.
    digits: u32,
    /// Whether all are of one pixel.
    of_one: bool,
}

/// By digit of a pixel, from the highest on: what it is shifted by less than the first, the one that leads what stands
/// above it, and its weight.
const PIXEL: [[u32; LANES]; 3] = {
    let (mut lanes, mut i) = ([[0; LANES]; 3], 0);
    while i < LANES {
        lanes[0][i] = (2 * i as u32).wrapping_neg();
        lanes[1][i] = 1 << (2 * i);
        if i < BLOCK_BITS as usize {
            lanes[2][i] = 1 << (2 * (BLOCK_BITS as usize - 1 - i));
        }
        i += 1;
    }
    lanes
};

impl SobolIndices {
    /// Indices of points of one sequence, of so many base-4 digits below the pixel's part.
    #[inline(always)]
    pub fn new(each: [u32; LANES], digits: u32) -> Self {
        let mut apart = 0;
        for number in &each {
            apart |= number ^ each[0];
        }
        SobolIndices { each, digits, of_one: apart >> (2 * digits) == 0 }
    }

    /// As [`permuted`].
    #[inline(always)]
    fn permuted<W: U32x8>(&self, key: u32) -> W {
        let (number, count) = (W::load(&self.each), BLOCK_BITS + self.digits);
        let (mut result, mut levels) = (W::splat(0), count);
        if self.of_one {
            // The digits of the pixel side by side.
            let [shifts, tops, weights] = &PIXEL;
            let rest = W::splat(self.each[0]).shr_by(W::splat(2 * (count - 1)).wrapping_add(W::load(shifts)));
            let digits = permuted_digit(rest, W::load(tops), key).wrapping_mul(W::load(weights)).to_floats().store();
            let [a, b, c, d, e, ..] = digits;
            result = W::splat(((a + b) + (c + d) + e) as u32);
            levels = self.digits;
        }
        for level in (0..levels).rev() {
            let rest = number.shr_by(W::splat(2 * level));
            let top = W::splat(1 << (2 * (count - 1 - level)));
            result = result.shl::<2>().or(permuted_digit(rest, top, key));
        }
        result
    }
}

/// As [`scrambled`] of the reversed bits of `x`.
#[inline(always)]
fn scrambled_words<W: U32x8>(x: W, seed: u32) -> W {
    let x = x
        .xor(x.wrapping_mul(W::splat(0x3d20_adea)))
        .wrapping_add(W::splat(seed))
        .wrapping_mul(W::splat((seed >> 16) | 1));
    let x = x.xor(x.wrapping_mul(W::splat(0x0552_6c56)));
    x.xor(x.wrapping_mul(W::splat(0x53a2_2864))).reverse_bits()
}

/// As [`second`], its bits reversed.
#[inline(always)]
fn second_words<W: U32x8>(n: W) -> W {
    let n = n.xor(n.and(W::splat(0xaaaa_aaaa)).shr::<1>());
    let n = n.xor(n.and(W::splat(0xcccc_cccc)).shr::<2>());
    let n = n.xor(n.and(W::splat(0xf0f0_f0f0)).shr::<4>());
    let n = n.xor(n.and(W::splat(0xff00_ff00)).shr::<8>());
    n.xor(n.shr::<16>())
}

#[inline(always)]
fn unit_words<W: U32x8>(x: W) -> W::Floats {
    x.shr::<8>().to_floats() * W::Floats::splat(1.0 / (1u32 << 24) as f32)
}

/// As [`pair`], for eight numbers.
#[inline(always)]
pub fn pairs<L: Wide>(numbers: &SobolIndices, key: u64) -> [L; 2] {
    let (low, high) = (key as u32, (key >> 32) as u32);
    let number = numbers.permuted::<L::U32x8>(low);
    let (x, y) = (scrambled_words(number, high), scrambled_words(second_words(number), high.rotate_left(16) ^ low));
    [unit_words(x), unit_words(y)]
}

/// As [`single`], for eight numbers.
#[inline(always)]
pub fn singles<L: Wide>(numbers: &SobolIndices, key: u64) -> L {
    let number = numbers.permuted::<L::U32x8>(key as u32);
    unit_words(scrambled_words(number, (key >> 32) as u32))
}

#[cfg(test)]
mod tests;
