//! One table of what a script can call: each function stands in it once, with its registration, its page of the guide
//! and an example that runs as a test.

use ::rhai::Engine;

/// A function of the API, as the engine is given it and as the guide shows it.
pub struct Function {
    /// As it is called.
    pub name: &'static str,
    /// How it is called and what it gives, as in `"along(path, t) -> vector"`: one form for each choice of arguments.
    pub forms: &'static [&'static str],
    /// What it does, in sentences.
    pub text: &'static str,
    /// Each argument by its name in `forms`: unit, range, and its default where it may be left out.
    pub arguments: &'static [(&'static str, &'static str)],
    /// Lines of a script, run in `frame(s, f)`. What stands behind `//` is what the line gives.
    pub example: &'static str,
    pub(super) register: fn(&mut Engine),
}

/// Functions that belong together: a heading of the guide.
pub struct Chapter {
    /// Its heading.
    pub title: &'static str,
    /// In the order of the guide.
    pub functions: &'static [Function],
}

/// Every function, in the order of the guide.
pub const CHAPTERS: &[&Chapter] = &[
    &super::time::CHAPTER,
    &super::parameters::CHAPTER,
    &super::scene_api::CHAPTER,
    &super::cameras::CHAPTER,
    &super::clips::CHAPTER,
    &super::easing::CHAPTER,
    &super::interpolate::CHAPTER,
    &super::paths::CHAPTER,
    &super::geometry::CHAPTER,
    &super::morphing::CHAPTER,
    &super::instances::CHAPTER,
    &super::noise::CHAPTER,
    &super::placing::CHAPTER,
    &super::world::CHAPTER,
    &super::constraints::CHAPTER,
    &super::subjects::CHAPTER,
    &super::vector::CHAPTER,
    &super::random::CHAPTER,
    &super::mathematics::CHAPTER,
    &super::data::CHAPTER,
    &super::said::CHAPTER,
];

/// Gives the engine all functions.
pub fn register(engine: &mut Engine) {
    functions().for_each(|function| (function.register)(engine));
}

/// Every function of the API.
pub fn functions() -> impl Iterator<Item = &'static Function> {
    CHAPTERS.iter().flat_map(|chapter| chapter.functions)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::base::project::Project;
    use crate::script::examples::{demo_scene, runnable};
    use crate::script::{Evaluation, Program};

    /// Every example runs, and gives what it says that it gives.
    #[test]
    fn examples_run_and_give_what_they_say() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("example.rhai");
        for function in functions() {
            let text = runnable(function.example);
            std::fs::write(&path, &text).unwrap();
            let project = Project::of(&path, &Default::default()).unwrap();
            let program = Program::open(&path, &[], &project, &Evaluation::InProcess)
                .unwrap_or_else(|e| panic!("{}: {e}\n{text}", function.name));
            program.frame(&demo_scene(), 2, 0.0).unwrap_or_else(|e| panic!("{}: {e}\n{text}", function.name));
        }
    }

    #[test]
    fn every_argument_is_described_and_every_function_has_an_example() {
        for function in functions() {
            assert!(!function.example.trim().is_empty() && !function.text.is_empty(), "{}", function.name);
            let described: BTreeSet<&str> = function.arguments.iter().map(|(name, _)| *name).collect();
            let mut taken = BTreeSet::new();
            for form in function.forms {
                assert!(form.contains(function.name), "{form}");
                let (call, _) = form.split_once(" ->").unwrap_or((form, ""));
                let inner = call.split_once('(').map_or("", |(_, tail)| tail.trim_end_matches(')'));
                taken.extend(inner.split(", ").filter(|name| !name.is_empty()));
                if let Some((receiver, _)) = call.split_once('.') {
                    taken.extend(Some(receiver).filter(|name| !["s", "f"].contains(name)));
                }
            }
            assert_eq!(described, taken, "{}", function.name);
        }
    }
}
