use super::*;
use crate::base::random::combine;
use crate::trace::sampler::{Domain, RayNode, Sampler};

#[test]
fn the_second_coordinate_is_that_of_sobol() {
    let mut columns = [0u32; 32];
    columns[0] = 1 << 31;
    for j in 1..32 {
        columns[j] = columns[j - 1] ^ (columns[j - 1] >> 1);
    }
    for n in [0u32, 1, 2, 3, 77, 1 << 20, 0xdead_beef, u32::MAX] {
        let expected = (0..32).filter(|bit| n >> bit & 1 == 1).fold(0, |sum, bit| sum ^ columns[bit as usize]);
        assert_eq!(second(n), expected, "{n}");
    }
}

#[test]
fn the_permutation_of_digits_is_one() {
    for key in [0, 1, 0x1234_5678] {
        let mut seen = vec![false; 1024];
        (0..1024).for_each(|n| seen[permuted(n, 5, key) as usize] = true);
        assert!(seen.iter().all(|s| *s));
    }
    assert!([0, 1, 2, 2, 2, 3].into_iter().eq([1, 4, 5, 9, 16, 17].map(digits)));
}

/// Whether points fill every elementary interval of their number once: rows and columns, and all shapes between.
fn is_net(points: &[[f32; 2]]) -> bool {
    let bits = points.len().ilog2();
    (0..=bits).all(|across| {
        let (nx, ny) = (1u32 << across, 1u32 << (bits - across));
        let mut seen = vec![false; points.len()];
        points.iter().for_each(|[x, y]| {
            seen[((x * nx as f32) as u32 + (y * ny as f32) as u32 * nx) as usize] = true;
        });
        seen.iter().all(|s| *s)
    })
}

#[test]
fn samples_of_a_pixel_and_of_its_neighbours_fill_all_elementary_intervals() {
    for samples in [1, 4, 16, 64] {
        for side in [1, 2, 4] {
            let mut points = Vec::new();
            for pixel in 0..side * side {
                // A square of pixels that the curve runs through in one go.
                let mut sampler = Sampler::sobol(7, [40 + pixel % side, 20 + pixel / side], samples);
                for sample in 0..samples {
                    sampler.sample = sample;
                    points.push(sampler.stratified(RayNode::CAMERA.scattered(), Domain::Bounce));
                }
            }
            assert!(is_net(&points), "{samples} samples, {side} x {side} pixels");
        }
    }
}

#[test]
fn dimensions_are_uniform_and_uncorrelated() {
    let node = |k: u32| (0..k).fold(RayNode::CAMERA, |node, _| node.scattered());
    let number = |sampler: &Sampler, dimension: u32| match dimension % 4 {
        0 => sampler.stratified(node(dimension / 4), Domain::Bounce)[0],
        1 => sampler.stratified(node(dimension / 4), Domain::Bounce)[1],
        2 => sampler.stratified(node(dimension / 4), Domain::Light(0))[0],
        _ => sampler.extra(node(dimension / 4), Domain::Light(0)),
    };
    const DIMENSIONS: usize = 12;
    let (mut sums, mut products, mut n) = ([0.0f64; DIMENSIONS], [[0.0f64; DIMENSIONS]; DIMENSIONS], 0.0);
    for pixel in 0..256 {
        // Far apart: no two in a block.
        let mut sampler = Sampler::sobol(3, [pixel % 16 * 64, pixel / 16 * 64], 16);
        for sample in 0..16 {
            sampler.sample = sample;
            let values: [f64; DIMENSIONS] = std::array::from_fn(|d| f64::from(number(&sampler, d as u32)) - 0.5);
            for i in 0..DIMENSIONS {
                sums[i] += values[i];
                (0..i).for_each(|j| products[i][j] += values[i] * values[j]);
            }
            n += 1.0;
        }
    }
    for i in 0..DIMENSIONS {
        assert!((sums[i] / n).abs() < 0.01, "{i}: {}", sums[i] / n);
        for (j, product) in products[i][..i].iter().enumerate() {
            // In parts of the variance of 1/12; three sigma of independent ones is 0.05.
            let correlation = product / n * 12.0;
            assert!(correlation.abs() < 0.06, "{i} {j}: {correlation}");
        }
    }
}

/// Mean error of pixels, and of means of 4 x 4 pixels, for a smooth integrand of two pairs.
fn errors(mut value: impl FnMut([u32; 2], u32) -> [[f32; 2]; 2], samples: u32) -> (f64, f64) {
    const SIDE: usize = 32;
    let mut error = vec![0.0f64; SIDE * SIDE];
    for (i, error) in error.iter_mut().enumerate() {
        for sample in 0..samples {
            let [[a, b], [c, d]] = value([(i % SIDE) as u32, (i / SIDE) as u32], sample).map(|p| p.map(f64::from));
            *error += (a * b + c * c * d) / f64::from(samples);
        }
        *error -= 1.0 / 4.0 + 1.0 / 6.0;
    }
    let mean_square = |values: &[f64]| values.iter().map(|e| e * e).sum::<f64>() / values.len() as f64;
    let blurred: Vec<f64> = (0..SIDE * SIDE / 16)
        .map(|i| {
            let corner = i / (SIDE / 4) * 4 * SIDE + i % (SIDE / 4) * 4;
            (0..16).map(|k| error[corner + k / 4 * SIDE + k % 4]).sum::<f64>() / 16.0
        })
        .collect();
    (mean_square(&error), mean_square(&blurred))
}

fn both(sampler: Sampler, sample: u32) -> [[f32; 2]; 2] {
    let sampler = Sampler { sample, ..sampler };
    let node = RayNode::CAMERA.scattered();
    [sampler.stratified(node, Domain::Bounce), sampler.stratified(node, Domain::Light(0))]
}

#[test]
fn errors_are_smaller_than_with_strata_and_blue() {
    let (sobol, blurred) = errors(|place, sample| both(Sampler::sobol(11, place, 16), sample), 16);
    let (strata, white) = errors(|[x, y], sample| both(Sampler::new(11, y * 32 + x, 4), sample), 16);
    assert!(sobol < 0.8 * strata, "{sobol} {strata}");
    // White noise falls by the 16 pixels of the mean; what is left here is far less.
    assert!((0.5..2.0).contains(&(white * 16.0 / strata)), "{white} {strata}");
    assert!(blurred * 16.0 < 0.5 * sobol, "{blurred} {sobol}");
}

#[test]
fn samples_past_the_number_asked_for_are_new() {
    let mut sampler = Sampler::sobol(1, [5, 6], 16);
    let first = sampler.stratified(RayNode::CAMERA, Domain::Lens);
    sampler.sample = 16;
    assert_ne!(sampler.stratified(RayNode::CAMERA, Domain::Lens), first);
    assert_ne!(combine(1, 2), combine(2, 1));
}
