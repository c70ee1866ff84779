//! Shadow catchers: surfaces that show no more than how much objects take of the light that arrives.
//!
//! Sums of that light with the objects and without them are taken over a pixel, and then divided: the mean of ratios of
//! samples would say something else. Laid over a picture of the place without objects, the pixel is that of the place
//! with them.

use glam::Vec3;

use super::Film;

/// What one sample has seen of a shadow catcher.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CaughtLight {
    /// Light that it sends back as the scene stands.
    pub with_objects: Vec3,
    /// The same without what casts shadows.
    pub without_objects: Vec3,
    /// What is seen in its place.
    pub behind: Vec3,
}

/// Sums over the samples of one pixel that have met a shadow catcher.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CaughtSum {
    /// Light with objects and without, in the two halves of the samples that denoising goes by.
    halves: [[Vec3; 2]; 2],
    behind: Vec3,
    /// The light of both halves, by the weights of the filter, and the sum of these.
    weighted: CaughtLight,
    weight: f32,
    count: f32,
}

impl CaughtSum {
    /// Adds a sample to one of the halves.
    pub fn add(&mut self, second: bool, light: CaughtLight, weight: f32) {
        let half = &mut self.halves[usize::from(second)];
        half[0] += light.with_objects;
        half[1] += light.without_objects;
        self.behind += light.behind;
        self.weighted.with_objects += light.with_objects * weight;
        self.weighted.without_objects += light.without_objects * weight;
        self.weighted.behind += light.behind * weight;
        self.weight += weight;
        self.count += 1.0;
    }

    /// What a pixel of so many samples in all shows, whose weights have this sum; `None` if none has met a catcher.
    pub fn resolve(&self, samples: u32, weight: f32) -> Option<CaughtShadow> {
        if self.count == 0.0 {
            return None;
        }
        let samples = samples.max(1) as f32;
        // As `PixelAccumulator::color` has it of all samples.
        let filtered = |sum: Vec3, weighted: Vec3| sum / samples + (weighted - sum * (weight / samples)) / samples;
        let [a, b] = self.halves;
        let left = left_of([
            filtered(a[0] + b[0], self.weighted.with_objects),
            filtered(a[1] + b[1], self.weighted.without_objects),
        ]);
        let cover = filtered(Vec3::splat(self.count), Vec3::splat(self.weight)).x;
        let behind = filtered(self.behind, self.weighted.behind);
        Some(CaughtShadow { cover, left, halves: self.halves.map(left_of), behind: behind.to_array() })
    }
}

/// Share that is left of light. Where none would arrive none is taken.
fn left_of([with_objects, without_objects]: [Vec3; 2]) -> [f32; 3] {
    [0, 1, 2].map(|k| match without_objects[k] {
        light if light > 0.0 => (with_objects[k] / light).clamp(0.0, 1.0),
        _ => 1.0,
    })
}

/// What a pixel shows of shadow catchers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CaughtShadow {
    /// Share of the pixel that catchers cover, by the weights of the filter.
    pub cover: f32,
    /// Share of the light that shadows leave there, each channel from 0 to 1.
    pub left: [f32; 3],
    /// The same in each half of the samples.
    pub halves: [[f32; 3]; 2],
    /// What is seen in the place of catchers, by how much of the pixel they cover, without shadows.
    pub behind: [f32; 3],
}

/// No catcher.
impl Default for CaughtShadow {
    fn default() -> Self {
        CaughtShadow { cover: 0.0, left: [1.0; 3], halves: [[1.0; 3]; 2], behind: [0.0; 3] }
    }
}

impl CaughtShadow {
    /// What shadows add to alpha: how much of what lies behind they take away.
    pub fn alpha(&self) -> f32 {
        self.cover * (1.0 - (self.left[0] + self.left[1] + self.left[2]) / 3.0)
    }

    /// What is left of what lies behind.
    pub fn darkened(&self) -> [f32; 3] {
        [0, 1, 2].map(|k| self.behind[k] * self.left[k])
    }
}

impl Film {
    /// Lays what shadow catchers show over the pixels: what lies behind, darkened, and alpha.
    pub fn cast_shadows(&mut self) {
        let caught = std::mem::take(&mut self.layers.caught);
        for (i, shadow) in caught.iter().enumerate() {
            let darkened = shadow.darkened();
            self.pixels[i].iter_mut().zip(darkened).for_each(|(x, light)| *x += light);
            if let Some(alpha) = self.layers.coverage.get_mut(i) {
                *alpha += shadow.alpha();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shadow_is_the_ratio_of_sums() {
        let mut sum = CaughtSum::default();
        assert_eq!(sum.resolve(4, 4.0), None);
        let light = |with: f32, without: f32| CaughtLight {
            with_objects: Vec3::new(with, 0.0, 2.0 * with),
            without_objects: Vec3::new(without, 0.0, with),
            behind: Vec3::splat(0.5),
        };
        sum.add(false, light(0.0, 1.0), 1.0);
        sum.add(true, light(3.0, 3.0), 1.0);
        let shadow = sum.resolve(4, 4.0).unwrap();
        // Three quarters of the red are left; green never came, and more blue than that is no shadow.
        assert_eq!((shadow.cover, shadow.left, shadow.behind), (0.5, [0.75, 1.0, 1.0], [0.25; 3]));
        assert_eq!(shadow.halves, [[0.0, 1.0, 1.0], [1.0; 3]]);
        assert_eq!(shadow.darkened(), [0.1875, 0.25, 0.25]);
        assert!((shadow.alpha() - 0.5 * 0.25 / 3.0).abs() < 1e-6, "{}", shadow.alpha());
        assert_eq!(CaughtShadow::default().alpha(), 0.0);
    }
}
