//! A frame as digests: all that decides its pixels, part by part, without rendering it.
//!
//! The scene that frames start from is hashed once. A frame then costs what its edits touch: a part of the scene is the
//! sum of the digests of its members, each with its place in the authored order, so that a member can be taken out and
//! put back changed. What does not show is left out: tags that no light is linked by, materials that no entity has, file
//! names of what was read, the accelerator, threads, and every comment and space in scene and script.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::assets::Assets;
use super::linked_tags::LinkedTags;
pub use super::parts::FramePart;
use super::parts::{PartDigests, with, without};
use crate::base::digest::{Digest, Hasher};
use crate::components::content::{feed_component, feed_record};
use crate::components::*;
use crate::systems::EmitterId;

/// The number of the pictures themselves: raise it with every change to the program that changes a pixel or a byte of
/// a file, so that frames of an older program count as stale.
pub const PICTURES: u32 = 7;

/// An emitter that has another colour in a frame than in the scene that frames start from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterColor {
    /// Which one.
    pub emitter: EmitterId,
    /// Its colour in the frame, linear.
    pub color: DVec3,
}

/// A frame as digests of its parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fingerprint {
    parts: PartDigests,
    /// Emitters whose colours differ from the base scene, if the picture is a sum over lights.
    pub emitter_colors: Vec<EmitterColor>,
    /// Whether the picture is a sum over lights, as far as its settings go.
    pub is_sum: bool,
    /// The digest of all that decides the photons of the picture, if it is made with some: of the camera that is when
    /// its shutter opens and closes.
    pub photons: Option<Digest>,
    /// Whether the picture changes only where rays meet objects that change, as far as camera and settings go.
    pub has_static_camera: bool,
    /// Width and height of the picture.
    pub size: [u32; 2],
    /// What tracing it is estimated to cost: millions of steps of rays.
    pub cost: f64,
}

impl Fingerprint {
    /// The digest of all that decides the frame's pixels, the program included.
    pub fn hash(&self) -> Digest {
        let mut hasher = Hasher::default();
        hasher.text(concat!("anim ", env!("CARGO_PKG_VERSION")));
        hasher.word(PICTURES.into());
        self.parts.iter().for_each(|part| hasher.digest(*part));
        hasher.finish()
    }

    /// The digest of all but the colours of emitters.
    pub fn hash_without_colors(&self) -> Digest {
        let mut parts = self.parts;
        parts[FramePart::LightColors as usize] = Digest::default();
        Fingerprint { parts, emitter_colors: Vec::new(), ..*self }.hash()
    }

    /// A frame of several moments, one at least; what times they are follows from camera and settings.
    pub fn of_moments(moments: &[Fingerprint]) -> Fingerprint {
        let first = moments.first().cloned().unwrap_or_default();
        if moments.len() <= 1 {
            return first;
        }
        let mut hashers: [Hasher; FramePart::ALL.len()] = Default::default();
        for moment in moments {
            hashers.iter_mut().zip(moment.parts).for_each(|(hasher, part)| hasher.digest(part));
        }
        let all = || {
            let mut hasher = Hasher::default();
            moments.iter().filter_map(|moment| moment.photons).for_each(|photons| hasher.digest(photons));
            hasher.finish()
        };
        let photons = first.photons.map(|_| all());
        // Moments share the samples, and with them the cost.
        Fingerprint { parts: hashers.map(|hasher| hasher.finish()), photons, ..first }
    }

    /// Whether two frames differ in nothing but objects: their shapes, places and materials.
    pub fn differs_in_objects_only(&self, other: &Fingerprint) -> bool {
        let others = [FramePart::Geometry, FramePart::Transforms, FramePart::Materials];
        self.has_static_camera
            && other.has_static_camera
            && self.changes(other).iter().all(|part| others.contains(part))
    }

    /// Whether two frames are made with the same photons.
    pub fn shares_photons_with(&self, other: &Fingerprint) -> bool {
        self.photons.is_some() && self.photons == other.photons
    }

    /// The parts with their digests.
    pub fn digests(&self) -> impl Iterator<Item = (FramePart, Digest)> + '_ {
        FramePart::ALL.into_iter().map(|part| (part, self.parts[part as usize]))
    }

    /// The parts in which two frames differ.
    pub fn changes(&self, before: &Fingerprint) -> Vec<FramePart> {
        FramePart::ALL.into_iter().filter(|part| self.parts[*part as usize] != before.parts[*part as usize]).collect()
    }
}

