//! The pages: their names, their order and what stands on them.

use super::fields::{blocks as fields_of, entity_records, other_records};
use super::{Block, CodeKind, GuideEntry, coming_from, language, many_machines, markdown, mistakes};
use crate::script::{CHAPTERS, Function};

/// A page of the guide.
pub struct Page {
    /// What it is asked for by: `anim guide camera`.
    pub name: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// What is on it, in a line.
    pub summary: &'static str,
    /// All that is on it.
    pub blocks: fn() -> Vec<Block>,
}

/// All pages, in the order in which one reads them.
pub const PAGES: &[Page] = &[
    Page { name: "start", title: "A first sequence", summary: "a scene, a script, the frames", blocks: start },
    Page { name: "scene", title: "Scenes", summary: "entities: bodies, places, motion", blocks: scene },
    Page { name: "materials", title: "Materials and textures", summary: "what surfaces look like", blocks: materials },
    Page { name: "lights", title: "Lights", summary: "lamps, surfaces that shine, surroundings", blocks: lights },
    Page { name: "camera", title: "The camera", summary: "view, lens, focus and shutter", blocks: camera },
    Page { name: "render", title: "The picture", summary: "size, samples, integrators, film", blocks: render },
    Page { name: "script", title: "Scripts", summary: "every function, with an example", blocks: script },
    Page {
        name: "language",
        title: "The language of scripts",
        summary: "what surprises in it",
        blocks: language::blocks,
    },
    Page { name: "formats", title: "Files", summary: "what is read and what is written", blocks: formats },
    Page { name: "films", title: "Films and sheets", summary: "frames become a film, or one picture", blocks: films },
    Page { name: "golden", title: "Golden frames", summary: "tests of pictures: anim test", blocks: golden },
    Page {
        name: "farm",
        title: "Many machines",
        summary: "shards, workers, archives, what a folder lacks",
        blocks: many_machines::farm,
    },
    Page { name: "slurm", title: "Slurm", summary: "an array of tasks, and its check", blocks: many_machines::slurm },
    Page {
        name: "openjd",
        title: "Open Job Description",
        summary: "a template for AWS Deadline Cloud and others",
        blocks: many_machines::openjd,
    },
    Page { name: "make", title: "make and ninja", summary: "a rule for each task", blocks: many_machines::make },
    Page { name: "actions", title: "GitHub Actions", summary: "shards as a matrix", blocks: many_machines::actions },
    Page {
        name: "queues",
        title: "Other queues",
        summary: "tasks as data; Deadline, OpenCue, Tractor",
        blocks: many_machines::queues,
    },
    Page {
        name: "errors",
        title: "Mistakes",
        summary: "what is said of them, and exit codes",
        blocks: mistakes::blocks,
    },
    Page {
        name: "coming-from",
        title: "Coming from other tools",
        summary: "words and idioms of POV-Ray, Blender and P3F",
        blocks: coming_from::blocks,
    },
];

/// The page of a name.
pub fn find(name: &str) -> Option<&'static Page> {
    PAGES.iter().find(|page| page.name == name)
}

fn text(text: &str) -> Block {
    Block::Paragraph(text.into())
}

fn code(kind: CodeKind, text: &str) -> Block {
    Block::Code(kind, text.into())
}

fn start() -> Vec<Block> {
    vec![
        text(
            "A scene is a RON file: a camera, settings of the picture, materials, and entities, each a bag of components.",
        ),
        code(CodeKind::Scene, STAGE),
        text(
            "An animation is a script: `setup` builds once, `frame` is called for every frame and starts each time from what \
              `setup` left.",
        ),
        code(CodeKind::Script, SHOW),
        text("The frames go to frames/show/. What is there already is kept; after an edit, what differs is made anew."),
        code(
            CodeKind::Command,
            "anim show.rhai\nanim show.rhai --frames 1-10 --size 320x180\nanim check show.rhai\nanim plan show.rhai",
        ),
    ]
}

