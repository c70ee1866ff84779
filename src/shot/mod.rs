//! A shot: one input, its frames as data, and their way to pictures.
//!
//! Every frame is evaluated before the first is rendered, so that a mistake in frame 37 is known at once and nothing
//! is written. A frame starts from the same World: its edits are applied, it is rendered, they are taken back; where the
//! shutter is open, so for each of its [`Slice`]s of time. While one frame is rendered the one before is encoded and
//! written.

pub mod run;
mod shutter;

use std::path::Path;
use std::sync::Arc;

use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::components::{Accel, Aov, Edit, Integrator, Render, Scene};
use crate::load;
use crate::script::Program;
use crate::systems::{self, Stage};
pub use shutter::Slice;

/// Settings of the command line; they have the last word in every frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    pub size: Option<[u32; 2]>,
    pub samples: Option<u32>,
    pub seed: Option<u64>,
    pub integrator: Option<Integrator>,
    pub accel: Option<Accel>,
    pub light_size: Option<f64>,
    pub bit_depth: Option<u32>,
    pub aovs: Option<Vec<Aov>>,
    pub denoise: Option<bool>,
}

impl Overrides {
    fn apply(&self, render: Render) -> Render {
        Render {
            size: self.size.unwrap_or(render.size),
            samples: self.samples.unwrap_or(render.samples),
            seed: self.seed.or(render.seed),
            integrator: self.integrator.unwrap_or(render.integrator),
            accel: self.accel.unwrap_or(render.accel),
            light_size: self.light_size.unwrap_or(render.light_size),
            bit_depth: self.bit_depth.unwrap_or(render.bit_depth),
            aovs: self.aovs.clone().unwrap_or(render.aovs),
            denoise: self.denoise.unwrap_or(render.denoise),
            ..render
        }
    }
}

/// An input that is open: a script with its scene, or a scene alone.
pub struct Shot {
    /// Name of the input without its ending.
    pub name: String,
    /// File name of the input.
    pub source: String,
    pub stage: Stage,
    script: Option<(Program, Arc<Scene>)>,
    overrides: Overrides,
}

/// Opens a script or a scene; gives it with the warnings of its scene.
///
/// # Errors
/// Every mistake in the input, each with its place.
pub fn open(
    input: &Path,
    defines: &[(String, String)],
    strict: bool,
    overrides: Overrides,
) -> Result<(Shot, Diagnostics), Diagnostics> {
    let name = input.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let source = input.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let is_script = input.extension().is_some_and(|e| e.eq_ignore_ascii_case("rhai"));
    if !is_script {
        if let Some((define, _)) = defines.first() {
            let message = format!("-D {define}: only a script has parameters, and {source} is a scene");
            return Err(Diagnostic::error(message).because(crate::base::diagnostics::Cause::Usage).into());
        }
        let (scene, warnings) = load::load_scene(input, strict)?;
        let stage = systems::spawn(scene)?;
        return Ok((Shot { name, source, stage, script: None, overrides }, warnings));
    }
    let program = Program::open(input, defines)?;
    let (scene, warnings) = match program.scene_path()? {
        Some(path) => load::load_scene(&path, strict)?,
        None => {
            let base = input.parent().unwrap_or(Path::new("")).to_path_buf();
            (Scene { base, ..Scene::default() }, Diagnostics::default())
        }
    };
    let scene = Arc::new(scene);
    let edits = program.setup(&scene)?;
    let mut stage = systems::spawn(Arc::unwrap_or_clone(scene))?;
    systems::animate(&mut stage, edits)?;
    let rest = Arc::new(systems::collect(&stage));
    if rest.entities.len() != stage.entity_count() {
        // What setup removed leaves no gap in the numbers that frames count by.
        stage = systems::spawn(Scene::clone(&rest))?;
    }
    Ok((Shot { name, source, stage, script: Some((program, rest)), overrides }, warnings))
}

impl Shot {
    pub fn is_sequence(&self) -> bool {
        self.script.is_some()
    }

    /// Number of frames; 1 for a scene alone.
    pub fn frames(&self) -> u32 {
        self.script.as_ref().map_or(1, |(program, _)| program.header().frames)
    }

    /// The edits of a frame, counted from 1, at `offset` frames from its own time: those of the script, then those of the
    /// command line.
    ///
    /// # Errors
    /// A mistake in the script, with its place and the frame.
    pub fn edits(&self, frame: u32, offset: f64) -> Result<Vec<Edit>, Diagnostics> {
        let mut edits = match &self.script {
            Some((program, rest)) => program.frame(rest, frame, offset)?,
            None => Vec::new(),
        };
        let render = shutter::last_render(&edits).cloned().unwrap_or_else(|| self.stage.settings());
        let changed = self.overrides.apply(render.clone());
        if changed != render {
            edits.push(Edit::Render(changed));
        }
        Ok(edits)
    }

    /// Evaluates and applies every moment of these frames without rendering it.
    ///
    /// # Errors
    /// The mistakes of the first frame that has any.
    pub fn check(&mut self, frames: &[u32]) -> Result<(), Diagnostics> {
        for frame in frames {
            self.each_slice(*frame, |stage, _| systems::check(stage).map(|()| true))?;
        }
        Ok(())
    }

    /// The World of one frame as a scene, at the frame's own time.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub fn scene_of(&mut self, frame: u32) -> Result<Scene, Diagnostics> {
        let edits = self.edits(frame, 0.0)?;
        let named = self.is_sequence();
        let taken_back = systems::animate(&mut self.stage, edits)
            .map_err(|problems| if named { shutter::in_frame(frame, problems) } else { problems })?;
        let scene = systems::collect(&self.stage);
        systems::undo(&mut self.stage, taken_back);
        Ok(scene)
    }
}
