//! What can be rendered and is most likely not what was meant: warnings of `anim check`, and of what renders.

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::Shot;
use super::fingerprint::Fingerprint;
use super::glass;
use super::idle::Unused;
use super::linked_tags as links;
use super::placements::{Placements, shapes_of};
use super::plan::Plan;
use super::unused;
use crate::base::diagnostics::{Diagnostic, Diagnostics, ScenePart, Severity, Subject};
use crate::base::limits;
use crate::components::shapes::world_bounds;
use crate::components::*;
use crate::load;
use crate::systems::{self, ContactsLeftOut};

/// Frames whose scenes are looked at, spread over the sequence: the first and the last are among them.
const LOOKED_AT: usize = 24;
/// As many where somebody waits for the pictures.
const LOOKED_AT_SOON: usize = 3;
/// Entities that a warning names.
const NAMED: usize = 3;

/// Warnings about a shot whose frames can all be rendered; `fingerprints` are those of frames 1, 2, 3, ...
pub fn advice(shot: &mut Shot, fingerprints: &[Fingerprint]) -> Diagnostics {
    let frames: Vec<u32> = (1..=fingerprints.len() as u32).collect();
    let still = fingerprints.windows(2).all(|pair| pair[0].hash() == pair[1].hash());
    advice_on(shot, &frames, LOOKED_AT, still)
}

/// Those of them that are soon found, about the frames of a plan: before these are rendered nobody wants to wait.
pub fn quick_advice(shot: &mut Shot, plan: &Plan) -> Diagnostics {
    let good: Vec<_> = plan.frames.iter().filter(|planned| planned.fingerprint.is_ok()).collect();
    let frames: Vec<u32> = good.iter().map(|planned| planned.frame).collect();
    let is_whole = frames.len() == shot.frames() as usize;
    let still = is_whole && good.windows(2).all(|pair| pair[0].hash == pair[1].hash);
    advice_on(shot, &frames, LOOKED_AT_SOON, still)
}

/// Warnings about some frames, of which so many are looked at; `still` if they are all that there are, and the same.
fn advice_on(shot: &mut Shot, frames: &[u32], most: usize, still: bool) -> Diagnostics {
    let count = frames.len();
    let looked_at = count.min(most);
    let spread = |i: usize| frames[if looked_at > 1 { i * (count - 1) / (looked_at - 1) } else { 0 }];
    let mut scenes: Vec<(u32, Scene)> = Vec::with_capacity(looked_at);
    for frame in (0..looked_at).map(spread) {
        if let Ok(scene) = shot.scene_of(frame) {
            scenes.push((frame, scene));
        }
    }
    let mut found = Diagnostics::default();
    if shot.is_sequence() && count > 1 && still {
        let message = format!("nothing moves: all {count} frames are the same picture");
        let help = "let `frame(s, f)` change something by `f.t` or `f.seconds`, or set `frames: 1`";
        found.push(at_script(shot, Diagnostic::warning(message).help(help)));
    }
    if !scenes.is_empty() && scenes.iter().all(|(_, scene)| is_dark(scene)) {
        let message = "there is no light in the scene: whatever is in it is black";
        let help = "add an entity with `point_light` or `area_light`; with `integrator: Path`, a `background`, an \
                    `environment` or a material's `emission` light it too";
        found.push(at_script(shot, Diagnostic::warning(message).help(help)));
    }
    let has_all = count == shot.frames() as usize;
    found.0.extend(has_all.then(|| stepping(shot, count as u32)).flatten());
    // What few frames do not show another one may.
    let is_telling = has_all && (looked_at == count || looked_at == LOOKED_AT);
    found.0.extend(is_telling.then(|| unseen(shot, &scenes, count)).flatten());
    found.0.extend(contacts(shot));
    if let Some((first, scene)) = scenes.first() {
        for mut warning in glass::beyond_what_rays_know(scene) {
            shot.input.find_place(&mut warning, *first);
            found.push(warning);
        }
        for (subject, message, help) in links::advice(scene) {
            let mut warning = Diagnostic { help, ..Diagnostic::warning(message).about(subject) };
            shot.input.find_place(&mut warning, *first);
            found.push(warning);
        }
        if let Some((message, help)) = idle_fog(scene) {
            let subject = Subject { part: ScenePart::Render, component: None, field: Some("fog") };
            let mut warning = Diagnostic::warning(message).about(subject).help(help);
            shot.input.find_place(&mut warning, *first);
            found.push(warning);
        }
        let before = shot.is_sequence().then(|| shot.input.base.scene().clone());
        let idle = unused::in_all(before.as_ref(), scenes.iter().map(|(_, scene)| scene));
        for Unused { subject, message, help, .. } in idle.into_iter().chain(fov_as_usual(shot, scene)) {
            let mut warning = Diagnostic { help, ..Diagnostic::warning(message) };
            match ways(shot, scene, &subject) {
                Telling::AtItsPlace => {
                    warning = warning.about(subject);
                    shot.input.find_place(&mut warning, *first);
                }
                Telling::Alone => {}
                Telling::Never => continue,
            }
            found.push(warning);
        }
    }
    found
}

