//! What must hold in a scene beyond its grammar: ranges and references, as data.

use rustc_hash::{FxHashMap, FxHashSet};

use super::spans::Step;
use crate::base::diagnostics::{Diagnostic, Place, suggestion};
use crate::base::limits;
use crate::components::*;

/// Something wrong in a scene, and the path to it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Steps from the scene to the value.
    pub path: Vec<Step>,
    /// What was found, and what was expected.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// Where it is in the file that stands at the path, if it is in there.
    pub inside: Option<Box<Place>>,
}

impl Problem {
    /// A problem without help.
    pub fn new(path: Vec<Step>, message: impl Into<String>) -> Self {
        Problem { path, message: message.into(), help: None, inside: None }
    }

    /// What is wrong with a file that is named at a path.
    pub fn from_file(path: Vec<Step>, problem: Diagnostic) -> Self {
        let Diagnostic { message, help, place, .. } = problem;
        Problem { path, message, help, inside: place.map(Box::new) }
    }

    /// With what to do about it.
    pub fn help(self, help: Option<String>) -> Self {
        Problem { help, ..self }
    }

    /// The problem without a place in a text.
    pub fn diagnostic(self) -> Diagnostic {
        let diagnostic = Diagnostic::error(self.message);
        match self.help {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        }
    }
}

/// The step to a field.
pub fn key(name: &str) -> Step {
    Step::Key(name.to_string())
}

/// Path to a component of an entity.
pub fn component_path(entity: usize, kind: Kind) -> Vec<Step> {
    vec![key("entities"), Step::Index(entity), key(kind.name())]
}

/// Everything that is wrong with a scene, in the order of the text.
pub fn check(scene: &Scene) -> Vec<Problem> {
    let mut problems = Vec::new();
    let mut range = |path: &[Step], owner: &str, checked: Result<(), Invalid>| {
        if let Err(invalid) = checked {
            let path = path.iter().cloned().chain([key(invalid.field)]).collect();
            problems.push(Problem::new(path, format!("{owner}: {}", invalid.message)));
        }
    };
    range(&[key("camera")], "camera", scene.camera.check());
    for (name, camera) in &scene.cameras {
        range(&[key("cameras"), key(name)], &format!("camera `{name}`"), camera.check());
    }
    range(&[key("render")], "render", scene.render.check());
    for (name, material) in &scene.materials {
        let (path, owner) = ([key("materials"), key(name)], format!("material `{name}`"));
        let mut nested = false;
        for (field, texture, _) in material.maps() {
            let path = [&path[..], &[key(field)]].concat();
            let checked = texture.check();
            nested |= checked.is_err();
            range(&path, &format!("`{field}` of {owner}"), checked);
        }
        range(&path, &owner, if nested { Ok(()) } else { material.check() });
    }
    for (i, desc) in scene.entities.iter().enumerate() {
        for component in desc.components() {
            if let Err(invalid) = component.record().check() {
                let path = component_path(i, component.kind());
                range(&path, &format!("{} of {}", component.kind().name(), desc.label(i)), Err(invalid));
            }
        }
    }
    references(scene, &mut problems);
    problems
}

fn references(scene: &Scene, problems: &mut Vec<Problem>) {
    if scene.entities.len() > limits::ENTITIES || scene.materials.len() > limits::MATERIALS {
        problems.push(Problem::new(vec![key("entities")], format!("more than {} entities", limits::ENTITIES)));
    }
    if scene.cameras.len() > limits::CAMERAS {
        problems.push(Problem::new(vec![key("cameras")], format!("more than {} cameras", limits::CAMERAS)));
    }
    texts(scene, problems);
    let mut names: FxHashMap<&str, usize> = FxHashMap::default();
    for (i, desc) in scene.entities.iter().enumerate() {
        let Some(name) = desc.name.as_deref() else { continue };
        if names.insert(name, i).is_some() {
            let path = vec![key("entities"), Step::Index(i), key("name")];
            problems.push(Problem::new(path, format!("two entities are called `{name}`")));
        }
    }
    let materials: FxHashSet<&str> = scene.materials.iter().map(|(name, _)| &**name).collect();
    for (i, desc) in scene.entities.iter().enumerate() {
        if let Some(material) = desc.component::<MaterialName>()
            && !materials.contains(&*material.0)
        {
            let help = suggestion(&material.0, scene.materials.iter().map(|(name, _)| &**name));
            let message = format!("unknown material `{}` of {}", material.0, desc.label(i));
            problems.push(Problem::new(component_path(i, Kind::MaterialName), message).help(help));
        }
        if let Some(Component::Skin(skin)) = desc.get(Kind::Skin)
            && let Some(joint) = skin.joints.iter().find(|joint| !names.contains_key(&***joint))
        {
            let path = component_path(i, Kind::Skin).into_iter().chain([key("joints")]).collect();
            let message = format!("unknown joint `{joint}` of {}", desc.label(i));
            problems.push(Problem::new(path, message).help(suggestion(joint, names.keys().copied())));
        }
        if let Some(parent) = parent(desc)
            && !names.contains_key(parent)
        {
            let mut path = component_path(i, Kind::Transform);
            path.push(key("parent"));
            let message = format!("unknown parent `{parent}` of {}", desc.label(i));
            problems.push(Problem::new(path, message).help(suggestion(parent, names.keys().copied())));
        }
    }
    camera_references(&scene.camera, "the camera", &[key("camera")], &names, problems);
    for (name, camera) in &scene.cameras {
        let path = [key("cameras"), key(name)];
        if &**name == Scene::DEFAULT_CAMERA {
            let message = format!("no camera of `cameras` may be called `{name}`: that is the name of the default one");
            problems.push(Problem::new(path.to_vec(), message));
        }
        camera_references(camera, &format!("camera `{name}`"), &path, &names, problems);
    }
    cycles(scene, &names, problems);
}

