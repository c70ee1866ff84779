//! Gradient noise (Perlin, SIGGRAPH 2002) over a lattice that is hashed, not tabled: it repeats nowhere.

use glam::Vec3;

use crate::base::random::{combine, mix};

/// Noise with mean 0, about -1..1, that changes over distances of 1.
pub fn noise(p: Vec3) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let fade = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let [x, y, z] = cell.to_array().map(|c| c as i64);
    let mut sums = [0.0; 4];
    for (i, sum) in sums.iter_mut().enumerate() {
        let (dy, dz) = ((i & 1) as i64, (i >> 1) as i64);
        let row = combine(mix((z + dz) as u64), (y + dy) as u64);
        let offset = f - Vec3::new(0.0, dy as f32, dz as f32);
        let near = slope(combine(row, x as u64), offset);
        let far = slope(combine(row, (x + 1) as u64), offset - Vec3::X);
        *sum = near + (far - near) * fade.x;
    }
    let [a, b, c, d] = sums;
    let (low, high) = (a + (b - a) * fade.y, c + (d - c) * fade.y);
    low + (high - low) * fade.z
}

/// One of the twelve gradients towards the edges of a cube, times the offset.
fn slope(hash: u64, o: Vec3) -> f32 {
    let h = (hash >> 60) as u32;
    let u = if h < 8 { o.x } else { o.y };
    let v = match h {
        0..4 => o.y,
        12 | 14 => o.x,
        _ => o.z,
    };
    (if h & 1 == 0 { u } else { -u }) + (if h & 2 == 0 { v } else { -v })
}

/// Octaves of noise, each half as wide and half as strong as the one before, without what is finer than `width`.
pub fn octaves(p: Vec3, octaves: u32, width: f32) -> f32 {
    let (mut sum, mut frequency, mut weight) = (0.0, 1.0f32, 1.0f32);
    for octave in 0..octaves {
        let share = kept(width * frequency);
        if share <= 0.0 {
            break;
        }
        // Shifted, so that the zeros of the lattices do not meet.
        let at = p * frequency + Vec3::new(0.31, 0.57, 0.73) * octave as f32;
        sum += weight * share * noise(at);
        frequency *= 2.0;
        weight *= 0.5;
    }
    sum
}

/// What is left of noise that was averaged over so many cells of its lattice.
fn kept(cells: f32) -> f32 {
    let s = ((0.9 - cells) / (0.9 - 0.25)).clamp(0.0, 1.0);
    s * s * (3.0 - 2.0 * s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_mean_zero_and_no_jumps() {
        let (mut sum, mut square, n) = (0.0f64, 0.0f64, 20_000);
        for i in 0..n {
            let p = Vec3::new(i as f32 * 0.37, i as f32 * 0.11 - 900.0, i as f32 * 0.23);
            let x = noise(p);
            assert!(x.abs() <= 1.1, "{x}");
            assert!((noise(p + Vec3::splat(1e-3)) - x).abs() < 0.01);
            sum += f64::from(x);
            square += f64::from(x * x);
        }
        assert!((sum / n as f64).abs() < 0.01);
        assert!((0.03..0.2).contains(&(square / n as f64)), "{}", square / n as f64);
        // Continuous across the walls of a cell; far out it is still a number.
        for p in [Vec3::splat(3.0), Vec3::new(-2.0, 0.5, 7.0)] {
            assert!((noise(p - Vec3::splat(1e-6)) - noise(p + Vec3::splat(1e-6))).abs() < 1e-4);
        }
        assert!(noise(Vec3::splat(1e9)).is_finite() && noise(Vec3::splat(-3e18)).is_finite());
    }

    #[test]
    fn wide_footprints_leave_the_mean() {
        let p = Vec3::new(0.3, 0.8, 0.1);
        assert_eq!(octaves(p, 8, 1.0), 0.0);
        assert_ne!(octaves(p, 8, 0.1), octaves(p, 8, 0.0));
        assert!((octaves(p, 8, 0.001) - octaves(p, 8, 0.0)).abs() < 0.02);
    }
}
