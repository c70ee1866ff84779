//! What an entity can carry, as plain structs.
//!
//! Each component is declared once (`record!`), which gives it defaults, its RON form and access by field name; the
//! list of kinds stands in [`entity`]. Numbers are `f64` here, where people write them; the kernel works in `f32`.
//! Space, unit and range of every field stand beside it.

pub mod animation;
pub mod asset;
pub mod camera;
mod codec;
pub mod content;
pub mod daylight;
pub mod entity;
pub mod film;
pub mod fog;
pub mod homes;
pub mod light;
pub mod material;
pub mod mesh;
pub mod mip_map;
pub mod modeling;
pub mod record;
pub mod render;
pub mod scene;
pub mod shapes;
pub mod skin;
pub mod texture;
pub mod transform;
pub mod value;
pub mod visibility;

pub use animation::{Clip, KeyInterpolation, Track, TrackProperty};
pub use asset::{Asset, AssetData, AssetNode};
pub use camera::{Camera, Focus, Lens, Projection, Viewpoint};
pub use daylight::Daylight;
pub use entity::{Component, ComponentType, EntityDesc, Kind, Role};
pub use film::{Aov, Filter, ToneMap};
pub use fog::Fog;
pub use light::{AreaLight, DirectionalLight, Falloff, PointLight, SpotLight};
pub use material::{Material, MaterialName, Model};
pub use mesh::{FaceSet, Mesh, MeshData, Piece, Pieces};
pub use mip_map::{ImageCache, ImagePlane, MipLevel, MipMap, Texels};
pub use record::{Check, FieldClass, FieldError, Invalid, Record};
pub use render::{Accel, Fresnel, Integrator, LightSampler, Render, Shadows, Transfer};
pub use scene::{Edit, Scene};
pub use shapes::{AABox, Cone, Cylinder, Plane, Reach, Shape, Sphere, Triangle};
pub use skin::{Influences, Morph, MorphData, MorphTarget, Skin, SkinData};
pub use texture::{Axes, Channel, Encoding, Pattern, Space, TexelFilter, Texture, Wrap};
pub use transform::{Motion, Scale, Transform};
pub use value::{FieldValue, Mismatch, Text, Value};
pub use visibility::{LightLink, ShadowLink, Visible};
