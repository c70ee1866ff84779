//! What a ray carries: one path state, and eight side by side.

use glam::Vec3;

use crate::trace::material::texture::RayCone;
use crate::trace::sampler::RayNode;
use crate::trace::simd::{LANES, V3, Wide, lanes_from_bits, lanes_to_bits};

/// What becomes of the light that a ray finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathState {
    pub node: RayNode,
    /// Index of its sample in the batch.
    pub sample: u32,
    /// Factor of its light in the colour of the sample.
    pub throughput: Vec3,
    /// Of the ray where it starts; in an [`super::wave::SurfaceInteraction`] where it ends.
    pub cone: RayCone,
    /// Density per steradian with which the direction was sampled; 0 if nothing else could have found it.
    pub pdf: f32,
    /// Material of the body that the ray runs in and that absorbs light, or [`NO_MEDIUM`].
    pub medium: u32,
    pub emission_filter: EmissionFilter,
}

/// Whose light a ray still brings home. Other rays than those of photon mapping seek all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmissionFilter {
    All,
    /// What comes straight from a light, and then as `Unsent`: photons have told the rest.
    DirectOnly,
    /// That of lights which send no photons.
    NonPhoton,
}

/// No medium that absorbs light. As a number of a column it is NaN.
pub const NO_MEDIUM: u32 = u32::MAX;

/// How much wider the cones of rays get that a diffuse surface scatters, in radians: far less than they are apart, so
/// that what they find of a texture stays true to its place.
pub const DIFFUSE_SPREAD: f32 = 0.1;

impl PathState {
    /// The path state of the first ray of a sample or photon.
    pub fn first(sample: u32, cone: RayCone) -> PathState {
        let (node, throughput) = (RayNode::CAMERA, Vec3::ONE);
        PathState { node, sample, throughput, cone, pdf: 0.0, medium: NO_MEDIUM, emission_filter: EmissionFilter::All }
    }

    /// The path state of a ray in the one possible direction.
    pub fn onward(&self, node: RayNode, throughput: Vec3) -> PathState {
        PathState { node, throughput: self.throughput * throughput, pdf: 0.0, ..*self }
    }

    /// The cone of a ray whose direction was sampled with this density, 0 for the one possible direction: the wider the
    /// lobe, the wider the cone.
    pub fn scattered_cone(&self, pdf: f32) -> RayCone {
        if pdf > 0.0 { self.cone.widened((0.5 / pdf.sqrt()).min(DIFFUSE_SPREAD)) } else { self.cone }
    }

    #[inline(always)]
    pub(super) fn row(&self) -> [f32; 11] {
        let [low, high] = self.node.halves().map(f32::from_bits);
        let (sample, medium) = (f32::from_bits(self.sample), f32::from_bits(self.medium));
        let (w, emission_filter) = (self.throughput, f32::from_bits(self.emission_filter as u32));
        [low, high, sample, w.x, w.y, w.z, self.cone.width, self.cone.spread, self.pdf, medium, emission_filter]
    }

    #[inline(always)]
    pub(super) fn of_row(
        [low, high, sample, x, y, z, width, spread, pdf, medium, emission_filter]: [f32; 11],
    ) -> PathState {
        PathState {
            node: RayNode::of_halves([low.to_bits(), high.to_bits()]),
            sample: sample.to_bits(),
            throughput: Vec3::new(x, y, z),
            cone: RayCone { width, spread },
            pdf,
            medium: medium.to_bits(),
            emission_filter: match emission_filter.to_bits() {
                0 => EmissionFilter::All,
                1 => EmissionFilter::DirectOnly,
                _ => EmissionFilter::NonPhoton,
            },
        }
    }
}

/// Path states side by side; whole numbers by their bits.
#[derive(Clone, Copy, Debug)]
pub struct PathStateLanes<L> {
    /// Halves of the nodes.
    pub nodes: [L; 2],
    pub samples: L,
    pub throughput: V3<L>,
    pub width: L,
    pub spread: L,
    pub pdf: L,
    pub media: L,
    pub emission_filter: L,
}

impl<L: Wide> PathStateLanes<L> {
    /// As [`PathState::first`].
    #[inline(always)]
    pub fn first(samples: &[u32; LANES], cone: RayCone) -> Self {
        let mut rows = [L::splat(0.0); 11];
        for (x, y) in rows.iter_mut().zip(&PathState::first(0, cone).row()) {
            *x = L::splat(*y);
        }
        PathStateLanes { samples: lanes_from_bits(samples), ..Self::of_rows(rows) }
    }

    #[inline(always)]
    pub(super) fn rows(&self) -> [L; 11] {
        let ([low, high], w) = (self.nodes, self.throughput);
        [low, high, self.samples, w.x, w.y, w.z, self.width, self.spread, self.pdf, self.media, self.emission_filter]
    }

    #[inline(always)]
    pub(super) fn of_rows([low, high, samples, x, y, z, width, spread, pdf, media, emission_filter]: [L; 11]) -> Self {
        PathStateLanes {
            nodes: [low, high],
            samples,
            throughput: V3 { x, y, z },
            width,
            spread,
            pdf,
            media,
            emission_filter,
        }
    }

    /// The nodes one by one.
    #[inline(always)]
    pub fn each_node(&self) -> [RayNode; LANES] {
        let (low, high) = (lanes_to_bits(self.nodes[0]), lanes_to_bits(self.nodes[1]));
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
        PathStateLanes { nodes: [lanes_from_bits(&halves[0]), lanes_from_bits(&halves[1])], ..self }
    }
}
