//! `anim dump` and `anim convert`: scenes as RON.

use std::path::{Path, PathBuf};

use super::{AccessArguments, Exit, InputArguments, print, say, say_printed, usage};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::project::Project;
use crate::components::Scene;
use crate::load;
use crate::output::write_atomic;
use crate::shot::Overrides;

#[derive(clap::Args)]
pub struct DumpArguments {
    #[command(flatten)]
    input: InputArguments,
    /// Which frame of a script
    #[arg(long, value_name = "N", default_value_t = 1)]
    frame: u32,
    /// Write to a file instead of stdout
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(clap::Args)]
pub struct ConvertArguments {
    /// A scene (.ron, .nff, .p3f) or a model (.gltf, .glb, .obj, .ply, .stl, .aff)
    scene: PathBuf,
    /// Refuse what a tolerant reader of NFF and P3F skips with a warning
    #[arg(long)]
    strict: bool,
    /// Write to a file instead of stdout
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    access: AccessArguments,
}

pub fn dump(arguments: DumpArguments) -> Result<Exit, Diagnostics> {
    let options = arguments.input.options(Overrides::default())?;
    let (mut shot, warnings) = super::open(&arguments.input.input, options)?;
    say(&warnings);
    if !(1..=shot.frames()).contains(&arguments.frame) {
        return Err(usage(format!("--frame {}: the sequence has frames 1 to {}", arguments.frame, shot.frames())));
    }
    let scene = shot.scene_of(arguments.frame);
    say_printed(&shot, arguments.input.log.as_deref())?;
    let scene = scene?;
    write(&scene, arguments.out.as_deref(), load::write::to_ron)
}

pub fn convert(arguments: ConvertArguments) -> Result<Exit, Diagnostics> {
    let project = Project::of(&arguments.scene, &arguments.access.access())?;
    let (scene, warnings) = load::load_scene_in(&arguments.scene, arguments.strict, &project)?;
    say(&warnings);
    write(&scene, arguments.out.as_deref(), load::write::to_editable_ron)
}

fn write(
    scene: &Scene,
    out: Option<&Path>,
    to_ron: impl Fn(&Scene, Option<&Path>) -> Result<String, Diagnostic>,
) -> Result<Exit, Diagnostics> {
    match out {
        None => print(&to_ron(scene, None)?),
        Some(path) => {
            let folder = path.parent().unwrap_or(Path::new(""));
            write_atomic(path, to_ron(scene, Some(folder))?.as_bytes())?;
        }
    }
    Ok(Exit::Done)
}
