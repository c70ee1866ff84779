//! Stateless sampling: every random decision is a hash of (seed, pixel, sample, what it is for).
//!
//! A [`Sampler`] belongs to one sample of one pixel. It hands out stratified points: the n x n samples of a pixel fill
//! the n x n cells of any square domain (pixel, lens, light, gloss) once each, in an order shuffled per pixel and
//! domain, so that domains are decorrelated (Cook 1986; the shuffle is Kensler's, Pixar memo 13-01).
//!
//! A [`Sampler::sobol`] hands out [`sobol`] points by the same names, for any number of samples.

use super::sobol;
use crate::base::random::{combine, mix, unit_f32};

/// What a stratified point is for; domains of one ray-tree node must differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// The place in the pixel.
    Pixel,
    /// The place on the lens.
    Lens,
    /// The direction of a mirrored ray.
    Gloss,
    /// Direction of a path after a diffuse surface.
    Bounce,
    /// Which of a surface's ways of scattering a path takes.
    Lobe,
    /// Whether a path goes on.
    Roulette,
    /// When, while the shutter is open.
    Time,
    /// Which part of what a path goes on with it looks for.
    Part,
    /// How the directions lie in which a surface is looked over that photons are gathered from.
    Gather,
    /// How far a path gets in fog, and where it is scattered to.
    FreeFlight,
    /// Which light is asked for what it sends into fog, and where.
    InScatter,
    /// The point of that light.
    InScatterLight,
    /// The point of a light, by its number.
    Light(u32),
    /// Whether a surface that is there in part is, after so many others on the same ray.
    Hole(u32),
}

impl Domain {
    fn word(self) -> u64 {
        match self {
            Domain::Pixel => 0,
            Domain::Lens => 1,
            Domain::Gloss => 2,
            Domain::Bounce => 3,
            Domain::Lobe => 4,
            Domain::Roulette => 5,
            Domain::Time => 6,
            Domain::Part => 7,
            Domain::Gather => 8,
            Domain::FreeFlight => 9,
            Domain::InScatter => 10,
            Domain::InScatterLight => 11,
            Domain::Light(i) => 16 + u64::from(i),
            Domain::Hole(i) => (1 << 40) + u64::from(i),
        }
    }
}

/// One sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    /// Of the pixel; of its block for Sobol points.
    pub(super) pixel_key: u64,
    /// Index of the sample, 0..strata^2.
    pub sample: u32,
    /// Side n of the n x n strata.
    pub strata: u32,
    /// Place of the pixel along the curve through its block; [`STRATA`] where points are stratified.
    pub(super) place: u32,
    /// Digits that number the samples of a pixel.
    pub(super) digits: u32,
}

/// No place along a curve.
pub const STRATA: u32 = u32::MAX;

/// A node of the tree of rays of one sample: equal for corresponding rays of all samples of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RayNode(u64);

impl RayNode {
    /// The ray from the camera.
    pub const CAMERA: RayNode = RayNode(0);

    /// The lower half of what stands for it, and the upper one.
    #[inline(always)]
    pub fn halves(self) -> [u32; 2] {
        [self.0 as u32, (self.0 >> 32) as u32]
    }

    /// The node of a number that was split in two.
    #[inline(always)]
    pub fn of_halves([low, high]: [u32; 2]) -> RayNode {
        RayNode(u64::from(high) << 32 | u64::from(low))
    }

    /// The node of the ray that a mirror sends on.
    pub fn reflected(self) -> RayNode {
        RayNode(combine(self.0, 1))
    }

    /// The node of the ray that goes through.
    pub fn refracted(self) -> RayNode {
        RayNode(combine(self.0, 2))
    }

    /// The node of the ray that a path goes on with.
    pub fn scattered(self) -> RayNode {
        RayNode(combine(self.0, 3))
    }
}

impl Sampler {
    /// Samples of a pixel in `strata` by `strata` cells.
    pub fn new(seed: u64, pixel: u32, strata: u32) -> Self {
        Sampler { pixel_key: combine(seed, u64::from(pixel)), sample: 0, strata, place: STRATA, digits: 0 }
    }

