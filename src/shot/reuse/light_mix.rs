//! Frames that differ only in the colours of what emits light, and what they share.
//!
//! Light adds up. If nothing changes but the colours of some lights, of emissive materials or of the environment, then
//! one light group for each of these and one for all the rest give every frame as a weighted sum (the light mixing of
//! production renderers; Jevans 1992 does the same for objects). In its light group each emitter has a grey that is the
//! same in all frames of the mix, so that the probabilities of sampling it are the same too.
//!
//! A frame that belongs to a mix is always made so, alone or among others: the mix follows from the window of
//! [`WINDOW`] frames that the frame's number falls into, so that the sum has the same bits whichever frames are wanted and
//! whatever is kept of the light groups. One frame of a long sequence costs the evaluation of its window, not of the
//! whole; a sequence that is no longer than a window is one.
//!
//! # The way of a light's colour
//!
//! 1. [`Fingerprint::emitter_colors`](crate::shot::fingerprint::Fingerprint): each frame as data knows which emitters
//!    ([`EmitterId`]) have another colour than in the base scene, and its hash without all colours.
//! 2. [`find`] (here): frames whose hashes without colours are equal form a [`LightMix`]; each emitter that changes gets a
//!    light group of its own and a unit, a power of two above its brightest colour.
//! 3. [`systems::PartialFrame::light_groups`](crate::systems::PartialFrame): the frame that is traced first is given the
//!    [`LightGroups`]. They replace the emitter's colour by its grey unit and say the number of its group: of lamps in
//!    `LightGroups::assign_light`, of materials in [`LightGroups::assign_materials`], of the environment in
//!    [`LightGroups::assign_environment`].
//! 4. [`crate::trace`]: every contribution is added to the accumulator of the group that the light or material that it
//!    came from carries. Group 0 is all the rest.
//! 5. [`systems::PartialFrame::resolve`](crate::systems::PartialFrame::resolve) gives a film for each group,
//!    [`LightMix::factors`] (here) the colour over the unit, and
//!    [`systems::weighted_sum`](crate::systems::weighted_sum) the frame. The films are kept in
//!    [`ReuseCache`](super::ReuseCache) for the other frames of the mix.

use std::ops::RangeInclusive;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;

use crate::base::digest::{Digest, Hasher};
use crate::base::limits;
use crate::components::Render;
use crate::shot::fingerprint::{BaseFingerprint, EmitterColor, Fingerprint};
use crate::systems::{EmitterId, LightGroups};

/// Frames among which mixes are found: 1 to 64, 65 to 128, and so on. Part of what decides pixels.
pub const WINDOW: u32 = 64;

/// The window that a frame falls into, from 0; frames count from 1.
pub fn window_of(frame: u32) -> u32 {
    (frame - 1) / WINDOW
}

/// The frames of a window, in a sequence of so many.
pub fn frames_of(window: u32, frames: u32) -> RangeInclusive<u32> {
    window * WINDOW + 1..=frames.min((window + 1) * WINDOW)
}

/// The light groups that some frames are sums of.
#[derive(Clone, Debug, PartialEq)]
pub struct LightMix {
    /// The digest of what the frames have in common and of how they are divided into light groups.
    pub hash: Digest,
    /// Emitters with a light group of their own.
    pub light_groups: LightGroups,
}

impl LightMix {
    /// The factor of each light group but the first in a frame.
    pub fn factors(&self, base: &BaseFingerprint, fingerprint: &Fingerprint) -> Vec<Vec3> {
        let factor = |(emitter, unit): &(EmitterId, f32)| color_in(base, fingerprint, *emitter).as_vec3() / *unit;
        self.light_groups.emitters.iter().map(factor).collect()
    }

    /// The settings of one of its frames; `render` are those of any of them, which differ in the environment's colour.
    pub fn settings(&self, base: &BaseFingerprint, fingerprint: &Fingerprint, render: &Render) -> Render {
        render.clone().with_environment_color(color_in(base, fingerprint, EmitterId::Environment))
    }

