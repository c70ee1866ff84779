//! How the picture is made: the settings of a scene.

use glam::DVec3;

use super::record::ranges::{at_least, between, color, whole};
use super::record::{Check, Invalid, choice, record};
use super::value::Text;
use crate::base::limits;

choice! {
    /// Which light paths are followed.
    pub enum Integrator {
        /// Whitted (CACM 1980): sharp mirrors and refraction, hard shadows, a pinhole camera.
        Whitted,
        /// Cook, Porter and Carpenter (SIGGRAPH 1984): soft shadows, gloss and the lens, by sampling.
        Distribution,
        /// Kajiya (SIGGRAPH 1986): light that bounces between diffuse surfaces too, one way at a time.
        Path,
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
        /// The one that is estimated to be the fastest.
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
        pub size: [u32; 2] = [640, 360],
        /// Samples per pixel, rounded down to a square n x n of jittered strata; 1 is the pixel centre.
        pub samples: u32 = 16,
        pub integrator: Integrator = Integrator::Distribution,
        /// Colour of rays that leave the scene, linear.
        pub background: DVec3 = DVec3::ZERO,
        /// Folder of a cube map (right, left, top, bottom, front, back), relative to the scene; over `background`.
        pub environment: Option<Text> = None,
        /// Longest chain of rays, the camera's included: 1 shows no reflection.
        pub max_depth: u32 = 6,
        pub shadows: Shadows = Shadows::Auto,
        /// Points on each light where `Fixed` shadows are used, rounded down to a square.
        pub shadow_samples: u32 = 16,
        /// Side of the square, in the world's xy directions, that point lights are widened to for soft shadows.
        pub light_size: f64 = 0.0,
        /// Whether transparent surfaces let light through to what they shade, dimmed by `transmission` at each; they
        /// block it otherwise, as in the ancestors.
        pub transparent_shadows: bool = false,
        pub fresnel: Fresnel = Fresnel::Exact,
        /// Seed of all sampling; follows from the camera's pose when not given.
        pub seed: Option<u64> = None,
        pub accel: Accel = Accel::Auto,
        /// Cells of the grid per primitive: the density of Woo's resolution rule. Blocks of eight want coarse cells.
        pub grid_density: f64 = 1.0,
        /// Bits per channel of the picture file, 8 or 16.
        pub bit_depth: u32 = 8,
        pub transfer: Transfer = Transfer::Srgb,
    }
}

impl Render {
    /// Side n of the n x n strata of a pixel.
    pub fn strata(&self) -> u32 {
        self.samples.isqrt().max(1)
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
        whole("samples", self.samples.into(), 1, limits::SAMPLES.into())?;
        color("background", self.background)?;
        whole("max_depth", self.max_depth.into(), 1, limits::RAY_DEPTH.into())?;
        whole("shadow_samples", self.shadow_samples.into(), 1, limits::SHADOW_SAMPLES.into())?;
        at_least("light_size", self.light_size, 0.0)?;
        between("grid_density", self.grid_density, 1e-3, 1e3)?;
        if self.bit_depth != 8 && self.bit_depth != 16 {
            let message = format!("`bit_depth` must be 8 or 16, not {}", self.bit_depth);
            return Err(Invalid { field: "bit_depth", message });
        }
        Ok(())
    }
}
