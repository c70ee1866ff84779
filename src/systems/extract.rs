//! World -> columns of primitives for the kernel, in authored order.
//!
//! Shapes go into world space here, in `f64`, and become `f32` last. A shape whose transform keeps it similar stays
//! the analytic shape it is; any other affine map makes it a transformed shape.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec2, Vec3};
use hecs::World;
use rustc_hash::FxHashMap;

use super::hierarchy::Placement;
use super::stage::{AuthoredIndex, Despawned, Stage};
use crate::base::diagnostics::{Diagnostic, Diagnostics, ScenePart, Subject};
use crate::base::{limits, math};
use crate::components::*;
use crate::trace::material::ShadingParams;
use crate::trace::primitive::{Geometry, LocalShape, Sides, Tag};

/// Whether rays meet a surface of this material on both sides.
pub fn shows_both_sides(material: &Material) -> bool {
    material.two_sided || material.is_transparent()
}

/// The kernel's materials: those of the scene by their number, then the default one for entities without a material.
pub fn materials(stage: &Stage) -> Vec<ShadingParams> {
    let of = |e: &hecs::Entity| stage.world.get::<&Material>(*e).map(|m| ShadingParams::from(&*m));
    let default = ShadingParams::from(&Material::default());
    stage.materials.iter().map(|e| of(e).unwrap_or(default)).chain([default]).collect()
}

/// Sees to it that the material of every entity exists.
///
/// # Errors
/// The first entity whose material has no definition, with the nearest name.
pub fn check_materials(stage: &Stage) -> Result<(), Diagnostics> {
    let mut last: Option<Text> = None;
    for (order, material_name) in stage.world.query::<(&AuthoredIndex, &MaterialName)>().iter() {
        if last.as_ref().is_some_and(|known| Arc::ptr_eq(known, &material_name.0)) {
            continue;
        }
        if !stage.material_names.contains_key(&material_name.0) {
            return Err(stage
                .unknown(order.0 as usize, "material", &material_name.0, stage.material_names.keys())
                .into());
        }
        last = Some(material_name.0.clone());
    }
    Ok(())
}

/// Brings the columns up to date, if an edit may have changed them; true if they differ from before.
///
/// # Errors
/// More primitives than the kernel can number; a map that squashes a shape flat.
pub fn update(stage: &mut Stage) -> Result<bool, Diagnostics> {
    if !stage.derived.stale_geometry {
        return Ok(false);
    }
    let geometry = Extraction::new(stage).run()?;
    stage.derived.stale_geometry = false;
    let changed = geometry != *stage.derived.geometry;
    if changed {
        stage.derived.geometry = Arc::new(geometry);
    }
    Ok(changed)
}

/// Squares of squares of what the kernel adds up must stay inside `f32`.
const FARTHEST: f64 = 1e9;

/// Meshes of fewer triangles are split into single ones: their bookkeeping would cost more than they do.
const FEW_TRIANGLES: usize = 16;

struct Extraction<'a> {
    stage: &'a Stage,
    world: &'a World,
    /// Material number and visible sides by material index; the last entry is the default material's.
    sides: Vec<bool>,
    /// How many live entities use each mesh.
    uses: FxHashMap<*const MeshData, u32>,
    geometry: Geometry,
}

/// One shape of one entity with all that places it.
struct PlacedShape<'a, T> {
    order: u32,
    shape: &'a T,
    map: DAffine3,
    material: u32,
    both_sides: bool,
}

impl<T> PlacedShape<'_, T> {
    /// `inside_only` hides the outer side, as a negative radius asks for.
    fn tag(&self, inside_only: bool) -> Tag {
        let sides = match (inside_only, self.both_sides) {
            (true, _) => Sides::Back,
            (false, true) => Sides::Both,
            (false, false) => Sides::Front,
        };
        Tag { entity: self.order, material: self.material, sides }
    }

    fn point(&self, p: DVec3) -> Vec3 {
        self.map.transform_point3(p).as_vec3()
    }

    /// Normals go by the inverse transpose; its sign is that of the determinant, so mirrors keep the outside outside.
    fn normal(&self, n: DVec3) -> Vec3 {
        let m = self.map.matrix3;
        let cofactor =
            glam::DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
        (cofactor * n * m.determinant().signum()).normalize_or_zero().as_vec3()
    }

    fn mirrored(&self) -> bool {
        self.map.matrix3.determinant() < 0.0
    }
}

