//! Warnings about transparent bodies beyond what a ray can tell of where it is.

use glam::{DAffine3, DVec3};
use rustc_hash::FxHashMap;

use super::placements::{Placements, shapes_of};
use crate::base::diagnostics::{Diagnostic, ScenePart};
use crate::base::limits;
use crate::components::shapes::world_bounds;
use crate::components::*;

/// Bodies that a warning names.
const NAMED: usize = 3;

/// A shape that light goes through.
struct ClearBody<'a> {
    entity: usize,
    shape: &'a dyn Shape,
    to_local: DAffine3,
    min: DVec3,
    max: DVec3,
}

impl ClearBody<'_> {
    fn holds(&self, point: DVec3) -> bool {
        let is_near = point.cmpgt(self.min).all() && point.cmplt(self.max).all();
        is_near && self.shape.holds(self.to_local.transform_point3(point))
    }
}

/// Bodies that lie deeper in each other than rays remember, and materials with numbers beyond theirs.
pub fn beyond_what_rays_know(scene: &Scene) -> Vec<Diagnostic> {
    let mut numbers: FxHashMap<&str, usize> = FxHashMap::default();
    for (number, (name, material)) in scene.materials.iter().enumerate() {
        if material.is_transparent() && !material.thin {
            numbers.insert(name, number);
        }
    }
    if numbers.is_empty() {
        return Vec::new();
    }
    let mut found = Vec::new();
    let last =
        numbers.iter().filter(|(_, number)| **number >= limits::BODY_MATERIALS).min_by_key(|(_, number)| **number);
    if let Some((name, number)) = last {
        let message = format!(
            "material `{name}` is number {} of the scene: bodies of transparent materials beyond number {} are as if in air, \
             whatever they lie in",
            number + 1,
            limits::BODY_MATERIALS
        );
        let warning = Diagnostic::warning(message).help("put transparent materials before others");
        found.push(warning.about(ScenePart::Material(*number)));
    }
    let bodies = bodies_of(scene, |name| numbers.contains_key(name));
    if let Some(nested) = deepest(&bodies).filter(|nested| nested.len() > limits::NESTED_BODIES as usize) {
        let names: Vec<String> = nested.iter().take(NAMED).map(|body| scene.entities[*body].label(*body)).collect();
        let message = format!(
            "{} transparent bodies lie in each other ({} and {} more): rays forget the outermost beyond {}, so that what is \
             inside refracts as if in air",
            nested.len(),
            names.join(", "),
            nested.len() - names.len(),
            limits::NESTED_BODIES
        );
        found.push(Diagnostic::warning(message).about(ScenePart::Entity(nested[0])));
    }
    found
}

fn bodies_of<'a>(scene: &'a Scene, is_clear: impl Fn(&str) -> bool) -> Vec<ClearBody<'a>> {
    let placements = Placements::new(scene);
    let mut bodies = Vec::new();
    for (entity, desc) in scene.entities.iter().enumerate() {
        let worn = desc.get(Kind::MaterialName).and_then(MaterialName::of);
        if !worn.is_some_and(|worn| is_clear(&worn.0)) {
            continue;
        }
        let map = placements.of(entity);
        for shape in shapes_of(desc) {
            let Some([min, max]) = world_bounds(shape, &map) else { continue };
            bodies.push(ClearBody { entity, shape, to_local: map.inverse(), min, max });
        }
    }
    bodies
}

