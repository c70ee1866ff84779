use std::f32::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use super::*;
use crate::components::{Accel, LightSampler, Material, MeshData};
use crate::trace::accel::{Accelerator, TraversalScratch};
use crate::trace::material::ShadingParams;
use crate::trace::primitive::{Geometry, Sides, Tag};
use crate::trace::soa::Ray;

fn lamp(edges: [Vec3; 2], color: f32) -> Lamp {
    let normal = edges[0].cross(edges[1]).normalize_or_zero();
    let center = Vec3::new(0.0, 2.0, 0.0);
    Lamp {
        center,
        edges,
        normal,
        color: Vec3::splat(color),
        cone: LampCone::EVERYWHERE,
        distant: false,
        inverse_square: true,
        visible: false,
        reflected: true,
        linking: LightLinking::default(),
        group: 0,
    }
}

fn shining(radiance: f64) -> Vec<ShadingParams> {
    vec![ShadingParams::from(&Material { emission: DVec3::splat(radiance), ..Material::default() })]
}

/// Points of the unit square and a third number, n apart.
fn numbers(n: usize) -> impl Iterator<Item = (f32, [f32; 2])> {
    let at = move |i: usize| (i as f32 + 0.5) / n as f32;
    (0..n * n * n).map(move |i| (at(i / n / n), [at(i % n), at(i / n % n)]))
}

/// Irradiance of a surface at the origin that faces up.
fn irradiance(lights: &Lights) -> f32 {
    let n = 32;
    let of = |(pick, u)| lights.sample(Vec3::ZERO, pick, u).map_or(0.0, |l| l.contribution.x * l.direction.y.max(0.0));
    numbers(n).map(of).sum::<f32>() / (n * n * n) as f32
}

/// Irradiance of a rectangle of radiance 1 above its centre: four corners of a quadrant each (Siegel and Howell).
fn rectangle(half_width: f32, half_depth: f32, height: f32) -> f32 {
    let (a, b) = (half_width / height, half_depth / height);
    let (ra, rb) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    4.0 * 0.5 * (a / ra * libm::atanf(b / ra) + b / rb * libm::atanf(a / rb))
}

#[test]
fn lights_have_their_analytic_irradiance() {
    let quad = Lights::new(vec![lamp([Vec3::X, Vec3::Z * 2.0], 3.0)], &Geometry::default(), &[]);
    let expected = 3.0 * PI / 2.0 * rectangle(0.5, 1.0, 2.0);
    assert!((irradiance(&quad) / expected - 1.0).abs() < 1e-3, "{} {expected}", irradiance(&quad));
    let point = Lights::new(vec![lamp([Vec3::ZERO; 2], 3.0)], &Geometry::default(), &[]);
    assert!((irradiance(&point) / (3.0 * PI / 4.0) - 1.0).abs() < 1e-3);

    for (radius, height) in [(1.0, 3.0), (0.01, 3.0), (2.5, 3.0)] {
        let mut geometry = Geometry::default();
        geometry.push_sphere(Tag::default(), Vec3::Y * height, radius);
        geometry.finish();
        let expected = 5.0 * PI * (radius / height) * (radius / height);
        let found = irradiance(&Lights::new(Vec::new(), &geometry, &shining(5.0)));
        assert!((found / expected - 1.0).abs() < 1e-3, "{radius}: {found} {expected}");
    }

    // The rectangle again, as triangles, and as the under side of a flat box.
    let corners =
        [Vec3::new(-1.0, 2.0, -1.0), Vec3::new(1.0, 2.0, -1.0), Vec3::new(1.0, 2.0, 1.0), Vec3::new(-1.0, 2.0, 1.0)];
    let mut geometry = Geometry::default();
    geometry.push_triangle(Tag::default(), [corners[0], corners[1], corners[2]], None);
    geometry.push_triangle(Tag::default(), [corners[0], corners[2], corners[3]], None);
    geometry.finish();
    let found = irradiance(&Lights::new(Vec::new(), &geometry, &shining(1.0)));
    assert!((found / rectangle(1.0, 1.0, 2.0) - 1.0).abs() < 2e-3, "{found}");
}

