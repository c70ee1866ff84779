//! Linear light of any size -> what a screen can show: exposure, then a tone curve.
//!
//! Everything here is IEEE arithmetic and `libm`: the same bytes on every machine.

use crate::base::color::{luminance, srgb_byte, srgb_encode};
use crate::components::{Render, ToneMap, Transfer};

/// From the linear values of a film to the numbers of a picture for the screen: exposure, tone map, transfer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplayTransform {
    /// Factor before the curve: 2 to the power of the stops.
    gain: f32,
    tone_map: ToneMap,
    transfer: Transfer,
    dither: bool,
}

/// Values above this look the same on every curve, and their squares stay inside `f32`.
const BRIGHTEST: f32 = 1e6;

impl DisplayTransform {
    /// The transform that the settings ask for.
    pub fn new(render: &Render) -> Self {
        let gain = libm::exp2(render.exposure) as f32;
        DisplayTransform { gain, tone_map: render.tone_map, transfer: render.transfer, dither: render.dither }
    }

    /// The linear value to show, mostly in 0..1; what lies outside is cut off when it is encoded.
    pub fn expose(&self, color: [f32; 3]) -> [f32; 3] {
        let exposed = color.map(|x| x * self.gain);
        match self.tone_map {
            ToneMap::Clip => exposed,
            ToneMap::Reinhard => reinhard(bounded(exposed)),
            ToneMap::Aces => aces(bounded(exposed)),
            ToneMap::AgX => agx(bounded(exposed)),
            ToneMap::Neutral => neutral(bounded(exposed)),
        }
    }

    /// A channel of 8 bits, from an exposed value.
    pub fn byte(&self, x: f32) -> u8 {
        match self.transfer {
            Transfer::Srgb => srgb_byte(x),
            Transfer::Linear => (self.encode(x) * 255.0 + 0.5) as u8,
        }
    }

    /// Whether pictures of 8 bits are dithered.
    pub fn dithers(&self) -> bool {
        self.dither
    }

    /// A channel of 8 bits, from an exposed value: the code above what lies above the threshold between two codes.
    pub fn dithered_byte(&self, x: f32, threshold: f32) -> u8 {
        let code = self.encode(x) * 255.0;
        // What is a code but for rounding stays one.
        let nearest = (code + 0.5) as u8;
        if (code - f32::from(nearest)).abs() < 1e-4 { nearest } else { (code + threshold) as u8 }
    }

    /// A channel of 16 bits, from an exposed value.
    pub fn word(&self, x: f32) -> u16 {
        (self.encode(x) * 65535.0 + 0.5) as u16
    }

    fn encode(&self, x: f32) -> f32 {
        match self.transfer {
            Transfer::Srgb => srgb_encode(x),
            Transfer::Linear if x > 0.0 => x.min(1.0),
            Transfer::Linear => 0.0,
        }
    }
}

/// Within what the curves are made for; not a number counts as 0.
fn bounded(color: [f32; 3]) -> [f32; 3] {
    color.map(|x| if x > 0.0 { x.min(BRIGHTEST) } else { 0.0 })
}

/// Rows of a matrix times a colour.
fn times(rows: &[[f32; 3]; 3], [r, g, b]: [f32; 3]) -> [f32; 3] {
    rows.map(|row| row[0] * r + row[1] * g + row[2] * b)
}

fn reinhard(color: [f32; 3]) -> [f32; 3] {
    let scale = 1.0 / (1.0 + luminance(color));
    color.map(|x| x * scale)
}

/// sRGB primaries to ACES AP1 with the saturation of the reference rendering transform.
const ACES_IN: [[f32; 3]; 3] =
    [[0.597_19, 0.354_58, 0.048_23], [0.076_00, 0.908_34, 0.015_66], [0.028_40, 0.133_83, 0.837_77]];
/// The saturation of the output transform, and back to sRGB primaries.
const ACES_OUT: [[f32; 3]; 3] =
    [[1.604_75, -0.531_08, -0.073_67], [-0.102_08, 1.108_13, -0.006_05], [-0.003_27, -0.072_76, 1.076_02]];

fn aces(color: [f32; 3]) -> [f32; 3] {
    let curve = |v: f32| (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081);
    times(&ACES_OUT, times(&ACES_IN, color).map(curve))
}

/// Towards grey before the curve, so that bright colours fade, and back after it; rows sum to one.
const AGX_IN: [[f32; 3]; 3] = [
    [0.842_479_06, 0.078_433_6, 0.079_223_745],
    [0.042_328_24, 0.878_468_6, 0.079_166_13],
    [0.042_375_655, 0.078_433_6, 0.879_143],
];
const AGX_OUT: [[f32; 3]; 3] = [
    [1.196_879, -0.098_020_88, -0.099_029_74],
    [-0.052_896_85, 1.151_903_1, -0.098_961_18],
    [-0.052_971_64, -0.098_043_45, 1.151_073_7],
];
/// Range of the logarithmic encoding, in stops around 1.
const AGX_STOPS: [f32; 2] = [-12.473_93, 4.026_069];

