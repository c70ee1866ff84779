//! What every scene goes through, whatever its text was: assets are taken in, all is checked, files are read.

use super::asset::Expanded;
use super::resolve::{self, Problem};
use super::{asset, image, mesh};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::components::*;

/// What is wrong with a scene.
pub struct Wrong {
    /// In its own text.
    pub problems: Vec<Problem>,
    /// In files that it names, and what of them is not used.
    pub found: Diagnostics,
}

/// Takes in the assets of a scene and checks all that can be checked without reading more.
pub fn expanded(scene: &mut Scene) -> Expanded {
    let mut expanded = asset::expand(scene);
    // Where an asset is missing, so is all that others say of it.
    if expanded.problems.is_empty() && !expanded.found.has_errors() {
        expanded.problems = resolve::check(scene);
    }
    expanded
}

/// Completes a scene as it was written by all that it names; gives what of that is not used.
///
/// # Errors
/// All that is wrong.
pub fn assemble(scene: &mut Scene) -> Result<Vec<Diagnostic>, Wrong> {
    let Expanded { mut problems, mut found, documents } = expanded(scene);
    if problems.is_empty() && !found.has_errors() {
        let (of_meshes, warnings) = mesh::load_all(scene);
        problems = of_meshes;
        problems.extend(image::load_all(scene, &documents));
        problems.extend(environment_problem(scene));
        found.0.extend(warnings);
    }
    if problems.is_empty() && !found.has_errors() { Ok(found.0) } else { Err(Wrong { problems, found }) }
}

/// What is wrong with the environment that a scene names.
fn environment_problem(scene: &mut Scene) -> Option<Problem> {
    let name = scene.render.environment.as_ref()?;
    let decoded = scene.render.transfer == Transfer::Srgb;
    let problem = image::read_surroundings(&mut scene.images, &scene.base, name, decoded).err()?;
    let path = vec![resolve::key("render"), resolve::key("environment")];
    Some(Problem::new(path, problem.message).help(problem.help))
}
