//! Words of other tools, and of everyday speech, with ours: for mistakes that no distance of letters explains.
//!
//! A word is only ever offered where it works: the caller says which words are known there.

mod functions;
mod picture;
mod synonym;

use functions::FUNCTIONS;
use picture::PICTURE;
use synonym::{Synonym, meaning};

/// Words of ours that stand inside of something else than where they were written.
const ELSEWHERE: &[Synonym] = &[
    meaning(
        &["translation", "rotation", "scale", "scaling", "yaw", "pitch", "roll", "parent"],
        &["transform"],
        "which holds it: `transform: (...)`",
    ),
    meaning(
        &["color", "colour", "roughness", "ior", "metallic", "emission"],
        &["material"],
        "the name of one of `materials`",
    ),
];

const MEANINGS: &[Synonym] = &[
    // Places.
    meaning(
        &["position", "pos", "location", "loc", "translate", "move", "origin", "place", "xyz", "coords", "coordinates"],
        &["translation", "from", "center", "position", "point", "offset", "base", "transform"],
        "",
    ),
    meaning(
        &["rotate", "rot", "orientation", "euler", "eulerangles", "rotationeuler", "angles", "direction", "quaternion"],
        &["rotation", "at", "transform"],
        "degrees: pitch, yaw, roll",
    ),
    meaning(&["heading", "spin", "azimuth"], &["yaw"], "degrees"),
    meaning(&["tilt", "elevation", "inclination"], &["pitch"], "degrees"),
    meaning(&["bank", "banking", "twist"], &["roll"], "degrees"),
    meaning(&["scaling", "zoom", "stretch", "dimensions", "scalexyz"], &["scale", "fov", "size"], ""),
    meaning(
        &["toworld", "matrixworld", "worldmatrix", "objecttoworld", "modelmatrix", "transformation", "xform"],
        &["matrix", "transform"],
        "",
    ),
    meaning(
        &["childof", "attachedto", "parentto", "attach", "parentname", "owner"],
        &["parent"],
        "the name of an entity",
    ),
    meaning(
        &["target", "lookat", "lookatpoint", "to", "interest", "focalpoint", "aim", "pointat", "center", "eyetarget"],
        &["at", "center", "look_at", "direction"],
        "",
    ),
    meaning(&["eye", "lookfrom", "viewpoint", "cameraposition", "start", "src"], &["from", "base", "file"], ""),
    meaning(&["upvector", "vup", "viewup", "worldup"], &["up"], ""),
    // Bodies.
    meaning(&["cube", "box", "block", "cuboid", "brick", "rect3d", "aabb"], &["aabox"], ""),
    meaning(&["ball", "globe", "orb", "spheregeometry", "icosphere", "uvsphere"], &["sphere"], ""),
    meaning(&["floor", "ground", "infiniteplane", "halfspace"], &["plane"], ""),
    meaning(&["pipe", "rod", "column", "pillar"], &["cylinder", "tube"], ""),
    meaning(&["donut", "doughnut", "ring"], &["torus"], ""),
    meaning(&["disc", "circle"], &["disk", "orbit"], ""),
    meaning(
        &["object", "obj", "geometry", "polygons", "polymesh", "geom", "shape"],
        &["mesh", "entities", "sphere", "file"],
        "",
    ),
    meaning(&["tri", "polygon", "face"], &["triangle"], ""),
    meaning(
        &["rectangle", "quad", "rect", "square", "card"],
        &["aabox", "mesh"],
        "a flat box, or a mesh of two triangles",
    ),
    meaning(&["r", "rad", "diameter"], &["radius"], ""),
    meaning(&["centre", "middle", "midpoint", "c"], &["center"], ""),
    meaning(&["bottom", "foot"], &["base", "min"], ""),
    meaning(&["top", "tip", "cap"], &["apex", "max", "capped"], ""),
    meaning(&["corner1", "lower", "lowercorner", "p0", "minimum", "low"], &["min", "base"], ""),
    meaning(&["corner2", "upper", "uppercorner", "p1", "maximum", "high"], &["max", "apex"], ""),
    meaning(&["closed", "open", "caps"], &["capped"], "true or false"),
    meaning(&["path", "filename", "source", "url", "uri", "filepath"], &["file", "image", "scene"], ""),
    meaning(&["points", "positions", "verts", "vertexes", "coord"], &["vertices"], ""),
    meaning(&["faces", "indices", "polys", "elements"], &["triangles"], ""),
    meaning(&["texcoords", "uv", "texturecoordinates", "st", "uvcoords"], &["uvs"], ""),
    meaning(&["smoothing", "smoothshading", "shadesmooth", "flatshading", "shadeflat"], &["smooth"], ""),
    // Entities.
    meaning(&["id", "label", "title", "ident", "key"], &["name"], ""),
    meaning(
        &["tag", "group", "groups", "labels", "layers", "collection", "classes"],
        &["tags", "tagged"],
        "a list of texts",
    ),
    meaning(&["mat", "shader", "surface", "skin", "appearance", "finish"], &["material"], "the name of a material"),
    meaning(&["objects", "children", "nodes", "bodies", "shapes", "primitives"], &["entities"], ""),
    meaning(
        &[
            "torus", "disk", "disc", "circle", "capsule", "tube", "lathe", "sor", "prism", "teapot", "text", "ring",
            "curve",
        ],
        &["mesh"],
        "functions of scripts make such: torus, disk, tube, lathe, extrude, text",
    ),
    meaning(&["materiallibrary", "mats", "shaders"], &["materials"], ""),
    meaning(&["settings", "options", "output", "film", "globalsettings", "renderer"], &["render", "integrator"], ""),
    meaning(&["cam", "view", "viewer"], &["camera"], ""),
    meaning(&["hidden", "hide", "show", "enabled", "active", "visibility"], &["visible"], ""),
    meaning(&["castshadow", "castshadows", "castsshadows", "noshadow", "shadows"], &["shadow", "visible"], ""),
    meaning(&["reflections", "indirect", "glossy", "refraction", "scattered"], &["reflection"], "true or false"),
    meaning(&["lightlinking", "lightset", "lightgroup", "illuminates"], &["light_link"], ""),
    meaning(&["shadowlinking", "shadowset", "casters", "blockers"], &["shadow_link"], ""),
    meaning(&["include", "only", "receivers", "lit"], &["includes"], "a list of tags"),
    meaning(&["exclude", "except", "without", "ignore"], &["excludes"], "a list of tags"),
    // Light.
    meaning(
        &[
            "lightsource",
            "pointlamp",
            "bulb",
            "omni",
            "omnilight",
            "pointlightsource",
            "light",
            "lamp",
            "lights",
            "emitter",
            "emitters",
        ],
        &["point_light", "entities"],
        "a flat one is an `area_light`",
    ),
    meaning(
        &["rectlight", "quadlight", "softbox", "panel", "arealamp", "rectangularlight", "area"],
        &["area_light"],
        "",
    ),
    meaning(
        &["sun", "sunlight", "distantlight", "dirlight", "directional", "parallellight"],
        &["directional_light"],
        "",
    ),
    meaning(&["spot", "spotlamp", "conelight"], &["spot_light"], ""),
    meaning(
        &["power", "energy", "brightness", "strength", "lumens", "watts", "luminosity", "wattage", "lightintensity"],
        &["intensity", "environment_intensity", "emission", "color"],
        "how bright it is",
    ),
    meaning(
        &[
            "intensity",
            "radiance",
            "spectrum",
            "lightcolor",
            "irradiance",
            "illuminance",
            "ambientlight",
            "ambientcolor",
        ],
        &["intensity", "emission", "color", "background"],
        "how bright it is",
    ),
    meaning(&["kelvin", "colortemperature", "cct", "blackbody"], &["temperature"], "kelvin"),
    meaning(&["decay", "distancefalloff", "fadepower", "fadedistance", "attenuation"], &["falloff", "absorption"], ""),
    meaning(&["mist", "haze", "volume", "volumetric", "atmosphere", "medium", "media"], &["fog"], ""),
    meaning(&["extinction", "sigmat"], &["density"], "lost per world unit"),
    meaning(&["asymmetry", "phase", "phasefunction", "eccentricity"], &["anisotropy"], "from -0.95 to 0.95"),
    // Materials.
    meaning(
        &[
            "albedo",
            "diffusecolor",
            "basecolor",
            "tint",
            "rgb",
            "pigment",
            "basecolour",
            "cd",
            "reflectance",
            "colorrgb",
            "diffusecolour",
            "hue",
            "fill",
        ],
        &["color", "tint"],
        "",
    ),
    meaning(&["kd", "diffuseweight", "diffusereflection"], &["diffuse"], "`color` is the colour, `diffuse` its weight"),
    meaning(
        &["ks", "highlight", "specularweight", "phong", "specularlevel", "spec"],
        &["specular"],
        "the weight of the highlight",
    ),
    meaning(&["cs", "speculartint", "specularcolour", "highlightcolor"], &["specular_color"], ""),
    meaning(
        &["shine", "ns", "phongsize", "phongexponent", "exponent", "specularexponent", "hardness", "specularpower"],
        &["shininess"],
        "the exponent of the highlight",
    ),
    meaning(
        &["mirror", "reflectivity", "reflect", "kr", "reflective", "reflections", "mirrorness"],
        &["reflection"],
        "its weight",
    ),
    meaning(&["glossy", "glossiness", "glossyness", "fuzz", "blurriness", "smoothness"], &["gloss", "roughness"], ""),
    meaning(
        &[
            "transparency",
            "transparent",
            "kt",
            "transmittance",
            "transmit",
            "dissolve",
            "translucency",
            "refraction",
            "seethrough",
            "clear",
        ],
        &["transmission"],
        "0 is opaque, 1 is clear: 1 - opacity",
    ),
    meaning(
        &["refractiveindex", "indexofrefraction", "ni", "refractionindex", "iorvalue", "index", "n", "eta"],
        &["ior", "eta"],
        "1.5 is glass",
    ),
    meaning(
        &[
            "emissive",
            "emit",
            "glow",
            "ke",
            "emissioncolor",
            "emissivecolor",
            "luminance",
            "selfillumination",
            "ambient",
            "incandescence",
            "emissionstrength",
            "emissiveintensity",
        ],
        &["emission"],
        "the radiance that a surface sends out",
    ),
    meaning(&["alpha", "coverage"], &["opacity", "transmission"], "how much of the surface is there"),
    meaning(&["rough", "ggx", "alphag", "microroughness"], &["roughness"], ""),
    meaning(
        &["metalness", "metal", "metall"],
        &["metallic", "model"],
        "of `model: Principled`; bare metal is `Conductor`",
    ),
    meaning(&["glass", "transparent", "refractive"], &["Dielectric"], "with `ior`"),
    meaning(&["metal", "mirror", "chrome", "metallic"], &["Conductor"], "with `roughness`"),
    meaning(&["diffuse", "matte", "lambertian", "clay"], &["Lambert"], ""),
    meaning(&["disney", "pbr", "standard", "uber", "openpbr", "gltf"], &["Principled"], ""),
    meaning(&["phong", "blinn", "classic"], &["BlinnPhong"], ""),
    meaning(&["coated", "glossy", "ceramic"], &["Plastic"], "with `roughness`"),
    meaning(
        &["coneangle", "spotsize", "spotangle", "cutoffangle", "beamangle", "spread"],
        &["outer_angle"],
        "degrees from the axis",
    ),
    meaning(&["spotblend", "penumbra", "softness", "edge"], &["inner_angle"], "degrees from the axis"),
    meaning(&["glass", "dielectric"], &["model"], "write `model: Dielectric`, with `ior`"),
    meaning(
        &["clearcoat", "coat", "clearcoatroughness"],
        &["model"],
        "write `model: Plastic`, with `ior` and `roughness`",
    ),
    meaning(
        &["brdf", "bsdf", "bxdf", "type", "kind", "shading", "illum", "shadingmodel", "lighting"],
        &["model", "pattern", "mode", "kind", "projection", "integrator", "material"],
        "",
    ),
    meaning(&["extinction", "absorb", "sigmaa", "fadecolor", "beer", "density"], &["absorption"], "per world unit"),
    meaning(
        &["doublesided", "backface", "onesided", "culling", "backfaceculling", "doubleside", "side", "twosided"],
        &["two_sided"],
        "true or false",
    ),
    meaning(
        &[
            "texture",
            "mapkd",
            "diffusemap",
            "albedomap",
            "imagemap",
            "diffusetexture",
            "basecolortexture",
            "map",
            "colortexture",
            "image",
            "texturemap",
            "albedotexture",
        ],
        &["color_map", "image", "texture"],
        "",
    ),
    meaning(
        &["bumpmap", "heightmap", "displacement", "displace", "mapbump", "relief", "displacementmap"],
        &["bump"],
        "",
    ),
    meaning(&["normal", "normals", "normaltexture", "mapnormal", "norm"], &["normal_map", "normal", "normals"], ""),
    meaning(&["roughnesstexture", "glossmap", "metallicroughness"], &["roughness_map"], ""),
    meaning(&["specmap", "mapks", "speculartexture"], &["specular_map"], ""),
    // Textures.
    meaning(&["repeat", "tiling", "tile", "frequency", "uvscale"], &["scale", "wrap"], ""),
    meaning(&["shift", "uvoffset", "phase"], &["offset"], ""),
    meaning(&["procedural", "generator", "checkerboard", "checks"], &["pattern"], ""),
    meaning(&["colours", "palette", "gradient", "ramp", "colorramp"], &["colors"], ""),
    meaning(&["height", "amount", "bumpscale", "relieftexture"], &["depth", "size", "apex"], ""),
    meaning(&["interpolation", "filtering", "mipmap"], &["filter"], ""),
    // The sequence.
    meaning(
        &["length", "duration", "framecount", "count", "numframes", "end", "total", "nframes"],
        &["frames", "count", "len"],
        "",
    ),
    meaning(&["framerate", "rate", "speed", "fpscount", "framespersecond"], &["fps"], "frames a second"),
    meaning(&["loop", "looping", "cycle"], &["mode"], "mode: \"loop\""),
    meaning(&["time", "secs", "sec", "now", "elapsed", "clock"], &["seconds", "t"], "`t` goes from 0 to 1"),
    meaning(&["frame", "framenumber", "num", "no", "current"], &["number", "f"], ""),
    meaning(&["progress", "percent", "normalizedtime", "u"], &["t"], "0 to 1"),
    meaning(&["i", "idx", "frameindex"], &["index"], ""),
    meaning(&["default", "value", "range", "values"], &["choices", "min", "value"], ""),
];

