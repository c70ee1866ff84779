//! Materials that mesh files bring, and how a scene takes them in.

use std::path::{Path, PathBuf};

use rustc_hash::{FxHashMap, FxHashSet};

use super::obj::mtl::{self, Slot};
use super::obj::{Library, Obj};
use super::source::{Notes, SourceFile};
use super::{Brought, Loaded, text_of};
use crate::base::diagnostics::Diagnostic;
use crate::base::project::{FileRole, Folder};
use crate::base::{files, limits};
use crate::components::*;
use crate::load::image;

/// Reads the libraries that an OBJ file names: the materials that its faces wear.
pub fn libraries(base: &Folder, file: &str, source: SourceFile, obj: &Obj, notes: &mut Notes) -> Vec<Brought> {
    let folder = Path::new(file).parent().unwrap_or(Path::new("")).to_path_buf();
    let worn: FxHashSet<&str> = obj.data.materials.iter().map(|set| &*set.name).collect();
    let mut found: Vec<Brought> = Vec::new();
    if worn.is_empty() {
        return found;
    }
    let mut complete = true;
    for Library { name, start, end } in &obj.libraries {
        for path in library_paths(base, &folder, name) {
            match library(base, &path, notes) {
                Ok(materials) => {
                    for brought in materials.into_iter().filter(|brought| worn.contains(&*brought.name)) {
                        // The last definition of a name counts.
                        found.retain(|known| known.name != brought.name);
                        found.push(brought);
                    }
                }
                Err(problem) => {
                    complete = false;
                    notes.add(&format!("mtllib {name}"), || {
                        let warning = source.error(*start, *end, format!("no materials: {}", problem.message));
                        Diagnostic { help: problem.help, ..warning.into_warning() }
                    });
                }
            }
        }
    }
    let missing: Vec<&str> = obj.data.materials.iter().map(|set| &*set.name).collect();
    let is_missing = |name: &&str| !found.iter().any(|brought| *brought.name == **name);
    let missing: Vec<String> = missing.into_iter().filter(is_missing).map(|name| format!("`{name}`")).collect();
    // Where a library is missing, so are all its materials, and that was said.
    if complete && !missing.is_empty() {
        notes.add("usemtl", || {
            let more = if missing.len() > 5 { format!(" and {} more", missing.len() - 5) } else { String::new() };
            let names = missing[..missing.len().min(5)].join(", ");
            let message = format!("no library has the material {names}{more}");
            let help = "such faces wear a material of the scene by that name, or else that of the entity";
            source.whole(message).help(help).into_warning()
        });
    }
    found
}

/// The files that a `mtllib` statement names: one whose name may have blanks in it, or several.
fn library_paths(base: &Folder, folder: &Path, name: &str) -> Vec<PathBuf> {
    let place = |name: &str| folder.join(name.replace('\\', "/"));
    let whole = place(name);
    let words: Vec<&str> = name.split_whitespace().collect();
    if words.len() < 2 || find(base, &whole).is_some() {
        return vec![find(base, &whole).unwrap_or(whole)];
    }
    // Several names with blanks in them end where the usual ending does.
    let several = names_by_ending(name);
    let names = if several.iter().all(|name| find(base, &place(name)).is_some()) { several } else { words };
    names.into_iter().map(place).map(|path| find(base, &path).unwrap_or(path)).collect()
}

/// A text cut behind each word that ends in `.mtl`.
fn names_by_ending(text: &str) -> Vec<&str> {
    let (mut names, mut start) = (Vec::new(), 0);
    for (i, _) in text.char_indices().filter(|(_, c)| c.is_whitespace()) {
        if text[start..i].to_lowercase().ends_with(".mtl") {
            names.push(text[start..i].trim());
            start = i;
        }
    }
    names.push(text[start..].trim());
    names
}

/// A file by its path relative to `base`: as it is written; or else by its name alone beside where it should be, as
/// projects that were moved want it; in letters of any case.
fn find(base: &Folder, path: &Path) -> Option<PathBuf> {
    let is_file = |path: &Path| base.admit(&path.to_string_lossy()).is_ok_and(|full| full.is_file());
    if is_file(path) {
        return Some(path.to_path_buf());
    }
    files::find_any_case(base, path).filter(|path| is_file(path))
}

