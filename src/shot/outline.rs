//! A frame as digests: all that decides its pixels, part by part, without rendering it.
//!
//! The scene that frames start from is hashed once. A frame then costs what its edits touch: a part of the scene is the
//! sum of the digests of its members, each with its place in the authored order, so that a member can be taken out and
//! put back changed. What does not show is left out: tags, materials that nothing wears, file names of what was read,
//! the accelerator, threads, and every comment and space in scene and script.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::assets::Assets;
pub use super::parts::Part;
use super::parts::{Parts, with, without};
use crate::base::digest::{Digest, Hasher};
use crate::components::content::{feed_component, feed_record};
use crate::components::*;
use crate::systems::Shiner;

/// The number of the pictures themselves: raise it with every change to the program that changes a pixel or a byte of
/// a file, so that frames of an older program count as stale.
pub const PICTURES: u32 = 3;

/// Settings that do not show in a picture.
const INVISIBLE: [&str; 2] = ["accel", "grid_density"];

/// Fields of the camera that are the lens and its focus; the others are where it stands and what it sees.
const LENS: [&str; 6] = ["focus_distance", "focus", "aperture", "lens", "f_stop", "meters_per_unit"];

/// Settings that photons do not see.
const FILM: [&str; 9] =
    ["size", "bit_depth", "clamp", "exposure", "tone_map", "filter", "filter_width", "aovs", "denoise"];

/// What shines in a frame in another colour than in the scene that frames start from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shine {
    pub shiner: Shiner,
    pub color: DVec3,
}

/// A frame, known by its parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline {
    parts: Parts,
    pub shines: Vec<Shine>,
    /// Whether the picture is a sum over lights, as far as its settings go.
    pub is_sum: bool,
    /// The digest of all that decides the photons of the picture, if it is made with some: of the camera that is when
    /// its shutter opens and closes.
    pub photons: Option<Digest>,
    /// Whether the picture changes only where bodies do, as far as camera and settings go.
    pub is_still: bool,
    /// Width and height of the picture.
    pub size: [u32; 2],
    /// What tracing it is estimated to cost: millions of steps of rays.
    pub cost: f64,
}

impl Outline {
    /// The digest of all that decides the frame's pixels, the program included.
    pub fn hash(&self) -> Digest {
        let mut hasher = Hasher::default();
        hasher.text(concat!("anim ", env!("CARGO_PKG_VERSION")));
        hasher.word(PICTURES.into());
        self.parts.iter().for_each(|part| hasher.digest(*part));
        hasher.finish()
    }

    /// The digest of all but the colours of what shines.
    pub fn hash_without_colors(&self) -> Digest {
        let mut parts = self.parts;
        parts[Part::LightColors as usize] = Digest::default();
        Outline { parts, shines: Vec::new(), ..*self }.hash()
    }

    /// A frame of several moments, one at least; what times they are follows from camera and settings.
    pub fn together(moments: &[Outline]) -> Outline {
        let first = moments.first().cloned().unwrap_or_default();
        if moments.len() <= 1 {
            return first;
        }
        let mut hashers: [Hasher; Part::ALL.len()] = Default::default();
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
        Outline { parts: hashers.map(|hasher| hasher.finish()), photons, ..first }
    }

    /// Whether two frames show the same but for bodies that are elsewhere or otherwise.
    pub fn stands_still_with(&self, other: &Outline) -> bool {
        let others = [Part::Geometry, Part::Transforms, Part::Materials];
        self.is_still && other.is_still && self.changes(other).iter().all(|part| others.contains(part))
    }

    /// Whether two frames are made with the same photons.
    pub fn shares_photons_with(&self, other: &Outline) -> bool {
        self.photons.is_some() && self.photons == other.photons
    }

    /// The parts in which two frames differ.
    pub fn changes(&self, before: &Outline) -> Vec<Part> {
        Part::ALL.into_iter().filter(|part| self.parts[*part as usize] != before.parts[*part as usize]).collect()
    }
}

/// What tracing depends on beside the settings.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    lights: i64,
    primitives: i64,
}

/// The scene that frames start from, hashed.
pub struct Rest {
    scene: Arc<Scene>,
    assets: Assets,
    parts: Parts,
    tally: Tally,
    materials: FxHashMap<Text, usize>,
    /// How many entities wear each material.
    worn: Vec<i64>,
}

