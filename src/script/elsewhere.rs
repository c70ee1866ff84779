//! What scripts of other programs and languages call, where no word of ours is its name: how the same is done here.

use crate::base::diagnostics::{did_you_mean, suggestion};
use crate::base::synonyms::by_meaning;
use crate::components::homes::{home_by_meaning, home_of};
use crate::components::{Kind, Role};

const TURNS: &str = "an entity is turned by its angles in degrees: e.yaw = 90, or e.rotation = [pitch, yaw, roll]";
const MOVES: &str = "an entity is where its `translation` is: e.translation = [x, y, z], or e.translation += [1, 0, 0]";
const COLORS: &str = "a color is a list of three linear numbers from 0 to 1: [1, 0.5, 0]";
const RANDOM: &str =
    "random numbers come from `rng` of the frame: f.rng.range(0, 1), f.rng.int(1, 6); in `setup` from s.rng";
const KEYS: &str = "there are no keyframes to set: keys([[0, 1], [0.5, 3]], f.t) gives the value at a time";
const EVERY: &str = "`anim` calls `frame(s, f)` for every frame and renders it: a script only says what is where";
const ASSIGNS: &str = "fields are assigned: e.yaw = 90; s.camera.fov = 35";
const JOINS: &str = "texts with values in them stand in backticks: `frame ${f.number}`";
const LISTS: &str = "list.reduce(|sum, x| sum + x, 0) goes through a list";

/// What is done here instead of calling a function of a name that there is not.
pub fn of_function(name: &str) -> Option<String> {
    let plain: String = name.chars().filter(|c| *c != '_').flat_map(char::to_lowercase).collect();
    let known = match plain.as_str() {
        "rotate" | "rotatex" | "rotatey" | "rotatez" | "setrotation" | "turn" | "rotateby" | "rotateto" | "spin"
        | "rotateaxis" | "rotateonaxis" | "rotator" => TURNS,
        "translate" | "move" | "moveto" | "moveby" | "setposition" | "setlocation" | "shift" | "moveobject"
        | "settranslation" | "translatex" | "translatey" | "translatez" | "movealongpath" | "goto" => MOVES,
        "setscale" | "resize" | "scaleby" | "scale" => "e.scale = 2, or e.scale = [1, 2, 1]",
        "hide" | "fadeout" | "setvisible" | "setvisibility" | "disable" => "e.visible = false hides it",
        "show" | "fadein" | "enable" => "e.visible = true shows it",
        "setcolor" | "setmaterial" | "setfill" | "setcolour" | "colorize" => {
            "s.material(\"name\").color = [1, 0.5, 0] changes a material, e.material = \"name\" what an entity wears"
        }
        "color" | "colour" | "rgb" | "rgba" | "color3" | "color4" | "vec4" | "hex" | "rgbt" | "rgbf" | "srgb" => COLORS,
        "hsv" | "hsl" | "hsvtorgb" | "hsltorgb" | "hsv2rgb" => COLORS,
        "mod" | "fmod" | "modulo" | "rem" => "the remainder is written x % y",
        "rand" | "random" | "randint" | "randrange" | "uniform" | "randf" | "rnd" | "randomrange" | "randn"
        | "seed" | "srand" | "randomize" | "randomfloat" => RANDOM,
        "log10" => "write log(x)",
        "log2" => "write log(x, 2)",
        "cbrt" => "write pow(x, 1 / 3.0)",
        "fract" | "frac" => "write fraction(x), or x % 1.0",
        "sgn" | "signum" => "write sign(x)",
        "atan2" => "write atan(y, x)",
        "step" => "write if x < edge { 0.0 } else { 1.0 }, or smoothstep(a, b, x)",
        "vec2" | "float2" | "point2" => "two numbers are a list: [x, y]; three are a vector: vec3(x, y, z)",
        "str" | "string" | "format" | "sprintf" | "tostr" | "fmt" | "concat" => JOINS,
        "sum" | "fold" | "accumulate" | "average" | "mean" => LISTS,
        "enumerate" => "write for (item, i) in list { ... }",
        "assert" | "raise" | "error" | "panic" | "abort" => "throw \"why\" ends the script with a message",
        "wait" | "sleep" | "pause" | "settimeout" => {
            "nothing waits: what happens when follows from f.t, 0 to 1, and f.seconds"
        }
        "keyframeinsert" | "keyframe" | "setkeyframe" | "insertkeyframe" | "setkey" | "addkeyframe" => KEYS,
        "render"
        | "renderframe"
        | "requestanimationframe"
        | "save"
        | "saveimage"
        | "writeimage"
        | "saveframe"
        | "animate"
        | "update"
        | "draw"
        | "display"
        | "construct" => EVERY,
        "set" | "setattr" | "setproperty" | "setattribute" | "setvalue" | "setparam" => ASSIGNS,
        "getattr" | "getattribute" | "getproperty" => "fields are read by name: e.yaw, s.camera.fov",
        "setcamera" | "setfov" | "setcameraposition" => {
            "the camera is s.camera: s.camera.from = [0, 1, 5]; s.camera.at = [0, 0, 0]"
        }
        "loadmesh" | "loadobj" | "loadmodel" | "importobj" | "loadgltf" | "importmesh" => {
            "s.spawn(#{ mesh: #{ file: \"model.obj\" } }) reads a mesh"
        }
        "loadtexture" | "loadimage" | "texture" | "imagetexture" => {
            "s.material(\"name\").color_map = #{ image: \"wood.png\" } lays a picture over a material"
        }
        "traverse" | "foreach" | "children" | "getobjects" | "selectall" => {
            "all entities are s.entities(): for e in s.entities() { ... }"
        }
        "linspace" | "arange" | "xrange" => "to count, write for i in 0..10 { let x = i / 10; }",
        "lookat" => "an entity is turned by e.look_at([0, 1, 0]), the camera by s.camera.at = [0, 1, 0]",
        "at" | "getpoint" | "getpointat" | "pointatlength" | "pointat" | "pointfromproportion" => {
            "a point of a path is along(path, t), with t from 0 to 1"
        }
        "deg2rad" | "degtorad" | "toradians" | "radians" => "write to_radians(x); fields take degrees",
        "rad2deg" | "radtodeg" | "todegrees" | "degrees" => "write to_degrees(x)",
        "meshstandardmaterial"
        | "meshphysicalmaterial"
        | "meshphongmaterial"
        | "meshbasicmaterial"
        | "material"
        | "principledbsdf"
        | "shadermaterial"
        | "meshlambertmaterial"
        | "pigment"
        | "finish" => "a material is made by s.add_material(\"name\", #{ color: [1, 0.5, 0], roughness: 0.3 })",
        "getelementbyid" | "getobjectbyname" | "findobjectbyname" => "s.get(\"name\") is the entity of a name",
        _ => return None,
    };
    Some(known.into())
}

