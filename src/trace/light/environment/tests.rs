use std::sync::Arc;

use glam::Vec3;

use super::*;
use crate::components::{MipMap, Texels};
use crate::trace::material::texture::RayCone;

fn speckled(width: u32, height: u32, key: u64) -> impl Fn(u32) -> [f32; 3] {
    move |i| {
        let hash = crate::base::random::mix(u64::from(i) + key);
        // Mostly dark, with a few bright texels: what importance sampling is for.
        let bright = if hash.is_multiple_of(50) { 40.0 } else { 0.1 };
        let _ = (width, height);
        [bright, 0.5 * bright, (hash >> 60) as f32 / 16.0]
    }
}

fn sphere(width: u32, height: u32) -> EnvironmentMap {
    let texel = speckled(width, height, 5);
    EnvironmentMap::Sphere(Arc::new(MipMap::new(
        width,
        height,
        Texels::Floats((0..width * height).map(texel).collect()),
    )))
}

fn cube() -> EnvironmentMap {
    let face = |k: usize| Face { width: 8, height: 8, texels: (0..64).map(speckled(8, 8, 77 + k as u64)).collect() };
    EnvironmentMap::Cube(Arc::new(CubeMap { faces: std::array::from_fn(face) }))
}

fn all() -> Vec<Environment> {
    let sky = EnvironmentMap::Sky([Vec3::new(0.1, 0.2, 0.9), Vec3::ONE, Vec3::splat(0.05)]);
    let black = EnvironmentMap::Sky([Vec3::ZERO; 3]);
    let mut all: Vec<Environment> = [sphere(24, 12), sphere(1, 1), cube(), sky, black]
        .into_iter()
        .map(|source| Environment::new(source, 2.0, 33.0))
        .collect();
    all.iter_mut().for_each(Environment::prepare);
    all
}

/// Directions evenly over the sphere, each standing for 4 pi / n.
fn even(n: usize) -> impl Iterator<Item = Vec3> {
    (0..n).map(move |i| {
        let y = 1.0 - (2.0 * i as f32 + 1.0) / n as f32;
        let r = (1.0 - y * y).sqrt();
        let (sin, cos) = libm::sincosf(2.399_963_2 * i as f32);
        Vec3::new(r * cos, y, r * sin)
    })
}

#[test]
fn densities_integrate_to_one() {
    for (which, environment) in all().iter().enumerate() {
        let n = 100_000;
        let sum: f64 = even(n).map(|d| f64::from(environment.pdf(d))).sum();
        let integral = sum * 4.0 * std::f64::consts::PI / n as f64;
        assert!((integral - 1.0).abs() < 0.01, "{which}: {integral}");
    }
}

#[test]
fn the_sampled_mean_is_the_integral() {
    for (which, environment) in all().iter().enumerate() {
        let n = 100_000;
        let sum = even(n).fold(glam::DVec3::ZERO, |sum, d| sum + environment.lookup(d).as_dvec3());
        let expected = sum * (4.0 * std::f64::consts::PI / n as f64);
        let (side, mut sum) = (160, glam::DVec3::ZERO);
        for i in 0..side * side {
            let at = |k: u32| (k as f32 + 0.5) / side as f32;
            let sample = environment.sample([at(i % side), at(i / side)]).unwrap();
            assert!(sample.pdf > 0.0 && (sample.direction.length() - 1.0).abs() < 1e-5);
            assert!(
                (sample.radiance - environment.lookup(sample.direction)).length()
                    < 1e-3 * (1.0 + sample.radiance.length())
            );
            sum += sample.radiance.as_dvec3() / f64::from(sample.pdf);
        }
        let found = sum / f64::from(side * side);
        assert!((found - expected).length() < 0.02 * expected.length() + 1e-9, "{which}: {found} {expected}");
    }
}

/// What a sample says of its density is what the density of its direction is.
#[test]
fn samples_and_densities_agree() {
    for (which, environment) in all().iter().enumerate() {
        let (mut wrong, n) = (0, 2_000u64);
        for i in 0..n {
            let random = |k| crate::base::random::unit_f32(crate::base::random::combine(k, i));
            let sample = environment.sample([random(1), random(2)]).unwrap();
            let pdf = environment.pdf(sample.direction);
            // On the border of two cells rounding may choose the other one.
            wrong += u64::from((pdf / sample.pdf - 1.0).abs() > 1e-3);
        }
        assert!(wrong * 200 < n, "{which}: {wrong} of {n}");
    }
    // The corners of the square are directions too.
    for environment in all() {
        for square in [[0.0, 0.0], [1.0 - f32::EPSILON, 0.0], [0.0, 1.0 - f32::EPSILON], [1.0 - f32::EPSILON; 2]] {
            assert!(environment.sample(square).unwrap().pdf > 0.0);
        }
    }
}

/// Wherever light comes from there is a density.
#[test]
fn nothing_bright_is_never_sampled() {
    let mut texels = vec![[0.0; 3]; 40 * 20];
    texels[40 * 7 + 11] = [1.0; 3];
    let source = EnvironmentMap::Sphere(Arc::new(MipMap::new(40, 20, Texels::Floats(texels))));
    let mut environment = Environment::new(source, 1.0, 0.0);
    environment.prepare();
    for d in even(20_000).filter(|d| environment.lookup(*d).x > 1e-4) {
        assert!(environment.pdf(d) > 0.0, "{d}");
    }
}

#[test]
fn pictures_of_the_sphere_lie_as_they_are_said_to() {
    // Red runs with u, green with v from the bottom.
    let texel = |i: u32| [((i % 64) as f32 + 0.5) / 64.0, 1.0 - ((i / 64) as f32 + 0.5) / 32.0, 0.0];
    let picture = Arc::new(MipMap::new(64, 32, Texels::Floats((0..64 * 32).map(texel).collect())));
    let look = |degrees, d: Vec3| Environment::new(EnvironmentMap::Sphere(picture.clone()), 1.0, degrees).lookup(d);
    assert!((look(0.0, Vec3::NEG_Z) - Vec3::new(0.5, 0.5, 0.0)).length() < 1e-5);
    assert!((look(0.0, Vec3::X) - Vec3::new(0.75, 0.5, 0.0)).length() < 1e-5);
    assert!(look(0.0, Vec3::Y).y > 0.98 && look(0.0, Vec3::NEG_Y).y < 0.02);
    // Turned counter-clockwise from above by a quarter, what was ahead (-z) is on the left (-x).
    assert!((look(90.0, Vec3::NEG_X) - Vec3::new(0.5, 0.5, 0.0)).length() < 1e-5);
    let wide = Environment::new(EnvironmentMap::Sphere(picture.clone()), 1.0, 0.0);
    let all = wide.lookup_wide(Vec3::NEG_Z, RayCone { width: 0.0, spread: 100.0 });
    assert!((all - Vec3::new(0.5, 0.5, 0.0)).length() < 1e-3, "{all}");
}
