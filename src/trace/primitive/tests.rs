//! No acne and no leaks: rays that leave a surface, at every scale.

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::*;
use crate::base::random::{combine, unit_f32};
use crate::components::Accel;
use crate::trace::accel::{Accelerator, TraversalScratch};
use crate::trace::soa::Ray;

fn random_vectors(seed: u64) -> impl FnMut() -> Vec3 {
    let mut n = 0;
    move || {
        n += 1;
        let x = |i: u64| unit_f32(combine(seed, n * 4 + i)) * 2.0 - 1.0;
        Vec3::new(x(0), x(1), x(2))
    }
}

/// One convex solid of each kind, of size `scale` around `center`.
fn solids(scale: f32, center: Vec3) -> Vec<Geometry> {
    let tag = Tag::default();
    let (c, s) = (center, scale);
    let mut out = vec![Geometry::default(); 6];
    out[0].push_sphere(tag, c, s);
    out[1].push_box(tag, c - s, c + Vec3::new(s, 0.5 * s, 2.0 * s));
    out[2].push_cone(tag, c, s, c + Vec3::new(0.3, 1.0, 0.2) * s, 0.4 * s, true);
    let m = DMat3::from_cols(DVec3::new(1.0, 0.3, 0.0), DVec3::new(0.0, 0.7, 0.2), DVec3::new(0.1, 0.0, 1.9));
    let map = DAffine3 { matrix3: m * f64::from(s), translation: c.as_dvec3() };
    out[3].push_transformed(tag, LocalShape::Sphere(SpherePrim { center: Vec3::ZERO, radius: 1.0 }), &map);
    out[4].push_transformed(tag, LocalShape::Box(BoxPrim { min: Vec3::splat(-1.0), max: Vec3::ONE }), &map);
    let points =
        [Vec3::new(1.0, 1.0, 1.0), Vec3::new(-1.0, -1.0, 1.0), Vec3::new(-1.0, 1.0, -1.0), Vec3::new(1.0, -1.0, -1.0)];
    for [i, j, k] in [[0, 1, 3], [0, 2, 1], [0, 3, 2], [1, 2, 3]] {
        let corners = [points[i], points[j], points[k]].map(|p| c + p * s);
        let outward = (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(corners[0] - c) > 0.0;
        out[5].push_triangle(tag, if outward { corners } else { [corners[0], corners[2], corners[1]] }, None);
    }
    out.iter_mut().for_each(Geometry::finish);
    out
}

#[test]
fn rays_that_leave_a_solid_neither_meet_it_again_nor_slip_through() {
    for (scale, offset) in [(1.0, 0.0), (1e-3, 0.0), (1e6, 0.0), (1.0, 1e4), (1e-3, 1.0), (30.0, 7.0)] {
        let center = Vec3::new(offset, -0.7 * offset, 0.3 * offset);
        for (kind, geometry) in solids(scale, center).iter().enumerate() {
            let mut next = random_vectors(kind as u64);
            let mut scratch = TraversalScratch::default();
            let (mut tested, mut lost) = (0, 0);
            while tested < 2_000 {
                let origin = center + next() * (6.0 * scale);
                let target = center + next() * (0.7 * scale);
                let ray = Ray::new(origin, (target - origin).normalize_or(Vec3::X));
                let Some(hit) = Accelerator::brute().closest(geometry, &ray, &mut scratch) else { continue };
                let surface = geometry.surface_point(&ray, &hit);
                if ray.direction.dot(surface.geometric_normal) >= 0.0 {
                    // The origin was inside.
                    continue;
                }
                tested += 1;
                let direction = next().normalize_or(Vec3::Y);
                let steep = direction.dot(surface.geometric_normal);
                if steep.abs() < 1e-3 {
                    continue;
                }
                let leaving = Ray::new(surface.offset_origin(direction), direction);
                let again = Accelerator::brute().closest(geometry, &leaving, &mut scratch);
                if steep > 0.0 {
                    assert!(again.is_none(), "acne: kind {kind} scale {scale} at {offset}: {surface:?} {again:?}");
                } else {
                    // Inside there is a way out. Close to an edge the offset may lead past the next face, though.
                    let back = again.map(|hit| geometry.surface_point(&leaving, &hit));
                    let well = back.is_some_and(|back| direction.dot(back.geometric_normal) > 0.0);
                    lost += usize::from(!well);
                }
            }
            assert!(lost <= if kind == 0 { 0 } else { tested / 100 }, "leaks: {lost}, kind {kind} {scale} {offset}");
        }
    }
}

/// Two large triangles that many rays leave, most of them at a low angle, far from the corners and near the diagonal.
#[test]
fn rays_that_leave_a_large_floor_do_not_meet_it_again() {
    for (tilt, scale) in [(0.0, 12.0), (0.3, 12.0), (1.0, 500.0), (0.0, 1e5), (0.7, 0.05)] {
        let turn = DMat3::from_rotation_x(tilt).as_mat3();
        let corner = |x: f32, z: f32| turn * (Vec3::new(x, -0.04, z) * scale);
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let mut geometry = Geometry::default();
        geometry.push_triangle(Tag::default(), [corners[0], corners[2], corners[1]], None);
        geometry.push_triangle(Tag::default(), [corners[0], corners[3], corners[2]], None);
        geometry.finish();
        let mut next = random_vectors(tilt.to_bits());
        let mut scratch = TraversalScratch::default();
        for _ in 0..20_000 {
            let eye = turn * (Vec3::new(0.2, 0.3, 0.1) * scale);
            let aim = next();
            let ray = Ray::new(eye, (corner(0.99 * aim.x, 0.99 * aim.z) - eye).normalize());
            let hit = Accelerator::brute().closest(&geometry, &ray, &mut scratch).unwrap();
            let surface = geometry.surface_point(&ray, &hit);
            let low = next() * Vec3::new(1.0, 0.3, 1.0);
            let direction = (turn * low.with_y(low.y.abs() + 0.02)).normalize();
            let leaving = Ray::new(surface.offset_origin(direction), direction);
            let again = Accelerator::brute().closest(&geometry, &leaving, &mut scratch);
            assert!(again.is_none(), "tilt {tilt} scale {scale}: {surface:?} {direction} {again:?}");
        }
    }
}

#[test]
fn the_error_bound_holds() {
    let center = Vec3::new(3.0, -2.0, 11.0);
    let mut geometry = Geometry::default();
    geometry.push_sphere(Tag::default(), center, 0.7);
    geometry.finish();
    let mut next = random_vectors(5);
    for _ in 0..2_000 {
        let origin = center + next() * 20.0;
        let ray = Ray::new(origin, (center + next() * 0.3 - origin).normalize());
        let Some(hit) = Accelerator::brute().closest(&geometry, &ray, &mut TraversalScratch::default()) else {
            continue;
        };
        let surface = geometry.surface_point(&ray, &hit);
        let off = surface.point.as_dvec3() - center.as_dvec3();
        let exact = center.as_dvec3() + off.normalize() * f64::from(0.7f32);
        let error = (surface.point.as_dvec3() - exact).abs();
        assert!(error.cmple(surface.error.as_dvec3()).all(), "{error} {}", surface.error);
    }
}

#[test]
fn the_camera_may_be_as_far_as_it_likes() {
    let mut geometry = Geometry::default();
    geometry.push_sphere(Tag::default(), Vec3::ZERO, 1.0);
    geometry.finish();
    let accelerator = Accelerator::build(&geometry, Accel::Grid, 2.0);
    for distance in [10.0f32, 1e3, 1e6] {
        let ray = Ray::new(Vec3::Z * distance, Vec3::NEG_Z);
        let hit = accelerator.closest(&geometry, &ray, &mut TraversalScratch::default()).unwrap();
        let surface = geometry.surface_point(&ray, &hit);
        assert!((surface.point - Vec3::Z).length() < 1e-6, "{distance}: {surface:?}");
    }
}

#[test]
fn one_sided_surfaces_show_one_side() {
    for (sides, from_outside) in [(Sides::Front, Some(4.0)), (Sides::Back, Some(6.0)), (Sides::Both, Some(4.0))] {
        let mut geometry = Geometry::default();
        geometry.push_sphere(Tag { sides, ..Tag::default() }, Vec3::ZERO, 1.0);
        geometry.finish();
        let t =
            |ray: Ray| Accelerator::brute().closest(&geometry, &ray, &mut TraversalScratch::default()).map(|hit| hit.t);
        assert_eq!(t(Ray::new(Vec3::Z * 5.0, Vec3::NEG_Z)), from_outside);
        assert_eq!(t(Ray::new(Vec3::ZERO, Vec3::NEG_Z)).is_some(), sides != Sides::Front);
    }
}

mod uv {
    use std::sync::Arc;

    use glam::{DAffine3, DVec3, Vec2};

    use super::super::aabox::cube;
    use super::super::cone::{ConePart, tube};
    use super::super::plane::floor;
    use super::super::sphere::globe;
    use super::*;
    use crate::base::math::placement;
    use crate::components::MeshData;
    use crate::trace::accel::{Accelerator, TraversalScratch};
    use crate::trace::primitive::{LocalShape, Tag};
    use crate::trace::soa::Ray;

    fn frame(map: &DAffine3) -> ObjectSpace {
        ObjectSpace { map: AffineMap::new(map), center: None }
    }

    /// Texture coordinates of the hit of a ray from a point towards another.
    fn meet(geometry: &Geometry, frame: &ObjectSpace, from: Vec3, to: Vec3) -> (SurfaceUv, SurfacePoint) {
        let accelerator = Accelerator::build(geometry, crate::components::Accel::Brute, 2.0);
        let ray = Ray::new(from, (to - from).normalize());
        let hit = accelerator.closest(geometry, &ray, &mut TraversalScratch::default()).unwrap();
        let surface = geometry.surface_point(&ray, &hit);
        (geometry.surface_uv(&hit, &surface, frame, false), surface)
    }

    /// One of each shape in a local space, under a map.
    fn shapes(map: &DAffine3, similar: bool) -> Vec<Geometry> {
        let m = |p: Vec3| map.transform_point3(p.as_dvec3()).as_vec3();
        let scale = map.matrix3.x_axis.length() as f32;
        let tag = Tag::default();
        let square = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.5, 0.0)];
        let uvs = vec![Vec2::new(0.1, 0.2), Vec2::new(0.9, 0.1), Vec2::new(0.4, 0.8)];
        let mesh = MeshData::new(square.to_vec(), vec![[0, 1, 2]], Vec::new()).with_uvs(uvs);
        let mesh = Arc::new(mesh);
        let mut all: Vec<Geometry> = (0..6).map(|_| Geometry::default()).collect();
        let cone = LocalShape::Cone(ConeFrustum::new(Vec3::NEG_Y, 1.0, Vec3::Y, 0.5, true));
        if similar {
            all[0].push_sphere(tag, m(Vec3::ZERO), scale);
            all[1].push_cone(tag, m(Vec3::NEG_Y), scale, m(Vec3::Y), 0.5 * scale, true);
        } else {
            all[0].push_transformed(tag, LocalShape::Sphere(SpherePrim { center: Vec3::ZERO, radius: 1.0 }), map);
            all[1].push_transformed(tag, cone, map);
        }
        all[2].push_transformed(tag, LocalShape::Box(BoxPrim { min: -Vec3::ONE, max: Vec3::ONE }), map);
        all[3].push_mesh(tag, &mesh, false, map);
        all[4].push_instance(tag, &mesh, false, map);
        let normal = map.matrix3.inverse().transpose() * DVec3::Z;
        all[5].push_plane(tag, m(Vec3::ZERO), normal.normalize().as_vec3());
        all.iter_mut().for_each(Geometry::finish);
        all
    }

    /// Gradients against differences: a step along the surface changes u and v as they say.
    #[test]
    fn gradients_are_the_change_of_the_coordinates() {
        let similar = placement(DVec3::new(0.3, -0.2, 0.1), DVec3::new(20.0, 30.0, 40.0), DVec3::splat(1.5));
        let affine = placement(DVec3::new(0.3, -0.2, 0.1), DVec3::new(20.0, 30.0, 40.0), DVec3::new(1.0, 2.0, -0.7));
        for (map, keeps) in [(similar, true), (affine, false)] {
            for (which, geometry) in shapes(&map, keeps).iter().enumerate() {
                let m = |p: Vec3| map.transform_point3(p.as_dvec3()).as_vec3();
                let from = m(Vec3::new(0.5, 0.4, 4.0));
                for target in [Vec3::new(0.05, -0.1, 0.0), Vec3::new(-0.2, 0.3, 0.0)] {
                    let (here, surface) = meet(geometry, &frame(&map), from, m(target));
                    for step in [Vec3::X, Vec3::Y] {
                        let (there, other) = meet(geometry, &frame(&map), from, m(target + step * 2e-2));
                        let moved = other.point - surface.point;
                        let change = Vec2::from_array(here.gradients.map(|g| g.dot(moved)));
                        let error = (there.uv - here.uv - change).length();
                        assert!(error < 2e-2 * change.length() + 2e-5, "{which} {error} {change} {:?}", here.uv);
                    }
                }
            }
        }
    }

    #[test]
    fn globes_have_their_poles_and_seam_where_it_is_said() {
        let uv = |p: Vec3| globe(p).uv;
        assert!((uv(Vec3::Z) - Vec2::new(0.5, 0.5)).length() < 1e-6);
        assert!((uv(Vec3::X) - Vec2::new(0.75, 0.5)).length() < 1e-6);
        assert!((uv(Vec3::Y).y - 1.0).abs() < 1e-5 && uv(Vec3::NEG_Y).y.abs() < 1e-5);
        let seam = uv(Vec3::new(1e-6, 0.0, -1.0)).x - uv(Vec3::new(-1e-6, 0.0, -1.0)).x;
        assert!((seam - 1.0).abs() < 1e-5);
        for p in [Vec3::Y, Vec3::NEG_Y, Vec3::ZERO, Vec3::splat(1e-30)] {
            assert!(uv(p).is_finite(), "{p}");
        }
    }

    #[test]
    fn faces_and_floors_run_as_documented() {
        let face = |p: Vec3, n: Vec3| cube(p, n, -Vec3::ONE, Vec3::ONE).uv;
        // Right and up as seen from outside: the lower left corner of each side is (0, 0).
        assert_eq!(face(Vec3::new(-1.0, -1.0, 1.0), Vec3::Z), Vec2::ZERO);
        assert_eq!(face(Vec3::new(1.0, -1.0, 1.0), Vec3::X), Vec2::ZERO);
        assert_eq!(face(Vec3::new(1.0, -1.0, -1.0), Vec3::NEG_Z), Vec2::ZERO);
        assert_eq!(face(Vec3::new(-1.0, -1.0, -1.0), Vec3::NEG_X), Vec2::ZERO);
        assert_eq!(face(Vec3::new(-1.0, 1.0, 1.0), Vec3::Y), Vec2::ZERO);
        assert_eq!(face(Vec3::new(-1.0, -1.0, -1.0), Vec3::NEG_Y), Vec2::ZERO);
        let ground = floor(Vec3::new(2.0, 0.0, -3.0), Vec3::Y);
        assert_eq!(ground.uv, Vec2::new(2.0, 3.0));
        let cylinder = ConeFrustum::new(Vec3::ZERO, 1.0, Vec3::Y * 2.0, 1.0, true);
        let side = tube(Vec3::new(1.0, 0.5, 0.0), ConePart::Side.code(), &cylinder);
        assert!((side.uv - Vec2::new(0.75, 0.25)).length() < 1e-6);
        let top = tube(Vec3::new(0.5, 2.0, 0.5), ConePart::Apex.code(), &cylinder);
        assert!((top.uv - Vec2::new(0.75, 0.25)).length() < 1e-6);
    }
}

