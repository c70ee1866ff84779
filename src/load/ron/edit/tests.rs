use proptest::prelude::*;

use super::*;

const SCENE: &str = r#"// A stage.
(
    camera: (from: (0.0, 1.0, 5.0), /* where */ at: (0, 0, 0)),
    materials: {
        "brass": (color: (0.9, 0.7, 0.4), // warm
            specular: 0.5),
        "a.b": (),
    },
    entities: [
        (
            name: "key",
            area_light: (
                size: (1.0, 1.0), // metres
            ),
            transform: (translation: (3.0, 4.0, 2.0))
        ),
        (sphere: (radius: 1.0,), material: "brass"), // the ball
    ],
)
"#;

fn set(assignments: &[&str]) -> Result<String, String> {
    let parsed: Vec<Assignment> = assignments.iter().map(|text| Assignment::parse(text).unwrap()).collect();
    assign(SCENE, "a.ron", &parsed).map(|(text, _)| text).map_err(|problem| problem.to_string())
}

/// An assignment replaces one text in the scene by another, and nothing else.
#[track_caller]
fn changes(assignment: &str, before: &str, after: &str) {
    assert_eq!(SCENE.matches(before).count(), 1, "{before}");
    assert_eq!(set(&[assignment]).unwrap(), SCENE.replace(before, after), "{assignment}");
}

#[test]
fn a_value_is_replaced_and_nothing_else() {
    changes("materials.brass.specular=0.75", "specular: 0.5", "specular: 0.75");
    changes("entities[1].sphere.radius=2", "radius: 1.0,", "radius: 2,");
    changes("camera.from.y=7", "from: (0.0, 1.0, 5.0)", "from: (0.0, 7, 5.0)");
    changes("camera.from[2]=8", "from: (0.0, 1.0, 5.0)", "from: (0.0, 1.0, 8)");
    changes("entities.key.transform.translation.x = -1.5", "translation: (3.0,", "translation: (-1.5,");
    changes("camera.at=(1, 0, 0) // comments of the value are left out", "at: (0, 0, 0)", "at: (1, 0, 0)");
    assert!(set(&["materials.brass.color=#ff8000"]).unwrap().contains("color: (1.0, 0.215861, 0.0), // warm"));
}

