//! Noise for motion: smooth random functions of one to four numbers, the same on every machine.
//!
//! Value noise interpolates random values of a lattice; simplex noise (Perlin 2001) adds gradients around the corners of
//! the simplex that a point lies in. Both hash their lattices with a seed, so that they repeat nowhere.

use ::rhai::{Dynamic, Map};
use glam::DVec3;

use super::convert::{describe, is_vector, number, vector};
use super::errors::{Fallible, complain};
use super::options::CallOptions;
use super::table::{Chapter, Function};
use crate::base::limits;
use crate::base::math::sin_cos_degrees;
use crate::base::random::{combine, mix};

/// Most coordinates of a point that noise is asked for.
const DIMENSIONS: usize = 4;

/// Farthest coordinate: beyond it cells of the lattice are no longer exact numbers.
const FARTHEST: f64 = 1e15;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseKind {
    Value,
    Simplex,
}

/// What a sum of octaves is made of.
#[derive(Clone, Copy, Debug)]
pub struct FractalNoise {
    pub kind: NoiseKind,
    pub seed: u64,
    pub octaves: u32,
    /// How much finer each octave is than the one before.
    pub lacunarity: f64,
    /// How strong each octave is beside the one before.
    pub gain: f64,
}

impl FractalNoise {
    /// The sum of all octaves, divided by what they could add up to: from -1 to 1.
    pub fn at(&self, point: &[f64]) -> f64 {
        let (mut sum, mut whole, mut frequency, mut weight) = (0.0, 0.0, 1.0, 1.0);
        for octave in 0..self.octaves {
            let seed = combine(self.seed, u64::from(octave));
            let mut scaled = [0.0; DIMENSIONS];
            for (slot, x) in scaled.iter_mut().zip(point) {
                *slot = x * frequency;
            }
            sum += weight * noise(self.kind, seed, &scaled[..point.len()]);
            whole += weight;
            frequency *= self.lacunarity;
            weight *= self.gain;
        }
        sum / whole
    }
}

/// Noise from -1 to 1 at a point of one to four coordinates.
pub fn noise(kind: NoiseKind, seed: u64, point: &[f64]) -> f64 {
    match kind {
        NoiseKind::Value => value_noise(seed, point),
        NoiseKind::Simplex => simplex_noise(seed, point),
    }
}

fn cell_hash(seed: u64, cell: &[i64]) -> u64 {
    cell.iter().fold(mix(seed ^ 0x006e_6f69_7365), |hash, c| combine(hash, *c as u64))
}

/// The random value of each corner of a cell, joined by a polynomial whose first two derivatives vanish at the corners.
fn value_noise(seed: u64, point: &[f64]) -> f64 {
    let n = point.len();
    let mut base = [0i64; DIMENSIONS];
    let mut fade = [0.0; DIMENSIONS];
    for (i, x) in point.iter().enumerate() {
        let floor = x.floor();
        let f = x - floor;
        base[i] = floor as i64;
        fade[i] = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    }
    let mut sum = 0.0;
    for corner in 0..1usize << n {
        let mut cell = base;
        let mut weight = 1.0;
        for i in 0..n {
            let upper = corner >> i & 1 == 1;
            cell[i] += i64::from(upper);
            weight *= if upper { fade[i] } else { 1.0 - fade[i] };
        }
        let unit = (cell_hash(seed, &cell[..n]) >> 11) as f64 / (1u64 << 53) as f64;
        sum += weight * (2.0 * unit - 1.0);
    }
    sum
}

/// What brings the strongest sum of all corners to 1: one over the largest value of the sum of (1/2 - d^2)^4 d over the
/// corners of a simplex, d their distances.
const SIMPLEX_SCALE: [f64; DIMENSIONS] = [71.513_811_7, 99.204_334_5, 107.653_485_3, 108.567_826_4];