    /// Sobol points for `samples` samples of pixel (x, y); those past that number start another set.
    pub fn sobol(seed: u64, [x, y]: [u32; 2], samples: u32) -> Self {
        let block = u64::from(x >> sobol::BLOCK_BITS) << 32 | u64::from(y >> sobol::BLOCK_BITS);
        let place = sobol::curve([x, y]);
        let strata = samples.isqrt().max(1);
        Sampler { pixel_key: combine(seed, block), sample: 0, strata, place, digits: sobol::digits(samples) }
    }

    /// Number of the sample in the sequence of its block, how many digits that has, and the key of a pair.
    fn numbered(&self, key: u64) -> (u32, u32, u64) {
        let low = self.sample & ((1 << (2 * self.digits)) - 1);
        let set = self.sample >> (2 * self.digits);
        let key = if set == 0 { key } else { combine(key, u64::from(set)) };
        (self.place << (2 * self.digits) | low, sobol::BLOCK_BITS + self.digits, key)
    }

    pub(super) fn key(&self, node: RayNode, domain: Domain) -> u64 {
        mix(self.pixel_key ^ node.0.wrapping_add(domain.word().wrapping_mul(0x9e37_79b9_7f4a_7c15)))
    }

    /// A point in the unit square, in this sample's cell of the domain's shuffled strata.
    pub fn stratified(&self, node: RayNode, domain: Domain) -> [f32; 2] {
        let key = self.key(node, domain);
        if self.place != STRATA {
            let (number, digits, key) = self.numbered(key);
            return sobol::pair(number, digits, key);
        }
        let cell = shuffle(self.sample, self.strata * self.strata, key as u32);
        self.within(cell, key)
    }

    /// As [`Self::stratified`], but in the cell of the sample itself: for the pixel.
    pub fn in_own_cell(&self, node: RayNode, domain: Domain) -> [f32; 2] {
        if self.place != STRATA {
            return self.stratified(node, domain);
        }
        self.within(self.sample, self.key(node, domain))
    }

    fn within(&self, cell: u32, key: u64) -> [f32; 2] {
        let [x, y] = self.pair(key);
        let n = self.strata;
        let side = 1.0 / n as f32;
        // A product can round up to 1; the domain is half open.
        let below_one = 1.0 - f32::EPSILON / 2.0;
        let place = |cell: u32, offset: f32| ((cell as f32 + offset) * side).min(below_one);
        // Exact for all counts of samples: the quotient is never within rounding of the next.
        let row = ((cell as f32 + 0.5) * side) as u32;
        [place(cell - row * n, x), place(row, y)]
    }

    /// An independent uniform point in the unit square.
    pub fn random(&self, node: RayNode, domain: Domain) -> [f32; 2] {
        let key = self.key(node, domain);
        self.pair(if self.place == STRATA { key } else { combine(key, u64::from(self.place)) })
    }

    /// An independent uniform number, apart from the pairs of the same domain; a stratified one of Sobol points.
    pub fn extra(&self, node: RayNode, domain: Domain) -> f32 {
        if self.place != STRATA {
            // Any other key serves: another pair.
            let (number, digits, key) = self.numbered(!self.key(node, domain));
            return sobol::single(number, digits, key);
        }
        unit_f32(combine(self.key(node, domain), !u64::from(self.sample)))
    }

    /// A position among the pixel's samples, shuffled per pixel and domain.
    pub fn shuffled(&self, domain: Domain, position: u32) -> u32 {
        shuffle(position, self.strata * self.strata, self.own_key(domain) as u32)
    }

    /// A whole number below `steps`, of at most 24 bits, that belongs to the pixel and the domain.
    pub fn offset(&self, domain: Domain, steps: u64) -> u64 {
        (self.own_key(domain) >> 40) % steps
    }

    /// A key of the pixel alone, even where points are those of its block.
    fn own_key(&self, domain: Domain) -> u64 {
        let key = self.key(RayNode::CAMERA, domain);
        if self.place == STRATA { key } else { combine(key, u64::from(self.place)) }
    }

    fn pair(&self, key: u64) -> [f32; 2] {
        let hash = combine(key, u64::from(self.sample));
        [unit_f32(hash), unit_f32(hash << 24)]
    }
}