fn agx(color: [f32; 3]) -> [f32; 3] {
    let [low, high] = AGX_STOPS;
    let curve = |v: f32| {
        let stops = if v > 0.0 { libm::log2f(v).clamp(low, high) } else { low };
        let x = (stops - low) / (high - low);
        let (x2, x4) = (x * x, x * x * x * x);
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.002_32
    };
    // The curve gives values for a screen of gamma 2.2; the film goes on in linear light.
    times(&AGX_OUT, times(&AGX_IN, color).map(curve)).map(|x| libm::powf(x.max(0.0), 2.2))
}

/// Where compression starts: the base colour 0.8 less the reflection of a dielectric, 0.04.
const NEUTRAL_KNEE: f32 = 0.8 - 0.04;
const NEUTRAL_DESATURATION: f32 = 0.15;

fn neutral(color: [f32; 3]) -> [f32; 3] {
    let least = color[0].min(color[1]).min(color[2]);
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let color = color.map(|x| x - offset);
    let peak = color[0].max(color[1]).max(color[2]);
    if peak < NEUTRAL_KNEE {
        return color;
    }
    let room = 1.0 - NEUTRAL_KNEE;
    let lowered = 1.0 - room * room / (peak + room - NEUTRAL_KNEE);
    let fade = 1.0 - 1.0 / (NEUTRAL_DESATURATION * (peak - lowered) + 1.0);
    color.map(|x| x * (lowered / peak) * (1.0 - fade) + lowered * fade)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn display(tone_map: ToneMap, exposure: f64) -> DisplayTransform {
        DisplayTransform::new(&Render { tone_map, exposure, ..Render::default() })
    }

    fn grey(tone_map: ToneMap, x: f32) -> f32 {
        let [r, g, b] = display(tone_map, 0.0).expose([x; 3]);
        assert!((r - g).abs() < 2e-3 && (g - b).abs() < 2e-3, "{tone_map:?} {x}: {r} {g} {b}");
        g
    }

    const CURVES: [ToneMap; 4] = [ToneMap::Reinhard, ToneMap::Aces, ToneMap::AgX, ToneMap::Neutral];

    #[test]
    fn curves_rise_from_black_towards_white() {
        for tone_map in CURVES {
            assert!(grey(tone_map, 0.0).abs() < 1e-3, "{tone_map:?}");
            let mut last = -1.0;
            for step in -80..80 {
                let now = grey(tone_map, libm::exp2f(step as f32 / 8.0));
                // The fit of AgX ends with a touch of a fall, far below one part of 255.
                assert!(now >= last - 1e-3 && now < 1.03, "{tone_map:?} {step}: {last} {now}");
                last = now;
            }
            assert!(last > 0.95, "{tone_map:?} {last}");
        }
    }

    #[test]
    fn middle_grey_has_its_published_values() {
        assert!((grey(ToneMap::Reinhard, 0.18) - 0.18 / 1.18).abs() < 1e-6);
        // Hill's rational function at 0.18, by hand.
        let v = 0.18f64;
        let hill = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
        assert!((f64::from(grey(ToneMap::Aces, 0.18)) - hill).abs() < 1e-3);
        // AgX keeps middle grey near where it was: 0.18 comes out as about a fifth.
        assert!((grey(ToneMap::AgX, 0.18) - 0.2).abs() < 0.03, "{}", grey(ToneMap::AgX, 0.18));
        assert!((grey(ToneMap::Neutral, 0.18) - 0.14).abs() < 1e-6);
    }

    #[test]
    fn neutral_only_shifts_what_lies_below_its_knee() {
        let kept = display(ToneMap::Neutral, 0.0).expose([0.5, 0.3, 0.1]);
        for (found, expected) in kept.iter().zip([0.46, 0.26, 0.06]) {
            assert!((found - expected).abs() < 1e-6);
        }
        // Continuous at the knee, and never at or above 1.
        let (below, above) = (grey(ToneMap::Neutral, 0.799_999), grey(ToneMap::Neutral, 0.800_001));
        assert!((above - below).abs() < 1e-5);
        assert!(display(ToneMap::Neutral, 0.0).expose([900.0, 4.0, 0.0]).iter().all(|x| *x < 1.0));
    }

    #[test]
    fn a_stop_doubles_and_nothing_is_no_number() {
        assert_eq!(display(ToneMap::Clip, 1.0).expose([0.25, 0.5, 4.0]), [0.5, 1.0, 8.0]);
        assert_eq!(display(ToneMap::Clip, 0.0).expose([0.1, 0.2, 0.3]), [0.1, 0.2, 0.3]);
        for tone_map in CURVES {
            for wild in [f32::NAN, f32::INFINITY, -1.0, f32::MAX] {
                let shown = display(tone_map, 3.0).expose([wild, 0.5, 0.0]);
                assert!(shown.iter().all(|x| x.is_finite()), "{tone_map:?} {wild}: {shown:?}");
            }
        }
    }
}
