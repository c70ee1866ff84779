//! What the camera's rays met first, beside the colours: the layers that are called AOVs in the field.

use glam::{Vec2, Vec3};

use super::bounds::PixelBounds;
use super::catcher::CaughtShadow;
use super::denoise::DenoisePixel;

/// Depth of a pixel that nothing stands in, as other renderers write it.
pub const NOTHING: f32 = 1e10;

/// What the camera ray of one sample met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feature {
    /// Along the view axis, in world units.
    pub depth: f32,
    /// In the world.
    pub point: Vec3,
    /// Unit, in the world, towards the camera: the shading normal.
    pub normal: Vec3,
    /// Share of white light that comes back, by diffuse and mirror reflection together; 1 for what is clear.
    pub albedo: Vec3,
    /// Since the frame before, in pixels to the right and up.
    pub motion: Vec2,
    /// Authored indices, from 0.
    pub entity: u32,
    /// As `entity`; the default material comes after the authored ones.
    pub material: u32,
    /// Whether it is a shadow catcher, which covers nothing by itself.
    pub catcher: bool,
}

impl Feature {
    fn is_finite(&self) -> bool {
        self.depth.is_finite() && self.point.is_finite() && self.normal.is_finite() && self.albedo.is_finite()
    }
}

/// Sums of features over the samples of one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeatureSum {
    samples: u32,
    hits: u32,
    /// How many of the hits cover what lies behind.
    covering: u32,
    /// Shares that were hidden of samples that met nothing.
    veils: f32,
    /// Sums of the filter's weights: of all samples, and of those that cover what lies behind.
    weight: f32,
    weighted_covering: f32,
    depth: f32,
    point: Vec3,
    normal: Vec3,
    albedo: Vec3,
    /// Square of the distance from the pixel's centre of the sample that gave ids and motion.
    nearest: f32,
    ids: [u32; 2],
    motion: Vec2,
}

impl Default for FeatureSum {
    fn default() -> Self {
        let zero = Vec3::ZERO;
        let (point, normal, albedo) = (zero, zero, zero);
        FeatureSum {
            samples: 0,
            hits: 0,
            covering: 0,
            veils: 0.0,
            weight: 0.0,
            weighted_covering: 0.0,
            depth: 0.0,
            point,
            normal,
            albedo,
            nearest: f32::INFINITY,
            ids: [0; 2],
            motion: Vec2::ZERO,
        }
    }
}

impl FeatureSum {
    /// Adds a sample of a weight, `None` where it met nothing; `off_center` is its squared distance from the pixel's
    /// centre. What is no number counts as nothing.
    pub fn add(&mut self, feature: Option<&Feature>, off_center: f32, weight: f32) {
        self.samples += 1;
        self.weight += weight;
        let nearest = off_center < self.nearest;
        if nearest {
            self.nearest = off_center;
            self.ids = [0; 2];
            self.motion = Vec2::ZERO;
        }
        let Some(feature) = feature.filter(|f| f.is_finite()) else { return };
        if nearest {
            self.ids = [feature.entity + 1, feature.material + 1];
            self.motion = feature.motion;
        }
        self.hits += 1;
        if !feature.catcher {
            self.covering += 1;
            self.weighted_covering += weight;
        }
        self.depth += feature.depth;
        self.point += feature.point;
        self.normal += feature.normal;
        self.albedo += feature.albedo;
    }

    /// Adds what hides a share of what lies behind everything from a sample that met nothing and was added.
    pub fn add_veil(&mut self, share: f32, weight: f32) {
        self.veils += share;
        self.weighted_covering += weight * share;
    }

    /// Share of the samples that met something but a shadow catcher, as the film has it of colours: see `PixelAccumulator::color`.
    fn coverage(&self) -> f32 {
        let samples = self.samples.max(1) as f32;
        let mean = (self.covering as f32 + self.veils) / samples;
        if self.weight == samples {
            return mean;
        }
        mean + (self.weighted_covering - mean * self.weight) / samples
    }
}

/// Columns with a value for each pixel, top row first; empty where nobody asked for them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    /// Share of the samples that met something, by the weights of the filter, and of shadow catchers the shadow: alpha.
    /// Weights with signs may take it a little out of 0 to 1, as they do colours.
    pub coverage: Vec<f32>,
    /// Mean over the samples that met something, along the view axis; [`NOTHING`] where none did.
    pub depth: Vec<f32>,
    /// Mean over the samples that met something, zero where none did.
    pub position: Vec<[f32; 3]>,
    /// Means over all samples: zero for those that met nothing.
    pub normal: Vec<[f32; 3]>,
    /// Means over all samples: zero for those that met nothing.
    pub albedo: Vec<[f32; 3]>,
    /// Authored number, counted from 1, of the entity and of the material that the sample nearest to the pixel's centre
    /// met; 0 if it met nothing. The default material comes after the last authored one.
    pub entity: Vec<u32>,
    /// As `entity`.
    pub material: Vec<u32>,
    /// What that sample met has moved since the frame before, in pixels to the right and up; zero if it met nothing.
    pub motion: Vec<[f32; 2]>,
    /// Variance of the pixel's luminance: that of its samples over their number. Strata make the truth smaller.
    pub variance: Vec<f32>,
    /// What the film is denoised by; empty unless that is wanted, and afterwards.
    pub halves: Vec<DenoisePixel>,
    /// What pixels show of shadow catchers; empty where there are none, and once it is laid over the pixels.
    pub caught: Vec<CaughtShadow>,
}