fn simplex_noise(seed: u64, point: &[f64]) -> f64 {
    let n = point.len();
    let count = n as f64;
    let root = (count + 1.0).sqrt();
    // Between the lattice of cubes and the one of simplices.
    let (skew, unskew) = ((root - 1.0) / count, (1.0 - 1.0 / root) / count);
    let shift = point.iter().sum::<f64>() * skew;
    let mut cell = [0i64; DIMENSIONS];
    let mut floors = [0.0; DIMENSIONS];
    for i in 0..n {
        floors[i] = (point[i] + shift).floor();
        cell[i] = floors[i] as i64;
    }
    let back = floors[..n].iter().sum::<f64>() * unskew;
    let mut offset = [0.0; DIMENSIONS];
    for i in 0..n {
        offset[i] = point[i] - (floors[i] - back);
    }
    // The corners of the simplex are met by stepping along the axes, the largest offset first.
    let mut order = [0, 1, 2, 3];
    order[..n].sort_by(|a, b| offset[*b].total_cmp(&offset[*a]));
    let mut sum = corner(seed, &cell[..n], &offset[..n]);
    for axis in order.into_iter().take(n) {
        cell[axis] += 1;
        for (i, x) in offset.iter_mut().enumerate().take(n) {
            *x += unskew - if i == axis { 1.0 } else { 0.0 };
        }
        sum += corner(seed, &cell[..n], &offset[..n]);
    }
    (sum * SIMPLEX_SCALE[n - 1]).clamp(-1.0, 1.0)
}

/// What the gradient of one corner brings to a point so far from it.
fn corner(seed: u64, cell: &[i64], offset: &[f64]) -> f64 {
    let falloff = 0.5 - offset.iter().map(|x| x * x).sum::<f64>();
    if falloff <= 0.0 {
        return 0.0;
    }
    let gradient = gradient(cell_hash(seed, cell) >> 32, cell.len());
    let slope: f64 = gradient.iter().zip(offset).map(|(g, x)| g * x).sum();
    falloff * falloff * falloff * falloff * slope
}

/// A direction of length 1 (of at most 1 where there is but one axis), one out of a few that lie evenly.
fn gradient(hash: u64, dimensions: usize) -> [f64; DIMENSIONS] {
    let sign = |bit: u64| if hash >> bit & 1 == 0 { 1.0 } else { -1.0 };
    match dimensions {
        1 => [sign(0) * ((hash >> 1 & 7) + 1) as f64 / 8.0, 0.0, 0.0, 0.0],
        2 => {
            let (sin, cos) = sin_cos_degrees((hash & 15) as f64 * 22.5);
            [cos, sin, 0.0, 0.0]
        }
        // Towards the edges of a cube, and of its like in four dimensions: one coordinate is 0, the others are alike.
        _ => {
            let size = 1.0 / (dimensions as f64 - 1.0).sqrt();
            let zero = (hash >> 8) % dimensions as u64;
            let mut out = [0.0; DIMENSIONS];
            for (i, slot) in (0u64..).zip(out.iter_mut()).take(dimensions).filter(|(i, _)| *i != zero) {
                *slot = sign(i) * size;
            }
            out
        }
    }
}

/// A point as scripts write it: a number, a vector, or a list of up to four numbers.
fn point(value: &Dynamic) -> Fallible<Vec<f64>> {
    let out = if let Some(list) = value.read_lock::<::rhai::Array>() {
        list.iter().map(number).collect::<Fallible<Vec<f64>>>()?
    } else if is_vector(value) {
        vector(value)?.to_array().to_vec()
    } else {
        vec![number(value)?]
    };
    if out.is_empty() || out.len() > DIMENSIONS {
        return complain(format!("noise: expected one to four numbers, found {}", describe(value)), None);
    }
    match out.iter().find(|x| x.is_nan() || x.abs() > FARTHEST) {
        Some(x) => complain(format!("noise: a coordinate must lie within +-{FARTHEST:e}, not {x}"), None),
        None => Ok(out),
    }
}

fn fractal(options: &CallOptions, kind: NoiseKind, octaves: u32) -> Fallible<FractalNoise> {
    let kind = match options.choice("kind", &["simplex", "value"])? {
        Some(0) => NoiseKind::Simplex,
        Some(_) => NoiseKind::Value,
        None => kind,
    };
    Ok(FractalNoise {
        kind,
        seed: options.whole("seed", 0, 0, i64::MAX as u64)?,
        octaves: options.whole("octaves", octaves.into(), 1, limits::OCTAVES.into())? as u32,
        lacunarity: options.between("lacunarity", 2.0, 1.0, 16.0)?,
        gain: options.between("gain", 0.5, 0.0, 1.0)?,
    })
}

