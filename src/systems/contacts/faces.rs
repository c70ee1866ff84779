//! Bodies that may touch others, and their flat faces.
//!
//! Of a mesh only those faces count that come near another body: a figure of a hundred thousand triangles on a floor has a
//! few hundred.

use glam::{DAffine3, DVec3};

use super::Contacts;
use crate::base::diagnostics::Diagnostic;
use crate::base::limits;
use crate::components::shapes::world_bounds;
use crate::components::*;
use crate::systems::hierarchy::Placement;
use crate::systems::origin::{relative, render_origin};
use crate::systems::shapes::from_origin_of;
use crate::systems::stage::{MaterialIndex, Stage};

/// Corners of the polygon that stands for the cap of a cone.
const CAP_CORNERS: u32 = 16;
/// How near the bounds of two bodies are whose faces can lie in one plane, as a share of their greatest coordinate: more
/// than what the normals of one plane may differ by makes of it.
const NEAR: f64 = 1e-4;
/// Bodies near a mesh that its faces are compared with one by one.
const NEIGHBOURS: usize = 16;

/// A mesh whose faces are gathered when all bodies are known.
pub(super) struct TouchingMesh {
    body: usize,
    pieces: Pieces,
    map: DAffine3,
}

/// A body that may touch others.
#[derive(Clone, Copy)]
pub(super) struct TouchingBody {
    pub(super) index: usize,
    /// Order of ties among primitives.
    pub(super) order: u8,
    pub(super) transparent: bool,
    /// Whether it has an inside that its faces enclose.
    pub(super) closed: bool,
    pub(super) priority: u32,
    pub(super) min: DVec3,
    pub(super) max: DVec3,
    zone: Zone,
    /// Greatest coordinate of all of it.
    extent: f64,
}

/// A flat face of a body.
pub(super) struct FlatFace {
    pub(super) body: usize,
    /// Unit, outwards.
    pub(super) normal: DVec3,
    /// Convex, in the plane of the face; empty for a whole plane.
    pub(super) outline: Vec<DVec3>,
    /// Any point of it.
    pub(super) point: DVec3,
}

impl FlatFace {
    /// The same normal for both sides of a plane, and the plane's distance from the origin along it.
    pub(super) fn plane(&self) -> (DVec3, f64) {
        let n = self.normal;
        let first = n.to_array().into_iter().find(|x| x.abs() > 1e-6).unwrap_or(1.0);
        let n = if first < 0.0 { -n } else { n };
        (n, n.dot(self.point))
    }
}

/// Where all flat faces of a body lie.
#[derive(Clone, Copy)]
enum Zone {
    /// It has none.
    Nowhere,
    /// Between two corners.
    Box([DVec3; 2]),
    /// On a plane: a unit normal, and the distance from the origin along it.
    Plane(DVec3, f64),
}

impl Zone {
    fn of(shape: &dyn Shape, map: &DAffine3) -> Self {
        world_bounds(shape, map).map_or(Zone::Nowhere, Zone::Box)
    }

    /// Greatest coordinate.
    fn size(&self) -> f64 {
        match self {
            Zone::Nowhere => 0.0,
            Zone::Box([min, max]) => min.abs().max(max.abs()).max_element(),
            Zone::Plane(_, distance) => distance.abs(),
        }
    }

    /// With a box more; of a plane, the plane.
    fn with(self, [min, max]: [DVec3; 2]) -> Self {
        match self {
            Zone::Nowhere => Zone::Box([min, max]),
            Zone::Box([low, high]) => Zone::Box([low.min(min), high.max(max)]),
            Zone::Plane(..) => self,
        }
    }

    /// Whether something between two corners comes within `slack` of it.
    fn meets(&self, [min, max]: [DVec3; 2], slack: f64) -> bool {
        match self {
            Zone::Nowhere => false,
            Zone::Box([low, high]) => (low - slack).cmple(max).all() && (high + slack).cmpge(min).all(),
            Zone::Plane(normal, distance) => {
                let (middle, half) = ((min + max) * 0.5, (max - min) * 0.5);
                (normal.dot(middle) - distance).abs() <= normal.abs().dot(half) + slack
            }
        }
    }
}

/// The zone that holds two others, where a box does.
fn union(a: Zone, b: Zone) -> Option<Zone> {
    match (a, b) {
        (zone, Zone::Nowhere) => Some(zone),
        (Zone::Nowhere | Zone::Box(_), Zone::Box(b)) => Some(a.with(b)),
        _ => None,
    }
}

