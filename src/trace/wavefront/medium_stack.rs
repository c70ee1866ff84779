//! The transparent bodies that a ray is in, and what it crosses where it meets the surface of one.
//!
//! Bodies may lie in each other (a drop in a marble), overlap (a liquid that reaches into the wall of its glass) or share
//! a material. Which one is there is decided by priority, then by which was entered last (Schmidt and Budge, "Simple
//! nested dielectrics in ray traced images", 2002). A surface between a body and itself, or one that another body of
//! higher priority covers, is not there at all.

use crate::base::limits;
use crate::trace::material::ShadingParams;
use crate::trace::primitive::Tag;
use crate::trace::simd::Lanes;
use crate::trace::soa::Field;

/// Entries, and bits of one: the number of a material and one more, 0 for none.
const DEPTH: u32 = limits::NESTED_BODIES;
const BITS: u32 = u64::BITS / DEPTH;
const ENTRY: u64 = limits::BODY_MATERIALS as u64;

/// Materials of the transparent bodies that a ray is in, the last one entered in the lowest bits.
///
/// It holds as many as [`limits::NESTED_BODIES`], and forgets the outermost beyond that. Materials of higher numbers than
/// [`limits::BODY_MATERIALS`] are as if in air.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MediumStack(u64);

impl MediumStack {
    /// In no body.
    pub const AIR: MediumStack = MediumStack(0);

    #[inline(always)]
    /// Whether there is no body.
    pub fn is_air(self) -> bool {
        self.0 == 0
    }

    /// The lower half of its bits, and the upper one.
    #[inline(always)]
    pub fn words(self) -> [u32; 2] {
        [self.0 as u32, (self.0 >> 32) as u32]
    }

    /// The same as columns hold them.
    #[inline(always)]
    pub fn halves(self) -> [f32; 2] {
        let [low, high] = self.words();
        [f32::from_bits(low), f32::from_bits(high)]
    }

    /// The stack of such columns.
    #[inline(always)]
    pub fn of_halves([low, high]: [f32; 2]) -> MediumStack {
        MediumStack(u64::from(low.to_bits()) | u64::from(high.to_bits()) << 32)
    }

    fn entries(self) -> impl Iterator<Item = u64> {
        (0..DEPTH).map(move |i| self.0 >> (i * BITS) & ENTRY).take_while(|entry| *entry != 0)
    }

    fn entered(self, material: u32) -> MediumStack {
        let entry = u64::from(material) + 1;
        if entry > ENTRY { self } else { MediumStack(self.0 << BITS | entry) }
    }

    /// Without the latest entry of a material; `None` if there is none.
    fn left(self, material: u32) -> Option<MediumStack> {
        let entry = u64::from(material) + 1;
        let at = self.entries().position(|other| other == entry)? as u32 * BITS;
        let below = self.0 & ((1 << at) - 1);
        let above = self.0.checked_shr(at + BITS).unwrap_or(0);
        Some(MediumStack(above << at | below))
    }

    /// The material that is there.
    pub fn material(self, materials: &[ShadingParams]) -> Option<u32> {
        let priority = |entry: u64| materials[(entry - 1) as usize].priority;
        let best = self.entries().reduce(|best, other| if priority(other) > priority(best) { other } else { best });
        best.map(|entry| (entry - 1) as u32)
    }
}

/// What lies on both sides of a surface that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The bodies that the ray is in.
    pub before: MediumStack,
    /// Those that what goes through the surface is in.
    pub behind: MediumStack,
    /// Index of the body whose surface it is against that of what is around it there.
    pub ior: f32,
    /// Whether the same body is there on both sides: the surface does not exist.
    pub is_void: bool,
}

impl Crossing {
    /// `front`: the ray comes from the outside. Surfaces that enclose nothing, and opaque ones, change nothing.
    #[inline]
    pub fn new(materials: &[ShadingParams], stack: MediumStack, tag: Tag, front: bool) -> Crossing {
        let material = &materials[tag.material as usize];
        if !material.bounds_body() || !tag.closed {
            return Crossing { before: stack, behind: stack, ior: material.ior, is_void: false };
        }
        // A ray that leaves a body which it has not entered has started in it.
        let inside = if front { stack.entered(tag.material) } else { stack };
        let (inside, outside) = match inside.left(tag.material) {
            Some(outside) => (inside, outside),
            None => (stack.entered(tag.material), stack),
        };
        let [within, around] = [inside, outside].map(|stack| stack.material(materials));
        let index = |material: Option<u32>| material.map_or(1.0, |m| materials[m as usize].ior);
        let (before, behind) = if front { (outside, inside) } else { (inside, outside) };
        Crossing { before, behind, ior: index(within) / index(around), is_void: within == around && within.is_some() }
    }

