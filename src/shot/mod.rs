//! A shot: one input, its frames as data, and their way to pictures.
//!
//! Every frame is evaluated before the first is rendered ([`plan`]), so that a mistake in frame 37 is known at once; the
//! frames without one are rendered all the same. The evaluation leaves a digest of each frame ([`fingerprint`]): frames that
//! lie finished under their names are kept, frames that are the same are rendered once ([`run`]), and frames that differ in
//! little share most of their work ([`reuse`]). A frame starts from the same World: its edits are
//! applied, it is rendered, they are taken back; where the shutter is open, so for each of its [`Slice`]s of time. While
//! one frame is rendered the one before is encoded and written.

pub mod advice;
pub mod animation_measures;
mod assets;
mod bands;
mod checkpoints;
pub mod chunks;
mod description;
mod files;
pub mod fingerprint;
mod glass;
mod idle;
mod linked_tags;
pub mod live;
mod moments;
mod overrides;
mod parts;
mod placements;
pub mod plan;
pub mod reuse;
pub mod run;
pub mod set;
mod shutter;
mod unused;
mod unused_material;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use assets::Assets;
use fingerprint::{BaseFingerprint, Fingerprint};
pub use overrides::Overrides;
pub use shutter::Slice;

use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics, ScenePart};
use crate::base::limits;
use crate::base::project::{Access, FileRole, Folder, Project};
use crate::base::rate::Rate;
use crate::components::{Camera, Edit, Render, Scene};
use crate::load;
use crate::load::mesh::MeshFiles;
use crate::output::names::Target;
use crate::script::{ClipFrames, Evaluation, Parameter, Program};
use crate::systems::{self, Stage};

/// How an input is opened.
#[derive(Clone, Debug, Default)]
pub struct OpenOptions {
    /// Values of the script's parameters.
    pub defines: Vec<(String, String)>,
    /// Refuse what a tolerant reader of NFF and P3F skips with a warning.
    pub strict: bool,
    /// What the command line gives over the script and the scene.
    pub overrides: Overrides,
    /// What may be read.
    pub access: Access,
    /// Where the script is evaluated.
    pub evaluation: Evaluation,
    /// A temporary folder that the input lies in, which is there for as long as the shot is open.
    pub unpacked: Option<Arc<tempfile::TempDir>>,
    /// Keep the scene as its file says it, for [`Shot::authored`].
    pub keep_scene: bool,
}

/// An input that is open: a script with its scene, or a scene alone.
pub struct Shot {
    /// Name of the input without its ending.
    pub name: String,
    /// File name of the input.
    pub source: String,
    /// The World, as `setup` left it.
    pub stage: Stage,
    input: Input,
    path: PathBuf,
    project: Arc<Project>,
    authored: Option<Arc<Scene>>,
    /// Removed when the shot is closed: it is the last field, so that whoever reads files there is gone by then.
    _unpacked: Option<Arc<tempfile::TempDir>>,
}

/// What frames are made from, whatever World they are made in.
struct Input {
    program: Option<(Program, Arc<Scene>)>,
    base: BaseFingerprint,
    settings: Render,
    overrides: Overrides,
    /// Files of meshes that the script chooses.
    meshes: MeshFiles,
    scene_file: Option<(PathBuf, Arc<Project>)>,
    /// Entities have the numbers that they have in the scene's text: `setup` has removed none.
    entities_as_written: bool,
}

/// Opens a script or a scene as [`open_with`], in its usual project and in this process.
///
/// # Errors
/// As [`open_with`].
pub fn open(
    input: &Path,
    defines: &[(String, String)],
    strict: bool,
    overrides: Overrides,
) -> Result<(Shot, Diagnostics), Diagnostics> {
    open_with(input, OpenOptions { defines: defines.to_vec(), strict, overrides, ..OpenOptions::default() })
}

/// Opens a script or a scene; gives it with the warnings of its scene.
///
/// # Errors
/// Every mistake in the input, each with its place.
pub fn open_with(input: &Path, options: OpenOptions) -> Result<(Shot, Diagnostics), Diagnostics> {
    let project = Project::of(input, &options.access)?;
    open_in(input, options, project)
}

