use std::path::Path;

use glam::{Vec2, Vec3, Vec4};
use proptest::prelude::*;

use super::*;

/// A folder with some files, and the first of them read.
fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::create_dir_all(folder.path().join(name).parent().unwrap()).unwrap();
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

fn read(name: &str, bytes: &[u8]) -> Result<MeshData, String> {
    let folder = folder(&[(name, bytes)]);
    load(&folder.path().into(), name, false).map(|loaded| loaded.data).map_err(|problem| problem.to_string())
}

fn warnings(name: &str, bytes: &[u8]) -> Vec<String> {
    let folder = folder(&[(name, bytes)]);
    let loaded = load(&folder.path().into(), name, false).unwrap();
    loaded.warnings.iter().chain(&loaded.material_warnings).map(ToString::to_string).collect()
}

/// The area of a mesh.
fn area(data: &MeshData) -> f32 {
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| data.vertices[i as usize]);
        (b - a).cross(c - a).length() / 2.0
    };
    data.triangles.iter().map(of).sum()
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n\
                   0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

fn binary_ply() -> Vec<u8> {
    let header = PLY.split("end_header\n").next().unwrap().replace("ascii", "binary_little_endian");
    let mut bytes = (header + "end_header\n").into_bytes();
    for x in [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0] {
        bytes.extend(x.to_le_bytes());
    }
    bytes.push(4);
    (0..4i32).for_each(|i| bytes.extend(i.to_le_bytes()));
    bytes
}

#[test]
fn a_ply_square_is_two_triangles() {
    let data = read("a.ply", PLY.as_bytes()).unwrap();
    assert_eq!(data.triangles, [[0, 1, 2], [0, 2, 3]]);
    let bytes = binary_ply();
    assert_eq!(read("b.ply", &bytes).unwrap(), data);
    for cut in 0..bytes.len() {
        assert!(read("c.ply", &bytes[..cut]).is_err(), "{cut}");
    }
    for cut in 0..PLY.len() - 1 {
        assert!(read("c.ply", &PLY.as_bytes()[..cut]).is_err(), "{cut}");
    }
}

#[test]
fn ply_headers_end_their_lines_in_any_way() {
    let bytes = binary_ply();
    let data = read("a.ply", &bytes).unwrap();
    let at = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8(bytes[..at].to_vec()).unwrap();
    for end in ["\r", "\r\n"] {
        let text = header.replace('\n', end);
        assert_eq!(read("b.ply", &[text.as_bytes(), &bytes[at..]].concat()).unwrap(), data, "{end:?}");
    }
    let mut blank = b"\n\nply\n\ncomment gru\xdf\n".to_vec();
    blank.extend(&bytes[4..]);
    assert_eq!(read("c.ply", &blank).unwrap(), data);
    let loose = PLY.replace("end_header\n", "end_header\n\n").replace("1 0 0\n", "\n1. -.0 0\n  \n");
    assert_eq!(read("d.ply", loose.as_bytes()).unwrap().triangles, data.triangles);
}

#[test]
fn ply_colours_texture_coordinates_and_doubles_are_read() {
    let text = PLY
        .replace("float z", "double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float s\nproperty float t")
        .replace("0 0 0\n1 0 0\n1 1 0\n0 1 0", "0 0 0 255 0 0 0 0\n1 0 0 0 51 0 1 0\n1 1 0 0 0 0 1 1\n0 1 0 9 9 9 0 1");
    let data = read("a.ply", text.as_bytes()).unwrap();
    assert_eq!(data.colors[..2], [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 0.2, 0.0, 1.0)]);
    assert_eq!(data.uvs[2], Vec2::ONE);
    let faces = PLY
        .replace("face 1", "face 2")
        .replace("vertex_indices\n", "vertex_indices\nproperty list uchar float texcoord\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n")
        .replace("4 0 1 2 3\n", "3 0 1 2 6 0 0 1 0 1 1 255 0 0\n3 0 2 3 6 0 .5 1 1 0 1 0 0 255\n");
    let data = read("b.ply", faces.as_bytes()).unwrap();
    assert_eq!((data.vertices.len(), data.uvs.len(), data.colors.len()), (6, 6, 6));
    let corner = |t: usize, i: usize| data.triangles[t][i] as usize;
    assert_eq!(
        (data.uvs[corner(1, 0)], data.colors[corner(1, 0)]),
        (Vec2::new(0.0, 0.5), Vec4::new(0.0, 0.0, 1.0, 1.0))
    );
    assert_eq!((data.uvs[corner(0, 0)], data.vertices[corner(0, 0)]), (Vec2::ZERO, Vec3::ZERO));
}

