//! Textures as a user meets them: files, mistakes in them, scripts, and pictures whose truth is known.

use crate::tool::Sandbox;

/// A PNG of one colour.
fn flat(width: u32, height: u32, color: [u8; 3]) -> Vec<u8> {
    encoded(&image::RgbImage::from_pixel(width, height, image::Rgb(color)), image::ImageFormat::Png)
}

fn encoded(picture: &image::RgbImage, format: image::ImageFormat) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// A wall that fills the picture and is lit with strength 1 from right before it, with a material of one field.
fn wall(field: &str) -> String {
    format!(
        "(\n  camera: (from: (0, 0, 5), at: (0, 0, 0), fov: 20),\n  render: (size: (8, 8), samples: 1),\n  \
         materials: {{ \"m\": (color: (1, 1, 1), {field}) }},\n  entities: [\n    (plane: (normal: (0, 0, 1)), material: \
         \"m\"),\n    (point_light: (position: (0, 0, 1000))),\n  ],\n)"
    )
}

/// How a message names the place of a word in the materials of a scene.
fn place_of(scene: &str, there: &str) -> String {
    let line = scene.lines().nth(3).unwrap();
    format!("a.ron:4:{}: error", line.find(there).unwrap() + 1)
}

fn pixel(sandbox: &Sandbox, file: &str, x: u32, y: u32) -> [u8; 3] {
    image::load_from_memory(&sandbox.read(file)).unwrap().to_rgb8().get_pixel(x, y).0
}

/// What a picture of a colour shows is that colour, to the byte: decoded on the way in, encoded on the way out.
#[test]
fn colours_come_through() {
    let sandbox = Sandbox::new();
    for format in ["png", "jpg"] {
        let kind = if format == "png" { image::ImageFormat::Png } else { image::ImageFormat::Jpeg };
        let picture = image::RgbImage::from_pixel(16, 16, image::Rgb([90, 90, 90]));
        sandbox.write(&format!("a.{format}"), encoded(&picture, kind));
        sandbox.write("scene.ron", wall(&format!("color_map: (image: \"a.{format}\")")));
        sandbox.anim("scene.ron -o out.png").ok();
        assert_eq!(pixel(&sandbox, "out.png", 3, 3), [90, 90, 90]);
    }
    sandbox.write("scene.ron", wall("color_map: (image: \"a.png\", encoding: Linear)"));
    sandbox.anim("scene.ron -o out.png").ok();
    assert!(pixel(&sandbox, "out.png", 3, 3)[0] > 150);
}

#[test]
fn broken_images_are_explained_at_their_place() {
    let mistake = |bytes: Option<Vec<u8>>, name: &str, said: &[&str]| {
        let sandbox = Sandbox::new();
        if let Some(bytes) = bytes {
            sandbox.write(name, bytes);
        }
        let scene = wall(&format!("color_map: (image: \"{name}\")"));
        let place = place_of(&scene, &format!("\"{name}\""));
        sandbox.write("a.ron", scene);
        sandbox.anim("render a.ron -o out").fails(3, &[&[place.as_str()], said].concat());
        sandbox.anim("check a.ron").fails(3, &[&[place.as_str()], said].concat());
    };
    mistake(None, "gone.png", &["no such file"]);
    mistake(Some(b"junk".to_vec()), "a.png", &["known: PNG, JPEG, HDR (Radiance), EXR, TGA, BMP, WebP"]);
    let png = flat(32, 32, [1, 2, 3]);
    mistake(Some(png[..png.len() / 2].to_vec()), "a.png", &["cannot read"]);
    let noise = image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([(x * y * 7) as u8, (x * 3) as u8, (y ^ x) as u8]));
    let jpeg = encoded(&noise, image::ImageFormat::Jpeg);
    mistake(Some(jpeg[..jpeg.len() * 2 / 3].to_vec()), "a.jpg", &["ends too early"]);
    // 30000 x 30000, said by a header alone.
    let mut vast = flat(1, 1, [0; 3]);
    vast[16..24].copy_from_slice(&[0, 0, 0x75, 0x30, 0, 0, 0x75, 0x30]);
    mistake(Some(vast), "a.png", &["cannot read"]);
    let mut wide = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 30000\n".to_vec();
    mistake(Some(wide.clone()), "a.hdr", &["over the limit of"]);
    wide = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n".to_vec();
    wide.extend([255, 255, 255, 255]);
    mistake(Some(wide.clone()), "a.hdr", &["no colour"]);
    wide.pop();
    mistake(Some(wide), "a.hdr", &["cannot read"]);
}

