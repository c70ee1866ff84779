//! Colour transfer between linear light and the sRGB curve (IEC 61966-2-1).

use std::sync::LazyLock;

/// sRGB encoding of a linear value; input is clamped to 0..1, NaN counts as 0.
pub fn srgb_encode(linear: f32) -> f32 {
    let x = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * libm::powf(x, 1.0 / 2.4) - 0.055 }
}

/// The byte that stands for a linear value, clamped to 0..1: `srgb_encode(x) * 255`, rounded to nearest.
///
/// Looked up among the least values of all bytes: a power for every channel of every pixel would take as long as a
/// tenth of a quick frame, and so would a search through all of them.
pub fn srgb_byte(linear: f32) -> u8 {
    if linear.is_nan() || linear <= 0.0 {
        return 0;
    }
    let bytes = &*BYTES;
    let step = (linear.min(1.0).to_bits().saturating_sub(DARK.to_bits()) >> STEP_BITS) as usize;
    let mut byte = usize::from(bytes.of_step[step]);
    while byte < 255 && bytes.least[byte] <= linear {
        byte += 1;
    }
    byte as u8
}

fn rounded_byte(linear: f32) -> u8 {
    (srgb_encode(linear) * 255.0 + 0.5) as u8
}

/// A value that rounds to 0; from there to 1 are [`STEPS`] steps, hardly ever with more than two bytes in one.
const DARK: f32 = 1.0 / 8192.0;

/// Bits of a float that tell where in its step it lies.
const STEP_BITS: u32 = 16;

const STEPS: usize = ((1.0f32.to_bits() - DARK.to_bits()) >> STEP_BITS) as usize;

struct Bytes {
    /// The least linear value that rounds to 1, to 2, and so on to 255.
    least: [f32; 255],
    /// The byte of the least value of each step.
    of_step: [u8; STEPS + 1],
}

static BYTES: LazyLock<Bytes> = LazyLock::new(|| {
    let least = |i: usize| {
        // Bits of floats from 0 to 1 are in the order of the floats.
        let (mut below, mut reached) = (0, 1.0f32.to_bits());
        while reached - below > 1 {
            let middle = below.midpoint(reached);
            let there = usize::from(rounded_byte(f32::from_bits(middle))) > i;
            *if there { &mut reached } else { &mut below } = middle;
        }
        f32::from_bits(reached)
    };
    let first = |step: usize| rounded_byte(f32::from_bits(DARK.to_bits() + ((step as u32) << STEP_BITS)));
    Bytes { least: std::array::from_fn(least), of_step: std::array::from_fn(first) }
});

/// Linear value of an sRGB-encoded one in 0..1.
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { libm::powf((encoded + 0.055) / 1.055, 2.4) }
}

/// A colour as the screen shows it, `#ff8800`, in linear light.
pub fn from_hex(text: &str) -> Option<[f32; 3]> {
    let digits = text.trim().strip_prefix('#')?;
    if digits.len() != 6 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let channel = |i: usize| u8::from_str_radix(&digits[i..i + 2], 16).ok().map(|x| srgb_decode(f32::from(x) / 255.0));
    Some([channel(0)?, channel(2)?, channel(4)?])
}

/// Relative luminance of linear Rec. 709 primaries.
pub fn luminance(rgb: [f32; 3]) -> f32 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looked_up_bytes_are_the_rounded_ones() {
        for (i, least) in BYTES.least.iter().enumerate() {
            for x in [least.next_down().next_down(), least.next_down(), *least, least.next_up()] {
                assert_eq!(srgb_byte(x), rounded_byte(x), "{i} {x}");
            }
        }
        for i in -1_000..101_000 {
            let x = i as f32 * 1e-5;
            assert_eq!(srgb_byte(x), rounded_byte(x), "{x}");
        }
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, f32::MAX, 1e-45] {
            assert_eq!(srgb_byte(x), rounded_byte(x), "{x}");
        }
    }

    #[test]
    fn the_curve_has_its_published_values_and_comes_back() {
        assert_eq!(srgb_encode(-1.0), 0.0);
        assert_eq!(srgb_encode(f32::NAN), 0.0);
        assert!((srgb_encode(1.0) - 1.0).abs() < 1e-6);
        assert!((srgb_encode(0.214_041) - 0.5).abs() < 1e-4);
        for i in 0..=255 {
            let x = i as f32 / 255.0;
            assert!((srgb_encode(srgb_decode(x)) - x).abs() < 1e-5);
        }
    }
}
