//! Warps: from the unit square to disks, hemispheres, spheres and triangles, and the axes around a normal.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::Vec3;

use crate::base::math::sin_cos_degrees;
use crate::trace::simd::{Lanes, V3};

/// Maps the unit square to the unit disk, keeping strata compact (Shirley and Chiu 1997).
#[inline(always)]
pub fn concentric_disk<L: Lanes>([x, y]: [L; 2]) -> [L; 2] {
    let (one, two) = (L::splat(1.0), L::splat(2.0));
    let (a, b) = (two * x - one, two * y - one);
    let wide = b.abs().lt(a.abs());
    let (r, rest) = (L::select(wide, a, b), L::select(wide, b, a));
    let zero = L::splat(0.0);
    let [sin, cos] = sin_cos(L::select(r.ne(zero), rest / r, zero) * L::splat(std::f32::consts::FRAC_PI_4));
    // In the upper and lower quarters the angle counts from the other axis.
    [r * L::select(wide, cos, sin), r * L::select(wide, sin, cos)]
}

/// Sine and cosine of angles within an eighth of a turn (the polynomials of Moshier's Cephes).
#[inline(always)]
pub(super) fn sin_cos<L: Lanes>(x: L) -> [L; 2] {
    let z = x * x;
    let sin = square([-1.951_529_6e-4, 8.332_161e-3, -1.666_665_5e-1], z) * z * x + x;
    let cos = square([2.443_315_7e-5, -1.388_731_6e-3, 4.166_664_6e-2], z) * z * z;
    [sin, cos - L::splat(0.5) * z + L::splat(1.0)]
}

/// Sine and cosine of half turns, from -1 to 1 and a little beyond.
#[inline(always)]
pub fn sin_cos_half_turns<L: Lanes>(x: L) -> [L; 2] {
    let (one, two) = (L::splat(1.0), L::splat(2.0));
    let [mut sin, mut cos] = sin_cos(x * L::splat(std::f32::consts::FRAC_PI_4));
    // The angle is doubled twice.
    for _ in 0..2 {
        (sin, cos) = (two * sin * cos, one - two * sin * sin);
    }
    [sin, cos]
}

/// The regular polygon in the unit circle that an iris with blades opens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iris {
    blades: f32,
    /// Two corners that follow each other.
    corners: [[f32; 2]; 2],
}

impl Iris {
    /// `blades` are 3 at least; `angle` turns them, in degrees, from a corner at the top.
    pub fn new(blades: u32, angle: f64) -> Self {
        // Points are turned by half a turn less than they should be: see `point`.
        let corner = |i: f64| {
            let (sin, cos) = sin_cos_degrees(angle - 90.0 + i * 360.0 / f64::from(blades));
            [cos as f32, sin as f32]
        };
        Iris { blades: blades as f32, corners: [corner(0.0), corner(1.0)] }
    }

    /// Maps the unit square to the polygon, evenly by area.
    #[inline(always)]
    pub fn point<L: Lanes>(&self, [x, y]: [L; 2]) -> [L; 2] {
        let one = L::splat(1.0);
        // Numbers of this size have no fractions: adding one rounds.
        let whole = L::splat(12_582_912.0);
        let along = x * L::splat(self.blades);
        let sector = (along - L::splat(0.5) + whole) - whole;
        let radius = (along - sector).max(L::splat(0.0)).sqrt();
        let [a, b] = self.corners;
        let [px, py] = [0, 1].map(|i| radius * ((one - y) * L::splat(a[i]) + y * L::splat(b[i])));
        let [sin, cos] = sin_cos_half_turns(sector * L::splat(2.0 / self.blades) - one);
        [px * cos - py * sin, px * sin + py * cos]
    }
}

/// A polynomial of the second degree.
#[inline(always)]
fn square<L: Lanes>([a, b, c]: [f32; 3], z: L) -> L {
    (L::splat(a) * z + L::splat(b)) * z + L::splat(c)
}

/// A direction by the cosine over the upper hemisphere.
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    cosine_directions(u).into()
}

/// As [`cosine_hemisphere`].
#[inline(always)]
pub fn cosine_directions<L: Lanes>(u: [L; 2]) -> V3<L> {
    let [x, y] = concentric_disk(u);
    V3 { x, y, z: (L::splat(1.0) - x * x - y * y).max(L::splat(0.0)).sqrt() }
}

/// Density of [`cosine_hemisphere`] per steradian.
#[inline]
pub fn cosine_pdf(wi: Vec3) -> f32 {
    wi.z.max(0.0) * FRAC_1_PI
}