impl Rest {
    pub fn new(scene: Arc<Scene>, assets: Assets) -> Self {
        let materials: FxHashMap<Text, usize> =
            scene.materials.iter().enumerate().map(|(i, (name, _))| (name.clone(), i)).collect();
        let mut rest = Rest {
            parts: Parts::default(),
            tally: Tally::default(),
            worn: vec![0; scene.materials.len()],
            materials,
            scene: scene.clone(),
            assets,
        };
        let entities = scene.entities.par_iter().enumerate().with_min_len(1_000);
        rest.parts = entities.map(|(index, bag)| rest.entity(index, bag)).reduce(Parts::default, with);
        for bag in &scene.entities {
            count(&mut rest.tally, bag, 1);
            for index in worn_by(bag).filter_map(|name| rest.materials.get(name)) {
                rest.worn[*index] += 1;
            }
        }
        for (index, (name, material)) in scene.materials.iter().enumerate().filter(|(i, _)| rest.worn[*i] > 0) {
            rest.parts = with(rest.parts, rest.material(index, name, material));
        }
        rest
    }

    pub fn camera(&self) -> &Camera {
        &self.scene.camera
    }

    /// For a scene whose entities and materials are never edited: their digests are all that is kept.
    pub fn without_entities(self) -> Self {
        let Scene { camera, render, .. } = &*self.scene;
        let (camera, render) = (camera.clone(), render.clone());
        Rest { scene: Arc::new(Scene { camera, render, ..Scene::default() }), ..self }
    }

    /// A file that the scene names and that has changed since it was hashed.
    pub fn changed_asset(&self) -> Option<String> {
        self.assets.changed()
    }

    /// The frame that these edits make of the scene.
    pub fn outline(&self, edits: &[Edit]) -> Outline {
        let mut touched = Touched::default();
        edits.iter().for_each(|edit| touched.apply(&self.scene, edit));
        let camera = touched.camera.unwrap_or(&self.scene.camera);
        let render = touched.render.unwrap_or(&self.scene.render);
        let (mut parts, mut tally) = (self.parts, self.tally);
        let mut worn: BTreeMap<usize, i64> = touched.materials.keys().map(|index| (*index, 0)).collect();
        let mut wear = |bag: &Bag, count: i64| {
            let first = self.scene.materials.len();
            let added = |name| touched.added.iter().position(|known| *known == name).map(|i| first + i);
            for index in worn_by(bag).filter_map(|name| self.materials.get(name).copied().or_else(|| added(name))) {
                *worn.entry(index).or_default() += count;
            }
        };
        for (index, now) in &touched.entities {
            if let Some(before) = self.scene.entities.get(*index) {
                parts = without(parts, self.entity(*index, before));
                count(&mut tally, before, -1);
                wear(before, -1);
            }
            if let Some(now) = now {
                parts = with(parts, self.entity(*index, now));
                count(&mut tally, now, 1);
                wear(now, 1);
            }
        }
        let mut shines = self.shines(&touched, render);
        for (index, change) in worn {
            let before = self.worn.get(index).copied().unwrap_or(0);
            let rest = self.scene.materials.get(index);
            if let Some((name, material)) = rest.filter(|_| before > 0) {
                parts = without(parts, self.material(index, name, material));
            }
            let name = rest.map(|(name, _)| &**name).or_else(|| touched.added.get(index - self.worn.len()).copied());
            let material = touched.materials.get(&index).copied().or(rest.map(|(_, material)| material));
            if let (Some(name), Some(material), true) = (name, material, before + change > 0) {
                parts = with(parts, self.material(index, name, material));
                shines.push(Shine { shiner: Shiner::Material(index), color: material.emission });
            }
        }
        parts[Part::Camera as usize] = self.record(camera, |field| !LENS.contains(&field));
        parts[Part::Lens as usize] = self.record(camera, |field| LENS.contains(&field));
        let surround = surround(render).0;
        parts[Part::Settings as usize] = self.record(render, |field| field != surround && !INVISIBLE.contains(&field));
        let colors = &mut parts[Part::LightColors as usize];
        *colors = colors.with(self.record(render, |field| field == surround));
        let is_sum = is_sum(camera, render);
        shines.retain(|shine| is_sum && self.rest_color(shine.shiner) != Some(shine.color));
        Outline {
            parts,
            shines,
            is_sum,
            photons: (render.integrator == Integrator::Photon).then(|| self.photons(parts, camera, render)),
            is_still: is_still(camera, render),
            size: render.size,
            cost: cost(render, tally),
        }
    }

    /// As [`Self::outline`], of a moment whose picture shows what has moved since another one.
    pub fn outline_after(&self, edits: &[Edit], before: Option<&[Edit]>) -> Outline {
        let mut outline = self.outline(edits);
        if let Some(before) = before {
            let parts = self.outline(before).parts;
            let mut hasher = Hasher::default();
            let told = [Part::Camera, Part::Geometry, Part::Transforms, Part::Lights];
            told.iter().for_each(|part| hasher.digest(parts[*part as usize]));
            outline.parts[Part::Before as usize] = hasher.finish();
        }
        outline
    }

