//! Every cap of the program, in one table, each with its reason.
//!
//! Input is never trusted for a size: nothing is allocated from a count that a file merely declares. The caps keep a
//! hostile or mistaken input from filling memory or running for ever; each is far above honest use.

/// A text scene (RON, NFF, P3F): 600 k spheres take about 30 MB.
pub const SCENE_FILE_BYTES: u64 = 512 << 20;
/// A mesh file (OBJ, PLY): ten million triangles as text.
pub const MESH_FILE_BYTES: u64 = 2 << 30;
/// Numbers that the accessors of one glTF file are read as, each use counted: four gigabytes. A small file may name the
/// same bytes, or none at all, again and again.
pub const ASSET_NUMBERS: u64 = 1 << 30;
/// Mesh files that a script chose and that are kept for the frames after: two for each of a few sequences.
pub const MESH_FILES_KEPT: usize = 16;
/// An image file: a 16 k x 8 k sky in 16 bits.
pub const IMAGE_FILE_BYTES: u64 = 1 << 30;
/// Width and height of an image that is read: 16 k sky domes.
pub const IMAGE_SIDE: u32 = 32_768;
/// Texels of all pictures that the textures of a scene name: sixteen of 4 k x 4 k, about 2 GB with smaller copies.
pub const TEXTURE_TEXELS: u64 = 1 << 28;
/// The largest value of a texel: the smaller copies add them up, and shading squares them, inside `f32`.
pub const TEXEL_VALUE: f32 = 1e9;
/// Memory of one image while it is decoded: a 16 k x 8 k sky in floats, and a copy.
pub const IMAGE_BYTES: u64 = 4 << 30;
/// Colours of one pattern.
pub const PATTERN_COLORS: usize = 64;
/// Octaves of noise: the sixteenth is 65 k times finer than the first, beyond what `f32` resolves.
pub const OCTAVES: u32 = 16;
/// A script file: a thousand times the longest that a person writes.
pub const SCRIPT_FILE_BYTES: u64 = 4 << 20;

