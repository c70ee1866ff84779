//! Surfaces that touch: which of them comes first.
//!
//! Where two surfaces lie in one plane, rounding would decide from ray to ray which is met first: salt and pepper, and
//! under a glass block rays that leave the block below the floor it stands on. So each contact is given one order before
//! anything is rounded: one of the two is moved by a distance that no picture shows and that every ray can tell.
//!
//! | touching | who moves, where to |
//! |---|---|
//! | two opaque surfaces that face one way | the one behind in the order of ties (kind of primitive, then authored order), back |
//! | glass on something opaque | the glass, off it: there is a thin gap of air, as under a block that lies on a table |
//! | glass in something opaque, their faces flush | the glass, out |
//! | two transparent bodies, face to face | the one of lower priority, or the later one, into the other: no gap of air between them |
//! | two transparent bodies, flush | the same, back |
//!
//! Contacts are found between flat faces (of boxes, caps, triangles, planes and meshes) that overlap, and between equal
//! spheres; meshes that skins and morphs bend are left out. How far something moves follows from its own size and place and
//! what it touches, so that a frame stays a function of its scene; reuse between frames counts a body as changed if it is
//! moved otherwise.

mod faces;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use glam::{DAffine3, DVec2, DVec3};

use self::faces::{FlatFace, TouchingBody, TouchingMesh};
use super::stage::Stage;
use crate::base::{limits, memory};

/// How far a body moves, as a share of its size and of its distance from the origin of the space that is traced: some
/// twenty times what coordinates are rounded by.
const STEP: f64 = 1.5e-5;
/// Planes that differ by less than this, as a share of the same, are one.
const SAME_PLANE: f64 = 4e-7;
/// Memory of one face while contacts are looked for: itself and its outline, in a list that doubles, and its place among
/// those of its plane.
const FACE_BYTES: u64 = 400;
/// Steps that a surface moves at most if it lies behind several others.
const MOST_STEPS: usize = 8;

/// Where bodies are moved, by authored index, as maps of the space that is traced.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactNudges(BTreeMap<usize, DAffine3>);

impl ContactNudges {
    /// The map of an entity, if it is moved.
    pub fn of(&self, index: usize) -> Option<&DAffine3> {
        self.0.get(&index)
    }

    /// Authored indices of entities that are moved otherwise than by `other`.
    pub fn differing<'a>(&'a self, other: &'a ContactNudges) -> impl Iterator<Item = usize> + 'a {
        let all = self.0.keys().chain(other.0.keys()).copied();
        all.filter(|index| self.of(*index) != other.of(*index))
    }
}

/// What a body is to do where it touches another one.
struct Push {
    other: usize,
    at: DVec3,
    direction: DVec3,
    /// Of the larger of the two bodies, its distance from the origin included: both are rounded by its like.
    size: f64,
}

/// Finds all contacts of the World as it is placed, and what follows from them.
pub fn contact_nudges(stage: &Stage) -> ContactNudges {
    nudges_within(stage, limits::CONTACT_FACES, limits::CONTACT_TESTS)
}

/// Bodies that touch others and are not moved as they should be, since there are too many faces to look at all of them
/// whenever a frame is rendered.
#[derive(Debug, PartialEq)]
pub struct ContactsLeftOut {
    /// Authored indices, ascending.
    pub bodies: Vec<usize>,
    /// Where not all faces could be looked at: how many may be, and whether it is memory that leaves room for no more.
    pub cut: Option<(usize, bool)>,
}

/// Finds the bodies that rendering leaves out. The World is to be placed.
pub fn contacts_left_out(stage: &Stage) -> ContactsLeftOut {
    left_out_within(stage, memory::left())
}

fn left_out_within(stage: &Stage, bytes: Option<u64>) -> ContactsLeftOut {
    let room = bytes.map_or(usize::MAX, |bytes| (bytes / FACE_BYTES) as usize);
    // Rendering looks at so many as well.
    let most = room.clamp(limits::CONTACT_FACES, limits::CONTACT_FACES_CHECKED);
    let (all, is_whole) = search(stage, most, limits::CONTACT_TESTS_CHECKED);
    let bodies = contact_nudges(stage).differing(&all).collect();
    ContactsLeftOut { bodies, cut: (!is_whole).then_some((most, most < limits::CONTACT_FACES_CHECKED)) }
}

fn nudges_within(stage: &Stage, most_faces: usize, most_tests: usize) -> ContactNudges {
    search(stage, most_faces, most_tests).0
}

/// What follows from the contacts among at most so many faces, and whether these are all that there are.
fn search(stage: &Stage, most_faces: usize, most_tests: usize) -> (ContactNudges, bool) {
    let mut found = Contacts { most_faces, most_tests, ..Contacts::default() };
    // Nothing fails in what is only looked at.
    let gathered = found.gather(stage);
    if gathered.is_err() || found.faces.len() > most_faces {
        return (ContactNudges::default(), false);
    }
    let is_whole = !found.is_cut;
    found.find_flat();
    found.find_spheres();
    (found.resolve(), is_whole)
}

