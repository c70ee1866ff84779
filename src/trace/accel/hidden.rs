//! Primitives that are not there for some rays.

use crate::trace::primitive::Geometry;

/// Primitives of a geometry that an accelerator leaves out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HiddenPrimitives {
    /// A bit for each; none at all if nothing is hidden.
    bits: Vec<u64>,
}

impl HiddenPrimitives {
    /// Nothing is hidden.
    pub const NONE: HiddenPrimitives = HiddenPrimitives { bits: Vec::new() };

    /// Those of entities for which `is_hidden`, by their authored index.
    pub fn new(geometry: &Geometry, is_hidden: impl Fn(u32) -> bool) -> Self {
        let mut bits = vec![0u64; geometry.len().div_ceil(64)];
        for number in 0..geometry.len() as u32 {
            if is_hidden(geometry.tag(number).entity) {
                bits[number as usize / 64] |= 1 << (number % 64);
            }
        }
        if bits.iter().all(|word| *word == 0) { HiddenPrimitives::NONE } else { HiddenPrimitives { bits } }
    }

    /// Whether nothing is hidden.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.bits.is_empty()
    }

    /// Whether the primitive of this number is left out.
    #[inline]
    pub fn contains(&self, number: u32) -> bool {
        self.bits.get(number as usize / 64).is_some_and(|word| word >> (number % 64) & 1 == 1)
    }

    /// The first `count` numbers but for those that are left out, in order.
    pub fn shown(&self, count: u32) -> Vec<u32> {
        (0..count).filter(|number| !self.contains(*number)).collect()
    }
}
