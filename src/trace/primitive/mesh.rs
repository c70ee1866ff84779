//! Meshes that stand in the world: each of their triangles is a primitive.

use std::sync::Arc;

use glam::{DAffine3, DMat3, Mat3, Vec2, Vec3, Vec4};

use super::bounds::Bounds;
use super::closest_hit::ClosestHit;
use super::column::PrimitiveColumn;
use super::interaction::InteractionLanes;
use super::prepared_ray::PreparedRay;
use super::surface::SurfacePoint;
use super::tag::Tag;
use super::terminator::SmoothFacet;
use super::triangle::{AreaTriangle, offer_triangle, on_triangle, patch, wrapped};
use super::uv::{ObjectSpace, SurfaceUv};
use crate::components::MeshData;
use crate::trace::soa::{Hit, Ray};

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
    /// Number of its first triangle among those of all baked meshes.
    first: u32,
}

impl PartialEq for BakedMesh {
    fn eq(&self, other: &Self) -> bool {
        same_mesh(&self.mesh, &other.mesh)
            && (&self.points, self.normals, self.mirrored, self.tag, self.first)
                == (&other.points, other.normals, other.mirrored, other.tag, other.first)
    }
}

pub fn same_mesh(a: &Arc<MeshData>, b: &Arc<MeshData>) -> bool {
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

    /// Texture coordinates of the corners, the first or the second ones, if the mesh has any.
    pub fn uvs(&self, triangle: u32, second: bool) -> Option<[Vec2; 3]> {
        let [a, b, c] = corner_uvs(&self.mesh, triangle, second)?;
        Some(if self.mirrored { [a, c, b] } else { [a, b, c] })
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

pub fn corner_uvs(mesh: &MeshData, triangle: u32, second: bool) -> Option<[Vec2; 3]> {
    let uvs = mesh.uv_set(second);
    let uvs = (!uvs.is_empty()).then(|| mesh.triangles[triangle as usize].map(|i| uvs[i as usize]));
    uvs.filter(|uvs| !uvs.contains(&MeshData::NO_UV))
}

/// The colour that the vertices of a triangle give a point of it; white if they have none.
pub fn mixed_color(mesh: &MeshData, triangle: u32, u: f32, v: f32) -> Vec4 {
    if mesh.colors.is_empty() {
        return Vec4::ONE;
    }
    let [a, b, c] = mesh.triangles[triangle as usize].map(|i| mesh.colors[i as usize]);
    a * (1.0 - u - v) + b * u + c * v
}

pub fn mixed_normal(mesh: &MeshData, triangle: u32, u: f32, v: f32) -> Vec3 {
    let normals = mesh.shading_normals();
    let [a, b, c] = mesh.triangles[triangle as usize].map(|i| normals[i as usize]);
    a * (1.0 - u - v) + b * u + c * v
}

/// The triangles of all meshes that stand in the world, one mesh after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BakedMeshes {
    meshes: Vec<BakedMesh>,
    triangles: usize,
}

impl BakedMeshes {
    pub fn push(&mut self, mesh: BakedMesh) {
        let first = self.triangles as u32;
        self.triangles += mesh.mesh.triangles.len();
        self.meshes.push(BakedMesh { first, ..mesh });
    }

    /// The mesh that a triangle is part of, and its number there.
    #[inline(always)]
    pub fn part(&self, i: usize) -> (&BakedMesh, u32) {
        let i = i as u32;
        let mesh = &self.meshes[self.meshes.partition_point(|mesh| mesh.first <= i) - 1];
        (mesh, i - mesh.first)
    }
}

impl PrimitiveColumn for BakedMeshes {
    const IS_SAMPLED: bool = true;
    type Area = AreaTriangle;

    fn len(&self) -> usize {
        self.triangles
    }

    #[inline]
    fn tag(&self, i: usize) -> Tag {
        self.part(i).0.tag
    }

    fn bounds(&self, i: usize) -> Bounds {
        let (mesh, triangle) = self.part(i);
        Bounds::around(&mesh.corners(triangle))
    }

    fn all_bounds(&self) -> Bounds {
        self.meshes.iter().map(BakedMesh::bounds).fold(Bounds::default(), Bounds::union)
    }

    fn intersect(&self, i: usize, number: u32, ray: &PreparedRay, closest: &mut ClosestHit) {
        let (mesh, triangle) = self.part(i);
        offer_triangle(ray, &mesh.corners(triangle), mesh.tag.sides, number, closest);
    }

    #[inline]
    fn surface_point(&self, i: usize, _: &Ray, _: impl Fn() -> Vec3, hit: &Hit) -> SurfacePoint {
        let (mesh, triangle) = self.part(i);
        let shading = mesh.shading_normal(triangle, hit.u, hit.v);
        on_triangle(&mesh.corners(triangle), hit, shading).of(mesh.tag)
    }

    fn uv(&self, i: usize, hit: &Hit, surface: &SurfacePoint, space: &ObjectSpace) -> SurfaceUv {
        let (mesh, triangle) = self.part(i);
        let uvs = mesh.uvs(triangle, false);
        wrapped(surface, space).filter(|_| uvs.is_none()).unwrap_or_else(|| patch(mesh.corners(triangle), uvs, hit))
    }

    fn second_uv(&self, i: usize, hit: &Hit, _: &SurfacePoint, _: &ObjectSpace) -> Option<SurfaceUv> {
        let (mesh, triangle) = self.part(i);
        mesh.uvs(triangle, true).map(|uvs| patch(mesh.corners(triangle), Some(uvs), hit))
    }

    fn smooth_facet(&self, i: usize, _: &Hit) -> Option<SmoothFacet> {
        let (mesh, triangle) = self.part(i);
        let to_world = mesh.normals?;
        let [a, b, c] =
            mesh.mesh.triangles[triangle as usize].map(|i| to_world * mesh.mesh.shading_normals()[i as usize]);
        let normals = if mesh.mirrored { [a, c, b] } else { [a, b, c] };
        Some(SmoothFacet { corners: mesh.corners(triangle), normals })
    }

    fn vertex_color(&self, i: usize, hit: &Hit) -> Vec4 {
        let (mesh, triangle) = self.part(i);
        let (u, v) = if mesh.mirrored { (hit.v, hit.u) } else { (hit.u, hit.v) };
        mixed_color(&mesh.mesh, triangle, u, v)
    }

    #[inline(always)]
    fn gather(&self, i: usize, [u, v]: [f32; 2], lane: usize, lanes: &mut InteractionLanes) -> bool {
        let (mesh, triangle) = self.part(i);
        lanes.add_triangle(lane, mesh.corners(triangle), mesh.shading_normal(triangle, u, v));
        true
    }

    fn area_shapes(&self, wanted: &dyn Fn(Tag) -> bool, visit: &mut dyn FnMut(usize, u32, Tag, AreaTriangle)) {
        for mesh in self.meshes.iter().filter(|mesh| wanted(mesh.tag)) {
            for triangle in 0..mesh.mesh.triangles.len() as u32 {
                let shape = AreaTriangle::new(mesh.corners(triangle));
                visit((mesh.first + triangle) as usize, 0, mesh.tag, shape);
            }
        }
    }
}
