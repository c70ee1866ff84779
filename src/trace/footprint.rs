//! What the rays of a tile touched of that which changes from one picture to the next.
//!
//! While the camera stands still, all that can change in a sample is what its rays meet: the bodies that move, grow or
//! put on another material. Where these bodies are in all pictures to come is known before the first is traced
//! ([`Boxes`]), so it is enough to note which of their places the rays of a sample crossed ([`Footprint`]): camera rays,
//! mirror images, shadows and bounces alike. In a later picture the sample is the same, to the bit, unless a body left
//! or took one of those. [`Trail`] is what is kept of a tile, sample by sample where there is memory for that.
//!
//! A place is what lies between two planes across each of nine directions ([`Place`]; Kay and Kajiya, SIGGRAPH 1986):
//! it is far nearer to what it is around than a box would be, above all around what turns.

use glam::{DVec3, Vec3};

use super::Ray;
use super::geometry::Bounds;
use super::shapes::finite_recip;
use super::simd::{Kernel, LANES, Wide, Width};

mod trail;

pub use trail::{Changes, Trail};

/// Directions across which places are bounded: the axes, then the diagonals between two of them.
const WAYS: usize = 9;

/// Axes of a diagonal, and the sign of the second.
const DIAGONALS: [(usize, usize, f32); WAYS - 3] =
    [(0, 1, 1.0), (0, 1, -1.0), (0, 2, 1.0), (0, 2, -1.0), (1, 2, 1.0), (1, 2, -1.0)];

/// Where a body can be met: by direction, the least and the greatest distance of its points along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    low: [f32; WAYS],
    high: [f32; WAYS],
}

/// Of nothing.
impl Default for Place {
    fn default() -> Self {
        Place { low: [f32::INFINITY; WAYS], high: [f32::NEG_INFINITY; WAYS] }
    }
}

impl Place {
    /// `farthest` tells how far a shape reaches along a direction of any length: the greatest product of one of its
    /// points and the direction.
    pub fn new(farthest: impl Fn(DVec3) -> f64) -> Self {
        let mut place = Place::default();
        for way in 0..WAYS {
            let direction = direction(way).as_dvec3();
            place.low[way] = -farthest(-direction) as f32;
            place.high[way] = farthest(direction) as f32;
        }
        place
    }

    pub fn union(self, other: Place) -> Self {
        Place {
            low: std::array::from_fn(|way| self.low[way].min(other.low[way])),
            high: std::array::from_fn(|way| self.high[way].max(other.high[way])),
        }
    }

    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        let corner = |of: &[f32; WAYS]| Vec3::new(of[0], of[1], of[2]);
        Bounds { min: corner(&self.low), max: corner(&self.high) }
    }

    /// With room for all roundings of those who trace rays.
    fn widened(mut self) -> Self {
        let bounds = self.bounds();
        let pad = 1e-4 * bounds.size().max_element() + 2e-5 * bounds.min.abs().max(bounds.max.abs()).max_element();
        self.low.iter_mut().for_each(|low| *low -= pad);
        self.high.iter_mut().for_each(|high| *high += pad);
        self
    }
}

fn direction(way: usize) -> Vec3 {
    let Some((a, b, sign)) = way.checked_sub(3).map(|i| DIAGONALS[i]) else { return Vec3::AXES[way] };
    Vec3::AXES[a] + Vec3::AXES[b] * sign
}

/// Places of bodies in all pictures.
#[derive(Clone, Debug, Default)]
pub struct Boxes {
    octets: Vec<Octet>,
    /// Around eight octets each, so that most need not be looked at.
    tops: Vec<Top>,
    /// Around all of them: most rays need no more.
    around: Bounds,
}

/// Eight places side by side, for one ray against all of them.
#[derive(Clone, Debug)]
struct Octet {
    around: Bounds,
    /// The bits of each, and those of all.
    bits: [u64; LANES],
    all: u64,
    low: [[f32; LANES]; WAYS],
    high: [[f32; LANES]; WAYS],
}

#[derive(Clone, Debug)]
struct Top {
    all: u64,
    min: [[f32; LANES]; 3],
    max: [[f32; LANES]; 3],
}

/// Share of its distance by which a ray may be off, far above what roundings make of it.
const SLACK: f32 = 1e-5;

