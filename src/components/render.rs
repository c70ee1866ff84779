//! How the picture is made: the settings of a scene.

use glam::DVec3;

use super::daylight::Daylight;
use super::film::{Aov, Filter, ToneMap};
use super::fog::Fog;
use super::record::ranges::{above, at_least, between, color, coordinate, whole};
use super::record::{Check, Invalid, choice, record};
use super::value::Text;
use crate::base::limits;

choice! {
    /// Which light paths are followed.
    pub enum Integrator {
        /// Whitted (CACM 1980): sharp mirrors and refraction, hard shadows, a pinhole camera, one moment.
        Whitted,
        /// Cook, Porter and Carpenter (SIGGRAPH 1984): soft shadows, gloss and the lens, by sampling.
        Distribution,
        /// Kajiya (SIGGRAPH 1986): light that bounces between diffuse surfaces too, one way at a time.
        Path,
        /// Photon mapping (Jensen 1996) in passes (Knaus and Zwicker 2011): light from lamps through glass and off mirrors
        /// too, onto what paths from the eye meet. Noise and blur vanish with passes.
        Photon,
    }
}

choice! {
    /// Where on an area light a shadow ray ends.
    pub enum Shadows {
        /// `Fixed` where a pixel has one sample, `Jittered` where it has more.
        Auto,
        /// At the light's centre: hard shadows.
        Hard,
        /// A regular grid of `shadow_samples` points, the same for every pixel sample.
        Fixed,
        /// One random point for each pixel sample.
        Random,
        /// One random point in the cell of the light that belongs to the sample's cell of the pixel.
        Jittered,
    }
}

choice! {
    /// How paths choose which light they sample at a hit, where there are more than 8 of them; of fewer, one is chosen by
    /// power. The mean of the picture is the same.
    pub enum LightSampler {
        /// By power alone.
        Power,
        /// By what each is estimated to bring to the hit: by distance and direction, too (Conty and Kulla, HPG 2018). 2,000
        /// lamps are as little noisy as the few that are near.
        Bvh,
    }
}

choice! {
    /// How a transparent surface splits light into reflected and refracted.
    pub enum Fresnel {
        /// The Fresnel equations for unpolarised light.
        Exact,
        /// Schlick's approximation (1994).
        Schlick,
        /// `reflection` and `transmission` as they stand, as the older NFF tracers do.
        Off,
    }
}

choice! {
    /// What finds the primitives along a ray. All give the same picture, to the byte.
    pub enum Accel {
        /// The fastest: so far always `Bvh`, for no scene was found in which `Grid` leads by a tenth.
        Auto,
        /// A uniform grid with mailboxes.
        Grid,
        /// A tree of boxes, eight wide, by the surface area heuristic.
        Bvh,
        /// Every primitive is tested: slow, and the oracle for the others.
        Brute,
    }
}

choice! {
    /// How linear values become the numbers of a picture file.
    pub enum Transfer {
        /// The sRGB curve: what a screen expects.
        Srgb,
        /// As they are, as the tracers of the NFF world write them.
        Linear,
    }
}

