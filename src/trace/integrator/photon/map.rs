//! Photons where they came to rest, and those around a point.

use glam::Vec3;

/// Power that arrives at a point of a diffuse surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Photon {
    pub position: Vec3,
    /// Unit, back to where it came from.
    pub toward: Vec3,
    /// True normal of the surface, unit, on the side that it arrived at.
    pub normal: Vec3,
    pub power: Vec3,
    /// Rays from the light to here.
    pub rays: u32,
}

/// Photons in buckets of cells, for searches within a radius or a few times as far.
///
/// Cells are as wide as the nearest search, so that it touches eight; they are hashed to as many buckets as there are
/// photons (Teschner et al., VMV 2003). Within a bucket photons stand in the order that they were given in, so that
/// sums over them are always taken in the same order.
#[derive(Clone, Debug, Default)]
pub struct PhotonMap {
    /// Of the nearest search.
    radius: f32,
    /// First photon of each bucket, and the end of the last.
    starts: Vec<u32>,
    photons: Vec<Photon>,
}

/// How many times farther photons are spread where they are few.
pub const REACHES: [f32; 3] = [1.0, 2.0, 4.0];

/// Photons that are enough to spread them no farther.
const ENOUGH: usize = 16;

/// How far off the tangent plane a photon may lie, in radii: what lies beyond is another surface.
pub const THICKNESS: f32 = 0.25;

/// Distance from the origin, in radii, where photons are given up: numbers of cells stay whole.
const FARTHEST: f32 = 1e9;

/// Least cosine between the normals of a photon and of the point that asks: less is another surface, or round a corner.
pub const AGREEMENT: f32 = 0.7;

impl PhotonMap {
    /// `radius` is that of the nearest search; one that is not above 0 makes an empty map.
    pub fn new(mut photons: Vec<Photon>, radius: f32) -> Self {
        let usable = radius > 0.0 && radius < f32::INFINITY;
        if !usable {
            return PhotonMap::default();
        }
        // Farther out the radius is lost in the rounding of positions.
        photons.retain(|photon| photon.position.abs().max_element() < radius * FARTHEST);
        if photons.is_empty() {
            return PhotonMap::default();
        }
        let buckets = photons.len().next_power_of_two();
        let mut map = PhotonMap { radius, starts: vec![0; buckets + 1], photons: Vec::new() };
        let homes: Vec<u32> = photons.iter().map(|p| map.bucket(map.cell(p.position)) as u32).collect();
        for home in &homes {
            map.starts[*home as usize + 1] += 1;
        }
        for i in 0..buckets {
            map.starts[i + 1] += map.starts[i];
        }
        let mut next = map.starts.clone();
        map.photons = vec![Photon::default(); photons.len()];
        for (home, photon) in homes.into_iter().zip(photons) {
            let slot = &mut next[home as usize];
            map.photons[*slot as usize] = photon;
            *slot += 1;
        }
        map
    }

