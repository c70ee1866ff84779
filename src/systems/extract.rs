//! World -> columns of primitives for the kernel, in authored order.
//!
//! Shapes go into the space that is traced here, in `f64`, and become `f32` last. A shape whose transform keeps it similar stays
//! the analytic shape it is; any other affine map makes it a transformed shape. What each shape becomes stands in
//! [`super::shapes`].

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use rustc_hash::FxHashMap;

use super::contacts::{ContactNudges, contact_nudges};
use super::deform::{self, Deformed};
use super::hierarchy::Placement;
use super::origin::{relative, render_origin};
use super::stage::{AuthoredIndex, Despawned, MaterialIndex, Stage};
use crate::base::diagnostics::{Diagnostic, Diagnostics, ScenePart, Subject};
use crate::base::limits;
use crate::components::entity::every_kind;
use crate::components::*;
use crate::trace::material::ShadingParams;
use crate::trace::primitive::{Geometry, Sides, Tag};

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

/// The columns of the World as it stands; the same ones as before if they are equal.
///
/// # Errors
/// More primitives than the kernel can number; a map that squashes a shape flat.
pub fn update(stage: &mut Stage) -> Result<Arc<Geometry>, Diagnostics> {
    let key = stage.geometry_key();
    if let Some((_, geometry)) = stage.derived.geometry.as_ref().filter(|(known, _)| *known == key) {
        return Ok(geometry.clone());
    }
    deform::update(stage)?;
    let before = stage.derived.geometry.as_ref().map(|(_, geometry)| geometry);
    let extracted = Extraction::new(stage).run()?;
    let geometry = match before {
        Some(before) if **before == extracted => before.clone(),
        _ => Arc::new(extracted),
    };
    stage.derived.geometry = Some((key, geometry.clone()));
    Ok(geometry)
}

/// Squares of squares of what the kernel adds up must stay inside `f32`.
const FARTHEST: f64 = 1e9;

/// The columns while they are filled.
pub(super) struct Extraction<'a> {
    stage: &'a Stage,
    /// World space; the columns are filled relative to it.
    pub(super) origin: DVec3,
    /// Whether each material shows both sides; the last entry is the default material's.
    sides: Vec<bool>,
    /// Whether light goes through, by material index; as `sides`.
    transparent: Vec<bool>,
    /// Each piece of a mesh, held until it is in the columns, and how many live entities use it.
    uses: FxHashMap<*const MeshData, (Arc<MeshData>, u32)>,
    /// How surfaces that touch are set apart.
    nudges: ContactNudges,
    pub(super) geometry: Geometry,
}

/// Where a shape stands, and what goes with it into its primitives.
#[derive(Clone, Copy)]
pub(super) struct ShapePlacement {
    entity: u32,
    /// From the shape's local space to the one that is traced.
    pub(super) map: DAffine3,
    material: u32,
    both_sides: bool,
    /// Whether the shape encloses an inside.
    closed: bool,
}

/// A component that is a shape, as primitives of the kernel.
pub(super) trait ExtractShape: hecs::Component {
    /// Whether anything is left of it under a map that squashes it flat.
    const CAN_BE_FLAT: bool = false;

    /// The shape as it is bent, and whether it then stands in the space that is traced.
    fn bent<'a>(&'a self, bent: Option<&'a Deformed>) -> (&'a Self, bool) {
        let _ = bent;
        (self, false)
    }

    /// Adds the primitives of the shape to the columns.
    fn extract(&self, placed: &ShapePlacement, out: &mut Extraction);
}

impl ShapePlacement {
    /// `inside_only` hides the outer side, as a negative radius asks for.
    pub(super) fn tag(&self, inside_only: bool) -> Tag {
        let sides = match (inside_only, self.both_sides) {
            (true, _) => Sides::Back,
            (false, true) => Sides::Both,
            (false, false) => Sides::Front,
        };
        Tag { entity: self.entity, material: self.material, sides, closed: self.closed }
    }

    /// The same of a shape that encloses an inside, or does not.
    pub(super) fn enclosing(self, closed: bool) -> ShapePlacement {
        ShapePlacement { closed, ..self }
    }

