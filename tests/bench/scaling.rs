//! How cost grows: with the size of the scene (as a logarithm), with pixels, samples and threads (in proportion).
//!
//! `cargo bench --bench scaling` prints a table; `-- --largest 1000000` stops at a million primitives.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anim::components::{Camera, EntityDesc, Integrator, Material, Mesh, MeshData, PointLight, Render, Scene};
use anim::systems;
use clap::Parser;
use glam::{DVec3, Vec3};

#[derive(Parser)]
struct Args {
    /// Most triangles of a scene.
    #[arg(long, default_value_t = 10_000_000)]
    largest: usize,
    /// What `cargo bench` adds.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Hills of about as many triangles.
fn hills(triangles: usize) -> MeshData {
    let side = ((triangles / 2).isqrt() as u32).max(1);
    let vertex = |i: u32, j: u32| {
        let at = |i: u32| (i as f32 / side as f32 - 0.5) * 8.0;
        let (x, z) = (at(i), at(j));
        let height = 0.4 * libm::sinf(2.1 * x) * libm::cosf(1.7 * z) + 0.03 * libm::sinf(31.0 * x + 17.0 * z);
        Vec3::new(x, height, z)
    };
    let vertices = (0..=side).flat_map(|i| (0..=side).map(move |j| vertex(i, j))).collect();
    let at = |i: u32, j: u32| i * (side + 1) + j;
    let quads = (0..side).flat_map(|i| (0..side).map(move |j| (i, j)));
    let triangles = quads
        .flat_map(|(i, j)| [[at(i, j), at(i, j + 1), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i + 1, j)]]);
    MeshData::new(vertices, triangles.collect(), Vec::new())
}

fn scene(triangles: usize, size: [u32; 2], samples: u32) -> Scene {
    let mut ground = EntityDesc::default();
    ground.put(Mesh { data: Arc::new(hills(triangles)), ..Mesh::default() }.into());
    let mut lamp = EntityDesc::default();
    lamp.put(PointLight { position: DVec3::new(4.0, 6.0, 3.0), ..PointLight::default() }.into());
    Scene {
        camera: Camera { from: DVec3::new(0.0, 2.5, 6.0), ..Camera::default() },
        render: Render { size, samples, integrator: Integrator::Distribution, ..Render::default() },
        materials: vec![("plain".into(), Material::default())],
        entities: vec![ground, lamp],
        ..Scene::default()
    }
}

/// Seconds of building and of rendering, and primary rays per second.
fn frame(scene: &Scene, threads: usize) -> (f64, f64, f64) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
    pool.install(|| {
        let mut stage = systems::spawn(scene.clone()).expect("a sound scene");
        let rendered = systems::render(&mut stage, &AtomicBool::new(false), &|_, _| ());
        let (_, stats) = rendered.expect("a picture").expect("not cancelled");
        (stats.build_seconds, stats.render_seconds, stats.counters.primary_rays as f64 / stats.render_seconds)
    })
}

fn row(what: &str, scene: &Scene, threads: usize) {
    let (build, render, rate) = frame(scene, threads);
    println!("| {what:<28} | {build:>9.3} | {render:>9.3} | {:>9.2} |", rate / 1e6);
}

fn main() {
    let args = Args::parse();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    println!("| {:<28} | {:>9} | {:>9} | {:>9} |", "", "build s", "render s", "Mrays/s");
    println!("|{:-<30}|{:->11}|{:->11}|{:->11}|", "", "", "", "");
    let mut triangles = 1_000;
    while triangles <= args.largest {
        row(&format!("{triangles} triangles"), &scene(triangles, [640, 480], 4), threads);
        triangles *= 10;
    }
    for size in [[160, 120], [320, 240], [640, 480], [1280, 960]] {
        row(&format!("{} x {} pixels", size[0], size[1]), &scene(100_000, size, 4), threads);
    }
    for samples in [1, 4, 16, 64] {
        row(&format!("{samples} samples"), &scene(100_000, [320, 240], samples), threads);
    }
    for count in 1..=threads {
        row(&format!("{count} threads"), &scene(100_000, [640, 480], 16), count);
    }
}
