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
    out[3].push_transformed(tag, LocalShape::Sphere { center: Vec3::ZERO, radius: 1.0 }, &map);
    out[4].push_transformed(tag, LocalShape::Box { min: Vec3::splat(-1.0), max: Vec3::ONE }, &map);
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
                let Some(hit) = Accelerator::Brute.closest(geometry, &ray, &mut scratch) else { continue };
                let surface = geometry.surface(&ray, &hit);
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
                let again = Accelerator::Brute.closest(geometry, &leaving, &mut scratch);
                if steep > 0.0 {
                    assert!(again.is_none(), "acne: kind {kind} scale {scale} at {offset}: {surface:?} {again:?}");
                } else {
                    // Inside there is a way out. Close to an edge the offset may lead past the next face, though.
                    let back = again.map(|hit| geometry.surface(&leaving, &hit));
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
            let hit = Accelerator::Brute.closest(&geometry, &ray, &mut scratch).unwrap();
            let surface = geometry.surface(&ray, &hit);
            let low = next() * Vec3::new(1.0, 0.3, 1.0);
            let direction = (turn * low.with_y(low.y.abs() + 0.02)).normalize();
            let leaving = Ray::new(surface.offset_origin(direction), direction);
            let again = Accelerator::Brute.closest(&geometry, &leaving, &mut scratch);
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
        let Some(hit) = Accelerator::Brute.closest(&geometry, &ray, &mut TraversalScratch::default()) else { continue };
        let surface = geometry.surface(&ray, &hit);
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
        let surface = geometry.surface(&ray, &hit);
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
            |ray: Ray| Accelerator::Brute.closest(&geometry, &ray, &mut TraversalScratch::default()).map(|hit| hit.t);
        assert_eq!(t(Ray::new(Vec3::Z * 5.0, Vec3::NEG_Z)), from_outside);
        assert_eq!(t(Ray::new(Vec3::ZERO, Vec3::NEG_Z)).is_some(), sides != Sides::Front);
    }
}