#[test]
fn ply_strips_alternate() {
    let strips = PLY
        .replace("face 1", "tristrips 1")
        .replace("uchar int", "int int")
        .replace("4 0 1 2 3\n", "9 0 1 3 2 -1 0 0 1 2\n");
    let data = read("a.ply", strips.as_bytes()).unwrap();
    assert_eq!(data.triangles, [[0, 1, 3], [3, 1, 2], [1, 0, 2]]);
    let up = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| data.vertices[i as usize]);
        (b - a).cross(c - a).z
    };
    assert!(up(&data.triangles[0]) > 0.0 && up(&data.triangles[1]) > 0.0);
}

#[test]
fn broken_plys_are_refused_at_their_line() {
    let said = |text: &str| read("a.ply", text.as_bytes()).unwrap_err();
    assert!(said(&PLY.replace("vertex 4", "vertex 4000000000")).contains("a.ply:3:1: error: declares 4000000000"));
    assert!(
        said(&PLY.replace("4 0 1 2 3", "4 0 1 2 9")).contains("a.ply:14:1: error: `face` 0: vertex 9 does not exist")
    );
    assert!(said(&PLY.replace("1 1 0", "1 one 0")).contains("a.ply:12:3: error: `one` is not a number"));
    assert!(said(&PLY.replace("1 1 0", "1 1,5 0")).contains("numbers have a point"));
    assert!(said(&PLY.replace("float y", "half y")).contains("a.ply:5:1: error: a property is written"));
    assert!(said(&PLY.replace("float y", "float q")).contains("vertices have no `y`"));
    assert!(said(&PLY.replace("1 1 0", "1 1 0 7")).contains("a.ply:12:7: error: `vertex` 2 has more numbers"));
    assert!(said(&PLY.replace("1 1 0", "1 nan 0")).contains("vertex 2 is used by a face"));
    assert!(read("a.ply", b"\xff\x00junk").unwrap_err().contains("does not start with `ply`"));
    let told = warnings(
        "a.ply",
        PLY.replace("float z", "float z\nproperty float quality").replace(" 0\n", " 0 1\n").as_bytes(),
    );
    assert!(told[0].contains("a.ply:7:1: warning: `quality` of `vertex` is not used"), "{told:?}");
}

#[test]
fn unread_formats_say_what_to_export() {
    for (name, said) in
        [("a.fbx", "FBX is not read"), ("a.usdz", "OpenUSD"), ("a.abc", "mesh.file"), ("a.xyz", "known: .obj")]
    {
        assert!(read(name, b"").unwrap_err().contains(said), "{name}");
    }
    assert!(
        read("a.obj", b"version https://git-lfs.github.com/spec/v1\noid x\n").unwrap_err().contains("git lfs pull")
    );
    assert!(read("a.obj", b"\xff\xfev\x00 \x00").unwrap_err().contains("UTF-16"));
}

