use super::*;

fn read(text: &str) -> (MeshData, Vec<String>) {
    read_bytes(text.as_bytes())
}

fn read_bytes(bytes: &[u8]) -> (MeshData, Vec<String>) {
    let mut notes = Notes::default();
    let obj = parse(SourceFile { file: "a.obj", bytes }, false, &mut notes).map_err(|d| d.to_string()).unwrap();
    (obj.data, notes.into_warnings().iter().map(ToString::to_string).collect())
}

fn quiet(text: &str) -> MeshData {
    let (data, warnings) = read(text);
    assert!(warnings.is_empty(), "{warnings:?}");
    data
}

fn fails(text: &str) -> String {
    let parsed = parse(SourceFile { file: "a.obj", bytes: text.as_bytes() }, false, &mut Notes::default());
    parsed.map(|_| ()).unwrap_err().to_string()
}

/// Four corners of a square, and a fifth.
const POINTS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 2 0\n";

#[test]
fn a_square_is_two_triangles_and_unused_vertices_are_left_out() {
    let data = quiet(&format!("{POINTS}f 1 2 3 4\n"));
    assert_eq!((data.vertices.len(), data.triangles), (4, vec![[0, 1, 2], [0, 2, 3]]));
}

#[test]
fn corners_share_a_vertex_only_where_all_of_it_is_the_same() {
    let data =
        quiet(&format!("{POINTS}vt 0 0\nvt 1 1\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1/1/1 3/2/1 4/1/1\nf 1//1 2 3\n"));
    assert_eq!(data.triangles, [[0, 1, 2], [0, 3, 4], [5, 6, 7]]);
    assert_eq!((data.uvs[3], data.uvs[5]), (Vec2::ONE, MeshData::NO_UV));
    assert_eq!((data.normals[5], data.normals[6]), (Vec3::Z, Vec3::ZERO));
}

#[test]
fn a_group_without_faces_takes_nothing_from_the_others() {
    let card = format!("{POINTS}vt 0 0\nvn 0 0 1\ng card\nf 1/1/1 2/1/1 3/1/1\n");
    assert_eq!(quiet(&format!("{card}g\n")), quiet(&card));
}

#[test]
fn lines_go_on_behind_a_backslash_and_end_before_a_comment() {
    let plain = quiet(&format!("{POINTS}f 1 2 3\n"));
    for text in [
        POINTS.replace("v 1 0 0", "v 1 \\\n 0 0") + "f 1 2 \\\r\n3\n",
        POINTS.replace('\n', " # here\n") + "f 1 2 3# there",
        POINTS.replace('\n', "\r\n") + "f 1 2 3\r\n",
        POINTS.replace('\n', "\r") + "f 1 2 3\r",
        POINTS.replace("v 1 0 0", "\tv\t1. +.0e0 0   ") + "  f  1  2  3  ",
        format!("\n\n#\n{POINTS}f -5 -4 -3"),
        format!("f 1 2 3\n{POINTS}"),
    ] {
        assert_eq!(quiet(&text), plain, "{text:?}");
    }
}

#[test]
fn faces_may_come_before_what_they_name() {
    let ordered = quiet(&format!("{POINTS}vt 0 0\nvt 1 0\nvn 0 0 1\nusemtl a\ng x\nf 1/1/1 2/2/1 3/1/1\nf 3 4 5\n"));
    let turned = quiet(&format!("usemtl a\ng x\nf 1/1/1 2/2/1 3/1/1\nf 3 4 5\n{POINTS}vt 0 0\nvt 1 0\nvn 0 0 1\n"));
    assert_eq!(turned, ordered);
    // Numbers that count backwards count from where they stand.
    let data = quiet("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nf 4 5 6\nv 9 9 9\nv 8 8 8\nv 7 8 9\n");
    assert_eq!(data.vertices[0], Vec3::ZERO);
}

#[test]
fn lines_and_points_are_no_surfaces() {
    let (data, warnings) = read(&format!("{POINTS}f 1 2 3\nl 1 2 3 4 5\nl 1 2\np 1 2 3 4\nf 1 2\n"));
    assert_eq!(data.triangles.len(), 1);
    assert_eq!(warnings.len(), 3, "{warnings:?}");
    assert!(warnings[0].starts_with("a.obj:7:1: warning: `l` is not drawn: lines have no surface (2 times"));
}

#[test]
fn texture_coordinates_may_be_one_number() {
    let data = quiet(&format!("{POINTS}vt 0\nvt 1\nvt .5\nf 1/1 2/2 3/3\n"));
    assert_eq!(data.uvs, [Vec2::ZERO, Vec2::X, Vec2::X * 0.5]);
}

#[test]
fn normals_that_are_none_are_missing() {
    let (data, warnings) = read(&format!("{POINTS}vn 0 0 1\nvn -nan(ind) 0 1.#QNAN\nf 1//1 2//0 3//2\n"));
    assert_eq!(data.normals, [Vec3::Z, Vec3::ZERO, Vec3::ZERO]);
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].starts_with("a.obj:7:1: warning: a normal that is no direction"), "{warnings:?}");
}

