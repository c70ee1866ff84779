//! Procedural textures, averaged over a footprint by their integrals.

use glam::Vec3;

use super::noise::octaves;
use crate::components::{Pattern, TexelFilter, Texture};

/// A pattern ready to be looked up.
#[derive(Clone, Debug, PartialEq)]
pub struct PatternSampler {
    pattern: Pattern,
    ramp: ColorRamp,
    octaves: u32,
    displacement: f32,
    filtered: bool,
}

/// Narrower than this share of a period, a mean is the value: their difference would be lost in rounding.
const NARROW: f32 = 1e-3;

/// Wider than this many periods, a mean is that of the whole.
const WIDE: f32 = 1e4;

/// Cells begin this share of a period before their numbers: a face that lies on a border is in one cell, not in both.
const HAIR: f32 = 1e-4;

impl PatternSampler {
    pub fn new(texture: &Texture, pattern: Pattern) -> Self {
        let colors: Vec<Vec3> = texture.colors.iter().map(|c| c.as_vec3()).collect();
        let ramp = match pattern {
            Pattern::Checker | Pattern::Stripes => ColorRamp::bands(&colors),
            Pattern::Marble | Pattern::Wood => ColorRamp::there_and_back(&colors),
            Pattern::Noise => ColorRamp::once(&colors),
        };
        PatternSampler {
            pattern,
            ramp,
            octaves: texture.octaves,
            displacement: texture.displacement() as f32,
            filtered: texture.filter == TexelFilter::Mip,
        }
    }

    /// The mean colour around `p` over a footprint with these axes.
    pub fn color(&self, mut p: Vec3, axes: [Vec3; 2]) -> Vec3 {
        let (mut widths, mut width) = (Vec3::ZERO, 0.0);
        if self.filtered {
            let [a, b] = axes;
            widths = (a * a + b * b).map(f32::sqrt);
            width = a.length().max(b.length());
        }
        if self.displacement > 0.0 {
            p += self.displaced(p, width) * self.displacement;
        }
        match self.pattern {
            Pattern::Checker => {
                let side = |x: f32, w: f32| square_wave(x + HAIR, w);
                let s = side(p.x, widths.x) * side(p.y, widths.y) * side(p.z, widths.z);
                self.ramp.value(0.25) * (0.5 + 0.5 * s) + self.ramp.value(0.75) * (0.5 - 0.5 * s)
            }
            Pattern::Stripes => self.ramp.mean(p.x + HAIR, widths.x),
            Pattern::Marble => self.ramp.mean(p.x, widths.x),
            Pattern::Wood => self.ramp.mean((p.x * p.x + p.z * p.z).sqrt(), widths.x.max(widths.z)),
            Pattern::Noise => self.ramp.value((0.5 + 0.6 * octaves(p, self.octaves, width)).clamp(0.0, 1.0)),
        }
    }

    /// Noise along the axes that matter to the pattern.
    fn displaced(&self, p: Vec3, width: f32) -> Vec3 {
        let along = |shift: f32| octaves(p + Vec3::splat(shift), self.octaves, width);
        match self.pattern {
            Pattern::Stripes | Pattern::Marble => Vec3::new(along(0.0), 0.0, 0.0),
            Pattern::Wood => Vec3::new(along(0.0), 0.0, along(31.7)),
            Pattern::Checker | Pattern::Noise => Vec3::new(along(0.0), along(17.3), along(31.7)),
        }
    }
}

/// The mean around `x`, over a width, of a wave that is 1 in the first half of every unit and -1 in the second.
fn square_wave(x: f32, width: f32) -> f32 {
    if width < NARROW {
        return if x - x.floor() < 0.5 { 1.0 } else { -1.0 };
    }
    if width > WIDE {
        return 0.0;
    }
    let integral = |x: f32| {
        let f = x - x.floor();
        f.min(1.0 - f)
    };
    let start = x - 0.5 * width;
    let start = start - start.floor();
    (integral(start + width) - integral(start)) / width
}

/// Colours over 0..1, straight between knots, and their integral.
#[derive(Clone, Debug, PartialEq)]
struct ColorRamp {
    /// At the start of each piece: colour, change of the colour over the piece, and integral up to there.
    pieces: Vec<[Vec3; 3]>,
    total: Vec3,
}

impl ColorRamp {
    fn new(ends: impl Iterator<Item = [Vec3; 2]> + Clone) -> Self {
        let share = 1.0 / ends.clone().count() as f32;
        let mut total = Vec3::ZERO;
        let piece = |[start, end]: [Vec3; 2]| {
            let before = total;
            total += (start + end) * (0.5 * share);
            [start, end - start, before]
        };
        let pieces = ends.map(piece).collect();
        ColorRamp { pieces, total }
    }

    fn bands(colors: &[Vec3]) -> Self {
        Self::new(colors.iter().map(|c| [*c, *c]))
    }

    fn once(colors: &[Vec3]) -> Self {
        Self::new(colors.windows(2).map(|pair| [pair[0], pair[1]]))
    }