fn fractal_noise(at: &Dynamic, options: &Map, octaves: u32) -> Fallible<f64> {
    let options = CallOptions::new("noise", options, &["kind", "seed", "octaves", "lacunarity", "gain"])?;
    Ok(fractal(&options, NoiseKind::Simplex, octaves)?.at(&point(at)?))
}

/// Three noises that know nothing of each other, as a vector.
fn shake(seconds: f64, options: &Map) -> Fallible<DVec3> {
    let known = ["amount", "frequency", "period", "kind", "seed", "octaves", "lacunarity", "gain"];
    let options = CallOptions::new("shake", options, &known)?;
    let fractal = fractal(&options, NoiseKind::Simplex, 2)?;
    let frequency = options.between("frequency", 2.0, 0.0, 1e6)?;
    let amount = options.vector_or_number("amount", DVec3::ONE)?;
    let period = options.between("period", 0.0, 0.0, 1e9)?;
    if !seconds.is_finite() || seconds.abs() * frequency > FARTHEST {
        return complain(format!("shake: the time must be a finite number, not {seconds}"), None);
    }
    let axis = |axis: u64| {
        let fractal = FractalNoise { seed: combine(fractal.seed, 1 + axis), ..fractal };
        if period == 0.0 {
            return fractal.at(&[seconds * frequency]);
        }
        // Once around a circle in the plane of noise, as long as the straight way would be.
        let radius = period * frequency / std::f64::consts::TAU;
        let (sin, cos) = sin_cos_degrees(360.0 * (seconds / period));
        fractal.at(&[radius * cos, radius * sin])
    };
    Ok(amount * DVec3::new(axis(0), axis(1), axis(2)))
}

pub const CHAPTER: Chapter = Chapter {
    title: "Noise",
    functions: &[
        Function {
            name: "noise",
            forms: &["noise(at) -> number", "noise(at, options) -> number"],
            text: "A smooth random function of one to four numbers, from -1 to 1, with mean 0, that changes over distances \
                   of about 1. The same place and seed give the same value in every frame and on every machine.",
            arguments: &[
                ("at", "a number, a vector, or a list of up to four numbers"),
                (
                    "options",
                    "a map: `kind` \"simplex\" (the default) or \"value\"; `seed`, whole, from 0, default 0; `octaves` 1 to \
                     16, default 1; `lacunarity`, how much finer each octave is, 1 to 16, default 2; `gain`, how strong \
                     each is beside the one before, 0 to 1, default 0.5",
                ),
            ],
            example: "noise(1.5) == noise(1.5)                                        // true\n\
                      noise([0.2, 0.7, 3.1], #{ seed: 4 }) != noise([0.2, 0.7, 3.1])  // true\n\
                      abs(noise([1.3, 2.1, 0.4, 9.9], #{ kind: \"value\", octaves: 4 })) <= 1.0  // true",
            register: |engine| {
                engine
                    .register_fn("noise", |at: Dynamic| fractal_noise(&at, &Map::new(), 1))
                    .register_fn("noise", |at: Dynamic, options: Map| fractal_noise(&at, &options, 1));
            },
        },
        Function {
            name: "fractal_noise",
            forms: &["fractal_noise(at) -> number", "fractal_noise(at, options) -> number"],
            text: "Noise of several octaves, each finer and weaker than the one before, from -1 to 1: as `noise`, but with 4 \
                   octaves where the options name none.",
            arguments: &[
                ("at", "a number, a vector, or a list of up to four numbers"),
                ("options", "a map, as for `noise`; `octaves` is 4 if left out"),
            ],
            example: "fractal_noise([0.5, 2.0]) == noise([0.5, 2.0], #{ octaves: 4 })   // true",
            register: |engine| {
                engine
                    .register_fn("fractal_noise", |at: Dynamic| fractal_noise(&at, &Map::new(), 4))
                    .register_fn("fractal_noise", |at: Dynamic, options: Map| fractal_noise(&at, &options, 4));
            },
        },
        Function {
            name: "shake",
            forms: &["shake(seconds) -> vector", "shake(seconds, options) -> vector"],
            text: "A vector that trembles around 0, as a camera in the hand: add it to a position or to angles.",
            arguments: &[
                ("seconds", "time in seconds, as `f.seconds`"),
                (
                    "options",
                    "a map: `amount`, the farthest it goes, a number or a vector for its axes, default 1; `frequency` in \
                     swings a second, from 0, default 2; `period` in seconds after which it repeats, so that a loop \
                     closes, default 0 for never; `seed`, `kind`, `octaves` (default 2), `lacunarity`, `gain` as for `noise`",
                ),
            ],
            example: "s.camera.from += shake(f.seconds, #{ amount: 0.02, frequency: 3 });\n\
                      let still = shake(1.0, #{ amount: 0.0 });\n\
                      still                                                          // vec3(0, 0, 0)\n\
                      distance(shake(0.3, #{ period: 2 }), shake(2.3, #{ period: 2 })) < 1e-9  // true",
            register: |engine| {
                engine
                    .register_fn("shake", |t: Dynamic| shake(number(&t)?, &Map::new()))
                    .register_fn("shake", |t: Dynamic, options: Map| shake(number(&t)?, &options));
            },
        },
    ],
};