impl Layers {
    /// Room for the features of so many pixels.
    pub fn make_room_for_features(&mut self, pixels: usize) {
        self.coverage = vec![0.0; pixels];
        self.depth = vec![NOTHING; pixels];
        self.position = vec![[0.0; 3]; pixels];
        self.normal = vec![[0.0; 3]; pixels];
        self.albedo = vec![[0.0; 3]; pixels];
        self.entity = vec![0; pixels];
        self.material = vec![0; pixels];
        self.motion = vec![[0.0; 2]; pixels];
    }

    /// Those of a part of the pixels that they are of.
    pub fn cropped(&self, bounds: PixelBounds, part: PixelBounds) -> Layers {
        let Layers { coverage, depth, position, normal, albedo, entity, material, motion, variance, halves, caught } =
            self;
        Layers {
            coverage: bounds.crop(coverage, part),
            depth: bounds.crop(depth, part),
            position: bounds.crop(position, part),
            normal: bounds.crop(normal, part),
            albedo: bounds.crop(albedo, part),
            entity: bounds.crop(entity, part),
            material: bounds.crop(material, part),
            motion: bounds.crop(motion, part),
            variance: bounds.crop(variance, part),
            halves: bounds.crop(halves, part),
            caught: bounds.crop(caught, part),
        }
    }

    /// Adds those of the pixels that follow.
    pub fn append(&mut self, others: Layers) {
        let Layers { coverage, depth, position, normal, albedo, entity, material, motion, variance, halves, caught } =
            others;
        self.coverage.extend(coverage);
        self.depth.extend(depth);
        self.position.extend(position);
        self.normal.extend(normal);
        self.albedo.extend(albedo);
        self.entity.extend(entity);
        self.material.extend(material);
        self.motion.extend(motion);
        self.variance.extend(variance);
        self.halves.extend(halves);
        self.caught.extend(caught);
    }

    /// Sets what the samples of a pixel add up to.
    pub fn resolve(&mut self, pixel: usize, sum: &FeatureSum) {
        let (hits, samples) = (sum.hits.max(1) as f32, sum.samples.max(1) as f32);
        self.coverage[pixel] = sum.coverage();
        self.depth[pixel] = if sum.hits > 0 { sum.depth / hits } else { NOTHING };
        self.position[pixel] = (sum.point / hits).to_array();
        self.normal[pixel] = (sum.normal / samples).to_array();
        self.albedo[pixel] = (sum.albedo / samples).to_array();
        [self.entity[pixel], self.material[pixel]] = sum.ids;
        self.motion[pixel] = sum.motion.to_array();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misses_count_where_a_share_is_meant_and_not_where_a_place_is() {
        let seen = |depth: f32, entity| Feature {
            depth,
            point: Vec3::new(0.0, 0.0, depth),
            normal: Vec3::Z,
            albedo: Vec3::splat(0.5),
            motion: Vec2::new(depth, 1.0),
            entity,
            material: 7,
            catcher: false,
        };
        let mut sum = FeatureSum::default();
        sum.add(Some(&seen(2.0, 4)), 0.3, 1.0);
        sum.add(None, 0.2, 1.0);
        sum.add(Some(&seen(4.0, 5)), 0.1, 1.0);
        sum.add(Some(&Feature { normal: Vec3::splat(f32::NAN), ..seen(1.0, 9) }), 0.1, 1.0);
        let mut layers = Layers::default();
        layers.make_room_for_features(2);
        layers.resolve(0, &sum);
        layers.resolve(1, &FeatureSum::default());
        assert_eq!((layers.depth[0], layers.position[0], layers.coverage[0]), (3.0, [0.0, 0.0, 3.0], 0.5));
        assert_eq!((layers.normal[0], layers.albedo[0]), ([0.0, 0.0, 0.5], [0.25; 3]));
        // The first of the two that are equally near.
        assert_eq!((layers.entity[0], layers.material[0], layers.motion[0]), (6, 8, [4.0, 1.0]));
        assert_eq!((layers.depth[1], layers.entity[1]), (NOTHING, 0));
    }
}