fn library(base: &Folder, path: &Path, notes: &mut Notes) -> Result<Vec<Brought>, Diagnostic> {
    let full = base.find(&path.to_string_lossy(), FileRole::Mesh)?;
    let bytes = files::read_bytes(&full, limits::SCENE_FILE_BYTES)?;
    let shown = full.display().to_string();
    let source = SourceFile { file: &shown, bytes: &bytes };
    let source = SourceFile { bytes: text_of(source)?, ..source };
    let folder = path.parent().unwrap_or(Path::new(""));
    let brought = |definition: mtl::Definition| {
        let map = |map: mtl::Map| {
            let image = image_path(base, folder, &map.file).to_string_lossy().replace('\\', "/");
            let texture = Texture { image: Some(image.into()), ..map.texture };
            (map.slot, texture, source.error(map.span[0], map.span[1], "the map is left out").into_warning())
        };
        let maps = definition.maps.into_iter().map(map).collect();
        let mut material = definition.material;
        if let Err(invalid) = material.check() {
            let [start, end] = definition.span;
            let message = format!("material `{}`: {}; it is grey", definition.name, invalid.message);
            notes.add(&message, || source.error(start, end, message.clone()).into_warning());
            material = Material::default();
        }
        Brought { name: definition.name.into(), material, maps }
    };
    let mut own = Notes::default();
    let definitions = mtl::parse(source, &mut own);
    let brought = definitions.into_iter().map(brought).collect();
    notes.take(own);
    Ok(brought)
}

/// Where an image of a library is: relative to it, or by its name alone if the folders before it are another machine's.
fn image_path(base: &Folder, folder: &Path, file: &str) -> PathBuf {
    let file = file.replace('\\', "/");
    let written = folder.join(&file);
    let alone = folder.join(file.rsplit('/').next().unwrap_or(&file));
    find(base, &written).or_else(|| find(base, &alone)).unwrap_or(written)
}

/// White materials with a picture each, for faces that name only that.
pub fn textures(base: &Folder, file: &str, source: SourceFile, data: &MeshData) -> Vec<Brought> {
    let folder = Path::new(file).parent().unwrap_or(Path::new(""));
    let brought = |set: &FaceSet| {
        let image = image_path(base, folder, &set.name).to_string_lossy().replace('\\', "/");
        let texture = Texture { image: Some(image.into()), ..Texture::default() };
        let warning = source.whole("the texture is left out").into_warning();
        let material = Material { color: glam::DVec3::ONE, ..Material::default() };
        Brought { name: set.name.clone(), material, maps: vec![(Slot::Color, texture, warning)] }
    };
    data.materials.iter().map(brought).collect()
}

/// The materials that were taken into a scene from mesh files.
pub struct Adopted {
    /// Materials that the scene itself has, by their name.
    own: FxHashSet<Text>,
    /// Materials that came from files, by their name in the scene.
    taken: FxHashMap<Text, Material>,
    /// What of a file's materials is not used, until it is told.
    warnings: FxHashMap<Text, Vec<Diagnostic>>,
}

impl Adopted {
    pub fn new(scene: &Scene) -> Self {
        let own = scene.materials.iter().map(|(name, _)| name.clone()).collect();
        Adopted { own, taken: FxHashMap::default(), warnings: FxHashMap::default() }
    }

    /// What of a file's materials is not used; told once.
    pub fn warnings_of(&mut self, file: &Text) -> Vec<Diagnostic> {
        self.warnings.remove(file).unwrap_or_default()
    }

    /// Takes in the materials of a file; gives its mesh, whose faces name materials of the scene.
    ///
    /// A material of the scene stands for one of the same name, or of the name behind that of the file and a slash.
    pub fn take(&mut self, scene: &mut Scene, file: &Text, loaded: Loaded) -> MeshData {
        let Loaded { mut data, materials, material_warnings, .. } = loaded;
        let mut warnings = material_warnings;
        let mut names: FxHashMap<Text, Text> = FxHashMap::default();
        for brought in materials {
            let qualified = qualified(file, &brought.name);
            let own = [&qualified, &brought.name].into_iter().find(|name| self.own.contains(*name));
            let name = match own {
                Some(own) => own.clone(),
                None => {
                    let decoded = scene.render.transfer == Transfer::Srgb;
                    let mut images = std::mem::take(&mut scene.images);
                    let material = complete(&mut images, scene, decoded, &brought, &mut warnings);
                    scene.images = images;
                    self.add(scene, file, &brought.name, material)
                }
            };
            names.insert(brought.name, name);
        }
        for set in &mut data.materials {
            let own = || self.own.get(&qualified(file, &set.name)).or_else(|| self.own.get(&set.name)).cloned();
            if let Some(name) = names.get(&set.name).cloned().or_else(own) {
                set.name = name;
            } else {
                set.runs.clear();
            }
        }
        data.materials.retain(|set| !set.runs.is_empty());
        self.warnings.insert(file.clone(), warnings);
        data
    }

