//! `anim set`: values of a scene file, in place.

use std::path::PathBuf;

use super::{AccessArguments, Exit, print};
use crate::base::diagnostics::Diagnostics;
use crate::base::project::Project;
use crate::load::ron::edit::{Assignment, ValueChange};
use crate::shot::set::{SceneEdit, edit_scene, replace_text};

#[derive(clap::Args)]
#[command(
    after_help = "Everything else in the file stays as it is: comments, order, spacing. A value that is not there yet is added. \
            Nothing is written unless the whole scene is good afterwards.

A path is words with points between them; entities are meant by name or number, from 0:
  camera.focus_distance=3.2            render.samples=64
  materials.brass.color='(1, 0.8, 0.4)'     materials.\"dark wood\".color='#553311'
  entities.key.area_light.size='(2, 2)'     'entities[3].sphere.radius=2'
  entities.king.transform.translation.y=1   entities.king.material=brass

Examples:
  anim set scene.ron camera.focus_distance=3.2 'entities.key.area_light.color=(6, 5, 4)'
  anim set scene.ron materials.brass.roughness=0.3 --dry-run"
)]
pub struct SetArguments {
    /// A RON scene
    scene: PathBuf,
    /// What is set, and to what
    #[arg(required = true, value_name = "PATH=VALUE", value_parser = Assignment::parse)]
    assignments: Vec<Assignment>,
    /// Say what would change, and write nothing
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    access: AccessArguments,
}

pub fn run(arguments: &SetArguments) -> Result<Exit, Diagnostics> {
    let SetArguments { scene, assignments, dry_run, access } = arguments;
    let project = Project::of(scene, &access.access())?;
    let SceneEdit { before, after, changes } = edit_scene(scene, assignments, &project)?;
    if before != after && !dry_run {
        replace_text(scene, &before, &after)?;
    }
    changes.iter().for_each(|change| print(&line(change)));
    Ok(Exit::Done)
}

/// `scene.ron:3:9: camera.fov = 30 (was 40)`
fn line(change: &ValueChange) -> String {
    let ValueChange { path, place, before, after } = change;
    let was = match before {
        Some(before) if before == after => " (as it was)".into(),
        Some(before) => format!(" (was {})", before.split_whitespace().collect::<Vec<_>>().join(" ")),
        None => " (new)".into(),
    };
    format!("{}:{}:{}: {path} = {after}{was}\n", place.file, place.line, place.column)
}
