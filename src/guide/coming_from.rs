//! Words and idioms of other tools in ours.

use std::collections::BTreeMap;

use super::Block;
use crate::base::synonyms;

/// What one says elsewhere, and here.
const POV_RAY: &[(&str, &str)] = &[
    (
        "camera { location <0,1,-5> look_at <0,0,0> }",
        "camera: (from: (0.0, 1.0, 5.0), at: (0.0, 0.0, 0.0)): +z comes towards you",
    ),
    ("angle 40 (horizontal)", "fov: degrees, vertical"),
    ("pigment { color rgb <1,0,0> }", "color: (1.0, 0.0, 0.0), linear light"),
    ("finish { phong 0.9 phong_size 60 }", "specular: 0.9, shininess: 60.0"),
    ("finish { reflection 0.3 }", "reflection: 0.3"),
    ("interior { ior 1.5 }", "ior: 1.5, transmission: 0.9"),
    ("light_source { <2,4,-3> color rgb 1 }", "(point_light: (position: (2.0, 4.0, 3.0)))"),
    ("area_light <1,0,0>, <0,0,1>, 4, 4", "(area_light: (size: (1.0, 1.0)))"),
    ("box { <-1,-1,-1>, <1,1,1> }", "(aabox: (min: (-1.0, -1.0, -1.0), max: (1.0, 1.0, 1.0)))"),
    ("rotate <0,90,0>", "rotation: (0.0, -90.0, 0.0): right-handed, counter-clockwise"),
    ("#declare Name = ...; #while ... #end", "let name = ...; for i in 0..10 { ... } in `setup`"),
    ("clock", "f.t, or f.seconds"),
    ("+A0.3 +AM2", "samples, noise_threshold"),
    ("max_trace_level 10", "max_depth: 10"),
    ("adc_bailout 0.004", "min_weight: 0.004"),
];

const BLENDER: &[(&str, &str)] = &[
    ("Z up", "y up: (x, z, -y) of Blender's coordinates"),
    ("Principled BSDF, Metallic 1", "model: Conductor, color, roughness"),
    ("Principled BSDF, Transmission 1", "model: Dielectric, ior, roughness"),
    ("Principled BSDF, Metallic 0", "model: Plastic, color, ior, roughness"),
    ("Base Color, Alpha", "color, transmission (1 - alpha)"),
    ("Keyframes, F-Curves", "keys([[0.0, a], [1.0, b, \"in_out_cubic\"]], f.t)"),
    ("Track To, Damped Track", "look_at(from, at), aim(from, at)"),
    ("Follow Path", "along(path(points), f.t)"),
    ("Parent", "transform: (parent: \"name\")"),
    ("Depth of Field: Focus Object, F-Stop", "focus: Entity(\"name\"), focal_length, f_stop"),
    ("Motion Blur: Shutter 0.5", "shutter: (-0.25, 0.25)"),
    ("World HDRI", "environment: \"sky.hdr\""),
    ("Cycles samples, noise threshold, denoise", "samples, noise_threshold, denoise"),
    ("Collections", "tags, s.tagged(tag)"),
];

const P3F: &[(&str, &str)] = &[
    ("v from at up angle", "camera: (from: ..., at: ..., up: ..., fov: ...)"),
    ("f r g b Kd Ks Shine T ior", "color, diffuse, specular, shininess, transmission, ior"),
    ("bclr r g b", "background: (r, g, b)"),
    ("env folder", "environment: \"folder\""),
    ("l x y z r g b", "(point_light: (position: (x, y, z), color: (r, g, b)))"),
    ("s x y z r", "(sphere: (center: (x, y, z), radius: r))"),
    ("box x0 y0 z0 x1 y1 z1", "(aabox: (min: ..., max: ...))"),
    ("pl p1 p2 p3", "(plane: (point: ..., normal: ...))"),
    ("p 3 ...", "(triangle: (vertices: ...))"),
    ("spp n, accel n", "samples: n, accel: Bvh"),
    ("aperture a, focal f", "aperture in world units, focus_distance; `anim convert scene.p3f` writes them"),
];

pub fn blocks() -> Vec<Block> {
    let mut blocks = Vec::new();
    for (title, pairs) in [("POV-Ray", POV_RAY), ("Blender", BLENDER), ("NFF and P3F", P3F)] {
        blocks.push(Block::Heading(title.into()));
        blocks.extend(pairs.iter().map(|(theirs, ours)| Block::Pair((*theirs).into(), (*ours).into())));
    }
    blocks.push(Block::Heading("Words".into()));
    let text =
        "What other tools say, and what it is called here; a mistake is answered with the one that works at its place.";
    blocks.push(Block::Paragraph(text.into()));
    let mut words: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (foreign, ours) in synonyms::pairs() {
        words.entry(ours).or_default().push(foreign);
    }
    blocks.extend(words.into_iter().map(|(ours, foreign)| Block::Pair(ours.into(), foreign.join(", "))));
    blocks
}