record! {
    /// Settings of the picture.
    pub struct Render {
        /// Width and height in pixels.
        pub size: [u32; 2] = [640, 360] => Film,
        /// The part of the frame that is rendered, `(x, y, width, height)` in pixels from the top left corner: the picture
        /// is that part, equal to the same part of the whole. All of the frame when not given.
        pub region: Option<[u32; 4]> = None => Film,
        /// Samples per pixel, rounded down to a square n x n of jittered strata; 1 is the pixel centre.
        pub samples: u32 = 16,
        /// Which light paths are followed.
        pub integrator: Integrator = Integrator::Distribution,
        /// Colour of rays that leave the scene, linear.
        pub background: DVec3 = DVec3::ZERO => EmittedColor,
        /// What surrounds the scene in place of `background`, relative to the scene: the folder of a cube map (right,
        /// left, top, bottom, front, back), or a picture of the whole sphere (equirectangular, PNG, JPEG or HDR) with
        /// its middle at -z, u to the right and v up.
        pub environment: Option<Text> = None,
        /// Longest chain of rays, the camera's included: 1 shows no reflection.
        pub max_depth: u32 = 6,
        /// Least share of the picture that a mirrored or refracted ray may stand for: `Whitted` and `Distribution` do not
        /// follow fainter ones, of which glass makes more at every depth. 0 follows all of them; 0.00002 does not show
        /// and keeps a `max_depth` of 64 nearly as cheap as one of 12.
        pub min_weight: f64 = 0.0,
        /// How paths choose which of many lights they sample.
        pub light_sampler: LightSampler = LightSampler::Bvh,
        /// Where on an area light a shadow ray ends.
        pub shadows: Shadows = Shadows::Auto,
        /// Points on each light where `Fixed` shadows are used, rounded down to a square.
        pub shadow_samples: u32 = 16,
        /// Side of the square, in the world's xy directions, that point lights are widened to for soft shadows.
        pub light_size: f64 = 0.0,
        /// Whether transparent surfaces let light through to what they shade, dimmed by `transmission` at each; they
        /// block it otherwise, as in the P3F tracers. Not so with `Photon`: photons go through glass by themselves.
        pub transparent_shadows: bool = false,
        /// How a transparent surface splits light into reflected and refracted.
        pub fresnel: Fresnel = Fresnel::Exact,
        /// Seed of all sampling; follows from the camera's pose when not given.
        pub seed: Option<u64> = None,
        /// What finds the primitives along a ray; it does not show.
        pub accel: Accel = Accel::Auto => Invisible,
        /// Cells of the grid per primitive: the density of Woo's resolution rule. Blocks of eight want coarse cells.
        pub grid_density: f64 = 1.0 => Invisible,
        /// Bits per channel of the picture file: 8 or 16 of a PNG, 32 for floats instead of halves in an EXR.
        pub bit_depth: u32 = 8 => Film,
        /// How linear values become the numbers of a picture file for the screen.
        pub transfer: Transfer = Transfer::Srgb,
        /// Whether what lies around the scene is left out where the camera sees it straight or through holes: it lights
        /// the scene and shows in mirrors and glass all the same. Pictures then have an alpha: straight in a PNG, in an
        /// EXR the channel `A` beside colours that it is multiplied into.
        pub transparent: bool = false,

        /// Most that a channel of what one way of indirect light adds to a sample may be, linear; more is scaled down to it.
        /// Takes out fireflies, and with them some of the light that was scattered twice or more on its way. What the
        /// camera sees, straight, mirrored or through clear glass, and direct light stay as they are.
        pub clamp: Option<f64> = None => Film,
        /// As `clamp`, of direct light: from a light by one surface to the camera.
        pub clamp_direct: Option<f64> = None => Film,
        /// Exposure in stops: 1 doubles what a picture for the screen shows. EXR files hold the values before it.
        pub exposure: f64 = 0.0 => Film,
        /// How linear values of any size become values that a screen can show.
        pub tone_map: ToneMap = ToneMap::Clip => Film,
        /// Whether pictures of 8 bits are dithered by blue noise: slow gradients then show no bands. It is the same in every
        /// frame.
        pub dither: bool = false => Film,
        /// How samples around a pixel's centre count towards it.
        pub filter: Filter = Filter::Box => Film,
        /// Full width of the filter in pixels, along x and y; the filter's usual one when not given: 1 for `Box`, 2 for
        /// `Tent`, 3 for `Gaussian` and `BlackmanHarris`, 4 for `Mitchell`.
        pub filter_width: Option<f64> = None => Film,
        /// Layers beside the colours, for EXR files only.
        pub aovs: Vec<Aov> = Vec::new() => Film,
        /// Standard error at which a pixel has samples enough, on the square root of exposed light, where 1 is the
        /// screen's range: 0.01 is hardly seen. Pixels then get rounds of `min_samples` until all of their block of
        /// 4 x 4 are there, or as many of them as `samples` holds are spent. Without it all pixels get `samples`.
        pub noise_threshold: Option<f64> = None,
        /// Samples of one round where there is a `noise_threshold`, rounded down to a square.
        pub min_samples: u32 = 16,
        /// Whether noise is filtered out of the finished picture, by what its pixels show and how two halves of their
        /// samples differ; two samples a pixel are the least.
        pub denoise: bool = false => Film,
        /// Factor of `environment`, `daylight` or `sky`, 0 and up.
        pub environment_intensity: f64 = 1.0 => EmittedColor,
        /// Degrees about y that `environment` or `daylight` is turned by, counter-clockwise seen from above.
        pub environment_rotation: f64 = 0.0,
        /// A sky where there is no `environment`: colours straight up, at the horizon and straight down, linear.
        pub sky: Option<[DVec3; 3]> = None,
        /// The sky of a clear day with the sun in it, where there is no `environment`: `(sun: (1, 2, 1), turbidity: 2.5)`.
        pub daylight: Option<Box<Daylight>> = None,
        /// Fog in the air: `(density: 0.1, color: (0.8, 0.8, 0.8))`.
        pub fog: Option<Box<Fog>> = None,