#[test]
fn what_is_missing_is_added_in_the_manner_of_its_neighbours() {
    changes("camera.fov=30", "at: (0, 0, 0)", "at: (0, 0, 0), fov: 30");
    changes("materials.brass.gloss=0.1", "specular: 0.5", "specular: 0.5, gloss: 0.1");
    changes(r#"materials."a.b".specular=1"#, r#""a.b": ()"#, r#""a.b": (specular: 1)"#);
    let behind = "// metres\n                color: (6, 5, 4),";
    changes("entities.key.area_light.color=(6, 5, 4)", "// metres", behind);
    let moved = "translation: (3.0, 4.0, 2.0)),\n            motion: (displacement: (1, 0, 0))";
    changes("entities.key.motion.displacement=(1, 0, 0)", "translation: (3.0, 4.0, 2.0))", moved);
    let placed = "material: \"brass\", transform: (translation: (0.0, 2, 0.0))";
    changes("entities[1].transform.translation.y=2", "material: \"brass\"", placed);
    changes("materials.brass.bump.depth=0.2", "specular: 0.5", "specular: 0.5, bump: (depth: 0.2)");
    changes("render.samples=4", "    ],\n)", "    ],\n    render: (samples: 4),\n)");
}

#[test]
fn lines_end_as_they_do_in_the_file() {
    let text = SCENE.replace('\n', "\r\n");
    let assignment = Assignment::parse("entities.key.area_light.color=(6, 5, 4)").unwrap();
    let (after, _) = assign(&text, "a.ron", &[assignment]).unwrap();
    assert_eq!(after.matches('\n').count(), after.matches("\r\n").count());
    assert!(after.contains("// metres\r\n                color: (6, 5, 4),\r\n"));
}

#[test]
fn texts_need_no_quotes_and_choices_get_none() {
    changes("entities[1].material=a.b", "material: \"brass\"", "material: \"a.b\"");
    assert!(set(&["camera.lens=Square"]).unwrap().contains("lens: Square"));
    assert!(set(&["entities[1].name=ball"]).unwrap().contains("name: \"ball\""));
    for file in ["a b.obj", "\"a b.obj\""] {
        let said = set(&[&format!("entities[1].mesh.file={file}")]).unwrap();
        assert!(said.contains("mesh: (file: \"a b.obj\")"), "{said}");
    }
}

#[test]
fn a_value_cannot_say_more_than_itself() {
    for value in ["1, gloss: 2", "1)", "(1", "1 // )\n", "1 2", "", "\"", "[1"] {
        let said =
            assign(SCENE, "a.ron", &[Assignment { path: "materials.brass.specular".into(), value: value.into() }]);
        match said {
            Ok((text, _)) => assert!(text.contains("specular: 1)"), "{value}"),
            Err(problem) => assert!(problem.message.starts_with("materials.brass.specular="), "{value}"),
        }
    }
}

#[test]
fn several_values_are_set_one_after_the_other_and_have_their_places() {
    let list =
        ["entities.key.name=lamp", "entities.lamp.area_light.falloff=InverseSquare", "entities[1].sphere.radius=3"];
    let parsed: Vec<Assignment> = list.iter().map(|text| Assignment::parse(text).unwrap()).collect();
    let (text, changes) = assign(SCENE, "a.ron", &parsed).unwrap();
    for change in &changes {
        let line = text.lines().nth(change.place.line as usize - 1).unwrap();
        let found: String = line.chars().skip(change.place.column as usize - 1).take(change.after.len()).collect();
        assert_eq!(found, change.after);
    }
    assert_eq!(changes[2].before.as_deref(), Some("1.0"));
    assert_eq!(changes[1].before, None);
}

#[test]
fn wrong_paths_and_values_are_answered_with_the_nearest_word() {
    for (assignment, said) in [
        ("camra.fov=3", "did you mean `camera`?"),
        ("camera.fof=3", "did you mean `fov`?"),
        ("materials.bras.color=(1, 1, 1)", "did you mean `brass`?"),
        ("entities.kye.sphere.radius=1", "did you mean `key`?"),
        ("entities[2].sphere.radius=1", "the scene has 2, counted from 0"),
        ("entities.key.translation=(1, 1, 1)", "write transform.translation"),
        ("entities.key.area_light.colour=(1, 1, 1)", "did you mean `color`?"),
        ("entities.key=(1, 1, 1)", "which component"),
        ("camera.fov=wide", "expected a number, found `wide`"),
        ("camera.from=(1, 2)", "expected three numbers"),
        ("camera.fov.x=2", "expected a number"),
        ("camera.fov.wide=2", "`fov` is one value"),
        ("camera.lens=Round", "unknown choice `Round`"),
        ("camera..fov=1", "words with points between them"),
        ("camera.from[y]=1", "words with points between them"),
        ("entities[1].material.color=1", "is one value"),
    ] {
        let found = set(&[assignment]).and_then(|text| {
            crate::load::ron::parse(&text, "a.ron", &std::path::Path::new("").into()).map_err(|e| e.to_string())
        });
        let found = found.map(drop).unwrap_err();
        assert!(found.contains(said), "{assignment}: {found}");
    }
    assert!(Assignment::parse("camera.fov").is_err() && Assignment::parse("=1").is_err());
    assert_eq!(Assignment::parse(r#"materials."a=b".ior=1"#).unwrap().value, "1");
}

proptest! {
    #[test]
    fn whatever_is_asked_the_rest_of_the_text_stays(path in "[a-z.\\[\\]\"0-9]{0,30}", value in "[ -~]{0,20}") {
        if let Ok((text, changes)) = assign(SCENE, "a.ron", &[Assignment { path, value }]) {
            let change = &changes[0];
            prop_assert!(text.len() >= SCENE.len() - change.before.as_ref().map_or(0, String::len));
            prop_assert!(spans::parse(&text).is_ok());
        }
    }
}
