use glam::{DVec3, Vec3};
use proptest::prelude::*;

use super::*;
use crate::trace::reuse::footprint::{WAYS, direction};
use crate::trace::simd::Width;
use crate::trace::soa::Ray;

fn cube(center: Vec3, half: f32) -> Kdop {
    Kdop::new(|d| d.dot(center.as_dvec3()) + f64::from(half) * d.abs().element_sum())
}

fn ball(center: Vec3, radius: f32) -> Kdop {
    Kdop::new(|d| d.dot(center.as_dvec3()) + f64::from(radius) * d.length())
}

/// Numbers of the places that a ray crosses before `end`, the same with lanes of any width.
fn crossed(places: &[Kdop], ray: &Ray, end: f32) -> Vec<usize> {
    let places: Vec<(Kdop, u64)> = places.iter().enumerate().map(|(i, place)| (*place, 1 << i)).collect();
    let boxes = TrackedRegions::new(&places);
    let found = Width::all().into_iter().map(|width| {
        let mut footprint = Footprint::default();
        footprint.begin([TouchMask::default(); 3].into_iter());
        let lookout = DirtyRegions { boxes: &boxes, live: u64::MAX, middle: Vec3::X, width };
        footprint.add(lookout, std::iter::once((*ray, 1, end)));
        let marks = footprint.marks();
        assert_eq!([marks[0], marks[2]], [TouchMask::default(); 2]);
        assert_eq!(marks[1].far, ray.origin.distance_squared(Vec3::X));
        marks[1].crossed
    });
    let found: Vec<u64> = found.collect();
    assert!(found.iter().all(|bits| *bits == found[0]));
    (0..places.len()).filter(|i| found[0] >> i & 1 == 1).collect()
}

#[test]
fn a_ray_crosses_what_lies_before_its_end() {
    let row: Vec<Kdop> = (0..20).map(|i| cube(Vec3::X * i as f32, 0.2)).collect();
    let along = Ray::new(Vec3::new(-5.0, 0.0, 0.0), Vec3::X);
    assert_eq!(crossed(&row, &along, 8.5), [0, 1, 2, 3]);
    assert_eq!(crossed(&row, &along, f32::INFINITY).len(), 20);
    assert_eq!(crossed(&row, &Ray::new(Vec3::X * 3.0, Vec3::Y), 1.0), [3]);
    assert_eq!(crossed(&row, &Ray::new(Vec3::new(3.5, 0.0, 0.0), Vec3::Z), 9.0), [0usize; 0]);
    assert_eq!(crossed(&row, &Ray::new(Vec3::Y, Vec3::X), 9.0), [0usize; 0]);
    // On the plane of a side, and across it.
    assert_eq!(crossed(&row, &Ray::new(Vec3::new(-5.0, 0.2, 0.2), Vec3::X), 7.5), [0, 1, 2]);
}

#[test]
fn a_ball_is_not_met_at_the_corners_of_its_box() {
    let past = |x: f32, y: f32| crossed(&[ball(Vec3::ZERO, 1.0)], &Ray::new(Vec3::new(x, y, -5.0), Vec3::Z), 9.0).len();
    assert_eq!((past(0.99, 0.0), past(0.7, 0.7), past(0.8, 0.8), past(0.95, 0.6)), (1, 1, 0, 0));
}