/// Pictures of every kind that is read, whatever way up they were stored, show the same.
#[test]
fn every_kind_of_image_shows_its_colours() {
    let desk = Sandbox::new();
    // Red above, blue below.
    let picture = image::RgbImage::from_fn(4, 4, |_, y| image::Rgb(if y < 2 { [200, 0, 0] } else { [0, 0, 200] }));
    let kinds = [("png", image::ImageFormat::Png), ("bmp", image::ImageFormat::Bmp), ("tga", image::ImageFormat::Tga)];
    let card = |name: &str| {
        wall(&format!("color_map: (image: \"{name}\", filter: Nearest, scale: 0.5, offset: 0.5, encoding: Srgb)"))
    };
    let look = |name: &str| {
        desk.write("scene.ron", card(name));
        desk.anim("scene.ron -o out.png --force").ok();
        [pixel(&desk, "out.png", 3, 1), pixel(&desk, "out.png", 3, 6)]
    };
    for (ending, kind) in kinds.into_iter().chain([("webp", image::ImageFormat::WebP)]) {
        let name = format!("a.{ending}");
        desk.write(&name, encoded(&picture, kind));
        assert_eq!(look(&name), [[200, 0, 0], [0, 0, 200]], "{name}");
    }
    // Floats are linear: 128 / 255 by the curve.
    let rgbe = |lines: &str, rows: [[u8; 4]; 2]| {
        let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{lines}\n").into_bytes();
        rows.into_iter().for_each(|texel| bytes.extend(texel));
        bytes
    };
    let (red, blue) = ([110, 0, 0, 127], [0, 0, 110, 127]);
    desk.write("up.hdr", rgbe("-Y 2 +X 1", [red, blue])).write("down.hdr", rgbe("+Y 2 +X 1", [blue, red]));
    assert_eq!(look("up.hdr")[0][1..], [0, 0]);
    assert_eq!(look("up.hdr"), look("down.hdr"));
    // Our own frames are textures too.
    let still =
        "(camera: (from: (0, 0, 0), at: (0, 0, -1)), render: (size: (4, 4), samples: 1, background: (0.2, 0.4, 0.1)))";
    desk.write("still.ron", still);
    desk.anim("still.ron -o still.exr").ok();
    let from_exr = look("still.exr");
    desk.anim("still.ron -o still.png").ok();
    let expected = pixel(&desk, "still.png", 1, 1);
    assert_eq!(from_exr, [expected; 2]);
    desk.write("cut.exr", &desk.read("still.exr")[..200]);
    desk.write("scene.ron", card("cut.exr"));
    desk.anim("check scene.ron").fails(3, &["cannot read cut.exr"]);
}