/// A scene of one entity with a mesh file, and the files.
fn scene(files: &[(&str, &[u8])], mesh: Mesh, materials: &[&str]) -> (Scene, Vec<String>, tempfile::TempDir) {
    let folder = folder(files);
    let material = |name: &&str| (Text::from(*name), Material { gloss: 0.5, ..Material::default() });
    let mut scene = Scene {
        base: folder.path().into(),
        entities: vec![EntityDesc::new([mesh.into()]).named("m")],
        materials: materials.iter().map(material).collect(),
        ..Scene::default()
    };
    let (problems, warnings) = load_all(&mut scene);
    let problems = problems.into_iter().map(|problem| problem.diagnostic());
    let said = problems.chain(warnings).map(|d| d.to_string()).collect();
    (scene, said, folder)
}

fn loaded(scene: &Scene) -> &Mesh {
    match scene.entities[0].get(Kind::Mesh) {
        Some(Component::Mesh(mesh)) => mesh,
        _ => panic!("no mesh"),
    }
}

const TWO: &[u8] = b"mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl red\nf 1 2 3\nusemtl green\nf 1 3 4\n";
const TWO_MTL: &[u8] = b"newmtl red\nKd 1 0 0\nnewmtl green\nKd 0 1 0\nnewmtl unused\nKd 0 0 1\n";

fn file(name: &str) -> Mesh {
    Mesh { file: Some(name.into()), ..Mesh::default() }
}

#[test]
fn materials_of_a_library_join_those_of_the_scene() {
    let files: &[(&str, &[u8])] = &[("models/two.obj", TWO), ("models/two.mtl", TWO_MTL)];
    let (scene_read, said, _folder) = scene(files, file("models/two.obj"), &[]);
    assert!(said.is_empty(), "{said:?}");
    let colors: Vec<_> = scene_read.materials.iter().map(|(name, m)| (&**name, m.color)).collect();
    assert_eq!(colors, [("red", glam::DVec3::X), ("green", glam::DVec3::Y)]);
    let worn: Vec<_> = loaded(&scene_read).worn().map(|name| &**name).collect();
    assert_eq!(worn, ["red", "green"]);
    // What the scene has under that name stands for it, and so does the longer name before it.
    let (own, ..) = scene(files, file("models/two.obj"), &["red"]);
    assert_eq!(own.materials.iter().map(|(n, m)| (&**n, m.gloss)).collect::<Vec<_>>(), [("red", 0.5), ("green", 0.0)]);
    let (own, ..) = scene(files, file("models/two.obj"), &["red", "two/red"]);
    assert_eq!(loaded(&own).worn().map(|name| &**name).collect::<Vec<_>>(), ["two/red", "green"]);
}

#[test]
fn equal_names_of_two_libraries_stay_apart() {
    let other = TWO_MTL.to_ascii_lowercase().iter().map(|b| if *b == b'1' { b'0' } else { *b }).collect::<Vec<_>>();
    let other = String::from_utf8(other).unwrap().replace("kd", "Kd");
    let other_obj = String::from_utf8(TWO.to_vec()).unwrap().replace("two.mtl", "other.mtl");
    let folder = folder(&[
        ("two.obj", TWO),
        ("two.mtl", TWO_MTL),
        ("b.obj", other_obj.as_bytes()),
        ("other.mtl", other.as_bytes()),
    ]);
    let desc = |name: &str| EntityDesc::new([file(name).into()]);
    let mut scene =
        Scene { base: folder.path().into(), entities: vec![desc("two.obj"), desc("b.obj")], ..Scene::default() };
    let (problems, warnings) = load_all(&mut scene);
    assert!(problems.is_empty() && warnings.is_empty());
    assert_eq!(scene.materials.iter().map(|(n, _)| &**n).collect::<Vec<_>>(), ["red", "green", "b/red", "b/green"]);
}

#[test]
fn libraries_that_are_missing_are_told_once() {
    let (read, said, _folder) = scene(&[("two.obj", TWO)], file("two.obj"), &["green"]);
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].contains("two.obj:1:8: warning: no materials: cannot read"), "{}", said[0]);
    assert_eq!(loaded(&read).worn().map(|name| &**name).collect::<Vec<_>>(), ["green"]);
    let (_, said, _folder) = scene(&[("two.obj", TWO), ("two.mtl", b"newmtl red\nKd 1 0 0\n")], file("two.obj"), &[]);
    assert!(said[0].contains("no library has the material `green`"), "{said:?}");
    let plain = Mesh { file_materials: false, ..file("two.obj") };
    assert!(scene(&[("two.obj", TWO)], plain, &[]).1.is_empty());
}