/// As [`by_meaning`], for a compound of which a part is such a word, or one of ours: `use_denoising`, `PathTracer`.
pub fn by_parts<'a>(found: &str, known: &[&'a str]) -> Option<(&'a str, &'static str)> {
    let mut words: Vec<String> = Vec::new();
    let mut before = '_';
    for c in found.chars() {
        if c == '_' || c == '-' || c == ' ' || (c.is_uppercase() && before.is_lowercase()) {
            words.push(String::new());
        }
        if c.is_alphanumeric() {
            words.last_mut().map(|word| word.extend(c.to_lowercase())).or_else(|| {
                words.push(c.to_lowercase().collect());
                None
            });
        }
        before = c;
    }
    words.retain(|word| !word.is_empty());
    let count = words.len();
    // What stands last is the thing, and what stands before it says which; the most words come first.
    let spans = (1..count).flat_map(|left_out| [(left_out, count), (0, count - left_out)]);
    let mut parts = spans.map(|(from, to)| words[from..to].join("_")).filter(|part| part.len() > 2);
    parts.find_map(|part| {
        let own = known.iter().find(|known| known.eq_ignore_ascii_case(&part)).map(|known| (*known, ""));
        own.or_else(|| by_meaning(&part, known))
    })
}

/// A word of ours among those that are `known`, for one that means the same elsewhere; with a note, which may be empty.
pub fn by_meaning<'a>(found: &str, known: &[&'a str]) -> Option<(&'a str, &'static str)> {
    let plain: String = found.chars().filter(|c| !['_', '-', ' '].contains(c)).flat_map(char::to_lowercase).collect();
    let fits = |meaning: &&Synonym| meaning.foreign.contains(&plain.as_str());
    let all = MEANINGS.iter().chain(PICTURE).chain(FUNCTIONS).chain(ELSEWHERE);
    let pairs = all.filter(fits).flat_map(|meaning| meaning.ours.iter().map(|ours| (*ours, meaning.note)));
    // The first of ours of all that fit comes first, so that a vaguer meaning does not win.
    let mut hits = pairs.filter_map(|(ours, note)| {
        let word = known.iter().find(|known| **known == ours)?;
        (*word != found).then_some((*word, note))
    });
    hits.next()
}

/// Every foreign word with the likeliest of ours.
pub fn pairs() -> impl Iterator<Item = (&'static str, &'static str)> {
    let first = |meaning: &'static Synonym| meaning.ours.first().copied();
    let of = move |meaning: &'static Synonym| {
        meaning.foreign.iter().filter_map(move |foreign| Some((*foreign, first(meaning)?)))
    };
    MEANINGS.iter().chain(PICTURE).chain(FUNCTIONS).flat_map(of)
}

#[cfg(test)]
mod tests;
