//! Where an entity stands.

use glam::{DAffine3, DMat3, DVec3};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::record::ranges::position;
use super::record::{Check, Invalid, record};
use super::value::{FieldValue, Mismatch, Text, Value};
use crate::base::{limits, math};

record! {
    /// Translation, rotation and scale of an entity, relative to its parent or the world.
    ///
    /// A point is scaled, then rotated, then translated.
    pub struct Transform {
        /// World units, in the parent's space.
        pub translation: DVec3 = DVec3::ZERO,
        /// Degrees: pitch about x, yaw about y, roll about z; roll is applied first, yaw last.
        pub rotation: DVec3 = DVec3::ZERO,
        /// Factor per axis; one number scales all axes alike. What is scaled by 0 on two axes or more does not show; by 0
        /// on one it is flat, which only meshes and triangles can be.
        pub scale: Scale = Scale::default(),
        /// Any affine map, in place of translation, rotation and scale: where the x, y and z axes go, and the origin.
        pub matrix: Option<[DVec3; 4]> = None,
        /// Name of the entity whose space this transform stands in.
        pub parent: Option<Text> = None,
    }
}

impl Transform {
    /// The affine map from local to parent space.
    pub fn matrix(&self) -> DAffine3 {
        match self.matrix {
            Some([x, y, z, origin]) => DAffine3 { matrix3: DMat3::from_cols(x, y, z), translation: origin },
            None => math::placement(self.translation, self.rotation, self.scale.0),
        }
    }
}

impl Check for Transform {
    fn check(&self) -> Result<(), Invalid> {
        position("translation", self.translation)?;
        position("rotation", self.rotation)?;
        position("scale", self.scale.0)?;
        self.matrix.iter().flatten().try_for_each(|column| position("matrix", *column))
    }
}

/// A factor per axis; written as one number when the three are equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale(pub DVec3);

impl Default for Scale {
    fn default() -> Self {
        Scale(DVec3::ONE)
    }
}

impl FieldValue for Scale {
    fn to_value(&self) -> Value {
        Value::Vec3(self.0)
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        if let Some(x) = value.as_number() {
            return Ok(Scale(DVec3::splat(x)));
        }
        DVec3::from_value(value).map(Scale).map_err(|_| Mismatch::new("a number or three numbers", value))
    }
}

impl Serialize for Scale {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.0 == DVec3::splat(self.0.x) { self.0.x.serialize(serializer) } else { self.0.serialize(serializer) }
    }
}

impl<'de> Deserialize<'de> for Scale {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ScaleVisitor;
        impl<'de> serde::de::Visitor<'de> for ScaleVisitor {
            type Value = Scale;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a number or three numbers")
            }
            fn visit_f64<E>(self, x: f64) -> Result<Scale, E> {
                Ok(Scale(DVec3::splat(x)))
            }
            fn visit_i64<E>(self, x: i64) -> Result<Scale, E> {
                Ok(Scale(DVec3::splat(x as f64)))
            }
            fn visit_u64<E>(self, x: u64) -> Result<Scale, E> {
                Ok(Scale(DVec3::splat(x as f64)))
            }
            fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut seq: A) -> Result<Scale, A::Error> {
                let mut axes = [0.0; 3];
                for (i, axis) in axes.iter_mut().enumerate() {
                    *axis = seq.next_element()?.ok_or_else(|| serde::de::Error::invalid_length(i, &self))?;
                }
                Ok(Scale(DVec3::from_array(axes)))
            }
        }
        deserializer.deserialize_any(ScaleVisitor)
    }
}

record! {
    /// Straight motion in time, for moving spheres of the scene formats.
    ///
    /// The entity stands at its transform at time `start` and `displacement` further at `end`, extrapolated outside; what
    /// it is the parent of goes with it. Time is that of the camera's `shutter`, so that every frame shows the same
    /// motion: it blurs a picture while the shutter is open, and a script moves entities from frame to frame.
    pub struct Motion {
        /// World units travelled from `start` to `end`.
        pub displacement: DVec3 = DVec3::ZERO,
        /// Time at the transform itself, in the camera's shutter units.
        pub start: f64 = 0.0,
        /// Time at the full displacement; later than `start`.
        pub end: f64 = 1.0,
    }
}

impl Motion {
    /// Displacement at a time.
    pub fn at(&self, time: f64) -> DVec3 {
        self.displacement * ((time - self.start) / (self.end - self.start))
    }
}

/// The map from an entity's local space to the world, if its parent's is `above`: the one rule for where things stand.
/// The displacement of its motion is in world space.
pub fn placement_below(above: DAffine3, transform: Option<&Transform>, motion: Option<&Motion>, time: f64) -> DAffine3 {
    let mut matrix = above;
    if let Some(transform) = transform {
        matrix *= transform.matrix();
    }
    if let Some(motion) = motion {
        matrix.translation += motion.at(time);
    }
    matrix
}

/// The map from an entity's local space to the world, where entities are numbers: `transform_of` and `motion_of` say what
/// they carry, `find` who has a name. A circle of parents, which is refused elsewhere, ends somewhere.
pub fn world_placement<'a>(
    entity: usize,
    transform_of: impl Fn(usize) -> Option<&'a Transform>,
    motion_of: impl Fn(usize) -> Option<&'a Motion>,
    find: impl Fn(&str) -> Option<usize>,
    time: f64,
) -> DAffine3 {
    let parent = |index: &usize| transform_of(*index)?.parent.as_deref().and_then(&find);
    let chain: Vec<usize> = std::iter::successors(Some(entity), parent).take(limits::HIERARCHY_DEPTH).collect();
    chain
        .into_iter()
        .rev()
        .fold(DAffine3::IDENTITY, |above, index| placement_below(above, transform_of(index), motion_of(index), time))
}

impl Check for Motion {
    fn check(&self) -> Result<(), Invalid> {
        position("displacement", self.displacement)?;
        super::record::ranges::coordinate("start", self.start)?;
        super::record::ranges::coordinate("end", self.end)?;
        if self.end > self.start {
            return Ok(());
        }
        Err(Invalid { field: "end", message: format!("`end` {} must be later than `start` {}", self.end, self.start) })
    }
}