    /// Of the nearest search; 0 of an empty map.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Memory that it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.starts) + size_of_val(&*self.photons)
    }

    fn cell(&self, p: Vec3) -> [i32; 3] {
        (p * (0.5 / self.radius)).floor().to_array().map(|x| x as i32)
    }

    fn bucket(&self, [x, y, z]: [i32; 3]) -> usize {
        let mix = (x as u32).wrapping_mul(73_856_093) ^ (y as u32).wrapping_mul(19_349_663);
        let mix = (mix ^ (z as u32).wrapping_mul(83_492_791)).wrapping_mul(0x9e37_79b9);
        let buckets = self.starts.len() - 1;
        // The upper bits are the well mixed ones.
        ((u64::from(mix) * buckets as u64) >> 32) as usize
    }

    /// The first of the reaches within which there are enough photons around this point, or else the last.
    pub fn reach(&self, point: Vec3, normal: Vec3) -> usize {
        let enough = |reach: &f32| {
            let mut count = 0;
            self.around(point, normal, *reach, |_, _| count += 1);
            count >= ENOUGH
        };
        REACHES.iter().position(enough).unwrap_or(REACHES.len() - 1)
    }

    /// Calls `found` with every photon that lies within `reach` radii around a point of a surface, and with its share
    /// of the density there, per unit of area (the kernel of Epanechnikov, as Silverman 1986 has it in the plane).
    #[inline]
    pub fn around(&self, point: Vec3, normal: Vec3, reach: f32, mut found: impl FnMut(&Photon, f32)) {
        if self.photons.is_empty() {
            return;
        }
        let radius = self.radius * reach;
        let [low, high] = [-radius, radius].map(|r| self.cell(point + Vec3::splat(r)));
        let (square, peak) = (radius * radius, 2.0 / (std::f32::consts::PI * radius * radius));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let bucket = self.bucket([x, y, z]);
                    let range = self.starts[bucket] as usize..self.starts[bucket + 1] as usize;
                    for photon in &self.photons[range] {
                        let offset = photon.position - point;
                        let distance = offset.length_squared();
                        let aside = distance >= square || offset.dot(normal).abs() > THICKNESS * radius;
                        // Cells may share a bucket.
                        if !aside && photon.normal.dot(normal) > AGREEMENT && self.cell(photon.position) == [x, y, z] {
                            found(photon, peak * (1.0 - distance / square));
                        }
                    }
                }
            }
        }
    }
}

/// Radius of the disk that holds `count` photons where they lie as densely as at the median of them.
///
/// Some of the photons are asked for their near neighbours among a part of all: a rough answer serves. `None` if there
/// are too few photons to tell.
pub fn spacing(photons: &[Photon], count: f32) -> Option<f32> {
    const PART: usize = 1 << 14;
    const ASKED: usize = 63;
    const NEAR: usize = 8;
    let stride = photons.len().div_ceil(PART).max(1);
    let part: Vec<Vec3> = photons.iter().step_by(stride).map(|p| p.position).collect();
    if part.len() <= NEAR {
        return None;
    }
    let mut near = Vec::with_capacity(part.len());
    let mut radii: Vec<f32> = (0..ASKED.min(part.len()))
        .map(|i| {
            let from = part[i * part.len() / ASKED.min(part.len())];
            near.clear();
            near.extend(part.iter().map(|p| p.distance_squared(from)));
            // The nearest of all is the photon itself.
            *near.select_nth_unstable_by(NEAR, f32::total_cmp).1
        })
        .collect();
    let middle = radii.len() / 2;
    let square = *radii.select_nth_unstable_by(middle, f32::total_cmp).1;
    let radius = (square * (count / (NEAR * stride) as f32)).sqrt();
    (radius > 0.0 && radius < f32::INFINITY).then_some(radius)
}