/// As [`open_with`], in a project that is known: the files that were looked for are known to it even where opening fails.
///
/// # Errors
/// As [`open_with`].
pub fn open_in(input: &Path, options: OpenOptions, project: Arc<Project>) -> Result<(Shot, Diagnostics), Diagnostics> {
    let OpenOptions { defines, strict, overrides, access: _, evaluation, keep_scene, unpacked: _unpacked } = options;
    let path = input.to_path_buf();
    let name = input.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let source = input.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let ends_in = |ending: &str| input.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    if ends_in("aff") {
        let keep = Keep { scene: keep_scene, unpacked: _unpacked };
        return open_clip(input, &defines, strict, overrides, project, keep);
    }
    if !ends_in("rhai") {
        if let Some((define, _)) = defines.first() {
            let message = format!("-D {define}: only a script has parameters, and {source} is a scene");
            return Err(Diagnostic::error(message).because(Cause::Usage).into());
        }
        load::check_ending(input)?;
        let (scene, warnings) = load::load_scene_in(input, strict, &project)?;
        let scene = Arc::new(scene);
        let base = BaseFingerprint::new(scene.clone(), Assets::new(scene.base.clone())).without_entities();
        let settings = scene.render.clone();
        let authored = keep_scene.then(|| scene.clone());
        let stage = systems::spawn(Arc::unwrap_or_clone(scene))?;
        let scene_file = Some((path.clone(), project.clone()));
        let (meshes, entities_as_written) = (MeshFiles::default(), true);
        let input = Input { program: None, base, settings, overrides, meshes, scene_file, entities_as_written };
        return Ok((Shot { name, source, stage, input, path, project, authored, _unpacked }, warnings));
    }
    let program = Program::open(input, &defines, &project, &evaluation)?;
    let scene_file = program.scene_path()?;
    let (scene, warnings) = match &scene_file {
        Some((path, project)) => load::load_scene_in(path, strict, project).map_err(|mut problems| {
            for problem in problems.0.iter_mut().filter(|problem| problem.place.is_none()) {
                problem.place = Some(program.place_of_scene());
            }
            problems
        })?,
        None => {
            let base = Folder::around(input, project.clone());
            (Scene { base, ..Scene::default() }, Diagnostics::default())
        }
    };
    let scene = Arc::new(scene);
    let meshes = MeshFiles::default();
    let edits = meshes.complete(&scene, program.setup(&scene)?);
    let edits = edits.map_err(|problems| in_setup(&program, &scene, problems))?;
    let mut stage = systems::spawn(Scene::clone(&scene))?;
    systems::animate(&mut stage, edits).map_err(|problems| in_setup(&program, &scene, problems))?;
    let authored = keep_scene.then_some(scene);
    let rest = Arc::new(systems::collect(&stage));
    let entities_as_written = rest.entities.len() == stage.entity_count();
    if !entities_as_written {
        // What setup removed leaves no gap in the numbers that frames count by.
        stage = systems::spawn(Scene::clone(&rest))?;
    }
    let settings = rest.render.clone();
    let base = BaseFingerprint::new(rest.clone(), Assets::new(rest.base.clone()));
    let program = Some((program, rest));
    let input = Input { program, base, settings, overrides, meshes, scene_file, entities_as_written };
    Ok((Shot { name, source, stage, input, path, project, authored, _unpacked }, warnings))
}

/// Mistakes that what `setup` has built has, with the places where it did.
fn in_setup(program: &Program, scene: &Arc<Scene>, mut problems: Diagnostics) -> Diagnostics {
    for problem in problems.0.iter_mut().filter(|problem| problem.place.is_none()) {
        let subjects = problem.about.take().unwrap_or_default();
        let place = subjects.0.iter().find_map(|subject| program.place_of(scene, None, *subject));
        problem.place = Some(place.unwrap_or_else(|| program.place()));
    }
    problems
}

/// What a shot keeps beside what its frames are made from.
struct Keep {
    scene: bool,
    unpacked: Option<Arc<tempfile::TempDir>>,
}

/// Opens a file that is a sequence without a script.
fn open_clip(
    input: &Path,
    defines: &[(String, String)],
    strict: bool,
    overrides: Overrides,
    project: Arc<Project>,
    keep: Keep,
) -> Result<(Shot, Diagnostics), Diagnostics> {
    let frames = frames_of(defines)?;
    let (scene, warnings, show) = load::load_aff_in(input, strict, &project)?;
    let name = input.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let source = input.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let entity = scene.entities.first().and_then(|desc| desc.name.clone()).unwrap_or_else(|| name.as_str().into());
    let clip = ClipFrames { entity, clip: load::aff::CLIP.into(), span: show.time };
    let program = Program::of_clip(clip, frames.unwrap_or(show.frames), input, &project);
    let rest = Arc::new(scene);
    let (authored, _unpacked) = (keep.scene.then(|| rest.clone()), keep.unpacked);
    let stage = systems::spawn(Scene::clone(&rest))?;
    let base = BaseFingerprint::new(rest.clone(), Assets::new(rest.base.clone()));
    let settings = rest.render.clone();
    let (path, meshes) = (input.to_path_buf(), MeshFiles::default());
    let program = Some((program, rest));
    let (scene_file, entities_as_written) = (Some((path.clone(), project.clone())), true);
    let input = Input { program, base, settings, overrides, meshes, scene_file, entities_as_written };
    Ok((Shot { name, source, stage, input, path, project, authored, _unpacked }, warnings))
}

