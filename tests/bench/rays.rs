//! Rays from raw files against primitives from raw files: hits, rays per second, build time and memory.
//!
//! `cargo bench --bench rays -- --triangles F --spheres F --rays F --query closest|any --accel grid|bvh|auto --threads N`
//!
//! `--build fast` builds trees as they are built for few rays. All files are little-endian: triangles `u32 n, n x 9 f32`; spheres `u32 n, n x (x y z r) f32`; rays `u32 n,
//! n x (ox oy oz tmin dx dy dz tmax) f32`. What follows is ignored.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anim::components::{Accel, MeshData};
use anim::trace::accel::{Accelerator, HiddenPrimitives, TraversalScratch};
use anim::trace::primitive::{Geometry, Tag};
use anim::trace::soa::{Hits, Ray, Rays};
use clap::{Parser, ValueEnum};
use glam::{DAffine3, Vec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Query {
    Closest,
    Any,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Build {
    /// As for endless rays.
    Full,
    /// As for no rays.
    Fast,
}

/// Traces rays from a file against primitives from files.
#[derive(Parser)]
struct Args {
    /// Triangle corners: u32 n, n x 9 f32.
    #[arg(long)]
    triangles: Option<PathBuf>,
    /// Spheres: u32 n, n x (x y z r) f32.
    #[arg(long)]
    spheres: Option<PathBuf>,
    /// Rays: u32 n, n x (ox oy oz tmin dx dy dz tmax) f32.
    #[arg(long)]
    rays: PathBuf,
    #[arg(long, value_enum, default_value = "closest")]
    query: Query,
    #[arg(long, default_value = "auto", value_parser = |s: &str| Accel::parse(s).ok_or("grid, bvh, brute or auto"))]
    accel: Accel,
    /// How a tree is built.
    #[arg(long, value_enum, default_value = "full")]
    build: Build,
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Timed runs; the median counts.
    #[arg(long, default_value_t = 5)]
    runs: usize,
    /// Cells of the grid per primitive.
    #[arg(long, default_value_t = 1.0)]
    density: f64,
    /// Hands over each ray alone instead of all together.
    #[arg(long)]
    single: bool,
    /// What `cargo bench` adds.
    #[arg(long, hide = true)]
    bench: bool,
}

/// The numbers after the count of a raw file.
fn read(path: &Path, per_item: usize) -> Vec<f32> {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut words = bytes.chunks_exact(4).map(|b| [b[0], b[1], b[2], b[3]]);
    let count = u32::from_le_bytes(words.next().expect("a count")) as usize;
    let numbers: Vec<f32> = words.take(count * per_item).map(f32::from_le_bytes).collect();
    assert_eq!(numbers.len(), count * per_item, "{} is cut short", path.display());
    numbers
}

/// A soup of corners as a mesh: equal corners become one vertex.
fn weld(numbers: &[f32]) -> MeshData {
    let (mut vertices, mut known) = (Vec::new(), FxHashMap::default());
    let mut corner = |p: &[f32]| -> u32 {
        *known.entry([p[0].to_bits(), p[1].to_bits(), p[2].to_bits()]).or_insert_with(|| {
            vertices.push(Vec3::from_slice(p));
            vertices.len() as u32 - 1
        })
    };
    let triangles = numbers.chunks_exact(9).map(|t| [corner(&t[..3]), corner(&t[3..6]), corner(&t[6..])]).collect();
    vertices.shrink_to_fit();
    MeshData::new(vertices, triangles, Vec::new())
}

fn scene(args: &Args) -> (Geometry, usize) {
    let mut geometry = Geometry::default();
    let mut bytes = 0;
    if let Some(path) = &args.spheres {
        for s in read(path, 4).chunks_exact(4) {
            geometry.push_sphere(Tag::default(), Vec3::from_slice(s), s[3]);
        }
        bytes += geometry.len() * (size_of::<[f32; 4]>() + size_of::<Tag>());
    }
    if let Some(path) = &args.triangles {
        let mesh = Arc::new(weld(&read(path, 9)));
        bytes += size_of_val(&mesh.vertices[..]) + size_of_val(&mesh.triangles[..]);
        geometry.push_mesh(Tag::default(), &mesh, false, &DAffine3::IDENTITY);
    }
    geometry.finish();
    (geometry, bytes)
}

/// Rays that are traced together.
const TOGETHER: usize = 4096;

fn rays(path: &Path) -> Vec<Rays> {
    let ray = |r: &[f32]| {
        let (direction, t_min) = (Vec3::new(r[4], r[5], r[6]), r[3]);
        Ray { origin: Vec3::from_slice(r) + direction * t_min, direction, t_max: r[7] - t_min }
    };
    read(path, 8).chunks(8 * TOGETHER).map(|rows| rows.chunks_exact(8).map(ray).collect()).collect()
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn main() {
    let args = Args::parse();
    rayon::ThreadPoolBuilder::new().num_threads(args.threads).build_global().expect("one thread pool");
    let (geometry, scene_bytes) = scene(&args);
    let expected = if args.build == Build::Full { f64::INFINITY } else { 0.0 };
    let build = || Accelerator::rebuild(&geometry, args.accel, args.density, expected, None, HiddenPrimitives::NONE);
    let builds = (0..args.runs.min(3)).map(|_| {
        let start = Instant::now();
        std::hint::black_box(build());
        start.elapsed().as_secs_f64()
    });
    let build_seconds = median(builds.collect());
    let accelerator = build();
    let rays = rays(&args.rays);
    let run = |rays: &Rays| -> (usize, u64, u64) {
        let mut scratch = TraversalScratch::default();
        let mut hits = 0;
        match (args.query, args.single) {
            (Query::Closest, false) => {
                let mut found = Hits::default();
                accelerator.closest_all(&geometry, rays, &mut scratch, &mut found);
                hits += found.found_count() as usize;
            }
            (Query::Any, false) => {
                let mut blocked = Vec::new();
                accelerator.occluded_all(&geometry, rays, &mut scratch, &mut blocked);
                hits += blocked.iter().filter(|blocked| **blocked).count();
            }
            (Query::Closest, true) => rays.iter().for_each(|ray| {
                hits += usize::from(accelerator.closest(&geometry, &ray, &mut scratch).is_some());
            }),
            (Query::Any, true) => rays.iter().for_each(|ray| {
                hits += usize::from(accelerator.occluded(&geometry, &ray, &mut scratch));
            }),
        }
        (hits, scratch.counters.steps, scratch.counters.intersection_tests)
    };
    let once = || -> (usize, u64, u64) {
        let sum = |a: (usize, u64, u64), b: (usize, u64, u64)| (a.0 + b.0, a.1 + b.1, a.2 + b.2);
        if args.threads == 1 {
            return rays.iter().map(run).fold((0, 0, 0), sum);
        }
        rays.par_iter().map(run).reduce(|| (0, 0, 0), sum)
    };
    let (hits, steps, tests) = once();
    let times = (0..args.runs).map(|_| {
        let start = Instant::now();
        std::hint::black_box(once());
        start.elapsed().as_secs_f64()
    });
    let seconds = median(times.collect());
    let count: usize = rays.iter().map(Rays::len).sum();
    let (rays, primitives) = (count as f64, geometry.len() as f64);
    println!(
        "accel={} query={} threads={} primitives={} rays={} hits={hits} Mrays/s={:.2} build_seconds={build_seconds:.4} \
         Mprimitives/s={:.2} bytes_per_primitive={:.1} steps/ray={:.2} tests/ray={:.2}",
        accelerator.name(),
        if args.query == Query::Closest { "closest" } else { "any" },
        args.threads,
        geometry.len(),
        count,
        rays / seconds / 1e6,
        primitives / build_seconds / 1e6,
        (scene_bytes + accelerator.bytes()) as f64 / primitives,
        steps as f64 / rays,
        tests as f64 / rays,
    );
}