/// At the script; a scene alone is named as a whole.
fn at_script(shot: &Shot, warning: Diagnostic) -> Diagnostic {
    let place = shot.input.program.as_ref().map(|(program, _)| program.place());
    let place = place.or_else(|| {
        let (path, _) = shot.input.scene_file.as_ref()?;
        Some(crate::base::diagnostics::Place::file(path.to_string_lossy().as_ref()))
    });
    Diagnostic { place, ..warning }
}

/// What is to be said of contacts in the first frame: bodies that touch others and are not set apart from them, and
/// whether all could be looked at.
fn contacts(shot: &mut Shot) -> Vec<Diagnostic> {
    let place = |stage: &mut systems::Stage| {
        systems::update_hierarchy(stage)?;
        Ok(systems::contacts_left_out(stage))
    };
    let edits = shot.input.edits(1).ok();
    let found = edits.and_then(|edits| shot.input.with_frame(&mut shot.stage, 1, edits, place).ok());
    let Some(ContactsLeftOut { bodies, cut }) = found else { return Vec::new() };
    let cut = cut.map(|(most, for_memory)| {
        let message = format!("bodies that touch each other are looked for among no more than {most} flat faces");
        let note = at_script(shot, Diagnostic { severity: Severity::Note, ..Diagnostic::warning(message) });
        if for_memory { note.help("memory is left for no more: allow more with --memory") } else { note }
    });
    left_out_contacts(shot, &bodies).into_iter().chain(cut).collect()
}

/// A warning about bodies of the first frame that touch others and are not set apart from them.
fn left_out_contacts(shot: &mut Shot, left_out: &[usize]) -> Option<Diagnostic> {
    let one = *left_out.first()?;
    let scene = shot.scene_of(1).ok()?;
    let label = |index: &usize| scene.entities.get(*index).map_or_else(String::new, |desc| desc.label(*index));
    let names: Vec<String> = left_out.iter().take(NAMED).map(label).collect();
    let more = if left_out.len() > NAMED { format!(" and {} more", left_out.len() - NAMED) } else { String::new() };
    let verb = if left_out.len() == 1 { "touches" } else { "touch" };
    let message = format!(
        "{}{more} {verb} other bodies and may flicker there: among more than {} flat faces, or {} pairs of them in one \
         plane, contacts are not looked for",
        names.join(", "),
        limits::CONTACT_FACES,
        limits::CONTACT_TESTS
    );
    let help = "leave a small gap between them, or let one reach into the other";
    let mut warning = Diagnostic::warning(message).help(help).about(ScenePart::Entity(one));
    shot.input.find_place(&mut warning, 1);
    Some(warning)
}

