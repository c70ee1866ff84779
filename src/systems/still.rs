//! What is kept of pictures while the camera stands still: the sums of the tiles, and what their rays touched.

use glam::Vec3;

use super::bodies::Body;
use crate::base::limits;
use crate::film::Tally;
use crate::trace::primitive::{Bounds, Geometry};
use crate::trace::reuse::{Change, Changes, DirtyRegions, Kdop, SampleHistory, TrackedRegions};
use crate::trace::simd::Width;

/// Pictures that differ in bodies alone, as data: where each body is in each of them.
#[derive(Debug, Default)]
pub struct Scenes {
    pub boxes: TrackedRegions,
    /// By picture and body: the number of its state; none where it is not there.
    states: Vec<Vec<Option<u32>>>,
    /// The bit that stands for a state in footprints.
    bits: Vec<u64>,
}

/// A state of a body: the first picture that it is in, and where it is.
#[derive(Clone, Copy, Debug)]
struct State {
    picture: usize,
    place: Kdop,
}

impl Scenes {
    /// `bodies` by picture, 64 pictures at most, the same bodies in each; `None` if one of them changes that may show
    /// everywhere.
    ///
    /// As long as there are bits enough, each state of a body has its own; or else those share one that first are in
    /// the same picture. The places of these are joined to what lies near them if there are more than `most`.
    pub fn new(bodies: &[Vec<Body>], most: usize) -> Option<Scenes> {
        let count = bodies.first()?.len();
        let mut all: Vec<State> = Vec::new();
        let mut states = vec![vec![None; count]; bodies.len()];
        for body in by_size(bodies) {
            let is_everywhere = |all: &Vec<Body>| matches!(all[body], Body::Everywhere { .. });
            if bodies.iter().any(is_everywhere) {
                if bodies.iter().all(|all| all[body] == bodies[0][body]) {
                    continue;
                }
                return None;
            }
            let first_state = all.len();
            let mut known = Vec::new();
            let mut meshes = Vec::new();
            for (picture, bodies) in bodies.iter().enumerate() {
                let mesh = match &bodies[body] {
                    Body::Everywhere { .. } | Body::Nothing => None,
                    Body::Bounded { digest, place, mesh } => {
                        let number = known.iter().position(|one| one == digest).unwrap_or_else(|| {
                            known.push(*digest);
                            all.push(State { picture, place: *place });
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
        let alone = all.len() <= most.min(u64::BITS as usize);
        let bits: Vec<u64> =
            all.iter().enumerate().map(|(number, state)| 1 << if alone { number } else { state.picture }).collect();
        let places = if all.len() <= most {
            all.iter().zip(&bits).map(|(state, bits)| (state.place, *bits)).collect()
        } else {
            joined(&all, bodies.len(), most)
        };
        Some(Scenes { boxes: TrackedRegions::new(&places), states, bits })
    }

    /// Bits of the states that bodies left or took between two pictures.
    fn changes(&self, then: usize, now: usize) -> u64 {
        let bit = |state: Option<u32>| state.map_or(0, |number| self.bits[number as usize]);
        let bodies = self.states[then].iter().zip(&self.states[now]);
        bodies.filter(|(a, b)| a != b).fold(0, |bits, (a, b)| bits | bit(*a) | bit(*b))
    }

    fn pictures(&self) -> usize {
        self.states.len()
    }
}

/// Numbers of the bodies, the largest first: rays that cross it in all pictures need not be held against the others.
fn by_size(bodies: &[Vec<Body>]) -> Vec<usize> {
    let size = |body: &Body| match body {
        Body::Bounded { place, .. } => place.bounds().size().element_sum(),
        Body::Nothing | Body::Everywhere { .. } => 0.0,
    };
    let largest = |body: usize| bodies.iter().map(|all| size(&all[body])).fold(0.0, f32::max);
    let sizes: Vec<f32> = (0..bodies[0].len()).map(largest).collect();
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by(|a, b| sizes[*b].total_cmp(&sizes[*a]));
    order
}

/// Places of states by the picture that they first are in, each with others near it.
fn joined(all: &[State], pictures: usize, most: usize) -> Vec<(Kdop, u64)> {
    let mut places = Vec::new();
    for picture in 0..pictures {
        let mut some: Vec<Kdop> = all.iter().filter(|s| s.picture == picture).map(|s| s.place).collect();
        halve(&mut some, (most / pictures).max(1), &mut |place| places.push((place, 1 << picture)));
    }
    places
}

/// Joins places to so many at most, halving them along the longest side of the box around their middles.
fn halve(places: &mut [Kdop], most: usize, found: &mut impl FnMut(Kdop)) {
    if places.len() <= most {
        return places.iter().for_each(|place| found(*place));
    }
    if most == 1 {
        return found(places.iter().fold(Kdop::default(), |all, place| all.union(*place)));
    }
    let middle = |place: &Kdop| place.bounds().center();
    let middles: Vec<_> = places.iter().map(middle).collect();
    let sides = Bounds::around(&middles).size();
    let axis = (0..3).max_by(|a, b| sides[*a].total_cmp(&sides[*b])).unwrap_or(0);
    places.sort_by(|a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
    let (left, right) = places.split_at_mut(places.len() / 2);
    halve(left, most / 2, found);
    halve(right, most - most / 2, found);
}

/// A tile as it was traced last.
#[derive(Debug)]
pub struct Kept {
    pub tally: Tally,
    pub trail: SampleHistory,
}

/// What one picture told rays beside what they met.
#[derive(Clone, Debug, PartialEq)]
struct Air {
    /// Where all finite primitives were.
    bounds: Bounds,
    /// What lots were drawn by; empty if none were.
    chances: Vec<f32>,
}

/// Tiles that are kept from picture to picture.
#[derive(Debug, Default)]
pub struct Still {
    scenes: Scenes,
    tiles: Vec<Kept>,
    /// By picture.
    air: Vec<Option<Air>>,
    /// The point from which it is measured how far away rays start: the centre of all, at first.
    middle: Option<Vec3>,
    /// Memory that may be used, in bytes.
    memory: usize,
}

impl Still {
    pub fn new(scenes: Scenes, memory: u64) -> Self {
        let air = vec![None; scenes.pictures()];
        let memory = usize::try_from(memory).unwrap_or(usize::MAX);
        Still { scenes, tiles: Vec::new(), air, middle: None, memory }
    }

    /// What the rays of a picture are to look out for, and the tiles.
    pub fn parts(&mut self, picture: usize) -> (DirtyRegions<'_>, &mut [Kept]) {
        let Still { scenes, tiles, middle, .. } = self;
        let later = picture + 1..scenes.pictures();
        let live = later.fold(0, |bits, later| bits | scenes.changes(picture, later));
        let middle = middle.unwrap_or_default();
        (DirtyRegions { boxes: &scenes.boxes, live, middle, width: Width::detect() }, tiles)
    }

    /// Begins a picture: `bounds` are those of its finite primitives, `chances` what lots are drawn by.
    pub fn begin(&mut self, picture: usize, bounds: Bounds, chances: Vec<f32>) -> Changes {
        let middle = *self.middle.get_or_insert(if bounds.is_empty() { Vec3::ZERO } else { bounds.center() });
        let now = Air { bounds, chances };
        // Where rays start far from all primitives, it matters where these are.
        let near = |bounds: Bounds| {
            let off = if bounds.is_empty() { 0.0 } else { bounds.center().distance(middle) };
            (Geometry::nearness(bounds) * 0.999 - off * 1.001).max(0.0)
        };
        let since = |then: usize| {
            let before = self.air[then].as_ref().filter(|before| before.chances == now.chances)?;
            let stands = before.bounds == now.bounds;
            let near = if stands { f32::INFINITY } else { near(before.bounds).min(near(now.bounds)) };
            Some(Change { bits: self.scenes.changes(then, picture), near: near * near })
        };
        let since = (0..picture).map(since).collect();
        let next = if picture + 1 < self.scenes.pictures() { self.scenes.changes(picture, picture + 1) } else { 0 };
        self.air[picture] = Some(now);
        Changes { picture: picture as u8, since, next }
    }

    /// Makes room for tiles, if there is none yet: without samples, of so many a pixel, each of which may be kept if
    /// there is memory. False if there is none even for whole pixels.
    pub fn make_room(&mut self, empty: &[Tally], pixels: impl Fn(usize) -> usize, samples: Option<u32>) -> bool {
        if self.tiles.is_empty() {
            let bytes = |each: u32| -> usize {
                let tile = |(i, tally): (usize, &Tally)| {
                    tally.bytes() + size_of::<Kept>() + SampleHistory::bytes(pixels(i), each)
                };
                empty.iter().enumerate().map(tile).sum()
            };
            let fits = |each: &u32| bytes(*each) <= self.memory;
            let Some(each) = samples.into_iter().chain([0]).find(fits) else { return false };
            let tile =
                |(i, tally): (usize, &Tally)| Kept { tally: tally.clone(), trail: SampleHistory::new(pixels(i), each) };
            self.tiles = empty.iter().enumerate().map(tile).collect();
        }
        true
    }

    pub fn bytes(&self) -> usize {
        let tile = |kept: &Kept| kept.tally.bytes() + kept.trail.memory() + size_of::<Kept>();
        self.tiles.iter().map(tile).sum()
    }
}

const _: () = assert!(limits::STILL_FRAMES <= u64::BITS as usize);

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::base::digest::Digest;
    use crate::trace::reuse::{Footprint, TouchMask};
    use crate::trace::soa::Ray;

    fn ball(x: f32, look: u128) -> Body {
        let center = DVec3::X * f64::from(x);
        let digest = Digest(look << 64 | u128::from(x.to_bits()));
        let place = Kdop::new(|d| d.dot(center) + 0.4 * d.length());
        Body::Bounded { digest, place, mesh: None }
    }

    /// Pictures, after the first, that look the same along a ray down at `x`.
    fn same_at(x: f32, bodies: &[Vec<Body>], most: usize) -> Vec<bool> {
        let scenes = Scenes::new(bodies, most).unwrap();
        let mut still = Still::new(scenes, 0);
        let mut footprint = Footprint::default();
        footprint.begin(std::iter::once(TouchMask::default()));
        let ray = Ray::new(Vec3::new(x, 9.0, 0.0), Vec3::NEG_Y);
        footprint.add(still.parts(0).0, std::iter::once((ray, 0, 20.0)));
        let mut trail = SampleHistory::new(1, 1);
        trail.keep_samples(&[0], &[Vec3::ONE], &footprint, 0);
        still.begin(0, Bounds::default(), Vec::new());
        let mut is_same = |picture| trail.stale(&still.begin(picture, Bounds::default(), Vec::new())).is_empty();
        (1..bodies.len()).map(&mut is_same).collect()
    }

    #[test]
    fn a_ray_minds_who_left_its_way_and_who_came_into_it() {
        let row = |xs: [f32; 4]| xs.map(|x| vec![ball(x, 1), ball(9.0, 1)]);
        assert_eq!(same_at(0.0, &row([0.0, 0.0, 1.0, 2.0]), 64), [true, false, false]);
        assert_eq!(same_at(2.0, &row([0.0, 0.0, 1.0, 2.0]), 64), [true, true, false]);
        assert_eq!(same_at(9.0, &row([0.0, 0.0, 1.0, 2.0]), 64), [true, true, true]);
        // What is first in one picture lies in one place: a ray at the ball that rests minds that the other one moves.
        assert_eq!(same_at(5.0, &row([0.0, 0.0, 1.0, 2.0]), 3), [true, false, false]);
        assert_eq!(same_at(2.0, &row([0.0, 0.0, 0.0, 2.0]), 2), [true, true, false]);
        let painted = [vec![ball(0.0, 1)], vec![ball(0.0, 2)], vec![Body::Nothing]];
        assert_eq!(same_at(0.0, &painted, 64), [false, false]);
        assert_eq!(same_at(3.0, &painted, 64), [true, true]);
    }

    #[test]
    fn many_bodies_share_bits_and_places() {
        // A row of balls, each of which makes a step in another picture.
        let row = |picture: usize| (0..40).map(|i| ball(i as f32 + if i < picture { 0.5 } else { 0.0 }, 1)).collect();
        let pictures: Vec<Vec<Body>> = (0..41).map(row).collect();
        for most in [41, 128, 512] {
            for x in [0.0, 17.2, 38.9] {
                let same = same_at(x, &pictures, most);
                let moved = |picture: usize| (0..picture).any(|i| x > i as f32 - 0.4 && x < i as f32 + 0.9);
                for picture in 1..41 {
                    assert!(!(moved(picture) && same[picture - 1]), "{most} {x} {picture}");
                }
            }
        }
        assert_eq!(same_at(50.0, &pictures, 41), [true; 40]);
    }

    #[test]
    fn what_shows_everywhere_or_shares_a_mesh_with_a_stranger_is_refused() {
        let everywhere = |look| Body::Everywhere { digest: Digest(look) };
        assert!(Scenes::new(&[vec![ball(0.0, 1)], vec![everywhere(1)]], 64).is_none());
        assert!(Scenes::new(&[vec![everywhere(2)], vec![everywhere(1)]], 64).is_none());
        assert!(Scenes::new(&[vec![everywhere(1)], vec![everywhere(1)]], 64).is_some());
        let Body::Bounded { digest, place, .. } = ball(0.0, 1) else { return };
        let mesh = |mesh| vec![Body::Bounded { digest, place, mesh }];
        assert!(Scenes::new(&[mesh(Some(1)), mesh(Some(1))], 64).is_some());
        assert!(Scenes::new(&[mesh(Some(1)), vec![Body::Nothing]], 64).is_none());
    }

    #[test]
    fn other_lots_or_a_start_from_far_away_change_everything() {
        let mut still =
            Still::new(Scenes::new(&[vec![ball(0.0, 1)], vec![ball(1.0, 1)], vec![ball(1.0, 1)]], 64).unwrap(), 0);
        let unit = |size: f32| Bounds { min: Vec3::ZERO, max: Vec3::splat(size) };
        still.begin(0, unit(1.0), vec![1.0]);
        let change = still.begin(1, unit(1.5), vec![1.0]).since[0].unwrap();
        // Both centres lie within 0.5 of the first.
        let reach = 3.99 * Vec3::ONE.length();
        assert!(
            change.bits == 0b11 && change.near < reach * reach && change.near > (reach - 0.5).powi(2),
            "{change:?}"
        );
        assert_eq!(still.begin(2, unit(1.5), vec![0.5]).since, [None, None]);
        still.begin(2, unit(1.5), vec![1.0]);
        let changes = still.begin(2, unit(1.5), vec![1.0]);
        assert_eq!((changes.since[1], changes.next), (Some(Change { bits: 0, near: f32::INFINITY }), 0));
    }
}
