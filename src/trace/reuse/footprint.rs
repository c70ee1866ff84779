//! What the rays of a tile touched of that which changes from one picture to the next.
//!
//! While the camera stands still, all that can change in a sample is what its rays meet: the bodies that move, grow or
//! put on another material. Where these bodies are in all pictures to come is known before the first is traced
//! ([`TrackedRegions`]), so it is enough to note which of their places the rays of a sample crossed ([`Footprint`]):
//! camera rays, mirror images, shadows and bounces alike. In a later picture the sample is the same, to the bit, unless
//! a body left or took one of those. [`SampleHistory`] is what is kept of a tile, sample by sample where there is
//! memory for that.
//!
//! A place is what lies between two planes across each of nine directions ([`Kdop`]; Kay and Kajiya, SIGGRAPH 1986):
//! it is far nearer to what it is around than a box would be, above all around what turns.

use glam::{DVec3, Vec3};

use crate::trace::primitive::{Bounds, finite_recip};
use crate::trace::simd::{Kernel, LANES, Wide, Width};
use crate::trace::soa::Ray;

/// Directions across which places are bounded: the axes, then the diagonals between two of them.
pub(super) const WAYS: usize = 9;

/// Axes of a diagonal, and the sign of the second.
const DIAGONALS: [(usize, usize, f32); WAYS - 3] =
    [(0, 1, 1.0), (0, 1, -1.0), (0, 2, 1.0), (0, 2, -1.0), (1, 2, 1.0), (1, 2, -1.0)];

/// Where a body can be met: by direction, the least and the greatest distance of its points along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kdop {
    pub(super) low: [f32; WAYS],
    pub(super) high: [f32; WAYS],
}

/// Of nothing.
impl Default for Kdop {
    fn default() -> Self {
        Kdop { low: [f32::INFINITY; WAYS], high: [f32::NEG_INFINITY; WAYS] }
    }
}

impl Kdop {
    /// `farthest` tells how far a shape reaches along a direction of any length: the greatest product of one of its
    /// points and the direction.
    pub fn new(farthest: impl Fn(DVec3) -> f64) -> Self {
        let mut place = Kdop::default();
        for way in 0..WAYS {
            let direction = direction(way).as_dvec3();
            place.low[way] = -farthest(-direction) as f32;
            place.high[way] = farthest(direction) as f32;
        }
        place
    }

    /// What covers both.
    pub fn union(self, other: Kdop) -> Self {
        Kdop {
            low: std::array::from_fn(|way| self.low[way].min(other.low[way])),
            high: std::array::from_fn(|way| self.high[way].max(other.high[way])),
        }
    }

    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        let corner = |of: &[f32; WAYS]| Vec3::new(of[0], of[1], of[2]);
        Bounds { min: corner(&self.low), max: corner(&self.high) }
    }

    /// With so much more room on all sides.
    pub fn wider(mut self, by: f64) -> Self {
        self.low.iter_mut().for_each(|low| *low -= by as f32);
        self.high.iter_mut().for_each(|high| *high += by as f32);
        self
    }

    /// With room for all roundings of those who trace rays.
    fn widened(self) -> Self {
        let bounds = self.bounds();
        let pad = 1e-4 * bounds.size().max_element() + 2e-5 * bounds.min.abs().max(bounds.max.abs()).max_element();
        self.wider(f64::from(pad))
    }
}

pub(super) fn direction(way: usize) -> Vec3 {
    let Some((a, b, sign)) = way.checked_sub(3).map(|i| DIAGONALS[i]) else { return Vec3::AXES[way] };
    Vec3::AXES[a] + Vec3::AXES[b] * sign
}

/// Places of bodies in all pictures.
#[derive(Clone, Debug, Default)]
pub struct TrackedRegions {
    octets: Vec<RegionBlock>,
    /// Around eight octets each, so that most need not be looked at.
    tops: Vec<RegionGroup>,
    /// Around all of them: most rays need no more.
    around: Bounds,
}