/// The number of frames that `-D frames=N` gives a sequence without a script.
fn frames_of(defines: &[(String, String)]) -> Result<Option<u32>, Diagnostics> {
    let usage = |message: String| Diagnostics::from(Diagnostic::error(message).because(Cause::Usage));
    let mut frames = None;
    for (name, value) in defines {
        if name != "frames" {
            return Err(usage(format!("-D {name}: this file has no parameter but `frames`")));
        }
        let count = value.parse().ok().filter(|count| (1..=limits::FRAMES).contains(count));
        let expected = || usage(format!("-D frames={value}: expected a whole number from 1 to {}", limits::FRAMES));
        frames = Some(count.ok_or_else(expected)?);
    }
    Ok(frames)
}

impl Input {
    /// The edits of a frame, counted from 1, at its own time.
    ///
    /// # Errors
    /// A mistake in the script, with its place and the frame.
    fn edits(&self, frame: u32) -> Result<Vec<Edit>, Diagnostics> {
        self.edits_at(frame, 0.0)
    }

    /// The edits at `offset` frames from a frame's own time: those of the script, then those of the command line.
    ///
    /// # Errors
    /// As [`Self::edits`].
    fn edits_at(&self, frame: u32, offset: f64) -> Result<Vec<Edit>, Diagnostics> {
        let mut edits = match &self.program {
            Some((program, rest)) => {
                let edits = program.frame(rest, frame, offset)?;
                self.meshes.complete(rest, edits).map_err(|problems| self.in_frame(frame, problems))?
            }
            None => Vec::new(),
        };
        if let Some(camera) = self.chosen_camera(&edits)? {
            edits.push(Edit::Camera(camera));
        }
        let render = shutter::last_render(&edits).cloned().unwrap_or_else(|| self.settings.clone());
        let changed = self.overrides.apply(render.clone());
        if changed != render {
            edits.push(Edit::Render(changed));
        }
        Ok(edits)
    }

    /// The camera that the command line chooses, as the edits of a frame leave it.
    ///
    /// # Errors
    /// A name that no camera has.
    fn chosen_camera(&self, edits: &[Edit]) -> Result<Option<Camera>, Diagnostics> {
        let Some(name) = self.overrides.camera.as_deref() else { return Ok(None) };
        let scene = self.base.scene();
        let written = edits.iter().rev().find_map(|edit| if let Edit::Cameras(all) = edit { Some(all) } else { None });
        let named = written.and_then(|all| all.iter().find(|(known, _)| &**known == name)).map(|(_, camera)| camera);
        match named.or_else(|| scene.camera_named(name)) {
            Some(camera) => Ok(Some(camera.clone())),
            None => {
                let problem = Diagnostic::error(format!("--camera {name}: there is no such camera"));
                Err(problem.suggest(name, scene.cameras.iter().map(|(known, _)| &**known)).because(Cause::Usage).into())
            }
        }
    }

    /// Makes a frame in a World of this input and does something with it; then the frame's edits are taken back.
    ///
    /// # Errors
    /// A mistake in the frame; a panic in the work, which is a mistake of the program.
    fn with_frame<T>(
        &self,
        stage: &mut Stage,
        frame: u32,
        edits: Vec<Edit>,
        work: impl FnOnce(&mut Stage) -> Result<T, Diagnostics>,
    ) -> Result<T, Diagnostics> {
        let taken_back = systems::animate(stage, edits).map_err(|problems| self.in_frame(frame, problems))?;
        let done = guarded(stage, work);
        systems::undo(stage, taken_back);
        done.map_err(|problems| self.in_frame(frame, problems))
    }

    fn in_frame(&self, frame: u32, mut problems: Diagnostics) -> Diagnostics {
        for problem in &mut problems.0 {
            self.find_place(problem, frame);
            if self.program.is_some() {
                problem.message = format!("in frame {frame}: {}", problem.message);
            }
        }
        problems
    }

