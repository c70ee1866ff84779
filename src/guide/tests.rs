//! Nothing is missing in the guide, and every example in it runs.

use super::*;
use crate::base::project::Project;
use crate::components::Kind;
use crate::load;
use crate::script::examples::{demo_scene, runnable};
use crate::script::{CHAPTERS, Evaluation, Program};

fn runs_as_script(text: &str) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("example.rhai");
    std::fs::write(&path, runnable(text)).unwrap();
    let project = Project::of(&path, &Default::default()).unwrap();
    let program = Program::open(&path, &[], &project, &Evaluation::InProcess).unwrap_or_else(|e| panic!("{e}\n{text}"));
    program.frame(&demo_scene(), 1, 0.0).unwrap_or_else(|e| panic!("{e}\n{text}"));
}

fn loads_as_scene(text: &str) -> Result<(), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    std::fs::write(&path, text).unwrap();
    load::load_scene(&path, false).map(drop).map_err(|problems| problems.to_string())
}

#[test]
fn every_field_has_a_text_and_a_kind() {
    for record in entity_records().iter().chain(&other_records()) {
        for field in &record.fields {
            assert!(!field.text.is_empty(), "{}.{} is not described", record.name, field.name);
            assert!(!field.kind.is_empty(), "{}.{} has no kind", record.name, field.name);
        }
    }
}

/// The example of every field stands in a scene that loads.
#[test]
fn examples_of_fields_load() {
    let needs_files =
        ["file", "environment", "image", "color_map", "specular_map", "roughness_map", "bump", "normal_map"];
    let mut wrong = Vec::new();
    for record in other_records().iter().chain(&entity_records()) {
        for field in record.fields.iter().filter(|field| !needs_files.contains(&field.name)) {
            let inner = match field.name {
                // Some fields go together.
                "f_stop" => format!("focal_length: 50.0, f_stop: {}", field.example),
                "eta" => format!("eta: {}, k: (3.0, 2.0, 2.0)", field.example),
                "k" => format!("k: {}, eta: (0.2, 0.9, 1.0)", field.example),
                "parent" => "parent: \"other\"".into(),
                "triangles" | "normals" | "uvs" | "vertices" | "smooth" if record.name == "mesh" => {
                    "vertices: [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], triangles: [(0, 1, 2)]".into()
                }
                name => format!("{name}: {}", field.example),
            };
            let text = match record.name {
                "camera" => format!("(camera: ({inner}), entities: [(name: \"name\", viewpoint: ())])"),
                "render" => format!("(render: ({inner}))"),
                "material" if record.fields.len() > 1 => format!("(materials: {{ \"m\": ({inner}) }})"),
                "fog" => format!("(render: (fog: ({inner})))"),
                "daylight" => format!("(render: (daylight: ({inner})))"),
                // What comes with a file is tried where files are read.
                "texture" | "material" | "asset" | "skin" | "morph" => continue,
                name => format!("(entities: [(name: \"other\"), ({name}: ({inner}))])"),
            };
            wrong.extend(loads_as_scene(&text).err().map(|e| format!("{}.{}: {text}\n{e}", record.name, field.name)));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_component_and_function_stands_on_a_page() {
    let all: Vec<Block> = PAGES.iter().flat_map(|page| (page.blocks)()).collect();
    for kind in Kind::ALL {
        let heading = Block::Heading(format!("`{}`", kind.name()));
        assert!(all.contains(&heading), "{}", kind.name());
    }
    for function in CHAPTERS.iter().flat_map(|chapter| chapter.functions) {
        let stands = |block: &Block| matches!(block, Block::GuideEntry(entry) if entry.forms == function.forms);
        assert!(all.iter().any(stands), "{}", function.name);
    }
}

#[test]
fn pieces_of_code_run() {
    for page in PAGES.iter().filter(|page| page.name != "errors") {
        for block in (page.blocks)() {
            match block {
                Block::Code(CodeKind::Script, text) => runs_as_script(&text),
                Block::Code(CodeKind::Scene, text) => loads_as_scene(&text).unwrap(),
                _ => {}
            }
        }
    }
}

#[test]
fn mistakes_are_shown_with_what_is_said_of_them() {
    let blocks = (find("errors").unwrap().blocks)();
    let answers: Vec<&String> = blocks
        .iter()
        .filter_map(|b| if let Block::Code(CodeKind::Answer, text) = b { Some(text) } else { None })
        .collect();
    assert!(answers.len() >= 7);
    assert!(answers.iter().all(|answer| answer.contains("error") && answer.contains("^")), "{answers:?}");
}

#[test]
fn the_forms_of_the_guide_are_well_formed() {
    for page in PAGES {
        let shown = text::page(page, false);
        assert!(shown.lines().all(|line| !line.ends_with(' ')), "{}", page.name);
        assert!(!shown.contains('\x1b'));
    }
    assert!(text::contents(true).contains('\x1b'));
    for (name, file) in html::files(true) {
        assert!(!name.contains('/') && !file.is_empty());
        if name.ends_with(".html") {
            assert_eq!(file.matches("<section").count(), file.matches("</section>").count(), "{name}");
        }
    }
    let schema = json::schema();
    assert_eq!(schema["properties"]["camera"]["properties"]["lens"]["enum"][0], "Disk");
    assert_eq!(schema["properties"]["cameras"]["additionalProperties"]["properties"]["height"]["type"], "number");
    assert_eq!(schema["properties"]["camera"]["properties"]["entity"]["type"], "string");
    assert!(json::pages().as_array().unwrap().len() == PAGES.len());
    assert!(definitions::file().contains("fn along("));
}
