//! Meshes among the primitives: in the world, or in their own space with instances.

use std::sync::Arc;

use glam::{DAffine3, DMat3, Mat3, Vec2, Vec3, Vec4};

use super::bounds::Bounds;
use super::tag::Tag;
use super::transformed::AffineMap;
use crate::components::MeshData;

/// A mesh that stands in the world.
#[derive(Clone, Debug)]
pub struct BakedMesh {
    pub mesh: Arc<MeshData>,
    /// World positions, where those of the mesh do not serve.
    points: Option<Vec<Vec3>>,
    /// For shading normals; `None` for a flat mesh.
    normals: Option<Mat3>,
    /// Whether the map turns the triangles inside out, so that their corners must be read the other way round.
    mirrored: bool,
    pub tag: Tag,
    /// Number of its first triangle.
    pub first: u32,
}

impl PartialEq for BakedMesh {
    fn eq(&self, other: &Self) -> bool {
        same_mesh(&self.mesh, &other.mesh)
            && (&self.points, self.normals, self.mirrored, self.tag, self.first)
                == (&other.points, other.normals, other.mirrored, other.tag, other.first)
    }
}

fn same_mesh(a: &Arc<MeshData>, b: &Arc<MeshData>) -> bool {
    Arc::ptr_eq(a, b) || a == b
}

impl BakedMesh {
    pub fn new(tag: Tag, mesh: &Arc<MeshData>, smooth: bool, to_world: &DAffine3) -> Self {
        let place = |p: &Vec3| to_world.transform_point3(p.as_dvec3()).as_vec3();
        let points = (*to_world != DAffine3::IDENTITY).then(|| mesh.vertices.iter().map(place).collect());
        let m = to_world.matrix3;
        let mirrored = m.determinant() < 0.0;
        // Normals go by the cofactors; the sign of the determinant keeps the outside outside.
        let cofactors = DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
        // Of any length: scaled so that no square overflows.
        let largest = cofactors.to_cols_array().iter().fold(0.0, |l: f64, x| l.max(x.abs()));
        let normals = cofactors * (m.determinant().signum() / largest);
        let normals = (smooth && !mesh.shading_normals().is_empty()).then(|| normals.as_mat3());
        BakedMesh { mesh: mesh.clone(), points, normals, mirrored, tag, first: 0 }
    }

    #[inline(always)]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        let points = self.points.as_ref().unwrap_or(&self.mesh.vertices);
        let [a, b, c] = self.mesh.triangles[triangle as usize];
        let [a, b, c] = [points[a as usize], points[b as usize], points[c as usize]];
        if self.mirrored { [a, c, b] } else { [a, b, c] }
    }

    /// Texture coordinates of the corners, if the mesh has any.
    pub fn uvs(&self, triangle: u32) -> Option<[Vec2; 3]> {
        let [a, b, c] = corner_uvs(&self.mesh, triangle)?;
        Some(if self.mirrored { [a, c, b] } else { [a, b, c] })
    }

    /// Colour at weights of the second and third corner.
    pub fn color(&self, triangle: u32, u: f32, v: f32) -> Vec4 {
        let (u, v) = if self.mirrored { (v, u) } else { (u, v) };
        mixed_color(&self.mesh, triangle, u, v)
    }

    /// Direction of the shading normal at weights of the second and third corner; any length.
    pub fn shading_normal(&self, triangle: u32, u: f32, v: f32) -> Option<Vec3> {
        let (u, v) = if self.mirrored { (v, u) } else { (u, v) };
        Some(self.normals? * mixed_normal(&self.mesh, triangle, u, v))
    }

    pub fn bounds(&self) -> Bounds {
        Bounds::around(self.points.as_ref().unwrap_or(&self.mesh.vertices))
    }
}

fn corner_uvs(mesh: &MeshData, triangle: u32) -> Option<[Vec2; 3]> {
    let uvs = (!mesh.uvs.is_empty()).then(|| mesh.triangles[triangle as usize].map(|i| mesh.uvs[i as usize]));
    uvs.filter(|uvs| !uvs.contains(&MeshData::NO_UV))
}

/// The colour that the vertices of a triangle give a point of it; white if they have none.
fn mixed_color(mesh: &MeshData, triangle: u32, u: f32, v: f32) -> Vec4 {
    if mesh.colors.is_empty() {
        return Vec4::ONE;
    }
    let [a, b, c] = mesh.triangles[triangle as usize].map(|i| mesh.colors[i as usize]);
    a * (1.0 - u - v) + b * u + c * v
}

fn mixed_normal(mesh: &MeshData, triangle: u32, u: f32, v: f32) -> Vec3 {
    let normals = mesh.shading_normals();
    let [a, b, c] = mesh.triangles[triangle as usize].map(|i| normals[i as usize]);
    a * (1.0 - u - v) + b * u + c * v
}

/// A mesh in its own space.
#[derive(Clone, Debug)]
pub struct MeshPrototype {
    pub mesh: Arc<MeshData>,
    pub smooth: bool,
    pub bounds: Bounds,
}

impl PartialEq for MeshPrototype {
    fn eq(&self, other: &Self) -> bool {
        same_mesh(&self.mesh, &other.mesh) && self.smooth == other.smooth
    }
}

impl MeshPrototype {
    pub fn new(mesh: &Arc<MeshData>, smooth: bool) -> Self {
        let smooth = smooth && !mesh.shading_normals().is_empty();
        MeshPrototype { mesh: mesh.clone(), smooth, bounds: Bounds::around(&mesh.vertices) }
    }

    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.mesh.triangles[triangle as usize].map(|i| self.mesh.vertices[i as usize])
    }

    /// As [`BakedMesh::uvs`].
    pub fn uvs(&self, triangle: u32) -> Option<[Vec2; 3]> {
        corner_uvs(&self.mesh, triangle)
    }

    /// As [`BakedMesh::color`].
    pub fn color(&self, triangle: u32, u: f32, v: f32) -> Vec4 {
        mixed_color(&self.mesh, triangle, u, v)
    }

    /// As [`BakedMesh::shading_normal`], in local space.
    pub fn shading_normal(&self, triangle: u32, u: f32, v: f32) -> Option<Vec3> {
        self.smooth.then(|| mixed_normal(&self.mesh, triangle, u, v))
    }
}

/// A model under an affine map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index of the model.
    pub model: u32,
    pub map: AffineMap,
    /// In the world.
    pub bounds: Bounds,
}

impl Instance {
    pub fn new(index: u32, model: &MeshPrototype, to_world: &DAffine3) -> Self {
        let map = AffineMap::new(to_world);
        Instance { model: index, map, bounds: map.bounds(model.bounds) }
    }
}
