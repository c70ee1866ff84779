//! Flat outlines with holes, as faces and as bodies.

use glam::{DVec2, DVec3};

use super::builder::{MeshBuilder, double_area};
use crate::components::mesh::MeshData;

/// A closed polygon; its last point joins the first.
pub type Outline = Vec<DVec2>;

/// A body with these outlines for its front and back: from -depth / 2 to depth / 2 along z, the front towards +z. What lies
/// in an odd number of outlines is filled, whichever way they run. Without depth it is the front alone.
pub fn extrude(outlines: &[Outline], depth: f64) -> MeshData {
    let mut outlines: Vec<Outline> = outlines.iter().filter(|one| one.len() >= 3).cloned().collect();
    let depths: Vec<usize> = (0..outlines.len()).map(|i| nesting(&outlines, i)).collect();
    for (outline, depth) in outlines.iter_mut().zip(&depths) {
        // Bodies run against the clock, holes with it.
        if (double_area(outline) < 0.0) == (depth % 2 == 0) {
            outline.reverse();
        }
    }
    let all = || outlines.iter().flatten().copied();
    let low = all().reduce(DVec2::min).unwrap_or_default();
    let size = (all().reduce(DVec2::max).unwrap_or_default() - low).max(DVec2::splat(f64::MIN_POSITIVE));
    let mut mesh = MeshBuilder::default();
    let sides: &[f64] = if depth > 0.0 { &[0.5, -0.5] } else { &[0.0] };
    for (i, nested) in depths.iter().enumerate().filter(|(_, nested)| *nested % 2 == 0) {
        let is_hole = |j: &usize| depths[*j] == nested + 1 && contains(&outlines[i], outlines[*j][0]);
        let group: Vec<Outline> =
            [i].into_iter().chain((0..outlines.len()).filter(is_hole)).map(|j| outlines[j].clone()).collect();
        let triangles = faces(&group);
        for side in sides {
            let point = |p: &DVec2| (p.extend(side * depth), (*p - low) / size);
            let corners: Vec<u32> = group
                .iter()
                .flatten()
                .map(|p| {
                    let (at, uv) = point(p);
                    mesh.vertex(at, uv)
                })
                .collect();
            for [a, b, c] in triangles.iter().map(|t| t.map(|i| corners[i])) {
                mesh.triangle(if *side < 0.0 { [a, c, b] } else { [a, b, c] });
            }
        }
        if depth > 0.0 {
            group.iter().for_each(|outline| wall(&mut mesh, outline, depth));
        }
    }
    mesh.finish()
}

/// The side of a body below one of its outlines.
fn wall(mesh: &mut MeshBuilder, outline: &Outline, depth: f64) {
    let around: Vec<DVec2> = outline.iter().chain(outline.first()).copied().collect();
    let whole: f64 = around.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    let mut so_far = 0.0;
    let mut before = around[0];
    let mut shares = Vec::with_capacity(around.len());
    for point in &around {
        so_far += before.distance(*point);
        before = *point;
        shares.push(so_far / whole.max(f64::MIN_POSITIVE));
    }
    let row = |side: f64| {
        let column = |(point, share): (&DVec2, &f64)| {
            let at: DVec3 = point.extend(side * depth);
            (at, DVec2::new(*share, side + 0.5))
        };
        around.iter().zip(&shares).map(column).collect()
    };
    mesh.grid(&[row(-0.5), row(0.5)], false);
}

/// How many of the other outlines hold this one.
fn nesting(outlines: &[Outline], index: usize) -> usize {
    let Some(point) = outlines[index].first() else { return 0 };
    let others = outlines.iter().enumerate().filter(|(i, _)| *i != index);
    others.filter(|(_, other)| contains(other, *point)).count()
}

/// Whether a point lies inside of an outline: a ray to the right crosses it an odd number of times.
fn contains(outline: &Outline, point: DVec2) -> bool {
    let next = outline.iter().cycle().skip(1);
    let crosses = |(a, b): (&DVec2, &DVec2)| {
        (a.y > point.y) != (b.y > point.y) && point.x < a.x + (b.x - a.x) * ((point.y - a.y) / (b.y - a.y))
    };
    outline.iter().zip(next).filter(|pair| crosses(*pair)).count() % 2 == 1
}

/// Triangles of an outline, the first, with holes, the others: corners by their place in all of them together, against
/// the clock.
pub(super) fn faces(group: &[Outline]) -> Vec<[usize; 3]> {
    let flat: Vec<f64> = group.iter().flatten().flat_map(|p| p.to_array()).collect();
    let points: Vec<DVec2> = group.iter().flatten().copied().collect();
    let mut holes = Vec::new();
    let mut count = 0;
    for outline in group {
        if count > 0 {
            holes.push(count);
        }
        count += outline.len();
    }
    let indices = earcutr::earcut(&flat, &holes, 2).unwrap_or_default();
    let mut triangles: Vec<[usize; 3]> = indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    for t in &mut triangles {
        let [a, b, c] = t.map(|i| points[i]);
        if (b - a).perp_dot(c - a) < 0.0 {
            t.swap(1, 2);
        }
    }
    triangles
}