/// Width and height of a frame: 16 k film.
pub const FRAME_SIDE: u32 = 16_384;
/// Pixels of a frame: its film and its encoded rows must fit in memory beside the scene.
pub const FRAME_PIXELS: u64 = 1 << 27;
/// Bytes that a frame may take while it is made at once; a larger one is made in bands, where nothing of it is kept for
/// other frames: 1080p with all layers.
pub const FRAME_AT_ONCE: u64 = 512 << 20;
/// Bytes of one band of such a frame: large enough to keep all threads busy.
pub const BAND_BYTES: u64 = 96 << 20;
/// The file of a frame: the pixels above in 16 bits, should they not shrink.
pub const FRAME_FILE_BYTES: u64 = 4 << 30;
/// All channels of an EXR file, unpacked: sixty passes of a 4 k picture in floats.
pub const EXR_BYTES: u64 = 8 << 30;
/// Emitters with a light group of their own where only their colours change: each adds a film to the frame's memory.
pub const LIGHT_GROUPS: usize = 16;
/// Frames of a reuse window, which are looked ahead for objects that change: each has a bit in a word.
pub const REUSE_WINDOW_FRAMES: usize = 64;
/// Edits and frames of a window that goes on while a scene is edited: each has a number in a byte with every sample.
pub const LIVE_WINDOW_FRAMES: usize = 240;
/// Bounds of all objects that change in a reuse window: each ray is tested against them, which must stay cheap beside
/// tracing it.
pub const REUSE_BOUNDS: usize = 512;
/// Entities that may change in one frame of a reuse window; a frame with more is traced as a whole. The state of each in
/// every frame takes memory.
pub const REUSE_CHANGED_ENTITIES: usize = 8_192;
/// Pairs of a mesh and another body whose bounds are compared for contacts: a few milliseconds. Beyond it, all faces of
/// meshes count as near something, or none if they are more than [`CONTACT_FACES`].
pub const CONTACT_PAIRS: usize = 4_000_000;
/// Flat faces near other bodies among which contacts are looked for: beyond it the search would show in the time of a
/// frame, and scenes of so many are scanned or scattered, not built of blocks that touch.
pub const CONTACT_FACES: usize = 100_000;
/// Pairs of faces in one plane that are tested for an overlap: a floor of a thousand tiles.
pub const CONTACT_TESTS: usize = 500_000;
/// The same where `check` looks for contacts that rendering leaves out: a minute's work, once.
pub const CONTACT_FACES_CHECKED: usize = 10_000_000;
/// The same of pairs.
pub const CONTACT_TESTS_CHECKED: usize = 50_000_000;
/// Transparent bodies in each other that a ray knows itself to be in: their materials share 64 bits of it.
pub const NESTED_BODIES: u32 = 4;
/// Materials of transparent bodies, by their numbers from 0: what the share of one body in these bits can tell apart.
pub const BODY_MATERIALS: usize = (1 << (u64::BITS / NESTED_BODIES)) - 1;
/// Pairs of transparent bodies that `check` compares: some seconds.
pub const NESTING_TESTS: usize = 100_000_000;
/// Memory in MiB of what is kept from frame to frame, unless the user says otherwise.
pub const REUSE_MEMORY: u64 = 1_024;
/// Memory of the pictures that the preview holds: a minute of small frames, or twenty of 4 k.
pub const PREVIEW_PICTURE_BYTES: usize = 512 << 20;
/// Orders of pages that wait for the preview's worker: more than a dozen tabs make.
pub const PREVIEW_ORDERS: usize = 64;
/// A message from a page to the preview: a hundred values at once.
pub const PREVIEW_MESSAGE_BYTES: usize = 64 << 10;
/// Pixels of the layers that say what is seen where: 36 megabytes for each million.
pub const PREVIEW_LAYER_PIXELS: u32 = 1 << 20;
/// Frames of a timeline: beyond them a page would show less than a pixel of each, several times over.
pub const PREVIEW_FRAMES: u32 = 20_000;
/// The manifest of a folder of frames: a million lines.
pub const MANIFEST_BYTES: u64 = 512 << 20;
/// Samples per pixel: 256 x 256 strata; more would not change a 16-bit pixel.
pub const SAMPLES: u32 = 65_536;
/// Points on one light for one shadow estimate.
pub const SHADOW_SAMPLES: u32 = 4_096;
/// Moments of a frame with an open shutter: each is evaluated, placed and built; motion that needs more is a smear.
pub const SHUTTER_SLICES: u32 = 1_024;
/// Photons of one pass: a second of emission and half a minute of tracing.
pub const PHOTONS: u32 = 4_000_000;
/// Photons that one pass may store, 52 bytes each; where many are emitted, a smaller share of them is stored.
pub const PHOTONS_AT_REST: u32 = 20_000_000;
/// Ray generations: each may branch in two, so the tree is bounded by 2^depth.
pub const RAY_DEPTH: u32 = 64;
/// Surfaces that are not there, or not wholly, that one ray goes through: leaves of a wood; the next one stops it.
pub const HOLES: u32 = 1_024;
/// Sets of four joints that may move one vertex: sixteen sets are far beyond what programs write.
pub const JOINT_SETS: usize = 16;
/// Files that one AFF scene includes, each use counted.
pub const INCLUDES: usize = 10_000;
/// Stops of exposure either way: beyond them everything is black or white.
pub const EXPOSURE: f64 = 64.0;
/// Width of a reconstruction filter in pixels: wider ones blur, and belong behind the renderer.
pub const FILTER_WIDTH: f64 = 16.0;
/// Frames of one sequence: eleven hours at 24 frames a second.
pub const FRAMES: u32 = 1_000_000;
/// What a golden picture may take to say what it was made from, compressed: it must stay a small file.
pub const DESCRIPTION_BYTES: usize = 8 << 10;
/// Pictures of one page of a report: what a browser still opens at once.
pub const REPORT_BYTES: usize = 64 << 20;
/// Exposures at which FLIP compares two pictures of linear light: twice the stops that a half can hold.
pub const FLIP_EXPOSURES: u32 = 64;
/// Files of an archive: fifty thousand frames of a simulation as meshes, and their textures.
pub const ARCHIVE_FILES: usize = 65_536;
/// All files of an archive, unpacked: what a node's temporary folder still holds.
pub const ARCHIVE_BYTES: u64 = 64 << 30;
/// What an archive says of itself: a quarter of a kilobyte for each of its files.
pub const ARCHIVE_MANIFEST_BYTES: u64 = 32 << 20;
/// Seconds between two signs of life of a worker that holds claims: a few bytes, on a file system that many share.
pub const CLAIM_BEAT_SECONDS: u64 = 10;
/// Seconds without a sign of life until a worker of another machine counts as gone: six signs lost in a row, or the
/// longest that a shared file system keeps what it knows of a file.
pub const CLAIM_PATIENCE_SECONDS: u64 = 60;
/// How often a frame may be taken over from workers that are gone: whatever ends so many of them would end the next too.
pub const CLAIM_TAKEOVERS: u32 = 100;
/// Worker threads.
pub const THREADS: usize = 1_024;