        /// Moments that a frame is made of while the camera's shutter is open, evenly spread over it, each for its share
        /// of every pixel's samples; never more than samples. One moment is the middle of the shutter. Where there are
        /// more, no pixel stops early at a `noise_threshold`; samples beyond them have times in between, at which what
        /// moves is on its straight way from one moment to the next.
        pub shutter_slices: u32 = 16,

        /// Photons that each pass of `Photon` sends out.
        pub photons: u32 = 200_000,
        /// Passes of `Photon`, each for its share of every pixel's samples, never more than samples; at least one for
        /// each moment of an open shutter. No pixel stops early at a `noise_threshold` where there are more than one.
        pub photon_passes: u32 = 16,
        /// How far around a point the first pass of `Photon` looks for photons, world units; follows from how densely
        /// they lie when not given. Photons of sparse caustics are spread up to four times
        /// as far; later passes look less far.
        pub photon_radius: Option<f64> = None,
    }
}

impl Render {
    /// Top left pixel, and width and height of what is rendered of the frame.
    pub fn pixel_bounds(&self) -> [[u32; 2]; 2] {
        self.region.map_or([[0; 2], self.size], |[x, y, width, height]| [[x, y], [width, height]])
    }

    /// Side n of the n x n strata of a pixel, or of one round of its samples.
    pub fn strata(&self) -> u32 {
        let round = if self.noise_threshold.is_some() { self.samples.min(self.min_samples) } else { self.samples };
        round.isqrt().max(1)
    }

    /// Most rounds of samples that a pixel gets.
    pub fn rounds(&self) -> u32 {
        let strata = self.strata();
        // One sample lies at the centre of the pixel: more would be the same.
        if self.noise_threshold.is_some() && strata > 1 { self.samples / (strata * strata) } else { 1 }
    }

    /// Whether what the camera's rays meet first is to be remembered.
    pub fn gathers_features(&self) -> bool {
        self.transparent || self.aovs.iter().any(|aov| *aov != Aov::Variance)
    }

    /// Whether the spread of samples is to be measured.
    pub fn gathers_moments(&self) -> bool {
        self.noise_threshold.is_some() || self.aovs.contains(&Aov::Variance)
    }

    /// Whether something else than a background of one colour lies around the scene.
    pub fn has_environment(&self) -> bool {
        self.environment.is_some() || self.sky.is_some() || self.daylight.is_some()
    }

    /// The one field of those of class [`EmittedColor`](super::FieldClass::EmittedColor) that the brightness of the surroundings is
    /// proportional to, and its value; the other one does not count.
    pub fn environment_color(&self) -> (&'static str, DVec3) {
        if self.has_environment() {
            ("environment_intensity", DVec3::splat(self.environment_intensity))
        } else {
            ("background", self.background)
        }
    }

    /// The settings with another value of the field that [`Self::environment_color`] names.
    pub fn with_environment_color(mut self, color: DVec3) -> Self {
        if self.has_environment() {
            self.environment_intensity = color.x;
        } else {
            self.background = color;
        }
        self
    }

    /// Full width of the reconstruction filter in pixels.
    pub fn filter_width(&self) -> f64 {
        self.filter_width.unwrap_or(self.filter.usual_width())
    }

    fn check_region(&self) -> Result<(), Invalid> {
        let Some([x, y, width, height]) = self.region else { return Ok(()) };
        let fits = |at: u32, side: u32, of: u32| side > 0 && at.checked_add(side).is_some_and(|end| end <= of);
        let [w, h] = self.size;
        if fits(x, width, w) && fits(y, height, h) {
            return Ok(());
        }
        let what = if width > 0 && height > 0 { "does not lie in" } else { "has no pixel of" };
        let message = format!("the region of {width}x{height} pixels at ({x}, {y}) {what} the frame of {w}x{h}");
        Err(Invalid { field: "region", message })
    }

