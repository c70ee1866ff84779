//! RON scenes.
//!
//! One serde pass reads a scene that is right. If it is wrong, `explain` reads it again piece by piece, so that
//! every mistake is reported, each at its own place.

pub mod edit;
mod explain;

use ::ron::extensions::Extensions;
use serde::Deserialize;
use serde::de::{Error as _, MapAccess, Visitor};

use super::assemble::{self, Wrong};
use super::resolve::Problem;
use super::spans;
use crate::base::diagnostics::{Diagnostic, Diagnostics, Place};
use crate::base::project::Folder;
use crate::components::*;

/// How RON is read and written: `Some` and the names of one-field tuples may be left out.
pub(super) fn options() -> ::ron::Options {
    let extensions = Extensions::IMPLICIT_SOME | Extensions::UNWRAP_NEWTYPES | Extensions::UNWRAP_VARIANT_NEWTYPES;
    ::ron::Options::default().with_default_extension(extensions)
}

/// Sections of a scene file.
const SECTIONS: [&str; 5] = ["camera", "cameras", "render", "materials", "entities"];

#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields, rename = "Scene")]
struct SceneFile {
    camera: Camera,
    cameras: Named<Camera>,
    render: Render,
    materials: Named<Material>,
    entities: Vec<EntityDesc>,
}

/// Things with names, in the order of the file.
struct Named<T>(Vec<(Text, T)>);

impl<T> Default for Named<T> {
    fn default() -> Self {
        Named(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Named<T> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder<T>(std::marker::PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for InOrder<T> {
            type Value = Named<T>;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a map of names: { \"name\": (...) }")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Named<T>, A::Error> {
                let mut all: Vec<(Text, T)> = Vec::new();
                let mut names = rustc_hash::FxHashSet::default();
                while let Some((name, one)) = map.next_entry::<Text, T>()? {
                    if !names.insert(name.clone()) {
                        return Err(A::Error::custom(format!("`{name}` is there twice")));
                    }
                    all.push((name, one));
                }
                Ok(Named(all))
            }
        }
        deserializer.deserialize_map(InOrder(std::marker::PhantomData))
    }
}

/// Reads a RON scene; `file` is what diagnostics call it, `base` the folder of the files that it names.
///
/// # Errors
/// Every mistake in it, each with its place.
pub fn parse(text: &str, file: &str, base: &Folder) -> Result<(Scene, Diagnostics), Diagnostics> {
    let read = match options().from_str::<SceneFile>(text) {
        Ok(read) => read,
        Err(error) => {
            let (mut found, scene) = explain::explain(text, file, &error);
            // A piece that could not be read is at its default, which is right: what is wrong here was read.
            let Some(mut scene) = scene else { return Err(in_order(found)) };
            scene.base = base.clone();
            let expanded = assemble::expanded(&mut scene);
            found.0.extend(placed(text, file, expanded.problems).0);
            found = in_order(found);
            found.0.extend(expanded.found.0);
            return Err(found);
        }
    };
    let SceneFile { camera, cameras: Named(cameras), render, materials: Named(materials), entities } = read;
    let (base, images) = (base.clone(), ImageCache::default());
    let mut scene = Scene { camera, cameras, render, materials, entities, base, images };
    match assemble::assemble(&mut scene) {
        Ok(warnings) => Ok((scene, Diagnostics(warnings))),
        Err(Wrong { problems, found }) => {
            let mut all = placed(text, file, problems);
            all.0.extend(found.0);
            Err(all)
        }
    }
}

/// Problems of a scene with their places in its text.
fn placed(text: &str, file: &str, problems: Vec<Problem>) -> Diagnostics {
    let tree = spans::parse(text).ok();
    let diagnostic = |problem: Problem| -> Diagnostic {
        let span = tree.as_ref().map(|tree| tree.locate(&problem.path));
        let here = span.map_or(Place::file(file), |(start, end)| Place::of_span(file, text, start, end));
        match problem.inside.clone() {
            None => problem.diagnostic().at(here),
            Some(inside) if inside.line == 0 => {
                let message = format!("{}: {}", inside.file, problem.message);
                Problem { message, ..problem }.diagnostic().at(here)
            }
            Some(inside) => {
                let named = format!("the file is named in {}:{}:{}", here.file, here.line, here.column);
                let help = problem.help.clone().map_or(named.clone(), |help| format!("{help}; {named}"));
                problem.help(Some(help)).diagnostic().at(*inside)
            }
        }
    };
    in_order(Diagnostics(problems.into_iter().map(diagnostic).collect()))
}

fn in_order(mut all: Diagnostics) -> Diagnostics {
    all.0.sort_by_key(|d| d.place.as_ref().map_or((0, 0), |p| (p.line, p.column)));
    all
}

#[cfg(test)]
mod tests;