/// What tracing depends on beside the settings.
#[derive(Clone, Copy, Debug, Default)]
struct SceneCounts {
    lights: i64,
    primitives: i64,
}

/// The scene that frames start from, hashed.
pub struct BaseFingerprint {
    scene: Arc<Scene>,
    assets: Assets,
    parts: PartDigests,
    counts: SceneCounts,
    materials: FxHashMap<Text, usize>,
    /// How many entities have each material.
    uses: Vec<i64>,
    tags: LinkedTags,
}

impl BaseFingerprint {
    /// Hashes a scene; `assets` are the files that it names.
    pub fn new(scene: Arc<Scene>, assets: Assets) -> Self {
        let materials: FxHashMap<Text, usize> =
            scene.materials.iter().enumerate().map(|(i, (name, _))| (name.clone(), i)).collect();
        let mut rest = BaseFingerprint {
            parts: PartDigests::default(),
            counts: SceneCounts::default(),
            uses: vec![0; scene.materials.len()],
            tags: LinkedTags::new(&scene.entities),
            materials,
            scene: scene.clone(),
            assets,
        };
        let entities = scene.entities.par_iter().enumerate().with_min_len(1_000);
        rest.parts = entities.map(|(index, desc)| rest.entity(index, desc)).reduce(PartDigests::default, with);
        for desc in &scene.entities {
            count(&mut rest.counts, desc, 1);
            for index in materials_of(desc).filter_map(|name| rest.materials.get(name)) {
                rest.uses[*index] += 1;
            }
        }
        for (index, (name, material)) in scene.materials.iter().enumerate().filter(|(i, _)| rest.uses[*i] > 0) {
            rest.parts = with(rest.parts, rest.material(index, name, material));
        }
        rest
    }

    /// The camera of the scene.
    pub fn camera(&self) -> &Camera {
        &self.scene.camera
    }

    /// The scene that frames start from; without entities where they are never edited.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// For a scene whose entities and materials are never edited: their digests are all that is kept.
    pub fn without_entities(self) -> Self {
        let Scene { camera, cameras, render, .. } = &*self.scene;
        let (camera, cameras, render) = (camera.clone(), cameras.clone(), render.clone());
        BaseFingerprint { scene: Arc::new(Scene { camera, cameras, render, ..Scene::default() }), ..self }
    }

    /// The digest of what a file holds that the scene names so; `None` if the text names none.
    pub fn content_of(&self, text: &Text) -> Option<Digest> {
        self.assets.content(text)
    }

    /// Feeds the content of every file that a value names.
    pub fn feed_files(&self, value: &Value, hasher: &mut Hasher) {
        self.assets.feed(value, hasher);
    }

    /// A file that the scene names and that has changed since it was hashed.
    pub fn changed_asset(&self) -> Option<String> {
        self.assets.changed()
    }

