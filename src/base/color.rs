//! Colour transfer between linear light and the sRGB curve (IEC 61966-2-1).

/// sRGB encoding of a linear value; input is clamped to 0..1, NaN counts as 0.
pub fn srgb_encode(linear: f32) -> f32 {
    let x = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * libm::powf(x, 1.0 / 2.4) - 0.055 }
}

/// Linear value of an sRGB-encoded one in 0..1.
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { libm::powf((encoded + 0.055) / 1.055, 2.4) }
}

/// Relative luminance of linear Rec. 709 primaries.
pub fn luminance(rgb: [f32; 3]) -> f32 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

#[cfg(test)]
mod tests {
    use super::*;

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