/// Squared radius of a pass, counted from 0, in parts of the first one's (Knaus and Zwicker, ACM TOG 2011, equation
/// 20): each is the one before times (i + alpha) / (i + 1), so that noise and blur of the mean both vanish.
pub fn shrinking(pass: u32) -> f64 {
    const ALPHA: f64 = 2.0 / 3.0;
    (1..=pass).fold(1.0, |square, i| square * (f64::from(i) + ALPHA) / (f64::from(i) + 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::random::{hash_words, unit_f32};

    /// Photons all over a square of side 2 in the plane z = 0, that add up to a power of 1 per unit of area.
    fn carpet(count: u32) -> Vec<Photon> {
        let at = |i: u32, axis: u64| 2.0 * unit_f32(hash_words([u64::from(i), axis])) - 1.0;
        let photon = |i| Photon {
            position: Vec3::new(at(i, 0), at(i, 1), 0.0),
            normal: Vec3::Z,
            toward: Vec3::Z,
            power: Vec3::splat(4.0 / count as f32),
            rays: 2,
        };
        (0..count).map(photon).collect()
    }

    fn density(map: &PhotonMap, point: Vec3, normal: Vec3) -> f32 {
        let mut sum = 0.0;
        map.around(point, normal, 1.0, |photon, share| sum += photon.power.x * share);
        sum
    }

    #[test]
    fn an_even_carpet_has_the_density_one() {
        let map = PhotonMap::new(carpet(100_000), 0.1);
        let places = [[0.0, 0.0], [0.5, -0.4], [-0.85, 0.85], [0.2, 0.2]];
        let mean = places.map(|[x, y]| density(&map, Vec3::new(x, y, 0.0), Vec3::Z)).iter().sum::<f32>() / 4.0;
        assert!((mean - 1.0).abs() < 0.03, "{mean}");
        // Half of the disk lies beyond the edge: what is not there is not made up for.
        let edge = density(&map, Vec3::new(1.0, 0.0, 0.0), Vec3::Z);
        assert!((edge - 0.5).abs() < 0.05, "{edge}");
    }

    #[test]
    fn a_search_finds_what_brute_force_finds() {
        let photons = carpet(3000);
        let map = PhotonMap::new(photons.clone(), 0.07);
        for place in &photons[..50] {
            let at = place.position + Vec3::new(0.013, -0.02, 0.001);
            let near = photons.iter().filter(|p| p.position.distance_squared(at) < 0.07 * 0.07).count();
            let mut found = 0;
            map.around(at, Vec3::Z, 1.0, |_, _| found += 1);
            assert_eq!(found, near);
            // The same far out of cells that are much smaller.
            let mut found = 0;
            PhotonMap::new(photons.clone(), 0.0175).around(at, Vec3::Z, 4.0, |_, _| found += 1);
            assert_eq!(found, near);
        }
    }

    #[test]
    fn photons_reach_as_far_as_there_are_enough() {
        // 3000 photons on 4 units of area: 16 in a radius of 0.082.
        for (radius, expected) in [(0.12, 0), (0.058, 1), (0.029, 2), (0.001, 2)] {
            assert_eq!(PhotonMap::new(carpet(3000), radius).reach(Vec3::ZERO, Vec3::Z), expected, "{radius}");
        }
    }

    #[test]
    fn other_surfaces_do_not_count() {
        let map = PhotonMap::new(carpet(10_000), 0.1);
        assert_eq!(density(&map, Vec3::new(0.0, 0.0, 0.05), Vec3::Z), 0.0);
        assert_eq!(density(&map, Vec3::ZERO, Vec3::NEG_Z), 0.0);
        assert_eq!(density(&map, Vec3::ZERO, Vec3::X), 0.0);
    }

    #[test]
    fn odd_maps_are_empty() {
        for radius in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(PhotonMap::new(carpet(10), radius).photons.is_empty());
        }
        assert_eq!(density(&PhotonMap::new(Vec::new(), 1.0), Vec3::ZERO, Vec3::Z), 0.0);
        let far = Photon { position: Vec3::splat(1e30), ..carpet(1)[0] };
        assert!(PhotonMap::new(vec![far; 3], 1e-3).photons.is_empty());
    }

    #[test]
    fn spacing_follows_from_density() {
        // 40 photons to a disk: pi r^2 = 4 * 40 / n.
        for n in [2_000u32, 60_000] {
            let expected = (4.0 * 40.0 / n as f32 / std::f32::consts::PI).sqrt();
            let found = spacing(&carpet(n), 40.0).unwrap();
            assert!((found / expected - 1.0).abs() < 0.25, "{found} {expected}");
        }
        assert_eq!(spacing(&carpet(8), 40.0), None);
        assert_eq!(spacing(&[carpet(1)[0]; 100], 40.0), None);
    }

    #[test]
    fn radii_shrink_as_published() {
        assert_eq!(shrinking(0), 1.0);
        assert!((shrinking(1) - (5.0 / 3.0) / 2.0).abs() < 1e-12);
        // r^2 goes as n^(alpha - 1).
        let ratio = shrinking(8000) / shrinking(1000);
        assert!((ratio - 0.5).abs() < 1e-3, "{ratio}");
    }
}
