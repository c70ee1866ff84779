//! Curves through space, walked at constant speed: cubic pieces, their length, and frames that never roll.
//!
//! Every kind of path becomes cubic Bezier pieces. Lengths are Gauss-Legendre sums over parts of a piece; the way back
//! from a length to a place is a search in their table and a few steps of Newton's method. Frames are carried along by
//! double reflection (Wang, Juettler, Zheng and Liu 2008), so that they turn no more than the path itself does.

use glam::{DMat3, DVec3};

use crate::base::limits;

/// How the points of a path become a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveKind {
    /// Through all points, its knots spaced by the square root of their distances: no cusps, no loops of its own.
    CatmullRom,
    /// Through every third point; the two between are handles.
    Bezier,
    /// Near the points, from the first to the last, and smoother than the others.
    BSpline,
    /// Straight from point to point.
    Linear,
}

/// Parts of a piece whose lengths are tabled.
const PARTS: usize = 16;

type CubicPiece = [DVec3; 4];

/// A place on a curve: which piece, and how far through it.
#[derive(Clone, Copy, Debug)]
struct CurveSpot {
    piece: usize,
    u: f64,
}

/// A point of a curve with its axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveFrame {
    pub position: DVec3,
    /// Unit vector onwards.
    pub tangent: DVec3,
    /// Unit vector across, upwards where the path begins.
    pub normal: DVec3,
}

impl CurveFrame {
    /// The third axis: to the right of who looks along the tangent with the normal upwards.
    pub fn binormal(&self) -> DVec3 {
        self.tangent.cross(self.normal)
    }

    /// The rotation that takes -z to the tangent and +y to the normal.
    pub fn matrix(&self) -> DMat3 {
        DMat3::from_cols(self.binormal(), self.normal, -self.tangent)
    }
}

/// A curve with the table of its lengths.
#[derive(Clone, Debug)]
pub struct Curve {
    pieces: Vec<CubicPiece>,
    closed: bool,
    /// Length from the start to the beginning of each part, and the whole at the end.
    lengths: Vec<f64>,
    /// The normal at the beginning of each part, and at the end.
    normals: Vec<DVec3>,
    /// Radians that the carried normal would be off by after one round of a closed curve.
    twist: f64,
}

impl Curve {
    /// A curve of some kind; `up` is where the first normal points as far as the tangent lets it.
    ///
    /// # Errors
    /// Too few or too many points, or points that are all the same.
    pub fn new(kind: CurveKind, points: &[DVec3], closed: bool, up: DVec3) -> Result<Curve, String> {
        if points.len() > limits::PATH_POINTS {
            return Err(format!("a path has at most {} points, not {}", limits::PATH_POINTS, points.len()));
        }
        let pieces = match kind {
            CurveKind::Bezier => bezier(points, closed)?,
            CurveKind::CatmullRom => catmull_rom(&distinct(points, closed), closed)?,
            CurveKind::Linear => linear(&distinct(points, closed), closed)?,
            CurveKind::BSpline => b_spline(&distinct(points, closed), closed)?,
        };
        let mut curve = Curve { pieces, closed, lengths: vec![0.0], normals: Vec::new(), twist: 0.0 };
        let mut length = 0.0;
        for piece in &curve.pieces {
            for part in 0..PARTS {
                length += part_length(piece, part as f64 / PARTS as f64, (part + 1) as f64 / PARTS as f64);
                curve.lengths.push(length);
            }
        }
        if !(length > 0.0 && length.is_finite()) {
            return Err("the points of a path must not all be the same".into());
        }
        curve.carry_normals(up);
        Ok(curve)
    }

    /// How many pieces it is made of, from point to point.
    pub fn pieces(&self) -> usize {
        self.pieces.len()
    }

    /// Whether it leads back to its start.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// World units from end to end, or once around.
    pub fn length(&self) -> f64 {
        self.lengths[self.lengths.len() - 1]
    }

    /// The point at a share of the length. A closed curve goes round; an open one goes straight on beyond its ends.
    pub fn position(&self, share: f64) -> DVec3 {
        let (spot, beyond) = self.spot(share);
        let at = point(&self.pieces[spot.piece], spot.u);
        if beyond == 0.0 { at } else { at + self.tangent_at(spot) * beyond }
    }