/// Share of the distance of its start from the middle of the world by which it may be off to the side.
const OFF: f32 = 2e-6;

/// Lanes beyond the last box lie nowhere near.
const NOWHERE: f32 = 1e30;

impl Boxes {
    /// Places, and the bits that stand for them in footprints: several may share one. Those that follow each other
    /// should lie near each other.
    pub fn new(places: &[(Place, u64)]) -> Self {
        let octets: Vec<Octet> = places.chunks(LANES).map(Octet::new).collect();
        let tops = octets.chunks(LANES).map(Top::new).collect();
        Boxes { around: octets.iter().fold(Bounds::default(), |all, octet| all.union(octet.around)), octets, tops }
    }
}

impl Octet {
    fn new(places: &[(Place, u64)]) -> Self {
        let (mut low, mut high) = ([[NOWHERE; LANES]; WAYS], [[NOWHERE; LANES]; WAYS]);
        let (mut bits, mut around) = ([0; LANES], Bounds::default());
        for (lane, (place, bit)) in places.iter().enumerate() {
            let place = place.widened();
            for way in 0..WAYS {
                (low[way][lane], high[way][lane]) = (place.low[way], place.high[way]);
            }
            bits[lane] = *bit;
            around = around.union(place.bounds());
        }
        Octet { around, bits, all: bits.iter().fold(0, |all, bit| all | bit), low, high }
    }

    /// Bits of the places that a ray crosses.
    #[inline(always)]
    fn crossed<L: Wide>(&self, probe: &Probe) -> u64 {
        let mut enter = L::splat(0.0);
        let mut leave = L::splat(probe.end);
        for way in 0..3 {
            let sides = [L::load(&self.low[way]), L::load(&self.high[way])];
            (enter, leave) = probe.clip([enter, leave], sides, probe.origin[way], probe.inverse[way]);
        }
        if met(enter, leave) == 0 {
            return 0;
        }
        for (i, (first, second, sign)) in DIAGONALS.into_iter().enumerate() {
            let sides = [L::load(&self.low[3 + i]), L::load(&self.high[3 + i])];
            let from = probe.origin[first] + sign * probe.origin[second];
            let along = probe.direction[first] + sign * probe.direction[second];
            (enter, leave) = probe.clip([enter, leave], sides, from, finite_recip(along));
        }
        let mut lanes = met(enter, leave);
        let mut found = 0;
        while lanes != 0 {
            found |= self.bits[lanes.trailing_zeros() as usize];
            lanes &= lanes - 1;
        }
        found
    }
}

impl Top {
    fn new(octets: &[Octet]) -> Self {
        let side = |pick: fn(&Bounds) -> Vec3, axis: usize| {
            std::array::from_fn(|i| octets.get(i).map_or(NOWHERE, |octet| pick(&octet.around)[axis]))
        };
        Top {
            all: octets.iter().fold(0, |all, octet| all | octet.all),
            min: std::array::from_fn(|axis| side(|around| around.min, axis)),
            max: std::array::from_fn(|axis| side(|around| around.max, axis)),
        }
    }

    /// Octets that a ray may cross, by bit.
    #[inline(always)]
    fn near<L: Wide>(&self, probe: &Probe) -> u32 {
        let mut enter = L::splat(0.0);
        let mut leave = L::splat(probe.end);
        for axis in 0..3 {
            let sides = [L::load(&self.min[axis]), L::load(&self.max[axis])];
            (enter, leave) = probe.clip([enter, leave], sides, probe.origin[axis], probe.inverse[axis]);
        }
        met(enter, leave)
    }
}

/// A ray as it is held against places.
struct Probe {
    origin: Vec3,
    direction: Vec3,
    inverse: Vec3,
    end: f32,
    /// How far off a ray from so far away may be.
    off: f32,
}

impl Probe {
    #[inline(always)]
    fn new(ray: &Ray, end: f32) -> Self {
        let [x, y, z] = ray.direction.to_array().map(finite_recip::<f32>);
        Probe {
            origin: ray.origin,
            direction: ray.direction,
            inverse: Vec3::new(x, y, z),
            end: end + end * SLACK,
            off: OFF * ray.origin.abs().max_element(),
        }
    }

