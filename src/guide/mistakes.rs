//! Mistakes with the real words of the program: each piece is read, and what is said of it is shown.

use super::{Block, CodeKind};
use crate::base::project::Project;
use crate::load;
use crate::script::examples::demo_scene;
use crate::script::{Evaluation, Program};

/// Scenes with a mistake.
const SCENES: &[&str] = &[
    "(materials: { \"brass\": (colour: (0.72, 0.48, 0.16)) })",
    "(entities: [(sphere: (radius: 0.0))])",
    "(entities: [(name: \"ball\", cube: (min: (0.0, 0.0, 0.0)))])",
];

/// Scripts with a mistake.
const SCRIPTS: &[&str] = &[
    "animation(#{ frames: 24 });\nfn frame(s, f) {\n    s.camera.fvo = 35;\n}",
    "animation(#{ frames: 24 });\nfn frame(s, f) {\n    s.get(\"ball\").position = [0, 1, 0];\n}",
    "animation(#{ frames: 24 });\nfn frame(s, f) {\n    let a = 1\n    s.camera.fov = lerp(30, 40);\n}",
    "animation(#{ frames: 24 });\nfn frame(s, f) {\n    s.material(\"brass\").shine = 1;\n}",
];

/// What the program says of an input.
fn said(name: &str, text: &str) -> String {
    let Ok(folder) = tempfile::tempdir() else { return String::new() };
    let path = folder.path().join(name);
    if std::fs::write(&path, text).is_err() {
        return String::new();
    }
    let Ok(project) = Project::of(&path, &Default::default()) else { return String::new() };
    let problems = if name.ends_with(".ron") {
        load::load_scene_in(&path, false, &project).err()
    } else {
        let run = || {
            let program = Program::open(&path, &[], &project, &Evaluation::InProcess)?;
            program.frame(&demo_scene(), 1, 0.0)
        };
        run().err()
    };
    let text = problems.map(|problems| problems.to_string()).unwrap_or_default();
    text.replace(&format!("{}/", folder.path().to_string_lossy()), "")
}

pub fn blocks() -> Vec<Block> {
    let intro = "Every mistake is answered with file, line and column, what was found, what was expected and the nearest right \
                 word. Nothing is rendered before all frames are known to be good, and several mistakes are told at once.";
    let codes = "Exit codes: 0 done; 1 differences found; 2 usage; 3 the scene or script is wrong; 4 some frames failed; 5 \
                 reading or writing failed; 130 interrupted.";
    let mut blocks = vec![Block::Paragraph(intro.into()), Block::Paragraph(codes.into())];
    let scenes = SCENES.iter().map(|text| ("scene.ron", CodeKind::Scene, *text));
    let scripts = SCRIPTS.iter().map(|text| ("show.rhai", CodeKind::Script, *text));
    for (name, kind, text) in scenes.chain(scripts) {
        blocks.push(Block::Code(kind, text.into()));
        blocks.push(Block::Code(CodeKind::Answer, said(name, text)));
    }
    blocks
}
