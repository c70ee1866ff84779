//! Meshes that follow from a few numbers: turned, swept and extruded shapes, and text.
//!
//! All of them are closed where they can be, face outwards, and have texture coordinates. Normals are left to the
//! component that shows them, which joins faces up to a crease angle.

mod builder;
mod outline;
mod surface;
mod text;

pub use outline::{Outline, extrude};
pub use surface::{PathFrame, lathe, rounded_box, sweep};
pub use text::{TextAlign, TextLayout, text};

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::{DVec2, DVec3};

    use super::*;
    use crate::base::math::sin_cos_degrees;
    use crate::components::mesh::MeshData;

    /// Volume by the divergence theorem, which is positive only for what is closed and faces outwards, and the sum of the
    /// areas' normals, which is zero for what is closed.
    fn volume(data: &MeshData) -> (f64, f64) {
        let points: Vec<DVec3> = data.points().collect();
        let mut sum = (0.0, DVec3::ZERO);
        for [a, b, c] in data.triangles.iter().map(|t| t.map(|i| points[i as usize])) {
            sum.0 += a.dot(b.cross(c)) / 6.0;
            sum.1 += (b - a).cross(c - a) / 2.0;
        }
        (sum.0, sum.1.length())
    }

    #[track_caller]
    fn is_solid(data: &MeshData, expected: f64, tolerance: f64) {
        let (volume, open) = volume(data);
        assert!((volume / expected - 1.0).abs() < tolerance, "{volume} instead of {expected}");
        assert!(open < 1e-3 * expected.max(1.0), "open by {open}");
        assert_eq!(data.uvs.len(), data.vertices.len());
    }

    fn circle(center: DVec2, radius: f64, count: u32) -> Vec<DVec2> {
        let at = |i: u32| {
            let (sin, cos) = sin_cos_degrees(360.0 * f64::from(i) / f64::from(count));
            center + DVec2::new(cos, sin) * radius
        };
        (0..count).map(at).collect()
    }

    #[test]
    fn turned_shapes_have_their_volumes_whichever_way_their_profiles_run() {
        // A ball, and a ring.
        let half: Vec<DVec2> = (0..=64)
            .map(|i| {
                let (sin, cos) = sin_cos_degrees(-90.0 + 180.0 * f64::from(i) / 64.0);
                DVec2::new(cos.max(0.0), sin)
            })
            .collect();
        is_solid(&lathe(&half, false, 128, 360.0), 4.0 / 3.0 * PI, 0.01);
        let reversed: Vec<DVec2> = half.iter().rev().copied().collect();
        is_solid(&lathe(&reversed, false, 128, 360.0), 4.0 / 3.0 * PI, 0.01);
        is_solid(&lathe(&circle(DVec2::new(2.0, 0.0), 0.5, 64), true, 128, 360.0), PI * PI, 0.01);
    }

    #[test]
    fn rounded_boxes_and_swept_shapes_have_their_volumes() {
        let (size, r) = (DVec3::new(2.0, 1.0, 3.0), 0.25);
        let [a, b, c] = (size - 2.0 * r).to_array();
        let edges = PI * r * r * (a + b + c) + 4.0 / 3.0 * PI * r * r * r;
        is_solid(&rounded_box(size, r, 8), a * b * c + 2.0 * r * (a * b + b * c + c * a) + edges, 0.005);
        is_solid(&rounded_box(size, 0.0, 8), 6.0, 1e-6);
        // A straight rod along -x, with a square for a profile that runs with the clock.
        let at = |i: i32| PathFrame {
            position: DVec3::new(-f64::from(i), 0.0, 0.0),
            across: DVec3::NEG_Z,
            up: DVec3::Y,
            share: f64::from(i) / 4.0,
            scale: 1.0,
        };
        let frames: Vec<PathFrame> = (0..=4).map(at).collect();
        let square = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]].map(DVec2::from_array);
        is_solid(&sweep(&square, &frames, false, true), 16.0, 1e-6);
    }

    #[test]
    fn extruded_outlines_keep_their_holes() {
        let square =
            |side: f64| [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|p| DVec2::from_array(p) * side);
        let outlines: Vec<Outline> =
            vec![square(2.0).to_vec(), square(1.0).iter().rev().copied().collect(), square(0.5).to_vec()];
        // 16 - 4 + 1, in any direction.
        is_solid(&extrude(&outlines, 0.5), 6.5, 1e-6);
        let turned: Vec<Outline> = outlines.iter().rev().map(|one| one.iter().rev().copied().collect()).collect();
        is_solid(&extrude(&turned, 0.5), 6.5, 1e-6);
        let (flat, _) = volume(&extrude(&outlines, 0.0));
        assert_eq!(flat, 0.0);
    }

    #[test]
    fn text_stands_where_its_alignment_says() {
        let layout = TextLayout { size: 2.0, depth: 0.3, ..TextLayout::default() };
        let bounds = |data: &MeshData| {
            let points: Vec<DVec3> = data.points().collect();
            let low = points.iter().copied().reduce(DVec3::min).unwrap();
            (low, points.into_iter().reduce(DVec3::max).unwrap())
        };
        let (low, high) = bounds(&text("HH", &layout));
        // Capitals are 0.714 of an em, and stand on the line.
        assert!(low.y.abs() < 1e-6 && (high.y - 1.428).abs() < 1e-3, "{low} {high}");
        assert!(low.x > 0.0 && (low.z + 0.15).abs() < 1e-6 && (high.z - 0.15).abs() < 1e-6);
        let (low, high) = bounds(&text("HH", &TextLayout { align: TextAlign::Center, ..layout }));
        // The sides of a letter differ by a little.
        assert!((low.x + high.x).abs() < 0.1, "{low} {high}");
        let (_, high) = bounds(&text("HH\nH", &TextLayout { align: TextAlign::Right, ..layout }));
        assert!(high.x < 0.0 && high.x > -0.3);
        // The hole of an O is there: its volume is less than that of the disk around it.
        let (o, open) = volume(&text("O", &layout));
        assert!(open < 1e-3 && o > 0.1 && o < 0.3 * 1.5, "{o} {open}");
        assert!(volume(&text("V\u{e9}r\u{ee}t\u{e9} 80%", &layout)).0 > 0.5);
    }
}
