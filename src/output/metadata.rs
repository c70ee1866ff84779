//! What a picture says of its making: nothing of the machine, the time, or the way it was found.

use serde::{Deserialize, Serialize};

use crate::base::digest::Digest;
use crate::components::{FieldClass, Record, Render};

/// What a picture says of its making: keyword and text, in order.
pub type Metadata = Vec<(String, String)>;

/// What a frame's file holds, beside its pixels.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// File name of the script or scene.
    pub source: String,
    /// Number of the frame, from 1.
    pub frame: u32,
    /// Digest of all that decides the pixels.
    #[serde(with = "hex")]
    pub hash: Digest,
}

/// Digests as text in serde.
pub(super) mod hex {
    use crate::base::digest::Digest;
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<S: Serializer>(digest: &Digest, s: S) -> Result<S::Ok, S::Error> {
        s.collect_str(digest)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Digest, D::Error> {
        String::deserialize(d)?.parse().map_err(|()| D::Error::custom("not a digest"))
    }
}

/// The keyword of the frame's hash.
pub(super) const HASH: &str = "Hash";
/// The keyword of the digest of the picture's pixels: a frame's file says what it shows, so that what another tool has
/// changed is known from what it has only packed otherwise.
pub const PIXELS: &str = "Pixels";

/// The keyword of the hash of the whole frame, in the file of a part of it.
pub(super) const WHOLE: &str = "Whole";

/// Says which whole frame a part is of.
pub fn with_whole(mut metadata: Metadata, whole: Option<Digest>) -> Metadata {
    metadata.extend(whole.map(|whole| entry(WHOLE, whole.to_string())));
    metadata
}

/// The text under a keyword.
pub(super) fn text_under<'a>(metadata: &'a Metadata, keyword: &str) -> Option<&'a str> {
    metadata.iter().find(|(known, _)| known == keyword).map(|(_, text)| text.as_str())
}

/// The metadata with the digest of the pixels, of the file of a frame; others need not say what they show.
pub(super) fn with_pixels(metadata: &Metadata, digest: impl FnOnce() -> Digest) -> Metadata {
    let mut metadata = metadata.clone();
    if text_under(&metadata, HASH).is_some() {
        metadata.push(entry(PIXELS, digest().to_string()));
    }
    metadata
}

fn entry(keyword: &str, text: impl Into<String>) -> (String, String) {
    (keyword.to_string(), text.into())
}

/// The metadata by which a picture says what it is; those of a frame's file start with them.
pub fn provenance_metadata(provenance: &Provenance) -> Metadata {
    vec![
        entry("Software", concat!("anim ", env!("CARGO_PKG_VERSION"))),
        entry("Source", &*provenance.source),
        entry("Frame", provenance.frame.to_string()),
        entry(HASH, provenance.hash.to_string()),
    ]
}

/// All metadata of a frame's file.
pub fn frame_metadata(provenance: &Provenance, seed: u64, render: &Render) -> Metadata {
    let mut metadata = provenance_metadata(provenance);
    metadata.push(entry("Seed", seed.to_string()));
    metadata.push(entry("Settings", settings_text(render)));
    metadata
}

/// Settings that are always named, since people look for them.
const ALWAYS: [&str; 4] = ["size", "samples", "integrator", "max_depth"];

/// The settings that decide a picture's pixels, as one line of `name=value`: the usual ones, then all that differ from
/// their defaults, in declared order. What does not show, as the accelerator, is not among them.
pub fn settings_text(render: &Render) -> String {
    let default = Render::default();
    let mut words = Vec::new();
    for (field, class) in Render::FIELDS.iter().zip(Render::CLASSES) {
        let (value, usual) = (render.get(field), default.get(field));
        let is_named = ALWAYS.contains(field) || value != usual;
        if let Some(value) = value.filter(|_| is_named && *class != FieldClass::Invisible) {
            words.push(format!("{field}={value}"));
        }
    }
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::components::{Accel, Aov, ToneMap};
    use glam::DVec3;

    #[test]
    fn settings_name_all_that_decides_pixels() {
        let text = settings_text(&Render::default());
        assert_eq!(text, "size=[640,360] samples=16 integrator=Distribution max_depth=6");
        let render = Render {
            background: DVec3::new(0.1, 0.0, 2.0),
            environment: Some("my sky.hdr".into()),
            tone_map: ToneMap::AgX,
            aovs: vec![Aov::Depth, Aov::Normal],
            photons: 7,
            clamp: Some(2.5),
            sky: Some([DVec3::ONE, DVec3::X, DVec3::ZERO]),
            accel: Accel::Grid,
            grid_density: 4.0,
            ..Render::default()
        };
        assert_eq!(
            settings_text(&render),
            "size=[640,360] samples=16 integrator=Distribution background=[0.1,0,2] environment=\"my sky.hdr\" max_depth=6 \
             clamp=2.5 tone_map=AgX aovs=[Depth,Normal] sky=[[1,1,1],[1,0,0],[0,0,0]] photons=7"
        );
    }
}
