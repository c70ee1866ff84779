//! Hits that are shaded together: one of any material, or eight of the usual ones side by side.

use super::batch::ShadingBatch;
use super::context::RenderContext;
use super::interaction::SurfaceInteraction;
use super::path_state::PathStateLanes;
use crate::trace::light::{LightLinking, Lights};
use crate::trace::material::ShadingParams;
use crate::trace::primitive::SurfacePointLanes;
use crate::trace::sampler::{Domain, RayNode};
use crate::trace::simd::{LANES, Lanes, V3, Wide, lanes, lanes_to_bits};

/// What shading asks of hits, one or eight. Everything in it is to be marked `#[inline(always)]`, see
/// [`crate::trace::simd::Kernel::run`].
pub trait ShadedHits<L: Lanes> {
    /// Nodes of rays that follow.
    type Nodes;

    /// A bit for each lane that is in use.
    fn used(&self) -> u32;
    /// Of the rays.
    fn direction(&self) -> V3<L>;
    /// Facing the rays.
    fn points(&self) -> SurfacePointLanes<L>;
    /// Of the rays; cones are those at the hits.
    fn states(&self) -> PathStateLanes<L>;
    /// Slots of the first light group that light is added to.
    fn samples(&self) -> [u32; LANES];
    /// Albedo of what is diffuse.
    fn diffuse(&self) -> V3<L>;
    /// The material of one lane.
    fn material(&self, lane: usize) -> &ShadingParams;
    /// The entity of one lane, by its authored index.
    fn entity(&self, lane: usize) -> u32;

    /// See [`crate::trace::sampler::Sampler::stratified`].
    fn stratified(&self, domain: Domain) -> [L; 2];
    /// See [`crate::trace::sampler::Sampler::random`].
    fn random(&self, domain: Domain) -> [L; 2];
    /// See [`crate::trace::sampler::Sampler::extra`].
    fn extra(&self, domain: Domain) -> L;

    /// The nodes that these lead to.
    fn onward(&self, to: fn(RayNode) -> RayNode) -> Self::Nodes;
    /// Path states at such nodes.
    fn at(&self, states: PathStateLanes<L>, nodes: &Self::Nodes) -> PathStateLanes<L>;
    /// A random number of one lane at its node.
    fn random_at(&self, nodes: &Self::Nodes, lane: usize, domain: Domain) -> f32;

    /// Where rays start from the lanes that have a bit towards light that the smooth normal faces and the surface itself
    /// does not: which of them have such a start, and all `origins` with theirs in place of what is there.
    fn smooth_starts(&self, context: RenderContext, bits: u32, origins: V3<L>) -> (u32, V3<L>);
    /// What is left of light from a direction: where a map has bent the normal, it fades out at the terminator.
    fn fade(&self, light: V3<L>, direction: V3<L>) -> V3<L>;
}

/// Which of the lanes that have a bit are lit by their lights.
#[inline(never)]
pub fn linked_lanes<L: Lanes, H: ShadedHits<L>>(
    lights: &Lights,
    hits: &H,
    bits: u32,
    light: impl Fn(usize) -> LightLinking,
) -> u32 {
    lanes(bits).filter(|i| lights.is_linked(light(*i), hits.entity(*i))).fold(0, |linked, i| linked | 1 << i)
}