    /// The frame that these edits make of the scene.
    pub fn fingerprint(&self, edits: &[Edit]) -> Fingerprint {
        let mut edited = EditedScene::default();
        edits.iter().for_each(|edit| edited.apply(&self.scene, edit));
        let camera = edited.camera.unwrap_or(&self.scene.camera);
        let render = edited.render.unwrap_or(&self.scene.render);
        let (mut parts, mut counts) = (self.parts, self.counts);
        let mut uses: BTreeMap<usize, i64> = edited.materials.keys().map(|index| (*index, 0)).collect();
        let mut count_use = |desc: &EntityDesc, count: i64| {
            let first = self.scene.materials.len();
            let added = |name| edited.added.iter().position(|known| *known == name).map(|i| first + i);
            for index in materials_of(desc).filter_map(|name| self.materials.get(name).copied().or_else(|| added(name)))
            {
                *uses.entry(index).or_default() += count;
            }
        };
        for (index, now) in &edited.entities {
            if let Some(before) = self.scene.entities.get(*index) {
                parts = without(parts, self.entity(*index, before));
                count(&mut counts, before, -1);
                count_use(before, -1);
            }
            if let Some(now) = now {
                parts = with(parts, self.entity(*index, now));
                count(&mut counts, now, 1);
                count_use(now, 1);
            }
        }
        let mut emitter_colors = self.emitter_colors(&edited, render);
        for (index, change) in uses {
            let before = self.uses.get(index).copied().unwrap_or(0);
            let rest = self.scene.materials.get(index);
            if let Some((name, material)) = rest.filter(|_| before > 0) {
                parts = without(parts, self.material(index, name, material));
            }
            let name = rest.map(|(name, _)| &**name).or_else(|| edited.added.get(index - self.uses.len()).copied());
            let material = edited.materials.get(&index).copied().or(rest.map(|(_, material)| material));
            if let (Some(name), Some(material), true) = (name, material, before + change > 0) {
                parts = with(parts, self.material(index, name, material));
                emitter_colors.push(EmitterColor { emitter: EmitterId::Material(index), color: material.emission });
            }
        }
        if let Some(tagged) = self.tags.edited(&edited.entities) {
            let part = &mut parts[FramePart::Geometry as usize];
            *part = part.with(tagged);
        }
        let pose = &mut parts[FramePart::Camera as usize];
        *pose = pose.with(self.record(camera, |_, class| class != FieldClass::Lens));
        parts[FramePart::Lens as usize] = self.record(camera, |_, class| class == FieldClass::Lens);
        let brightness = render.environment_color().0;
        // Clear air is what there was before there could be fog: frames without it are the same ones.
        let is_clear = |field: &str| field == "fog" && render.fog.is_none();
        parts[FramePart::Settings as usize] = self
            .record(render, |field, class| field != brightness && class != FieldClass::Invisible && !is_clear(field));
        let colors = &mut parts[FramePart::LightColors as usize];
        *colors = colors.with(self.record(render, |field, _| field == brightness));
        // What catchers show is a ratio of sums.
        let mut worn =
            self.scene.materials.iter().map(|(_, material)| material).chain(edited.materials.values().copied());
        let is_sum = is_sum(camera, render) && !worn.any(|material| material.shadow_catcher);
        emitter_colors.retain(|one| is_sum && self.emitter_color(one.emitter) != Some(one.color));
        Fingerprint {
            parts,
            emitter_colors,
            is_sum,
            photons: (render.integrator == Integrator::Photon).then(|| self.photons(parts, camera, render)),
            has_static_camera: has_static_camera(camera, render),
            size: render.pixel_bounds()[1],
            cost: cost(render, counts),
        }
    }

    /// As [`Self::fingerprint`], of a moment whose picture shows what has moved since another one.
    pub fn fingerprint_after(&self, edits: &[Edit], before: Option<&[Edit]>) -> Fingerprint {
        let mut fingerprint = self.fingerprint(edits);
        if let Some(before) = before {
            let parts = self.fingerprint(before).parts;
            let mut hasher = Hasher::default();
            let shown = [FramePart::Camera, FramePart::Geometry, FramePart::Transforms, FramePart::Lights];
            shown.iter().for_each(|part| hasher.digest(parts[*part as usize]));
            fingerprint.parts[FramePart::Before as usize] = hasher.finish();
        }
        fingerprint
    }

    fn photons(&self, parts: PartDigests, camera: &Camera, render: &Render) -> Digest {
        let mut hasher = Hasher::default();
        let seen = [
            FramePart::Geometry,
            FramePart::Transforms,
            FramePart::Materials,
            FramePart::Lights,
            FramePart::LightColors,
        ];
        seen.iter().for_each(|part| hasher.digest(parts[*part as usize]));
        let unseen = [FieldClass::Film, FieldClass::Invisible];
        hasher.digest(self.record(render, |_, class| !unseen.contains(&class)));
        hasher.digest(self.record(camera, |_, class| class == FieldClass::Shutter));
        // Photons are stored relative to an origin near the camera.
        crate::systems::origin_for(camera.from).to_array().into_iter().for_each(|x| hasher.number(x));
        hasher.digest(self.record(camera, |field, _| field == "entity"));
        hasher.finish()
    }