    /// Unit vector onwards at a share of the length.
    pub fn tangent(&self, share: f64) -> DVec3 {
        self.tangent_at(self.spot(share).0)
    }

    /// Position and axes at a share of the length.
    pub fn frame(&self, share: f64) -> CurveFrame {
        let (spot, beyond) = self.spot(share);
        let part = (spot.piece * PARTS + ((spot.u * PARTS as f64) as usize).min(PARTS - 1)).min(self.lengths.len() - 2);
        let knot = self.knot(part);
        let tangent = self.tangent_at(spot);
        let at = point(&self.pieces[spot.piece], spot.u);
        let from = (point(&self.pieces[knot.piece], knot.u), self.tangent_at(knot), self.normals[part]);
        let carried = reflect_twice(from, (at, tangent));
        let share = if self.closed { self.length_before(spot) / self.length() } else { 0.0 };
        let normal = turn(carried, tangent, -self.twist * share);
        CurveFrame { position: at + tangent * beyond, tangent, normal }
    }

    /// The place at a share of the length, and how far beyond the end of an open curve it lies.
    fn spot(&self, share: f64) -> (CurveSpot, f64) {
        let whole = self.length();
        let share = if self.closed { share - share.floor() } else { share };
        let wanted = share * whole;
        if wanted <= 0.0 {
            return (CurveSpot { piece: 0, u: 0.0 }, wanted);
        }
        if wanted >= whole {
            return (CurveSpot { piece: self.pieces.len() - 1, u: 1.0 }, wanted - whole);
        }
        let part = self.lengths.partition_point(|length| *length <= wanted).clamp(1, self.lengths.len() - 1) - 1;
        let knot = self.knot(part);
        let piece = &self.pieces[knot.piece];
        let (low, high) = (knot.u, knot.u + 1.0 / PARTS as f64);
        let (start, end) = (self.lengths[part], self.lengths[part + 1]);
        let mut u = low + (high - low) * if end > start { (wanted - start) / (end - start) } else { 0.0 };
        for _ in 0..4 {
            let speed = slope(piece, u).length();
            if speed <= 1e-12 * whole {
                break;
            }
            u = (u - (start + part_length(piece, low, u) - wanted) / speed).clamp(low, high);
        }
        (CurveSpot { piece: knot.piece, u }, 0.0)
    }

    fn knot(&self, part: usize) -> CurveSpot {
        match part / PARTS {
            piece if piece < self.pieces.len() => CurveSpot { piece, u: (part % PARTS) as f64 / PARTS as f64 },
            _ => CurveSpot { piece: self.pieces.len() - 1, u: 1.0 },
        }
    }

    fn length_before(&self, spot: CurveSpot) -> f64 {
        let part = spot.piece * PARTS + ((spot.u * PARTS as f64) as usize).min(PARTS - 1);
        self.lengths[part] + part_length(&self.pieces[spot.piece], self.knot(part).u, spot.u)
    }

    /// Where a piece stands still for a moment, the way that it takes around there.
    fn tangent_at(&self, spot: CurveSpot) -> DVec3 {
        let piece = &self.pieces[spot.piece];
        let reach = piece[0].distance(piece[1]) + piece[1].distance(piece[2]) + piece[2].distance(piece[3]);
        let direct = slope(piece, spot.u);
        if direct.length() > 1e-9 * reach {
            return direct.normalize();
        }
        let near = 1e-3;
        let around = point(piece, (spot.u + near).min(1.0)) - point(piece, (spot.u - near).max(0.0));
        around.try_normalize().or((piece[3] - piece[0]).try_normalize()).unwrap_or(DVec3::NEG_Z)
    }

    fn carry_normals(&mut self, up: DVec3) {
        let at = |curve: &Curve, part: usize| {
            let spot = curve.knot(part);
            (point(&curve.pieces[spot.piece], spot.u), curve.tangent_at(spot))
        };
        let (mut position, mut tangent) = at(self, 0);
        let first = (up - tangent * up.dot(tangent)).try_normalize();
        let mut normal = first.unwrap_or_else(|| tangent.any_orthonormal_vector());
        self.normals.push(normal);
        for part in 1..self.lengths.len() {
            let (next, next_tangent) = at(self, part);
            normal = reflect_twice((position, tangent, normal), (next, next_tangent));
            (position, tangent) = (next, next_tangent);
            self.normals.push(normal);
        }
        if self.closed {
            let first = self.normals[0];
            self.twist = libm::atan2(tangent.cross(first).dot(normal), first.dot(normal));
        }
    }
}

