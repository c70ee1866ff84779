//! What an entity can carry, as plain structs.
//!
//! Each component is declared once (`record!`), which gives it defaults, its RON form and access by field name; the
//! list of kinds stands in [`entity`]. Numbers are `f64` here, where people write them; the kernel works in `f32`.
//! Space, unit and range of every field stand beside it.

pub mod camera;
mod codec;
pub mod content;
pub mod daylight;
pub mod entity;
pub mod film;
pub mod light;
pub mod material;
pub mod mesh;
pub mod mip_map;
pub mod record;
pub mod render;
pub mod shapes;
pub mod texture;
pub mod transform;
pub mod value;

pub use camera::{Camera, Focus, Lens};
pub use daylight::Daylight;
pub use entity::{Component, ComponentType, Edit, EntityDesc, Kind, Role, Scene};
pub use film::{Aov, Filter, ToneMap};
pub use light::{AreaLight, Falloff, PointLight};
pub use material::{Material, MaterialName, Model};
pub use mesh::{FaceSet, Mesh, MeshData, Piece};
pub use mip_map::{ImageCache, MipLevel, MipMap, Texels};
pub use record::{Check, FieldClass, FieldError, Invalid, Record};
pub use render::{Accel, Fresnel, Integrator, Render, Shadows, Transfer};
pub use shapes::{AABox, Cone, Cylinder, Plane, Reach, Shape, Sphere, Triangle};
pub use texture::{Axes, Encoding, Pattern, Space, TexelFilter, Texture, Wrap};
pub use transform::{Motion, Scale, Transform};
pub use value::{FieldValue, Mismatch, Text, Value};