#[derive(Default)]
struct Contacts {
    /// Faces that are looked at, and pairs of them.
    most_faces: usize,
    most_tests: usize,
    /// Whether a mesh was left out for its faces.
    is_cut: bool,
    bodies: Vec<TouchingBody>,
    faces: Vec<FlatFace>,
    meshes: Vec<TouchingMesh>,
    /// Spheres: center, radius, body.
    spheres: Vec<([u64; 4], usize)>,
    /// By body.
    pushes: BTreeMap<usize, Vec<Push>>,
}

impl Contacts {
    /// Contacts of faces that lie in one plane and overlap.
    fn find_flat(&mut self) {
        let mut planes: BTreeMap<[i64; 3], Vec<(f64, usize)>> = BTreeMap::new();
        for (number, face) in self.faces.iter().enumerate() {
            let (normal, distance) = face.plane();
            // Cells of directions whose middles are where most normals are.
            let cell = normal.to_array().map(|x| (x * 200.0).round() as i64);
            planes.entry(cell).or_default().push((distance, number));
        }
        let mut tests = 0;
        for mut group in planes.into_values().filter(|group| group.len() > 1) {
            group.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let widest = SAME_PLANE * group.iter().map(|(_, face)| self.size(*face)).fold(0.0, f64::max);
            for near in group.chunk_by(|a, b| b.0 - a.0 <= widest) {
                tests = self.find_in_plane(near, tests);
                if tests > self.most_tests {
                    return;
                }
            }
        }
    }

    /// Contacts among faces whose planes are nearly one, by distance from the origin. Faces of one body do not touch each
    /// other: a floor of many triangles costs no more than what stands on it. `tests` were made before; gives how many are
    /// now.
    fn find_in_plane(&mut self, near: &[(f64, usize)], mut tests: usize) -> usize {
        let mut of_bodies: BTreeMap<usize, Vec<(f64, usize)>> = BTreeMap::new();
        for (distance, face) in near {
            of_bodies.entry(self.faces[*face].body).or_default().push((*distance, *face));
        }
        let bodies: Vec<Vec<(f64, usize)>> = of_bodies.into_values().collect();
        for (i, one) in bodies.iter().enumerate() {
            for (first, a) in one {
                for (second, b) in bodies[i + 1..].iter().flatten() {
                    tests += 1;
                    if tests > self.most_tests {
                        return tests;
                    }
                    if (second - first).abs() <= SAME_PLANE * self.size(*a).max(self.size(*b)) {
                        self.touch(*a.min(b), *a.max(b));
                    }
                }
            }
        }
        tests
    }

    /// Size of a face's body, its distance from the origin included.
    fn size(&self, face: usize) -> f64 {
        let (body, point) = (&self.bodies[self.faces[face].body], self.faces[face].point);
        let size = if body.min.x <= body.max.x { body.min.abs().max(body.max.abs()).max_element() } else { 0.0 };
        size.max(point.abs().max_element())
    }

    fn touch(&mut self, a: usize, b: usize) {
        let (one, two) = (&self.faces[a], &self.faces[b]);
        if one.normal.dot(two.normal).abs() < 1.0 - 1e-9 {
            return;
        }
        let [first, second] = [self.bodies[one.body], self.bodies[two.body]];
        if first.index == second.index {
            return;
        }
        let Some((mover, direction)) = moved([&first, &second], [one.normal, two.normal]) else { return };
        let Some(at) = overlap(one, two) else { return };
        let [body, other] = if mover == 0 { [one.body, two.body] } else { [two.body, one.body] };
        let size = self.size(a).max(self.size(b));
        self.pushes.entry(body).or_default().push(Push { other, at, direction, size });
    }

    /// Spheres that are equal: the one behind shrinks.
    fn find_spheres(&mut self) {
        self.spheres.sort_unstable();
        for pair in self.spheres.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            let (other, body) = (pair[0].1, pair[1].1);
            let TouchingBody { min, max, .. } = self.bodies[body];
            let pushes = self.pushes.entry(body).or_default();
            // From both sides, which asks for another size.
            let size = min.abs().max(max.abs()).max_element();
            pushes.push(Push { other, at: max, direction: DVec3::NEG_X, size });
            pushes.push(Push { other, at: min, direction: DVec3::X, size });
        }
    }

    /// The map of every body that is pushed.
    fn resolve(self) -> ContactNudges {
        let mut nudges = BTreeMap::new();
        for (number, mut pushes) in self.pushes {
            let body = &self.bodies[number];
            let same = |a: &Push, b: &Push| a.direction.dot(b.direction) > 0.999;
            // Glass moves one step, whatever it stands on; an opaque surface one for each that lies before it.
            let mut kept: Vec<Push> = Vec::new();
            let mut size = 0.0f64;
            pushes.sort_by_key(|push| push.other);
            for push in pushes {
                size = size.max(push.size).max(push.at.abs().max_element());
                let again = |k: &&Push| same(k, &push) && (body.transparent || k.other == push.other);
                if !kept.iter().any(|k| again(&k)) && kept.len() < MOST_STEPS {
                    kept.push(push);
                }
            }
            if body.min.x <= body.max.x {
                size = size.max(body.min.abs().max(body.max.abs()).max_element());
            }
            nudges.insert(body.index, map_of(body, &kept, STEP * size));
        }
        ContactNudges(nudges)
    }
}