    /// What goes with it, under another map.
    pub(super) fn under(&self, map: DAffine3) -> ShapePlacement {
        ShapePlacement { map, ..*self }
    }

    pub(super) fn point(&self, p: DVec3) -> Vec3 {
        self.map.transform_point3(p).as_vec3()
    }

    /// Normals go by the inverse transpose; its sign is that of the determinant, so mirrors keep the outside outside.
    pub(super) fn normal(&self, n: DVec3) -> Vec3 {
        self.exact_normal(n).as_vec3()
    }

    pub(super) fn exact_normal(&self, n: DVec3) -> DVec3 {
        let m = self.map.matrix3;
        let cofactor =
            glam::DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
        (cofactor * n * m.determinant().signum()).normalize_or_zero()
    }

    /// Whether the map squashes everything flat: there is no way back then, and no normal but that of the plane.
    pub(super) fn is_flat(&self) -> bool {
        self.map.matrix3.determinant() == 0.0
    }

    pub(super) fn is_mirrored(&self) -> bool {
        self.map.matrix3.determinant() < 0.0
    }
}

/// Extracts the shapes of every kind, in the order of the list of kinds.
macro_rules! extract_shapes {
    ($this:ident; $($name:ident : $variant:ident is $role:ident),* $(,)?) => { $( extract_shapes!(@$role $this $variant); )* };
    (@Shape $this:ident $shape:ident) => { $this.each::<$shape>()?; };
    (@$role:ident $this:ident $shape:ident) => {};
}

/// Calls `$this.check::<T>()?` for every kind that is a shape.
macro_rules! check_shapes {
    ($this:ident; $($name:ident : $variant:ident is $role:ident),* $(,)?) => { $( check_shapes!(@$role $this $variant); )* };
    (@Shape $this:ident $shape:ident) => { check_placements_of::<$shape>($this)?; };
    (@$role:ident $this:ident $shape:ident) => {};
}

/// Sees to it that every shape can be traced where it stands, as [`update`] does when its columns are made.
///
/// # Errors
/// The first shape of a kind that is scaled flat and must not be, or that stands beyond reach.
pub fn check_placements(stage: &Stage) -> Result<(), Diagnostics> {
    every_kind!(check_shapes stage);
    Ok(())
}

fn check_placements_of<T: ExtractShape>(stage: &Stage) -> Result<(), Diagnostic> {
    let origin = render_origin(stage);
    let mut wrong: Option<(AuthoredIndex, Diagnostic)> = None;
    // In no order: of several the first is told.
    let mut query =
        stage.world.query::<(&AuthoredIndex, &T, Option<&Deformed>, Option<&Placement>)>().without::<&Despawned>();
    for (order, shape, bent, placement) in query.iter() {
        let map = if shape.bent(bent).1 { DAffine3::IDENTITY } else { relative(placement, origin) };
        if let Err(problem) = shows(stage, order.0 as usize, &map, T::CAN_BE_FLAT)
            && wrong.as_ref().is_none_or(|(first, _)| order < first)
        {
            wrong = Some((*order, problem));
        }
    }
    wrong.map_or(Ok(()), |(_, problem)| Err(problem))
}

impl<'a> Extraction<'a> {
    fn new(stage: &'a Stage) -> Self {
        let of = |e: &hecs::Entity| stage.world.get::<&Material>(*e).map(|m| shows_both_sides(&m)).unwrap_or(true);
        let sides = stage.materials.iter().map(of).chain([true]).collect();
        let lets_through = |e: &hecs::Entity| stage.world.get::<&Material>(*e).is_ok_and(|m| m.is_transparent());
        let transparent = stage.materials.iter().map(lets_through).chain([false]).collect();
        let mut uses: FxHashMap<_, (Arc<MeshData>, u32)> = FxHashMap::default();
        let mut own = stage.world.query::<(&Mesh, Option<&Deformed>)>().without::<&Despawned>();
        for (mesh, _) in own.iter().filter(|(_, bent)| bent.is_none()) {
            for piece in mesh.pieces().iter() {
                uses.entry(Arc::as_ptr(&piece.data)).or_insert_with(|| (piece.data.clone(), 0)).1 += 1;
            }
        }
        let origin = render_origin(stage);
        let nudges = contact_nudges(stage);
        Extraction { stage, origin, sides, transparent, uses, nudges, geometry: Geometry::default() }
    }

