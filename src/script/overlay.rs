//! What a script has changed so far, over the scene that it started from.
//!
//! Reads see earlier writes. In the end the overlay becomes edits in a fixed order, and what was written back to what
//! it was is no edit.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::sandbox;
use crate::base::diagnostics::ScenePart;
use crate::components::*;

/// Names of a scene.
#[derive(Default)]
pub struct NameIndex {
    pub entities: FxHashMap<Text, usize>,
    pub materials: FxHashMap<Text, usize>,
}

impl NameIndex {
    pub fn new(scene: &Scene) -> Self {
        let named = |(i, desc): (usize, &EntityDesc)| desc.name.clone().map(|name| (name, i));
        NameIndex {
            entities: scene.entities.iter().enumerate().filter_map(named).collect(),
            materials: scene.materials.iter().enumerate().map(|(i, (name, _))| (name.clone(), i)).collect(),
        }
    }
}

pub struct Overlay {
    rest: Arc<Scene>,
    index: Arc<NameIndex>,
    /// The camera that frames are seen from unless another one is chosen.
    default_camera: Option<Camera>,
    /// All named cameras, as soon as one is written to.
    cameras: Option<Vec<(Text, Camera)>>,
    active: ActiveCamera,
    render: Option<Render>,
    materials: BTreeMap<usize, Material>,
    new_materials: Vec<(Text, Material)>,
    /// Components that were put (`Some`) or taken off (`None`), of entities of the scene.
    components: BTreeMap<(usize, Kind), Option<Component>>,
    tags: BTreeMap<usize, Vec<Text>>,
    spawned: Vec<EntityDesc>,
    spawned_names: FxHashMap<Text, usize>,
    gone: BTreeSet<usize>,
    /// The step at which each part of the scene was written to last, if that is asked for.
    marks: Option<Marks>,
}

/// Which camera the frame is seen from.
#[derive(Clone, Debug, PartialEq)]
pub enum ActiveCamera {
    /// `camera` of the scene.
    Default,
    /// One of the named ones, by its number.
    Named(usize),
    /// One between others, or one that was changed since.
    Blended(Box<Camera>),
}