/// Whether nothing in the scene sends light to what is in it, though there is something.
fn is_dark(scene: &Scene) -> bool {
    let render = &scene.render;
    let is_path_traced = matches!(render.integrator, Integrator::Path | Integrator::Photon);
    let surroundings = render.background != DVec3::ZERO || render.has_environment();
    let emits = |material: &Material| material.emission != DVec3::ZERO;
    let is_lamp =
        |desc: &EntityDesc| Kind::ALL.iter().any(|kind| kind.role() == Role::Light && desc.get(*kind).is_some());
    let is_lit = is_path_traced && surroundings
        || scene.entities.iter().any(is_lamp)
        || scene.materials.iter().any(|(_, material)| emits(material));
    !is_lit && scene.entities.iter().any(|desc| shapes_of(desc).next().is_some())
}

/// Pairs of frames in which what moves is looked for.
const PAIRS: u32 = 3;

/// A warning about what differs from frame to frame and stands still while the shutter is open.
fn stepping(shot: &Shot, count: u32) -> Option<Diagnostic> {
    if !shot.is_sequence() || count < 2 {
        return None;
    }
    let mut steps: Option<Vec<Moved>> = None;
    for pair in 0..PAIRS.min(count - 1) {
        let frame = 1 + pair * (count - 1) / PAIRS.min(count - 1);
        let slices = shot.slices(frame).ok()?;
        let next = shot.slices(frame + 1).ok()?;
        let (first, last) = (slices.first()?, slices.last()?);
        let moved: Vec<Moved> = differing(&first.edits, &next.first()?.edits);
        let blurred = differing(&first.edits, &last.edits);
        // One picture after another without a shutter has nothing to blur.
        if slices.len() < 2 || moved.is_empty() {
            return None;
        }
        let alone = moved.into_iter().filter(|one| !blurred.contains(one));
        steps = Some(match steps {
            None => alone.collect(),
            Some(before) => alone.filter(|one| before.contains(one)).collect(),
        });
    }
    let Moved(part) = *steps?.first()?;
    let what = match part {
        ScenePart::Entity(index) => shot.input.program.as_ref()?.1.entities.get(index)?.label(index),
        ScenePart::Camera | ScenePart::Render | ScenePart::Material(_) => "the camera".into(),
    };
    let message =
        format!("{what} moves from frame to frame and stands still while the shutter is open: it is not blurred");
    let help = "let it move by `f.t` or `f.seconds`, which are those of each moment; `f.index` and `f.number` are not";
    let mut warning = Diagnostic::warning(message).help(help).about(part);
    shot.input.find_place(&mut warning, 1);
    Some(warning)
}

/// Something whose place may be another one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Moved(ScenePart);

/// What stands elsewhere under one list of edits than under another.
fn differing(from: &[Edit], to: &[Edit]) -> Vec<Moved> {
    let places = |edits: &[Edit]| -> FxHashMap<usize, Transform> {
        let place = |edit: &Edit| {
            let Edit::Put { entity, component: Component::Transform(transform) } = edit else { return None };
            Some((*entity, transform.clone()))
        };
        edits.iter().filter_map(place).collect()
    };
    let view = |edits: &[Edit]| {
        let view = |edit: &Edit| {
            let Edit::Camera(camera) = edit else { return None };
            Some([camera.from, camera.at, camera.up])
        };
        edits.iter().rev().find_map(view)
    };
    let (before, after) = (places(from), places(to));
    let moves = |(entity, place): (&usize, &Transform)| {
        before.get(entity).is_some_and(|known| known != place).then_some(Moved(ScenePart::Entity(*entity)))
    };
    let mut found: Vec<Moved> = after.iter().filter_map(moves).collect();
    found.sort_by_key(|Moved(part)| if let ScenePart::Entity(index) = part { *index } else { usize::MAX });
    let is_seen_from_elsewhere = view(from).zip(view(to)).is_some_and(|(a, b)| a != b);
    found.extend(is_seen_from_elsewhere.then_some(Moved(ScenePart::Camera)));
    found
}