/// Carries a normal from one point of a curve to another: mirrored at the plane between the points, then at the one
/// that brings the tangents together.
fn reflect_twice((from, tangent, normal): (DVec3, DVec3, DVec3), (to, onwards): (DVec3, DVec3)) -> DVec3 {
    let mirror = |v: DVec3, axis: DVec3| {
        let square = axis.length_squared();
        if square > 0.0 { v - axis * (2.0 * axis.dot(v) / square) } else { v }
    };
    let step = to - from;
    let (normal, tangent) = (mirror(normal, step), mirror(tangent, step));
    let carried = mirror(normal, onwards - tangent);
    // Rounding must not add up over thousands of parts.
    (carried - onwards * carried.dot(onwards)).try_normalize().unwrap_or_else(|| onwards.any_orthonormal_vector())
}

/// A vector turned about a unit axis that it stands upright on.
fn turn(v: DVec3, axis: DVec3, radians: f64) -> DVec3 {
    if radians == 0.0 { v } else { v * libm::cos(radians) + axis.cross(v) * libm::sin(radians) }
}

fn point(p: &CubicPiece, u: f64) -> DVec3 {
    let r = 1.0 - u;
    p[0] * (r * r * r) + p[1] * (3.0 * r * r * u) + p[2] * (3.0 * r * u * u) + p[3] * (u * u * u)
}

fn slope(p: &CubicPiece, u: f64) -> DVec3 {
    let r = 1.0 - u;
    (p[1] - p[0]) * (3.0 * r * r) + (p[2] - p[1]) * (6.0 * r * u) + (p[3] - p[2]) * (3.0 * u * u)
}

/// Nodes and weights of the Gauss-Legendre rule of five points.
const GAUSS: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

fn part_length(piece: &CubicPiece, from: f64, to: f64) -> f64 {
    let (middle, half) = ((from + to) / 2.0, (to - from) / 2.0);
    half * GAUSS.iter().map(|(node, weight)| weight * slope(piece, middle + half * node).length()).sum::<f64>()
}

/// The points without those that repeat the one before.
fn distinct(points: &[DVec3], closed: bool) -> Vec<DVec3> {
    let mut out = points.to_vec();
    out.dedup();
    if closed && out.len() > 1 && out.first() == out.last() {
        out.pop();
    }
    out
}

fn at_least(count: usize, least: usize, what: &str) -> Result<(), String> {
    if count >= least { Ok(()) } else { Err(format!("{what} needs at least {least} points, found {count}")) }
}

/// The point with a number of either sign: around a closed list, mirrored at the ends of an open one.
fn neighbour(points: &[DVec3], index: isize, closed: bool) -> DVec3 {
    let count = points.len() as isize;
    if closed {
        return points[index.rem_euclid(count) as usize];
    }
    match index {
        i if i < 0 => points[0] * 2.0 - points[(-i).min(count - 1) as usize],
        i if i >= count => points[(count - 1) as usize] * 2.0 - points[(2 * count - 2 - i).max(0) as usize],
        i => points[i as usize],
    }
}

fn linear(points: &[DVec3], closed: bool) -> Result<Vec<CubicPiece>, String> {
    at_least(points.len(), 2, "a path")?;
    let count = if closed { points.len() } else { points.len() - 1 };
    let piece = |i: usize| {
        let (a, b) = (points[i], points[(i + 1) % points.len()]);
        [a, a + (b - a) / 3.0, a + (b - a) * (2.0 / 3.0), b]
    };
    Ok((0..count).map(piece).collect())
}