    fn run(mut self) -> Result<Geometry, Diagnostics> {
        every_kind!(extract_shapes self);
        self.geometry.finish();
        Ok(self.geometry)
    }

    /// Whether several live entities use a piece of a mesh.
    pub(super) fn is_shared(&self, data: &Arc<MeshData>) -> bool {
        self.uses.get(&Arc::as_ptr(data)).is_some_and(|(_, uses)| *uses > 1)
    }

    /// Whether light goes through what a shape is made of.
    pub(super) fn is_transparent(&self, placed: &ShapePlacement) -> bool {
        self.transparent[placed.material as usize]
    }

    /// The placement of a piece of a mesh, which may be made of another material than its entity.
    pub(super) fn placement_of(&self, piece: &Piece, placed: &ShapePlacement) -> ShapePlacement {
        let own = piece.material.as_ref().and_then(|name| self.stage.material_names.get(name));
        let material = own.map_or(placed.material, |index| *index as u32);
        ShapePlacement { material, both_sides: self.sides[material as usize], ..*placed }
    }

    /// Extracts every entity with a `T`, in authored order.
    fn each<T: ExtractShape>(&mut self) -> Result<(), Diagnostic> {
        let stage = self.stage;
        let default_material = (self.sides.len() - 1) as u32;
        type Parts<'q, T> = (&'q T, Option<&'q Deformed>, Option<&'q Placement>, Option<&'q MaterialIndex>);
        stage.for_each_in_order::<Parts<T>>(|index, (shape, bent, placement, material)| {
            let (shape, in_world) = shape.bent(bent);
            let map = if in_world { DAffine3::IDENTITY } else { relative(placement, self.origin) };
            let map = self.nudges.of(index).map_or(map, |nudge| *nudge * map);
            if !shows(stage, index, &map, T::CAN_BE_FLAT)? {
                return Ok(());
            }
            let material = material.map_or(default_material, |material| material.0);
            let both_sides = self.sides[material as usize];
            shape.extract(&ShapePlacement { entity: index as u32, map, material, both_sides, closed: true }, self);
            if self.geometry.len() > limits::TRIANGLES {
                return Err(Diagnostic::error(format!("more than {} primitives", limits::TRIANGLES)));
            }
            Ok(())
        })
    }
}

/// The transform of an entity, as what a mistake is about.
fn transform_of(index: usize) -> Subject {
    Subject { part: ScenePart::Entity(index), component: Some(Kind::Transform.name()), field: None }
}

/// Whether anything is left of a shape under a map.
fn shows(stage: &Stage, index: usize, map: &DAffine3, can_be_flat: bool) -> Result<bool, Diagnostic> {
    if !map.to_cols_array().iter().all(|x| x.abs() <= FARTHEST) {
        let message = format!("{} is scaled or moved beyond reach", stage.label(index));
        return Err(Diagnostic::error(message).about(transform_of(index)));
    }
    if map.matrix3.determinant() != 0.0 {
        return Ok(true);
    }
    let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis];
    let has_area = [x.cross(y), y.cross(z), z.cross(x)].iter().any(|normal| *normal != DVec3::ZERO);
    if has_area && !can_be_flat {
        let message = format!("{} is scaled flat, which only meshes and triangles can be", stage.label(index));
        let diagnostic = Diagnostic::error(message).help("scaled by 0 on two axes or more, it does not show");
        return Err(diagnostic.about(transform_of(index)));
    }
    Ok(has_area)
}

/// Authored index of a named entity that is there.
pub fn find(stage: &Stage, name: &str) -> Option<usize> {
    let index = *stage.names.get(name)?;
    stage.live(index).map(|_| index)
}
