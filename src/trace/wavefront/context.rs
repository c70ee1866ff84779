//! Everything that a frame is traced from, and its settings, resolved.

use glam::Vec3;

use crate::components::{Fresnel, Integrator, Render, Shadows};
use crate::film::FilterTable;
use crate::trace::accel::Accelerator;
use crate::trace::camera::CameraRays;
use crate::trace::light::Lights;
use crate::trace::light::environment::Environment;
use crate::trace::material::ShadingParams;
use crate::trace::material::texture::TextureBindings;
use crate::trace::primitive::Geometry;
use crate::trace::reuse::{DirtyRegions, MotionVectors};
use crate::trace::sampler::Sampler;
use crate::trace::simd::{Lanes, V3, Width};

/// Where on a light a shadow ray ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightSampling {
    Center,
    /// n x n cell centres.
    Fixed(u32),
    Random,
    Jittered,
}

/// Settings of the recursion, resolved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    pub integrator: Integrator,
    /// Side of the strata of one round of samples.
    pub strata: u32,
    pub rounds: u32,
    /// When a pixel has had rounds enough.
    pub noise: Option<Noise>,
    pub clamps: Clamps,
    /// Whether the film wants to know what the camera's rays meet first.
    pub features: bool,
    pub max_depth: u32,
    /// Least weight of mirrored and refracted rays where all of them are followed; 0 for no least one.
    pub min_weight: f32,
    pub light_sampling: LightSampling,
    pub gloss: bool,
    pub lens: bool,
    pub transparent_shadows: bool,
    /// Whether rays are followed both ways where a surface is there in part; else chance decides.
    pub splits_holes: bool,
    /// Whether the camera sees nothing of what lies around the scene.
    pub transparent: bool,
    pub fresnel: Fresnel,
    pub background: Vec3,
    pub seed: u64,
    /// Photons of a pass, and the seed of theirs: the camera is not in it.
    pub photons: u32,
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

/// Everything that a frame is traced from.
#[derive(Clone, Copy)]
pub struct RenderContext<'a> {
    pub geometry: &'a Geometry,
    pub accelerator: &'a Accelerator,
    pub materials: &'a [ShadingParams],
    pub lights: &'a Lights,
    pub textures: &'a TextureBindings,
    pub camera: &'a CameraRays,
    /// Where the origin of all this is in the world.
    pub origin: Vec3,
    /// The frame before, where the film wants to know what has moved.
    pub motion: Option<&'a MotionVectors>,
    /// Takes the place of the background colour.
    pub environment: Option<&'a Environment>,
    pub settings: &'a Settings,
    /// What shading that goes side by side runs in.
    pub lanes: Width,
    /// Where in and around a pixel its samples lie.
    pub filter: &'a FilterTable,
    pub width: u32,
    /// Groups that lights are divided into, 1 at least.
    pub light_groups: usize,
    /// Whether surfaces of some materials are not there everywhere.
    pub holes: bool,
    /// Whether any material is clear glass, whose bodies may cover each other.
    pub glass: bool,
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
    /// Whether what stops a shadow ray may let some of its light through.
    #[inline(always)]
    pub fn dims_shadow_rays(&self) -> bool {
        self.settings.transparent_shadows || self.holes
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