fn bezier(points: &[DVec3], closed: bool) -> Result<Vec<CubicPiece>, String> {
    let fits = if closed { points.len().is_multiple_of(3) } else { points.len() % 3 == 1 };
    if points.len() < 3 || !fits || (!closed && points.len() < 4) {
        let rule = if closed { "3, 6, 9, ..." } else { "4, 7, 10, ..." };
        return Err(format!(
            "a Bezier path has {rule} points (a point, two handles, a point, ...), not {}",
            points.len()
        ));
    }
    let piece = |i: usize| [0, 1, 2, 3].map(|k| points[(3 * i + k) % points.len()]);
    Ok((0..points.len() / 3).map(piece).collect())
}

fn catmull_rom(points: &[DVec3], closed: bool) -> Result<Vec<CubicPiece>, String> {
    at_least(points.len(), if closed { 3 } else { 2 }, if closed { "a closed path" } else { "a path" })?;
    let count = if closed { points.len() } else { points.len() - 1 } as isize;
    let piece = |i: isize| {
        let [p0, p1, p2, p3] = [-1, 0, 1, 2].map(|k| neighbour(points, i + k, closed));
        let [a, b, c] = [(p0, p1), (p1, p2), (p2, p3)].map(|(p, q)| p.distance(q).sqrt());
        // The slopes of the non-uniform spline, over the interval of this piece.
        let start = ((p1 - p0) / a - (p2 - p0) / (a + b) + (p2 - p1) / b) * b;
        let end = ((p2 - p1) / b - (p3 - p1) / (b + c) + (p3 - p2) / c) * b;
        [p1, p1 + start / 3.0, p2 - end / 3.0, p2]
    };
    Ok((0..count).map(piece).collect())
}

