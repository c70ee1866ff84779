//! References in the order of a curve that fills space (Morton 1966), on all threads.

use glam::Vec4;
use rayon::prelude::*;

use super::prim_ref::{Extent, FORK, PrimRef};

/// Cells of one axis, in bits.
const SIDE_BITS: u32 = 10;

/// Numbers take the lowest bits of a key, then comes the place on the curve, then the kind.
const NUMBER_BITS: u32 = 30;

const NUMBER: u64 = (1 << NUMBER_BITS) - 1;

const PLACE: u64 = ((1 << (3 * SIDE_BITS)) - 1) << NUMBER_BITS;

/// Bits of a key that one pass sorts by.
const DIGIT_BITS: u32 = 11;

const DIGITS: usize = 1 << DIGIT_BITS;

/// Parts that one pass is shared out in.
const PARTS: usize = 8;

/// More in one cell of the curve get a curve of their own.
const CROWD: usize = 32;

/// Numbers of the references, which are numbered through: kind by kind, along a curve within each. `centroids` are
/// the bounds of their centroids.
pub fn order(refs: &[PrimRef], centroids: Extent) -> Vec<u32> {
    let key = |(n, r): (usize, &PrimRef)| u64::from(r.held()) << (NUMBER_BITS + 3 * SIDE_BITS) | n as u64;
    let mut keys: Vec<u64> = refs.par_iter().with_min_len(4096).enumerate().map(key).collect();
    arrange(&mut keys, refs, centroids);
    keys.into_par_iter().with_min_len(4096).map(|key| (key & NUMBER) as u32).collect()
}

/// Sorts keys of one kind or of many by kind, place and number.
fn arrange(keys: &mut [u64], refs: &[PrimRef], centroids: Extent) {
    let size = centroids.high - centroids.low;
    let end = (1 << SIDE_BITS) as f32 - 0.01;
    let scale = size.map(|s| if s > 0.0 && (end / s).is_finite() { end / s } else { 0.0 });
    if scale.truncate() == glam::Vec3::ZERO {
        return keys.sort_unstable();
    }
    keys.par_iter_mut().with_min_len(4096).for_each(|key| {
        let at = (refs[(*key & NUMBER) as usize].doubled_centroid() - centroids.low) * scale;
        let place = spread(at.x as u32) << 2 | spread(at.y as u32) << 1 | spread(at.z as u32);
        *key = *key & !PLACE | u64::from(place) << NUMBER_BITS;
    });
    sort(keys);
    let mut crowds = Vec::new();
    let mut rest = keys;
    while let Some(crowd) = next_crowd(&mut rest) {
        crowds.push(crowd);
    }
    crowds.into_par_iter().for_each(|crowd| {
        let parts = crowd.par_chunks(FORK).map(|keys| centroids_of(keys, refs));
        let centroids = parts.reduce(|| Extent::EMPTY, Extent::union);
        arrange(crowd, refs, centroids);
    });
}

fn centroids_of(keys: &[u64], refs: &[PrimRef]) -> Extent {
    let mut centroids = Extent::EMPTY;
    for key in keys {
        let middle: Vec4 = refs[(key & NUMBER) as usize].doubled_centroid();
        centroids.add(middle, middle);
    }
    centroids
}

/// The next run of more than [`CROWD`] to [`CROWD`] times two of sorted keys that share a kind and a cell.
fn next_crowd<'a>(rest: &mut &'a mut [u64]) -> Option<&'a mut [u64]> {
    let cell = |key: u64| key >> NUMBER_BITS;
    let within = (0..rest.len().saturating_sub(CROWD)).step_by(CROWD).find(|i| {
        let i = *i;
        cell(rest[i]) == cell(rest[i + CROWD])
    });
    let keys = std::mem::take(rest);
    let shared = cell(keys[within?]);
    let start = keys.partition_point(|key| cell(*key) < shared);
    let end = keys.partition_point(|key| cell(*key) <= shared);
    let (before, after) = keys.split_at_mut(end);
    *rest = after;
    Some(&mut before[start..])
}

/// The lowest ten bits, two zeros before each.
fn spread(x: u32) -> u32 {
    let x = (x | x << 16) & 0x0300_00FF;
    let x = (x | x << 8) & 0x0300_F00F;
    let x = (x | x << 4) & 0x030C_30C3;
    (x | x << 2) & 0x0924_9249
}

/// Sorts by all but the numbers, by which keys are sorted already where many are: digit by digit, the lowest first.
fn sort(keys: &mut [u64]) {
    if keys.len() <= FORK {
        return keys.sort_unstable();
    }
    let mut other = vec![0; keys.len()];
    let (mut from, mut to) = (&mut *keys, &mut other[..]);
    let mut swapped = false;
    for pass in 0..3 {
        if pass_over(from, to, NUMBER_BITS + pass * DIGIT_BITS) {
            (from, to) = (to, from);
            swapped = !swapped;
        }
    }
    if swapped {
        // What was `from` at last is the other.
        to.copy_from_slice(from);
    }
}

/// Moves keys to where their digit puts them, in the order in which they are; false if all have the same digit.
fn pass_over(from: &[u64], to: &mut [u64], shift: u32) -> bool {
    let digit = |key: u64| (key >> shift) as usize & (DIGITS - 1);
    let part = from.len().div_ceil(PARTS);
    let count = |keys: &[u64]| {
        let mut counts = vec![0u32; DIGITS];
        keys.iter().for_each(|key| counts[digit(*key)] += 1);
        counts
    };
    let counts: Vec<Vec<u32>> = from.par_chunks(part).map(count).collect();
    let first = digit(from[0]);
    if counts.iter().map(|counts| counts[first] as usize).sum::<usize>() == from.len() {
        return false;
    }
    // By part, where each digit's keys go.
    let mut places: Vec<Vec<std::slice::IterMut<u64>>> = counts.iter().map(|_| Vec::with_capacity(DIGITS)).collect();
    let mut rest = to;
    for digit in 0..DIGITS {
        for (places, counts) in places.iter_mut().zip(&counts) {
            let (place, after) = rest.split_at_mut(counts[digit] as usize);
            places.push(place.iter_mut());
            rest = after;
        }
    }
    from.par_chunks(part).zip(places).for_each(|(keys, mut places)| {
        for key in keys {
            // There is room for exactly as many as were counted.
            if let Some(place) = places[digit(*key)].next() {
                *place = *key;
            }
        }
    });
    true
}
