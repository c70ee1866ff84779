//! Shapes -> primitives: one implementation for each shape.

use glam::{DAffine3, DVec3, Vec2, Vec3};

use super::deform::Deformed;
use super::extract::{ExtractShape, Extraction, ShapePlacement};
use super::origin::moved;
use crate::base::math;
use crate::components::*;
use crate::trace::primitive::{BoxPrim, ConeFrustum, LocalShape, SpherePrim};

/// Meshes of fewer triangles are split into single ones: their bookkeeping would cost more than they do.
const FEW_TRIANGLES: usize = 16;

impl ExtractShape for Sphere {
    fn extract(&self, placed: &ShapePlacement, out: &mut Extraction) {
        let Sphere { center, radius } = *self;
        // A transparent sphere of negative radius is a bubble; another one is its inside alone.
        let is_bubble = radius < 0.0 && out.is_transparent(placed);
        let tag = placed.tag(radius < 0.0 && !is_bubble);
        let radius = if is_bubble { radius } else { radius.abs() };
        match math::uniform_scale(&placed.map) {
            Some(scale) => out.geometry.push_sphere(tag, placed.point(center), (radius * scale) as f32),
            None => {
                let shape = LocalShape::Sphere(SpherePrim { center: center.as_vec3(), radius: radius as f32 });
                out.geometry.push_transformed(tag, shape, &placed.map);
            }
        }
    }
}

/// A mirrored triangle runs the other way round, so that its front stays its front.
fn winding(placed: &ShapePlacement) -> [usize; 3] {
    if placed.is_mirrored() { [0, 2, 1] } else { [0, 1, 2] }
}

impl ExtractShape for Triangle {
    const CAN_BE_FLAT: bool = true;

    fn extract(&self, placed: &ShapePlacement, out: &mut Extraction) {
        let (order, placed) = (winding(placed), placed.enclosing(false));
        let corners = order.map(|i| placed.point(self.vertices[i]));
        let normals = self.normals.as_ref().map(|n| order.map(|i| placed.normal(n[i])));
        out.geometry.push_triangle(placed.tag(false), corners, normals);
        match &self.uvs {
            Some(uvs) => out.geometry.texture_triangle(order.map(|i| uvs[i].as_vec2())),
            None if placed.is_mirrored() => out.geometry.texture_triangle([Vec2::ZERO, Vec2::Y, Vec2::X]),
            None => {}
        }
    }
}

impl ExtractShape for Plane {
    fn extract(&self, placed: &ShapePlacement, out: &mut Extraction) {
        let normal = placed.normal(self.normal);
        let mut point = placed.map.transform_point3(self.point);
        if out.origin != DVec3::ZERO {
            // The nearest point of the plane: what is far along it would be lost in rounding.
            let exact = placed.exact_normal(self.normal);
            point = exact * exact.dot(point);
        }
        let point = point.as_vec3();
        // A plane is no window into a half of the world that is filled with glass.
        let placed = placed.enclosing(false);
        out.geometry.push_plane(placed.tag(false), point, normal);
    }
}

impl ExtractShape for AABox {
    fn extract(&self, placed: &ShapePlacement, out: &mut Extraction) {
        let AABox { min, max } = *self;
        let m = placed.map.matrix3;
        let single = |v: DVec3| v.to_array().iter().filter(|x| **x != 0.0).count() == 1;
        if single(m.x_axis) && single(m.y_axis) && single(m.z_axis) {
            // Stretched, mirrored or turned by right angles: still along the world's axes.
            let (a, b) = (placed.point(min), placed.point(max));
            out.geometry.push_box(placed.tag(false), a.min(b), a.max(b));
        } else {
            let shape = LocalShape::Box(BoxPrim { min: min.as_vec3(), max: max.as_vec3() });
            out.geometry.push_transformed(placed.tag(false), shape, &placed.map);
        }
    }
}

impl ExtractShape for Cylinder {
    fn extract(&self, placed: &ShapePlacement, out: &mut Extraction) {
        frustum(placed, [self.base, self.apex], [self.radius, self.radius], self.capped, out);
    }
}

