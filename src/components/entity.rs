//! Entities as plain data: sets of components.
//!
//! This is the form in which scenes are loaded, shown to scripts and written again. `systems::spawn` turns it into a
//! hecs World; an entity's index here is its authored order there.

use std::fmt;

use glam::DVec3;
use serde::de::{Error as _, MapAccess, Visitor};
use serde::ser::SerializeStruct;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::*;
use crate::base::codec::{Decoder, Encoder, Malformed};
use crate::base::digest::Digest;

/// What a kind of component does for its entity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// It decides where the entity stands.
    Placement,
    /// It is a surface that rays can meet; see [`Shape`].
    Shape,
    /// It decides what surfaces of the entity look like.
    Surface,
    /// It bends the surfaces of the entity.
    Deformation,
    /// It is a light without a surface.
    Light,
    /// It decides which rays meet the surfaces and lights of the entity.
    Visibility,
    /// It decides what the lights of the entity light, and whose shadows they throw.
    Linking,
    /// It decides what a camera sees that the entity carries.
    View,
    /// It is a file that other entities come from.
    Source,
}

/// A type of component, for access by type.
pub trait ComponentType: Into<Component> {
    /// The kind of its components.
    const KIND: Kind;
    /// The component as this type, if it is one.
    fn of(component: &Component) -> Option<&Self>;
}

/// Declares every kind of component that an entity can carry, once.
macro_rules! components {
    ($( $name:ident : $variant:ident is $role:ident ),* $(,)?) => {
        /// A component by its name in RON and Rhai.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Kind { $( #[doc = concat!("`", stringify!($name), "`")] $variant ),* }

        impl Kind {
            /// All kinds, in the order of the enum.
            pub const ALL: &'static [Kind] = &[$( Kind::$variant ),*];
            /// Their names, in the same order.
            pub const NAMES: &'static [&'static str] = &[$( stringify!($name) ),*];

            /// The name in RON and Rhai.
            pub fn name(self) -> &'static str {
                match self { $( Kind::$variant => stringify!($name) ),* }
            }
            /// What a component of this kind does for its entity.
            pub fn role(self) -> Role {
                match self { $( Kind::$variant => Role::$role ),* }
            }
            /// The kind of a name, if there is one.
            pub fn parse(name: &str) -> Option<Kind> {
                match name { $( stringify!($name) => Some(Kind::$variant), )* _ => None }
            }
            /// Field names of the component.
            pub fn fields(self) -> &'static [&'static str] {
                match self { $( Kind::$variant => $variant::FIELDS ),* }
            }
            /// The component with every field at its default.
            pub fn default_component(self) -> Component {
                match self { $( Kind::$variant => Component::$variant($variant::default()) ),* }
            }
            /// Reads one component of this kind, as another process of this program wrote it.
            pub fn decode_fields(self, from: &mut Decoder) -> Result<Component, Malformed> {
                match self { $( Kind::$variant => from.get().map(Component::$variant) ),* }
            }
            /// Reads one component of this kind.
            pub fn deserialize<'de, D: Deserializer<'de>>(self, d: D) -> Result<Component, D::Error> {
                match self { $( Kind::$variant => $variant::deserialize(d).map(Component::$variant) ),* }
            }
        }

        /// A component of any kind.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Component { $( #[doc = concat!("`", stringify!($name), "`")] $variant($variant) ),* }

        impl Component {
            /// Which kind it is.
            pub fn kind(&self) -> Kind {
                match self { $( Component::$variant(_) => Kind::$variant ),* }
            }
            /// Writes it for another process of this program, its kind left out.
            pub fn encode_fields(&self, to: &mut Encoder) {
                match self { $( Component::$variant(c) => to.put(c) ),* }
            }
            /// Access to its fields by name.
            pub fn record(&self) -> &dyn Record {
                match self { $( Component::$variant(c) => c ),* }
            }
            /// As [`Self::record`], to change them.
            pub fn record_mut(&mut self) -> &mut dyn Record {
                match self { $( Component::$variant(c) => c ),* }
            }
            /// The surface that it is, if it is one.
            pub fn shape(&self) -> Option<&dyn Shape> {
                match self { $( Component::$variant(c) => shape_of!($role c) ),* }
            }
        }

        $( impl From<$variant> for Component {
            fn from(c: $variant) -> Component {
                Component::$variant(c)
            }
        }

        impl ComponentType for $variant {
            const KIND: Kind = Kind::$variant;
            fn of(component: &Component) -> Option<&Self> {
                if let Component::$variant(c) = component { Some(c) } else { None }
            }
        } )*

        impl Serialize for Component {
            fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
                match self { $( Component::$variant(c) => c.serialize(s) ),* }
            }
        }
    };
}