/// A call that would make a body or a light, as `Sphere(...)` or `add_cube(...)` do elsewhere.
pub fn of_body(name: &str) -> Option<String> {
    let lower = name.to_lowercase();
    let verbs = ["add_", "create_", "make_", "new_", "spawn_", "primitive_", "add", "create", "make"];
    let word = verbs.iter().find_map(|verb| lower.strip_prefix(verb)).unwrap_or(&lower);
    let word = word.trim_start_matches("primitive_").trim_end_matches("_add").trim_end_matches("geometry");
    let word = word.trim_end_matches("buffer");
    let kinds: Vec<&str> = Kind::ALL
        .iter()
        .filter(|kind| matches!(kind.role(), Role::Shape | Role::Light))
        .map(|kind| kind.name())
        .collect();
    let plain = |text: &str| text.replace('_', "");
    let same = kinds.iter().copied().find(|kind| plain(kind) == plain(word));
    let kind = same.or_else(|| by_meaning(word, &kinds).map(|(kind, _)| kind))?;
    Some(format!("entities are made by s.spawn(#{{ name: \"a\", {kind}: #{{ ... }} }})"))
}

/// What stands here for a variable that other programs and languages have.
pub fn of_variable(name: &str) -> Option<&'static str> {
    Some(match name {
        "PI" | "pi" | "Math" | "math" | "M_PI" | "Pi" => {
            "write PI(), sin(x), sqrt(x) as they are; sind, cosd and tand take degrees"
        }
        "TAU" | "tau" | "TWO_PI" => "write 2 * PI()",
        "E" | "M_E" => "write exp(1)",
        "t" | "time" | "iTime" | "u_time" => "write f.t, from 0 to 1, or f.seconds",
        "seconds" => "write f.seconds",
        "clock" => "write f.t, which goes from 0 to 1",
        "frame" | "frame_number" | "frameNumber" | "frame_current" | "iFrame" | "frameCount" => "write f.number",
        "index" | "frame_index" => "write f.index",
        "fps" => "write f.fps",
        "dt" | "delta" | "deltaTime" => "write f.dt",
        "frames" | "final_frame" | "num_frames" => "write f.count",
        "camera" | "cam" => "write s.camera",
        "render" | "settings" | "renderer" => "write s.render",
        "scene" | "world" | "stage" => "the scene is the first argument of `setup` and `frame`: s",
        "s" => "the scene is the first argument of `setup(s)` and `frame(s, f)`, and is nowhere else",
        "f" => "the frame is the second argument of `frame(s, f)`, and is nowhere else",
        "bpy" | "THREE" | "mi" | "mitsuba" | "cmds" | "manim" | "unreal" | "hou" | "c4d" => {
            "there is no library to call: the scene is s, its camera s.camera, an entity s.get(\"name\")"
        }
        "np" | "numpy" | "glm" | "vec" | "mathutils" | "Vector" => {
            "vectors are lists of three numbers: [1, 2, 3] + [0, 1, 0], length(v), dot(a, b)"
        }
        "console" | "System" | "sys" | "std" | "Debug" | "process" => "print(x) says what a value is",
        "True" => "write true",
        "False" => "write false",
        "None" | "nil" | "null" | "undefined" | "NULL" | "nullptr" => "write () for nothing",
        "NaN" | "nan" | "inf" | "Infinity" => "there is no such number: fields take finite ones",
        "self" => "write this, or hand it over as an argument",
        "rng" | "random" | "rand" | "Random" => "write f.rng, or s.rng in setup",
        "x" | "y" | "z" => "coordinates belong to a vector: v.x",
        "_" => "`_` is for the last case of a switch",
        "UP" | "DOWN" | "LEFT" | "RIGHT" | "ORIGIN" | "OUT" | "IN" => {
            "write the vector: up is [0, 1, 0], right [1, 0, 0]"
        }
        "RED" | "BLUE" | "GREEN" | "WHITE" | "BLACK" | "YELLOW" | "red" | "blue" | "green" | "white" | "black"
        | "yellow" | "White" | "Red" | "Blue" | "Green" => COLORS,
        "fragCoord" | "gl_FragCoord" | "gl_Position" | "uv" | "iResolution" => {
            "a script moves what is in the scene; it is not called for pixels"
        }
        _ => return None,
    })
}

