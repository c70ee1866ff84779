//! What a ray carries: one path state, and eight side by side.

use glam::Vec3;

use super::medium_stack::MediumStack;
use crate::base::limits;
use crate::trace::material::texture::RayCone;
use crate::trace::sampler::RayNode;
use crate::trace::simd::{LANES, Lanes, lanes_from_bits, lanes_to_bits};
use crate::trace::soa::{Field, work_item};

work_item! {
    /// What becomes of the light that a ray finds.
    #[derive(Clone, Copy, Debug, PartialEq)]
    PathState, PathStateLanes, PathStates {
        /// Where it is in the tree of rays of its sample.
        node: RayNode,
        /// Index of its sample in the batch; where there are shadow catchers, the slot that its light is added to.
        sample: u32,
        /// Factor of its light in the colour of the sample.
        throughput: Vec3,
        /// Of the ray where it starts; in a [`super::SurfaceInteraction`] where it ends.
        cone: RayCone,
        /// Density per steradian with which the direction was sampled; 0 if nothing else could have found it.
        pdf: f32,
        /// The transparent bodies that the ray is in.
        medium: MediumStack,
        /// How often a surface has scattered the path in a direction that was one of many: 0 while it shows what the
        /// camera sees, straight or by mirrors and clear glass.
        scatterings: f32,
        /// Whose light still counts.
        scope: EmissionScope,
    }
}

/// Whose light still counts, and for whom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EmissionScope {
    /// Whose light a ray still brings home.
    pub filter: EmissionFilter,
    /// The entity that it left, where lights do not light all of them; `None` for rays of the camera, and elsewhere.
    pub receiver: Option<u32>,
}

/// Bits of the filter in what stands for a scope; those above are the entity and one more.
const FILTER_BITS: u32 = 2;

impl EmissionScope {
    /// As one number.
    #[inline(always)]
    fn bits(self) -> u32 {
        self.filter as u32 | self.receiver.map_or(0, |entity| (entity + 1) << FILTER_BITS)
    }

    /// Lanes of numbers that stand for scopes, with these entities in them.
    #[inline(always)]
    pub fn with_receivers<L: Lanes>(scopes: L, entities: &[u32; LANES]) -> L {
        let mut bits = lanes_to_bits(scopes);
        for (bits, entity) in bits.iter_mut().zip(entities) {
            *bits = *bits & ((1 << FILTER_BITS) - 1) | (entity + 1) << FILTER_BITS;
        }
        lanes_from_bits(&bits)
    }
}

// Room for the number of every entity, and one more.
const _: () = assert!((limits::ENTITIES as u64 + 1) << FILTER_BITS <= u32::MAX as u64);

/// Whose light a ray still brings home. Other rays than those of photon mapping seek all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmissionFilter {
    /// By any material.
    All,
    /// What comes straight from a light, and then as `NonPhoton`: photons have told the rest.
    DirectOnly,
    /// That of lights which send no photons.
    NonPhoton,
}

/// How much wider the cones of rays get that a diffuse surface scatters, in radians: far less than they are apart, so
/// that what they find of a texture stays true to its place.
pub const DIFFUSE_SPREAD: f32 = 0.1;

impl PathState {
    /// The path state of the first ray of a sample or photon.
    pub fn first(sample: u32, cone: RayCone) -> PathState {
        let (node, throughput) = (RayNode::CAMERA, Vec3::ONE);
        let (medium, scope) = (MediumStack::AIR, EmissionScope { filter: EmissionFilter::All, receiver: None });
        PathState { node, sample, throughput, cone, pdf: 0.0, medium, scatterings: 0.0, scope }
    }

    /// The path state of a ray in the one possible direction.
    pub fn onward(&self, node: RayNode, throughput: Vec3) -> PathState {
        PathState { node, throughput: self.throughput * throughput, pdf: 0.0, ..*self }
    }

    /// See `RayConeLanes::scattered`.
    pub fn scattered_cone(&self, pdf: f32) -> RayCone {
        RayCone { spread: RayConeLanes::from(self.cone).scattered(pdf).spread, ..self.cone }
    }
}

/// The lower half of what stands for the node, and the upper one.
impl Field for RayNode {
    const COLUMNS: usize = 2;
    type Side<L: Lanes> = [L; 2];

