//! What is kept of frames while the camera stands still: the accumulators of tiles, and which bounds their rays crossed.

use glam::Vec3;

use super::open_window::{NextState, OpenObjects};
use super::reuse_bounds::ReuseBounds;
use crate::base::limits;
use crate::film::PixelAccumulator;
use crate::trace::primitive::{Bounds, Geometry};
use crate::trace::reuse::{Change, Changes, DirtyRegions, Kdop, SampleHistory, TrackedRegions};
use crate::trace::simd::Width;

/// The frames of a window, which differ in objects alone: the state of each object in each frame.
#[derive(Debug, Default)]
pub struct ObjectStates {
    /// Bounds of all states, with their bits.
    pub boxes: TrackedRegions,
    /// By frame and object: the number of its state; none if it is not there.
    states: Vec<Vec<Option<u32>>>,
    /// The bit that stands for a state in footprints.
    bits: Vec<u64>,
    /// Of a window that goes on with frames that nobody knows yet.
    open: Option<OpenObjects>,
}

/// A state of an object: the first frame that has it, and where the object is.
#[derive(Clone, Copy, Debug)]
struct ObjectState {
    frame: usize,
    place: Kdop,
}

impl ObjectStates {
    /// `objects` by frame, 64 frames at most, the same objects in each; `None` if an object changes that reaches
    /// everywhere.
    ///
    /// Each state of an object has a bit of its own if there are enough; otherwise all states that first appear in one
    /// frame share a bit. If there are more than `limit` bounds, those of one frame that lie near each other are merged.
    pub fn new(objects: &[Vec<ReuseBounds>], limit: usize) -> Option<ObjectStates> {
        let count = objects.first()?.len();
        let mut all: Vec<ObjectState> = Vec::new();
        let mut states = vec![vec![None; count]; objects.len()];
        for object in by_size(objects) {
            let is_everywhere = |all: &Vec<ReuseBounds>| matches!(all[object], ReuseBounds::Everywhere { .. });
            if objects.iter().any(is_everywhere) {
                if objects.iter().all(|all| all[object] == objects[0][object]) {
                    continue;
                }
                return None;
            }
            let first_state = all.len();
            let mut known = Vec::new();
            let mut meshes = Vec::new();
            for (frame, objects) in objects.iter().enumerate() {
                let mesh = match &objects[object] {
                    ReuseBounds::Everywhere { .. } | ReuseBounds::Nothing => None,
                    ReuseBounds::Bounded { digest, place, mesh } => {
                        let number = known.iter().position(|one| one == digest).unwrap_or_else(|| {
                            known.push(*digest);
                            all.push(ObjectState { frame, place: *place });
                            known.len() - 1
                        });
                        states[frame][object] = Some((first_state + number) as u32);
                        *mesh
                    }
                };
                meshes.push(mesh);
            }
            if meshes.iter().any(|mesh| *mesh != meshes[0]) {
                return None;
            }
        }
        let alone = all.len() <= limit.min(u64::BITS as usize);
        let bits: Vec<u64> =
            all.iter().enumerate().map(|(number, state)| 1 << if alone { number } else { state.frame }).collect();
        let places = if all.len() <= limit {
            all.iter().zip(&bits).map(|(state, bits)| (state.place, *bits)).collect()
        } else {
            merge_by_frame(&all, objects.len(), limit)
        };
        Some(ObjectStates { boxes: TrackedRegions::new(&places), states, bits, open: None })
    }

    /// A window that starts with these objects and goes on with whatever is added; `None` if there are too many, or none
    /// that has a size.
    pub fn open(objects: &[ReuseBounds]) -> Option<ObjectStates> {
        let (open, bits, regions) = OpenObjects::new(objects)?;
        let mut states = ObjectStates { boxes: TrackedRegions::new(&regions), open: Some(open), ..Default::default() };
        let row = bits.into_iter().map(|bits| (bits != 0).then(|| states.add(bits))).collect();
        states.states.push(row);
        Some(states)
    }

    fn add(&mut self, bits: u64) -> u32 {
        self.bits.push(bits);
        (self.bits.len() - 1) as u32
    }

    /// Adds a frame to an open window; false if anything may have changed everywhere, which ends it.
    fn push(&mut self, objects: &[ReuseBounds]) -> bool {
        let Some(next) = self.open.as_mut().map(|open| open.next(objects)) else { return false };
        let Some(last) = self.states.last().cloned() else { return false };
        let mut row = Vec::with_capacity(next.len());
        for (object, state) in next.into_iter().enumerate() {
            row.push(match state {
                NextState::Same => last.get(object).copied().flatten(),
                NextState::Gone => None,
                NextState::New(bits) => Some(self.add(bits)),
                NextState::Unbounded => return false,
            });
        }
        self.states.iter_mut().for_each(|before| before.resize(row.len(), None));
        self.states.push(row);
        true
    }