    /// Adds a material under its name, or under a longer one if another file has brought another of that name.
    fn add(&mut self, scene: &mut Scene, file: &Text, name: &Text, material: Material) -> Text {
        let longest: Text = format!("{file}/{name}").into();
        let numbered = (2..).map(|i| Text::from(format!("{longest} {i}")));
        for name in [name.clone(), qualified(file, name), longest.clone()].into_iter().chain(numbered) {
            match self.taken.get(&name) {
                Some(known) if *known == material => return name,
                None if !self.own.contains(&name) => {
                    self.taken.insert(name.clone(), material.clone());
                    scene.materials.push((name.clone(), material));
                    return name;
                }
                _ => {}
            }
        }
        longest
    }
}

/// The names in a scene of the materials that a file brings, by their own; what the scene has not is added.
pub fn names_for(
    materials: &[(Text, Material)],
    file: &str,
    scene: &Scene,
    added: &mut Vec<(Text, Material)>,
) -> FxHashMap<Text, Text> {
    let mut names = FxHashMap::default();
    for (name, material) in materials {
        let qualified = qualified(file, name);
        let own = [&qualified, name].into_iter().find(|name| scene.material_index(name).is_some()).cloned();
        let position = |added: &[(Text, Material)], wanted: &Text| added.iter().position(|(known, _)| known == wanted);
        let name_there = match (&own, position(added, name)) {
            (Some(own), _) => own.clone(),
            (None, Some(at)) if added[at].1 != *material => qualified,
            (None, _) => name.clone(),
        };
        if own.is_none() && position(added, &name_there).is_none() {
            added.push((name_there.clone(), material.clone()));
        }
        names.insert(name.clone(), name_there);
    }
    names
}

/// The name of a file's material among those of other files: `vase/red` for `red` of `models/vase.obj`.
fn qualified(file: &str, name: &str) -> Text {
    let stem = Path::new(file).file_stem().unwrap_or_default().to_string_lossy();
    format!("{stem}/{name}").into()
}

/// The material with those of its maps that can be used.
pub fn complete(
    images: &mut ImageCache,
    scene: &Scene,
    curved: bool,
    brought: &Brought,
    warnings: &mut Vec<Diagnostic>,
) -> Material {
    let mut material = brought.material.clone();
    for (slot, texture, warning) in &brought.maps {
        let Some(file) = &texture.file() else { continue };
        let colored = matches!(slot, Slot::Color | Slot::Specular | Slot::Emission);
        let plane = texture.plane(colored && curved);
        let picture = match image::fetch(images, &scene.base, file, plane) {
            Ok(picture) => picture,
            Err(problem) => {
                let message = format!("{}: {}", warning.message, problem.message);
                warnings.push(Diagnostic { message, help: problem.help, ..warning.clone() });
                continue;
            }
        };
        let texture = Some(Box::new(texture.clone()));
        match slot {
            Slot::Color => material.color_map = texture,
            Slot::Specular => material.specular_map = texture,
            Slot::Roughness => material.roughness_map = texture,
            Slot::Opacity => material.opacity_map = texture,
            Slot::Emission => material.emission_map = texture,
            Slot::Normal => material.normal_map = texture,
            Slot::Bump if is_of_normals(&picture) => {
                let depth = texture.as_ref().and_then(|t| t.depth).map(|depth| depth / Texture::DEPTH);
                material.normal_map = texture.map(|t| Box::new(Texture { depth, ..*t }));
            }
            Slot::Bump => material.bump = texture,
        }
    }
    if let Err(invalid) = material.check() {
        let name = &brought.name;
        warnings.push(Diagnostic::warning(format!("the maps of material `{name}` are left out: {}", invalid.message)));
        return brought.material.clone();
    }
    material
}

/// Whether a picture is of normals, as many that are called bump maps are: on the whole they point outwards, blue.
fn is_of_normals(picture: &MipMap) -> bool {
    let mean = picture.levels.last().map(|level| level.texel(0, 0)).unwrap_or_default();
    let is_middle = |x: f32| (0.4..0.6).contains(&x);
    is_middle(mean.x) && is_middle(mean.y) && mean.z > 0.75
}
