//! The parts of a frame, and their digests.

use crate::base::digest::Digest;

/// What a frame is made of, and so what can change from one frame to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FramePart {
    /// Where the camera stands, what it sees, and its shutter.
    Camera,
    /// Lens and focus of the camera.
    Lens,
    /// Settings of the picture that show.
    Settings,
    /// Which entities there are, and their shapes.
    Geometry,
    /// Where entities without lights stand.
    Transforms,
    /// Materials that entities have, and textures.
    Materials,
    /// Where lights are, their size and falloff.
    Lights,
    /// Colours of lights, of emissive materials, and of the environment.
    LightColors,
    /// Camera and placements of the frame before, where motion is a layer.
    Before,
}

impl FramePart {
    /// In the order of the enum: a part is its own index.
    pub const ALL: [FramePart; 9] = [
        FramePart::Camera,
        FramePart::Lens,
        FramePart::Settings,
        FramePart::Geometry,
        FramePart::Transforms,
        FramePart::Materials,
        FramePart::Lights,
        FramePart::LightColors,
        FramePart::Before,
    ];

    /// The word for it in reports.
    pub fn word(self) -> &'static str {
        match self {
            FramePart::Camera => "camera",
            FramePart::Lens => "lens",
            FramePart::Settings => "settings",
            FramePart::Geometry => "geometry",
            FramePart::Transforms => "transforms",
            FramePart::Materials => "materials",
            FramePart::Lights => "lights",
            FramePart::LightColors => "light_colors",
            FramePart::Before => "before",
        }
    }
}

/// A digest of each part; those of a scene are sums over its members.
pub type PartDigests = [Digest; FramePart::ALL.len()];

pub fn with(sums: PartDigests, parts: PartDigests) -> PartDigests {
    std::array::from_fn(|i| sums[i].with(parts[i]))
}

pub fn without(sums: PartDigests, parts: PartDigests) -> PartDigests {
    std::array::from_fn(|i| sums[i].without(parts[i]))
}
