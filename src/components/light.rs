//! Lights without a surface. An object that emits light has a material with `emission`.

use glam::{DVec2, DVec3};

use super::record::ranges::{at_least, between, color, direction, position};
use super::record::{Check, Invalid, choice, record};
use crate::base::color::black_body;

choice! {
    /// How a light weakens with distance.
    pub enum Falloff {
        /// Not at all, as in the NFF and P3F tracers.
        Constant,
        /// With the inverse square of the distance in world units; `color` is what arrives at distance 1. A point of
        /// colour c then has the intensity pi c, an area light of area A the radiance pi c / A to both sides.
        InverseSquare,
    }
}

/// What is sent, of a colour with its factors.
fn sent(color: DVec3, intensity: f64, temperature: Option<f64>) -> DVec3 {
    let tint = temperature.map_or(DVec3::ONE, |kelvin| DVec3::from_array(black_body(kelvin)));
    color * intensity * tint
}

fn emission(intensity: f64, temperature: Option<f64>) -> Result<(), Invalid> {
    at_least("intensity", intensity, 0.0)?;
    temperature.map_or(Ok(()), |kelvin| between("temperature", kelvin, 1e3, 4e4))
}

/// What a light sends: its colour, with all that changes it.
macro_rules! emitted {
    ($($light:ident),*) => {
        $(impl $light {
            /// Its linear colour with intensity and temperature in it.
            pub fn emitted(&self) -> DVec3 {
                sent(self.color, self.intensity, self.temperature)
            }
        })*
    };
}
emitted!(PointLight, SpotLight, DirectionalLight, AreaLight);

record! {
    /// A light at a point.
    pub struct PointLight {
        /// Position, local space.
        pub position: DVec3 = DVec3::ZERO,
        /// Linear intensity, 0 and up.
        pub color: DVec3 = DVec3::ONE => EmittedColor,
        /// Factor of `color`, 0 and up.
        pub intensity: f64 = 1.0 => EmittedColor,
        /// Kelvin, 1000 to 40000: tints `color` as a glowing body of that temperature is, as bright as before. A candle has
        /// 1900, a bulb 2800, daylight about 6500.
        pub temperature: Option<f64> = None => EmittedColor,
        /// How it weakens with distance.
        pub falloff: Falloff = Falloff::Constant,
    }
}

impl Check for PointLight {
    fn check(&self) -> Result<(), Invalid> {
        position("position", self.position)?;
        color("color", self.color)?;
        emission(self.intensity, self.temperature)
    }
}

record! {
    /// A light at a point that shines into a cone.
    pub struct SpotLight {
        /// Position, local space.
        pub position: DVec3 = DVec3::ZERO,
        /// Along the middle of the cone, local space, of any length but 0.
        pub direction: DVec3 = DVec3::NEG_Z,
        /// Linear intensity in the middle of the cone, 0 and up.
        pub color: DVec3 = DVec3::ONE => EmittedColor,
        /// Factor of `color`, 0 and up.
        pub intensity: f64 = 1.0 => EmittedColor,
        /// Kelvin, 1000 to 40000: tints `color` as a glowing body of that temperature is, as bright as before. A candle has
        /// 1900, a bulb 2800, daylight about 6500.
        pub temperature: Option<f64> = None => EmittedColor,
        /// Degrees from the middle, 0 to 90, from where on it is dark.
        pub outer_angle: f64 = 45.0,
        /// Degrees from the middle, 0 to `outer_angle`, up to where it is as bright as in the middle. From there on it
        /// fades with the square of the cosine's share.
        pub inner_angle: f64 = 30.0,
        /// How it weakens with distance.
        pub falloff: Falloff = Falloff::Constant,
    }
}

impl Check for SpotLight {
    fn check(&self) -> Result<(), Invalid> {
        position("position", self.position)?;
        direction("direction", self.direction)?;
        color("color", self.color)?;
        emission(self.intensity, self.temperature)?;
        between("outer_angle", self.outer_angle, 0.0, 90.0)?;
        if self.outer_angle == 0.0 {
            return Err(Invalid { field: "outer_angle", message: "`outer_angle` must be greater than 0".into() });
        }
        between("inner_angle", self.inner_angle, 0.0, self.outer_angle)
    }
}

record! {
    /// Light that comes from one direction from far away, as the sun's.
    pub struct DirectionalLight {
        /// The way that the light goes, local space, of any length but 0.
        pub direction: DVec3 = DVec3::NEG_Z,
        /// What arrives where the light falls straight, linear, 0 and up.
        pub color: DVec3 = DVec3::ONE => EmittedColor,
        /// Factor of `color`, 0 and up.
        pub intensity: f64 = 1.0 => EmittedColor,
        /// Kelvin, 1000 to 40000: tints `color` as a glowing body of that temperature is, as bright as before. A candle has
        /// 1900, a bulb 2800, daylight about 6500.
        pub temperature: Option<f64> = None => EmittedColor,
        /// How wide it looks, in degrees, 0 to 90: the edges of its shadows are as soft. The sun has 0.53.
        pub angle: f64 = 0.0,
    }
}

impl Check for DirectionalLight {
    fn check(&self) -> Result<(), Invalid> {
        direction("direction", self.direction)?;
        color("color", self.color)?;
        emission(self.intensity, self.temperature)?;
        between("angle", self.angle, 0.0, 90.0)
    }
}

record! {
    /// A parallelogram that emits light from all its points, to both sides.
    ///
    /// It lies in the local xz plane around `position`, unless `edges` say otherwise.
    pub struct AreaLight {
        /// Centre, local space.
        pub position: DVec3 = DVec3::ZERO,
        /// Width along local x and depth along local z, above 0.
        pub size: DVec2 = DVec2::ONE,
        /// Its two edges, local space; take the place of `size`.
        pub edges: Option<[DVec3; 2]> = None,
        /// Linear intensity of the whole light, 0 and up.
        pub color: DVec3 = DVec3::ONE => EmittedColor,
        /// Factor of `color`, 0 and up.
        pub intensity: f64 = 1.0 => EmittedColor,
        /// Kelvin, 1000 to 40000: tints `color` as a glowing body of that temperature is, as bright as before. A candle has
        /// 1900, a bulb 2800, daylight about 6500.
        pub temperature: Option<f64> = None => EmittedColor,
        /// How it weakens with distance.
        pub falloff: Falloff = Falloff::Constant,
        /// Whether camera rays see it, where they are traced by `Path` and it falls off with the square of the distance.
        /// Rays that left a surface meet it either way.
        pub visible: bool = false,
    }
}

impl AreaLight {
    /// The two edge vectors, local space.
    pub fn edge_vectors(&self) -> [DVec3; 2] {
        self.edges.unwrap_or([DVec3::X * self.size.x, DVec3::Z * self.size.y])
    }
}

impl Check for AreaLight {
    fn check(&self) -> Result<(), Invalid> {
        position("position", self.position)?;
        position("size", self.size.extend(0.0))?;
        if self.size.x < 0.0 || self.size.y < 0.0 {
            return Err(Invalid { field: "size", message: "`size` must not be negative".into() });
        }
        self.edges.iter().flatten().try_for_each(|e| position("edges", *e))?;
        let [a, b] = self.edge_vectors();
        if a.cross(b) == DVec3::ZERO {
            let field = if self.edges.is_some() { "edges" } else { "size" };
            let message = format!("`{field}` must span an area: a light without one is a `point_light`");
            return Err(Invalid { field, message });
        }
        color("color", self.color)?;
        emission(self.intensity, self.temperature)
    }
}