    /// Bits of the states that objects left or took from one frame to another.
    fn changes(&self, then: usize, now: usize) -> u64 {
        let bit = |state: Option<u32>| state.map_or(0, |number| self.bits[number as usize]);
        let objects = self.states[then].iter().zip(&self.states[now]);
        objects.filter(|(a, b)| a != b).fold(0, |bits, (a, b)| bits | bit(*a) | bit(*b))
    }

    fn frames(&self) -> usize {
        self.states.len()
    }
}

/// Numbers of the objects, the largest first: a ray that crosses all states of one need not be tested against the others.
fn by_size(objects: &[Vec<ReuseBounds>]) -> Vec<usize> {
    let size = |object: &ReuseBounds| match object {
        ReuseBounds::Bounded { place, .. } => place.bounds().size().element_sum(),
        ReuseBounds::Nothing | ReuseBounds::Everywhere { .. } => 0.0,
    };
    let largest = |object: usize| objects.iter().map(|all| size(&all[object])).fold(0.0, f32::max);
    let sizes: Vec<f32> = (0..objects[0].len()).map(largest).collect();
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by(|a, b| sizes[*b].total_cmp(&sizes[*a]));
    order
}

/// Bounds of states, those that first appear in one frame and lie near each other merged.
fn merge_by_frame(all: &[ObjectState], frames: usize, limit: usize) -> Vec<(Kdop, u64)> {
    let mut places = Vec::new();
    for frame in 0..frames {
        let mut some: Vec<Kdop> = all.iter().filter(|s| s.frame == frame).map(|s| s.place).collect();
        merge_nearby(&mut some, (limit / frames).max(1), &mut |place| places.push((place, 1 << frame)));
    }
    places
}