#[test]
fn names_and_comments_may_be_of_any_encoding() {
    let (data, warnings) =
        read_bytes(b"# Stra\xdfe\nv 0 0 0\nv 1 0 0\nv 0 1 0\ng W\xfcrfel\nusemtl gr\xc3\xbcn\nf 1 2 3\n");
    assert!(warnings.is_empty());
    assert_eq!((&*data.groups[0].name, &*data.materials[0].name), ("Würfel", "grün"));
}

#[test]
fn materials_and_groups_have_runs_of_triangles() {
    let text = format!(
        "{POINTS}f 1 2 3\nusemtl red\no box\nf 1 2 3 4\ng lid top\nusemtl blue\nf 1 2 3\nusemtl \nf 1 2 3\nusemtl red\no\nf 1 2 3\n"
    );
    let data = quiet(&text);
    let set = |name: &str, runs: &[[u32; 2]]| crate::components::FaceSet { name: name.into(), runs: runs.to_vec() };
    assert_eq!(data.materials, [set("red", &[[1, 3], [5, 6]]), set("blue", &[[3, 4]])]);
    let grouped = [set("box", &[[1, 5]]), set("lid", &[[3, 5]]), set("top", &[[3, 5]]), set("lid top", &[[3, 5]])];
    assert_eq!(data.groups, grouped);
}

#[test]
fn smoothing_groups_are_kept_if_any_is_smooth() {
    assert!(quiet(&format!("{POINTS}s off\nf 1 2 3\ns 0\nf 1 2 3\n")).smoothing.is_empty());
    let data = quiet(&format!("{POINTS}f 1 2 3\ns 2\nf 1 2 3 4\ns off\nf 1 2 3\n"));
    assert_eq!(data.smoothing, [0, 2, 2, 0]);
}

#[test]
fn colours_of_some_vertices_leave_the_others_white() {
    let (data, warnings) = read("v 0 0 0\nv 1 0 0 1 0.5 0\nv 0 1 0 0 0 1\nf 1 2 3\n");
    assert!(warnings.is_empty());
    assert_eq!(data.colors, [Vec4::ONE, Vec4::new(1.0, 0.5, 0.0, 1.0), Vec4::new(0.0, 0.0, 1.0, 1.0)]);
    let (data, warnings) = read("v 0 0 0 255 0 0\nv 1 0 0 0 51 0\nv 0 1 0 0 0 255\nf 1 2 3\n");
    assert_eq!(data.colors[1], Vec4::new(0.0, 0.2, 0.0, 1.0));
    assert!(warnings[0].contains("taken as 0 to 255"));
    // A fourth number is a weight of curves.
    assert!(quiet("v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n").colors.is_empty());
}

#[test]
fn what_cannot_be_read_has_its_place() {
    for (text, said) in [
        ("v 0 0\n", "a.obj:1:1: error: `v` needs 3 numbers and has 2"),
        ("v 0 0 zero\n", "a.obj:1:7: error: `zero` is not a number"),
        ("v 1,5 2,5 0\n", "numbers have a point before their decimals"),
        ("v 0 0 0\nf 1 2 3\n", "a.obj:2:5: error: vertex 2 does not exist; there are 1, numbered from 1"),
        ("v 0 0 0\nf 1 1 -2\n", "a.obj:2:7: error: vertex -2 does not exist"),
        ("v 0 0 0\nf 1 0 1\n", "a.obj:2:5: error: vertex 0 does not exist"),
        ("v 0 0 0\nf 1/a 1 1\n", "a.obj:2:3: error: `1/a` is not a corner of a face"),
        ("v 0 0 0\nf one two three\n", "corners are written 1, 1/2, 1//3 or 1/2/3"),
        ("v 0 0 0\nv 0 nan 0\nf 1 2 1\n", "a.obj:2:1: error: vertex 2 is used by a face and has the coordinate NaN"),
        ("v 0 0 0\nv 0 1e12 0\nf 1 2 1\n", "a.obj:2:1: error: vertex 2 lies beyond +-1e9"),
        ("<html>\n<body>\n", "this is no OBJ file"),
        ("", "this is no OBJ file"),
    ] {
        assert!(fails(text).contains(said), "{text:?}: {}", fails(text));
    }
    // What no face uses may be anything.
    quiet(&format!("{POINTS}v nan nan nan\nf 1 2 3\n"));
}

#[test]
fn what_is_not_used_is_said_once() {
    let (_, warnings) =
        read(&format!("{POINTS}bevel on\ncstype bezier\nfoo bar\nfoo bar\nvt 0 0\nf 1/1 2/1 3/7\nvt 0 0 0 4\n"));
    let said: Vec<&str> = warnings.iter().map(|w| w.lines().next().unwrap()).collect();
    assert_eq!(
        said,
        [
            "a.obj:6:1: warning: `bevel` is not used",
            "a.obj:7:1: warning: `cstype` is not used: curves and surfaces are not read",
            "a.obj:8:1: warning: `foo` is no statement of OBJ; the line is skipped (2 times in this file)",
            "a.obj:11:13: warning: texture coordinates 7 does not exist; there are 2, numbered from 1",
            "a.obj:12:10: warning: `4` after the end of `vt` is not used",
        ]
    );
}