/// Eight places side by side, for one ray against all of them.
#[derive(Clone, Debug)]
struct RegionBlock {
    around: Bounds,
    /// The bits of each, and those of all.
    bits: [u64; LANES],
    all: u64,
    low: [[f32; LANES]; WAYS],
    high: [[f32; LANES]; WAYS],
}

#[derive(Clone, Debug)]
struct RegionGroup {
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

impl TrackedRegions {
    /// Places, and the bits that stand for them in footprints: several may share one. Those that follow each other
    /// should lie near each other.
    pub fn new(places: &[(Kdop, u64)]) -> Self {
        let octets: Vec<RegionBlock> = places.chunks(LANES).map(RegionBlock::new).collect();
        let tops = octets.chunks(LANES).map(RegionGroup::new).collect();
        TrackedRegions {
            around: octets.iter().fold(Bounds::default(), |all, octet| all.union(octet.around)),
            octets,
            tops,
        }
    }
}

impl RegionBlock {
    fn new(places: &[(Kdop, u64)]) -> Self {
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
        RegionBlock { around, bits, all: bits.iter().fold(0, |all, bit| all | bit), low, high }
    }

    /// Bits of the places that a ray crosses.
    #[inline(always)]
    fn crossed<L: Wide>(&self, probe: &PaddedRay, slanted: &mut Option<DiagonalRay>) -> u64 {
        let mut enter = L::splat(0.0);
        let mut leave = L::splat(probe.end);
        for way in 0..3 {
            let sides = [L::load(&self.low[way]), L::load(&self.high[way])];
            (enter, leave) = probe.clip([enter, leave], sides, probe.origin[way], probe.inverse[way]);
        }
        if met(enter, leave) == 0 {
            return 0;
        }
        let DiagonalRay { from, inverse } = slanted.get_or_insert_with(|| DiagonalRay::new(probe));
        for i in 0..DIAGONALS.len() {
            let sides = [L::load(&self.low[3 + i]), L::load(&self.high[3 + i])];
            (enter, leave) = probe.clip([enter, leave], sides, from[i], inverse[i]);
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

impl RegionGroup {
    fn new(octets: &[RegionBlock]) -> Self {
        let side = |pick: fn(&Bounds) -> Vec3, axis: usize| {
            std::array::from_fn(|i| octets.get(i).map_or(NOWHERE, |octet| pick(&octet.around)[axis]))
        };
        RegionGroup {
            all: octets.iter().fold(0, |all, octet| all | octet.all),
            min: std::array::from_fn(|axis| side(|around| around.min, axis)),
            max: std::array::from_fn(|axis| side(|around| around.max, axis)),
        }
    }

    /// Octets that a ray may cross, by bit.
    #[inline(always)]
    fn near<L: Wide>(&self, probe: &PaddedRay) -> u32 {
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
struct PaddedRay {
    origin: Vec3,
    direction: Vec3,
    inverse: Vec3,
    end: f32,
    /// How far off a ray from so far away may be.
    off: f32,
}

impl PaddedRay {
    #[inline(always)]
    fn new(ray: &Ray, end: f32) -> Self {
        let [x, y, z] = ray.direction.to_array().map(finite_recip::<f32>);
        PaddedRay {
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

/// A ray along the diagonals.
struct DiagonalRay {
    from: [f32; DIAGONALS.len()],
    inverse: [f32; DIAGONALS.len()],
}

impl DiagonalRay {
    #[inline(always)]
    fn new(probe: &PaddedRay) -> Self {
        let (mut from, mut inverse) = ([0.0; DIAGONALS.len()], [0.0; DIAGONALS.len()]);
        for (i, (first, second, sign)) in DIAGONALS.into_iter().enumerate() {
            from[i] = probe.origin[first] + sign * probe.origin[second];
            inverse[i] = finite_recip(probe.direction[first] + sign * probe.direction[second]);
        }
        DiagonalRay { from, inverse }
    }
}

/// Lanes in which something is left of the ray.
#[inline(always)]
fn met<L: Wide>(enter: L, leave: L) -> u32 {
    L::bits((enter * L::splat(1.0 - SLACK)).le(leave * L::splat(1.0 + SLACK)))
}

/// Places to look out for: those that rays of this picture may be asked about later have their bits in `live`.
#[derive(Clone, Copy, Debug)]
pub struct DirtyRegions<'a> {
    /// The regions.
    pub boxes: &'a TrackedRegions,
    /// A bit for each that is still looked for.
    pub live: u64,
    /// The point from which it is measured how far away rays start.
    pub middle: Vec3,
    /// What the tests run in.
    pub width: Width,
}

/// What the rays of one sample, or of one pixel, touched.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TouchMask {
    /// Bits of the places that they crossed.
    pub crossed: u64,
    /// Square of the farthest distance of a start from the middle.
    pub far: f32,
}

impl TouchMask {
    /// Of rays that are not held against any place: they may have crossed all.
    pub const UNTESTED: TouchMask = TouchMask { crossed: u64::MAX, far: 0.0 };

    fn join(&mut self, other: TouchMask) {
        *self = TouchMask { crossed: self.crossed | other.crossed, far: self.far.max(other.far) };
    }
}

/// What the rays of samples crossed.
#[derive(Clone, Debug, Default)]
pub struct Footprint {
    /// By sample of the batch.
    marks: Vec<TouchMask>,
    /// By pixel of the tile, where pixels are kept as wholes.
    pub(super) pixels: Vec<TouchMask>,
    /// The rays of a wave, with sample and end of each.
    rays: Vec<(Ray, u32, f32)>,
}

impl Footprint {
    /// Before the first ray of a batch, with what is known of each sample.
    pub fn begin(&mut self, samples: impl Iterator<Item = TouchMask>) {
        self.marks.clear();
        self.marks.extend(samples);
    }

    /// What the rays of the samples of the batch touched.
    pub fn marks(&self) -> &[TouchMask] {
        &self.marks
    }

    /// Puts a sample of the batch down to its pixel.
    pub fn put_down(&mut self, sample: usize, pixel: usize) {
        self.pixels[pixel].join(self.marks[sample]);
    }

    /// As [`Self::begin`], with samples of these pixels.
    pub fn begin_of_pixels(&mut self, pixels: impl Iterator<Item = usize>) {
        self.marks.clear();
        self.marks.extend(pixels.map(|pixel| self.pixels[pixel]));
    }

    /// Notes what rays cross, each of a sample and before an end.
    pub fn add(&mut self, lookout: DirtyRegions, added: impl Iterator<Item = (Ray, u32, f32)>) {
        let Footprint { marks, rays, .. } = self;
        rays.clear();
        rays.extend(added);
        lookout.width.run(TouchKernel { lookout, rays, marks });
    }
}

struct TouchKernel<'a> {
    lookout: DirtyRegions<'a>,
    rays: &'a [(Ray, u32, f32)],
    marks: &'a mut [TouchMask],
}

impl Kernel for TouchKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Wide>(self) {
        let TouchKernel { lookout: DirtyRegions { boxes, live, middle, .. }, rays, marks } = self;
        for (ray, sample, end) in rays {
            let TouchMask { crossed, far } = &mut marks[*sample as usize];
            *far = far.max(ray.origin.distance_squared(middle));
            if live & !*crossed == 0 {
                continue;
            }
            let probe = PaddedRay::new(ray, *end);
            if probe.misses(&boxes.around) {
                continue;
            }
            let mut slanted = None;
            for (top, octets) in boxes.tops.iter().zip(boxes.octets.chunks(LANES)) {
                if top.all & live & !*crossed == 0 {
                    continue;
                }
                let mut near = top.near::<L>(&probe) & ((1 << octets.len()) - 1);
                while near != 0 {
                    let octet = &octets[near.trailing_zeros() as usize];
                    if octet.all & live & !*crossed != 0 {
                        *crossed |= octet.crossed::<L>(&probe, &mut slanted);
                    }
                    near &= near - 1;
                }
            }
        }
    }
}
