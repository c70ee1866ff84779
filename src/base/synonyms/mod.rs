//! Words of other tools, and of everyday speech, with ours: for mistakes that no distance of letters explains.
//!
//! A word is only ever offered where it works: the caller says which words are known there.

/// What some words elsewhere are called here, and what to say beside it.
struct Synonym {
    /// Lower case, without blanks, dashes and underscores.
    foreign: &'static [&'static str],
    /// Ours, the likeliest first.
    ours: &'static [&'static str],
    /// What the word alone does not tell.
    note: &'static str,
}

const fn meaning(foreign: &'static [&'static str], ours: &'static [&'static str], note: &'static str) -> Synonym {
    Synonym { foreign, ours, note }
}

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
        &["childof", "attachedto", "parentto", "attach", "parentname", "owner"],
        &["parent"],
        "the name of an entity",
    ),
    meaning(
        &["target", "lookat", "lookatpoint", "to", "interest", "focalpoint", "aim", "pointat", "center", "eyetarget"],
        &["at", "center", "look_at"],
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
        &["mesh", "entities", "sphere"],
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
    meaning(&["corner1", "lower", "lowercorner", "p0", "minimum", "low"], &["min"], ""),
    meaning(&["corner2", "upper", "uppercorner", "p1", "maximum", "high"], &["max"], ""),
    meaning(&["closed", "open", "caps"], &["capped"], "true or false"),
    meaning(&["path", "filename", "source", "url", "uri", "filepath"], &["file", "image", "scene"], ""),
    meaning(&["points", "positions", "verts", "vertexes", "coord"], &["vertices"], ""),
    meaning(&["faces", "indices", "polys", "elements"], &["triangles"], ""),
    meaning(&["texcoords", "uv", "texturecoordinates", "st", "uvcoords"], &["uvs"], ""),
    meaning(&["smoothing", "smoothshading", "shadesmooth"], &["smooth"], ""),
    // Entities.
    meaning(&["id", "label", "title", "ident", "key"], &["name"], ""),
    meaning(
        &["tag", "group", "groups", "labels", "layers", "collection", "classes"],
        &["tags", "tagged"],
        "a list of texts",
    ),
    meaning(&["mat", "shader", "surface", "skin", "appearance", "finish"], &["material"], "the name of a material"),
    meaning(&["objects", "children", "nodes", "bodies", "shapes", "primitives"], &["entities"], ""),
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
        &["lightsource", "pointlamp", "bulb", "omni", "omnilight", "pointlightsource", "light", "lamp", "lights"],
        &["point_light", "entities"],
        "a flat one is an `area_light`",
    ),
    meaning(&["rectlight", "quadlight", "softbox", "panel", "arealamp", "rectangularlight"], &["area_light"], ""),
    meaning(
        &["sun", "sunlight", "distantlight", "dirlight", "directional", "parallellight"],
        &["directional_light"],
        "",
    ),
    meaning(&["spot", "spotlamp", "conelight"], &["spot_light"], ""),
    meaning(
        &["power", "energy", "brightness", "strength", "lumens", "watts", "luminosity", "wattage", "lightintensity"],
        &["intensity", "environment_intensity", "color"],
        "how bright it is",
    ),
    meaning(
        &["intensity", "radiance", "spectrum", "lightcolor"],
        &["intensity", "color", "emission"],
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
        &["model", "pattern", "mode", "kind"],
        "",
    ),
    meaning(&["extinction", "absorb", "sigmaa", "fadecolor", "beer", "density"], &["absorption"], "per world unit"),
    meaning(
        &["doublesided", "backface", "onesided", "culling", "backfaceculling", "doubleside"],
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
    meaning(&["height", "amount", "bumpscale", "relieftexture"], &["depth", "size"], ""),
    meaning(&["interpolation", "filtering", "mipmap"], &["filter"], ""),
    // Camera.
    meaning(
        &["fieldofview", "angle", "fovy", "fovdegrees", "viewangle", "yfov", "verticalfov", "vfov"],
        &["fov"],
        "degrees, vertical",
    ),
    meaning(
        &["focaldistance", "focusdist", "focaldist", "focusplane", "objectdistance", "focaldepth", "dofdistance"],
        &["focus_distance"],
        "",
    ),
    meaning(
        &["lensradius", "aperturesize", "apertureradius", "dof", "depthoffield", "blur", "bokehsize"],
        &["aperture"],
        "the radius of the lens, world units",
    ),
    meaning(&["fnumber", "fstop", "apertureblades", "stop"], &["f_stop"], ""),
    meaning(&["focal", "lensmm", "focallength"], &["focal_length", "focus"], "millimetres"),
    meaning(&["bokeh", "bokehshape", "lensshape", "blades"], &["lens"], "Disk or Square"),
    meaning(&["sensor", "filmwidth", "sensorsize", "filmback", "horizontalaperture"], &["sensor_width"], "millimetres"),
    meaning(
        &["motionblur", "shutterspeed", "exposuretime", "shutterangle", "shuttertime"],
        &["shutter"],
        "when it opens and closes, in frames: (0, 0.5)",
    ),
    // Settings.
    meaning(
        &["resolution", "res", "width", "height", "imagesize", "dimension", "pixels", "framesize", "imageresolution"],
        &["size", "y"],
        "(width, height)",
    ),
    meaning(
        &[
            "spp",
            "samplecount",
            "samplesperpixel",
            "aa",
            "antialiasing",
            "antialias",
            "rays",
            "quality",
            "passes",
            "aasamples",
            "numsamples",
            "raysperpixel",
        ],
        &["samples"],
        "",
    ),
    meaning(&["engine", "method", "algorithm", "tracer", "technique"], &["integrator"], ""),
    meaning(
        &["bg", "backgroundcolor", "skycolor", "bclr", "clearcolor", "backgroundcolour", "backdrop", "worldcolor"],
        &["background"],
        "",
    ),
    meaning(
        &[
            "hdri",
            "hdr",
            "envmap",
            "environmentmap",
            "env",
            "skybox",
            "skysphere",
            "ibl",
            "world",
            "dome",
            "skydome",
            "domelight",
            "cubemap",
        ],
        &["environment"],
        "a picture of the sky around the scene",
    ),
    meaning(
        &[
            "bounces",
            "maxbounces",
            "recursion",
            "maxtracelevel",
            "raydepth",
            "tracedepth",
            "maxraydepth",
            "recursiondepth",
            "maxrecursion",
            "depth",
        ],
        &["max_depth", "bit_depth"],
        "",
    ),
    meaning(&["adcbailout", "minimportance", "raythreshold", "cutoff", "minthroughput"], &["min_weight"], ""),
    meaning(&["ev", "gain", "exposurevalue", "stops"], &["exposure"], "stops"),
    meaning(&["tonemap", "tonemapping", "tonemapper", "viewtransform", "look"], &["tone_map"], ""),
    meaning(&["reconstruction", "pixelfilter", "reconstructionfilter"], &["filter"], ""),
    meaning(&["firefly", "clampindirect", "fireflyclamp", "maxradiance"], &["clamp"], ""),
    meaning(&["denoiser", "denoising", "oidn", "noisereduction"], &["denoise"], "true or false"),
    meaning(
        &["adaptive", "adaptivethreshold", "noiselevel", "errorthreshold", "adaptivesampling"],
        &["noise_threshold"],
        "",
    ),
    meaning(&["bits", "bpp", "colordepth", "bitsperchannel"], &["bit_depth"], "8, 16 or 32"),
    meaning(&["gamma", "colorspace", "srgb"], &["transfer"], "Srgb or Linear"),
    meaning(&["photoncount", "numphotons", "causticphotons"], &["photons"], ""),
    meaning(&["softshadows", "shadow", "shadowtype", "shadowmode"], &["shadows"], ""),
    meaning(&["accelerator", "acceleration", "bvh", "grid", "spatialstructure"], &["accel"], ""),
    meaning(&["layer", "aov", "buffers", "channels", "renderpasses"], &["aovs"], ""),
    meaning(&["randomseed", "rngseed"], &["seed"], ""),
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
    // Functions.
    meaning(
        &["add", "addentity", "create", "instantiate", "new", "addobject", "makeentity", "spawnentity"],
        &["spawn", "push"],
        "",
    ),
    meaning(
        &["find", "entity", "lookup", "getobject", "getentity", "object", "getbyname", "findobject", "node"],
        &["get"],
        "",
    ),
    meaning(&["remove", "delete", "destroy", "kill", "erase", "unspawn"], &["despawn", "remove"], ""),
    meaning(&["findall", "withtag", "bytag", "getbytag"], &["tagged"], ""),
    meaning(&["getmaterial", "mtl"], &["material"], ""),
    meaning(&["creatematerial", "newmaterial", "makematerial"], &["add_material"], ""),
    meaning(&["mix", "interpolate", "blend", "linear", "interp"], &["lerp"], ""),
    meaning(&["easing", "tween", "easeinout", "easein", "easeout", "easeinoutcubic", "curve"], &["ease", "path"], ""),
    meaning(&["keyframes", "keyframe", "animate", "fcurve", "track"], &["keys"], ""),
    meaning(&["saturate", "clip", "limit", "constrain"], &["clamp"], ""),
    meaning(
        &["random", "rand", "randint", "randfloat", "uniform", "seedrandom"],
        &["rng"],
        "`f.rng.range(a, b)`, `rng.int(a, b)`",
    ),
    meaning(&["choice", "choose", "sample"], &["pick", "along"], ""),
    meaning(&["perlin", "simplex", "snoise", "simplexnoise", "perlinnoise", "noise3"], &["noise"], ""),
    meaning(&["fbm", "turbulence", "octavenoise"], &["fractal_noise", "turbulence"], ""),
    meaning(&["wiggle", "jitter", "camerashake", "handheld"], &["shake"], ""),
    meaning(&["revolve", "circular", "circlearound"], &["orbit"], ""),
    meaning(&["frompolar", "cylindrical", "oncircle"], &["polar"], ""),
    meaning(&["pointtowards", "face", "facing", "trackto"], &["look_at", "aim"], ""),
    meaning(&["spline", "bezierpath", "catmullrom", "polyline", "bspline"], &["path"], ""),
    meaning(&["pointalong", "getpoint", "evaluate", "positionat", "atlength"], &["along"], ""),
    meaning(&["quatslerp", "lerpangle", "anglelerp", "nlerp", "slerpquat"], &["slerp"], ""),
    meaning(&["pingpong", "trianglewave", "yoyo", "bounce"], &["ping_pong"], ""),
    meaning(&["unit", "normalized", "normalise"], &["normalize"], ""),
    meaning(&["magnitude", "mag", "abslength"], &["length"], ""),
    meaning(&["dist", "distanceto"], &["distance"], ""),
    meaning(&["vector", "vec", "vector3", "v3", "float3", "vec3f", "point3", "color3"], &["vec3"], ""),
    meaning(&["println", "console", "consolelog", "echo", "printf", "puts", "trace", "say"], &["print"], ""),
    meaning(&["fabs", "absolute"], &["abs"], ""),
    meaning(&["ceil", "roundup"], &["ceiling"], ""),
    meaning(&["rounddown", "trunc", "truncate"], &["floor"], ""),
    meaning(&["idiv", "floordiv", "intdiv", "quotient"], &["div"], ""),
    meaning(&["size", "length", "count", "howmany"], &["len", "size", "count"], ""),
    meaning(&["append", "pushback"], &["push"], ""),
    meaning(&["maprange", "map", "fit", "rescale", "linstep", "scalerange"], &["remap", "map"], ""),
    meaning(&["focuspull", "rackfocus", "pullfocus"], &["rack"], ""),
    meaning(&["parameter", "arg", "argument", "option", "define", "getparam", "setting"], &["param"], ""),
    meaning(&["readcsv", "csv", "loadtable", "opencsv"], &["load_csv"], ""),
    meaning(&["readjson", "json", "parsejson", "openjson"], &["load_json", "parse_json"], ""),
    meaning(&["readfile", "open", "readtext", "loadfile", "read"], &["load_text"], ""),
    meaning(&["power", "raise"], &["pow"], ""),
    meaning(&["squareroot", "root"], &["sqrt"], ""),
    meaning(&["sindeg", "sindegrees"], &["sind"], "degrees"),
    meaning(&["cosdeg", "cosdegrees"], &["cosd"], "degrees"),
    meaning(&["str", "tostr", "string"], &["to_string"], ""),
    meaning(&["int", "parseint"], &["to_int", "parse_int"], ""),
    meaning(&["float", "tofloating"], &["to_float", "parse_float"], ""),
    meaning(&["delay", "cascade", "sequence"], &["stagger"], ""),
    meaning(&["damp", "smoothdamping", "follow", "smooth"], &["smooth_damp", "smoothstep"], ""),
    meaning(&["step", "smootherstep"], &["smoothstep"], ""),
];

/// A word of ours among those that are `known`, for one that means the same elsewhere; with a note, which may be empty.
pub fn by_meaning<'a>(found: &str, known: &[&'a str]) -> Option<(&'a str, &'static str)> {
    let plain: String = found.chars().filter(|c| !['_', '-', ' '].contains(c)).flat_map(char::to_lowercase).collect();
    let fits = |meaning: &&Synonym| meaning.foreign.contains(&plain.as_str());
    let all = MEANINGS.iter().chain(ELSEWHERE);
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
    MEANINGS.iter().flat_map(of)
}

#[cfg(test)]
mod tests;