    fn check_film(&self) -> Result<(), Invalid> {
        for (field, clamp) in [("clamp", self.clamp), ("clamp_direct", self.clamp_direct)] {
            clamp.map_or(Ok(()), |clamp| above(field, clamp, 0.0))?;
        }
        between("exposure", self.exposure, -limits::EXPOSURE, limits::EXPOSURE)?;
        between("filter_width", self.filter_width(), 0.01, limits::FILTER_WIDTH)?;
        if let Some(threshold) = self.noise_threshold {
            between("noise_threshold", threshold, 1e-6, 1.0)?;
        }
        whole("min_samples", self.min_samples.into(), 4, limits::SAMPLES.into())
    }

    /// Turns that the samples of each of so many moments are taken in: with other photons each.
    pub fn turns(&self, moments: u32) -> u32 {
        match self.integrator {
            Integrator::Photon => (self.photon_passes.min(self.strata() * self.strata()) / moments).max(1),
            Integrator::Whitted | Integrator::Distribution | Integrator::Path => 1,
        }
    }

    /// Moments that are traced in the place of each of [`Self::moments`], so that as many samples as there are have a time
    /// of their own.
    pub fn parts_of_moment(&self) -> u32 {
        match self.integrator {
            // Each moment would have photons of its own.
            Integrator::Whitted | Integrator::Photon => 1,
            Integrator::Distribution | Integrator::Path if self.shutter_slices < 2 => 1,
            Integrator::Distribution | Integrator::Path => {
                let most = self.strata().pow(2).min(limits::SHUTTER_SLICES);
                (most / self.moments()).max(1)
            }
        }
    }

    /// Moments of a frame whose shutter is open. A Whitted picture is one moment, as it is one point of the lens.
    pub fn moments(&self) -> u32 {
        match self.integrator {
            Integrator::Whitted => 1,
            Integrator::Distribution | Integrator::Path | Integrator::Photon => {
                self.shutter_slices.min(self.strata() * self.strata())
            }
        }
    }
}

impl Check for Render {
    fn check(&self) -> Result<(), Invalid> {
        for side in self.size {
            whole("size", side.into(), 1, limits::FRAME_SIDE.into())?;
        }
        let pixels = u64::from(self.size[0]) * u64::from(self.size[1]);
        if pixels > limits::FRAME_PIXELS {
            let message = format!("a picture of {pixels} pixels is over the limit of {}", limits::FRAME_PIXELS);
            return Err(Invalid { field: "size", message });
        }
        self.check_region()?;
        whole("samples", self.samples.into(), 1, limits::SAMPLES.into())?;
        color("background", self.background)?;
        whole("max_depth", self.max_depth.into(), 1, limits::RAY_DEPTH.into())?;
        between("min_weight", self.min_weight, 0.0, 1.0)?;
        whole("shadow_samples", self.shadow_samples.into(), 1, limits::SHADOW_SAMPLES.into())?;
        at_least("light_size", self.light_size, 0.0)?;
        whole("shutter_slices", self.shutter_slices.into(), 1, limits::SHUTTER_SLICES.into())?;
        whole("photons", self.photons.into(), 1, limits::PHOTONS.into())?;
        whole("photon_passes", self.photon_passes.into(), 1, limits::SAMPLES.into())?;
        if let Some(radius) = self.photon_radius {
            above("photon_radius", radius, 0.0)?;
        }
        between("grid_density", self.grid_density, 1e-3, 1e3)?;
        if ![8, 16, 32].contains(&self.bit_depth) {
            let message = format!("`bit_depth` must be 8, 16 or 32, not {}", self.bit_depth);
            return Err(Invalid { field: "bit_depth", message });
        }
        at_least("environment_intensity", self.environment_intensity, 0.0)?;
        coordinate("environment_rotation", self.environment_rotation)?;
        self.sky.iter().flatten().try_for_each(|c| color("sky", *c))?;
        if let Some(Err(invalid)) = self.daylight.as_ref().map(|daylight| daylight.check()) {
            return Err(Invalid { field: "daylight", ..invalid });
        }
        if let Some(Err(invalid)) = self.fog.as_ref().map(|fog| fog.check()) {
            return Err(Invalid { field: "fog", ..invalid });
        }
        self.check_film()
    }
}