/// Steps by the part of the scene and, of an entity, the component.
pub type Marks = FxHashMap<(ScenePart, Option<&'static str>), u64>;

impl Overlay {
    pub fn new(rest: Arc<Scene>, index: Arc<NameIndex>) -> Self {
        Overlay {
            rest,
            index,
            default_camera: None,
            cameras: None,
            active: ActiveCamera::Default,
            render: None,
            materials: BTreeMap::new(),
            new_materials: Vec::new(),
            components: BTreeMap::new(),
            tags: BTreeMap::new(),
            spawned: Vec::new(),
            spawned_names: FxHashMap::default(),
            gone: BTreeSet::new(),
            marks: None,
        }
    }

    /// Notes from now on when parts are written to.
    pub fn keep_marks(&mut self) {
        self.marks = Some(Marks::default());
    }

    pub fn take_marks(&mut self) -> Marks {
        self.marks.take().unwrap_or_default()
    }

    fn mark(&mut self, part: ScenePart, component: Option<Kind>) {
        if let Some(marks) = &mut self.marks {
            let step = sandbox::steps();
            marks.insert((part, None), step);
            if let Some(kind) = component {
                marks.insert((part, Some(kind.name())), step);
            }
        }
    }

    /// The camera that the frame is seen from.
    pub fn camera(&self) -> &Camera {
        self.camera_of(&self.active)
    }

    pub fn camera_of<'a>(&'a self, which: &'a ActiveCamera) -> &'a Camera {
        match which {
            ActiveCamera::Default => self.default_camera.as_ref().unwrap_or(&self.rest.camera),
            ActiveCamera::Named(index) => &self.cameras()[*index].1,
            ActiveCamera::Blended(camera) => camera,
        }
    }

    pub fn active_camera(&self) -> &ActiveCamera {
        &self.active
    }

    /// Sees the frame from another camera from now on.
    pub fn choose_camera(&mut self, which: ActiveCamera) {
        self.mark(ScenePart::Camera, None);
        self.active = which;
    }

    pub fn set_camera(&mut self, which: &ActiveCamera, camera: Camera) {
        self.mark(ScenePart::Camera, None);
        match which {
            ActiveCamera::Default => self.default_camera = Some(camera),
            ActiveCamera::Named(index) => {
                self.cameras.get_or_insert_with(|| self.rest.cameras.clone())[*index].1 = camera
            }
            ActiveCamera::Blended(_) => self.active = ActiveCamera::Blended(Box::new(camera)),
        }
    }

    /// The named cameras.
    pub fn cameras(&self) -> &[(Text, Camera)] {
        self.cameras.as_deref().unwrap_or(&self.rest.cameras)
    }

    /// The camera of a name.
    pub fn find_camera(&self, name: &str) -> Option<ActiveCamera> {
        let named = self.cameras().iter().position(|(known, _)| &**known == name).map(ActiveCamera::Named);
        named.or((name == Scene::DEFAULT_CAMERA).then_some(ActiveCamera::Default))
    }

    /// Adds a camera whose name is new.
    pub fn add_camera(&mut self, name: Text, camera: Camera) -> ActiveCamera {
        let cameras = self.cameras.get_or_insert_with(|| self.rest.cameras.clone());
        cameras.push((name, camera));
        ActiveCamera::Named(cameras.len() - 1)
    }

    pub fn render(&self) -> &Render {
        self.render.as_ref().unwrap_or(&self.rest.render)
    }

    pub fn set_render(&mut self, render: Render) {
        self.mark(ScenePart::Render, None);
        self.render = Some(render);
    }

    pub fn find_material(&self, name: &str) -> Option<usize> {
        let new = || self.new_materials.iter().position(|(known, _)| &**known == name);
        self.index.materials.get(name).copied().or_else(|| new().map(|i| self.rest.materials.len() + i))
    }

    pub fn material_names(&self) -> Vec<Text> {
        let new = self.new_materials.iter().map(|(name, _)| name.clone());
        self.rest.materials.iter().map(|(name, _)| name.clone()).chain(new).collect()
    }

    pub fn material(&self, index: usize) -> Option<(&Text, &Material)> {
        if let Some((name, rest)) = self.rest.materials.get(index) {
            return Some((name, self.materials.get(&index).unwrap_or(rest)));
        }
        self.new_materials.get(index - self.rest.materials.len()).map(|(name, material)| (name, material))
    }

    pub fn set_material(&mut self, index: usize, material: Material) {
        self.mark(ScenePart::Material(index), None);
        match index.checked_sub(self.rest.materials.len()) {
            Some(new) => self.new_materials[new].1 = material,
            None => drop(self.materials.insert(index, material)),
        }
    }

    pub fn add_material(&mut self, name: Text, material: Material) -> usize {
        self.new_materials.push((name, material));
        self.rest.materials.len() + self.new_materials.len() - 1
    }

    pub fn find(&self, name: &str) -> Option<usize> {
        let found = self.spawned_names.get(name).or_else(|| self.index.entities.get(name)).copied();
        found.filter(|index| !self.gone.contains(index))
    }

    /// Names of the entities that are there.
    pub fn names(&self) -> Vec<Text> {
        let all = self.index.entities.iter().chain(&self.spawned_names);
        all.filter(|(_, index)| !self.gone.contains(index)).map(|(name, _)| name.clone()).collect()
    }

    /// Whether an entity of this name was there and was removed.
    pub fn was_removed(&self, name: &str) -> bool {
        let found = self.spawned_names.get(name).or_else(|| self.index.entities.get(name));
        found.is_some_and(|index| self.gone.contains(index))
    }

    /// Entities that are there, in authored order.
    pub fn entities(&self) -> impl Iterator<Item = usize> {
        (0..self.count()).filter(|index| !self.gone.contains(index))
    }

    /// How many entities were spawned, despawned ones included.
    pub fn spawned(&self) -> usize {
        self.spawned.len()
    }

    pub fn count(&self) -> usize {
        self.rest.entities.len() + self.spawned.len()
    }

    pub fn is_gone(&self, entity: usize) -> bool {
        self.gone.contains(&entity)
    }

    fn desc(&self, entity: usize) -> Option<&EntityDesc> {
        let first = self.rest.entities.len();
        if entity < first { self.rest.entities.get(entity) } else { self.spawned.get(entity - first) }
    }

    pub fn name(&self, entity: usize) -> Option<Text> {
        self.desc(entity)?.name.clone()
    }

    pub fn label(&self, entity: usize) -> String {
        self.desc(entity).map_or_else(|| format!("entity {}", entity + 1), |desc| desc.label(entity))
    }

    pub fn tags(&self, entity: usize) -> &[Text] {
        self.tags.get(&entity).or(self.desc(entity).map(|desc| &desc.tags)).map_or(&[], |tags| tags)
    }

    pub fn set_tags(&mut self, entity: usize, tags: Vec<Text>) {
        self.mark(ScenePart::Entity(entity), None);
        match entity.checked_sub(self.rest.entities.len()) {
            Some(new) => self.spawned[new].tags = tags,
            None => drop(self.tags.insert(entity, tags)),
        }
    }

    pub fn component(&self, entity: usize, kind: Kind) -> Option<&Component> {
        match self.components.get(&(entity, kind)) {
            Some(written) => written.as_ref(),
            None => self.desc(entity)?.get(kind),
        }
    }

    pub fn put(&mut self, entity: usize, component: Component) {
        self.mark(ScenePart::Entity(entity), Some(component.kind()));
        match entity.checked_sub(self.rest.entities.len()) {
            Some(new) => self.spawned[new].put(component),
            None => drop(self.components.insert((entity, component.kind()), Some(component))),
        }
    }

    pub fn take(&mut self, entity: usize, kind: Kind) {
        self.mark(ScenePart::Entity(entity), Some(kind));
        match entity.checked_sub(self.rest.entities.len()) {
            Some(new) => drop(self.spawned[new].take(kind)),
            None => drop(self.components.insert((entity, kind), None)),
        }
    }

    pub fn spawn(&mut self, desc: EntityDesc) -> usize {
        let index = self.count();
        if let Some(name) = &desc.name {
            self.spawned_names.insert(name.clone(), index);
        }
        self.spawned.push(desc);
        self.mark(ScenePart::Entity(index), None);
        index
    }

    /// The entity that was spawned last, taken back.
    pub fn unspawn(&mut self) -> Option<EntityDesc> {
        let desc = self.spawned.pop()?;
        if let Some(name) = &desc.name {
            self.spawned_names.remove(name);
        }
        Some(desc)
    }

    pub fn despawn(&mut self, entity: usize) {
        self.mark(ScenePart::Entity(entity), None);
        self.gone.insert(entity);
    }

    /// The overlay as edits; it is empty afterwards.
    pub fn take_edits(&mut self) -> Vec<Edit> {
        let mut edits = Vec::new();
        let rest = &self.rest;
        let camera = self.camera();
        if *camera != rest.camera {
            edits.push(Edit::Camera(camera.clone()));
        }
        edits.extend(self.cameras.take().filter(|all| *all != rest.cameras).map(Edit::Cameras));
        (self.default_camera, self.active) = (None, ActiveCamera::Default);
        edits.extend(self.render.take().filter(|r| *r != rest.render).map(Edit::Render));
        for (index, material) in std::mem::take(&mut self.materials) {
            if material != rest.materials[index].1 {
                edits.push(Edit::Material { index, material });
            }
        }
        let added = self.new_materials.drain(..);
        edits.extend(added.map(|(name, material)| Edit::AddMaterial { name, material }));
        edits.extend(self.spawned.drain(..).map(Edit::Spawn));
        for ((entity, kind), written) in std::mem::take(&mut self.components) {
            if self.gone.contains(&entity) || written.as_ref() == rest.entities[entity].get(kind) {
                continue;
            }
            edits.push(match written {
                Some(component) => Edit::Put { entity, component },
                None => Edit::Take { entity, kind },
            });
        }
        for (entity, tags) in std::mem::take(&mut self.tags) {
            if tags != rest.entities[entity].tags {
                edits.push(Edit::Tags { entity, tags });
            }
        }
        edits.extend(self.gone.iter().map(|entity| Edit::Despawn { entity: *entity }));
        edits
    }
}