    #[inline(always)]
    fn put<const N: usize>(self, row: &mut [f32; N], at: usize) {
        let [low, high] = self.halves();
        (row[at], row[at + 1]) = (f32::from_bits(low), f32::from_bits(high));
    }
    #[inline(always)]
    fn take<const N: usize>(row: &[f32; N], at: usize) -> Self {
        RayNode::of_halves([row[at].to_bits(), row[at + 1].to_bits()])
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

/// Ray cones side by side.
#[derive(Clone, Copy, Debug)]
pub struct RayConeLanes<L> {
    pub width: L,
    pub spread: L,
}

impl<L: Lanes> RayConeLanes<L> {
    /// The cones of rays whose directions were sampled with these densities, 0 for the one possible direction: the wider
    /// the lobe, the wider the cone.
    #[inline(always)]
    pub fn scattered(self, pdf: L) -> Self {
        let wider = self.spread + (L::splat(0.5) / pdf.sqrt()).min(L::splat(DIFFUSE_SPREAD));
        RayConeLanes { spread: L::select(L::splat(0.0).lt(pdf), wider, self.spread), ..self }
    }
}

impl From<RayCone> for RayConeLanes<f32> {
    #[inline(always)]
    fn from(RayCone { width, spread }: RayCone) -> Self {
        RayConeLanes { width, spread }
    }
}

impl Field for RayCone {
    const COLUMNS: usize = 2;
    type Side<L: Lanes> = RayConeLanes<L>;

    #[inline(always)]
    fn put<const N: usize>(self, row: &mut [f32; N], at: usize) {
        (row[at], row[at + 1]) = (self.width, self.spread);
    }
    #[inline(always)]
    fn take<const N: usize>(row: &[f32; N], at: usize) -> Self {
        RayCone { width: row[at], spread: row[at + 1] }
    }
    #[inline(always)]
    fn put_lanes<L: Lanes, const N: usize>(lanes: RayConeLanes<L>, rows: &mut [L; N], at: usize) {
        (rows[at], rows[at + 1]) = (lanes.width, lanes.spread);
    }
    #[inline(always)]
    fn take_lanes<L: Lanes, const N: usize>(rows: &[L; N], at: usize) -> RayConeLanes<L> {
        RayConeLanes { width: rows[at], spread: rows[at + 1] }
    }
}

impl Field for EmissionScope {
    const COLUMNS: usize = 1;
    type Side<L: Lanes> = L;

    #[inline(always)]
    fn put<const N: usize>(self, row: &mut [f32; N], at: usize) {
        row[at] = f32::from_bits(self.bits());
    }
    #[inline(always)]
    fn take<const N: usize>(row: &[f32; N], at: usize) -> Self {
        let bits = row[at].to_bits();
        let filter = match bits & ((1 << FILTER_BITS) - 1) {
            0 => EmissionFilter::All,
            1 => EmissionFilter::DirectOnly,
            _ => EmissionFilter::NonPhoton,
        };
        EmissionScope { filter, receiver: (bits >> FILTER_BITS).checked_sub(1) }
    }
    #[inline(always)]
    fn put_lanes<L: Lanes, const N: usize>(lanes: L, rows: &mut [L; N], at: usize) {
        rows[at] = lanes;
    }
    #[inline(always)]
    fn take_lanes<L: Lanes, const N: usize>(rows: &[L; N], at: usize) -> L {
        rows[at]
    }
}

impl<L: Lanes> PathStateLanes<L> {
    /// As [`PathState::first`].
    #[inline(always)]
    pub fn first(samples: &[u32; LANES], cone: RayCone) -> Self {
        PathStateLanes { sample: lanes_from_bits(samples), ..Self::splat(PathState::first(0, cone)) }
    }

    /// The nodes one by one.
    #[inline(always)]
    pub fn each_node(&self) -> [RayNode; LANES] {
        let (low, high) = (lanes_to_bits(self.node[0]), lanes_to_bits(self.node[1]));
        let mut nodes = [RayNode::CAMERA; LANES];
        for (i, node) in nodes.iter_mut().enumerate() {
            *node = RayNode::of_halves([low[i], high[i]]);
        }
        nodes
    }

    /// The same path states at other nodes.
    #[inline(always)]
    pub fn at(self, nodes: &[RayNode; LANES]) -> Self {
        let mut halves = [[0; LANES]; 2];
        for (i, node) in nodes.iter().enumerate() {
            [halves[0][i], halves[1][i]] = node.halves();
        }
        PathStateLanes { node: [lanes_from_bits(&halves[0]), lanes_from_bits(&halves[1])], ..self }
    }
}