/// A component as a shape, if its role is that of one.
macro_rules! shape_of {
    (Shape $component:ident) => {
        Some($component as &dyn Shape)
    };
    ($role:ident $component:ident) => {{
        let _ = $component;
        None
    }};
}

/// Hands the list of all kinds, `name: Type is Role`, to another macro, behind arguments of its own; the list stands only
/// here.
macro_rules! every_kind {
    ($then:ident $($argument:tt)*) => {
        $then! {
            $($argument;)*
            transform: Transform is Placement,
            motion: Motion is Placement,
            sphere: Sphere is Shape,
            triangle: Triangle is Shape,
            plane: Plane is Shape,
            aabox: AABox is Shape,
            cylinder: Cylinder is Shape,
            cone: Cone is Shape,
            mesh: Mesh is Shape,
            asset: Asset is Source,
            skin: Skin is Deformation,
            morph: Morph is Deformation,
            material: MaterialName is Surface,
            texture: Texture is Surface,
            point_light: PointLight is Light,
            area_light: AreaLight is Light,
            spot_light: SpotLight is Light,
            directional_light: DirectionalLight is Light,
            visible: Visible is Visibility,
            light_link: LightLink is Linking,
            shadow_link: ShadowLink is Linking,
            viewpoint: Viewpoint is View,
        }
    };
}
pub(crate) use every_kind;

every_kind!(components);

impl Component {
    /// The digest of the data behind its fields of class [`FieldClass::Data`], if it has some.
    pub fn data_digest(&self) -> Option<Digest> {
        let of_mesh = Mesh::of(self).map(|mesh| mesh.data.digest());
        let of_asset = || Asset::of(self).map(|asset| asset.data.digest);
        let of_skin = || Skin::of(self).map(|skin| skin.data.digest());
        of_mesh.or_else(of_asset).or_else(of_skin).or_else(|| Morph::of(self).map(|morph| morph.data.digest()))
    }

    /// The colour of the light that it emits, linear, if it is a light.
    pub fn light_color(&self) -> Option<DVec3> {
        let near =
            PointLight::of(self).map(PointLight::emitted).or_else(|| AreaLight::of(self).map(AreaLight::emitted));
        let aimed = || SpotLight::of(self).map(SpotLight::emitted);
        near.or_else(aimed).or_else(|| DirectionalLight::of(self).map(DirectionalLight::emitted))
    }
}

/// One entity: a name, tags, and at most one component of each kind, in the order of [`Kind::ALL`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EntityDesc {
    /// A name that no other entity of the scene has.
    pub name: Option<Text>,
    /// Words that scripts find it by.
    pub tags: Vec<Text>,
    components: Vec<Component>,
}

impl EntityDesc {
    /// An entity without a name.
    pub fn new(components: impl IntoIterator<Item = Component>) -> Self {
        let mut desc = EntityDesc::default();
        components.into_iter().for_each(|c| desc.put(c));
        desc
    }

    /// With a name.
    pub fn named(mut self, name: impl Into<Text>) -> Self {
        self.name = Some(name.into());
        self
    }

    /// Its components, in the order of [`Kind::ALL`].
    pub fn components(&self) -> &[Component] {
        &self.components
    }

    /// The components alone, in the order of [`Kind::ALL`].
    pub fn into_components(self) -> Vec<Component> {
        self.components
    }

    /// The component of a kind, if the entity has it.
    pub fn get(&self, kind: Kind) -> Option<&Component> {
        self.components.iter().find(|c| c.kind() == kind)
    }

    /// The component of a type, if the entity has it.
    pub fn component<T: ComponentType>(&self) -> Option<&T> {
        self.components.iter().find_map(T::of)
    }

    /// Adds a component, in place of one of the same kind.
    pub fn put(&mut self, component: Component) {
        match self.components.binary_search_by_key(&component.kind(), Component::kind) {
            Ok(i) => self.components[i] = component,
            Err(i) => {
                if self.components.is_empty() {
                    self.components.reserve_exact(2);
                }
                self.components.insert(i, component);
            }
        }
    }

    /// Takes a component off.
    pub fn take(&mut self, kind: Kind) -> Option<Component> {
        let i = self.components.iter().position(|c| c.kind() == kind)?;
        Some(self.components.remove(i))
    }

    /// What a message calls this entity.
    pub fn label(&self, index: usize) -> String {
        match &self.name {
            Some(name) => format!("entity `{name}`"),
            None => format!("entity {}", index + 1),
        }
    }

    /// Every key that an entity may have in a scene.
    pub fn keys() -> impl Iterator<Item = &'static str> {
        ["name", "tags"].into_iter().chain(Kind::NAMES.iter().copied())
    }
}

