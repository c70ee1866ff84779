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

/// The linear colour of a body that glows at a temperature in kelvin, of luminance 1: Planck's law seen by the CIE 1931
/// observer, as Wyman, Sloan and Shirley (JCGT 2013) approximate it. What lies outside of the screen's colours is cut off.
pub fn black_body(kelvin: f64) -> [f64; 3] {
    let mut xyz = [0.0; 3];
    for nanometers in (380..=780).step_by(5) {
        let length = f64::from(nanometers);
        // In units in which h c / k is 14387769 nm K; its scale cancels.
        let radiance = 1.0 / (libm::pow(length / 560.0, 5.0) * libm::expm1(14_387_769.0 / (length * kelvin)));
        for (sum, matching) in xyz.iter_mut().zip(observer(length)) {
            *sum += radiance * matching;
        }
    }
    let [x, y, z] = xyz.map(|sum| sum / xyz[1]);
    let rgb = [
        3.240_454_2 * x - 1.537_138_5 * y - 0.498_531_4 * z,
        -0.969_266 * x + 1.876_010_8 * y + 0.041_556 * z,
        0.055_643_4 * x - 0.204_025_9 * y + 1.057_225_2 * z,
    ];
    rgb.map(|channel| channel.max(0.0))
}

/// The colour matching functions of the CIE 1931 observer at a wave length in nanometres.
fn observer(length: f64) -> [f64; 3] {
    let lobe = |middle: f64, [below, above]: [f64; 2]| {
        let off = (length - middle) * if length < middle { below } else { above };
        libm::exp(-0.5 * off * off)
    };
    [
        0.362 * lobe(442.0, [0.0624, 0.0374]) + 1.056 * lobe(599.8, [0.0264, 0.0323])
            - 0.065 * lobe(501.1, [0.0490, 0.0382]),
        0.821 * lobe(568.8, [0.0213, 0.0247]) + 0.286 * lobe(530.9, [0.0613, 0.0322]),
        1.217 * lobe(437.0, [0.0845, 0.0278]) + 0.681 * lobe(459.0, [0.0385, 0.0725]),
    ]
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

    /// Chromaticities of the Planckian locus from tables: illuminant A, and 6500 and 10000 K.
    #[test]
    fn glowing_bodies_have_the_colours_of_the_tables() {
        for (kelvin, [x, y]) in [(2_856.0, [0.4476, 0.4074]), (6_500.0, [0.3135, 0.3237]), (10_000.0, [0.2807, 0.2884])]
        {
            let [r, g, b] = black_body(kelvin);
            let xyz = [
                0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b,
                0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b,
                0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b,
            ];
            let sum: f64 = xyz.iter().sum();
            assert!((xyz[1] - 1.0).abs() < 1e-3, "{kelvin}: {xyz:?}");
            assert!((xyz[0] / sum - x).abs() < 3e-3 && (xyz[1] / sum - y).abs() < 3e-3, "{kelvin}: {xyz:?}");
        }
    }
}