#[test]
fn a_trail_minds_what_left_its_way_and_what_came_into_it() {
    let change = |bits, near| Some(Change { bits, near });
    let changes = |picture, since: &[Option<Change>], next| Changes { picture, since: since.to_vec(), next };
    for each in [0, 2] {
        let mut trail = SampleHistory::new(2, each);
        let everything: Vec<u32> = (0..2 * each.max(1)).collect();
        assert_eq!(trail.stale(&changes(0, &[], 0)), everything);
        let mut footprint = Footprint::default();
        let marks = everything.iter().map(|i| TouchMask { crossed: u64::from(*i == 1) << 2, far: *i as f32 });
        footprint.begin(marks);
        let keep = |trail: &mut SampleHistory, footprint: &mut Footprint, now: &Changes| {
            if each > 0 {
                trail.keep_samples(&everything, &vec![Vec3::ONE; everything.len()], footprint, now.picture);
            } else {
                trail.begin_pixels(&everything, now, footprint);
                everything.iter().for_each(|i| footprint.put_down(*i as usize, *i as usize));
                trail.keep_pixels(&everything, footprint, now.picture);
            }
        };
        keep(&mut trail, &mut footprint, &changes(0, &[], 0));
        let always = f32::INFINITY;
        assert_eq!(trail.stale(&changes(1, &[change(0b11, always)], 0)), [0u32; 0]);
        assert_eq!(trail.stale(&changes(1, &[change(0b110, always)], 0)), [1]);
        assert_eq!(trail.stale(&changes(1, &[change(0, 1.0)], 0)), everything[1..]);
        assert_eq!(trail.stale(&changes(1, &[None], 0)), everything);
        // What will be taken again in the next picture is not held against places, but now and then.
        assert_eq!(trail.outlook(1, &changes(1, &[], 0b100)), TouchMask::UNTESTED);
        assert_eq!(trail.outlook(1, &changes(3, &[], 0b100)), TouchMask::default());
        assert_eq!(trail.outlook(1, &changes(1, &[], 0b011)), TouchMask::default());
        let now = changes(1, &[change(0b100, always)], 0b100);
        footprint.begin(everything.iter().map(|i| trail.outlook(*i, &now)));
        keep(&mut trail, &mut footprint, &now);
        // That one is taken again, whatever changes.
        assert_eq!(trail.stale(&changes(2, &[change(0, always); 2], 0)), [1]);
    }
}

proptest! {
    /// Whatever point of the ray lies in a place, the ray crosses it.
    #[test]
    fn no_place_on_the_way_is_missed(
        origin in prop::array::uniform3(-50.0f32..50.0),
        toward in prop::array::uniform3(-1.0f32..1.0),
        flat in 0usize..8,
        at in prop::collection::vec((0.0f32..80.0, 1e-3f32..5.0, prop::array::uniform3(-1.0f32..1.0)), 1..20),
    ) {
        // Along axes and diagonals too.
        let toward = Vec3::from_array(std::array::from_fn(|i| if flat >> i & 1 == 1 { toward[i].round() } else { toward[i] }));
        let direction = toward.normalize_or(Vec3::X);
        let ray = Ray::new(origin.into(), direction);
        let cubes = |(t, half, off): &(f32, f32, [f32; 3])| {
            cube(ray.origin + direction * *t + Vec3::from(*off) * *half * 0.999, *half)
        };
        let balls = |(t, radius, off): &(f32, f32, [f32; 3])| {
            let off = Vec3::from(*off);
            let off = off / off.length().max(1.0);
            ball(ray.origin + direction * *t + off * *radius * 0.999, *radius)
        };
        for places in [at.iter().map(cubes).collect::<Vec<_>>(), at.iter().map(balls).collect()] {
            prop_assert_eq!(crossed(&places, &ray, 80.0).len(), places.len());
        }
    }

    /// The sides of a place touch the shape that it is around.
    #[test]
    fn places_hold_their_shapes(points in prop::collection::vec(prop::array::uniform3(-9.0f64..9.0), 1..8)) {
        let points: Vec<DVec3> = points.into_iter().map(DVec3::from).collect();
        let place = Kdop::new(|d| points.iter().map(|p| p.dot(d)).fold(f64::NEG_INFINITY, f64::max));
        for way in 0..WAYS {
            let along: Vec<f32> = points.iter().map(|p| p.dot(direction(way).as_dvec3()) as f32).collect();
            prop_assert_eq!(place.low[way], along.iter().copied().fold(f32::INFINITY, f32::min));
            prop_assert_eq!(place.high[way], along.iter().copied().fold(f32::NEG_INFINITY, f32::max));
        }
    }
}