/// The entities whose bodies hold the middle of one of them, where there are most, the outermost first. Bodies are met in
/// the order of their left ends, so that only those are compared that lie side by side.
fn deepest(bodies: &[ClearBody]) -> Option<Vec<usize>> {
    let middle = |body: usize| (bodies[body].min + bodies[body].max) * 0.5;
    let mut starts: Vec<usize> = (0..bodies.len()).collect();
    starts.sort_by(|a, b| bodies[*a].min.x.total_cmp(&bodies[*b].min.x));
    let mut asked: Vec<usize> = (0..bodies.len()).collect();
    asked.sort_by(|a, b| middle(*a).x.total_cmp(&middle(*b).x));
    let mut starts = starts.into_iter().peekable();
    let (mut open, mut best, mut tests): (Vec<usize>, Vec<usize>, usize) = (Vec::new(), Vec::new(), 0);
    for body in asked {
        let point = middle(body);
        while let Some(next) = starts.next_if(|next| bodies[*next].min.x <= point.x) {
            open.push(next);
        }
        open.retain(|other| bodies[*other].max.x >= point.x);
        tests += open.len();
        if tests > limits::NESTING_TESTS {
            break;
        }
        // Of few whose boxes hold the point no more can hold it.
        let near = |other: &&usize| {
            let ClearBody { min, max, .. } = bodies[**other];
            point.cmpgt(min).all() && point.cmplt(max).all()
        };
        if open.iter().filter(near).count() <= best.len().max(limits::NESTED_BODIES as usize) {
            continue;
        }
        let holding: Vec<usize> = open.iter().copied().filter(|other| bodies[*other].holds(point)).collect();
        if holding.len() > best.len() {
            best = holding;
        }
    }
    best.sort_by(|a, b| {
        (bodies[*b].max - bodies[*b].min).length().total_cmp(&(bodies[*a].max - bodies[*a].min).length())
    });
    (!best.is_empty()).then(|| best.into_iter().map(|body| bodies[body].entity).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marbles(radii: &[f64], offset: f64) -> Scene {
        let names: Vec<String> = (0..radii.len()).map(|i| format!("glass{i}")).collect();
        let glass = Material { model: Model::Dielectric, ..Material::default() };
        let body = |(i, radius): (usize, &f64)| {
            let transform = Transform { translation: DVec3::X * (i as f64 * offset), ..Transform::default() };
            let sphere = Sphere { radius: *radius, ..Sphere::default() };
            EntityDesc::new([transform.into(), sphere.into(), MaterialName(names[i].as_str().into()).into()])
        };
        Scene {
            materials: names.iter().map(|name| (name.as_str().into(), glass.clone())).collect(),
            entities: radii.iter().enumerate().map(body).collect(),
            ..Scene::default()
        }
    }

    fn said(scene: &Scene) -> Vec<String> {
        beyond_what_rays_know(scene).into_iter().map(|warning| warning.message).collect()
    }

    #[test]
    fn bodies_that_lie_too_deep_in_each_other_are_named() {
        let five = said(&marbles(&[5.0, 4.0, 3.0, 2.0, 1.0], 0.1));
        assert!(
            five.len() == 1 && five[0].starts_with("5 transparent bodies lie in each other (entity 1, "),
            "{five:?}"
        );
        assert_eq!(said(&marbles(&[5.0, 4.0, 3.0, 2.0], 0.1)), [] as [String; 0]);
        assert_eq!(said(&marbles(&[1.0; 40], 1.5)), [] as [String; 0], "a row of marbles, of which two overlap");
        let mut opaque = marbles(&[5.0, 4.0, 3.0, 2.0, 1.0], 0.1);
        opaque.materials[2].1 = Material::default();
        assert_eq!(said(&opaque), [] as [String; 0]);
    }

    #[test]
    fn meshes_hold_what_they_enclose() {
        let tetrahedron = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let mesh = |triangles: &[[u32; 3]]| {
            let corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0], [0.0, 4.0, 0.0]].map(Into::into);
            let data = MeshData::new(corners.to_vec(), triangles.to_vec(), Vec::new());
            Mesh { data: std::sync::Arc::new(data), ..Mesh::default() }
        };
        let whole = mesh(&tetrahedron);
        assert!(whole.holds(DVec3::ONE) && !whole.holds(DVec3::splat(2.0)) && !whole.holds(-DVec3::ONE));
        assert!(!mesh(&tetrahedron[..3]).holds(DVec3::ONE), "what is open encloses nothing");
    }

    #[test]
    fn materials_with_numbers_beyond_what_rays_hold_are_named() {
        let mut scene = marbles(&[1.0], 0.0);
        let filler = (0..limits::BODY_MATERIALS).map(|i| (Text::from(format!("m{i}").as_str()), Material::default()));
        let glass = scene.materials.pop().unwrap();
        scene.materials = filler.collect();
        scene.materials.push(glass);
        let said = said(&scene);
        assert!(said.len() == 1 && said[0].starts_with("material `glass0` is number 65536 of the scene"), "{said:?}");
    }
}
