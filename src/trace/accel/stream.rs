//! Rays that share nothing but the octant of their directions, up to 64 of them side by side, with their hits so far.
//!
//! Packets are for rays that go the same way. What bounces off surfaces does not, and is dealt into octants by one pass
//! that counts, which keeps the order of the rays; a finer order costs more than it saves.

use crate::trace::primitive::{ClosestHit, Geometry, MARGIN, PreparedRay, finite_recip};
use crate::trace::simd::{LANES, V3, Wide, lane};
use crate::trace::soa::{RayLanes, Rays};

/// Rays that go down together at most: a bit for each in one number.
pub const STREAM: usize = 64;

/// Rays that are dealt with together: of 500 to 4,000 all were alike, of 16,000 slower by a tenth on small meshes.
pub const BATCH: usize = 1024;

/// Octants of directions: bit i is set where they run down axis i.
const OCTANTS: usize = 8;

/// A ray of a stream, and its hit so far.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct StreamRay {
    /// 1 / direction.
    pub inverse: [f32; 3],
    /// Origin times inverse, with the margin that makes near planes nearer.
    pub near: [f32; 3],
    pub far: [f32; 3],
    /// Its number among the rays of the wave.
    pub number: u32,
    /// How far it was moved up to the primitives.
    pub skip: f32,
    pub best: ClosestHit,
    pub prepared: PreparedRay,
}

/// Children that are still to be visited by the rays that have a bit.
#[derive(Clone, Copy, Default)]
pub struct StreamEntry {
    pub rays: u64,
    /// Bits of the child.
    pub child: u32,
}

/// What one thread owns for streams.
#[derive(Default)]
pub struct StreamScratch {
    pub rays: Vec<StreamRay>,
    pub stack: Vec<StreamEntry>,
    /// The places of [`LooseRays`], octant by octant.
    order: Vec<u16>,
}

/// Marks the number of a ray that has been looked for in vain by a packet.
const BEGUN: u32 = 1 << 31;

/// Rays of a batch that go on without a packet.
#[derive(Default)]
pub struct LooseRays {
    /// Numbers, or with [`BEGUN`] places in `begun`.
    entries: Vec<u32>,
    /// Rays that have gone part of their way, with their hits so far.
    begun: Vec<(u32, ClosestHit)>,
}

impl LooseRays {
    pub fn clear(&mut self) {
        self.entries.clear();
        self.begun.clear();
    }

    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Adds rays that have not begun.
    pub fn extend(&mut self, numbers: impl Iterator<Item = u32>) {
        self.entries.extend(numbers);
    }

    /// Adds a ray that has gone part of its way.
    pub fn push_begun(&mut self, number: u32, best: ClosestHit) {
        self.entries.push(self.begun.len() as u32 | BEGUN);
        self.begun.push((number, best));
    }

    /// The number of a ray, and its hit so far if it has begun.
    #[inline(always)]
    pub fn get(&self, i: usize) -> (u32, Option<ClosestHit>) {
        let entry = self.entries[i];
        if entry & BEGUN == 0 {
            return (entry, None);
        }
        let (number, best) = self.begun[(entry & !BEGUN) as usize];
        (number, Some(best))
    }
}

/// Octants of the directions of eight rays in a row.
#[inline(always)]
fn octants<L: Wide>(rays: &Rays, first: usize) -> [f32; LANES] {
    let (direction, zero): (V3<L>, L) = (rays.direction(first), L::splat(0.0));
    let x = L::select(direction.x.lt(zero), L::splat(1.0), zero);
    let y = L::select(direction.y.lt(zero), L::splat(2.0), zero);
    let z = L::select(direction.z.lt(zero), L::splat(4.0), zero);
    (x + y + z).store()
}