impl Contacts {
    /// Gathers all bodies and faces of the World as it is placed.
    pub(super) fn gather(&mut self, stage: &Stage) -> Result<(), Diagnostic> {
        self.each::<Sphere>(stage, 0, |this, body, shape, map| {
            let [center, edge] = [shape.center, shape.center + DVec3::X * shape.radius];
            let (center, edge) = (map.transform_point3(center), map.transform_point3(edge));
            this.bodies[body].closed = true;
            this.bodies[body].zone = Zone::Nowhere;
            let reach = DVec3::splat(edge.distance(center));
            (this.bodies[body].min, this.bodies[body].max) = (center - reach, center + reach);
            let [x, y, z] = center.to_array().map(f64::to_bits);
            this.spheres.push(([x, y, z, edge.distance(center).to_bits()], body));
        })?;
        self.each::<Triangle>(stage, 1, |this, body, shape, map| {
            this.face(body, shape.vertices.map(|v| map.transform_point3(v)).to_vec());
        })?;
        self.each::<AABox>(stage, 2, |this, body, shape, map| {
            this.bodies[body].closed = true;
            let corner = |i: usize| DVec3::from_array(std::array::from_fn(|k| [shape.min, shape.max][i >> k & 1][k]));
            let middle = map.transform_point3((shape.min + shape.max) * 0.5);
            for side in [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]] {
                this.outward(body, side.map(|i| map.transform_point3(corner(i))).to_vec(), middle);
            }
        })?;
        self.each::<Cylinder>(stage, 3, |this, body, s, map| {
            this.caps(body, [s.base, s.apex], [s.radius, s.radius], s.capped, map);
        })?;
        self.each::<Cone>(stage, 3, |this, body, s, map| {
            this.caps(body, [s.base, s.apex], [s.base_radius, s.apex_radius], s.capped, map);
        })?;
        self.each::<Mesh>(stage, 4, |this, body, shape, map| {
            let map = from_origin_of(shape, *map);
            this.meshes.push(TouchingMesh { body, pieces: shape.pieces(), map });
        })?;
        self.each::<Plane>(stage, 5, |this, body, shape, map| {
            let normal = (map.matrix3.inverse().transpose() * shape.normal).normalize_or_zero();
            let point = map.transform_point3(shape.point);
            let zone = Zone::Plane(normal, normal.dot(point));
            (this.bodies[body].zone, this.bodies[body].extent) = (zone, point.abs().max_element());
            this.faces.push(FlatFace { body, normal, outline: Vec::new(), point });
        })?;
        self.gather_meshes();
        Ok(())
    }

    /// Adds those faces of meshes that come near other bodies. A mesh that has too many of them has none.
    fn gather_meshes(&mut self) {
        let mut meshes = std::mem::take(&mut self.meshes);
        let count = |mesh: &TouchingMesh| mesh.pieces.iter().map(|piece| piece.data.triangles.len()).sum::<usize>();
        // Those of few faces first: what of them is near something is all that the larger ones are compared with.
        meshes.sort_by_cached_key(count);
        // Where there are too many to compare, every face may be near something.
        let few = meshes.len() * self.bodies.len() <= limits::CONTACT_PAIRS;
        if !few && meshes.iter().map(count).sum::<usize>() > self.most_faces {
            self.is_cut = true;
            return;
        }
        for mesh in meshes {
            let (near, slack) = if few { self.neighbours(mesh.body) } else { (None, 0.0) };
            let mut zone = Zone::Nowhere;
            if near.as_ref().is_some_and(Vec::is_empty) {
                self.bodies[mesh.body].zone = zone;
                continue;
            }
            let before = self.faces.len();
            'mesh: for piece in mesh.pieces.iter() {
                let at = |i: u32| mesh.map.transform_point3(piece.data.vertices[i as usize].as_dvec3());
                for corners in piece.data.triangles.iter().map(|t| t.map(at)) {
                    let bounds =
                        [corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2])];
                    let body = &mut self.bodies[mesh.body];
                    (body.min, body.max) = (body.min.min(bounds[0]), body.max.max(bounds[1]));
                    if near.as_ref().is_none_or(|near| near.iter().any(|zone| zone.meets(bounds, slack))) {
                        self.face(mesh.body, corners.to_vec());
                        zone = zone.with(bounds);
                    }
                    if self.faces.len() > self.most_faces {
                        self.faces.truncate(before);
                        self.is_cut = true;
                        zone = Zone::Nowhere;
                        break 'mesh;
                    }
                }
            }
            self.bodies[mesh.body].zone = zone;
        }
        // As if each had been added where its body was.
        self.faces.sort_by_key(|face| face.body);
    }

    /// Where other bodies come near a mesh, if not anywhere, and how near that is.
    fn neighbours(&self, mesh: usize) -> (Option<Vec<Zone>>, f64) {
        let own = &self.bodies[mesh];
        let Zone::Box(bounds) = own.zone else { return (Some(Vec::new()), 0.0) };
        let slack = |other: &TouchingBody| NEAR * own.extent.max(other.extent);
        let is_near = |other: &&TouchingBody| other.index != own.index && other.zone.meets(bounds, slack(other));
        let near: Vec<&TouchingBody> = self.bodies.iter().filter(is_near).collect();
        let widest = near.iter().map(|other| slack(other)).fold(0.0, f64::max);
        let mut zones: Option<Vec<Zone>> = Some(near.iter().map(|other| other.zone).collect());
        if near.len() > NEIGHBOURS {
            zones = near.iter().try_fold(Zone::Nowhere, |all, other| union(all, other.zone)).map(|all| vec![all]);
        }
        (zones, widest)
    }

    /// Calls with every shape of a kind and the number of its new body.
    fn each<T: hecs::Component + Shape>(
        &mut self,
        stage: &Stage,
        order: u8,
        mut add: impl FnMut(&mut Self, usize, &T, &DAffine3),
    ) -> Result<(), Diagnostic> {
        type Parts<'q, T> =
            (&'q T, Option<&'q Placement>, Option<&'q MaterialIndex>, Option<&'q Skin>, Option<&'q Morph>);
        let origin = render_origin(stage);
        stage.for_each_in_order::<Parts<T>>(|index, (shape, placement, material, skin, morph)| {
            if skin.is_some() || morph.is_some() {
                return Ok(());
            }
            let map = relative(placement, origin);
            let material = material.and_then(|m| stage.world.get::<&Material>(stage.materials[m.0 as usize]).ok());
            let transparent = material.as_ref().is_some_and(|m| m.is_transparent());
            let priority = material.as_ref().map_or(0, |m| m.priority);
            let (min, max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            let zone = Zone::of(shape, &map);
            let (closed, extent) = (false, zone.size());
            self.bodies.push(TouchingBody { index, order, transparent, closed, priority, min, max, zone, extent });
            add(self, self.bodies.len() - 1, shape, &map);
            Ok(())
        })
    }

    /// Adds a face whose corners run counter-clockwise seen from the front.
    fn face(&mut self, body: usize, outline: Vec<DVec3>) {
        let normal = (outline[1] - outline[0]).cross(outline[2] - outline[0]).normalize_or_zero();
        for corner in &outline {
            let body = &mut self.bodies[body];
            (body.min, body.max) = (body.min.min(*corner), body.max.max(*corner));
        }
        if normal != DVec3::ZERO {
            self.faces.push(FlatFace { body, normal, point: outline[0], outline });
        }
    }

    /// Adds a face of a body around `middle`.
    fn outward(&mut self, body: usize, mut outline: Vec<DVec3>, middle: DVec3) {
        let normal = (outline[1] - outline[0]).cross(outline[2] - outline[0]);
        if normal.dot(outline[0] - middle) < 0.0 {
            outline.reverse();
        }
        self.face(body, outline);
    }

    fn caps(&mut self, body: usize, ends: [DVec3; 2], radii: [f64; 2], capped: bool, map: &DAffine3) {
        let axis = (ends[1] - ends[0]).normalize_or_zero();
        if !capped || axis == DVec3::ZERO {
            return;
        }
        self.bodies[body].closed = true;
        let (a, b) = axis.any_orthonormal_pair();
        let middle = map.transform_point3((ends[0] + ends[1]) * 0.5);
        for (end, radius) in ends.into_iter().zip(radii) {
            let corner = |i: u32| {
                let (sin, cos) = libm::sincos(f64::from(i) * std::f64::consts::TAU / f64::from(CAP_CORNERS));
                map.transform_point3(end + (a * cos + b * sin) * radius.abs())
            };
            self.outward(body, (0..CAP_CORNERS).map(corner).collect(), middle);
        }
    }
}