    /// The colours of the lights that edits have touched, and of the environment.
    fn emitter_colors(&self, edited: &EditedScene, render: &Render) -> Vec<EmitterColor> {
        let now = edited.entities.iter().filter_map(|(entity, now)| Some((*entity, now.as_ref()?)));
        let lamps = now.flat_map(|(entity, desc)| {
            let color = move |c: &Component| Some((EmitterId::Lamp(entity, c.kind()), c.light_color()?));
            desc.components().iter().filter_map(color)
        });
        let around = (EmitterId::Environment, render.environment_color().1);
        lamps.chain([around]).map(|(emitter, color)| EmitterColor { emitter, color }).collect()
    }

    /// The colour of an emitter in the scene that frames start from.
    pub fn emitter_color(&self, emitter: EmitterId) -> Option<DVec3> {
        match emitter {
            EmitterId::Lamp(entity, kind) => self.scene.entities.get(entity)?.get(kind)?.light_color(),
            EmitterId::Material(index) => self.scene.materials.get(index).map(|(_, material)| material.emission),
            EmitterId::Environment => Some(self.scene.render.environment_color().1),
        }
    }

    fn record(&self, record: &dyn Record, wanted: impl Fn(&str, FieldClass) -> bool) -> Digest {
        let mut hasher = Hasher::default();
        feed_record(record, wanted, &mut hasher, &mut |value, hasher| self.assets.feed(value, hasher));
        hasher.finish()
    }

    /// What a material that an entity has adds to each part of a frame.
    fn material(&self, index: usize, name: &str, material: &Material) -> PartDigests {
        let digest = |wanted: &dyn Fn(FieldClass) -> bool| {
            let mut hasher = Hasher::default();
            hasher.word(index as u64);
            hasher.text(name);
            feed_record(material, |_, class| wanted(class), &mut hasher, &mut |value, hasher| {
                self.assets.feed(value, hasher)
            });
            hasher.finish()
        };
        let mut parts = PartDigests::default();
        parts[FramePart::Materials as usize] = digest(&|class| class != FieldClass::EmittedColor);
        if material.emission != DVec3::ZERO {
            parts[FramePart::LightColors as usize] = digest(&|class| class == FieldClass::EmittedColor);
        }
        parts
    }

    /// What an entity adds to each part of a frame.
    fn entity(&self, index: usize, desc: &EntityDesc) -> PartDigests {
        let mut parts = PartDigests::default();
        let start = || {
            let mut hasher = Hasher::default();
            hasher.word(index as u64);
            hasher
        };
        let mut presence = start();
        presence.text(desc.name.as_deref().unwrap_or(""));
        parts[FramePart::Geometry as usize] = presence.finish();
        let is_light = is_light(desc);
        for component in desc.components() {
            let mut add = |part: FramePart, wanted: &dyn Fn(FieldClass) -> bool| {
                let mut hasher = start();
                feed_component(component, wanted, &mut hasher, &mut |value, hasher| self.assets.feed(value, hasher));
                parts[part as usize] = parts[part as usize].with(hasher.finish());
            };
            match component.kind().role() {
                Role::Light => {
                    add(FramePart::LightColors, &|class| class == FieldClass::EmittedColor);
                    add(FramePart::Lights, &|class| class != FieldClass::EmittedColor);
                }
                Role::Linking => add(FramePart::Lights, &|_| true),
                Role::Placement | Role::Visibility if is_light => add(FramePart::Lights, &|_| true),
                Role::Placement => add(FramePart::Transforms, &|_| true),
                Role::Surface => add(FramePart::Materials, &|_| true),
                Role::Shape | Role::Deformation | Role::Visibility => add(FramePart::Geometry, &|_| true),
                Role::View => add(FramePart::Camera, &|_| true),
                // The entities that come from it are parts of the frame themselves.
                Role::Source => {}
            }
        }
        parts
    }
}

/// The scene as the edits of a frame leave it, as far as they touch it.
#[derive(Default)]
struct EditedScene<'a> {
    camera: Option<&'a Camera>,
    render: Option<&'a Render>,
    materials: BTreeMap<usize, &'a Material>,
    /// Names of the materials that were added, in order.
    added: Vec<&'a str>,
    /// Entities as they are now, by their index; `None` are gone.
    entities: BTreeMap<usize, Option<EntityDesc>>,
    spawned: usize,
}