    /// A mistake that the World has is of what the frame's script wrote last, or else of what the scene says.
    fn find_place(&self, problem: &mut Diagnostic, frame: u32) {
        let Some(subjects) = problem.about.take().filter(|_| problem.place.is_none()) else { return };
        let subjects = subjects.0;
        let by_script = self.program.as_ref().and_then(|(program, rest)| {
            subjects.iter().find_map(|subject| program.place_of(rest, Some((frame, 0.0)), *subject))
        });
        let by_scene = || {
            let (path, project) = self.scene_file.as_ref()?;
            let (scene, _) = load::load_scene_in(path, false, project).ok()?;
            let is_as_written = |part| match part {
                ScenePart::Entity(index) => self.entities_as_written && index < scene.entities.len(),
                ScenePart::Material(index) => index < scene.materials.len(),
                ScenePart::Camera | ScenePart::Render => true,
            };
            let subject = subjects.iter().find(|subject| is_as_written(subject.part))?;
            load::place_of(path, &scene, *subject)
        };
        let by_name = || self.program.as_ref().map(|(program, _)| program.place());
        problem.place = by_script.or_else(by_scene).or_else(by_name);
    }

    /// A frame as data, of which nobody says that it can be rendered; `None` if its script is wrong.
    fn fingerprint(&self, frame: u32) -> Option<Fingerprint> {
        let slices = self.slices(frame).ok()?;
        let fingerprints: Vec<Fingerprint> = slices.iter().map(|slice| slice.fingerprint(&self.base)).collect();
        Some(Fingerprint::of_moments(&fingerprints))
    }

    /// Evaluates and applies all moments of a frame without rendering it; with a target, its file must be able to hold it.
    ///
    /// # Errors
    /// The mistakes of the frame.
    fn evaluate(&self, stage: &mut Stage, frame: u32, target: Option<&Target>) -> Result<Fingerprint, Diagnostics> {
        let slices = self.slices(frame)?;
        let fingerprints: Vec<Fingerprint> = slices.iter().map(|slice| slice.fingerprint(&self.base)).collect();
        self.with_slices(stage, frame, slices, |stage, _| {
            systems::check(stage)?;
            files::load_all(stage)?;
            target.map_or(Ok(()), |target| run::check_settings(&stage.settings(), &target.path(frame)))?;
            Ok(true)
        })?;
        Ok(Fingerprint::of_moments(&fingerprints))
    }
}

/// Does work on a World. If it panics, only its own frame is lost: what was derived from the World is made anew.
fn guarded<T>(stage: &mut Stage, work: impl FnOnce(&mut Stage) -> Result<T, Diagnostics>) -> Result<T, Diagnostics> {
    catch_unwind(AssertUnwindSafe(|| work(stage))).unwrap_or_else(|cause| {
        systems::forget(stage);
        Err(panic_diagnostic(&*cause).into())
    })
}

fn panic_diagnostic(cause: &(dyn std::any::Any + Send)) -> Diagnostic {
    let text = cause.downcast_ref::<String>().map(String::as_str).or(cause.downcast_ref::<&str>().copied());
    let text = text.unwrap_or("no reason given");
    Diagnostic::bug(format!("the renderer failed: {text}"))
}

impl Shot {
    /// Every file that the shot is made of, as far as it was evaluated: its path and what it is read as. Files that were
    /// looked for and are not there are among them: should one appear, the shot may be another.
    pub fn files(&self) -> Vec<(PathBuf, FileRole)> {
        self.project.files()
    }

    /// The input's path as seen from the project's root: what tells apart two of one name.
    pub fn input_path(&self) -> String {
        self.project.shown(&self.path).to_string_lossy().replace('\\', "/")
    }

    /// The project that the shot belongs to.
    pub fn project(&self) -> &Project {
        &self.project
    }

    /// Whether it is a script, and not a scene alone.
    pub fn is_sequence(&self) -> bool {
        self.input.program.is_some()
    }

    /// Number of frames; 1 for a scene alone.
    pub fn frames(&self) -> u32 {
        self.input.program.as_ref().map_or(1, |(program, _)| program.header().frames)
    }

    /// Parameters that the script has declared so far, in the order of their declaration; none for a scene.
    pub fn parameters(&self) -> Vec<Parameter> {
        self.input.program.as_ref().map_or_else(Vec::new, |(program, _)| program.parameters())
    }

    /// What the script has printed since this was asked last, a line for each distinct one.
    pub fn take_printed(&self) -> Vec<String> {
        self.input.program.as_ref().map_or_else(Vec::new, |(program, _)| program.take_printed())
    }

    /// Frames per second of a sequence; `None` for a scene alone.
    pub fn rate(&self) -> Option<Rate> {
        self.input.program.as_ref().map(|(program, _)| program.header().rate)
    }

    /// The World of one frame as a scene, at the frame's own time.
    ///
    /// # Errors
    /// The mistakes of the frame.
    pub fn scene_of(&mut self, frame: u32) -> Result<Scene, Diagnostics> {
        let edits = self.input.edits(frame)?;
        self.input.with_frame(&mut self.stage, frame, edits, |stage| Ok(systems::collect(stage)))
    }
}

#[cfg(test)]
mod tests;