    /// Whether a ray goes on as if nothing were there: glass alone, for other materials may have a skin.
    pub fn is_passed(&self, material: &ShadingParams) -> bool {
        (self.is_void || self.ior == 1.0) && material.is_clear()
    }
}

/// The lower half of its bits, and the upper one.
impl Field for MediumStack {
    const COLUMNS: usize = 2;
    type Side<L: Lanes> = [L; 2];

    #[inline(always)]
    fn put<const N: usize>(self, row: &mut [f32; N], at: usize) {
        [row[at], row[at + 1]] = self.halves();
    }
    #[inline(always)]
    fn take<const N: usize>(row: &[f32; N], at: usize) -> Self {
        MediumStack::of_halves([row[at], row[at + 1]])
    }
    #[inline(always)]
    fn put_lanes<L: Lanes, const N: usize>(lanes: [L; 2], rows: &mut [L; N], at: usize) {
        (rows[at], rows[at + 1]) = (lanes[0], lanes[1]);
    }
    #[inline(always)]
    fn take_lanes<L: Lanes, const N: usize>(rows: &[L; N], at: usize) -> [L; 2] {
        [rows[at], rows[at + 1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::components::{Material, Model};

    fn glass(ior: f64, priority: u32) -> ShadingParams {
        ShadingParams::from(&Material { model: Model::Dielectric, ior: Some(ior), priority, ..Material::default() })
    }

    fn body(material: u32) -> Tag {
        Tag { material, closed: true, ..Tag::default() }
    }

    /// Indices that a ray meets on its way through surfaces: material, and whether from the outside.
    fn way(materials: &[ShadingParams], surfaces: &[(u32, bool)]) -> (Vec<(f32, bool)>, MediumStack) {
        let mut stack = MediumStack::AIR;
        let met = surfaces.iter().map(|(material, front)| {
            let crossing = Crossing::new(materials, stack, body(*material), *front);
            stack = crossing.behind;
            (crossing.ior, crossing.is_void)
        });
        (met.collect(), stack)
    }

    #[test]
    fn a_drop_in_a_marble_refracts_by_the_ratio_of_both() {
        let materials = [glass(1.5, 0), glass(1.33, 0)];
        let (met, left) = way(&materials, &[(0, true), (1, true), (1, false), (0, false)]);
        let drop = 1.33f32 / 1.5;
        assert_eq!(met, [(1.5, false), (drop, false), (drop, false), (1.5, false)]);
        assert!(left.is_air());
    }

    #[test]
    fn what_lies_in_its_like_is_not_there() {
        let (met, left) = way(&[glass(1.5, 0)], &[(0, true), (0, true), (0, false), (0, false)]);
        assert_eq!(met.iter().map(|m| m.1).collect::<Vec<_>>(), [false, true, true, false]);
        assert!(left.is_air());
    }

    #[test]
    fn the_wall_of_a_glass_covers_the_liquid_that_reaches_into_it() {
        // Water, then its glass, whichever way the ray goes: the water's own surface lies in the wall.
        let materials = [glass(1.5, 1), glass(1.33, 0)];
        let wall = 1.5f32 / 1.33;
        let (out, _) = way(&materials, &[(1, true), (0, true), (1, false), (0, false)]);
        assert_eq!(out, [(1.33, false), (wall, false), (1.0, true), (1.5, false)]);
        let (into, _) = way(&materials, &[(0, true), (1, true), (0, false), (1, false)]);
        assert_eq!(into, [(1.5, false), (1.0, true), (wall, false), (1.33, false)]);
    }

    #[test]
    fn a_ray_that_starts_inside_leaves_into_the_air() {
        let (met, left) = way(&[glass(1.5, 0)], &[(0, false)]);
        assert_eq!((met, left), (vec![(1.5, false)], MediumStack::AIR));
        let open = Tag { closed: false, ..body(0) };
        let pane = Crossing::new(&[glass(1.5, 0)], MediumStack::AIR, open, true);
        assert_eq!((pane.behind, pane.ior), (MediumStack::AIR, 1.5));
    }
}
