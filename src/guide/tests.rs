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
    // The module that it imports stands in its comments.
    let module: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("//     ")).collect();
    std::fs::write(folder.path().join("palette.rhai"), module.join("\n")).unwrap();
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

/// A PNG file of one grey pixel with an alpha of a half.
const PIXEL: [u8; 70] = [
    137, 80, 78, 71, 13, 10, 26, 10, 0, 0, 0, 13, 73, 72, 68, 82, 0, 0, 0, 1, 0, 0, 0, 1, 8, 6, 0, 0, 0, 31, 21, 196,
    137, 0, 0, 0, 13, 73, 68, 65, 84, 120, 218, 99, 104, 104, 248, 223, 0, 0, 6, 3, 2, 128, 113, 144, 215, 235, 0, 0,
    0, 0, 73, 69, 78, 68, 174, 66, 96, 130,
];

/// Pictures and a mesh of one triangle, for fields that name a file.
fn write_files(folder: &std::path::Path) {
    for name in ["wood.png", "dents.png", "leaf.png", "sky.png", "wood.0012.png"] {
        std::fs::write(folder.join(name), PIXEL).unwrap();
    }
    std::fs::write(folder.join("model.obj"), "g lid\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
}

/// Every field has a text, what its value is, the unit and range of its numbers, a default, and an example that is another
/// value than that.
#[test]
fn every_field_is_told_in_full() {
    let mut missing = Vec::new();
    for record in entity_records().iter().chain(&other_records()) {
        for field in &record.fields {
            let name = format!("{}.{}", record.name, field.name);
            let mut lacks =
                |what: &str, is_lacking: bool| missing.extend(is_lacking.then(|| format!("{name} has no {what}")));
            let is_numeric = field.kind.contains("number") || field.kind.contains("point");
            let is_list = field.kind.starts_with("a list");
            let holds_words = ["tags", "includes", "excludes", "without", "joints", "aovs"].contains(&field.name);
            lacks("text", field.text.is_empty());
            lacks("kind", field.kind.is_empty());
            lacks("unit", (is_numeric || (is_list && !holds_words)) && field.unit.is_empty());
            lacks("range", field.kind.contains("number") && (field.range.is_empty() || field.range == "any"));
            lacks("example", field.example.is_empty());
            let is_shown = record.name != "material" || record.fields.len() > 1;
            let usual = fields::in_ron(&field.default, &field.kind);
            lacks("example that says more than its default", is_shown && field.example == usual);
            for (word, meaning) in &field.choices {
                lacks(&format!("meaning of `{word}`"), meaning.is_empty());
            }
        }
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// What stands beside a field in its example.
fn companions(record: &str, field: &str) -> &'static str {
    match (record, field) {
        ("camera", "f_stop" | "sensor_width" | "meters_per_unit") => "focal_length: 35.0, ",
        ("material", "eta") => "k: (3.0, 2.0, 2.0), ",
        ("material", "k") => "eta: (0.2, 0.9, 1.0), ",
        ("mesh", "triangles" | "normals" | "uvs" | "colors") => {
            "vertices: [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], "
        }
        ("mesh", "group" | "file_materials") => "file: \"model.obj\", ",
        ("texture", "image") => "",
        ("texture", "frame") => "image: \"wood.####.png\", ",
        ("texture", "channel") => "image: \"wood.png\", ",
        ("texture", _) => "pattern: Checker, ",
        _ => "",
    }
}

/// The example of every field stands in a scene that loads.
#[test]
fn examples_of_fields_load() {
    let folder = tempfile::tempdir().unwrap();
    write_files(folder.path());
    let path = folder.path().join("scene.ron");
    let mut wrong = Vec::new();
    for record in other_records().iter().chain(&entity_records()) {
        for field in &record.fields {
            let with = companions(record.name, field.name);
            let triangles = "triangles: [(0, 1, 2)], ";
            let inner = match (record.name, field.name) {
                ("mesh", "normals" | "uvs" | "colors") => format!("{with}{triangles}{}: {}", field.name, field.example),
                ("texture", "pattern") => format!("pattern: {}", field.example),
                (_, name) => format!("{with}{name}: {}", field.example),
            };
            let others = "(name: \"table\"), (name: \"ball\", sphere: ()), (name: \"dolly\", viewpoint: ())";
            let text = match record.name {
                "camera" => format!("(camera: ({inner}), entities: [{others}])"),
                "render" => format!("(render: ({inner}))"),
                "material" if record.fields.len() > 1 => format!("(materials: {{ \"m\": ({inner}) }})"),
                "texture" if field.name == "depth" => format!("(materials: {{ \"m\": (bump: ({inner})) }})"),
                "texture" => format!("(materials: {{ \"m\": (color_map: ({inner})) }})"),
                "fog" => format!("(render: (fog: ({inner})))"),
                "daylight" => format!("(render: (daylight: ({inner})))"),
                // What comes with a file of its own is tried where such files are read.
                "material" | "asset" | "skin" | "morph" => continue,
                name => format!("(entities: [{others}, ({name}: ({inner}))])"),
            };
            std::fs::write(&path, &text).unwrap();
            let loaded = load::load_scene(&path, false).map(drop);
            wrong.extend(loaded.err().map(|e| format!("{}.{}: {text}\n{e}", record.name, field.name)));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Every argument of a function says what it is, with its unit or range, and what it is where it is left out.
#[test]
fn every_argument_is_told_in_full() {
    let units = [
        "number",
        "text",
        "list",
        "map",
        "vector",
        "point",
        "entity",
        "path",
        "closure",
        "degrees",
        "radians",
        "world unit",
        "time",
        "second",
        "frame",
        "0",
        "1",
        "true",
        "name",
        "color",
        "colour",
        "file",
        "direction",
        "angle",
        "mesh",
        "camera",
        "any",
        "easing",
        "generator",
        "seed",
        "share",
        "value",
        "state",
        "table",
        "row",
        "option",
        "asset",
    ];
    let mut missing = Vec::new();
    for function in CHAPTERS.iter().flat_map(|chapter| chapter.functions) {
        for (name, text) in function.arguments {
            if !units.iter().any(|unit| text.contains(unit)) {
                missing.push(format!("{}({name}): no unit in `{text}`", function.name));
            }
            // What stands before the bracket, and what stands in it.
            let taken = |form: &str| -> (String, Vec<String>) {
                let call = form.split(" ->").next().unwrap_or("");
                let (head, tail) = call.split_once('(').unwrap_or((call, ""));
                let inner = tail.trim_end_matches(')').split(", ").filter(|name| !name.is_empty());
                (head.to_string(), inner.map(str::to_string).collect())
            };
            let all: Vec<(String, Vec<String>)> = function.forms.iter().map(|form| taken(form)).collect();
            // One form is another with more behind it.
            let is_optional = all.iter().any(|(head, long)| {
                let shorter = |at: usize| {
                    let is_short = |(other, short): &(String, Vec<String>)| other == head && short.len() <= at;
                    all.iter().any(|form| is_short(form) && long.starts_with(&form.1))
                };
                long.iter().position(|taken| taken == name).is_some_and(shorter)
            });
            let says_so = ["left out", "without", "unless", "default", "otherwise", "if not given", "else"];
            if is_optional && !says_so.iter().any(|word| text.contains(word)) && !function.text.contains("left out") {
                missing.push(format!("{}({name}): what it is where it is left out: `{text}`", function.name));
            }
        }
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
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