#[test]
fn names_of_libraries_may_have_blanks() {
    let obj = String::from_utf8(TWO.to_vec()).unwrap().replace("two.mtl", "my red.mtl my green.MTL");
    let files: &[(&str, &[u8])] = &[
        ("two.obj", obj.as_bytes()),
        ("my red.mtl", b"newmtl red\nKd 1 0 0\n"),
        ("my green.MTL", b"newmtl green\nKd 0 1 0\n"),
    ];
    let (read, said, _folder) = scene(files, file("two.obj"), &[]);
    assert!(said.is_empty(), "{said:?}");
    assert_eq!(
        read.materials.iter().map(|(n, m)| (&**n, m.color.y)).collect::<Vec<_>>(),
        [("red", 0.0), ("green", 1.0)]
    );
}

#[test]
fn maps_are_found_where_projects_have_been_moved_and_left_out_where_not() {
    let mut png = std::io::Cursor::new(Vec::new());
    ::image::RgbImage::from_pixel(2, 2, ::image::Rgb([128, 128, 255]))
        .write_to(&mut png, ::image::ImageFormat::Png)
        .unwrap();
    let png = png.into_inner();
    let mtl = b"newmtl red\nmap_Kd C:\\work\\WOOD.png\nmap_Bump wood.png\nmap_Ks gone.png\nnewmtl green\nKd 1 1 1\n";
    let files: &[(&str, &[u8])] = &[("m/two.obj", TWO), ("m/two.mtl", mtl), ("m/Wood.png", &png)];
    let (read, said, _folder) = scene(files, file("m/two.obj"), &[]);
    let red = &read.materials[0].1;
    assert_eq!(red.color_map.as_ref().unwrap().image.as_deref(), Some("m/Wood.png"));
    // It shows normals, whatever it is called.
    assert!(red.normal_map.is_some() && red.bump.is_none() && red.specular_map.is_none());
    assert!(said.len() == 1 && said[0].contains("two.mtl:4:1: warning: the map is left out"), "{said:?}");
}

#[test]
fn groups_are_picked_by_name() {
    let obj = b"v 0 0 0\nv 1 0 0\nv 1 1 0\no lid\nf 1 2 3\nf 1 3 2\no vase\nf 1 2 3\n";
    let of = |group: &str| scene(&[("a.obj", obj)], Mesh { group: Some(group.into()), ..file("a.obj") }, &[]);
    let (read, said, _folder) = of("lid");
    assert!(said.is_empty());
    assert_eq!(loaded(&read).pieces().iter().map(|piece| piece.data.triangles.len()).sum::<usize>(), 2);
    assert!(of("lit").1[0].contains("no group or object `lit`; did you mean `lid`?"));
}

#[test]
fn a_polygon_of_every_format_keeps_its_area() {
    let corners = [[-1.5, -1.2], [0.0, -0.2], [1.5, -1.2], [0.0, 1.5]];
    let lines = |prefix: &str| corners.map(|[x, y]| format!("{prefix}{x} {y} 0\n")).concat();
    let expected = 1.5 * (0.2 + 1.5);
    let obj = read("a.obj", format!("{}f 1 2 3 4\n", lines("v ")).as_bytes()).unwrap();
    let header = &PLY[..PLY.find("0 0 0\n").unwrap()];
    let ply = read("a.ply", format!("{header}{}4 0 1 2 3\n", lines("")).as_bytes()).unwrap();
    for data in [obj, ply] {
        assert!((area(&data) - expected).abs() < 1e-5, "{}", area(&data));
    }
}

