//! Frames that differ in the colours of what shines alone, and what they share.
//!
//! Light adds up: where nothing changes but the colours of some lights, of materials that shine or of what lies around
//! the scene, one pass for each of these and one for all the rest make every frame as a weighted sum (as light mixing
//! does; Jevans 1992 is of the same mind about objects). In its pass each shines in a grey that is the same for all
//! frames of the group, so that the chances to ask for its light are too.
//! A frame that belongs to such a group is always made so, alone or among others: the group follows from the script as a
//! whole, so that the sum is the same to the bit, whichever frames are wanted and whatever is kept of the passes.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;

use super::outline::{Outline, Rest, Shine};
use crate::base::digest::{Digest, Hasher};
use crate::base::limits;
use crate::systems::{Passes, Shiner};

/// The passes that the frames of a group are sums of.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// The digest of what the frames have in common and of how they are divided into passes.
    pub hash: Digest,
    pub passes: Passes,
}

impl Group {
    /// What each pass but the first counts for in a frame.
    pub fn factors(&self, rest: &Rest, outline: &Outline) -> Vec<Vec3> {
        let factor = |(shiner, unit): &(Shiner, f32)| color_in(rest, &outline.shines, *shiner).as_vec3() / *unit;
        self.passes.shiners.iter().map(factor).collect()
    }

    /// The hash of one of its frames: the sum is not, to the bit, what one pass for all would be.
    pub fn hash_of(&self, outline: &Outline) -> Digest {
        let mut hasher = Hasher::default();
        hasher.digest(outline.hash());
        hasher.digest(self.hash);
        hasher.finish()
    }
}

fn color_in(rest: &Rest, shines: &[Shine], shiner: Shiner) -> DVec3 {
    let own = shines.iter().find(|shine| shine.shiner == shiner).map(|shine| shine.color);
    own.or(rest.rest_color(shiner)).unwrap_or(DVec3::ZERO)
}

/// Groups by what their frames have in common.
pub type Groups = FxHashMap<Digest, Arc<Group>>;

/// Finds the groups of a sequence; of each frame of it, not only of those that are wanted.
pub fn find<'a>(rest: &Rest, frames: impl Iterator<Item = &'a Outline>) -> Groups {
    let mut alike: FxHashMap<Digest, Vec<&[Shine]>> = FxHashMap::default();
    for outline in frames.filter(|outline| outline.is_sum) {
        alike.entry(outline.hash_without_colors()).or_default().push(&outline.shines);
    }
    alike.into_iter().filter_map(|(hash, frames)| Some((hash, Arc::new(group(rest, hash, &frames)?)))).collect()
}

fn group(rest: &Rest, common: Digest, frames: &[&[Shine]]) -> Option<Group> {
    let mut shiners: Vec<Shiner> = frames.iter().flat_map(|shines| shines.iter().map(|shine| shine.shiner)).collect();
    shiners.sort();
    shiners.dedup();
    let mut passes = Passes::default();
    let mut hasher = Hasher::default();
    hasher.digest(common);
    for shiner in shiners {
        let colors = || frames.iter().map(|shines| color_in(rest, shines, shiner));
        let brightest = colors().fold(0.0, |most: f64, color| most.max(color.max_element()));
        if colors().all(|one| one == color_in(rest, frames[0], shiner)) || brightest == 0.0 {
            continue;
        }
        let unit = power_of_two_above(brightest);
        passes.shiners.push((shiner, unit));
        let (word, number) = match shiner {
            Shiner::Lamp(entity, kind) => (kind.name(), entity),
            Shiner::Material(number) => ("material", number),
            Shiner::Surround => ("surround", 0),
        };
        hasher.word(number as u64);
        hasher.text(word);
        hasher.number(unit.into());
    }
    let count = passes.shiners.len();
    (1..=limits::LIGHT_PASSES).contains(&count).then(|| Group { hash: hasher.finish(), passes })
}

/// The unit that a light shines with in its own pass: a power of two, so that dividing by it is exact and small edits
/// leave it as it is.
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
    fn units_are_powers_of_two_that_hold_the_brightest() {
        for (brightest, unit) in [(1.0, 1.0), (0.9, 1.0), (0.5, 0.5), (6.0, 8.0), (1e-3, 1.0 / 512.0), (700.0, 1024.0)]
        {
            assert_eq!(power_of_two_above(brightest), unit, "{brightest}");
        }
    }
}
