//! Everything that a frame is traced from, and its settings, resolved.

use glam::Vec3;

use super::slots::CATCHER_ROWS;
use crate::components::{Fresnel, Integrator, Render, Shadows};
use crate::film::FilterTable;
use crate::trace::accel::Accelerator;
use crate::trace::camera::CameraRays;
use crate::trace::light::environment::Environment;
use crate::trace::light::{LightLinking, Lights};
use crate::trace::material::texture::{RayCone, TextureBindings};
use crate::trace::material::{FogMedium, ShadingParams};
use crate::trace::primitive::Geometry;
use crate::trace::reuse::{DirtyRegions, MotionVectors};
use crate::trace::sampler::Sampler;
use crate::trace::simd::{Lanes, V3, Width};

/// Where on a light a shadow ray ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightSampling {
    /// The middle.
    Center,
    /// n x n cell centres.
    Fixed(u32),
    /// Anywhere, without strata.
    Random,
    /// Anywhere, in strata over the samples of a pixel.
    Jittered,
}

/// Settings of the recursion, resolved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How light is followed.
    pub integrator: Integrator,
    /// Side of the strata of one round of samples.
    pub strata: u32,
    /// Rounds of samples of a pixel.
    pub rounds: u32,
    /// When a pixel has had rounds enough.
    pub noise: Option<Noise>,
    /// Most that a single way of light adds.
    pub clamps: Clamps,
    /// Whether the film wants to know what the camera's rays meet first.
    pub features: bool,
    /// Rays of a path at most, the camera's being the first.
    pub max_depth: u32,
    /// Least weight of mirrored and refracted rays where all of them are followed; 0 for no least one.
    pub min_weight: f32,
    /// Where shadow rays end.
    pub light_sampling: LightSampling,
    /// Whether mirrors may be glossy.
    pub gloss: bool,
    /// Whether the lens has an extent.
    pub lens: bool,
    /// Whether glass lets light of lamps through, unrefracted.
    pub transparent_shadows: bool,
    /// Whether rays are followed both ways where a surface is there in part; else chance decides.
    pub splits_holes: bool,
    /// Whether the camera sees nothing of what lies around the scene.
    pub transparent: bool,
    /// How much of the light polished glass mirrors.
    pub fresnel: Fresnel,
    /// Linear colour of rays that meet nothing.
    pub background: Vec3,
    /// Of the frame.
    pub seed: u64,
    /// Photons of a pass, and the seed of theirs: the camera is not in it.
    pub photons: u32,
    /// Of photons: that of the scene.
    pub photon_seed: u64,
    /// Of the first pass; follows from the photons if not given.
    pub photon_radius: Option<f64>,
}

impl Settings {
    /// Resolves the settings of a scene; `seed` is that of the frame.
    pub fn new(render: &Render, seed: u64) -> Self {
        let distribution = render.integrator != Integrator::Whitted;
        let strata = render.strata();
        let paths = matches!(render.integrator, Integrator::Path | Integrator::Photon);
        let light_sampling = match render.shadows {
            _ if !distribution => LightSampling::Center,
            Shadows::Hard => LightSampling::Center,
            Shadows::Auto if strata > 1 || paths => LightSampling::Jittered,
            Shadows::Auto | Shadows::Fixed => LightSampling::Fixed(render.shadow_samples.isqrt().max(1)),
            Shadows::Random => LightSampling::Random,
            Shadows::Jittered => LightSampling::Jittered,
        };
        Settings {
            integrator: render.integrator,
            strata,
            rounds: render.rounds(),
            noise: render.noise_threshold.map(|threshold| Noise { threshold, exposure: render.exposure }),
            clamps: Clamps::new(render),
            features: render.gathers_features() || render.denoise,
            max_depth: render.max_depth,
            min_weight: render.min_weight as f32,
            light_sampling,
            gloss: distribution,
            lens: distribution,
            transparent_shadows: render.transparent_shadows && render.integrator != Integrator::Photon,
            // A ray of the camera that goes on behind a hole is still one: what it shows counts for alpha.
            splits_holes: !distribution && !render.transparent,
            transparent: render.transparent,
            fresnel: render.fresnel,
            background: render.background.as_vec3(),
            seed,
            photons: render.photons,
            photon_seed: render.seed.unwrap_or(0),
            photon_radius: render.photon_radius,
        }
    }
}

impl Settings {
    /// Whether light is looked for along single paths.
    pub fn follows_paths(&self) -> bool {
        matches!(self.integrator, Integrator::Path | Integrator::Photon)
    }

    /// Whether a sample belongs to the second half of its pixel's: of Sobol points the later half, which is spread as well
    /// as the first; of strata the black squares of a checkerboard, so that both halves are of all of the pixel.
    pub fn is_second_half(&self, sampler: &Sampler) -> bool {
        let (n, sample) = (self.strata, sampler.sample);
        if self.follows_paths() { 2 * sample >= n * n } else { (sample % n + sample / n) % 2 == 1 }
    }

    /// The first sample of a pixel in a round with a seed of its own: paths are led by Sobol points, the rest by
    /// jittered strata.
    pub fn sampler(&self, seed: u64, [x, y]: [u32; 2], width: u32) -> Sampler {
        match self.integrator {
            Integrator::Path | Integrator::Photon => Sampler::sobol(seed, [x, y], self.strata * self.strata),
            Integrator::Whitted | Integrator::Distribution => Sampler::new(seed, y * width + x, self.strata),
        }
    }
}