    /// What is left of the ray between two sides, from where it starts along them.
    #[inline(always)]
    fn clip<L: Wide>(&self, [enter, leave]: [L; 2], [low, high]: [L; 2], from: f32, inverse: f32) -> (L, L) {
        let by = L::splat(inverse);
        let (a, b) = ((low - L::splat(from + self.off)) * by, (high - L::splat(from - self.off)) * by);
        (enter.max(a.min(b)), leave.min(a.max(b)))
    }

    /// Whether it misses a box for certain.
    #[inline(always)]
    fn misses(&self, around: &Bounds) -> bool {
        let min = (around.min - (self.origin + self.off)) * self.inverse;
        let max = (around.max - (self.origin - self.off)) * self.inverse;
        let (enter, leave) = (min.min(max).max_element(), min.max(max).min_element());
        enter.max(0.0) * (1.0 - SLACK) > leave.min(self.end) * (1.0 + SLACK)
    }
}

/// Lanes in which something is left of the ray.
#[inline(always)]
fn met<L: Wide>(enter: L, leave: L) -> u32 {
    L::bits((enter * L::splat(1.0 - SLACK)).le(leave * L::splat(1.0 + SLACK)))
}

/// Places to look out for: those that rays of this picture may be asked about later have their bits in `live`.
#[derive(Clone, Copy, Debug)]
pub struct Lookout<'a> {
    pub boxes: &'a Boxes,
    pub live: u64,
    pub width: Width,
}

/// What the rays of samples crossed.
#[derive(Clone, Debug, Default)]
pub struct Footprint {
    /// Bits of places, by sample of the batch.
    crossed: Vec<u64>,
    /// By pixel of the tile, where pixels are kept as wholes.
    pixels: Vec<u64>,
    /// Around the points that the rays start from.
    origins: Bounds,
    /// Sample and end of each ray of a wave.
    ends: Vec<(u32, f32)>,
}

impl Footprint {
    pub fn start_tile(&mut self) {
        self.origins = Bounds::default();
    }

    /// Before the first ray of a batch of so many samples.
    pub fn begin(&mut self, samples: usize) {
        self.crossed.clear();
        self.crossed.resize(samples, 0);
    }

    /// Bits of the places that the rays of a sample crossed.
    pub fn crossed(&self, sample: usize) -> u64 {
        self.crossed[sample]
    }

    /// Puts a sample of the batch down to its pixel.
    pub fn put_down(&mut self, sample: usize, pixel: usize) {
        self.pixels[pixel] |= self.crossed[sample];
    }

    /// Notes what rays cross, each of a sample and before an end.
    pub fn add(&mut self, lookout: Lookout, rays: &[Ray], ends: impl Iterator<Item = (u32, f32)>) {
        let Footprint { crossed, origins, ends: all, .. } = self;
        all.clear();
        all.extend(ends);
        for ray in rays {
            *origins = Bounds { min: origins.min.min(ray.origin), max: origins.max.max(ray.origin) };
        }
        if !lookout.boxes.octets.is_empty() {
            lookout.width.run(Crossing { lookout, rays, ends: all, crossed });
        }
    }
}

struct Crossing<'a> {
    lookout: Lookout<'a>,
    rays: &'a [Ray],
    ends: &'a [(u32, f32)],
    crossed: &'a mut [u64],
}

impl Kernel for Crossing<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        let Crossing { lookout: Lookout { boxes, live, .. }, rays, ends, crossed } = self;
        for (ray, (sample, end)) in rays.iter().zip(ends) {
            let crossed = &mut crossed[*sample as usize];
            let probe = Probe::new(ray, *end);
            if live & !*crossed == 0 || probe.misses(&boxes.around) {
                continue;
            }
            for (top, octets) in boxes.tops.iter().zip(boxes.octets.chunks(LANES)) {
                if top.all & live & !*crossed == 0 {
                    continue;
                }
                let mut near = top.near::<L>(&probe) & ((1 << octets.len()) - 1);
                while near != 0 {
                    let octet = &octets[near.trailing_zeros() as usize];
                    if octet.all & live & !*crossed != 0 {
                        *crossed |= octet.crossed::<L>(&probe);
                    }
                    near &= near - 1;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