/// The scene of the first page.
const STAGE: &str = "(
    camera: (from: (0.0, 1.4, 6.0), at: (0.0, 0.8, 0.0), fov: 40.0),
    render: (size: (640, 360), samples: 16, background: (0.1, 0.1, 0.12)),
    materials: { \"brass\": (color: (0.9, 0.7, 0.4), specular: 0.6, shininess: 80.0) },
    entities: [
        (name: \"ball\", sphere: (radius: 0.8), transform: (translation: (0.0, 0.8, 0.0)), material: \"brass\"),
        (name: \"floor\", plane: ()),
        (name: \"key\", area_light: (size: (1.0, 1.0)), transform: (translation: (3.0, 4.0, 2.0))),
    ],
)";

/// The script of the first page.
const SHOW: &str = "animation(#{ fps: 24, frames: 48, mode: \"loop\" });     // and scene: \"stage.ron\"

fn setup(s) {
    for i in 0..12 { s.spawn(#{ sphere: #{ radius: 0.1 }, translation: polar(1.6, i * 30, 0.1) }); }
}

fn frame(s, f) {
    s.camera.from = orbit([0, 1.4, 0], 6, f.t);
    s.camera.fov = lerp(35, 45, ease(\"in_out_sine\", ping_pong(2 * f.t)));
}";

fn scene() -> Vec<Block> {
    let mut blocks = vec![
        text(
            "A scene has `camera`, `cameras`, `render`, `materials` and `entities`; all of them may be left out, and every field has a \
              default. An entity has `name`, `tags` and at most one component of each kind. Lengths are world units, angles \
              degrees, y is up, and rotation is counter-clockwise seen from above: yaw takes +x towards -z.",
        ),
        code(CodeKind::Scene, STAGE),
    ];
    let is_elsewhere = |name: &str| stands_with_lights(name) || name == "material" || name == "texture";
    blocks.extend(entity_records().iter().filter(|record| !is_elsewhere(record.name)).flat_map(fields_of));
    blocks
}

fn stands_with_lights(name: &str) -> bool {
    name.ends_with("_light") || name.ends_with("_link")
}

fn records(names: &[&str]) -> Vec<Block> {
    let all = other_records().into_iter().chain(entity_records());
    all.filter(|record| names.contains(&record.name)).flat_map(|record| fields_of(&record)).collect()
}

fn materials() -> Vec<Block> {
    let mut blocks = vec![
        text(
            "Materials have names; an entity wears one by `material: \"name\"`. Any of their values may come from a map.",
        ),
        code(
            CodeKind::Scene,
            "(materials: { \"gold\": (model: Conductor, color: (1.0, 0.78, 0.34), roughness: 0.2) })",
        ),
    ];
    blocks.extend(
        other_records().iter().filter(|record| ["material", "texture"].contains(&record.name)).flat_map(fields_of),
    );
    blocks
}

fn lights() -> Vec<Block> {
    let mut blocks = vec![text(
        "Light comes from entities with `point_light`, `spot_light`, `directional_light` or `area_light`, from surfaces whose \
         material has `emission`, and from what surrounds the scene: `background`, `sky` or `environment` of the settings.",
    )];
    blocks.extend([
        text(
            "A light lights all bodies, and all bodies throw shadows in its light, unless links say otherwise, by the `tags` of \
              bodies. What the camera, mirrors and shadows see of a body or light is told by its `visible`.",
        ),
        code(CodeKind::Scene, LINKS),
        code(
            CodeKind::Script,
            "animation(#{ frames: 24 });

fn setup(s) {
    s.spawn(#{ name: \"ball\", tags: [\"hero\"], sphere: #{} });
    s.spawn(#{ name: \"rim\", point_light: #{ position: [-3, 4, -2] }, light_link: #{ includes: [\"hero\"] } });
}

fn frame(s, f) {
    let ball = s.get(\"ball\");
    ball.visible = f.number > 3;              // nobody sees it in the first frames
    if f.number > 12 { ball.visible.shadow = false; }
}",
        ),
    ]);
    let lights = entity_records().into_iter().filter(|record| stands_with_lights(record.name));
    blocks.extend(lights.flat_map(|record| fields_of(&record)));
    blocks
}

/// Lights that light some bodies alone.
const LINKS: &str = "(
    entities: [
        (name: \"hero\", tags: [\"hero\"], sphere: ()),
        (name: \"floor\", tags: [\"set\"], plane: (point: (0.0, -1.0, 0.0))),
        (name: \"flag\", tags: [\"flag\"], aabox: (min: (1.0, 2.0, 0.0), max: (2.0, 2.1, 1.0)), visible: (camera: false)),
        (name: \"key\", point_light: (position: (3.0, 5.0, 4.0)), shadow_link: (excludes: [\"flag\"])),
        (name: \"rim\", point_light: (position: (-3.0, 4.0, -2.0)), light_link: (includes: [\"hero\"])),
    ],
)";

fn camera() -> Vec<Block> {
    let mut blocks = vec![
        text(
            "A scene is seen from its `camera`. Others stand beside it in `cameras`, by name: a script cuts to one, or blends \
              two, and `--camera NAME` renders everything from one of them.",
        ),
        code(
            CodeKind::Scene,
            "(
    camera: (from: (0.0, 2.0, 8.0), at: (0.0, 1.0, 0.0)),
    cameras: {
        \"close\": (from: (1.0, 1.2, 2.0), at: (0.0, 1.0, 0.0), fov: 25.0, aperture: 0.05, blades: 6),
        \"plan\": (from: (0.0, 9.0, 0.0), at: (0.0, 0.0, 0.0), up: (0.0, 0.0, -1.0), projection: Orthographic, height: 6.0),
        \"all\": (from: (0.0, 1.0, 0.0), at: (0.0, 1.0, -1.0), projection: Equirectangular),
    },
)",
        ),
        code(
            CodeKind::Script,
            "animation(#{ frames: 48 });

fn setup(s) {
    s.add_camera(\"close\", #{ from: [1, 1.2, 2], fov: 25 });
}

fn frame(s, f) {
    if f.t < 0.5 {
        s.camera = blend(\"camera\", \"close\", ease(\"in_out_sine\", f.span(0, 0.4)));
    } else {
        s.camera = \"close\";                  // a cut
        s.camera.fov = lerp(25, 20, f.t);     // of the one that was chosen
    }
}",
        ),
    ];
    blocks.extend(records(&["camera"]));
    blocks
}

fn render() -> Vec<Block> {
    let mut blocks = records(&["render"]);
    blocks.push(text(
        "Fog fills the air between bodies, or a box. With `Path` it scatters the light of lamps, of what shines and of the \
          surroundings, and casts shafts of shadow; `Whitted` and `Distribution` let things fade into its color.",
    ));
    blocks.push(code(
        CodeKind::Scene,
        "(
    render: (integrator: Path, fog: (density: 0.15, color: (0.9, 0.9, 0.95), anisotropy: 0.3, bounds: ((-6, 0, -6), (6, 4, 6)))),
    entities: [(name: \"lamp\", spot_light: (position: (0, 3.9, 0), direction: (0, -1, 0), falloff: InverseSquare))],
)",
    ));
    blocks.push(code(
        CodeKind::Script,
        "animation(#{ frames: 24 });

fn frame(s, f) {
    s.render.fog = #{ density: lerp(0.02, 0.3, f.t), color: [0.9, 0.9, 0.95] };
}",
    ));
    blocks.extend(records(&["fog", "daylight"]));
    blocks
}

/// A function as an entry.
fn function(function: &Function) -> Block {
    Block::GuideEntry(GuideEntry {
        forms: function.forms.iter().map(|form| form.to_string()).collect(),
        text: function.text.to_string(),
        arguments: function.arguments.iter().map(|(name, text)| (name.to_string(), text.to_string())).collect(),
        example: Some((CodeKind::Script, function.example.to_string())),
        ..GuideEntry::default()
    })
}

fn script() -> Vec<Block> {
    let mut blocks = vec![
        code(CodeKind::Script, SHOW),
        text(
            "What stands behind // in the examples is what a line gives. A list of three numbers does wherever a vector is \
              meant, and a whole number wherever a number is.",
        ),
    ];
    for chapter in CHAPTERS {
        blocks.push(Block::Heading(chapter.title.into()));
        blocks.extend(chapter.functions.iter().map(function));
    }
    blocks
}

fn formats() -> Vec<Block> {
    vec![
        text(
            "Read: scenes in RON, NFF, P3F and AFF; meshes in OBJ (with its materials), PLY and STL; assets in glTF 2.0 (.gltf, \
              .glb); pictures in PNG, JPEG, WebP, TGA, BMP, PNM, HDR and EXR for textures and skies; data in CSV and JSON by \
              scripts. Files that an input names are read below its project's root: the nearest folder \
              above it with .git, golden.ron or scenes/, or else its own. --root and --allow-read say otherwise.",
        ),
        text(
            "An asset is a file whose nodes become entities: (name: \"robot\", asset: (file: \"robot.glb\")) gives robot/Arm and \
              robot/Arm/Hand as the file has them, with their meshes, lights, cameras, skins and shapes; groups and objects of \
              an OBJ and transforms of an AFF likewise. An entity of that name in the scene changes what it says and no more, \
              a material called robot/Steel (the file's name, then the material's) stands for the file's. A script plays the \
              clips: s.get(\"robot\").play(\"Walk\", f.seconds). Of glTF are read: metallic-roughness materials with all five \
              textures, texture transforms and vertex colours, alpha masks and blending, KHR lights_punctual, emissive_strength, \
              ior, transmission, volume, specular, unlit and node_visibility, EXT_mesh_gpu_instancing, sparse, quantised and \
              meshopt-compressed data. Draco, KTX2, AVIF and DDS are refused by name; what else a file has and no picture \
              shows is a warning. anim model.glb shows a file by itself, anim convert model.glb -o scene.ron writes a scene \
              around it to edit.",
        ),
        text(
            "An AFF file (the animated scenes of BART) is a sequence: its own number of frames, or -D frames=N. `anim plan` \
              prints its measures of animated ray tracing.",
        ),
        text(
            "Files of a sequence are chosen by number: mesh: (file: \"cache.####.obj\", frame: 12.5) stands between two files, \
              color_map: (image: \"footage.####.png\", frame: 12) shows the nearest. A script writes \
              s.get(\"sea\").mesh.frame = 1 + f.seconds * 24.",
        ),
        text(
            "What is far from the origin is traced as exactly as what is near: frames count from an origin near the camera, and \
              meshes of files from one near their first vertex. Up to 1e9 units away is room; beyond that is an error.",
        ),
        text(
            "Written: PNG with 8 or 16 bits, and OpenEXR with layers, by the ending of -o. Every picture says which script, \
              frame and settings it is of.",
        ),
        code(
            CodeKind::Command,
            "anim scene.ron -o still.exr --aovs depth,normal\nanim show.rhai -o 'out/f.######.png'\nanim convert scene.p3f -o scene.ron\nanim info still.png",
        ),
    ]
}

fn films() -> Vec<Block> {
    markdown::blocks(include_str!("pages/films.md"))
}

fn golden() -> Vec<Block> {
    markdown::blocks(include_str!("pages/golden.md"))
}
