//! What a primitive belongs to, and which of its sides are there.

/// Which sides of a primitive are there for rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sides {
    #[default]
    Both,
    /// Only the outside.
    Front,
    /// Only the inside.
    Back,
}

impl Sides {
    #[inline]
    pub fn shows(self, front: bool) -> bool {
        match self {
            Sides::Both => true,
            Sides::Front => front,
            Sides::Back => !front,
        }
    }
}

/// What a primitive belongs to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tag {
    /// Authored index of the entity.
    pub entity: u32,
    /// Index of the material.
    pub material: u32,
    pub sides: Sides,
    /// Whether it is part of a surface that encloses an inside.
    pub closed: bool,
}
