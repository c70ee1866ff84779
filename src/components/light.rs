//! Lights without a surface. An object that emits light has a material with `emission`.

use glam::{DVec2, DVec3};

use super::record::ranges::{color, position};
use super::record::{Check, Invalid, choice, record};

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

record! {
    /// A light at a point.
    pub struct PointLight {
        /// Position, local space.
        pub position: DVec3 = DVec3::ZERO,
        /// Linear intensity, 0 and up.
        pub color: DVec3 = DVec3::ONE => EmittedColor,
        /// How it weakens with distance.
        pub falloff: Falloff = Falloff::Constant,
    }
}

impl Check for PointLight {
    fn check(&self) -> Result<(), Invalid> {
        position("position", self.position)?;
        color("color", self.color)
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
        color("color", self.color)
    }
}
