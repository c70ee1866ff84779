//! What the rays of a tile touched of that which changes from one picture to the next.
//!
//! While the camera stands still, all that can change in a tile is what its rays meet: the bodies that move, grow or put
//! on another material. Where these bodies are in all pictures to come is known before the first is traced ([`Boxes`]),
//! so a tile need only note which of their places its rays crossed ([`Footprint`]): camera rays, mirror images, shadows
//! and bounces alike. In a later picture the tile is the same, to the bit, unless a body left or took one of those.

use glam::Vec3;

use super::Ray;
use super::geometry::Bounds;

/// Boxes side by side, for one ray against all eight.
const SIDE: usize = 8;

/// Places of bodies in all pictures, by number.
#[derive(Clone, Debug, Default)]
pub struct Boxes {
    octets: Vec<Octet>,
    /// Around all of them: most rays need no more.
    around: Bounds,
    count: usize,
}

#[derive(Clone, Debug)]
struct Octet {
    around: [Vec3; 2],
    /// By axis.
    min: [[f32; SIDE]; 3],
    max: [[f32; SIDE]; 3],
}

/// Share of its distance by which a ray may be off, far above what roundings make of it.
const SLACK: f32 = 1e-5;

impl Boxes {
    /// Boxes that follow each other should lie near each other.
    pub fn new(places: &[Bounds]) -> Self {
        let octet = |places: &[Bounds]| {
            let padded: Vec<Bounds> = places.iter().map(|place| widened(*place)).collect();
            let all = padded.iter().fold(Bounds::default(), |all, one| all.union(*one));
            // What is missing to eight is nowhere.
            let get = |pick: fn(&Bounds) -> Vec3, axis: usize, none: f32| {
                std::array::from_fn(|i| padded.get(i).map_or(none, |place| pick(place)[axis]))
            };
            Octet {
                around: [all.min, all.max],
                min: std::array::from_fn(|axis| get(|place| place.min, axis, f32::INFINITY)),
                max: std::array::from_fn(|axis| get(|place| place.max, axis, f32::NEG_INFINITY)),
            }
        };
        let octets: Vec<Octet> = places.chunks(SIDE).map(octet).collect();
        let all = |all: Bounds, octet: &Octet| all.union(Bounds { min: octet.around[0], max: octet.around[1] });
        Boxes { around: octets.iter().fold(Bounds::default(), all), octets, count: places.len() }
    }

    pub fn len(&self) -> usize {
        self.count
    }

    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

fn widened(place: Bounds) -> Bounds {
    let pad = 1e-4 * place.size().max_element() + 1e-5 * place.min.abs().max(place.max.abs()).max_element();
    Bounds { min: place.min - pad, max: place.max + pad }
}

/// What the rays of one tile crossed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Footprint {
    /// Bits of the boxes, eight a byte.
    crossed: Vec<u8>,
    /// Around the points that the rays start from.
    origins: Bounds,
}

impl Footprint {
    pub fn new(boxes: &Boxes) -> Self {
        Footprint { crossed: vec![0; boxes.octets.len()], origins: Bounds::default() }
    }

    /// Whether a ray crossed the box of this number.
    pub fn has(&self, number: usize) -> bool {
        self.crossed[number / SIDE] >> (number % SIDE) & 1 == 1
    }

    pub fn origins(&self) -> Bounds {
        self.origins
    }

    pub fn bytes(&self) -> usize {
        self.crossed.len() + size_of::<Self>()
    }

    /// Notes what a ray crosses before `end`.
    #[inline]
    pub fn add(&mut self, boxes: &Boxes, ray: &Ray, end: f32) {
        self.origins = Bounds { min: self.origins.min.min(ray.origin), max: self.origins.max.max(ray.origin) };
        let inverse = 1.0 / ray.direction;
        let end = end + end * SLACK;
        if is_apart([boxes.around.min, boxes.around.max], ray.origin, inverse, end) {
            return;
        }
        for (octet, bits) in boxes.octets.iter().zip(&mut self.crossed) {
            if *bits != u8::MAX && !is_apart(octet.around, ray.origin, inverse, end) {
                *bits |= octet.crossed(ray.origin, inverse, end);
            }
        }
    }
}

/// Whether a ray misses a box for certain: not where a distance is no number.
#[inline(always)]
fn is_apart(corners: [Vec3; 2], origin: Vec3, inverse: Vec3, end: f32) -> bool {
    let [min, max] = corners.map(|corner| (corner - origin) * inverse);
    let (enter, leave) = (min.min(max).max_element(), min.max(max).min_element());
    enter.max(0.0) * (1.0 - SLACK) > leave.min(end) * (1.0 + SLACK)
}

impl Octet {
    #[inline]
    fn crossed(&self, origin: Vec3, inverse: Vec3, end: f32) -> u8 {
        let (mut enter, mut leave) = ([0.0f32; SIDE], [end; SIDE]);
        for axis in 0..3 {
            let (from, by) = (origin[axis], inverse[axis]);
            for i in 0..SIDE {
                let (a, b) = ((self.min[axis][i] - from) * by, (self.max[axis][i] - from) * by);
                enter[i] = enter[i].max(a.min(b));
                leave[i] = leave[i].min(a.max(b));
            }
        }
        (0..SIDE).fold(0, |bits, i| bits | u8::from(enter[i] * (1.0 - SLACK) <= leave[i] * (1.0 + SLACK)) << i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cube(center: Vec3, half: f32) -> Bounds {
        Bounds { min: center - half, max: center + half }
    }

    fn crossed(places: &[Bounds], ray: &Ray, end: f32) -> Vec<usize> {
        let boxes = Boxes::new(places);
        let mut footprint = Footprint::new(&boxes);
        footprint.add(&boxes, ray, end);
        (0..boxes.len()).filter(|i| footprint.has(*i)).collect()
    }

    #[test]
    fn a_ray_crosses_what_lies_before_its_end() {
        let row: Vec<Bounds> = (0..20).map(|i| cube(Vec3::X * i as f32, 0.2)).collect();
        let along = Ray::new(Vec3::new(-5.0, 0.0, 0.0), Vec3::X);
        assert_eq!(crossed(&row, &along, 8.5), [0, 1, 2, 3]);
        assert_eq!(crossed(&row, &along, f32::INFINITY).len(), 20);
        assert_eq!(crossed(&row, &Ray::new(Vec3::X * 3.0, Vec3::Y), 1.0), [3]);
        assert_eq!(crossed(&row, &Ray::new(Vec3::new(3.5, 0.0, 0.0), Vec3::Z), 9.0), [0usize; 0]);
        assert_eq!(crossed(&row, &Ray::new(Vec3::Y, Vec3::X), 9.0), [0usize; 0]);
    }

    proptest! {
        /// Whatever point of the ray lies in a box, the ray crosses it.
        #[test]
        fn no_box_on_the_way_is_missed(
            origin in prop::array::uniform3(-50.0f32..50.0),
            toward in prop::array::uniform3(-1.0f32..1.0),
            at in prop::collection::vec((0.0f32..80.0, 1e-3f32..5.0, prop::array::uniform3(-1.0f32..1.0)), 1..20),
        ) {
            let direction = Vec3::from(toward).normalize_or(Vec3::X);
            let ray = Ray::new(origin.into(), direction);
            let place = |(t, half, off): &(f32, f32, [f32; 3])| {
                cube(ray.origin + direction * *t + Vec3::from(*off) * *half * 0.999, *half)
            };
            let places: Vec<Bounds> = at.iter().map(place).collect();
            prop_assert_eq!(crossed(&places, &ray, 80.0).len(), places.len());
        }
    }
}