/// Different links of lights to bodies in a frame: each body has a bit for each.
pub const LIGHT_LINKS: usize = 64;

/// Different sets of bodies that throw shadows in a frame: each has an accelerator of its own.
pub const SHADOW_SETS: usize = 16;

/// Entities of a scene, spawned ones included.
pub const ENTITIES: usize = 16_000_000;
/// Materials of a scene.
pub const MATERIALS: usize = 1_000_000;
/// Named cameras of a scene: all of them are copied when a script writes to one.
pub const CAMERAS: usize = 4_096;
/// Triangles of a scene: primitive numbers are 32 bits and cell lists must fit too.
pub const TRIANGLES: usize = 100_000_000;
/// Emissive primitives that are sampled as lights, triangles of instances included: past this they still emit, but
/// their light is found only by rays that happen to meet them.
pub const EMITTERS: usize = 4_000_000;
/// Lights that a tree is built over for each frame, which takes about a microsecond a light: of more, one is chosen by
/// power alone.
pub const TREE_LIGHTS: usize = 250_000;
/// Vertices of one NFF polygon: the largest of the standard databases has 144.
pub const POLYGON_VERTICES: usize = 100_000;
/// Folders above that of a P3F scene in which the folder of its sky is looked for: courses put both into one project.
pub const SKY_FOLDERS_ABOVE: usize = 3;
/// Parents above one entity: a chain longer than this is a mistake, and the walk stays bounded.
pub const HIERARCHY_DEPTH: usize = 1_024;
/// Nesting of brackets in a RON file: the parser recurses.
pub const NESTING: usize = 128;
/// Length of a name or another text in a scene.
pub const TEXT_BYTES: usize = 4_096;

/// Cells of the uniform grid: 512 MB of cell starts.
pub const GRID_CELLS: u64 = 1 << 27;
/// Cells along one axis of the uniform grid: the walk's cost grows with it.
pub const GRID_SIDE: u32 = 1_024;
/// Cells of the uniform grid that a primitive is listed in, on average: small ones touch two or three, and where large
/// ones stand among them the grid is made coarser rather than its lists longer.
pub const GRID_LISTED: u64 = 8;
/// The same for a grid inside of a cell: together at most 32 copies of a primitive, about a kilobyte.
pub const GRID_LISTED_INSIDE: u64 = 4;