    fn photons(&self, parts: Parts, camera: &Camera, render: &Render) -> Digest {
        let mut hasher = Hasher::default();
        let seen = [Part::Geometry, Part::Transforms, Part::Materials, Part::Lights, Part::LightColors];
        seen.iter().for_each(|part| hasher.digest(parts[*part as usize]));
        hasher.digest(self.record(render, |field| !FILM.contains(&field) && !INVISIBLE.contains(&field)));
        hasher.digest(self.record(camera, |field| field == "shutter"));
        hasher.finish()
    }

    /// The colours of the lights that edits have touched, and of what lies around the scene.
    fn shines(&self, touched: &Touched, render: &Render) -> Vec<Shine> {
        let now = touched.entities.iter().filter_map(|(entity, now)| Some((*entity, now.as_ref()?)));
        let lamps = now.flat_map(|(entity, bag)| LIGHTS.map(|kind| (Shiner::Lamp(entity, kind), color_of(bag, kind))));
        let around = (Shiner::Surround, Some(surround(render).1));
        lamps.chain([around]).filter_map(|(shiner, color)| Some(Shine { shiner, color: color? })).collect()
    }

    /// The colour of what shines in the scene that frames start from.
    pub fn rest_color(&self, shiner: Shiner) -> Option<DVec3> {
        match shiner {
            Shiner::Lamp(entity, kind) => color_of(self.scene.entities.get(entity)?, kind),
            Shiner::Material(index) => self.scene.materials.get(index).map(|(_, material)| material.emission),
            Shiner::Surround => Some(surround(&self.scene.render).1),
        }
    }

    fn record(&self, record: &dyn Record, wanted: impl Fn(&str) -> bool) -> Digest {
        let mut hasher = Hasher::default();
        feed_record(record, wanted, &mut hasher, &mut |value, hasher| self.assets.feed(value, hasher));
        hasher.finish()
    }

    /// What a material that is worn adds to each part of a frame.
    fn material(&self, index: usize, name: &str, material: &Material) -> Parts {
        let digest = |wanted: &dyn Fn(&str) -> bool| {
            let mut hasher = Hasher::default();
            hasher.word(index as u64);
            hasher.text(name);
            feed_record(material, wanted, &mut hasher, &mut |value, hasher| self.assets.feed(value, hasher));
            hasher.finish()
        };
        let mut parts = Parts::default();
        parts[Part::Materials as usize] = digest(&|field| field != "emission");
        if material.emission != DVec3::ZERO {
            parts[Part::LightColors as usize] = digest(&|field| field == "emission");
        }
        parts
    }

    /// What an entity adds to each part of a frame.
    fn entity(&self, index: usize, bag: &Bag) -> Parts {
        let mut parts = Parts::default();
        let start = || {
            let mut hasher = Hasher::default();
            hasher.word(index as u64);
            hasher
        };
        let mut presence = start();
        presence.text(bag.name.as_deref().unwrap_or(""));
        parts[Part::Geometry as usize] = presence.finish();
        let shines = is_light(bag);
        for component in bag.components() {
            let mut add = |part: Part, wanted: &dyn Fn(&str) -> bool| {
                let mut hasher = start();
                feed_component(component, wanted, &mut hasher, &mut |value, hasher| self.assets.feed(value, hasher));
                parts[part as usize] = parts[part as usize].with(hasher.finish());
            };
            match component.kind() {
                Kind::PointLight | Kind::AreaLight => {
                    add(Part::LightColors, &|field| field == "color");
                    add(Part::Lights, &|field| field != "color");
                }
                Kind::Transform | Kind::Motion if shines => add(Part::Lights, &|_| true),
                Kind::Transform | Kind::Motion => add(Part::Transforms, &|_| true),
                Kind::MaterialName | Kind::Texture => add(Part::Materials, &|_| true),
                _ => add(Part::Geometry, &|_| true),
            }
        }
        parts
    }
}

/// What a frame's edits leave in other hands than before.
#[derive(Default)]
struct Touched<'a> {
    camera: Option<&'a Camera>,
    render: Option<&'a Render>,
    materials: BTreeMap<usize, &'a Material>,
    /// Names of the materials that were added, in order.
    added: Vec<&'a str>,
    /// Entities as they are now, by their index; `None` are gone.
    entities: BTreeMap<usize, Option<Bag>>,
    spawned: usize,
}