    fn there_and_back(colors: &[Vec3]) -> Self {
        let there = colors.windows(2).map(|pair| [pair[0], pair[1]]);
        Self::new(there.clone().chain(there.rev().map(|[start, end]| [end, start])))
    }

    /// The piece that `x` in 0..1 lies in, and how far along it, 0..1.
    fn place(&self, x: f32) -> (&[Vec3; 3], f32) {
        let along = x * self.pieces.len() as f32;
        let i = (along as usize).min(self.pieces.len() - 1);
        (&self.pieces[i], along - i as f32)
    }

    fn value(&self, x: f32) -> Vec3 {
        let ([start, change, _], s) = self.place(x);
        *start + *change * s
    }

    /// Integral from 0, of the ramp repeated for ever.
    fn integral(&self, x: f32) -> Vec3 {
        let whole = x.floor();
        let ([start, change, before], s) = self.place(x - whole);
        *before + (*start + *change * (0.5 * s)) * (s / self.pieces.len() as f32) + self.total * whole
    }

    /// The mean around `x`, over a width, of the ramp repeated for ever.
    fn mean(&self, x: f32, width: f32) -> Vec3 {
        if width < NARROW {
            return self.value(x - x.floor());
        }
        if width > WIDE {
            return self.total;
        }
        let start = x - 0.5 * width;
        let start = start - start.floor();
        (self.integral(start + width) - self.integral(start)) / width
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn motif(pattern: Pattern) -> PatternSampler {
        let colors = match pattern {
            Pattern::Checker => vec![DVec3::ZERO, DVec3::new(1.0, 0.5, 0.25)],
            _ => vec![DVec3::ZERO, DVec3::new(1.0, 0.5, 0.25), DVec3::splat(0.1)],
        };
        let turbulence = Some(0.0);
        PatternSampler::new(&Texture { pattern: Some(pattern), colors, turbulence, ..Texture::default() }, pattern)
    }

    /// Means by the integral against means of many points, along an axis and over squares.
    #[test]
    fn patterns_are_averaged_exactly() {
        for pattern in [Pattern::Checker, Pattern::Stripes, Pattern::Marble] {
            let motif = motif(pattern);
            for (x, y, wide, tall) in [(0.13, 0.4, 0.3, 0.2), (0.9, -3.2, 1.7, 0.01), (7.3, 0.02, 0.05, 3.1)] {
                let axes = [Vec3::X * wide, Vec3::Y * tall];
                let found = motif.color(Vec3::new(x, y, 0.1), axes);
                let n = 400;
                let mut sum = Vec3::ZERO;
                for i in 0..n * n {
                    let at = |k: i32, w: f32| ((k as f32 + 0.5) / n as f32 - 0.5) * w;
                    let p = Vec3::new(x + at(i % n, wide), y + at(i / n, tall), 0.1);
                    sum += motif.color(p, [Vec3::ZERO; 2]);
                }
                let expected = sum / (n * n) as f32;
                assert!((found - expected).abs().max_element() < 5e-3, "{pattern:?} {x}: {found} {expected}");
            }
        }
    }

    #[test]
    fn wide_footprints_show_the_mean() {
        let far = [Vec3::X * 900.0, Vec3::Y * 900.0 + Vec3::Z * 700.0];
        let grey = motif(Pattern::Checker).color(Vec3::new(0.2, 0.3, 0.1), far);
        assert!((grey - Vec3::new(0.5, 0.25, 0.125)).abs().max_element() < 1e-3);
        let wood = motif(Pattern::Wood).color(Vec3::new(0.2, 0.3, 0.1), far);
        assert!((wood - motif(Pattern::Wood).ramp.total).abs().max_element() < 1e-3);
        let noise = motif(Pattern::Noise).color(Vec3::new(0.2, 0.3, 0.1), far);
        assert_eq!(noise, motif(Pattern::Noise).ramp.value(0.5));
        for pattern in [Pattern::Checker, Pattern::Stripes, Pattern::Marble, Pattern::Wood, Pattern::Noise] {
            assert!(motif(pattern).color(Vec3::splat(1e20), [Vec3::splat(1e30); 2]).is_finite());
        }
    }

    #[test]
    fn rings_and_bands_lie_where_they_are_said_to() {
        let wood = motif(Pattern::Wood);
        let ring = |x, y, z| wood.color(Vec3::new(x, y, z), [Vec3::ZERO; 2]);
        assert_eq!(ring(0.25, 0.0, 0.0), ring(0.0, 5.0, 0.25));
        assert!((ring(0.25, 0.0, 0.0) - Vec3::new(1.0, 0.5, 0.25)).length() < 1e-5);
        let checker = motif(Pattern::Checker);
        let cell = |x, y| checker.color(Vec3::new(x, y, 0.0), [Vec3::ZERO; 2]);
        assert_eq!(cell(0.25, 0.25), Vec3::ZERO);
        assert_eq!(cell(0.75, 0.25), Vec3::new(1.0, 0.5, 0.25));
        assert_eq!(cell(0.75, 0.75), Vec3::ZERO);
        // On the border of two cells, whatever the rounding.
        assert_eq!(cell(0.25, 1e-7), cell(0.25, -1e-7));
    }
}