mod shapes {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::super::cone::ConePart;
    use super::*;
    use crate::trace::simd::V3;

    fn vector(limit: f32) -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-limit..limit).prop_map(Vec3::from_array)
    }

    fn probe(origin: Vec3, direction: Vec3) -> PreparedRay {
        PreparedRay::new(origin, direction.normalize_or(Vec3::Z))
    }

    fn sphere(probe: &PreparedRay, center: Vec3, radius: f32) -> Option<[f32; 2]> {
        let (met, hits) = super::intersect_sphere::<f32>(&probe.beam(), V3::splat(center), radius);
        met.then_some(hits)
    }

    fn triangle(probe: &PreparedRay, corners: &[Vec3; 3]) -> Option<(f32, f32, f32, bool)> {
        let turned = corners.map(|p| V3::splat(probe.turned(p)));
        let hits = super::intersect_triangle::<f32>(&probe.beam(), turned)?;
        hits.hit.then_some((hits.t, hits.u, hits.v, hits.front))
    }

    proptest! {
        #[test]
        fn sphere_hits_lie_on_the_sphere(o in vector(50.0), at in vector(1.0), c in vector(5.0), r in 0.01f32..5.0) {
            let probe = probe(o, c + at * r - o);
            if let Some(hits) = sphere(&probe, c, r) {
                prop_assert!(hits[0] <= hits[1]);
                for t in hits {
                    let p = o.as_dvec3() + probe.direction.as_dvec3() * f64::from(t);
                    let off = p.distance(c.as_dvec3()) - f64::from(r);
                    prop_assert!(off.abs() < 1e-4 * (1.0 + f64::from(r)), "{off}");
                }
            } else {
                let f = c.as_dvec3() - o.as_dvec3();
                let nearest = f.cross(probe.direction.as_dvec3()).length();
                prop_assert!(nearest > f64::from(r) * 0.9999 - 1e-4);
            }
        }

        #[test]
        fn triangle_hits_agree_with_double_precision(
            o in vector(10.0), a in vector(3.0), b in vector(3.0), c in vector(3.0), w in prop::array::uniform2(0.0f32..1.0)
        ) {
            let (w1, w2) = if w[0] + w[1] > 1.0 { (1.0 - w[0], 1.0 - w[1]) } else { (w[0], w[1]) };
            let target = a + (b - a) * w1 + (c - a) * w2;
            let normal = (b - a).cross(c - a);
            prop_assume!(normal.length() > 0.1 && (target - o).normalize().dot(normal.normalize()).abs() > 0.05);
            let edge = w1.min(w2).min(1.0 - w1 - w2);
            prop_assume!(edge > 1e-3);
            let probe = probe(o, target - o);
            let (t, u, v, front) = triangle(&probe, &[a, b, c]).unwrap();
            prop_assert!((t - o.distance(target)).abs() < 1e-3);
            prop_assert!((u - w1).abs() < 2e-3 && (v - w2).abs() < 2e-3);
            prop_assert_eq!(front, normal.dot(probe.direction) < 0.0);
        }

        /// Two triangles on either side of an edge: a ray aimed at the edge hits at least one of them.
        #[test]
        fn no_ray_slips_through_a_shared_edge(
            o in vector(10.0), p in vector(1.0), q in vector(1.0), s in 0.0f32..1.0, left in vector(1.0), right in vector(1.0)
        ) {
            let mut target = p + (q - p) * s;
            target += target * f32::EPSILON;
            let d = (target - o).normalize_or(Vec3::Z);
            let across = (q - p).cross(d);
            // Seen from the origin, the third corners lie on opposite sides of the edge.
            prop_assume!(across.length() > 1e-3);
            let away = across.normalize();
            let (l, r) = (p + (q - p) * left.x.abs() + away, p + (q - p) * right.x.abs() - away);
            let probe = probe(o, target - o);
            prop_assume!(s > 0.01 && s < 0.99);
            prop_assert!(triangle(&probe, &[p, q, l]).is_some() || triangle(&probe, &[q, p, r]).is_some());
        }

        #[test]
        fn cone_crossings_lie_on_the_cone(
            o in vector(20.0), at in vector(1.0), base in vector(3.0), apex in vector(3.0), r0 in 0.0f32..2.0, r1 in 0.0f32..2.0
        ) {
            prop_assume!(base.distance(apex) > 0.1 && r0 + r1 > 0.1);
            let cone = ConeFrustum::new(base, r0, apex, r1, true);
            let probe = probe(o, base + (apex - base) * at.x.abs() + at - o);
            let (mut count, mut net) = (0, 0);
            cone.crossings(&probe, |t, enters, part| {
                count += 1;
                net += if enters { 1 } else { -1 };
                let p = (o.as_dvec3() + probe.direction.as_dvec3() * f64::from(t)) - base.as_dvec3();
                let axis: DVec3 = (apex.as_dvec3() - base.as_dvec3()).normalize();
                let z = p.dot(axis);
                let radius = (p - axis * z).length();
                let expected = f64::from(r0) + f64::from(cone.slope) * z;
                match part {
                    ConePart::Side => assert!((radius - expected).abs() < 5e-3, "{radius} {expected}"),
                    ConePart::Base => assert!(z.abs() < 1e-3 && radius < expected + 1e-3),
                    ConePart::Apex => assert!((z - f64::from(cone.height)).abs() < 1e-3 && radius < expected + 1e-3),
                }
            });
            prop_assert!(count <= 4);
            prop_assert!(net == 0 || count == 1 || o.distance(base) < 12.0);
        }
    }

    #[test]
    fn giant_and_tiny_spheres_are_met_where_they_are() {
        let down = probe(Vec3::new(0.0, 3.0, 0.0), Vec3::NEG_Y);
        let [t, _] = sphere(&down, Vec3::new(0.0, -1e5, 0.0), 1e5).unwrap();
        assert!((t - 3.0).abs() < 1e-2);
        let far = probe(Vec3::new(0.0, 0.0, 1e4), Vec3::NEG_Z);
        let [near, leave] = sphere(&far, Vec3::ZERO, 1e-2).unwrap();
        assert!(near <= leave && (near - 1e4).abs() < 0.02);
    }

    #[test]
    fn boxes_stand_rays_along_their_faces() {
        let (min, max) = (Vec3::ZERO, Vec3::ONE);
        let inside = |p: PreparedRay| {
            let [near, far] = intersect_box::<f32>(&p.beam(), V3::splat(min), V3::splat(max));
            near <= far && far > 0.0
        };
        assert!(inside(probe(Vec3::new(0.5, 0.5, -1.0), Vec3::Z)));
        assert!(!inside(probe(Vec3::new(0.5, 1.5, -1.0), Vec3::Z)));
        assert!(!inside(probe(Vec3::new(0.5, 0.5, -1.0), Vec3::NEG_Z)));
    }
}
