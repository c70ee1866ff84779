//! What is kept of pictures while the camera stands still: the sums of the tiles, and what their rays touched.

use super::bodies::Body;
use super::render::tile_count;
use crate::film::Tally;
use crate::trace::Geometry;
use crate::trace::footprint::{Boxes, Footprint};
use crate::trace::geometry::Bounds;

/// Pictures that differ in bodies alone, as data: where each body is in each of them.
#[derive(Debug, Default)]
pub struct Scenes {
    pub boxes: Boxes,
    /// By picture and body: the number of the box, which stands for a body in one state at one place.
    states: Vec<Vec<Option<u32>>>,
}

impl Scenes {
    /// `bodies` by picture, the same ones in each; `None` if one of them may show everywhere, or if there are more
    /// than `most` states.
    pub fn new(bodies: &[Vec<Body>], most: usize) -> Option<Scenes> {
        let count = bodies.first()?.len();
        let mut places = Vec::new();
        let mut states = vec![vec![None; count]; bodies.len()];
        for body in 0..count {
            let first_place = places.len();
            let mut known = Vec::new();
            let mut meshes = Vec::new();
            for (picture, all) in bodies.iter().enumerate() {
                let mesh = match &all[body] {
                    Body::Everywhere => return None,
                    Body::Nothing => None,
                    Body::Bounded { digest, bounds, mesh } => {
                        let number = known.iter().position(|one| one == digest).unwrap_or_else(|| {
                            known.push(*digest);
                            places.push(*bounds);
                            known.len() - 1
                        });
                        states[picture][body] = Some((first_place + number) as u32);
                        *mesh
                    }
                };
                meshes.push(mesh);
            }
            if places.len() > most || meshes.iter().any(|mesh| *mesh != meshes[0]) {
                return None;
            }
        }
        Some(Scenes { boxes: Boxes::new(&places), states })
    }

    pub fn pictures(&self) -> usize {
        self.states.len()
    }

    /// Whether rays that crossed what the footprint has in one picture meet the same in another.
    fn is_same(&self, footprint: &Footprint, then: usize, now: usize) -> bool {
        let is_clear = |state: Option<u32>| state.is_none_or(|number| !footprint.has(number as usize));
        self.states[then].iter().zip(&self.states[now]).all(|(a, b)| a == b || is_clear(*a) && is_clear(*b))
    }
}

/// A tile as it was traced last.
#[derive(Debug)]
struct Kept {
    tally: Tally,
    footprint: Footprint,
    picture: usize,
    /// Where all finite primitives were.
    bounds: Bounds,
}

/// Tiles that are kept from picture to picture.
#[derive(Debug, Default)]
pub struct Still {
    scenes: Scenes,
    tiles: Vec<Option<Kept>>,
}

impl Still {
    /// For pictures of this width and height.
    pub fn new(scenes: Scenes, size: [u32; 2]) -> Self {
        Still { scenes, tiles: (0..tile_count(size)).map(|_| None).collect() }
    }

    pub fn boxes(&self) -> &Boxes {
        &self.scenes.boxes
    }

    /// Tiles that may look otherwise in a picture than they did when they were traced last; `bounds` are those of its
    /// finite primitives. With `by_bounds` all do, if those are others than before.
    pub fn stale(&self, picture: usize, bounds: Bounds, by_bounds: bool) -> Vec<usize> {
        let is_same = |kept: &Kept| {
            let is_near = |bounds| Geometry::is_near(bounds, kept.footprint.origins());
            let starts_alike = kept.bounds == bounds || !by_bounds && is_near(bounds) && is_near(kept.bounds);
            starts_alike && self.scenes.is_same(&kept.footprint, kept.picture, picture)
        };
        let tiles = self.tiles.iter().enumerate();
        tiles.filter(|(_, tile)| !tile.as_ref().is_some_and(is_same)).map(|(index, _)| index).collect()
    }

    pub fn keep(&mut self, tile: usize, tally: Tally, footprint: Footprint, picture: usize, bounds: Bounds) {
        self.tiles[tile] = Some(Kept { tally, footprint, picture, bounds });
    }

    /// Fills in the sums of the tiles that are not stale; gives which of all tiles are.
    pub fn fill(&self, tallies: &mut [Tally], stale: &[usize]) -> Vec<bool> {
        let mut is_stale = vec![false; tallies.len()];
        stale.iter().for_each(|tile| is_stale[*tile] = true);
        for ((tally, kept), _) in tallies.iter_mut().zip(&self.tiles).zip(&is_stale).filter(|(_, stale)| !**stale) {
            if let Some(kept) = kept {
                tally.clone_from(&kept.tally);
            }
        }
        is_stale
    }

    pub fn bytes(&self) -> usize {
        let tile = |kept: &Kept| kept.tally.bytes() + kept.footprint.bytes() + size_of::<Option<Kept>>();
        self.tiles.iter().flatten().map(tile).sum()
    }
}