/// What a sample says of its density is what a ray that meets the same point is told; on every kind that is sampled.
#[test]
fn rays_that_meet_a_light_know_its_density() {
    let mesh = Arc::new(MeshData::new(
        vec![Vec3::new(-1.0, 3.0, 0.0), Vec3::new(1.0, 3.5, 0.0), Vec3::new(0.0, 4.0, 1.0), Vec3::new(3.0, 4.0, 1.0)],
        vec![[0, 2, 1], [1, 2, 3]],
        Vec::new(),
    ));
    let tag = Tag { sides: Sides::Both, ..Tag::default() };
    let mut geometry = Geometry::default();
    geometry.push_sphere(tag, Vec3::new(5.0, 3.0, 0.0), 0.7);
    geometry.push_triangle(
        tag,
        [Vec3::new(-5.0, 2.0, 0.0), Vec3::new(-4.0, 2.0, 0.0), Vec3::new(-4.0, 3.0, 1.0)],
        None,
    );
    geometry.push_box(tag, Vec3::new(-1.0, 1.0, -6.0), Vec3::new(1.0, 2.0, -5.0));
    geometry.push_mesh(tag, &mesh, false, &DAffine3::IDENTITY);
    for z in [5.0, 8.0] {
        let map =
            DAffine3::from_scale_rotation_translation(DVec3::new(1.0, 2.0, -1.0), glam::DQuat::IDENTITY, DVec3::Z * z);
        geometry.push_instance(tag, &mesh, false, &map);
    }
    geometry.finish();
    let lights = Lights::new(vec![lamp([Vec3::X, Vec3::Z], 2.0)], &geometry, &shining(1.0));
    assert_eq!(lights.len(), 1 + 3 + 2 + 4);
    let accelerator = Accelerator::build(&geometry, Accel::Brute, 1.0);
    let (mut scratch, mut met) = (TraversalScratch::default(), [0; 10]);
    // Small lights are chosen seldom: many choices, few points.
    let choices = (0..84).flat_map(|i| numbers(4).map(move |(_, u)| ((i as f32 + 0.5) / 84.0, u)));
    for (pick, u) in choices {
        let Some(light) = lights.sample(Vec3::ZERO, pick, u) else { continue };
        if light.light == 0 {
            let mut found = 0.0;
            lights.crossed(&Ray::new(Vec3::ZERO, light.direction), false, None, |_, _, pdf, _| found = pdf);
            assert!((found / light.pdf - 1.0).abs() < 1e-3, "{found} {}", light.pdf);
            met[0] += 1;
            continue;
        }
        let ray = Ray::new(Vec3::ZERO, light.direction);
        let Some(hit) = accelerator.closest(&geometry, &ray, &mut scratch) else { continue };
        // Far sides are met by none.
        if (hit.t - light.distance).abs() > 1e-3 * hit.t {
            continue;
        }
        let found = lights.pdf(&ray, &hit, &geometry.surface_point(&ray, &hit));
        if light.light != 3 && hit.t > 0.0 {
            assert!((found / light.pdf - 1.0).abs() < 0.02, "{}: {found} {}", light.light, light.pdf);
        }
        met[light.light as usize] += 1;
    }
    assert!(met.iter().all(|n| *n > 0), "{met:?}");
}