/// Help for a field that something does not have: the word of ours for it there, the place that has it, a slip of the
/// fingers, or what there is.
pub fn of_field<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let known: Vec<&str> = known.into_iter().collect();
    let meant = by_meaning(found, &known).is_some() || is_slip(found, &known);
    if meant {
        return suggestion(found, known);
    }
    if ["yaw", "pitch", "roll"].contains(&found) {
        return Some(format!("`{found}` belongs to an entity: s.get(\"name\").{found}; a camera looks at s.camera.at"));
    }
    let home = home_of(found).map(|home| home.in_script(found));
    home.or_else(|| home_by_meaning(found).map(|(home, field)| home.in_script(field)))
        .or_else(|| suggestion(found, known))
}

/// Whether one of the words differs in a letter or two, of many.
fn is_slip(found: &str, known: &[&str]) -> bool {
    found.chars().count() > 3 && did_you_mean(found, known).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foreign_calls_are_explained() {
        let says = |name: &str, part: &str| {
            let help = of_function(name).or_else(|| of_body(name)).unwrap_or_default();
            assert!(help.contains(part), "{name}: {help}");
        };
        says("rotate", "e.yaw");
        says("getPointAt", "along(path, t)");
        says("rotateY", "e.yaw");
        says("Color", "[1, 0.5, 0]");
        says("Sphere", "sphere: #{");
        says("add_cube", "aabox: #{");
        says("primitive_uv_sphere_add", "sphere: #{");
        says("BoxGeometry", "aabox: #{");
        says("createPointLight", "point_light: #{");
        assert_eq!(of_function("wombat"), None);
    }

    #[test]
    fn fields_are_looked_for_where_they_belong() {
        let help = |found: &str, known: &[&str]| of_field(found, known.iter().copied()).unwrap_or_default();
        assert!(help("fov", &["fog", "size"]).contains("s.camera.fov"));
        assert!(help("position", &["from", "at"]).contains("`from`"));
        assert!(help("smaples", &["samples"]).contains("`samples`"));
        assert!(help("wombat", &["samples"]).contains("expected one of"));
    }
}