impl StreamScratch {
    /// Makes room for streams through a tree whose walks can come to hold so many entries.
    pub fn make_room(&mut self, stack: usize) {
        if self.rays.len() < STREAM {
            let nowhere = glam::Vec3::ZERO;
            let ray = StreamRay {
                inverse: [0.0; 3],
                near: [0.0; 3],
                far: [0.0; 3],
                number: 0,
                skip: 0.0,
                best: ClosestHit::within(0.0),
                prepared: PreparedRay::new(nowhere, glam::Vec3::Z),
            };
            self.rays.resize(STREAM, ray);
        }
        if self.stack.len() < stack {
            self.stack.resize(stack, StreamEntry::default());
        }
    }

    /// Deals rays into octants, all of a batch of `count` from `first` on; gives where each octant ends.
    #[inline(always)]
    pub fn deal<L: Wide>(
        &mut self,
        rays: &Rays,
        (first, count): (usize, usize),
        loose: &LooseRays,
    ) -> [usize; OCTANTS] {
        let mut octant_of = [0u8; BATCH];
        for (eight, at) in octant_of[..count].chunks_mut(LANES).zip((first..).step_by(LANES)) {
            for (to, octant) in eight.iter_mut().zip(octants::<L>(rays, at)) {
                *to = octant as u8;
            }
        }
        let mut next = [0; OCTANTS];
        let octant = |i: usize| usize::from(octant_of[loose.get(i).0 as usize - first]) % OCTANTS;
        for i in 0..loose.len() {
            next[octant(i)] += 1;
        }
        let mut sum = 0;
        for count in &mut next {
            sum += std::mem::replace(count, sum);
        }
        self.order.resize(loose.len(), 0);
        for i in 0..loose.len() {
            let at = &mut next[octant(i)];
            self.order[*at] = i as u16;
            *at += 1;
        }
        next
    }

    /// Makes ready the rays from one place in the order to another, at most [`STREAM`] of them.
    #[inline(always)]
    pub fn load<L: Wide>(&mut self, geometry: &Geometry, rays: &Rays, loose: &LooseRays, from: usize, to: usize) {
        let StreamScratch { rays: stream, order, .. } = self;
        let (order, zero) = (&order[from..to], L::splat(0.0));
        for (places, to) in order.chunks(LANES).zip(stream.chunks_mut(LANES)) {
            let mut which = [0; LANES];
            let mut bests = [None; LANES];
            for i in 0..LANES {
                let (number, best) = loose.get(usize::from(places[i.min(places.len() - 1)]));
                (which[i], bests[i]) = (number as usize, best);
            }
            let RayLanes { origin, direction, t_max } = rays.gather::<L>(&which);
            let (skip, origin) = geometry.approached::<L>(origin, direction);
            let inverse =
                V3 { x: finite_recip(direction.x), y: finite_recip(direction.y), z: finite_recip(direction.z) };
            let margin = origin.abs().max_element() * L::splat(MARGIN);
            let margin = V3 {
                x: L::select(inverse.x.lt(zero), -margin, margin),
                y: L::select(inverse.y.lt(zero), -margin, margin),
                z: L::select(inverse.z.lt(zero), -margin, margin),
            };
            let (near, far) = (((origin + margin) * inverse).store(), ((origin - margin) * inverse).store());
            let (t, skip) = ((t_max - skip).store(), skip.store());
            let (origin, direction, inverse) = (origin.store(), direction.store(), inverse.store());
            for (i, ray) in to.iter_mut().enumerate().take(places.len()) {
                let (origin, direction, inverse) = (lane(&origin, i), lane(&direction, i), lane(&inverse, i));
                *ray = StreamRay {
                    inverse: inverse.to_array(),
                    near: lane(&near, i).to_array(),
                    far: lane(&far, i).to_array(),
                    number: which[i] as u32,
                    skip: skip[i],
                    best: match bests[i] {
                        Some(best) => best,
                        None => ClosestHit::within(t[i]),
                    },
                    prepared: PreparedRay::with_inverse(origin, direction, inverse),
                };
            }
        }
    }
}