/// Position of `index` in a pseudo-random permutation of `0..length`.
fn shuffle(index: u32, length: u32, key: u32) -> u32 {
    if length == 1 {
        return 0;
    }
    let mask = length.next_power_of_two() - 1;
    let mut i = index;
    loop {
        i ^= key;
        i = i.wrapping_mul(0xe170_893d);
        i ^= key >> 16;
        i ^= (i & mask) >> 4;
        i ^= key >> 8;
        i = i.wrapping_mul(0x0929_eb3f);
        i ^= key >> 23;
        i ^= (i & mask) >> 1;
        i = i.wrapping_mul(1 | key >> 27);
        i = i.wrapping_mul(0x6935_fa69);
        i ^= (i & mask) >> 11;
        i = i.wrapping_mul(0x74dc_b303);
        i ^= (i & mask) >> 2;
        i = i.wrapping_mul(0x9e50_1cc3);
        i ^= (i & mask) >> 2;
        i = i.wrapping_mul(0xc860_a3df);
        i &= mask;
        i ^= i >> 5;
        if i < length {
            break;
        }
    }
    // Rotated by a share of the length: no division.
    let turned = i + ((u64::from(key.wrapping_mul(0x9e37_79b9)) * u64::from(length)) >> 32) as u32;
    if turned < length { turned } else { turned - length }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::sampler::warp::{concentric_disk, sin_cos};

    #[test]
    fn the_shuffle_is_a_permutation() {
        for length in [1, 2, 4, 9, 16, 25, 100, 1024] {
            for key in [0, 1, 0xdead_beef, u32::MAX] {
                let mut seen = vec![false; length as usize];
                (0..length).for_each(|i| seen[shuffle(i, length, key) as usize] = true);
                assert!(seen.iter().all(|s| *s), "{length} {key}");
            }
        }
    }

    #[test]
    fn samples_of_a_pixel_fill_every_cell_once() {
        for domain in [Domain::Lens, Domain::Light(3)] {
            let mut sampler = Sampler::new(1, 77, 5);
            let mut seen = [false; 25];
            for sample in 0..25 {
                sampler.sample = sample;
                let [x, y] = sampler.stratified(RayNode::CAMERA.reflected(), domain);
                assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
                seen[(y * 5.0) as usize * 5 + (x * 5.0) as usize] = true;
            }
            assert!(seen.iter().all(|s| *s));
        }
    }

    #[test]
    fn rows_of_cells_are_exact() {
        for n in 1..=crate::base::limits::SAMPLES.isqrt() {
            let side = 1.0 / n as f32;
            for cell in [0, 1, n - 1, n, n + 1, n * n / 2, n * n - n, n * n - 1] {
                let cell = cell.min(n * n - 1);
                assert_eq!(((cell as f32 + 0.5) * side) as u32, cell / n, "{cell} of {n} x {n}");
            }
        }
    }

    #[test]
    fn domains_are_decorrelated() {
        let mut sampler = Sampler::new(1, 0, 1);
        let mut sum = 0.0f64;
        for pixel in 0..20_000 {
            sampler = Sampler::new(1, pixel, sampler.strata);
            let [a, _] = sampler.stratified(RayNode::CAMERA, Domain::Light(0));
            let [b, _] = sampler.stratified(RayNode::CAMERA, Domain::Light(1));
            sum += (f64::from(a) - 0.5) * (f64::from(b) - 0.5);
        }
        assert!((sum / 20_000.0).abs() < 0.003, "{sum}");
    }

    #[test]
    fn sines_are_right_to_the_last_digits() {
        for i in -1000..=1000 {
            let x = i as f32 / 1000.0 * std::f32::consts::FRAC_PI_4;
            let ([sin, cos], (s, c)) = (sin_cos(x), libm::sincos(f64::from(x)));
            assert!((f64::from(sin) - s).abs() < 1.2e-7 && (f64::from(cos) - c).abs() < 1.2e-7, "{x}");
        }
    }

    #[test]
    fn the_disk_is_covered_evenly() {
        let (mut inside, n) = (0, 200);
        for i in 0..n {
            for j in 0..n {
                let [x, y]: [f32; 2] = concentric_disk([(i as f32 + 0.5) / n as f32, (j as f32 + 0.5) / n as f32]);
                assert!(x * x + y * y <= 1.0 + 1e-6);
                inside += usize::from(x * x + y * y < 0.25);
            }
        }
        assert!((inside as f64 / (n * n) as f64 - 0.25).abs() < 0.01);
    }
}
