//! Polygons as triangles.

use glam::DVec3;

/// Calls for the triangles of a polygon in space, in its own orientation: corners by their place in it.
///
/// A polygon that is convex, or star-shaped as seen from its first corner, becomes a fan; others are cut by their ears.
pub fn triangles(points: &[DVec3], mut each: impl FnMut([usize; 3])) {
    match points.len() {
        0..3 => return,
        3 => return each([0, 1, 2]),
        4 => {
            let normal = (points[2] - points[0]).cross(points[3] - points[1]);
            let turns = |[a, b, c]: [usize; 3]| (points[b] - points[a]).cross(points[c] - points[a]).dot(normal) >= 0.0;
            let [fan, other] = [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]];
            let good = |halves: [[usize; 3]; 2]| halves.into_iter().all(turns);
            let halves = if good(fan) || !good(other) { fan } else { other };
            return halves.into_iter().for_each(each);
        }
        _ => {}
    }
    let normal = normal(points);
    let spread = |i: usize| (points[i] - points[0]).cross(points[i + 1] - points[0]).dot(normal);
    let count = points.len();
    if (1..count - 1).all(|i| spread(i) >= 0.0) && turns_once(points, normal) {
        return (1..count - 1).for_each(|i| each([0, i, i + 1]));
    }
    let ears = ears(points, normal);
    if ears.is_empty() || (ears.len() < count - 2 && !is_flat(points, normal)) {
        // It has no area, or crosses itself, or is bent so much that corners which are seen edge-on would be left out:
        // whatever it shows, none of its corners is lost.
        return (1..count - 1).for_each(|i| each([0, i, i + 1]));
    }
    ears.into_iter().for_each(each);
}

/// Triangles of a polygon of any shape by its ears alone, as NFF scenes have always had them.
pub fn clipped(points: &[DVec3]) -> Vec<[u32; 3]> {
    ears(points, normal(points)).into_iter().map(|t| t.map(|i| i as u32)).collect()
}

/// Newell's normal, which does not mind collinear corners; as long as twice the area.
fn normal(points: &[DVec3]) -> DVec3 {
    let ring = (0..points.len()).map(|i| (points[i] - points[0]).cross(points[(i + 1) % points.len()] - points[0]));
    ring.sum()
}

/// Whether all corners lie in one plane, but for a millionth of the largest distance from the first one.
fn is_flat(points: &[DVec3], normal: DVec3) -> bool {
    let normal = normal.normalize_or_zero();
    let spokes = || points.iter().map(|p| *p - points[0]);
    let reach = spokes().map(|p| p.length()).fold(0.0, f64::max);
    spokes().all(|p| p.dot(normal).abs() <= 1e-6 * reach)
}

/// Whether the spokes from the first corner sweep less than a full turn: a fan that is swept twice overlaps itself.
fn turns_once(points: &[DVec3], normal: DVec3) -> bool {
    let first = points[1] - points[0];
    let mut past_half = false;
    points[2..].iter().all(|p| {
        let behind = first.cross(*p - points[0]).dot(normal) < 0.0;
        let back_again = past_half && !behind;
        past_half |= behind;
        !back_again
    })
}

