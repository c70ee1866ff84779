//! The channels of an EXR file: what they are called, their values, and the digest of these.

use std::collections::BTreeMap;

use ::exr::prelude::{AnyChannel, FlatSamples, f16};

use crate::base::digest::{Digest, Hasher};
use crate::components::{Aov, Render};
use crate::film::Film;

/// Largest number of a half.
const MOST_OF_HALF: f32 = 65_504.0;
/// All layers; a file has each once, however often it is asked for.
const LAYERS: [Aov; 8] =
    [Aov::Depth, Aov::Normal, Aov::Albedo, Aov::Position, Aov::Entity, Aov::Material, Aov::Motion, Aov::Variance];

/// What a file holds of a film: colours in halves, or in floats where `bit_depth` is 32; all else in floats.
pub fn channels_of(film: &Film, render: &Render) -> Vec<AnyChannel<FlatSamples>> {
    let colors = &film.pixels;
    let mut channels: Vec<AnyChannel<FlatSamples>> = Vec::new();
    for (axis, name) in ["R", "G", "B"].into_iter().enumerate() {
        let values = colors.iter().map(|color| color[axis]);
        let samples = match render.bit_depth {
            32 => FlatSamples::F32(values.collect()),
            // What is too bright for a half is as bright as a half can be.
            _ => FlatSamples::F16(values.map(|x| f16::from_f32(x.min(MOST_OF_HALF))).collect()),
        };
        channels.push(AnyChannel::new(name, samples));
    }
    if render.transparent {
        let values = (0..colors.len()).map(|i| film.alpha(i));
        let samples = match render.bit_depth {
            32 => FlatSamples::F32(values.collect()),
            _ => FlatSamples::F16(values.map(f16::from_f32).collect()),
        };
        channels.push(AnyChannel::new("A", samples));
    }
    for aov in LAYERS {
        if render.aovs.contains(&aov) {
            channels.extend(
                columns(film, aov).into_iter().map(|(name, values)| AnyChannel::new(name, FlatSamples::F32(values))),
            );
        }
    }
    channels
}

/// Digests of the values of all channels, by name, whatever their order and the file's compression; rows are added from
/// the top.
#[derive(Default)]
pub struct ChannelDigests(BTreeMap<Vec<u8>, Hasher>);

impl ChannelDigests {
    /// Adds the values of rows.
    pub fn add(&mut self, channels: &[AnyChannel<FlatSamples>]) {
        for channel in channels {
            let hasher = self.0.entry(channel.name.as_slice().to_vec()).or_default();
            for value in channel.sample_data.values_as_f32() {
                hasher.bytes(&value.to_bits().to_le_bytes());
            }
        }
    }

    /// The digest of a picture of this size.
    pub fn finish(self, size: [u32; 2]) -> Digest {
        let mut hasher = Hasher::default();
        size.into_iter().for_each(|side| hasher.word(side.into()));
        for (name, channel) in self.0 {
            hasher.bytes(&name);
            hasher.digest(channel.finish());
        }
        hasher.finish()
    }
}

/// The channels of a layer, by name.
fn columns(film: &Film, aov: Aov) -> Vec<(&'static str, Vec<f32>)> {
    let layers = &film.layers;
    let axis = |of: &[[f32; 3]], i: usize| of.iter().map(|v| v[i]).collect();
    let side = |i: usize| layers.motion.iter().map(|v| v[i]).collect();
    let three = |names: [&'static str; 3], of: &[[f32; 3]]| (0..3).map(|i| (names[i], axis(of, i))).collect();
    // Exact: there are fewer entities and materials than 2^24.
    let numbers = |of: &[u32]| of.iter().map(|n| *n as f32).collect();
    match aov {
        Aov::Depth => vec![("Z", layers.depth.clone())],
        Aov::Normal => three(["N.X", "N.Y", "N.Z"], &layers.normal),
        Aov::Albedo => three(["albedo.R", "albedo.G", "albedo.B"], &layers.albedo),
        Aov::Position => three(["P.X", "P.Y", "P.Z"], &layers.position),
        Aov::Entity => vec![("entityId", numbers(&layers.entity))],
        Aov::Material => vec![("materialId", numbers(&layers.material))],
        Aov::Motion => vec![("motion.X", side(0)), ("motion.Y", side(1))],
        Aov::Variance => vec![("variance", layers.variance.clone())],
    }
}
