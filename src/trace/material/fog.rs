//! Fog: a homogeneous medium in the air between bodies.

use std::f32::consts::PI;

use glam::Vec3;

use crate::trace::primitive::Bounds;
use crate::trace::sampler::{Frame, around};

/// Air that takes light, and scatters some of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FogMedium {
    /// Lost per unit of a way.
    pub density: f32,
    /// Share of what is lost that is scattered; the colour that things fade into where nothing is.
    pub color: Vec3,
    /// The mean cosine of scattering.
    pub anisotropy: f32,
    /// The box that it fills; everywhere if there is none.
    pub bounds: Option<Bounds>,
    /// Whether the light that it scatters is followed; else it fades into its colour.
    pub scatters: bool,
}

impl FogMedium {
    /// Where a ray that ends at `end` runs in it: two distances, the same ones if it does not.
    #[inline]
    pub fn span(&self, origin: Vec3, direction: Vec3, end: f32) -> [f32; 2] {
        let Some(Bounds { min, max }) = self.bounds else { return [0.0, end] };
        let (mut enter, mut leave) = (0.0f32, end);
        for axis in 0..3 {
            let (o, d) = (origin[axis], direction[axis]);
            if d == 0.0 {
                if o < min[axis] || o > max[axis] {
                    return [0.0; 2];
                }
                continue;
            }
            let (a, b) = ((min[axis] - o) / d, (max[axis] - o) / d);
            (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
        }
        if enter < leave { [enter, leave] } else { [0.0; 2] }
    }

    /// Share of light that gets through a way of a length within it.
    #[inline]
    pub fn through(&self, length: f32) -> f32 {
        libm::expf(-self.density * length)
    }

    /// Share of light that gets along a ray to its end.
    #[inline]
    pub fn transmittance(&self, origin: Vec3, direction: Vec3, end: f32) -> f32 {
        let [enter, leave] = self.span(origin, direction, end);
        self.through(leave - enter)
    }

    /// Density per steradian of scattering by an angle with this cosine (Henyey and Greenstein 1941).
    #[inline]
    pub fn phase(&self, cosine: f32) -> f32 {
        let g = self.anisotropy;
        let base = (1.0 + g * g - 2.0 * g * cosine).max(1e-6);
        (1.0 - g * g) / (4.0 * PI * base * base.sqrt())
    }

    /// A direction that light is scattered to, by that density.
    #[inline]
    pub fn scattered(&self, direction: Vec3, [x, y]: [f32; 2]) -> Vec3 {
        let g = self.anisotropy;
        let cosine = if g.abs() < 1e-3 {
            1.0 - 2.0 * x
        } else {
            let ratio = (1.0 - g * g) / (1.0 - g + 2.0 * g * x);
            ((1.0 + g * g - ratio * ratio) / (2.0 * g)).clamp(-1.0, 1.0)
        };
        Frame::new(direction).to_world(around(cosine, y)).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fog(anisotropy: f32) -> FogMedium {
        FogMedium { density: 0.5, color: Vec3::ONE, anisotropy, bounds: None, scatters: true }
    }

    #[test]
    fn directions_are_scattered_as_densely_as_the_phase_function_says() {
        for g in [-0.8, -0.3, 0.0, 5e-4, 0.4, 0.8] {
            let (fog, along) = (fog(g), Vec3::new(0.6, 0.0, 0.8));
            // The mean cosine is the anisotropy, and all densities together are 1.
            let (n, mut cosines, mut whole) = (200, 0.0, 0.0);
            for i in 0..n {
                for j in 0..n {
                    let u = [(i as f32 + 0.5) / n as f32, (j as f32 + 0.5) / n as f32];
                    let to = fog.scattered(along, u);
                    cosines += f64::from(along.dot(to)) / f64::from(n * n);
                    whole += f64::from(fog.phase(1.0 - 2.0 * u[0])) * 4.0 * std::f64::consts::PI / f64::from(n * n);
                }
            }
            assert!((cosines - f64::from(g)).abs() < 2e-3 && (whole - 1.0).abs() < 5e-2, "{g}: {cosines} {whole}");
        }
    }

    #[test]
    fn a_box_of_fog_takes_light_within_it_alone() {
        let fog = FogMedium { bounds: Some(Bounds { min: Vec3::ZERO, max: Vec3::splat(2.0) }), ..fog(0.0) };
        let at = |y: f32, end: f32| fog.span(Vec3::new(-1.0, y, 1.0), Vec3::X, end);
        assert_eq!(
            (at(1.0, f32::INFINITY), at(1.0, 2.0), at(3.0, 9.0), at(1.0, 0.5)),
            ([1.0, 3.0], [1.0, 2.0], [0.0; 2], [0.0; 2])
        );
        assert_eq!(fog.transmittance(Vec3::new(-1.0, 1.0, 1.0), Vec3::X, 9.0), libm::expf(-1.0));
    }
}