/// What fog does that is hardly meant, and what to do about it.
fn idle_fog(scene: &Scene) -> Option<(&'static str, &'static str)> {
    let render = &scene.render;
    let fog = render.fog.as_ref().filter(|fog| fog.density > 0.0)?;
    if render.integrator == Integrator::Photon {
        let message = "`fog` scatters no light with `Photon`: things only fade into its color";
        return Some((message, "`integrator: Path` follows the light that fog scatters"));
    }
    let is_distant = |desc: &EntityDesc| desc.component::<DirectionalLight>().is_some();
    let surrounds =
        render.integrator == Integrator::Path && (render.has_environment() || render.background != DVec3::ZERO);
    let from_afar = surrounds || scene.entities.iter().any(is_distant);
    (from_afar && fog.bounds.is_none()).then_some((
        "`fog` without `bounds` reaches to infinity: no light from infinitely far gets through it",
        "give it a box: `fog: (density: 0.1, bounds: ((-20, -1, -20), (20, 10, 20)))`",
    ))
}

/// How something that counts for nothing is told.
enum Telling {
    AtItsPlace,
    /// The command line gives it.
    Alone,
    Never,
}

/// Formats with a place for every number leave none out, and settings of the command line are for a look at what is
/// written otherwise: neither is a mistake of whoever has written the scene.
fn ways(shot: &Shot, scene: &Scene, subject: &Subject) -> Telling {
    let is_by_hand = match &shot.input.scene_file {
        Some((path, _)) => path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ron")),
        None => true,
    };
    let overrides = &shot.input.overrides;
    let is_of_settings = matches!(subject.part, ScenePart::Render | ScenePart::Camera);
    if !is_by_hand || is_pinhole_by_choice(shot, subject) || is_of_file(shot, scene, subject) {
        Telling::Never
    } else if subject.field == Some("samples") && overrides.samples.is_some() {
        Telling::Alone
    } else if is_of_settings && overrides.change_light() {
        Telling::Never
    } else {
        Telling::AtItsPlace
    }
}

/// Whether it is of a material that comes with a mesh or an asset, and that the scene's own text does not name.
fn is_of_file(shot: &Shot, scene: &Scene, subject: &Subject) -> bool {
    let Some((path, _)) = &shot.input.scene_file else { return false };
    let whole = Subject { field: None, ..*subject };
    matches!(subject.part, ScenePart::Material(_)) && !load::is_written(path, scene, whole)
}

/// A field of the camera that the scene's own text gives.
fn camera_gives(shot: &Shot, field: &'static str) -> bool {
    let Some((path, _)) = &shot.input.scene_file else { return false };
    let subject = Subject { part: ScenePart::Camera, component: None, field: Some(field) };
    load::is_written(path, shot.input.base.scene(), subject)
}

/// Whether the scene says by itself that the lens is closed, which a script may open.
fn is_pinhole_by_choice(shot: &Shot, subject: &Subject) -> bool {
    let is_of_lens = ["focus", "focus_distance", "lens", "blades"].iter().any(|field| subject.field == Some(field));
    let is_closed = shot.input.base.scene().camera.lens_radius() == 0.0;
    subject.part == ScenePart::Camera && is_of_lens && is_closed && camera_gives(shot, "aperture")
}

/// A field of view that is the usual one, and is written beside a focal length all the same.
fn fov_as_usual(shot: &Shot, scene: &Scene) -> Option<Unused> {
    let camera = &scene.camera;
    let is_usual = camera.fov == Camera::default().fov && camera.focal_length.is_some() && camera.entity.is_none();
    let is_beside = is_usual && camera_gives(shot, "fov") && camera_gives(shot, "focal_length");
    is_beside.then(unused::hidden_fov).flatten()
}

/// Whether the material of an entity emits light.
fn shines(scene: &Scene, desc: &EntityDesc) -> bool {
    let worn = desc.get(Kind::MaterialName).and_then(MaterialName::of);
    let material = worn.and_then(|worn| scene.materials.iter().find(|(name, _)| *name == worn.0));
    material.is_some_and(|(_, material)| material.emission != DVec3::ZERO)
}

