//! Which extensions of glTF are read, which are told of, and which leave nothing to show.

use super::document::{Document, MESHOPT, item};
use super::material;
use super::warnings::Warnings;
use crate::load::resolve::{Problem, key};

/// Extensions that are read, beside those of materials and of compressed views.
const READ: [&str; 6] = [
    "KHR_lights_punctual",
    "KHR_texture_transform",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
];

/// Extensions that hold what does not show.
const UNSEEN: [&str; 5] =
    ["KHR_xmp", "KHR_xmp_json_ld", "KHR_node_selectability", "KHR_node_hoverability", "KHR_interactivity"];

/// Extensions without which there is nothing to show, and what to do about it.
const REFUSED: [(&str, &str); 4] = [
    (
        "KHR_draco_mesh_compression",
        "export it again without compression (in Blender: leave `Compression` off), or with meshopt, which is read",
    ),
    ("KHR_texture_basisu", "export it again with PNG or JPEG textures"),
    ("EXT_texture_avif", "export it again with PNG or JPEG textures"),
    ("MSFT_texture_dds", "export it again with PNG or JPEG textures"),
];

impl Document {
    /// Sees to it that everything the file cannot be shown without is read; tells of the rest.
    ///
    /// # Errors
    /// An extension that the file requires and that decides what there is to show.
    pub fn check_extensions(&self, warnings: &mut Warnings) -> Result<(), Problem> {
        let known = |name: &str| {
            READ.contains(&name) || UNSEEN.contains(&name) || MESHOPT.contains(&name) || material::READ.contains(&name)
        };
        for (i, name) in self.root.extensions_required.iter().enumerate() {
            let path = item(vec![key("extensionsRequired")], i);
            if let Some((_, help)) = REFUSED.iter().find(|(refused, _)| refused == name) {
                let message = format!("the file needs `{name}`, which is not read");
                return Err(Problem::new(path, message).help(Some((*help).into())));
            }
            // What only changes how a surface looks is told of where a material uses it.
            if !known(name) && !name.starts_with("KHR_materials_") {
                let message = format!("the file needs the extension `{name}`, which is not known");
                let help = "export it again without it".to_string();
                return Err(Problem::new(path, message).help(Some(help)));
            }
        }
        for (i, name) in self.root.extensions_used.iter().enumerate() {
            let told_elsewhere = name.starts_with("KHR_materials_") || name == "KHR_animation_pointer";
            let stands_in = REFUSED.iter().any(|(refused, _)| refused == name);
            if !known(name) && !told_elsewhere && !stands_in {
                let path = item(vec![key("extensionsUsed")], i);
                warnings.add(name, || Problem::new(path, format!("the extension `{name}` is not used")));
            }
        }
        Ok(())
    }
}