#[cfg(test)]
mod tests {
    use super::*;

    /// Points that lie as evenly as may be, without a generator.
    fn points(dimensions: usize, count: usize) -> impl Iterator<Item = Vec<f64>> {
        let steps = [0.754_877_666, 0.569_840_29, 0.438_579_021, 0.342_547_9];
        (0..count).map(move |i| (0..dimensions).map(|d| ((i as f64 * steps[d]) % 40.0) * 3.0 - 60.0).collect())
    }

    #[test]
    fn noise_stays_within_1_has_mean_0_and_reaches_far() {
        for kind in [NoiseKind::Value, NoiseKind::Simplex] {
            for n in 1..=4 {
                let (mut low, mut high, mut sum) = (0.0f64, 0.0f64, 0.0);
                for p in points(n, 40_000) {
                    let x = noise(kind, 7, &p);
                    assert!(x.abs() <= 1.0, "{kind:?} {n} {x}");
                    (low, high, sum) = (low.min(x), high.max(x), sum + x);
                }
                assert!(low < -0.6 && high > 0.6, "{kind:?} {n}: {low} {high}");
                assert!((sum / 40_000.0).abs() < 0.03, "{kind:?} {n}: mean {}", sum / 40_000.0);
            }
        }
    }

    /// A jump, or a kink where cells meet, would show as a large second difference.
    #[test]
    fn noise_is_smooth_across_cells() {
        for kind in [NoiseKind::Value, NoiseKind::Simplex] {
            for n in 1..=4 {
                let h = 1e-3;
                let at = |s: f64| {
                    let p: Vec<f64> = (0..n).map(|d| -2.0 + s * (1.0 - 0.17 * d as f64)).collect();
                    noise(kind, 3, &p)
                };
                for i in 1..6_000 {
                    let s = f64::from(i) * h;
                    let bend = (at(s + h) - 2.0 * at(s) + at(s - h)) / (h * h);
                    assert!(bend.abs() < 120.0, "{kind:?} {n} at {s}: {bend}");
                }
            }
        }
    }

    #[test]
    fn seeds_and_places_give_other_values() {
        let same = (0..2_000).filter(|i| {
            let p = [f64::from(*i) * 0.37 + 0.1, 0.4];
            (noise(NoiseKind::Simplex, 1, &p) - noise(NoiseKind::Simplex, 2, &p)).abs() < 1e-3
        });
        assert!(same.count() < 60);
    }

    #[test]
    fn octaves_add_detail_and_stay_in_range() {
        let smooth = FractalNoise { kind: NoiseKind::Simplex, seed: 1, octaves: 1, lacunarity: 2.0, gain: 0.5 };
        let rough = FractalNoise { octaves: 6, ..smooth };
        let travel = |f: &FractalNoise| {
            let at = |i: i32| f.at(&[f64::from(i) * 0.01, 0.5]);
            (0..5_000).map(|i| (at(i + 1) - at(i)).abs()).sum::<f64>()
        };
        assert!(travel(&rough) > 1.15 * travel(&smooth), "{} {}", travel(&rough), travel(&smooth));
        assert!(points(3, 5_000).all(|p| rough.at(&p).abs() <= 1.0));
    }
}