    /// The hash of one of its frames: the sum does not have the bits that tracing all lights at once would give.
    pub fn hash_of(&self, fingerprint: &Fingerprint) -> Digest {
        let mut hasher = Hasher::default();
        hasher.digest(fingerprint.hash());
        hasher.digest(self.hash);
        hasher.finish()
    }
}

fn color_in(base: &BaseFingerprint, fingerprint: &Fingerprint, emitter: EmitterId) -> DVec3 {
    let own = fingerprint.emitter_colors.iter().find(|one| one.emitter == emitter).map(|one| one.color);
    own.or(base.emitter_color(emitter)).unwrap_or(DVec3::ZERO)
}

/// Mixes by the hash that their frames have without the colours of emitters.
pub type LightMixes = FxHashMap<Digest, Arc<LightMix>>;

/// Finds the mixes of a window; `frames` are all of its frames, not only those that are wanted.
pub fn find<'a>(base: &BaseFingerprint, frames: impl Iterator<Item = &'a Fingerprint>) -> LightMixes {
    let mut alike: FxHashMap<Digest, Vec<&Fingerprint>> = FxHashMap::default();
    for fingerprint in frames.filter(|fingerprint| fingerprint.is_sum) {
        alike.entry(fingerprint.hash_without_colors()).or_default().push(fingerprint);
    }
    alike.into_iter().filter_map(|(hash, frames)| Some((hash, Arc::new(mix_of(base, hash, &frames)?)))).collect()
}

/// The mix of frames with a common hash; `None` if no colour changes, or too many do.
fn mix_of(base: &BaseFingerprint, common: Digest, frames: &[&Fingerprint]) -> Option<LightMix> {
    let all_colors = frames.iter().flat_map(|frame| &frame.emitter_colors);
    let mut emitters: Vec<EmitterId> = all_colors.map(|one: &EmitterColor| one.emitter).collect();
    emitters.sort();
    emitters.dedup();
    let mut light_groups = LightGroups::default();
    let mut hasher = Hasher::default();
    hasher.digest(common);
    for emitter in emitters {
        let colors = || frames.iter().map(|frame| color_in(base, frame, emitter));
        let brightest = colors().fold(0.0, |most: f64, color| most.max(color.max_element()));
        if colors().all(|one| one == color_in(base, frames[0], emitter)) || brightest == 0.0 {
            continue;
        }
        let unit = power_of_two_above(brightest);
        light_groups.emitters.push((emitter, unit));
        // Part of the hash that files carry: these words stay as they are.
        let (word, number) = match emitter {
            EmitterId::Lamp(entity, kind) => (kind.name(), entity),
            EmitterId::Material(number) => ("material", number),
            EmitterId::Environment => ("surround", 0),
        };
        hasher.word(number as u64);
        hasher.text(word);
        hasher.number(unit.into());
    }
    let count = light_groups.emitters.len();
    (1..=limits::LIGHT_GROUPS).contains(&count).then(|| LightMix { hash: hasher.finish(), light_groups })
}

/// The unit of an emitter in its own light group: a power of two, so that dividing by it is exact, and the same after
/// small edits.
fn power_of_two_above(brightest: f64) -> f32 {
    let mut unit = 1.0f32;
    while f64::from(unit) < brightest && unit < 1e30 {
        unit *= 2.0;
    }
    while f64::from(unit) * 0.5 >= brightest && unit > 1e-30 {
        unit *= 0.5;
    }
    unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_hold_every_frame_once() {
        let all: Vec<u32> = (0..=window_of(130)).flat_map(|window| frames_of(window, 130)).collect();
        assert_eq!(all, (1..=130).collect::<Vec<_>>());
        assert!((1..=130).all(|frame| frames_of(window_of(frame), 130).contains(&frame)));
        assert_eq!([1, 64, 65, 128, 129].map(window_of), [0, 0, 1, 1, 2]);
    }

    #[test]
    fn units_are_powers_of_two_that_hold_the_brightest() {
        for (brightest, unit) in [(1.0, 1.0), (0.9, 1.0), (0.5, 0.5), (6.0, 8.0), (1e-3, 1.0 / 512.0), (700.0, 1024.0)]
        {
            assert_eq!(power_of_two_above(brightest), unit, "{brightest}");
        }
    }
}
