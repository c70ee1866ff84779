//! Surfaces that a curve leaves behind: turned about an axis, or swept along a path; and boxes with round edges.

use glam::{DVec2, DVec3};

use super::builder::{MeshBuilder, double_area};
use super::outline::faces;
use crate::base::math::sin_cos_degrees;
use crate::components::mesh::MeshData;

/// Turns a profile about the y axis: `x` of its points is the distance from the axis, `y` the height.
///
/// The first column stands at +x, and columns follow counter-clockwise seen from above. A closed profile joins its last
/// point to its first. The solid lies on the side of the axis, whichever way the profile runs. `angle` is in degrees, up to
/// 360.
pub fn lathe(profile: &[DVec2], closed: bool, segments: u32, angle: f64) -> MeshData {
    let mut profile = profile.to_vec();
    if closed {
        profile.extend(profile.first().copied());
    }
    let rises: f64 = profile.windows(2).map(|pair| (pair[1].y - pair[0].y) * (pair[0].x + pair[1].x)).sum();
    if rises < 0.0 {
        profile.reverse();
    }
    let shares = shares(&profile);
    let row = |(point, share): (&DVec2, &f64)| {
        let column = |j: u32| {
            let turn = f64::from(j) / f64::from(segments);
            // The seam is where it started, to the bit.
            let (sin, cos) = sin_cos_degrees(if angle >= 360.0 && j == segments { 0.0 } else { angle * turn });
            (DVec3::new(point.x * cos, point.y, -point.x * sin), DVec2::new(turn, *share))
        };
        (0..=segments).map(column).collect()
    };
    let rows: Vec<Vec<(DVec3, DVec2)>> = profile.iter().zip(&shares).map(row).collect();
    let mut mesh = MeshBuilder::default();
    mesh.grid(&rows, false);
    mesh.finish()
}

/// Shares of the length of a chain of points at which each of them stands.
fn shares(points: &[DVec2]) -> Vec<f64> {
    let mut so_far = vec![0.0];
    for pair in points.windows(2) {
        so_far.push(so_far[so_far.len() - 1] + pair[0].distance(pair[1]));
    }
    let whole = so_far[so_far.len() - 1];
    so_far.into_iter().map(|length| if whole > 0.0 { length / whole } else { 0.0 }).collect()
}

/// Where a profile stands on its way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathFrame {
    /// World or local space, as the mesh is to be.
    pub position: DVec3,
    /// Where `x` of the profile points: to the right of who looks along the path.
    pub across: DVec3,
    /// Where `y` of the profile points.
    pub up: DVec3,
    /// How far along the path it is, 0 to 1.
    pub share: f64,
    /// Size of the profile.
    pub scale: f64,
}

/// Moves a closed profile through frames. A closed path leads from the last frame to the first; an open one gets caps at
/// its ends if they are asked for.
pub fn sweep(profile: &[DVec2], frames: &[PathFrame], closed: bool, caps: bool) -> MeshData {
    let mut profile = profile.to_vec();
    if double_area(&profile) < 0.0 {
        profile.reverse();
    }
    let place =
        |frame: &PathFrame, point: DVec2| frame.position + (frame.across * point.x + frame.up * point.y) * frame.scale;
    let around: Vec<DVec2> = profile.iter().chain(profile.first()).copied().collect();
    let shares = shares(&around);
    let row = |frame: &PathFrame, share: f64| {
        let column = |(point, u): (&DVec2, &f64)| (place(frame, *point), DVec2::new(*u, share));
        around.iter().zip(&shares).map(column).collect()
    };
    let mut rows: Vec<Vec<(DVec3, DVec2)>> = frames.iter().map(|frame| row(frame, frame.share)).collect();
    if let Some(first) = frames.first().filter(|_| closed) {
        rows.push(row(first, 1.0));
    }
    let mut mesh = MeshBuilder::default();
    mesh.grid(&rows, true);
    if let (false, true, [first, .., last]) = (closed, caps, frames) {
        let low = profile.iter().copied().reduce(DVec2::min).unwrap_or_default();
        let size = profile.iter().copied().reduce(DVec2::max).unwrap_or_default() - low;
        let uv = |point: DVec2| (point - low) / size.max(DVec2::splat(f64::MIN_POSITIVE));
        for (frame, is_end) in [(first, false), (last, true)] {
            let corners: Vec<u32> = profile.iter().map(|p| mesh.vertex(place(frame, *p), uv(*p))).collect();
            // Seen along the path the profile runs against the clock: its faces look back.
            for [a, b, c] in faces(std::slice::from_ref(&profile)) {
                let [a, b, c] = [a, b, c].map(|i| corners[i]);
                mesh.triangle(if is_end { [a, c, b] } else { [a, b, c] });
            }
        }
    }
    mesh.finish()
}

/// A box around the origin whose edges and corners are rounded; `radius` is at most half of the smallest side. `segments`
/// divide a quarter of a turn.
pub fn rounded_box(size: DVec3, radius: f64, segments: u32) -> MeshData {
    let half = size / 2.0;
    let radius = radius.clamp(0.0, half.min_element());
    let inner = half - radius;
    let segments = if radius > 0.0 { segments.max(1) } else { 0 };
    // Coordinates along an axis whose directions from the corner of the inner box are evenly spread.
    let steps = |inner: f64, half: f64| -> Vec<f64> {
        if segments == 0 {
            return vec![-half, half];
        }
        let out = |i: u32| {
            let (sin, cos) = sin_cos_degrees(45.0 * f64::from(i) / f64::from(segments));
            inner + radius * sin / cos
        };
        let up: Vec<f64> = (0..=segments).map(out).collect();
        up.iter().rev().map(|x| -x).chain(up.iter().copied()).collect()
    };
    let mut mesh = MeshBuilder::default();
    for (axis, sign) in [0, 1, 2].into_iter().flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (along, upward) = (steps(inner[u], half[u]), steps(inner[v], half[v]));
        let row = |y: &f64| {
            let point = |x: &f64| {
                let mut at = DVec3::ZERO;
                (at[axis], at[u], at[v]) = (sign * half[axis], *x, *y);
                let core = at.clamp(-inner, inner);
                let out = (at - core).normalize_or_zero();
                let placed = if radius > 0.0 { core + out * radius } else { at };
                (placed, DVec2::new(x / size[u] * sign + 0.5, y / size[v] + 0.5))
            };
            along.iter().map(point).collect()
        };
        let rows: Vec<Vec<(DVec3, DVec2)>> = upward.iter().map(row).collect();
        mesh.grid(&rows, sign < 0.0);
    }
    mesh.finish()
}