/// Axes of a surface: z along the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Unit, along the surface.
    pub x: Vec3,
    /// Unit, along the surface, across `x`.
    pub y: Vec3,
    /// Unit, the normal.
    pub z: Vec3,
}

impl Frame {
    /// `normal` is unit.
    #[inline]
    pub fn new(normal: Vec3) -> Self {
        let [x, y] = tangents(V3::<f32>::from(normal));
        Frame { x: x.into(), y: y.into(), z: normal }
    }

    /// A vector of the world in these axes.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }

    /// A vector of these axes in the world.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

/// Two axes across a unit normal (Duff et al., Building an Orthonormal Basis, Revisited, JCGT 2017).
#[inline(always)]
pub fn tangents<L: Lanes>(normal: V3<L>) -> [V3<L>; 2] {
    let V3 { x, y, z } = normal;
    let one = L::splat(1.0);
    let sign = L::select(z.lt(L::splat(0.0)), -one, one);
    let a = -one / (sign + z);
    let b = x * y * a;
    [V3 { x: one + sign * x * x * a, y: sign * b, z: -sign * x }, V3 { x: b, y: sign + y * y * a, z: -y }]
}

/// A uniform direction around z for two numbers: radius in the plane and height are given by `z`.
pub fn around(z: f32, turn: f32) -> Vec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = libm::sincosf(2.0 * PI * turn);
    Vec3::new(r * cos, r * sin, z)
}

/// Uniform point on the unit sphere.
pub fn uniform_sphere([x, y]: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = libm::sincosf(std::f32::consts::TAU * y);
    Vec3::new(r * cos, r * sin, z)
}

/// Weights of the second and third corner, evenly by area and with little distortion (Heitz 2019).
pub fn in_triangle([x, y]: [f32; 2]) -> [f32; 2] {
    if y > x { [0.5 * x, y - 0.5 * x] } else { [x - 0.5 * y, 0.5 * y] }
}

/// Weight of light that a ray found by itself, where lights were sampled for it too: the power heuristic (Veach 1997,
/// section 9.2). 0 stands for a density of which there is none.
#[inline(always)]
pub fn power_heuristic<L: Lanes>(pdf: L, asked: L) -> L {
    let one = L::splat(1.0);
    // The smaller one is divided: no square can overflow.
    let ratio = asked / pdf;
    L::select(pdf.ne(L::splat(0.0)), one / (one + ratio * ratio), one)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_turns_have_their_sines_and_cosines() {
        for i in -100..=100 {
            let x = i as f32 / 100.0;
            let [sin, cos] = sin_cos_half_turns(x);
            let (s, c) = libm::sincos(std::f64::consts::PI * f64::from(x));
            assert!((f64::from(sin) - s).abs() < 1e-6 && (f64::from(cos) - c).abs() < 1e-6, "{x}: {sin} {cos}");
        }
    }

    #[test]
    fn an_iris_fills_its_polygon_evenly() {
        for (blades, angle) in [(3, 0.0), (5, 0.0), (6, 15.0), (8, -40.0)] {
            let iris = Iris::new(blades, angle);
            const N: usize = 64;
            let points: Vec<[f32; 2]> =
                (0..N * N).map(|i| iris.point([i % N, i / N].map(|i| (i as f32 + 0.5) / N as f32))).collect();
            // The middle of each side is this far from the center.
            let inner = libm::cosf(std::f32::consts::PI / blades as f32);
            for side in 0..blades {
                let (sin, cos) = sin_cos_degrees(angle + 90.0 + (f64::from(side) + 0.5) * 360.0 / f64::from(blades));
                let out = |p: &[f32; 2]| p[0] * cos as f32 + p[1] * sin as f32;
                let most = points.iter().map(out).fold(f32::NEG_INFINITY, f32::max);
                assert!(most < inner + 1e-5 && most > inner - 0.03, "{blades} {side}: {most} {inner}");
            }
            let center = points.iter().fold([0.0; 2], |sum, p| [sum[0] + p[0], sum[1] + p[1]]);
            assert!(center.iter().all(|x| x.abs() < 1e-2 * (N * N) as f32), "{center:?}");
            // The mean square of the distance of a regular polygon's points from its center: (2 + cos 2 pi / n) / 6.
            let mean = points.iter().map(|p| p[0] * p[0] + p[1] * p[1]).sum::<f32>() / (N * N) as f32;
            let expected = (2.0 + libm::cosf(std::f32::consts::TAU / blades as f32)) / 6.0;
            assert!((mean - expected).abs() < 2e-3, "{blades}: {mean} {expected}");
        }
    }
}