/// How rays find primitives, by what the rays are for: the same for all of them where all see the same.
#[derive(Clone, Copy)]
pub struct RayAccelerators<'a> {
    /// Rays of the camera.
    pub camera: &'a Accelerator,
    /// Rays that left a surface, and photons.
    pub scattered: &'a Accelerator,
    /// Rays to lights, by the number of the set of bodies that throw shadows.
    pub shadow: &'a [&'a Accelerator],
}

impl<'a> RayAccelerators<'a> {
    /// Of paths with so many rays.
    #[inline]
    pub fn at_depth(&self, depth: u32) -> &'a Accelerator {
        if depth == 1 { self.camera } else { self.scattered }
    }
}

/// Everything that a frame is traced from.
#[derive(Clone, Copy)]
pub struct RenderContext<'a> {
    /// All primitives.
    pub geometry: &'a Geometry,
    /// How rays find them.
    pub accelerators: RayAccelerators<'a>,
    /// By number.
    pub materials: &'a [ShadingParams],
    /// All that shines.
    pub lights: &'a Lights,
    /// Textures of materials.
    pub textures: &'a TextureBindings,
    /// Where camera rays come from.
    pub camera: &'a CameraRays,
    /// Where the origin of all this is in the world.
    pub origin: Vec3,
    /// The frame before, where the film wants to know what has moved.
    pub motion: Option<&'a MotionVectors>,
    /// Takes the place of the background colour.
    pub environment: Option<&'a Environment>,
    /// In the air, if there is any.
    pub fog: Option<&'a FogMedium>,
    /// How it is traced.
    pub settings: &'a Settings,
    /// What shading that goes side by side runs in.
    pub lanes: Width,
    /// Where in and around a pixel its samples lie.
    pub filter: &'a FilterTable,
    /// Pixels of a row.
    pub width: u32,
    /// Groups that lights are divided into, 1 at least.
    pub light_groups: usize,
    /// Whether surfaces of some materials are not there everywhere.
    pub holes: bool,
    /// Whether any material is clear glass, whose bodies may cover each other.
    pub glass: bool,
    /// Whether light gets less on its way through the body of any material.
    pub absorbs: bool,
    /// Whether any material catches shadows.
    pub catchers: bool,
    /// Regions that are noted where rays cross them.
    pub regions: Option<DirtyRegions<'a>>,
}

/// Most that a channel of what a single way of light adds to a sample may be.
///
/// What the camera sees, straight or by mirrors and clear glass, is never cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clamps {
    is_set: bool,
    /// Of light that was scattered once on its way, and of light that was scattered more often.
    direct: f32,
    indirect: f32,
}

impl Clamps {
    fn new(render: &Render) -> Self {
        let most = |clamp: Option<f64>| clamp.map_or(f32::INFINITY, |c| c as f32);
        let (direct, indirect) = (most(render.clamp_direct), most(render.clamp));
        Clamps { is_set: render.clamp.is_some() || render.clamp_direct.is_some(), direct, indirect }
    }

    /// Light that comes by a way with so many scatterings, brought down so that its hue stays.
    #[inline]
    pub fn limited(&self, scatterings: f32, light: Vec3) -> Vec3 {
        self.limited_lanes(scatterings, V3::<f32>::from(light)).into()
    }

    /// As [`Self::limited`].
    #[inline(always)]
    pub fn limited_lanes<L: Lanes>(&self, scatterings: L, light: V3<L>) -> V3<L> {
        if !self.is_set {
            return light;
        }
        let (one, free) = (L::splat(1.0), L::splat(f32::INFINITY));
        let once = L::select(scatterings.lt(one), free, L::splat(self.direct));
        let most = L::select(one.lt(scatterings), L::splat(self.indirect), once);
        let largest = light.max_element();
        light.scale(L::select(most.lt(largest), most / largest, one))
    }
}

impl RenderContext<'_> {
    /// The queue of shadow rays for a light, whose rays are binned by this number: rays that other bodies stop have queues
    /// of their own.
    #[inline(always)]
    pub fn shadow_queue(&self, queues: usize, bin: usize, light: impl FnOnce() -> LightLinking) -> usize {
        match self.accelerators.shadow.len() {
            0 | 1 => bin % queues.max(1),
            sets => {
                let bins = (queues / sets).max(1);
                bin % bins + bins * (light().shadow_set as usize).min(sets - 1)
            }
        }
    }

    /// Whether what stops a shadow ray may let some of its light through.
    #[inline(always)]
    pub fn dims_shadow_rays(&self) -> bool {
        self.settings.transparent_shadows || self.holes || self.catchers
    }

    /// Sums of colours of a sample: one for each light group, or those of shadow catchers.
    pub fn rows(&self) -> usize {
        if self.catchers { CATCHER_ROWS } else { self.light_groups }
    }

    /// What a ray shows that leaves the scene, if nothing else has looked for the same light.
    pub fn surroundings(&self, direction: Vec3, cone: RayCone) -> Vec3 {
        self.environment.map_or(self.settings.background, |sky| sky.lookup_wide(direction, cone))
    }
}

/// What counts as noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Standard error that is small enough, where 1 is the range of the screen.
    pub threshold: f64,
    /// In stops.
    pub exposure: f64,
}