#[test]
fn photons_carry_the_power_of_all_lights() {
    let mut geometry = Geometry::default();
    geometry.push_sphere(Tag::default(), Vec3::new(5.0, 3.0, 0.0), 0.5);
    geometry.finish();
    let constant = Lamp { inverse_square: false, ..lamp([Vec3::ZERO; 2], 100.0) };
    let lamps = vec![lamp([Vec3::X, Vec3::Z * 2.0], 3.0), lamp([Vec3::ZERO; 2], 2.0), constant];
    let lights = Lights::new(lamps, &geometry, &shining(4.0));
    // Both sides of the lamp, the point, the sphere; the one that does not fall off sends nothing.
    let expected = 2.0 * PI * PI * 3.0 + 4.0 * PI * PI * 2.0 + PI * 4.0 * (4.0 * PI * 0.25);
    assert!((lights.power() / (3.0 * f64::from(expected)) - 1.0).abs() < 1e-5);
    let (n, mut sum, mut up) = (20, 0.0, 0.0);
    for (pick, u) in numbers(n) {
        let photon = lights.emit(pick, [u[1], u[0]], u).unwrap();
        sum += photon.power.x;
        up += photon.power.x * photon.ray.direction.y;
        assert!((photon.ray.direction.length() - 1.0).abs() < 1e-5);
    }
    let count = (n * n * n) as f32;
    assert!((sum / count / expected - 1.0).abs() < 0.01, "{} {expected}", sum / count);
    assert!((up / count / expected).abs() < 0.05, "{up}");
}

#[test]
fn lights_without_area_or_power_do_no_harm() {
    let line = lamp([Vec3::X, Vec3::ZERO], 1.0);
    let dark = lamp([Vec3::X, Vec3::Z], 0.0);
    let lights = Lights::new(vec![dark, line], &Geometry::default(), &[]);
    for (pick, u) in numbers(4) {
        let light = lights.sample(Vec3::ZERO, pick, u).unwrap();
        assert!(light.light == 1 && light.contribution.is_finite() && light.pdf == 0.0);
        assert!(lights.sample(lights.lamps()[1].point(u), pick, u).is_none());
    }
    let none = Lights::new(vec![dark], &Geometry::default(), &[]);
    assert!(none.sample(Vec3::ZERO, 0.5, [0.5; 2]).is_none() && none.emit(0.5, [0.5; 2], [0.5; 2]).is_none());
    assert!(Lights::default().sample(Vec3::ZERO, 0.5, [0.5; 2]).is_none());
    // A triangle of no area is no light.
    let mut geometry = Geometry::default();
    geometry.push_triangle(Tag::default(), [Vec3::ZERO, Vec3::X, Vec3::X * 2.0], None);
    geometry.finish();
    assert!(Lights::new(Vec::new(), &geometry, &shining(1.0)).is_empty());
}

/// However one of many lights is chosen, their light is the sum of all.
#[test]
fn many_lights_bring_what_they_bring_one_by_one() {
    let all: Vec<Lamp> = (0..40)
        .map(|i| {
            let (x, z) = ((i % 8) as f32 * 0.7 - 2.5, (i / 8) as f32 * 0.9 - 2.0);
            let edges = if i % 2 == 0 { [Vec3::ZERO; 2] } else { [Vec3::X * 0.2, Vec3::Z * 0.3] };
            Lamp {
                center: Vec3::new(x, 1.0 + 0.1 * i as f32, z),
                inverse_square: i % 7 != 3,
                ..lamp(edges, 0.1 * i as f32)
            }
        })
        .collect();
    let one = |lamp: &Lamp| irradiance(&Lights::new(vec![*lamp], &Geometry::default(), &[]));
    let expected: f32 = all.iter().map(one).sum();
    for sampler in [LightSampler::Power, LightSampler::Bvh] {
        let lights = Lights::new(all.clone(), &Geometry::default(), &[]).chosen_by(sampler);
        let n = 400_000;
        let mut sum = 0.0;
        for i in 0..n {
            let number = |k: u64| crate::base::random::unit_f32(crate::base::random::hash_words([i, k]));
            let light = lights.sample(Vec3::ZERO, number(0), [number(1), number(2)]);
            sum += light.map_or(0.0, |l| f64::from(l.contribution.x * l.direction.y.max(0.0)));
        }
        let found = (sum / n as f64) as f32;
        assert!((found / expected - 1.0).abs() < 0.01, "{sampler:?}: {found} {expected}");
    }
}