/// A photograph that was taken with the camera on its side stands upright.
#[test]
fn orientation_is_honoured_and_jpegs_of_every_layout_are_right() {
    let desk = Sandbox::new();
    let picture = image::RgbImage::from_fn(16, 16, |_, y| image::Rgb(if y < 8 { [200, 0, 0] } else { [0, 0, 200] }));
    let jpeg = encoded(&picture, image::ImageFormat::Jpeg);
    let exif = |orientation: u8| {
        let tiff =
            [&b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0"[..], &[orientation, 0, 0, 0, 0, 0, 0, 0]].concat();
        let body = [&b"Exif\0\0"[..], &tiff].concat();
        let length = (body.len() as u16 + 2).to_be_bytes();
        [&jpeg[..2], &[0xff, 0xe1], &length, &body, &jpeg[2..]].concat()
    };
    let look = |bytes: Vec<u8>| {
        desk.write("a.jpg", bytes);
        desk.write("scene.ron", wall("color_map: (image: \"a.jpg\", filter: Nearest, scale: 0.5, offset: 0.5)"));
        desk.anim("scene.ron -o out.png --force").ok();
        [pixel(&desk, "out.png", 3, 1), pixel(&desk, "out.png", 3, 6)]
            .map(|[r, _, b]| if r > b { "red" } else { "blue" })
    };
    assert_eq!(look(jpeg.clone()), ["red", "blue"]);
    assert_eq!(look(exif(1)), ["red", "blue"]);
    assert_eq!(look(exif(3)), ["blue", "red"]);
    // Components may stand one after the other, each in a scan of its own.
    for apart in [false, true] {
        desk.write("a.jpg", subsampled(apart));
        desk.anim("scene.ron -o out.png --force").ok();
        let [r, g, b] = pixel(&desk, "out.png", 3, 3).map(i32::from);
        assert!((r - 200).abs() < 4 && (g - 30).abs() < 4 && (b - 30).abs() < 4, "{apart}: {r} {g} {b}");
    }
    // Fill bytes before a marker mean nothing.
    assert_eq!(look([&jpeg[..2], &[0xff, 0xff, 0xff], &jpeg[2..]].concat()), ["red", "blue"]);
}

/// A JPEG of 32 x 32 pixels of (200, 30, 30) with colours at half the resolution: all components in one scan, or `apart`.
fn subsampled(apart: bool) -> Vec<u8> {
    let mut jpeg = vec![0xff, 0xd8, 0xff, 0xdb, 0, 67, 0];
    jpeg.extend([8; 64]);
    jpeg.extend([0xff, 0xc0, 0, 17, 8, 0, 32, 0, 32, 3, 1, 0x22, 0, 2, 0x11, 0, 3, 0x11, 0]);
    // Codes 000 to 011 for differences of 0, 5, 6 and 7 bits; code 0 for the end of a block.
    jpeg.extend([0xff, 0xc4, 0, 23, 0x00, 0, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 5, 6, 7]);
    jpeg.extend([0xff, 0xc4, 0, 20, 0x10, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    // The first block of a component differs from grey, the others not from the one before.
    let block = |first: bool, component: usize| match (first, component) {
        (false, _) => "0000".to_string(),
        (true, 0) => format!("010{:06b}0", -47 + 63),
        (true, 1) => format!("001{:05b}0", -29 + 31),
        (true, _) => format!("011{:07b}0", 84),
    };
    let mut scan = |components: &[usize], order: &[usize]| {
        let ids = components.iter().flat_map(|c| [*c as u8 + 1, 0]);
        jpeg.extend([0xff, 0xda, 0, 6 + 2 * components.len() as u8, components.len() as u8]);
        jpeg.extend(ids.chain([0, 63, 0]));
        let mut seen = [false; 3];
        let bits: String = order.iter().map(|c| block(!std::mem::replace(&mut seen[*c], true), *c)).collect();
        for byte in bits.as_bytes().chunks(8) {
            let text = format!("{:1<8}", std::str::from_utf8(byte).unwrap());
            let byte = u8::from_str_radix(&text, 2).unwrap();
            jpeg.push(byte);
            if byte == 0xff {
                jpeg.push(0);
            }
        }
    };
    if apart {
        scan(&[0], &[0; 16]);
        scan(&[1], &[1; 4]);
        scan(&[2], &[2; 4]);
    } else {
        scan(&[0, 1, 2], &[0, 0, 0, 0, 1, 2].repeat(4));
    }
    jpeg.extend([0xff, 0xd9]);
    jpeg
}

#[test]
fn mistakes_inside_a_texture_have_their_place() {
    let mistake = |field: &str, there: &str, said: &str| {
        let (sandbox, scene) = (Sandbox::new(), wall(field));
        let place = place_of(&scene, there);
        sandbox.write("a.ron", scene);
        sandbox.anim("check a.ron").fails(3, &[&place, said]);
    };
    mistake("color_map: (patern: Checker)", "patern", "did you mean `pattern`?");
    mistake("color_map: (pattern: Cheker)", "Cheker", "`Checker`");
    mistake("bump: (pattern: Noise, depth: NaN)", "NaN", "finite");
    mistake("color_map: (pattern: Noise, depth: 1)", "(pattern", "`depth` is for `bump`");
    mistake("color_map: ()", "()", "needs an `image` or a `pattern`");
    mistake("normal_map: (pattern: Noise)", "(pattern", "is an `image`");
}

#[test]
fn scripts_reach_textures_as_maps() {
    let sandbox = Sandbox::new();
    sandbox.write("white.png", flat(2, 2, [255; 3])).write("scene.ron", wall("color_map: (image: \"white.png\")"));
    let script = r#"
        animation(#{ scene: "scene.ron", frames: 3 });
        fn frame(s, f) {
            if f.index == 1 { s.material("m").color_map.tint = [0, 0, 0]; }
            if f.index == 2 { s.material("m").color_map = #{ pattern: "Stripes", colors: [[1, 1, 1], [0, 0, 0]], scale: 0.001 }; }
        }"#;
    sandbox.write("show.rhai", script);
    sandbox.anim("show.rhai -o out").ok();
    assert_eq!(pixel(&sandbox, "out/show.0001.png", 3, 3), [255; 3]);
    assert_eq!(pixel(&sandbox, "out/show.0002.png", 3, 3), [0; 3]);
    assert_eq!(pixel(&sandbox, "out/show.0003.png", 6, 3), [255; 3]);
    sandbox.write("show.rhai", script.replace("tint =", "tnt ="));
    sandbox.anim("show.rhai -o two").fails(4, &["show.rhai:4:"]);
    sandbox.write("show.rhai", script.replace("tint = [0, 0, 0]", "image = \"whit.png\""));
    sandbox.anim("show.rhai -o two").fails(4, &["frame 2", "did you mean `white.png`?", "`color_map` of material `m`"]);
}

#[test]
fn pictures_surround_a_scene() {
    let sandbox = Sandbox::new();
    // Left half red, right half blue: the middle is straight ahead (-z).
    let halves = image::RgbImage::from_fn(64, 32, |x, _| image::Rgb(if x < 32 { [200, 0, 0] } else { [0, 0, 200] }));
    sandbox.write("sky.png", encoded(&halves, image::ImageFormat::Png));
    let scene = |more: &str| {
        format!("(\n  camera: (from: (0, 0, 0), at: (0, 0, -1)),\n  render: (size: (16, 9), samples: 1, {more}),\n)")
    };
    let look = |more: &str, x: u32| {
        sandbox.write("a.ron", scene(more));
        sandbox.anim("a.ron -o out.png").ok();
        pixel(&sandbox, "out.png", x, 4)
    };
    assert_eq!((look("environment: \"sky.png\"", 2), look("environment: \"sky.png\"", 13)), ([200, 0, 0], [0, 0, 200]));
    assert_eq!(look("environment: \"sky.png\", environment_rotation: 180", 2), [0, 0, 200]);
    assert_eq!(look("environment: \"sky.png\", environment_intensity: 0", 2), [0; 3]);
    assert_eq!(look("sky: ((1, 1, 1), (1, 1, 1), (1, 1, 1))", 2), [255; 3]);
    sandbox.write("a.ron", scene("environment: \"skye.png\""));
    sandbox.anim("check a.ron").fails(3, &["a.ron:3:52: error", "did you mean `sky.png`?"]);
}

/// A texture is carried along by whatever moves its entity: a transform, or motion in time.
#[test]
fn textures_move_with_their_entity() {
    let sandbox = Sandbox::new();
    let look = |name: &str, moved: &str| {
        let scene = format!(
            "(camera: (from: (1, 1, 4), at: (1, 0, 0), shutter: (1, 1)), render: (size: (32, 24), samples: 1), \
             entities: [(aabox: (), {moved}, texture: (pattern: Marble, scale: 2)), (point_light: (position: (3, 4, 5)))])"
        );
        sandbox.write("a.ron", scene);
        sandbox.anim(&format!("a.ron -o {name}")).ok();
        image::load_from_memory(&sandbox.read(name)).unwrap().to_rgb8()
    };
    let placed = look("placed.png", "transform: (translation: (1, 0, 0))");
    assert!(placed == look("moved.png", "motion: (displacement: (1, 0, 0))"));
    assert!(placed != look("other.png", "transform: (translation: (1, 0, 0)), motion: (displacement: (0.1, 0, 0))"));
}

/// A scene with every kind of texture is the same to the byte however it is traced, and comes back as RON.
#[test]
fn textures_are_exact() {
    let sandbox = Sandbox::new();
    let picture = image::RgbImage::from_fn(37, 21, |x, y| image::Rgb([(x * 7) as u8, (y * 11) as u8, (x * y) as u8]));
    sandbox.write("sub/a.png", encoded(&picture, image::ImageFormat::Png));
    sandbox.write("scene.ron", EVERYTHING);
    sandbox.anim("scene.ron -o one.png --threads 1").ok();
    for other in ["--threads 3", "--accel brute", "--accel grid", "--accel bvh"] {
        sandbox.anim(&format!("scene.ron -o two.png {other}")).ok();
        assert!(sandbox.read("one.png") == sandbox.read("two.png"), "{other}");
    }
    sandbox.anim("convert scene.ron -o sub/again.ron").ok();
    sandbox.anim("sub/again.ron -o two.png --threads 1").ok();
    let pixels = |name| image::load_from_memory(&sandbox.read(name)).unwrap().to_rgb8();
    assert!(pixels("one.png") == pixels("two.png"));
}

const EVERYTHING: &str = r#"(
    camera: (from: (0, 2, 7), at: (0, 0.6, 0)),
    render: (size: (64, 48), samples: 4, background: (0.2, 0.3, 0.4)),
    materials: {
        "image": (color_map: (image: "sub/a.png", wrap: Mirror, scale: (2, 3), rotation: 20, offset: (0.1, 0.2))),
        "bump": (specular: 0.5, bump: (image: "sub/a.png", depth: 0.1), roughness_map: (image: "sub/a.png"), gloss: 0.1),
        "marble": (color_map: (pattern: Marble), specular_map: (pattern: Wood, space: World), specular: 0.4),
        "normal": (normal_map: (image: "sub/a.png", depth: 0.5)),
    },
    entities: [
        (plane: (), texture: (pattern: Checker, colors: [(0.1, 0.1, 0.1), (0.9, 0.9, 0.9)])),
        (sphere: (), transform: (translation: (-2.4, 1, 0)), material: "image"),
        (aabox: (), transform: (translation: (-0.8, 0.5, 0.5), rotation: (0, 30, 0)), material: "bump"),
        (cylinder: (), transform: (translation: (0.7, 0, 0.5)), material: "marble"),
        (cone: (), transform: (translation: (2, 0, 0), scale: (1, 1.5, 1)), material: "normal"),
        (sphere: (radius: 0.5), transform: (translation: (0, 0.5, 2), scale: (1, 0.6, 1)), material: "bump"),
        (triangle: (vertices: ((-3, 0, -2), (3, 0, -2), (0, 3, -2.5)), uvs: ((0, 0), (1, 0), (0.5, 1))), material: "image"),
        (mesh: (vertices: [(2, 0, 2), (3, 0, 2), (2.5, 1, 2)], triangles: [(0, 1, 2)]), material: "bump"),
        (point_light: (position: (4, 8, 8))),
    ],
)"#;