/// The map that brings a body a step along every push: a shift, or another size where pushes are against each other.
fn map_of(body: &TouchingBody, pushes: &[Push], step: f64) -> DAffine3 {
    let shift: DVec3 = pushes.iter().map(|push| push.direction * step).sum();
    let finite = body.min.x <= body.max.x;
    if !finite || pushes.iter().all(|push| shift.dot(push.direction) >= 0.5 * step) {
        return DAffine3::from_translation(shift);
    }
    let middle = (body.min + body.max) * 0.5;
    let growth = |push: &Push| {
        let height = (push.at - middle).dot(push.direction);
        step / if height.abs() > 1e-12 { height } else { f64::INFINITY }
    };
    let growth = pushes.iter().map(growth).fold(0.0, |most: f64, g| if g.abs() > most.abs() { g } else { most });
    let scale = DAffine3::from_scale(DVec3::splat(1.0 + growth.clamp(-0.01, 0.01)));
    DAffine3::from_translation(middle) * scale * DAffine3::from_translation(-middle)
}

/// Which of two bodies whose faces have these normals moves, and in which direction; `None` if it does not matter.
fn moved(bodies: [&TouchingBody; 2], normals: [DVec3; 2]) -> Option<(usize, DVec3)> {
    let along = normals[0].dot(normals[1]) > 0.0;
    let later = usize::from((bodies[0].order, bodies[0].index) < (bodies[1].order, bodies[1].index));
    match [bodies[0].transparent, bodies[1].transparent] {
        [false, false] => {
            // A closed body hides its side of a contact.
            let hidden = !along && bodies.iter().any(|body| body.closed);
            (!hidden).then(|| (later, -normals[1 - later]))
        }
        [true, true] => {
            if !bodies[0].closed || !bodies[1].closed {
                return None;
            }
            let lower = if bodies[0].priority == bodies[1].priority {
                later
            } else {
                usize::from(bodies[1].priority < bodies[0].priority)
            };
            Some((lower, if along { -normals[lower] } else { normals[lower] }))
        }
        [glass, _] => {
            let (glass, solid) = if glass { (0, 1) } else { (1, 0) };
            let direction = match (bodies[glass].closed, bodies[solid].closed) {
                (true, true) if along => normals[glass],
                (true, _) => -normals[glass],
                (false, _) => normals[solid],
            };
            Some((glass, direction))
        }
    }
}

/// A point of where two faces of one plane overlap, if they do by more than a sliver.
fn overlap(a: &FlatFace, b: &FlatFace) -> Option<DVec3> {
    let middle = |face: &FlatFace| face.outline.iter().sum::<DVec3>() / face.outline.len().max(1) as f64;
    match (a.outline.is_empty(), b.outline.is_empty()) {
        (true, true) => return Some(a.point),
        (true, false) => return Some(middle(b)),
        (false, true) => return Some(middle(a)),
        (false, false) => {}
    }
    let (x, y) = a.normal.any_orthonormal_pair();
    let flat = |face: &FlatFace| -> Vec<DVec2> {
        let at = |p: &DVec3| DVec2::new((*p - a.point).dot(x), (*p - a.point).dot(y));
        let mut points: Vec<DVec2> = face.outline.iter().map(at).collect();
        if area(&points) < 0.0 {
            points.reverse();
        }
        points
    };
    let (one, two) = (flat(a), flat(b));
    let mut common = one.clone();
    for (i, from) in two.iter().enumerate() {
        common = clipped(&common, *from, two[(i + 1) % two.len()]);
    }
    let least = 1e-6 * area(&one).min(area(&two));
    let center = common.iter().sum::<DVec2>() / common.len().max(1) as f64;
    (common.len() > 2 && area(&common) > least).then(|| a.point + x * center.x + y * center.y)
}

/// Area of a polygon, positive where it runs counter-clockwise.
fn area(points: &[DVec2]) -> f64 {
    let next = points.iter().cycle().skip(1);
    0.5 * points.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f64>()
}

/// The part of a convex polygon to the left of an edge (Sutherland and Hodgman, CACM 1974).
fn clipped(points: &[DVec2], from: DVec2, to: DVec2) -> Vec<DVec2> {
    let side = |p: DVec2| (to - from).perp_dot(p - from);
    let mut kept = Vec::with_capacity(points.len() + 1);
    for (i, here) in points.iter().enumerate() {
        let there = points[(i + 1) % points.len()];
        let (a, b) = (side(*here), side(there));
        if a >= 0.0 {
            kept.push(*here);
        }
        if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
            kept.push(*here + (there - *here) * (a / (a - b)));
        }
    }
    kept
}
