//! What a scene holds at rest, in numbers: how much there is of it, how large it is, and where.

use glam::{DAffine3, DVec3};
use rustc_hash::FxHashMap;

use crate::base::limits;
use crate::components::skin::bent;
use crate::components::*;

/// What a scene holds at rest, without its planes, which have no end.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneMeasures {
    /// How many there are.
    pub entities: usize,
    /// Entities with a mesh.
    pub meshes: usize,
    /// Triangles of all meshes, counted wherever one stands.
    pub triangles: u64,
    /// Sum of their areas, in square units of world space.
    pub area: f64,
    /// The box around meshes and spheres, world space; `None` if there are none.
    pub bounds: Option<[DVec3; 2]>,
    /// Entities that carry a light.
    pub lights: usize,
    /// Entities that carry a camera.
    pub viewpoints: usize,
    /// Names, in the order of the file.
    pub materials: Vec<Text>,
    /// Clips of all assets, with the seconds of their first and last key.
    pub clips: Vec<(Text, [f64; 2])>,
}

impl SceneMeasures {
    /// Measures a scene whose references were checked.
    pub fn of(scene: &Scene) -> SceneMeasures {
        let mut out = SceneMeasures {
            entities: scene.entities.len(),
            materials: scene.materials.iter().map(|(name, _)| name.clone()).collect(),
            ..SceneMeasures::default()
        };
        let places = Places::of(scene);
        for (desc, map) in scene.entities.iter().zip(&places.maps) {
            let has = |kind: Kind| usize::from(desc.get(kind).is_some());
            out.lights += has(Kind::PointLight) + has(Kind::AreaLight) + has(Kind::SpotLight);
            out.lights += has(Kind::DirectionalLight);
            out.viewpoints += has(Kind::Viewpoint);
            if let Some(Component::Mesh(mesh)) = desc.get(Kind::Mesh) {
                out.meshes += 1;
                let (bent, map) = places.bent(desc, mesh, *map);
                let corner = |v: u32| map.transform_point3(bent.vertices[v as usize].as_dvec3() + bent.origin);
                for [a, b, c] in mesh.shown_triangles(&bent).map(|triangle| triangle.map(corner)) {
                    out.triangles += 1;
                    out.area += (b - a).cross(c - a).length() / 2.0;
                    [a, b, c].into_iter().for_each(|p| out.add(p));
                }
            }
            if let Some(Component::Sphere(sphere)) = desc.get(Kind::Sphere) {
                let corners = [DVec3::ONE, DVec3::NEG_ONE].map(|side| sphere.center + side * sphere.radius.abs());
                corners.into_iter().for_each(|corner| out.add(map.transform_point3(corner)));
            }
            if let Some(Component::Asset(asset)) = desc.get(Kind::Asset) {
                out.clips.extend(asset.data.clips.iter().map(|clip| (clip.name.clone(), clip.span())));
            }
        }
        out
    }

    fn add(&mut self, p: DVec3) {
        let [min, max] = self.bounds.get_or_insert([p; 2]);
        (*min, *max) = (min.min(p), max.max(p));
    }
}

/// Where the entities of a scene stand.
struct Places<'a> {
    names: FxHashMap<&'a str, usize>,
    maps: Vec<DAffine3>,
}

impl<'a> Places<'a> {
    fn of(scene: &'a Scene) -> Self {
        let named = scene.entities.iter().enumerate().filter_map(|(i, desc)| Some((desc.name.as_deref()?, i)));
        let names: FxHashMap<&str, usize> = named.collect();
        let mut known: Vec<Option<DAffine3>> = vec![None; scene.entities.len()];
        let maps = (0..scene.entities.len()).map(|i| place(scene, &names, i, &mut known, 0)).collect();
        Places { names, maps }
    }

    /// A mesh as its shapes and joints bend it, and what leads from it to the world.
    fn bent(&self, desc: &EntityDesc, mesh: &Mesh, map: DAffine3) -> (MeshData, DAffine3) {
        let joint = |name: &Text| self.names.get(&**name).map_or(DAffine3::IDENTITY, |i| self.maps[*i]);
        bent(mesh, desc.get(Kind::Morph), desc.get(Kind::Skin), map, joint)
    }
}

/// Where an entity stands, its parents first; references were checked.
fn place(
    scene: &Scene,
    names: &FxHashMap<&str, usize>,
    index: usize,
    known: &mut [Option<DAffine3>],
    depth: usize,
) -> DAffine3 {
    if let Some(known) = known[index] {
        return known;
    }
    let mut map = DAffine3::IDENTITY;
    if let Some(Component::Transform(transform)) = scene.entities[index].get(Kind::Transform) {
        let parent = transform.parent.as_deref().and_then(|name| names.get(name));
        if let Some(parent) = parent.filter(|_| depth < limits::HIERARCHY_DEPTH) {
            map = place(scene, names, *parent, known, depth + 1);
        }
        map *= transform.matrix();
    }
    known[index] = Some(map);
    map
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moved_and_scaled_square_has_its_area_and_its_box() {
        let folder = tempfile::tempdir().unwrap();
        let text = r#"(entities: [
            (name: "group", transform: (translation: (1.0, 2.0, 3.0), scale: (2.0, 2.0, 2.0))),
            (transform: (parent: "group", translation: (1.0, 0.0, 0.0)), mesh: (
                vertices: [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0), (9.0, 9.0, 9.0)],
                triangles: [(0, 1, 2), (0, 2, 3)])),
            (point_light: ()),
        ])"#;
        std::fs::write(folder.path().join("a.ron"), text).unwrap();
        let (scene, _) = crate::load::load_scene(&folder.path().join("a.ron"), false).unwrap();
        let found = SceneMeasures::of(&scene);
        assert_eq!((found.entities, found.meshes, found.triangles, found.lights), (3, 1, 2, 1));
        assert!((found.area - 4.0).abs() < 1e-12, "{}", found.area);
        // A vertex that no triangle has takes up no room.
        assert_eq!(found.bounds, Some([DVec3::new(3.0, 2.0, 3.0), DVec3::new(5.0, 4.0, 3.0)]));
    }
}