/// Entities that a camera names.
fn camera_references(
    camera: &Camera,
    owner: &str,
    path: &[Step],
    names: &FxHashMap<&str, usize>,
    problems: &mut Vec<Problem>,
) {
    let mut known = |name: &str, field: &str, what: &str| {
        if !names.contains_key(name) {
            let message = format!("{owner} is {what} `{name}`, which does not exist");
            let path = path.iter().cloned().chain([key(field)]).collect();
            problems.push(Problem::new(path, message).help(suggestion(name, names.keys().copied())));
        }
    };
    if let Some(Focus::Entity(name)) = &camera.focus {
        known(name, "focus", "focused on");
    }
    if let Some(name) = &camera.entity {
        known(name, "entity", "carried by");
    }
}

/// Names and tags that are longer than any person's; all other texts must be one of these, or the name of a file.
fn texts(scene: &Scene, problems: &mut Vec<Problem>) {
    let mut check = |text: &str, path: &dyn Fn() -> Vec<Step>| {
        if text.len() > limits::TEXT_BYTES {
            let message = format!("a text of {} bytes is over the limit of {}", text.len(), limits::TEXT_BYTES);
            problems.push(Problem::new(path(), message));
        }
    };
    for (i, desc) in scene.entities.iter().enumerate() {
        let field = |name: &str| vec![key("entities"), Step::Index(i), key(name)];
        desc.name.iter().for_each(|name| check(name, &|| field("name")));
        desc.tags.iter().for_each(|tag| check(tag, &|| field("tags")));
    }
    for (name, _) in &scene.materials {
        check(name, &|| vec![key("materials"), key(name)]);
    }
    for (name, _) in &scene.cameras {
        check(name, &|| vec![key("cameras"), key(name)]);
    }
}

fn parent(desc: &EntityDesc) -> Option<&str> {
    desc.component::<Transform>().and_then(|transform| transform.parent.as_deref())
}

/// Chains of parents that lead back to themselves or on for too long; each is reported once.
fn cycles(scene: &Scene, names: &FxHashMap<&str, usize>, problems: &mut Vec<Problem>) {
    let up = |i: usize| parent(&scene.entities[i]).and_then(|name| names.get(name).copied());
    // Entities with all that stands above them, by how many these are.
    let mut settled: FxHashMap<usize, usize> = FxHashMap::default();
    let mut is_too_deep = false;
    for start in 0..scene.entities.len() {
        let mut chain = Vec::new();
        let mut on_chain = FxHashSet::default();
        let mut at = up(start).map(|_| start);
        let mut above = 0;
        while let Some(here) = at {
            if let Some(known) = settled.get(&here) {
                above = *known;
                break;
            }
            let mut path = component_path(here, Kind::Transform);
            path.push(key("parent"));
            if !on_chain.insert(here) {
                let round = chain.iter().skip_while(|i| **i != here).chain([&here]);
                let shown: Vec<String> = round.map(|i| scene.entities[*i].label(*i)).collect();
                let message = format!("parents go round in a circle: {}", shown.join(" -> "));
                problems.push(Problem::new(path, message));
                break;
            }
            chain.push(here);
            at = up(here);
        }
        if above + chain.len() > limits::HIERARCHY_DEPTH + 1 && !is_too_deep {
            is_too_deep = true;
            let mut path = component_path(start, Kind::Transform);
            path.push(key("parent"));
            let label = scene.entities[start].label(start);
            problems.push(Problem::new(path, format!("more than {} parents above {label}", limits::HIERARCHY_DEPTH)));
        }
        for here in chain.into_iter().rev() {
            above += 1;
            settled.insert(here, above);
        }
    }
}
