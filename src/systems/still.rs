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
    /// By picture and body: the number of its state; none where it is not there.
    states: Vec<Vec<Option<u32>>>,
    /// The box that a state lies in.
    box_of: Vec<u32>,
}

impl Scenes {
    /// `bodies` by picture, the same ones in each; `None` if one of them may show everywhere, or if more than `most`
    /// boxes are needed. Each state of a body has a box of its own, or else all that a body has share one.
    pub fn new(bodies: &[Vec<Body>], most: usize) -> Option<Scenes> {
        let count = bodies.first()?.len();
        let mut places: Vec<(usize, Bounds)> = Vec::new();
        let mut states = vec![vec![None; count]; bodies.len()];
        for body in 0..count {
            let first_state = places.len();
            let mut known = Vec::new();
            let mut meshes = Vec::new();
            for (picture, all) in bodies.iter().enumerate() {
                let mesh = match &all[body] {
                    Body::Everywhere => return None,
                    Body::Nothing => None,
                    Body::Bounded { digest, bounds, mesh } => {
                        let number = known.iter().position(|one| one == digest).unwrap_or_else(|| {
                            known.push(*digest);
                            places.push((body, *bounds));
                            known.len() - 1
                        });
                        states[picture][body] = Some((first_state + number) as u32);
                        *mesh
                    }
                };
                meshes.push(mesh);
            }
            if meshes.iter().any(|mesh| *mesh != meshes[0]) {
                return None;
            }
        }
        let (boxes, box_of): (Vec<Bounds>, Vec<u32>) = if places.len() <= most {
            places.iter().enumerate().map(|(number, (_, bounds))| (*bounds, number as u32)).unzip()
        } else if count <= most {
            let mut whole = vec![Bounds::default(); count];
            places.iter().for_each(|(body, bounds)| whole[*body] = whole[*body].union(*bounds));
            (whole, places.iter().map(|(body, _)| *body as u32).collect())
        } else {
            return None;
        };
        Some(Scenes { boxes: Boxes::new(&boxes), states, box_of })
    }

    /// Whether rays that crossed what the footprint has in one picture meet the same in another.
    fn is_same(&self, footprint: &Footprint, then: usize, now: usize) -> bool {
        let is_clear =
            |state: Option<u32>| state.is_none_or(|number| !footprint.has(self.box_of[number as usize] as usize));
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

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::base::digest::Digest;
    use crate::trace::Ray;

    fn ball(x: f32, look: u128) -> Body {
        let center = Vec3::new(x, 0.0, 0.0);
        let digest = Digest(look << 64 | u128::from(x.to_bits()));
        Body::Bounded { digest, bounds: Bounds { min: center - 0.4, max: center + 0.4 }, mesh: None }
    }

    /// Pictures, after the first, that look the same along a ray down at `x`.
    fn same_at(x: f32, bodies: &[Vec<Body>], most: usize) -> Vec<bool> {
        let scenes = Scenes::new(bodies, most).unwrap();
        let mut footprint = Footprint::new(&scenes.boxes);
        footprint.add(&scenes.boxes, &Ray::new(Vec3::new(x, 9.0, 0.0), Vec3::NEG_Y), 20.0);
        (1..bodies.len()).map(|now| scenes.is_same(&footprint, 0, now)).collect()
    }

    #[test]
    fn a_ray_minds_who_left_its_way_and_who_came_into_it() {
        let row = |xs: [f32; 4]| xs.map(|x| vec![ball(x, 1), ball(9.0, 1)]);
        assert_eq!(same_at(0.0, &row([0.0, 0.0, 1.0, 2.0]), 64), [true, false, false]);
        assert_eq!(same_at(2.0, &row([0.0, 0.0, 1.0, 2.0]), 64), [true, true, false]);
        assert_eq!(same_at(9.0, &row([0.0, 0.0, 1.0, 2.0]), 64), [true, true, true]);
        // All states of a body in one box: a ray at any of its places minds every change.
        assert_eq!(same_at(2.0, &row([0.0, 0.0, 1.0, 2.0]), 3), [true, false, false]);
        let painted = [vec![ball(0.0, 1)], vec![ball(0.0, 2)], vec![Body::Nothing]];
        assert_eq!(same_at(0.0, &painted, 64), [false, false]);
        assert_eq!(same_at(3.0, &painted, 64), [true, true]);
    }

    #[test]
    fn what_shows_everywhere_or_shares_a_mesh_with_a_stranger_is_refused() {
        assert!(Scenes::new(&[vec![ball(0.0, 1)], vec![Body::Everywhere]], 64).is_none());
        let Body::Bounded { digest, bounds, .. } = ball(0.0, 1) else { return };
        let mesh = |mesh| vec![Body::Bounded { digest, bounds, mesh }];
        assert!(Scenes::new(&[mesh(Some(1)), mesh(Some(1))], 64).is_some());
        assert!(Scenes::new(&[mesh(Some(1)), vec![Body::Nothing]], 64).is_none());
        let many: Vec<Body> = (0..65).map(|i| ball(i as f32, 1)).collect();
        assert!(Scenes::new(&[many.clone(), many], 64).is_none());
    }
}
