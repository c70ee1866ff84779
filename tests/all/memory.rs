//! Memory is foreseen: what cannot be held is made in bands, or refused by its name.

use crate::tool::Sandbox;

const SCENE: &str = r#"(
    camera: (from: (0.0, 2.0, 6.0), at: (0.0, 0.6, 0.0)),
    render: (size: (220, 210), samples: 1, integrator: Whitted, background: (0.2, 0.3, 0.4)),
    entities: [
        (name: "hero", sphere: (), transform: (translation: (0.0, 1.0, 0.0))),
        (plane: ()),
        (name: "key", point_light: (), transform: (translation: (2.0, 4.0, 3.0))),
        (name: "fill", point_light: (), transform: (translation: (-3.0, 4.0, 3.0))),
    ],
)"#;

fn pictures(sandbox: &Sandbox, folder: &str) -> Vec<(String, Vec<u8>)> {
    let files = sandbox.files().into_iter().filter(|file| file.starts_with(folder) && !file.contains("manifest"));
    files.map(|file| (file[folder.len()..].to_string(), sandbox.read(&file))).collect()
}

#[test]
fn frames_that_do_not_fit_are_made_in_bands_to_the_same_bytes() {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", SCENE);
    let script = |body: &str| format!("animation(#{{ scene: \"a.ron\", frames: 2 }});\nfn frame(s, f) {{ {body} }}");
    // Twins; lights that are dimmed alone; an open shutter.
    sandbox.write("twins.rhai", script("s.camera.fov = 40;"));
    sandbox.write("lights.rhai", script("s.get(\"key\").color = [f.number, 1, 1];"));
    sandbox.write(
        "blur.rhai",
        script("s.render.samples = 4; s.render.max_depth = 2; s.camera.shutter = [0, 0.5]; s.get(\"hero\").translation.x = f.t;"),
    );
    for (name, look) in [
        ("twins", "--size 220x210 --denoise -o OUT/f.####.exr --aovs depth,normal,albedo,position,motion"),
        ("lights", "--size 420x360 -o OUT/f.####.png"),
        (
            "blur",
            "--size 260x200 --region 3,5,250,190 --denoise -o OUT/f.####.exr --frames 2 --aovs depth,normal,position",
        ),
    ] {
        let run = |out: &str, more: &str| {
            let look = look.replace("OUT", &format!("{name}-{out}"));
            sandbox.anim(&format!("{name}.rhai {look} {more} --stats json")).ok().stdout
        };
        let (whole, banded) = (run("whole", ""), run("bands", "--memory 16"));
        let in_bands = (2..30).any(|bands| banded.contains(&format!("\"bands\":{bands},")));
        assert!(whole.contains("\"bands\":0,") && in_bands, "{name}\n{whole}\n{banded}");
        let whole = pictures(&sandbox, &format!("{name}-whole/"));
        assert!(!whole.is_empty() && whole == pictures(&sandbox, &format!("{name}-bands/")), "{name}\n{banded}");
    }
}

#[test]
fn a_texture_that_cannot_be_held_is_refused_by_its_name() {
    let sandbox = Sandbox::new();
    let (mut bytes, picture) = (std::io::Cursor::new(Vec::new()), image::GrayImage::new(2500, 2000));
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    sandbox.write("large.png", bytes.into_inner());
    let textured = SCENE.replacen("sphere: ()", "sphere: (), texture: (image: \"large.png\")", 1);
    sandbox.write("a.ron", textured);
    let said = ["a.ron:5", "the 2500 x 2000 pixels of", "large.png", "MiB of memory", "--memory"];
    sandbox.anim("check a.ron --memory 32").fails(3, &said);
    sandbox.anim("check a.ron --memory 512").ok();
    sandbox.anim("check a.ron --memory 1").fails(2, &["--memory"]);
}

#[test]
fn many_primitives_are_refused_before_anything_is_built_over_them() {
    let sandbox = Sandbox::new();
    let mut scene = String::from("(render: (size: (8, 8), samples: 1), entities: [");
    (0..60_000).for_each(|i| scene.push_str(&format!("(sphere: (radius: 0.1{i})),")));
    sandbox.write("a.ron", scene + "])");
    sandbox.anim("a.ron -o a.png --accel grid --memory 16").fails(3, &["60000 primitives", "--memory"]);
}