impl Serialize for EntityDesc {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let count = self.components.len() + usize::from(self.name.is_some()) + usize::from(!self.tags.is_empty());
        let mut out = serializer.serialize_struct("Entity", count)?;
        if let Some(name) = &self.name {
            out.serialize_field("name", name)?;
        }
        if !self.tags.is_empty() {
            out.serialize_field("tags", &self.tags)?;
        }
        for component in &self.components {
            out.serialize_field(component.kind().name(), component)?;
        }
        out.end()
    }
}

/// Carries the kind to the place where its value is read.
struct KindSeed(Kind);

impl<'de> serde::de::DeserializeSeed<'de> for KindSeed {
    type Value = Component;
    fn deserialize<D: Deserializer<'de>>(self, d: D) -> Result<Component, D::Error> {
        self.0.deserialize(d)
    }
}

impl<'de> Deserialize<'de> for EntityDesc {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct EntityVisitor;
        impl<'de> Visitor<'de> for EntityVisitor {
            type Value = EntityDesc;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("an entity: (name: ..., sphere: (...), material: ...)")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<EntityDesc, A::Error> {
                let (mut desc, mut has_tags) = (EntityDesc::default(), false);
                while let Some(key) = map.next_key::<Key>()? {
                    match key {
                        Key::Name if desc.name.is_some() => return Err(A::Error::duplicate_field("name")),
                        Key::Tags if has_tags => return Err(A::Error::duplicate_field("tags")),
                        Key::Name => desc.name = Some(map.next_value()?),
                        Key::Tags => (desc.tags, has_tags) = (map.next_value()?, true),
                        Key::Kind(kind) if desc.get(kind).is_some() => {
                            return Err(A::Error::duplicate_field(kind.name()));
                        }
                        Key::Kind(kind) => desc.put(map.next_value_seed(KindSeed(kind))?),
                    }
                }
                Ok(desc)
            }
        }
        deserializer.deserialize_struct("Entity", KEYS, EntityVisitor)
    }
}

/// The keys of an entity, as serde wants them; equal to [`EntityDesc::keys`].
const KEYS: &[&str] = &{
    let mut keys = [""; Kind::NAMES.len() + 2];
    (keys[0], keys[1]) = ("name", "tags");
    let mut i = 0;
    while i < Kind::NAMES.len() {
        keys[i + 2] = Kind::NAMES[i];
        i += 1;
    }
    keys
};

enum Key {
    Name,
    Tags,
    Kind(Kind),
}

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct KeyVisitor;
        impl Visitor<'_> for KeyVisitor {
            type Value = Key;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the name of a component")
            }
            fn visit_str<E: serde::de::Error>(self, key: &str) -> Result<Key, E> {
                match key {
                    "name" => Ok(Key::Name),
                    "tags" => Ok(Key::Tags),
                    other => Kind::parse(other).map(Key::Kind).ok_or_else(|| E::unknown_field(other, KEYS)),
                }
            }
        }
        deserializer.deserialize_identifier(KeyVisitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entity_keeps_one_component_of_a_kind_in_order() {
        let mut desc = EntityDesc::new([Sphere::default().into(), Transform::default().into()]);
        desc.put(Sphere { radius: 2.0, ..Sphere::default() }.into());
        let kinds: Vec<Kind> = desc.components().iter().map(Component::kind).collect();
        assert_eq!(kinds, [Kind::Transform, Kind::Sphere]);
        assert_eq!(desc.get(Kind::Sphere).unwrap().record().get("radius"), Some(Value::Number(2.0)));
        assert!(desc.take(Kind::Sphere).is_some() && desc.get(Kind::Sphere).is_none());
    }

    #[test]
    fn fields_are_set_by_name_and_judged() {
        let mut component = Kind::Sphere.default_component();
        let center = Value::List(vec![Value::Int(1), Value::Int(2), Value::Int(3)]);
        component.record_mut().set("center", &center).unwrap();
        assert_eq!(component, Sphere { center: DVec3::new(1.0, 2.0, 3.0), radius: 1.0 }.into());
        component.record_mut().set("radius", &Value::Number(f64::NAN)).unwrap();
        assert_eq!(component.record().check().unwrap_err().field, "radius");
        let unknown = component.record_mut().set("raduis", &Value::Int(1)).unwrap_err();
        assert_eq!(unknown, FieldError::Unknown { known: &["center", "radius"] });
    }

    #[test]
    fn every_kind_has_a_name_and_default_fields() {
        for kind in Kind::ALL {
            assert_eq!(Kind::parse(kind.name()), Some(*kind));
            let component = kind.default_component();
            assert_eq!(component.kind(), *kind);
            assert_eq!(component.shape().is_some(), kind.role() == Role::Shape);
            assert_eq!(component.light_color().is_some(), kind.role() == Role::Light);
            assert_eq!(component.record().classes().len(), kind.fields().len());
            for field in kind.fields() {
                assert!(component.record().get(field).is_some(), "{}.{field}", kind.name());
            }
        }
    }
}