/// Ear clipping in the plane along whose normal the polygon is flattest.
fn ears(points: &[DVec3], normal: DVec3) -> Vec<[usize; 3]> {
    let a = normal.abs();
    let flat: Vec<f64> = points
        .iter()
        .flat_map(|p| {
            let p = *p - points[0];
            if a.z >= a.x && a.z >= a.y {
                [p.x, p.y]
            } else if a.x >= a.y {
                [p.y, p.z]
            } else {
                [p.z, p.x]
            }
        })
        .collect();
    let indices = earcutr::earcut(&flat, &[], 2).unwrap_or_default();
    let mut triangles: Vec<[usize; 3]> = indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    for t in &mut triangles {
        let [p, q, r] = t.map(|i| points[i]);
        if (q - p).cross(r - p).dot(normal) < 0.0 {
            t.swap(1, 2);
        }
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn all(points: &[DVec3]) -> Vec<[usize; 3]> {
        let mut found = Vec::new();
        triangles(points, |t| found.push(t));
        found
    }

    /// Sum of the triangles' areas, and length of their summed normals: equal if none is turned over or overlaps.
    fn areas(points: &[DVec3]) -> (f64, f64) {
        let normals =
            all(points).into_iter().map(|[a, b, c]| (points[b] - points[a]).cross(points[c] - points[a]) / 2.0);
        let normals: Vec<DVec3> = normals.collect();
        (normals.iter().map(|n| n.length()).sum(), normals.iter().sum::<DVec3>().length())
    }

    fn flat(corners: &[[f64; 2]]) -> Vec<DVec3> {
        corners.iter().map(|[x, y]| DVec3::new(*x, *y, x + 2.0 * y)).collect()
    }

    #[test]
    fn a_concave_polygon_keeps_its_area_and_its_front() {
        // An L of area 3, in a tilted plane.
        let points = flat(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]]);
        let sum: DVec3 =
            all(&points).iter().map(|t| t.map(|i| points[i])).map(|[a, b, c]| (b - a).cross(c - a) / 2.0).sum();
        assert!((sum - DVec3::new(-1.0, -2.0, 1.0) * 3.0).length() < 1e-9, "{sum}");
    }

    /// The last corner stands above an edge: seen along the normal it lies on it.
    #[test]
    fn a_bent_polygon_keeps_all_of_its_corners() {
        let corners = [[-5.0, 0.0, 5.0], [5.0, 0.0, 5.0], [5.0, 0.0, -5.0], [-5.0, 0.0, -5.0], [0.0, 5.0, -5.0]];
        assert_eq!(all(&corners.map(DVec3::from_array)), [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    }

    #[test]
    fn a_dart_is_cut_at_its_notch_wherever_that_is() {
        let dart = [[-1.5, -1.2], [0.0, -0.2], [1.5, -1.2], [0.0, 1.5]];
        for turn in 0..4 {
            let mut corners = dart;
            corners.rotate_left(turn);
            let (area, net) = areas(&flat(&corners));
            assert!((area - net).abs() < 1e-9 && area > 0.0, "{turn}: {area} {net}");
        }
    }

    #[test]
    fn convex_polygons_stay_fans() {
        assert_eq!(all(&flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])), [[0, 1, 2], [0, 2, 3]]);
        let pentagon = flat(&[[0.0, 0.0], [2.0, 0.0], [3.0, 1.0], [1.0, 2.0], [-1.0, 1.0]]);
        assert_eq!(all(&pentagon), [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    }

    proptest! {
        /// A star around the origin, whatever its radii, has the area of its wedges.
        #[test]
        fn stars_keep_their_area(radii in prop::collection::vec(0.1f64..3.0, 5..40), turn in 0usize..40) {
            let step = std::f64::consts::TAU / radii.len() as f64;
            let mut points: Vec<DVec3> = radii
                .iter()
                .enumerate()
                .map(|(i, r)| DVec3::new(r * libm::cos(step * i as f64), r * libm::sin(step * i as f64), 0.0))
                .collect();
            let wedges = (0..points.len()).map(|i| points[i].cross(points[(i + 1) % points.len()]).z / 2.0);
            let expected: f64 = wedges.sum();
            let shift = turn % points.len();
            points.rotate_left(shift);
            let (area, net) = areas(&points);
            prop_assert!((area - expected).abs() < 1e-6 * expected, "{} {}", area, expected);
            prop_assert!((net - expected).abs() < 1e-6 * expected);
        }

        #[test]
        fn any_points_are_taken(points in prop::collection::vec(prop::array::uniform3(-2.0f64..2.0), 0..30)) {
            let points: Vec<DVec3> = points.into_iter().map(DVec3::from_array).collect();
            let found = all(&points);
            prop_assert!(found.len() <= points.len() && found.iter().flatten().all(|i| *i < points.len()));
        }
    }
}
