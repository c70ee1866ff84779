//! A scene as a whole, and the changes that lead from one to another.

use super::camera::Camera;
use super::entity::{Component, EntityDesc, Kind};
use super::material::Material;
use super::mip_map::ImageCache;
use super::render::Render;
use super::value::Text;
use crate::base::project::Folder;

/// A whole scene as data: what a scene file says, with every reference checked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Where it is seen from.
    pub camera: Camera,
    /// Other cameras that a script or the command line may choose, in authored order; the names differ, and none is
    /// [`Scene::DEFAULT_CAMERA`].
    pub cameras: Vec<(Text, Camera)>,
    /// Settings of the picture.
    pub render: Render,
    /// Named materials in authored order; the names differ.
    pub materials: Vec<(Text, Material)>,
    /// In authored order; the names differ.
    pub entities: Vec<EntityDesc>,
    /// Folder that file names in the scene are relative to, and what they may name.
    pub base: Folder,
    /// Pictures that its textures name, as far as they were read.
    pub images: ImageCache,
}

impl Scene {
    /// What `camera` itself is called where one of several cameras is chosen.
    pub const DEFAULT_CAMERA: &'static str = "camera";

    /// One of the named cameras.
    pub fn camera_named(&self, name: &str) -> Option<&Camera> {
        self.cameras.iter().find(|(known, _)| &**known == name).map(|(_, camera)| camera)
    }

    /// The number of a material.
    pub fn material_index(&self, name: &str) -> Option<usize> {
        self.materials.iter().position(|(known, _)| &**known == name)
    }

    /// The authored index of an entity.
    pub fn entity_index(&self, name: &str) -> Option<usize> {
        self.entities.iter().position(|desc| desc.name.as_deref() == Some(name))
    }
}

/// One change to a scene. Indices count in authored order; spawned entities and materials continue it.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// Replaces the camera.
    Camera(Camera),
    /// Replaces the cameras that may be chosen; no picture depends on them.
    Cameras(Vec<(Text, Camera)>),
    /// Replaces the settings.
    Render(Render),
    /// Replaces a material's values.
    Material {
        /// Number of the material.
        index: usize,
        /// What it becomes.
        material: Material,
    },
    /// Adds a named material at the end.
    AddMaterial {
        /// A name that no other material has.
        name: Text,
        /// What it is.
        material: Material,
    },
    /// Adds or replaces one component.
    Put {
        /// Authored index.
        entity: usize,
        /// What is put in the place of a component of its kind.
        component: Component,
    },
    /// Removes one component.
    Take {
        /// Authored index.
        entity: usize,
        /// Which one.
        kind: Kind,
    },
    /// Replaces the tags of an entity.
    Tags {
        /// Authored index.
        entity: usize,
        /// All of them.
        tags: Vec<Text>,
    },
    /// Adds an entity at the end.
    Spawn(EntityDesc),
    /// Removes an entity; its index stays taken.
    Despawn {
        /// Authored index.
        entity: usize,
    },
}
