//! Inputs from a seed and a number: a seed of the corpus with some things changed in it.

/// SplitMix64 (Steele, Lea and Flood, OOPSLA 2014).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64, number: u64) -> Self {
        let mut random = Random(seed ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        random.next();
        random
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 up to a number, which it does not reach.
    pub fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }
}

/// Numbers at the edges of what numbers can be.
const NUMBERS: [&str; 22] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "1e-320",
    "1e308",
    "-1e39",
    "3.4e38",
    "1e9",
    "1.00000001e9",
    "255",
    "256",
    "65536",
    "2147483647",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551616",
    "NaN",
    "inf",
    "1e999",
    ".5",
];
/// The longest that an input may grow: what is slow by its size alone is no finding.
const LONGEST: usize = 1 << 16;
/// Changes made in one input at most.
const MOST_CHANGES: usize = 8;

/// The input of a number.
pub fn input(seeds: &[Vec<u8>], words: &[&str], seed: u64, number: u64) -> Vec<u8> {
    if let Some(untouched) = usize::try_from(number).ok().and_then(|number| seeds.get(number)) {
        return untouched.clone();
    }
    let mut random = Random::new(seed, number);
    let mut bytes = seeds[random.below(seeds.len())].clone();
    for _ in 0..=random.below(MOST_CHANGES) {
        change(&mut bytes, seeds, words, &mut random);
    }
    bytes.truncate(LONGEST);
    bytes
}

fn change(bytes: &mut Vec<u8>, seeds: &[Vec<u8>], words: &[&str], random: &mut Random) {
    let at = random.below(bytes.len() + 1);
    let bits = random.below(9);
    let length = 1 + random.below(1 << bits);
    let end = (at + length).min(bytes.len());
    match random.below(10) {
        0 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
        1 if at < bytes.len() => bytes[at] = random.next() as u8,
        2 => bytes.truncate(at),
        3 => drop(bytes.drain(at..end)),
        4 => {
            let part = bytes[at..end].to_vec();
            let to = random.below(bytes.len() + 1);
            bytes.splice(to..to, part);
        }
        5 => {
            let other = &seeds[random.below(seeds.len())];
            let from = random.below(other.len() + 1);
            let part = other[from..(from + length).min(other.len())].to_vec();
            bytes.splice(at..end, part);
        }
        6 | 7 => change_number(bytes, at, NUMBERS[random.below(NUMBERS.len())]),
        8 if !words.is_empty() => {
            let word = words[random.below(words.len())].bytes();
            bytes.splice(at..at, word);
        }
        // A number of four bytes, as sizes are in binary files.
        _ => {
            let values = [0, 1, 0x7f, 0xff, 0xffff, 0x7fff_ffff, 0x8000_0000, u32::MAX];
            let value = values[random.below(values.len())];
            let value = if random.below(2) == 0 { value.to_le_bytes() } else { value.to_be_bytes() };
            bytes.splice(at..(at + 4).min(bytes.len()), value);
        }
    }
}

/// Puts another number in the place of the next one that is written out.
fn change_number(bytes: &mut Vec<u8>, at: usize, number: &str) {
    let is_part = |byte: &u8| byte.is_ascii_digit() || b".-+eE".contains(byte);
    let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit).map(|start| at + start) else { return };
    let end = bytes[start..].iter().position(|byte| !is_part(byte)).map_or(bytes.len(), |length| start + length);
    bytes.splice(start..end, number.bytes());
}