impl ExtractShape for Cone {
    fn extract(&self, placed: &ShapePlacement, out: &mut Extraction) {
        frustum(placed, [self.base, self.apex], [self.base_radius, self.apex_radius], self.capped, out);
    }
}

/// The frustum of a cone between two points, with its radii there.
fn frustum(placed: &ShapePlacement, [base, apex]: [DVec3; 2], radii: [f64; 2], capped: bool, out: &mut Extraction) {
    let tag = placed.enclosing(capped).tag(radii[0] < 0.0 || radii[1] < 0.0);
    let radii = radii.map(f64::abs);
    match math::uniform_scale(&placed.map) {
        Some(scale) => {
            let [base_radius, apex_radius] = radii.map(|r| (r * scale) as f32);
            out.geometry.push_cone(tag, placed.point(base), base_radius, placed.point(apex), apex_radius, capped);
        }
        None => {
            let [base_radius, apex_radius] = radii.map(|r| r as f32);
            let (base, apex) = (base.as_vec3(), apex.as_vec3());
            let shape = LocalShape::Cone(ConeFrustum::new(base, base_radius, apex, apex_radius, capped));
            out.geometry.push_transformed(tag, shape, &placed.map);
        }
    }
}

impl ExtractShape for Mesh {
    const CAN_BE_FLAT: bool = true;

    fn bent<'a>(&'a self, bent: Option<&'a Deformed>) -> (&'a Self, bool) {
        bent.map_or((self, false), |bent| (&bent.mesh, bent.in_world))
    }

    fn extract(&self, placed: &ShapePlacement, out: &mut Extraction) {
        let placed = placed.under(from_origin_of(self, placed.map));
        for piece in self.pieces().iter() {
            let placed = out.placement_of(piece, &placed);
            let Piece { data, smooth, .. } = piece;
            let is_plain = data.colors.is_empty() && data.second_uvs.is_empty();
            // Only of bodies that light goes through it matters.
            let is_closed = !placed.is_flat() && out.is_transparent(&placed) && data.encloses();
            let placed = placed.enclosing(is_closed);
            if placed.is_flat() {
                out.geometry.push_mesh(placed.tag(false), data, false, &placed.map);
            } else if data.triangles.len() < FEW_TRIANGLES && is_plain {
                single_triangles(data, &placed, *smooth, out);
            } else if out.is_shared(data) {
                out.geometry.push_instance(placed.tag(false), data, *smooth, &placed.map);
            } else {
                out.geometry.push_mesh(placed.tag(false), data, *smooth, &placed.map);
            }
        }
    }
}

/// The map of a mesh for its points, which count from its own origin.
pub(super) fn from_origin_of(mesh: &Mesh, map: DAffine3) -> DAffine3 {
    let origin = mesh.data.origin;
    let by = if origin == DVec3::ZERO { DVec3::ZERO } else { map.transform_vector3(origin) };
    moved(map, by)
}

fn single_triangles(data: &MeshData, placed: &ShapePlacement, smooth: bool, out: &mut Extraction) {
    let points: Vec<Vec3> = data.vertices.iter().map(|v| placed.point(v.as_dvec3())).collect();
    let normals = if smooth { data.shading_normals() } else { &[] };
    let normals: Vec<Vec3> = normals.iter().map(|n| placed.normal(n.as_dvec3())).collect();
    let order = winding(placed);
    for triangle in &data.triangles {
        let at = order.map(|i| triangle[i] as usize);
        let shading = (!normals.is_empty()).then(|| at.map(|i| normals[i]));
        out.geometry.push_triangle(placed.tag(false), at.map(|i| points[i]), shading);
        let uvs = at.map(|i| data.uvs.get(i).copied().unwrap_or(MeshData::NO_UV));
        if !uvs.contains(&MeshData::NO_UV) {
            out.geometry.texture_triangle(uvs);
        }
    }
}