impl ShadedHits<f32> for SurfaceInteraction<'_> {
    type Nodes = RayNode;

    #[inline(always)]
    fn used(&self) -> u32 {
        1
    }
    #[inline(always)]
    fn direction(&self) -> V3<f32> {
        self.direction.into()
    }
    #[inline(always)]
    fn points(&self) -> SurfacePointLanes<f32> {
        (&self.surface).into()
    }
    #[inline(always)]
    fn states(&self) -> PathStateLanes<f32> {
        PathStateLanes::splat(self.state)
    }
    #[inline(always)]
    fn samples(&self) -> [u32; LANES] {
        [self.state.sample; LANES]
    }
    #[inline(always)]
    fn diffuse(&self) -> V3<f32> {
        self.material.diffuse.into()
    }
    #[inline(always)]
    fn material(&self, _: usize) -> &ShadingParams {
        self.material
    }
    #[inline(always)]
    fn entity(&self, _: usize) -> u32 {
        self.surface.entity
    }
    #[inline(always)]
    fn stratified(&self, domain: Domain) -> [f32; 2] {
        self.sampler.stratified(self.state.node, domain)
    }
    #[inline(always)]
    fn random(&self, domain: Domain) -> [f32; 2] {
        self.sampler.random(self.state.node, domain)
    }
    #[inline(always)]
    fn extra(&self, domain: Domain) -> f32 {
        self.sampler.extra(self.state.node, domain)
    }
    #[inline(always)]
    fn onward(&self, to: fn(RayNode) -> RayNode) -> RayNode {
        to(self.state.node)
    }
    #[inline(always)]
    fn at(&self, states: PathStateLanes<f32>, node: &RayNode) -> PathStateLanes<f32> {
        states.at(&[*node; LANES])
    }
    #[inline(always)]
    fn random_at(&self, node: &RayNode, _: usize, domain: Domain) -> f32 {
        self.sampler.random(*node, domain)[0]
    }
    #[inline(always)]
    fn smooth_starts(&self, context: RenderContext, _: u32, origins: V3<f32>) -> (u32, V3<f32>) {
        self.smooth_start(context).map_or((0, origins), |start| (1, start.into()))
    }
    #[inline(always)]
    fn fade(&self, light: V3<f32>, direction: V3<f32>) -> V3<f32> {
        light.scale(self.surface.terminator(direction.into()))
    }
}

impl<L: Wide> ShadedHits<L> for ShadingBatch<'_, L> {
    type Nodes = [RayNode; LANES];

    #[inline(always)]
    fn used(&self) -> u32 {
        self.used
    }
    #[inline(always)]
    fn direction(&self) -> V3<L> {
        self.direction
    }
    #[inline(always)]
    fn points(&self) -> SurfacePointLanes<L> {
        self.points
    }
    #[inline(always)]
    fn states(&self) -> PathStateLanes<L> {
        self.states
    }
    #[inline(always)]
    fn samples(&self) -> [u32; LANES] {
        lanes_to_bits(self.states.sample)
    }
    #[inline(always)]
    fn diffuse(&self) -> V3<L> {
        self.albedo
    }
    #[inline(always)]
    fn material(&self, lane: usize) -> &ShadingParams {
        ShadingBatch::material(self, lane)
    }
    #[inline(always)]
    fn entity(&self, lane: usize) -> u32 {
        ShadingBatch::entity(self, lane)
    }
    #[inline(always)]
    fn stratified(&self, domain: Domain) -> [L; 2] {
        self.samples.stratified(domain)
    }
    #[inline(always)]
    fn random(&self, domain: Domain) -> [L; 2] {
        self.samples.random(domain)
    }
    #[inline(always)]
    fn extra(&self, domain: Domain) -> L {
        self.samples.extra(domain)
    }
    #[inline(always)]
    fn onward(&self, to: fn(RayNode) -> RayNode) -> [RayNode; LANES] {
        self.samples.onward(to)
    }
    #[inline(always)]
    fn at(&self, states: PathStateLanes<L>, nodes: &[RayNode; LANES]) -> PathStateLanes<L> {
        states.at(nodes)
    }
    #[inline(always)]
    fn random_at(&self, nodes: &[RayNode; LANES], lane: usize, domain: Domain) -> f32 {
        self.samples.sampler(lane).random(nodes[lane], domain)[0]
    }
    #[inline(always)]
    fn smooth_starts(&self, _: RenderContext, bits: u32, origins: V3<L>) -> (u32, V3<L>) {
        ShadingBatch::smooth_starts(self, bits, origins)
    }
    /// What is textured is shaded alone.
    #[inline(always)]
    fn fade(&self, light: V3<L>, _: V3<L>) -> V3<L> {
        light
    }
}
