//! Single operations of the kernel, timed by criterion: `cargo bench --bench kernels`.

use std::hint::black_box;
use std::sync::Arc;

use anim::components::{Accel, MeshData};
use anim::trace::accel::{Accelerator, HiddenPrimitives, TraversalScratch};
use anim::trace::primitive::{Geometry, PreparedRay, Tag, intersect_sphere, intersect_triangle};
use anim::trace::sampler::{Domain, RayNode, Sampler};
use anim::trace::simd::V3;
use anim::trace::soa::{Hits, Ray, Rays};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DAffine3, Vec3};

/// A bumpy ball of `2 side^2` triangles.
fn ball(side: u32) -> MeshData {
    let vertex = |i: u32, j: u32| {
        let (u, v) = (i as f32 / side as f32, j as f32 / side as f32);
        let (latitude, longitude) = ((u - 0.5) * std::f32::consts::PI, v * std::f32::consts::TAU);
        let radius = 1.0 + 0.05 * libm::sinf(20.0 * latitude) * libm::sinf(20.0 * longitude);
        let flat = libm::cosf(latitude);
        radius * Vec3::new(flat * libm::cosf(longitude), libm::sinf(latitude), flat * libm::sinf(longitude))
    };
    let vertices = (0..=side).flat_map(|i| (0..=side).map(move |j| vertex(i, j))).collect();
    let at = |i: u32, j: u32| i * (side + 1) + j;
    let quads = (0..side).flat_map(|i| (0..side).map(move |j| (i, j)));
    let triangles = quads
        .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]);
    MeshData::new(vertices, triangles.collect(), Vec::new())
}

fn scene() -> Geometry {
    let mut geometry = Geometry::default();
    geometry.push_mesh(Tag::default(), &Arc::new(ball(180)), false, &DAffine3::IDENTITY);
    geometry.finish();
    geometry
}

/// A picture's rays in squares of four by four pixels.
fn camera_rays(side: u32) -> Rays {
    let pixels = (0..side * side).map(|n| {
        let (square, within) = (n / 16, n % 16);
        (square % (side / 4) * 4 + within % 4, square / (side / 4) * 4 + within / 4)
    });
    let ray = |(x, y): (u32, u32)| {
        let at = |i: u32| (i as f32 + 0.5) / side as f32 - 0.5;
        Ray::new(Vec3::new(0.0, 0.0, 3.0), Vec3::new(at(x), at(y), -1.0).normalize())
    };
    pixels.map(ray).collect()
}

fn single_tests(c: &mut Criterion) {
    let probe = PreparedRay::new(Vec3::new(0.1, 0.2, 3.0), Vec3::new(0.05, -0.02, -1.0).normalize());
    let beam = probe.beam::<f32>();
    c.bench_function("sphere", |b| b.iter(|| intersect_sphere::<f32>(&beam, V3::splat(black_box(Vec3::ZERO)), 1.0)));
    let corners = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.1), Vec3::new(0.0, 1.0, -0.1)];
    let corners = corners.map(|p| V3::splat(probe.turned(p)));
    c.bench_function("triangle", |b| {
        b.iter(|| intersect_triangle::<f32>(&beam, black_box(corners)).map(|hits| (hits.t, hits.hit)));
    });
    let sampler = Sampler::new(1, 2, 4);
    c.bench_function("stratified point", |b| {
        b.iter(|| black_box(&sampler).stratified(RayNode::CAMERA, Domain::Light(0)));
    });
}

fn walks(c: &mut Criterion) {
    let geometry = scene();
    let rays = camera_rays(256);
    let mut group = c.benchmark_group("65 k rays to 65 k triangles");
    group.throughput(Throughput::Elements(rays.len() as u64)).sample_size(20);
    for choice in [Accel::Grid, Accel::Bvh] {
        let accelerator = Accelerator::build(&geometry, choice, 1.0);
        let mut scratch = TraversalScratch::default();
        group.bench_function(format!("{}, one by one", accelerator.name()), |b| {
            b.iter(|| rays.iter().filter(|ray| accelerator.closest(&geometry, ray, &mut scratch).is_some()).count());
        });
        let mut hits = Hits::default();
        group.bench_function(format!("{}, together", accelerator.name()), |b| {
            b.iter(|| {
                accelerator.closest_all(&geometry, &rays, &mut scratch, &mut hits);
                hits.found_count()
            });
        });
    }
}

fn builds(c: &mut Criterion) {
    let geometry = scene();
    let mut group = c.benchmark_group("build over 65 k triangles");
    group.throughput(Throughput::Elements(geometry.len() as u64)).sample_size(20);
    for choice in [Accel::Grid, Accel::Bvh] {
        group.bench_function(choice.name(), |b| b.iter(|| Accelerator::build(&geometry, choice, 1.0)));
    }
    group.bench_function("bvh for few rays", |b| {
        b.iter(|| Accelerator::rebuild(&geometry, Accel::Bvh, 1.0, 0.0, None, HiddenPrimitives::NONE));
    });
}

criterion_group!(kernels, single_tests, walks, builds);
criterion_main!(kernels);
