//! Content in 128 bits: what frames, assets and files are known by.
//!
//! MurmurHash3_x64_128 (Appleby, public domain, 2011), fed piece by piece. At 128 bits two different contents do not
//! meet by accident; it is no seal against forgery, and nothing here needs one. It costs no crate, and reads memory
//! about as fast as memory delivers.

use std::fmt;
use std::str::FromStr;

/// The digest of some content. Written as 32 hexadecimal digits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Digest(pub u128);

impl Digest {
    /// The digest of a file's bytes.
    pub fn of(bytes: &[u8]) -> Self {
        let mut hasher = Hasher::default();
        hasher.bytes(bytes);
        hasher.finish()
    }

    /// Adds a member to the digest of a set. A sum knows no order, so a member can be taken out again; what has a
    /// place in an order carries that place in its own digest.
    pub fn with(self, member: Digest) -> Self {
        Digest(self.0.wrapping_add(member.0))
    }

    /// Takes a member out of the digest of a set.
    pub fn without(self, member: Digest) -> Self {
        Digest(self.0.wrapping_sub(member.0))
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

impl FromStr for Digest {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let plain = text.len() == 32 && text.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
        if plain { u128::from_str_radix(text, 16).map(Digest).map_err(|_| ()) } else { Err(()) }
    }
}

/// Takes content in pieces. Where the pieces could be cut differently, lengths go in too: [`Hasher::text`] does so.
#[derive(Clone, Debug, Default)]
pub struct Hasher {
    state: [u64; 2],
    /// Bytes that do not fill a block yet.
    rest: [u8; 16],
    length: u64,
}

const C1: u64 = 0x87c3_7b91_1142_53d5;
const C2: u64 = 0x4cf5_ad43_2745_937f;

impl Hasher {
    /// Feeds bytes, without their number.
    pub fn bytes(&mut self, mut bytes: &[u8]) {
        let filled = (self.length % 16) as usize;
        self.length += bytes.len() as u64;
        if filled > 0 {
            let taken = bytes.len().min(16 - filled);
            self.rest[filled..filled + taken].copy_from_slice(&bytes[..taken]);
            bytes = &bytes[taken..];
            if filled + taken < 16 {
                return;
            }
            self.block(words(&self.rest));
        }
        let (blocks, rest) = bytes.as_chunks::<16>();
        for block in blocks {
            self.block(words(block));
        }
        self.rest[..rest.len()].copy_from_slice(rest);
    }

    /// Feeds a whole number.
    pub fn word(&mut self, word: u64) {
        self.bytes(&word.to_le_bytes());
    }

    /// Feeds a number by its bits: -0 and 0 differ.
    pub fn number(&mut self, number: f64) {
        self.word(number.to_bits());
    }

    /// A text with its length, so that two texts in a row cannot be cut at another place.
    pub fn text(&mut self, text: &str) {
        self.word(text.len() as u64);
        self.bytes(text.as_bytes());
    }

    /// Feeds a digest.
    pub fn digest(&mut self, digest: Digest) {
        self.bytes(&digest.0.to_le_bytes());
    }

    /// The digest of all that was fed.
    pub fn finish(mut self) -> Digest {
        let filled = (self.length % 16) as usize;
        self.rest[filled..].fill(0);
        let [k1, k2] = words(&self.rest);
        self.state[1] ^= scrambled(k2, C2, 33, C1);
        self.state[0] ^= scrambled(k1, C1, 31, C2);
        let [mut h1, mut h2] = self.state.map(|h| h ^ self.length);
        h1 = h1.wrapping_add(h2);
        h2 = h2.wrapping_add(h1);
        (h1, h2) = (avalanche(h1), avalanche(h2));
        h1 = h1.wrapping_add(h2);
        h2 = h2.wrapping_add(h1);
        Digest(u128::from(h2) << 64 | u128::from(h1))
    }

    fn block(&mut self, [k1, k2]: [u64; 2]) {
        let [h1, h2] = &mut self.state;
        *h1 ^= scrambled(k1, C1, 31, C2);
        *h1 = h1.rotate_left(27).wrapping_add(*h2).wrapping_mul(5).wrapping_add(0x52dc_e729);
        *h2 ^= scrambled(k2, C2, 33, C1);
        *h2 = h2.rotate_left(31).wrapping_add(*h1).wrapping_mul(5).wrapping_add(0x3849_5ab5);
    }
}

fn words(block: &[u8; 16]) -> [u64; 2] {
    let both = u128::from_le_bytes(*block);
    [both as u64, (both >> 64) as u64]
}

fn scrambled(k: u64, first: u64, turn: u32, second: u64) -> u64 {
    k.wrapping_mul(first).rotate_left(turn).wrapping_mul(second)
}

fn avalanche(mut k: u64) -> u64 {
    k = (k ^ (k >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
    k = (k ^ (k >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    k ^ (k >> 33)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The function's own verification: the digest of the digests of 0, 01, 0102, ... under seeds 256, 255, ...
    #[test]
    fn it_is_murmur3() {
        let key: Vec<u8> = (0..=255).collect();
        let mut all = Hasher::default();
        for n in 0..256 {
            let mut one = Hasher { state: [256 - n as u64; 2], ..Hasher::default() };
            one.bytes(&key[..n]);
            all.digest(one.finish());
        }
        assert_eq!(all.finish().0 as u32, 0x6384_ba69);
    }

    #[test]
    fn digests_are_written_and_read() {
        let digest = Digest::of(b"anim");
        assert_eq!(digest.to_string().parse(), Ok(digest));
        assert_eq!(Digest(10).to_string(), "0000000000000000000000000000000a");
        for wrong in ["", "0a", "+000000000000000000000000000000a", "0000000000000000000000000000000A"] {
            assert_eq!(wrong.parse::<Digest>(), Err(()));
        }
    }

    proptest! {
        #[test]
        fn pieces_make_no_difference(bytes in prop::collection::vec(any::<u8>(), 0..80), cut in 0usize..80) {
            let cut = cut.min(bytes.len());
            let mut pieces = Hasher::default();
            pieces.bytes(&bytes[..cut]);
            pieces.bytes(&bytes[cut..]);
            prop_assert_eq!(pieces.finish(), Digest::of(&bytes));
        }
    }
}
