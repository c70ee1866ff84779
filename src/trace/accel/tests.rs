//! Grid and tree against their oracle: the same hits to the bit, whatever stands where.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3};
use proptest::prelude::*;

use super::*;
use crate::components::{Accel, MeshData};
use crate::trace::accel::bvh::Bvh;
use crate::trace::accel::grid::Grid;
use crate::trace::primitive::{Geometry, LocalShape, Sides, SpherePrim, Tag};
use crate::trace::simd::Width;
use crate::trace::soa::{Hits, Ray, Rays};

/// Coordinates that often coincide: lattice points as well as arbitrary ones.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![3 => -4.0f32..4.0, 1 => (-4i32..=4).prop_map(|i| i as f32), 1 => Just(0.0)]
}

fn point() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(coordinate()).prop_map(Vec3::from_array)
}

#[derive(Clone, Debug)]
struct Piece(u8, Vec3, Vec3, Vec3, f32);

fn piece() -> impl Strategy<Value = Piece> {
    (0u8..10, point(), point(), point(), 0.01f32..1.5).prop_map(|(k, a, b, c, r)| Piece(k, a, b, c, r))
}

/// A strip of triangles that folds back and touches itself.
fn mesh() -> Arc<MeshData> {
    let vertices: Vec<Vec3> =
        (0..22).map(|i| Vec3::new((i / 2 % 7) as f32 * 0.2, (i % 2) as f32 * 0.3, (i / 2 % 3) as f32 * 0.1)).collect();
    let triangles = (0..20).map(|i| if i % 2 == 0 { [i, i + 1, i + 2] } else { [i + 1, i, i + 2] }).collect();
    Arc::new(MeshData::new(vertices, triangles, Vec::new()))
}

fn build(pieces: &[Piece]) -> Geometry {
    let mut geometry = Geometry::default();
    let shared = mesh();
    for (i, Piece(kind, a, b, c, r)) in pieces.iter().enumerate() {
        let sides = [Sides::Both, Sides::Front, Sides::Back][i % 3];
        let tag = Tag { entity: i as u32, sides, ..Tag::default() };
        let small = |p: &Vec3| *a + *p * 0.2;
        match kind {
            0 | 1 => geometry.push_sphere(tag, *a, *r * 0.3),
            2 => geometry.push_triangle(tag, [*a, small(b), small(c)], None),
            3 => geometry.push_box(tag, a.min(small(b)), a.max(small(b))),
            4 if a != b => geometry.push_cone(tag, *a, *r * 0.2, small(b), *r * 0.1, i % 2 == 0),
            5 => {
                let m = DMat3::from_cols(DVec3::X * 0.3, DVec3::new(0.1, 0.6, 0.0), DVec3::Z * f64::from(*r));
                let map = DAffine3 { matrix3: m, translation: a.as_dvec3() };
                geometry.push_transformed(
                    tag,
                    LocalShape::Sphere(SpherePrim { center: Vec3::ZERO, radius: 0.5 }),
                    &map,
                );
            }
            7 => {
                let map = DAffine3::from_rotation_y(f64::from(*r)) * DAffine3::from_translation(a.as_dvec3());
                geometry.push_mesh(tag, &mesh(), i % 2 == 0, &map);
            }
            8 => {
                // Every other one is squashed askew, so that carrying a ray into it costs many digits.
                let flat = if i % 2 == 0 { 1.0 } else { 1e-3 };
                let m = DMat3::from_cols(DVec3::X * f64::from(*r), DVec3::new(0.3, -0.8 * flat, 0.0), DVec3::Z * 0.7);
                let map = DAffine3 { matrix3: m, translation: a.as_dvec3() };
                geometry.push_instance(tag, &shared, false, &map);
            }
            6 if i % 5 == 0 => geometry.push_plane(tag, *a, b.normalize_or(Vec3::Y)),
            _ => geometry.push_triangle(tag, [*a, *b, *c], None),
        }
    }
    geometry.finish();
    geometry
}