impl<'a> Extraction<'a> {
    fn new(stage: &'a Stage) -> Self {
        let of = |e: &hecs::Entity| stage.world.get::<&Material>(*e).map(|m| shows_both_sides(&m)).unwrap_or(true);
        let sides = stage.materials.iter().map(of).chain([true]).collect();
        let mut uses = FxHashMap::default();
        for mesh in stage.world.query::<&Mesh>().without::<&Despawned>().iter() {
            *uses.entry(Arc::as_ptr(&mesh.data)).or_default() += 1;
        }
        Extraction { stage, world: &stage.world, sides, uses, geometry: Geometry::default() }
    }

    fn run(mut self) -> Result<Geometry, Diagnostics> {
        self.each::<Sphere>(Self::sphere)?;
        self.each::<Triangle>(Self::triangle)?;
        self.each::<Mesh>(Self::mesh)?;
        self.each::<AABox>(Self::aabox)?;
        self.each::<Cylinder>(|this, placed| {
            let c = placed.shape;
            this.cone(placed, [c.base, c.apex], [c.radius, c.radius], c.capped)
        })?;
        self.each::<Cone>(|this, placed| {
            let c = placed.shape;
            this.cone(placed, [c.base, c.apex], [c.base_radius, c.apex_radius], c.capped)
        })?;
        self.each::<Plane>(|this, placed| {
            let (point, normal) = (placed.point(placed.shape.point), placed.normal(placed.shape.normal));
            this.geometry.push_plane(placed.tag(false), point, normal);
        })?;
        self.geometry.finish();
        Ok(self.geometry)
    }

    /// Calls `push` for every entity with a `T`, in authored order.
    fn each<T: hecs::Component>(&mut self, push: impl Fn(&mut Self, &PlacedShape<T>)) -> Result<(), Diagnostics> {
        let (world, stage) = (self.world, self.stage);
        type Parts<'q, T> = (&'q AuthoredIndex, &'q T, Option<&'q Placement>, Option<&'q MaterialName>);
        let mut query = world.query::<Parts<T>>().without::<&Despawned>();
        let mut found: Vec<_> = query.iter().collect();
        found.sort_by_key(|parts| *parts.0);
        let default_material = (self.sides.len() - 1) as u32;
        let mut last: (Option<&Text>, u32) = (None, default_material);
        for (order, shape, placement, material_name) in found {
            let map = placement.map_or(DAffine3::IDENTITY, |p| p.0);
            if map.matrix3.determinant() == 0.0 || !map.to_cols_array().iter().all(|x| x.abs() <= FARTHEST) {
                let message = format!("{} is scaled to nothing or beyond reach", stage.label(order.0 as usize));
                let part = ScenePart::Entity(order.0 as usize);
                let subject = Subject { part, component: Some(Kind::Transform.name()), field: None };
                return Err(Diagnostic::error(message).about(subject).into());
            }
            let material = match material_name {
                None => default_material,
                Some(name) if last.0.is_some_and(|known| Arc::ptr_eq(known, &name.0)) => last.1,
                Some(name) => stage.material_names.get(&name.0).map_or(default_material, |i| *i as u32),
            };
            last = (material_name.map(|name| &name.0), material);
            let both_sides = self.sides[material as usize];
            push(self, &PlacedShape { order: order.0, shape, map, material, both_sides });
            if self.geometry.len() > limits::TRIANGLES {
                return Err(Diagnostic::error(format!("more than {} primitives", limits::TRIANGLES)).into());
            }
        }
        Ok(())
    }

    fn sphere(&mut self, placed: &PlacedShape<Sphere>) {
        let Sphere { center, radius } = *placed.shape;
        let tag = placed.tag(radius < 0.0);
        match math::uniform_scale(&placed.map) {
            Some(scale) => self.geometry.push_sphere(tag, placed.point(center), (radius.abs() * scale) as f32),
            None => {
                let shape = LocalShape::Sphere { center: center.as_vec3(), radius: radius.abs() as f32 };
                self.geometry.push_transformed(tag, shape, &placed.map);
            }
        }
    }

