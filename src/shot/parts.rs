//! The parts of a frame, and their digests.

use crate::base::digest::Digest;

/// What a frame is made of, and so what can change from one frame to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    Camera,
    Lens,
    Settings,
    Geometry,
    Transforms,
    Materials,
    /// Where lights are, their size and falloff.
    Lights,
    /// Of lights, of what else shines, and of what lies around the scene.
    LightColors,
    /// Camera and placements of the frame before, where motion is a layer.
    Before,
}

impl Part {
    /// In the order of the enum: a part is its own index.
    pub const ALL: [Part; 9] = [
        Part::Camera,
        Part::Lens,
        Part::Settings,
        Part::Geometry,
        Part::Transforms,
        Part::Materials,
        Part::Lights,
        Part::LightColors,
        Part::Before,
    ];

    /// The word for it in reports.
    pub fn word(self) -> &'static str {
        match self {
            Part::Camera => "camera",
            Part::Lens => "lens",
            Part::Settings => "settings",
            Part::Geometry => "geometry",
            Part::Transforms => "transforms",
            Part::Materials => "materials",
            Part::Lights => "lights",
            Part::LightColors => "light_colors",
            Part::Before => "before",
        }
    }
}

/// A digest of each part; those of a scene are sums over its members.
pub type Parts = [Digest; Part::ALL.len()];

pub fn with(sums: Parts, parts: Parts) -> Parts {
    std::array::from_fn(|i| sums[i].with(parts[i]))
}

pub fn without(sums: Parts, parts: Parts) -> Parts {
    std::array::from_fn(|i| sums[i].without(parts[i]))
}