impl<'a> EditedScene<'a> {
    fn apply(&mut self, rest: &Scene, edit: &'a Edit) {
        let mut desc = |index: usize, change: &dyn Fn(&mut EntityDesc)| {
            let known = self.entities.entry(index).or_insert_with(|| rest.entities.get(index).cloned());
            known.iter_mut().for_each(change);
        };
        match edit {
            Edit::Camera(camera) => self.camera = Some(camera),
            Edit::Render(render) => self.render = Some(render),
            Edit::Material { index, material } => drop(self.materials.insert(*index, material)),
            Edit::AddMaterial { name, material } => {
                self.materials.insert(rest.materials.len() + self.added.len(), material);
                self.added.push(name);
            }
            Edit::Put { entity, component } => desc(*entity, &|desc| desc.put(component.clone())),
            Edit::Take { entity, kind } => desc(*entity, &|desc| drop(desc.take(*kind))),
            Edit::Spawn(desc) => {
                self.entities.insert(rest.entities.len() + self.spawned, Some(desc.clone()));
                self.spawned += 1;
            }
            Edit::Despawn { entity } => drop(self.entities.insert(*entity, None)),
            Edit::Tags { entity, tags } => desc(*entity, &|desc| desc.tags = tags.clone()),
            Edit::Cameras(_) => {}
        }
    }
}

fn is_light(desc: &EntityDesc) -> bool {
    desc.components().iter().any(|component| component.kind().role() == Role::Light)
}

/// Not while a shutter is open, nor if camera or focus follow an entity or motion is one of the layers.
fn has_static_camera(camera: &Camera, render: &Render) -> bool {
    let follows = matches!(camera.focus, Some(Focus::Entity(_))) && camera.focus_distance.is_none();
    let is_instant = camera.shutter.y <= camera.shutter.x && !render.aovs.contains(&Aov::Motion);
    is_local(render.integrator) && is_instant && camera.entity.is_none() && (!follows || camera.lens_radius() == 0.0)
}

/// Whether a pixel depends on nothing but what its own rays meet, and is a sum over lights.
fn is_local(integrator: Integrator) -> bool {
    match integrator {
        Integrator::Whitted | Integrator::Distribution | Integrator::Path => true,
        // Photons come from everywhere.
        Integrator::Photon => false,
    }
}

/// Not if samples are clamped or judged by what all lights together make of them, nor while a shutter is open or motion
/// is one of the layers.
fn is_sum(camera: &Camera, render: &Render) -> bool {
    let is_cut = render.clamp.is_some() || render.clamp_direct.is_some();
    let is_judged = is_cut || render.denoise || render.gathers_moments() || render.filter.has_negative_lobes();
    let is_instant = camera.shutter.y <= camera.shutter.x && !render.aovs.contains(&Aov::Motion);
    is_local(render.integrator) && !is_judged && is_instant
}

/// Names of the materials that an entity has: its own, and those that the file of its mesh names.
fn materials_of(desc: &EntityDesc) -> impl Iterator<Item = &str> {
    let own = desc.component::<MaterialName>().map(|name| &*name.0);
    let mesh = desc.component::<Mesh>();
    own.into_iter().chain(mesh.into_iter().flat_map(Mesh::worn).map(|name| &**name))
}

fn count(counts: &mut SceneCounts, desc: &EntityDesc, sign: i64) {
    counts.lights += sign * i64::from(is_light(desc));
    let shapes = desc.components().iter().filter_map(Component::shape);
    counts.primitives += sign * shapes.map(|shape| shape.primitive_count() as i64).sum::<i64>();
}

/// Camera rays and the rays that follow from them, each as deep as the tree over the primitives.
fn cost(render: &Render, counts: SceneCounts) -> f64 {
    let [width, height] = render.pixel_bounds()[1].map(f64::from);
    let strata = f64::from(render.strata());
    let chain = match render.integrator {
        Integrator::Path | Integrator::Photon => f64::from(render.max_depth.min(6)),
        Integrator::Whitted | Integrator::Distribution => f64::from(render.max_depth.min(2)),
    };
    let rays = width * height * strata * strata * chain * (1.0 + counts.lights.max(0) as f64);
    let depth = 64 - (counts.primitives.max(0) as u64).leading_zeros();
    rays * f64::from(depth + 1) / 1e6
}