    fn triangle(&mut self, placed: &PlacedShape<Triangle>) {
        let order = if placed.mirrored() { [0, 2, 1] } else { [0, 1, 2] };
        let corners = order.map(|i| placed.point(placed.shape.vertices[i]));
        let normals = placed.shape.normals.as_ref().map(|n| order.map(|i| placed.normal(n[i])));
        self.geometry.push_triangle(placed.tag(false), corners, normals);
        match &placed.shape.uvs {
            Some(uvs) => self.geometry.texture_triangle(order.map(|i| uvs[i].as_vec2())),
            None if placed.mirrored() => self.geometry.texture_triangle([Vec2::ZERO, Vec2::Y, Vec2::X]),
            None => {}
        }
    }

    fn mesh(&mut self, placed: &PlacedShape<Mesh>) {
        let data = &placed.shape.data;
        let smooth = placed.shape.smooth || !data.normals.is_empty();
        let shared = self.uses.get(&Arc::as_ptr(data)).is_some_and(|uses| *uses > 1);
        if data.triangles.len() < FEW_TRIANGLES {
            self.few_triangles(placed, smooth);
        } else if shared {
            self.geometry.push_instance(placed.tag(false), data, smooth, &placed.map);
        } else {
            self.geometry.push_mesh(placed.tag(false), data, smooth, &placed.map);
        }
    }

    fn few_triangles(&mut self, placed: &PlacedShape<Mesh>, smooth: bool) {
        let data = &placed.shape.data;
        let points: Vec<Vec3> = data.vertices.iter().map(|v| placed.point(v.as_dvec3())).collect();
        let normals = if smooth { data.shading_normals() } else { &[] };
        let normals: Vec<Vec3> = normals.iter().map(|n| placed.normal(n.as_dvec3())).collect();
        let order = if placed.mirrored() { [0, 2, 1] } else { [0, 1, 2] };
        for triangle in &data.triangles {
            let at = order.map(|i| triangle[i] as usize);
            let shading = (!normals.is_empty()).then(|| at.map(|i| normals[i]));
            self.geometry.push_triangle(placed.tag(false), at.map(|i| points[i]), shading);
            if !data.uvs.is_empty() {
                self.geometry.texture_triangle(at.map(|i| data.uvs[i]));
            }
        }
    }

    fn aabox(&mut self, placed: &PlacedShape<AABox>) {
        let AABox { min, max } = *placed.shape;
        let m = placed.map.matrix3;
        let single = |v: DVec3| v.to_array().iter().filter(|x| **x != 0.0).count() == 1;
        if single(m.x_axis) && single(m.y_axis) && single(m.z_axis) {
            // Stretched, mirrored or turned by right angles: still along the world's axes.
            let (a, b) = (placed.point(min), placed.point(max));
            self.geometry.push_box(placed.tag(false), a.min(b), a.max(b));
        } else {
            let shape = LocalShape::Box { min: min.as_vec3(), max: max.as_vec3() };
            self.geometry.push_transformed(placed.tag(false), shape, &placed.map);
        }
    }

    fn cone<T>(&mut self, placed: &PlacedShape<T>, [base, apex]: [DVec3; 2], radii: [f64; 2], capped: bool) {
        let tag = placed.tag(radii[0] < 0.0 || radii[1] < 0.0);
        let radii = radii.map(f64::abs);
        match math::uniform_scale(&placed.map) {
            Some(scale) => {
                let [base_radius, apex_radius] = radii.map(|r| (r * scale) as f32);
                self.geometry.push_cone(tag, placed.point(base), base_radius, placed.point(apex), apex_radius, capped);
            }
            None => {
                let [base_radius, apex_radius] = radii.map(|r| r as f32);
                let (base, apex) = (base.as_vec3(), apex.as_vec3());
                let shape = LocalShape::Cone { base, base_radius, apex, apex_radius, capped };
                self.geometry.push_transformed(tag, shape, &placed.map);
            }
        }
    }
}

/// Authored index of a named entity that is there.
pub fn find(stage: &Stage, name: &str) -> Option<usize> {
    let index = *stage.names.get(name)?;
    stage.live(index).map(|_| index)
}