/// Merges bounds to `limit` at most: halves them along the longest axis of the box around their centres.
fn merge_nearby(places: &mut [Kdop], limit: usize, found: &mut impl FnMut(Kdop)) {
    if places.len() <= limit {
        return places.iter().for_each(|place| found(*place));
    }
    if limit == 1 {
        return found(places.iter().fold(Kdop::default(), |all, place| all.union(*place)));
    }
    let middle = |place: &Kdop| place.bounds().center();
    let centers: Vec<_> = places.iter().map(middle).collect();
    let sides = Bounds::around(&centers).size();
    let axis = (0..3).max_by(|a, b| sides[*a].total_cmp(&sides[*b])).unwrap_or(0);
    places.sort_by(|a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
    let (left, right) = places.split_at_mut(places.len() / 2);
    merge_nearby(left, limit / 2, found);
    merge_nearby(right, limit - limit / 2, found);
}

/// A tile as it was traced last: its sums, and what its rays crossed.
#[derive(Debug)]
pub struct CachedTile {
    pub accumulator: PixelAccumulator,
    pub trail: SampleHistory,
}

/// What samples of a frame depend on beside what their rays meet.
#[derive(Clone, Debug, PartialEq)]
struct FrameConditions {
    /// Where all finite primitives were.
    bounds: Bounds,
    /// Probabilities that lights are sampled by; empty if none are sampled at random.
    chances: Vec<f32>,
}

/// Tiles that are kept from frame to frame of a window.
#[derive(Debug, Default)]
pub struct StaticCameraCache {
    states: ObjectStates,
    tiles: Vec<CachedTile>,
    /// By frame; `None` for those that were not rendered.
    conditions: Vec<Option<FrameConditions>>,
    /// The point from which distances of ray origins are measured: the centre of all primitives in the first frame.
    middle: Option<Vec3>,
    /// Memory that may be used, in bytes.
    memory: usize,
}

impl StaticCameraCache {
    /// An empty cache that may take so many bytes.
    pub fn new(states: ObjectStates, memory: u64) -> Self {
        let conditions = vec![None; states.frames()];
        let memory = usize::try_from(memory).unwrap_or(usize::MAX);
        StaticCameraCache { states, tiles: Vec::new(), conditions, middle: None, memory }
    }

    /// Adds a frame to an open window and gives its number; `None` if the window ends here.
    pub fn push(&mut self, objects: &[ReuseBounds]) -> Option<usize> {
        if self.conditions.len() >= limits::LIVE_WINDOW_FRAMES || !self.states.push(objects) {
            return None;
        }
        self.conditions.push(None);
        Some(self.conditions.len() - 1)
    }

    /// The bounds that the rays of a frame are to be tested against, and the tiles.
    pub fn parts(&mut self, frame: usize) -> (DirtyRegions<'_>, &mut [CachedTile]) {
        let StaticCameraCache { states, tiles, middle, .. } = self;
        let later = frame + 1..states.frames();
        let live = match &states.open {
            Some(_) => u64::MAX,
            None => later.fold(0, |bits, later| bits | states.changes(frame, later)),
        };
        let middle = middle.unwrap_or_default();
        (DirtyRegions { boxes: &states.boxes, live, middle, width: Width::detect() }, tiles)
    }

    /// Begins a frame: `bounds` are those of its finite primitives, `chances` the probabilities that lights are sampled by.
    pub fn begin(&mut self, frame: usize, bounds: Bounds, chances: Vec<f32>) -> Changes {
        let middle = *self.middle.get_or_insert(if bounds.is_empty() { Vec3::ZERO } else { bounds.center() });
        let now = FrameConditions { bounds, chances };
        // If a ray starts far from all primitives, where it is cut off depends on where these are.
        let near = |bounds: Bounds| {
            let off = if bounds.is_empty() { 0.0 } else { bounds.center().distance(middle) };
            (Geometry::nearness(bounds) * 0.999 - off * 1.001).max(0.0)
        };
        let since = |then: usize| {
            let before = self.conditions[then].as_ref().filter(|before| before.chances == now.chances)?;
            let stands = before.bounds == now.bounds;
            let near = if stands { f32::INFINITY } else { near(before.bounds).min(near(now.bounds)) };
            Some(Change { bits: self.states.changes(then, frame), near: near * near })
        };
        let since = (0..frame).map(since).collect();
        let next = if frame + 1 < self.states.frames() { self.states.changes(frame, frame + 1) } else { 0 };
        self.conditions[frame] = Some(now);
        Changes { picture: frame as u8, since, next }
    }

    /// Makes room for the tiles, if there is none yet, as copies of `empty` ones. `samples` is their
    /// number per pixel if they may be kept one by one, which is done if there is memory for it; whole pixels are kept
    /// otherwise. False if there is no memory for that either.
    pub fn make_room(
        &mut self,
        empty: &[PixelAccumulator],
        pixels: impl Fn(usize) -> usize,
        samples: Option<u32>,
    ) -> bool {
        if self.tiles.is_empty() {
            let bytes = |each: u32| -> usize {
                let tile = |(i, accumulator): (usize, &PixelAccumulator)| {
                    accumulator.bytes() + size_of::<CachedTile>() + SampleHistory::bytes(pixels(i), each)
                };
                empty.iter().enumerate().map(tile).sum()
            };
            let fits = |each: &u32| bytes(*each) <= self.memory;
            let Some(each) = samples.into_iter().chain([0]).find(fits) else { return false };
            let tile = |(i, accumulator): (usize, &PixelAccumulator)| CachedTile {
                accumulator: accumulator.clone(),
                trail: SampleHistory::new(pixels(i), each),
            };
            self.tiles = empty.iter().enumerate().map(tile).collect();
        }
        true
    }

    /// Memory that is taken.
    pub fn bytes(&self) -> usize {
        let tile = |tile: &CachedTile| tile.accumulator.bytes() + tile.trail.memory() + size_of::<CachedTile>();
        self.tiles.iter().map(tile).sum()
    }
}

const _: () = assert!(limits::REUSE_WINDOW_FRAMES <= u64::BITS as usize);

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::base::digest::Digest;
    use crate::trace::reuse::{Footprint, TouchMask};
    use crate::trace::soa::Ray;

    fn ball(x: f32, look: u128) -> ReuseBounds {
        let center = DVec3::X * f64::from(x);
        let digest = Digest(look << 64 | u128::from(x.to_bits()));
        let place = Kdop::new(|d| d.dot(center) + 0.4 * d.length());
        ReuseBounds::Bounded { digest, place, mesh: None }
    }

    /// Pictures, after the first, that look the same along a ray down at `x`.
    fn same_at(x: f32, objects: &[Vec<ReuseBounds>], limit: usize) -> Vec<bool> {
        let states = ObjectStates::new(objects, limit).unwrap();
        let mut cache = StaticCameraCache::new(states, 0);
        let mut footprint = Footprint::default();
        footprint.begin(std::iter::once(TouchMask::default()));
        let ray = Ray::new(Vec3::new(x, 9.0, 0.0), Vec3::NEG_Y);
        footprint.add(cache.parts(0).0, std::iter::once((ray, 0, 20.0)));
        let mut trail = SampleHistory::new(1, 1);
        trail.keep_samples(&[0], &[Vec3::ONE], &footprint, 0);
        cache.begin(0, Bounds::default(), Vec::new());
        let mut is_same = |frame| trail.stale(&cache.begin(frame, Bounds::default(), Vec::new())).is_empty();
        (1..objects.len()).map(&mut is_same).collect()
    }

    #[test]
    fn a_sample_is_stale_if_an_object_left_its_ray_or_came_into_it() {
        let row = |xs: [f32; 4]| xs.map(|x| vec![ball(x, 1), ball(9.0, 1)]);
        assert_eq!(same_at(0.0, &row([0.0, 0.0, 1.0, 2.0]), 64), [true, false, false]);
        assert_eq!(same_at(2.0, &row([0.0, 0.0, 1.0, 2.0]), 64), [true, true, false]);
        assert_eq!(same_at(9.0, &row([0.0, 0.0, 1.0, 2.0]), 64), [true, true, true]);
        // States that first appear in one frame are merged: a ray at the ball that rests is stale when the other one moves.
        assert_eq!(same_at(5.0, &row([0.0, 0.0, 1.0, 2.0]), 3), [true, false, false]);
        assert_eq!(same_at(2.0, &row([0.0, 0.0, 0.0, 2.0]), 2), [true, true, false]);
        let painted = [vec![ball(0.0, 1)], vec![ball(0.0, 2)], vec![ReuseBounds::Nothing]];
        assert_eq!(same_at(0.0, &painted, 64), [false, false]);
        assert_eq!(same_at(3.0, &painted, 64), [true, true]);
    }

    #[test]
    fn many_objects_share_bits_and_places() {
        // A row of balls, each of which makes a step in another frame.
        let row = |frame: usize| (0..40).map(|i| ball(i as f32 + if i < frame { 0.5 } else { 0.0 }, 1)).collect();
        let frames: Vec<Vec<ReuseBounds>> = (0..41).map(row).collect();
        for limit in [41, 128, 512] {
            for x in [0.0, 17.2, 38.9] {
                let same = same_at(x, &frames, limit);
                let moved = |frame: usize| (0..frame).any(|i| x > i as f32 - 0.4 && x < i as f32 + 0.9);
                for frame in 1..41 {
                    assert!(!(moved(frame) && same[frame - 1]), "{limit} {x} {frame}");
                }
            }
        }
        assert_eq!(same_at(50.0, &frames, 41), [true; 40]);
    }

    #[test]
    fn a_change_of_what_reaches_everywhere_or_of_a_shared_mesh_ends_the_window() {
        let everywhere = |look| ReuseBounds::Everywhere { digest: Digest(look) };
        assert!(ObjectStates::new(&[vec![ball(0.0, 1)], vec![everywhere(1)]], 64).is_none());
        assert!(ObjectStates::new(&[vec![everywhere(2)], vec![everywhere(1)]], 64).is_none());
        assert!(ObjectStates::new(&[vec![everywhere(1)], vec![everywhere(1)]], 64).is_some());
        let ReuseBounds::Bounded { digest, place, .. } = ball(0.0, 1) else { return };
        let mesh = |mesh| vec![ReuseBounds::Bounded { digest, place, mesh }];
        assert!(ObjectStates::new(&[mesh(Some(1)), mesh(Some(1))], 64).is_some());
        assert!(ObjectStates::new(&[mesh(Some(1)), vec![ReuseBounds::Nothing]], 64).is_none());
    }

    #[test]
    fn other_light_probabilities_or_far_ray_origins_make_all_samples_stale() {
        let mut cache = StaticCameraCache::new(
            ObjectStates::new(&[vec![ball(0.0, 1)], vec![ball(1.0, 1)], vec![ball(1.0, 1)]], 64).unwrap(),
            0,
        );
        let unit = |size: f32| Bounds { min: Vec3::ZERO, max: Vec3::splat(size) };
        cache.begin(0, unit(1.0), vec![1.0]);
        let change = cache.begin(1, unit(1.5), vec![1.0]).since[0].unwrap();
        // Both centres lie within 0.5 of the first.
        let reach = 3.99 * Vec3::ONE.length();
        assert!(
            change.bits == 0b11 && change.near < reach * reach && change.near > (reach - 0.5).powi(2),
            "{change:?}"
        );
        assert_eq!(cache.begin(2, unit(1.5), vec![0.5]).since, [None, None]);
        cache.begin(2, unit(1.5), vec![1.0]);
        let changes = cache.begin(2, unit(1.5), vec![1.0]);
        assert_eq!((changes.since[1], changes.next), (Some(Change { bits: 0, near: f32::INFINITY }), 0));
    }
}