impl<'a> Touched<'a> {
    fn apply(&mut self, rest: &Scene, edit: &'a Edit) {
        let mut bag = |index: usize, change: &dyn Fn(&mut Bag)| {
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
            Edit::Put { entity, component } => bag(*entity, &|bag| bag.put(component.clone())),
            Edit::Take { entity, kind } => bag(*entity, &|bag| drop(bag.take(*kind))),
            Edit::Spawn(bag) => {
                self.entities.insert(rest.entities.len() + self.spawned, Some(bag.clone()));
                self.spawned += 1;
            }
            Edit::Despawn { entity } => drop(self.entities.insert(*entity, None)),
            Edit::Tags { .. } => {}
        }
    }
}

const LIGHTS: [Kind; 2] = [Kind::PointLight, Kind::AreaLight];

fn is_light(bag: &Bag) -> bool {
    LIGHTS.iter().any(|kind| bag.get(*kind).is_some())
}

fn color_of(bag: &Bag, kind: Kind) -> Option<DVec3> {
    match bag.get(kind)? {
        Component::PointLight(light) => Some(light.color),
        Component::AreaLight(light) => Some(light.color),
        _ => None,
    }
}

/// Not while a shutter is open, nor where the lens follows a body or what moved before is told.
fn is_still(camera: &Camera, render: &Render) -> bool {
    let follows = matches!(camera.focus, Some(Focus::Entity(_))) && camera.focus_distance.is_none();
    let is_instant = camera.shutter.y <= camera.shutter.x && !render.aovs.contains(&Aov::Motion);
    is_local(render.integrator) && is_instant && (!follows || camera.lens_radius() == 0.0)
}

/// Whether a pixel depends on nothing but what its own rays meet, each of which brings home light by light.
fn is_local(integrator: Integrator) -> bool {
    match integrator {
        Integrator::Whitted | Integrator::Distribution | Integrator::Path => true,
        // Photons come from everywhere.
        Integrator::Photon => false,
    }
}

/// Not where samples are cut off or judged by what all lights together make of them, nor while a shutter is open or
/// what moved before is told.
fn is_sum(camera: &Camera, render: &Render) -> bool {
    let has_signs = render.filter == Filter::Mitchell;
    let is_judged = render.clamp.is_some() || render.gathers_moments() || has_signs;
    let is_instant = camera.shutter.y <= camera.shutter.x && !render.aovs.contains(&Aov::Motion);
    is_local(render.integrator) && !is_judged && is_instant
}

/// Names of the materials that an entity wears: its own, and those that the file of its mesh names.
fn worn_by(bag: &Bag) -> impl Iterator<Item = &str> {
    let own = match bag.get(Kind::MaterialName) {
        Some(Component::MaterialName(worn)) => Some(&*worn.0),
        _ => None,
    };
    let mesh = match bag.get(Kind::Mesh) {
        Some(Component::Mesh(mesh)) => Some(mesh),
        _ => None,
    };
    own.into_iter().chain(mesh.into_iter().flat_map(Mesh::worn).map(|name| &**name))
}

/// The setting that says how bright it is around the scene, and its value.
fn surround(render: &Render) -> (&'static str, DVec3) {
    if render.environment.is_some() || render.sky.is_some() {
        return ("environment_intensity", DVec3::splat(render.environment_intensity));
    }
    ("background", render.background)
}

fn count(tally: &mut Tally, bag: &Bag, sign: i64) {
    tally.lights += sign * i64::from(is_light(bag));
    let shapes = bag.components().iter().map(|component| match component {
        Component::Mesh(mesh) => mesh.data.triangles.len() as i64,
        Component::Sphere(_) | Component::Triangle(_) | Component::Plane(_) => 1,
        Component::AABox(_) | Component::Cylinder(_) | Component::Cone(_) => 1,
        _ => 0,
    });
    tally.primitives += sign * shapes.sum::<i64>();
}

/// Camera rays and the rays that follow from them, each as deep as the tree over the primitives.
fn cost(render: &Render, tally: Tally) -> f64 {
    let [width, height] = render.size.map(f64::from);
    let strata = f64::from(render.strata());
    let chain = match render.integrator {
        Integrator::Path | Integrator::Photon => f64::from(render.max_depth.min(6)),
        _ => f64::from(render.max_depth.min(2)),
    };
    let rays = width * height * strata * strata * chain * (1.0 + tally.lights.max(0) as f64);
    let depth = 64 - (tally.primitives.max(0) as u64).leading_zeros();
    rays * f64::from(depth + 1) / 1e6
}