/// What is held to brute force: the tree at full quality, the one for few rays, and the grid.
fn all(geometry: &Geometry, width: Width, density: f64) -> [Accelerator; 3] {
    let [full, fast] = [f64::INFINITY, 0.0]
        .map(|rays| Accelerator::from(Bvh::build(geometry, width, rays, (None, false), &HiddenPrimitives::NONE)));
    [full, fast, Accelerator::from(Grid::build(geometry, density, width, None, &HiddenPrimitives::NONE))]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn all_agree_with_brute_force_to_the_bit(
        pieces in prop::collection::vec(piece(), 0..60),
        rays in prop::collection::vec((point(), point(), 0u8..4), 1..20),
        density in 0.2f64..20.0,
    ) {
        let geometry = build(&pieces);
        let others: Vec<_> = Width::all().into_iter().flat_map(|w| all(&geometry, w, density)).collect();
        let mut worker = TraversalScratch::default();
        for (from, to, kind) in rays {
            let from = if kind == 3 { from * 1e4 } else { from };
            let mut direction = (to - from).normalize_or(Vec3::X);
            if kind == 1 {
                direction = Vec3::AXES[(from.x.abs() * 7.0) as usize % 3];
            }
            let ray = Ray { origin: from, direction, t_max: if kind == 2 { 3.0 } else { f32::INFINITY } };
            let expected = Accelerator::brute().closest(&geometry, &ray, &mut TraversalScratch::default());
            for other in &others {
                let found = other.closest(&geometry, &ray, &mut worker);
                prop_assert_eq!(found, expected, "{}", other.name());
                prop_assert_eq!(other.occluded(&geometry, &ray, &mut worker), expected.is_some());
            }
            prop_assert_eq!(Accelerator::brute().occluded(&geometry, &ray, &mut worker), expected.is_some());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]
    #[test]
    fn what_is_hidden_is_not_there_for_any_of_them(
        pieces in prop::collection::vec(piece(), 1..60),
        rays in prop::collection::vec((point(), point()), 1..20),
        hidden in 1u32..4,
    ) {
        let geometry = build(&pieces);
        let hides = HiddenPrimitives::new(&geometry, |entity| hidden == 3 || entity % 3 == hidden);
        let make = |choice, rays| Accelerator::rebuild(&geometry, choice, 2.0, rays, None, hides.clone());
        let ways = [(Accel::Bvh, f64::INFINITY), (Accel::Bvh, 0.0), (Accel::Grid, 0.0)].map(|(c, r)| make(c, r));
        let (brute, mut worker) = (make(Accel::Brute, 0.0), TraversalScratch::default());
        for (from, to) in rays {
            let ray = Ray::new(from, (to - from).normalize_or(Vec3::X));
            let expected = brute.closest(&geometry, &ray, &mut worker);
            prop_assert!(expected.is_none_or(|hit| !hides.contains(hit.primitive)));
            for other in &ways {
                prop_assert_eq!(other.closest(&geometry, &ray, &mut worker), expected, "{}", other.name());
                prop_assert_eq!(other.occluded(&geometry, &ray, &mut worker), expected.is_some());
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    /// From a pinhole, from a lens, towards a lamp, or scattered: packets find what each ray finds alone.
    #[test]
    fn packets_find_what_single_rays_find(
        pieces in prop::collection::vec(piece(), 0..80),
        from in point(), to in point(), spread in 0.0f32..0.4, lens in prop_oneof![Just(0.0f32), 0.0f32..0.5],
        jitter in prop::collection::vec((prop::array::uniform3(-1.0f32..1.0), prop::array::uniform3(-1.0f32..1.0)), 1..40),
        t_max in prop_oneof![Just(f32::INFINITY), 1.0f32..6.0],
        density in 0.2f64..20.0,
    ) {
        let geometry = build(&pieces);
        let rays: Vec<Ray> = jitter.iter().map(|(a, b)| {
            let origin = from + Vec3::from_array(*a) * lens;
            let direction = (to + Vec3::from_array(*b) * spread - origin).normalize_or(Vec3::NEG_Z);
            Ray { origin, direction, t_max }
        }).collect();
        let mut worker = TraversalScratch::default();
        let expected: Vec<_> =
            rays.iter().map(|ray| Accelerator::brute().closest(&geometry, ray, &mut worker)).collect();
        let many = Rays::from_iter(rays);
        for accelerator in Width::all().into_iter().flat_map(|w| all(&geometry, w, density)) {
            let mut found = Hits::default();
            accelerator.closest_all(&geometry, &many, &mut worker, &mut found);
            prop_assert_eq!(&found.iter().collect::<Vec<_>>(), &expected, "{}", accelerator.name());
            let mut met = Vec::new();
            accelerator.occluded_all(&geometry, &many, &mut worker, &mut met);
            prop_assert_eq!(met.len(), expected.len());
            prop_assert!(met.iter().zip(&expected).all(|(met, hit)| *met == hit.is_some()), "{}", accelerator.name());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]
    /// From anywhere to anywhere, near small things and far from large ones: streams find what brute force finds,
    /// whether packets were tried before or not.
    #[test]
    fn streams_find_what_single_rays_find(
        pieces in prop::collection::vec(piece(), 0..80),
        ends in prop::collection::vec((point(), point()), 1..200),
        t_max in prop_oneof![Just(f32::INFINITY), 1.0f32..6.0],
        (shrink, reach) in (prop_oneof![Just(1.0f32), Just(1e-2)], prop_oneof![Just(0.0f32), Just(700.0)]),
        wait in prop_oneof![Just(0), Just(u32::MAX)],
    ) {
        let mut pieces = pieces;
        for Piece(_, a, b, c, r) in &mut pieces {
            (*a, *b, *c, *r) = (*a * shrink, *b * shrink, *c * shrink, *r * shrink);
        }
        if reach > 0.0 {
            let far = |x: f32, z: f32| Vec3::new(x * reach, -3.0, z * reach);
            pieces.push(Piece(9, far(-1.0, -1.0), far(-1.0, 1.0), far(1.0, 0.3), 1.0));
        }
        let geometry = build(&pieces);
        let rays: Vec<Ray> = ends.iter().map(|(from, to)| {
            let direction = (*to - *from).normalize_or(Vec3::NEG_Y);
            Ray { origin: *from * shrink, direction, t_max }
        }).collect();
        let mut worker = TraversalScratch::default();
        let expected: Vec<_> =
            rays.iter().map(|ray| Accelerator::brute().closest(&geometry, ray, &mut worker)).collect();
        let many = Rays::from_iter(rays);
        for accelerator in Width::all().into_iter().flat_map(|w| all(&geometry, w, 2.0)) {
            let mut found = Hits::default();
            worker.wait = wait;
            accelerator.closest_all(&geometry, &many, &mut worker, &mut found);
            prop_assert_eq!(&found.iter().collect::<Vec<_>>(), &expected, "{}", accelerator.name());
            let mut met = Vec::new();
            worker.wait = wait;
            accelerator.occluded_all(&geometry, &many, &mut worker, &mut met);
            prop_assert!(met.iter().zip(&expected).all(|(met, hit)| *met == hit.is_some()), "{}", accelerator.name());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// Pieces of the same kinds move frame by frame, a little or to anywhere: a tree that was fitted again and again
    /// still finds what brute force finds.
    #[test]
    fn fitted_trees_agree_with_brute_force_to_the_bit(
        pieces in prop::collection::vec(piece(), 1..60),
        motions in prop::collection::vec((prop_oneof![Just(0.02f32), Just(0.3), Just(4.0)], point(), point()), 1..4),
        rays in prop::collection::vec((point(), point()), 1..20),
        expected_rays in prop_oneof![Just(0.0), Just(f64::INFINITY)],
    ) {
        let mut pieces = pieces;
        let mut tree = Accelerator::rebuild(&build(&pieces), Accel::Bvh, 2.0, expected_rays, None, HiddenPrimitives::NONE);
        for (size, turn, shift) in motions {
            for (i, Piece(kind, a, b, c, _)) in pieces.iter_mut().enumerate() {
                let way = if i % 3 == 0 { turn } else { shift } * size;
                *a += way;
                *b += way;
                *c += if *kind == 2 { way } else { turn * size };
            }
            let geometry = build(&pieces);
            tree = Accelerator::rebuild(&geometry, Accel::Bvh, 2.0, expected_rays, Some(&tree), HiddenPrimitives::NONE);
            let mut worker = TraversalScratch::default();
            for (from, to) in &rays {
                let ray = Ray::new(*from, (*to - *from).normalize_or(Vec3::X));
                let expected = Accelerator::brute().closest(&geometry, &ray, &mut worker);
                prop_assert_eq!(tree.closest(&geometry, &ray, &mut worker), expected);
                prop_assert_eq!(tree.occluded(&geometry, &ray, &mut worker), expected.is_some());
            }
        }
    }
}

#[test]
fn what_a_ray_costs_does_not_depend_on_the_rays_before() {
    let pieces: Vec<Piece> = (0..40)
        .map(|i| Piece(0, Vec3::new((i % 7) as f32, (i % 5) as f32, (i % 3) as f32), Vec3::ONE, Vec3::X, 1.0))
        .collect();
    let geometry = build(&pieces);
    let grid = Accelerator::build(&geometry, Accel::Grid, 4.0);
    let ray = Ray::new(Vec3::new(-3.0, 0.1, 0.2), Vec3::new(1.0, 0.3, 0.2).normalize());
    let mut fresh = TraversalScratch::default();
    grid.closest(&geometry, &ray, &mut fresh);
    let mut used = TraversalScratch::default();
    for i in 0..50 {
        let aside = Ray::new(Vec3::new(-3.0, 0.1 * i as f32, 0.2), Vec3::X);
        grid.closest(&geometry, &aside, &mut used);
    }
    let before = used.counters;
    grid.closest(&geometry, &ray, &mut used);
    assert_eq!(used.counters.intersection_tests - before.intersection_tests, fresh.counters.intersection_tests);
    assert_eq!(used.counters.steps - before.steps, fresh.counters.steps);
}

#[test]
fn a_giant_floor_does_not_ruin_the_grid() {
    let mut geometry = Geometry::default();
    let tag = Tag::default();
    for i in 0..1000 {
        let at = Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32) * 0.1;
        geometry.push_sphere(tag, at, 0.03);
    }
    let far = 500.0;
    geometry.push_triangle(
        tag,
        [Vec3::new(-far, -0.1, -far), Vec3::new(-far, -0.1, far), Vec3::new(far, -0.1, far)],
        None,
    );
    geometry.push_triangle(
        tag,
        [Vec3::new(-far, -0.1, -far), Vec3::new(far, -0.1, far), Vec3::new(far, -0.1, -far)],
        None,
    );
    geometry.finish();
    let grid = Accelerator::build(&geometry, Accel::Grid, 2.0);
    let mut worker = TraversalScratch::default();
    for i in 0..100 {
        let target = Vec3::new(0.009 * i as f32, 0.4, 0.5);
        let origin = Vec3::new(0.5, 2.0, 3.0);
        grid.closest(&geometry, &Ray::new(origin, (target - origin).normalize()), &mut worker);
    }
    let per_ray = worker.counters.intersection_tests / 100;
    assert!(per_ray < 30, "{per_ray} tests a ray");
}

/// A ball of many small triangles in a shallow bowl of few large ones, a hundred times as wide.
#[test]
fn a_dense_mesh_in_a_wide_scene_answers_like_the_tree_and_costs_little() {
    let lattice = |side: u32, place: &dyn Fn(f32, f32) -> Vec3| {
        let at = |i: u32| i as f32 / side as f32;
        let vertices = (0..=side).flat_map(|i| (0..=side).map(move |j| (at(i), at(j)))).map(|(u, v)| place(u, v));
        let corner = |i: u32, j: u32| i * (side + 1) + j;
        let quads = (0..side).flat_map(|i| (0..side).map(move |j| (i, j)));
        let halves = |(i, j)| {
            let (a, b, c, d) = (corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
            [[a, b, c], [a, c, d]]
        };
        Arc::new(MeshData::new(vertices.collect(), quads.flat_map(halves).collect(), Vec::new()))
    };
    let ball = lattice(60, &|u, v| {
        let (a, b) = (u * std::f32::consts::TAU, (v - 0.5) * std::f32::consts::PI);
        Vec3::new(libm::cosf(a) * libm::cosf(b), 1.2 + libm::sinf(b), libm::sinf(a) * libm::cosf(b))
    });
    let bowl = lattice(20, &|u, v| {
        let (x, z) = (u - 0.5, v - 0.5);
        Vec3::new(200.0 * x, 40.0 * (x * x + z * z), 200.0 * z)
    });
    let mut geometry = Geometry::default();
    geometry.push_mesh(Tag::default(), &ball, false, &DAffine3::IDENTITY);
    geometry.push_mesh(Tag::default(), &bowl, false, &DAffine3::IDENTITY);
    geometry.finish();
    let [tree, fast, grid] = all(&geometry, Width::detect(), 2.0);
    let rays: Rays = (0..1024)
        .map(|i| {
            let target = Vec3::new((i % 32) as f32 * 0.08 - 1.25, (i / 32) as f32 * 0.08, 0.0);
            let origin = Vec3::new(6.0, 4.0, -60.0);
            Ray::new(origin, (target - origin).normalize())
        })
        .collect();
    let find = |accelerator: &Accelerator, worker: &mut TraversalScratch| {
        let mut found = Hits::default();
        accelerator.closest_all(&geometry, &rays, worker, &mut found);
        found.iter().collect::<Vec<_>>()
    };
    let mut worker = TraversalScratch::default();
    let expected = find(&tree, &mut TraversalScratch::default());
    assert_eq!(find(&grid, &mut worker), expected);
    assert_eq!(find(&fast, &mut TraversalScratch::default()), expected);
    // Nearly all of the ball has one place on the curve through the whole scene.
    let [tree, fast] = [tree, fast].map(|tree| {
        let mut worker = TraversalScratch::default();
        let hits = rays.iter().filter(|ray| tree.closest(&geometry, ray, &mut worker).is_some());
        assert_eq!(hits.count(), expected.iter().flatten().count());
        worker.counters.steps
    });
    assert!(2 * fast < 3 * tree, "{fast} nodes of the fast tree, {tree} of the full one");
    let per_ray = worker.counters.intersection_tests / 1024;
    // The cells of the wide scene around the ball hold most of its 7,200 triangles.
    assert!(per_ray < 200, "{per_ray} tests a ray");
}

/// In a cloud of small cones a ray visits many nodes wherever it goes: packets of camera rays share them all the same.
#[test]
fn packets_stay_together_among_many_small_cones() {
    let mut state = 1u32;
    let mut random = || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        (state >> 8) as f32 / 16_777_216.0
    };
    let mut geometry = Geometry::default();
    for _ in 0..3000 {
        let at = Vec3::new(random(), random(), random()) * 2.0 - 1.0;
        let along = (Vec3::new(random(), random(), random()) - 0.5) * 0.06;
        geometry.push_cone(Tag::default(), at, 0.006, at + along, 0.0, true);
    }
    geometry.finish();
    let tree = Accelerator::build(&geometry, Accel::Bvh, 1.0);
    let origin = Vec3::new(0.1, 0.2, 4.0);
    let rays: Rays = (0..512)
        .map(|i| {
            // Tiles of four by four.
            let (tile, x, y) = (i / 16, i % 4, i / 4 % 4);
            let target = Vec3::new((tile % 8 * 4 + x) as f32, (tile / 8 * 4 + y) as f32, 0.0) * 0.006;
            Ray::new(origin, (target - origin).normalize())
        })
        .collect();
    let (mut alone, mut together) = (TraversalScratch::default(), TraversalScratch::default());
    let expected: Vec<_> = rays.iter().map(|ray| tree.closest(&geometry, &ray, &mut alone)).collect();
    let mut found = Hits::default();
    tree.closest_all(&geometry, &rays, &mut together, &mut found);
    assert_eq!(found.iter().collect::<Vec<_>>(), expected);
    let (alone, together) = (alone.counters.steps, together.counters.steps);
    assert!(2 * together < alone, "{together} nodes together, {alone} alone");
}