/// Operations of one script function call (`setup` or one `frame`) unless its header or the command line raises them:
/// about half a second of interpretation.
pub const SCRIPT_OPERATIONS: u64 = 10_000_000;
/// The most that they are raised to: an hour of interpretation, which nobody waits for at every frame.
pub const SCRIPT_OPERATIONS_RAISED: u64 = 50_000_000_000;
/// Seconds of processor time of one script function call, however few its operations: a backstop for operations that
/// are slow, above what `SCRIPT_OPERATIONS` plain ones take on a slow machine, so that it decides nothing but failures.
pub const SCRIPT_SECONDS: u64 = 4;
/// The most that they are raised to: six hours.
pub const SCRIPT_SECONDS_RAISED: u64 = 21_600;
/// Seconds more where it runs on within one operation, which nothing but the end of its process stops.
pub const SCRIPT_SECONDS_OF_GRACE: u64 = 2;
/// Bytes that a script may hold in one call, of strings, lists and what it has spawned together, where it has a process
/// of its own: the most entities that it may spawn, twice over.
pub const SCRIPT_BYTES: usize = 512 << 20;
/// The most that they are raised to, in MiB: half of a large workstation.
pub const SCRIPT_MEBIBYTES_RAISED: u64 = 65_536;
/// Bytes beyond these that the process may hold: its answer is made of what the script holds.
pub const SCRIPT_BYTES_OF_ANSWER: usize = 512 << 20;
/// Address space of a script's process beyond its scene, where the system can limit it: the bytes above, the stack, and
/// what an allocator keeps in reserve.
pub const SCRIPT_ADDRESSES: u64 = 2 << 30;
/// Stack of a script's process: values that are nested ten thousands deep, at a kilobyte a level. Deeper ones end it.
pub const SCRIPT_STACK: usize = 64 << 20;
/// Bytes of one message between a script's process and the program: what it may hold, and more.
pub const SCRIPT_MESSAGE: u64 = 1 << 30;
/// Modules that import each other in a row: nobody reads deeper ones.
pub const SCRIPT_MODULE_DEPTH: usize = 16;
/// Tables whose columns are held against properties of rows that turn out to be nothing: nobody reads more of them.
pub const SCRIPT_TABLES: usize = 64;
/// Modules of one script.
pub const SCRIPT_MODULES: usize = 256;
/// Entities that one script function call may spawn: a second's work.
pub const SCRIPT_SPAWNS: usize = 300_000;
/// Nested calls in a script: well inside a 2 MB thread stack in a debug build too.
pub const SCRIPT_CALL_DEPTH: usize = 32;
/// Nesting of one script expression; the parser recurses.
pub const SCRIPT_EXPRESSION_DEPTH: usize = 64;
/// Arguments of one call in a script: nobody counts more, and the search for a function of so many is slow.
pub const SCRIPT_ARGUMENTS: usize = 64;
/// Bytes of one string in a script that has no process of its own. Where it has one, the memory that it holds is what is
/// limited, and not the size of single values: Rhai counts all elements of a value at every step, so that a list of n
/// elements would cost n^2 to grow.
pub const SCRIPT_STRING_BYTES: usize = 1 << 20;
/// Elements of one array in such a script, those of arrays inside it included.
pub const SCRIPT_ARRAY: usize = 32_768;
/// Entries of one object map in such a script, counted like those of arrays.
pub const SCRIPT_MAP: usize = 32_768;
/// A file of data that a script reads: a million rows of sixty letters.
pub const DATA_FILE_BYTES: u64 = 64 << 20;
/// States of one simulation together: a thousand balls over ten thousand steps.
pub const SIMULATION_BYTES: usize = 256 << 20;
/// States of simulations that are kept beside the frames of a folder: they only spare time, and must not crowd it.
pub const CHECKPOINT_BYTES: u64 = 64 << 20;
/// Steps of a simulation from one frame to the next.
pub const STEPS_PER_FRAME: u32 = 1_000;
/// Distinct lines that are kept of what a script prints: more are noise, and each takes memory.
pub const SCRIPT_PRINTS: usize = 10_000;
/// Points of one path: its table of lengths has sixteen places for each.
pub const PATH_POINTS: usize = 65_536;
/// Script variables in scope, functions and modules.
pub const SCRIPT_ITEMS: usize = 4_096;

/// Letters of one message about a script: a screen of text.
pub const MESSAGE_LETTERS: usize = 2_000;
/// Diagnostics shown for one file: past this the first ones have said enough.
pub const DIAGNOSTICS: usize = 20;