/// Bytes of a good file with some of them changed, cut out or put in.
fn mutated(good: &'static [u8]) -> impl Strategy<Value = Vec<u8>> {
    let change = (any::<prop::sample::Index>(), any::<u8>(), 0u8..4);
    prop::collection::vec(change, 0..12).prop_map(move |changes| {
        let mut bytes = good.to_vec();
        for (at, byte, what) in changes {
            let i = at.index(bytes.len().max(1));
            match what {
                0 if i < bytes.len() => bytes[i] = byte,
                1 if i < bytes.len() => drop(bytes.remove(i)),
                2 => bytes.insert(i.min(bytes.len()), byte),
                _ => bytes.extend_from_within(i.min(bytes.len())..(i + 20).min(bytes.len())),
            }
        }
        bytes
    })
}

const RICH: &[u8] =
    b"# all of it\nmtllib a.mtl\no lid\ng a b\ns 1\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0 # c\nv 0 1 0\nv 2 \\\n2 2\n\
vt 0 0\nvt 1\nvt 1 1 0\nvn 0 0 1\nvn nan 0 0\nusemtl red\nf 1/1/1 2/2/2 3/3/1\nf -4 -3 -2 -1\nf 1//1 2 3/2 4 5\n\
l 1 2 3\np 1\ns off\nusemtl\ncstype bezier\nf 5/9 1 2\n";

const RICH_MTL: &[u8] = b"newmtl red\nKd 1 0 0\nKs 1 1 1\nNs 10\nd 0.5\nTr 0.5\nNi 1.5\nillum 7\nTf 1 0 0\nKe 0 0 1\n\
map_Kd -s 1 2 3 -o 0 0 -clamp on x.png\nmap_Bump -bm 1 y.png\nPr 0.5\nPm 1\nmap_disp z\nnewmtl b\nKd spectral a.rfl\n";

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn any_obj_is_read_or_refused(bytes in mutated(RICH), mtl in mutated(RICH_MTL)) {
        let mut notes = Notes::default();
        let source = SourceFile { file: "a.obj", bytes: &bytes };
        if let Ok(obj) = obj::parse(source, true, &mut notes) {
            let mesh = Mesh { data: Arc::new(obj.data), smooth: Some(true), ..Mesh::default() };
            prop_assert!(mesh.check().is_ok());
            let triangles: usize = mesh.pieces().iter().map(|piece| piece.data.triangles.len()).sum();
            prop_assert_eq!(triangles, mesh.data.triangles.len());
            Mesh { smooth: None, crease_angle: Some(30.0), ..mesh.clone() }.pieces();
            Mesh { smooth: None, ..mesh }.pieces();
        }
        for definition in obj::mtl::parse(SourceFile { file: "a.mtl", bytes: &mtl }, &mut notes) {
            let _ = definition.material.check();
        }
        notes.into_warnings();
    }

    #[test]
    fn any_ply_is_read_or_refused(bytes in mutated(PLY.as_bytes()), binary in any::<bool>()) {
        let mut bytes = bytes;
        if binary {
            bytes = binary_ply().into_iter().zip(bytes.iter().cycle()).map(|(a, b)| if b % 17 == 0 { *b } else { a }).collect();
        }
        let source = SourceFile { file: "a.ply", bytes: &bytes };
        if let Ok(data) = ply::parse(source, true, &mut Notes::default()) {
            prop_assert!(data.triangles.iter().flatten().all(|i| (*i as usize) < data.vertices.len()));
        }
    }

    #[test]
    fn any_stl_is_read_or_refused(bytes in mutated(b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n")) {
        let _ = stl::parse(SourceFile { file: "a.stl", bytes: &bytes }, true, &mut Notes::default());
    }
}

#[test]
fn a_scene_names_files_relative_to_itself() {
    let folder = folder(&[("a/b.obj", TWO)]);
    assert!(load(&folder.path().into(), "a/b.obj", false).is_ok());
    assert!(load(&Path::new("nowhere").into(), "a/b.obj", false).is_err());
}