/// A warning about entities with names that stand outside the picture whenever it was looked at.
fn unseen(shot: &Shot, scenes: &[(u32, Scene)], count: usize) -> Option<Diagnostic> {
    let (first, scene) = scenes.first()?;
    // What a frame spawns has no number of its own: an entity is the same one while all scenes have as many.
    if scenes.iter().any(|(_, other)| other.entities.len() != scene.entities.len()) {
        return None;
    }
    // What is scattered without names may well lie anywhere, and what shines is meant to be seen by its light.
    let is_meant = |index: &usize| {
        let desc = &scene.entities[*index];
        let is_seen = desc.component::<Visible>().is_none_or(|visible| visible.camera != Some(false));
        is_seen && desc.name.is_some() && shapes_of(desc).next().is_some() && !shines(scene, desc)
    };
    let mut hidden: Vec<usize> = (0..scene.entities.len()).filter(is_meant).collect();
    for (_, scene) in scenes {
        let placements = Placements::new(scene);
        let view = View::new(&placements.camera(), scene.render.size);
        hidden.retain(|index| {
            let map = placements.of(*index);
            let bounds = |shape| world_bounds(shape, &map).is_some_and(|bounds| view.misses(bounds));
            shapes_of(&scene.entities[*index]).all(bounds)
        });
    }
    let one = *hidden.first()?;
    let names: Vec<String> = hidden.iter().take(NAMED).map(|index| scene.entities[*index].label(*index)).collect();
    let more = if hidden.len() > NAMED { format!(" and {} more", hidden.len() - NAMED) } else { String::new() };
    let frames = match (count, scenes.len()) {
        (1, _) => String::new(),
        (all, looked) if all == looked => format!(" in all {all} frames"),
        (all, looked) => format!(" in {looked} of {all} frames, spread over the sequence"),
    };
    let verb = if hidden.len() == 1 { "is" } else { "are" };
    let message = format!(
        "{}{more} {verb} outside the picture{frames}: only mirrors and shadows could show it",
        names.join(", ")
    );
    let mut warning = Diagnostic::warning(message).about(ScenePart::Entity(one));
    shot.input.find_place(&mut warning, *first);
    Some(warning)
}

/// What a camera sees.
struct View {
    /// Half spaces that hold all that is seen: normals inwards, and the least product of a point within and the normal.
    sides: Vec<(DVec3, f64)>,
    lens_radius: f64,
}

impl View {
    fn new(camera: &Camera, size: [u32; 2]) -> Self {
        let aspect = f64::from(size[0]) / f64::from(size[1].max(1));
        let axis = camera.axis();
        let right = axis.cross(camera.up).normalize_or(DVec3::X);
        let up = right.cross(axis);
        let perspective = camera.half_height(aspect);
        let parallel = camera.half_extent(aspect);
        let shift = camera.shift * 2.0;
        let from = camera.from;
        // By direction across the picture: how many halves of it lie that way.
        let ways = [(right, aspect, shift.x), (-right, aspect, -shift.x), (up, 1.0, shift.y), (-up, 1.0, -shift.y)];
        let side = |(way, scale, shift): (DVec3, f64, f64)| match camera.projection {
            Projection::Perspective => {
                let normal = (axis * (perspective * scale * (1.0 + shift)) - way).normalize_or_zero();
                Some((normal, from.dot(normal)))
            }
            Projection::Orthographic => Some((-way, -from.dot(way) - parallel * scale * (1.0 + shift))),
            Projection::Equirectangular => None,
        };
        let ahead = (camera.projection != Projection::Equirectangular).then_some((axis, from.dot(axis)));
        let sides = ways.into_iter().filter_map(side).chain(ahead).collect();
        View { sides, lens_radius: camera.lens_radius() }
    }

    /// Whether a box lies outside. With an open lens whatever is near enough may show, so that sides give way by its width.
    fn misses(&self, [min, max]: [DVec3; 2]) -> bool {
        self.sides.iter().any(|(normal, least)| {
            let nearest = (min * *normal).max(max * *normal).element_sum();
            nearest - least < -4.0 * self.lens_radius
        })
    }
}