fn b_spline(points: &[DVec3], closed: bool) -> Result<Vec<CubicPiece>, String> {
    at_least(points.len(), if closed { 3 } else { 2 }, if closed { "a closed path" } else { "a path" })?;
    let count = if closed { points.len() } else { points.len() - 1 } as isize;
    let piece = |i: isize| {
        let [p0, p1, p2, p3] = [-1, 0, 1, 2].map(|k| neighbour(points, i + k, closed));
        [(p0 + p1 * 4.0 + p2) / 6.0, (p1 * 2.0 + p2) / 3.0, (p1 + p2 * 2.0) / 3.0, (p1 + p2 * 4.0 + p3) / 6.0]
    };
    Ok((0..count).map(piece).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const KINDS: [CurveKind; 4] = [CurveKind::CatmullRom, CurveKind::Bezier, CurveKind::BSpline, CurveKind::Linear];

    fn points() -> Vec<DVec3> {
        [
            [0.0, 0.0, 0.0],
            [1.0, 2.0, 0.0],
            [4.0, 2.0, 1.0],
            [4.5, 2.0, 1.0],
            [4.0, -3.0, 2.0],
            [9.0, 0.0, 0.0],
            [9.0, 1.0, 5.0],
        ]
        .map(DVec3::from_array)
        .to_vec()
    }

    #[test]
    fn speed_is_constant_whatever_the_kind() {
        for kind in KINDS {
            for closed in [false, true] {
                let points = if closed { &points()[..6] } else { &points()[..] };
                let curve = Curve::new(kind, points, closed, DVec3::Y).unwrap();
                let n = 20_000;
                let step = curve.length() / f64::from(n);
                let mut longest = 0.0f64;
                let mut total = 0.0;
                for i in 0..n {
                    let at = |i: i32| curve.position(f64::from(i) / f64::from(n));
                    let went = at(i).distance(at(i + 1));
                    longest = longest.max(went / step);
                    total += went;
                    // Corners of straight paths are cut by chords; everywhere else a chord is all but the arc.
                    assert!(
                        went / step > 0.99 || kind == CurveKind::Linear || kind == CurveKind::Bezier,
                        "{kind:?} {i}"
                    );
                }
                assert!(longest < 1.0 + 1e-6, "{kind:?} {closed} {longest}");
                assert!((total / curve.length() - 1.0).abs() < 1e-4, "{kind:?} {closed}");
            }
        }
    }

    #[test]
    fn paths_run_through_their_points() {
        let points = points();
        for kind in [CurveKind::CatmullRom, CurveKind::Linear] {
            let curve = Curve::new(kind, &points, false, DVec3::Y).unwrap();
            for p in &points {
                let near = (0..=8_000).map(|i| curve.position(f64::from(i) / 8_000.0).distance(*p)).fold(9.0, f64::min);
                assert!(near < 2e-3, "{kind:?} misses {p} by {near}");
            }
        }
        for kind in KINDS {
            let curve = Curve::new(kind, &points, false, DVec3::Y).unwrap();
            assert!(curve.position(0.0).distance(points[0]) < 1e-12, "{kind:?}");
            assert!(curve.position(1.0).distance(points[6]) < 1e-12, "{kind:?}");
        }
    }

    #[test]
    fn a_circle_of_bezier_pieces_has_its_length() {
        let k = 4.0 / 3.0 * (2f64.sqrt() - 1.0);
        let circle: Vec<DVec3> = [
            [1.0, 0.0],
            [1.0, k],
            [k, 1.0],
            [0.0, 1.0],
            [-k, 1.0],
            [-1.0, k],
            [-1.0, 0.0],
            [-1.0, -k],
            [-k, -1.0],
            [0.0, -1.0],
            [k, -1.0],
            [1.0, -k],
        ]
        .map(|[x, y]| DVec3::new(x, y, 0.0))
        .to_vec();
        let curve = Curve::new(CurveKind::Bezier, &circle, true, DVec3::Z).unwrap();
        // The classic four-piece circle is 2.7e-4 off at most.
        assert!((curve.length() - std::f64::consts::TAU).abs() < 2e-3);
        let eighth = curve.position(0.125);
        assert!(eighth.distance(DVec3::new(0.5f64.sqrt(), 0.5f64.sqrt(), 0.0)) < 1e-3, "{eighth}");
        assert!(curve.position(1.25).distance(curve.position(0.25)) < 1e-12);
    }

    #[test]
    fn an_open_path_goes_straight_on_beyond_its_ends() {
        let curve = Curve::new(CurveKind::CatmullRom, &points(), false, DVec3::Y).unwrap();
        let (end, onwards) = (curve.position(1.0), curve.tangent(1.0));
        assert!(curve.position(1.1).distance(end + onwards * 0.1 * curve.length()) < 1e-9);
        let (start, first) = (curve.position(0.0), curve.tangent(0.0));
        assert!(curve.position(-0.1).distance(start - first * 0.1 * curve.length()) < 1e-9);
    }

    /// A loop over the top: a frame from a fixed `up` would flip there.
    #[test]
    fn frames_do_not_flip() {
        let hoop: Vec<DVec3> = (0..16)
            .map(|i| {
                let (sin, cos) = crate::base::math::sin_cos_degrees(f64::from(i) * 22.5);
                DVec3::new(0.05 * f64::from(i), 3.0 * sin, 3.0 * cos)
            })
            .collect();
        for closed in [false, true] {
            let curve = Curve::new(CurveKind::CatmullRom, &hoop, closed, DVec3::Y).unwrap();
            let mut before = curve.frame(0.0);
            for i in 1..=4_000 {
                let frame = curve.frame(f64::from(i) / 4_000.0);
                assert!(frame.normal.dot(before.normal) > 0.99 && frame.tangent.dot(before.tangent) > 0.99, "{i}");
                assert!(frame.normal.dot(frame.tangent).abs() < 1e-9 && (frame.normal.length() - 1.0).abs() < 1e-9);
                before = frame;
            }
            if closed {
                assert!(before.normal.dot(curve.frame(0.0).normal) > 0.999_999);
            }
        }
    }

    #[test]
    fn impossible_paths_are_explained() {
        let said = |kind, points: &[DVec3], closed| Curve::new(kind, points, closed, DVec3::Y).unwrap_err();
        assert!(said(CurveKind::CatmullRom, &[DVec3::X], false).contains("at least 2"));
        assert!(said(CurveKind::CatmullRom, &[DVec3::X, DVec3::X, DVec3::X], false).contains("at least 2"));
        assert!(said(CurveKind::Bezier, &points()[..5], false).contains("4, 7, 10"));
        assert!(said(CurveKind::Bezier, &[DVec3::X; 4], false).contains("all be the same"));
        assert!(said(CurveKind::BSpline, &points()[..2], true).contains("at least 3"));
    }
}
