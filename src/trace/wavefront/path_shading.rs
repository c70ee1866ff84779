//! What paths do at surfaces, written once: one of any material, or eight that follow Lambert's law side by side.

use glam::Vec3;

use super::context::RenderContext;
use super::path_state::PathStateLanes;
use super::ray_queue::RayQueue;
use super::shaded_hits::ShadedHits;
use super::shadow_ray_queue::{ShadowRayBatch, ShadowRayQueue};
use crate::trace::light::Lights;
use crate::trace::sampler::{Domain, RayNode, power_heuristic};
use crate::trace::simd::{LANES, Lanes, V3, lanes};

/// How surfaces scatter light, one or eight. Everything in it is to be marked `#[inline(always)]`.
pub trait BsdfLanes<L: Lanes> {
    /// A direction as the BSDF wants it.
    type Local: Copy;
    /// Whether some of it goes in single directions, or through the surface.
    const HAS_SPECULAR: bool;

    fn local(&self, direction: V3<L>) -> Self::Local;
    /// Cosine of the direction to the normal that light is counted about.
    fn cosine(&self, local: Self::Local) -> L;
    /// Value times cosine, without what goes in single directions.
    fn eval(&self, local: Self::Local) -> V3<L>;
    /// Density per steradian of [`Self::sample`], without single directions.
    fn pdf(&self, local: Self::Local) -> L;
    /// Directions in which paths go on.
    fn sample(&self) -> DirectionSample<L>;
    /// What a path is worth that goes on with this throughput: below 1, chance decides whether it does.
    fn worth(&self, throughput: V3<L>, sample: &DirectionSample<L>) -> L;
    /// The medium of the rays that follow.
    fn medium(&self, medium: L, sample: &DirectionSample<L>) -> L;
}

/// Directions that light is scattered to.
#[derive(Clone, Copy)]
pub struct DirectionSample<L: Lanes> {
    /// Unit, in the world.
    pub direction: V3<L>,
    /// Value times cosine over density.
    pub weight: V3<L>,
    /// Per steradian; 0 for single directions.
    pub pdf: L,
    /// Whether the light is not absorbed.
    pub good: L::Mask,
    /// Whether it is a single direction.
    pub specular: L::Mask,
    pub transmitted: L::Mask,
}

/// Light that is absorbed.
impl Default for DirectionSample<f32> {
    fn default() -> Self {
        let zero = V3::splat(Vec3::ZERO);
        DirectionSample { direction: zero, weight: zero, pdf: 0.0, good: false, specular: false, transmitted: false }
    }
}

impl<L: Lanes> DirectionSample<L> {
    /// The directions for surfaces with these normals, and whether they are of use. A smooth normal may send light to
    /// the wrong side: a single direction is brought back.
    #[inline(always)]
    pub fn on_its_side(&self, geometric_normal: V3<L>) -> (V3<L>, L::Mask) {
        let height = geometric_normal.dot(self.direction);
        let wrong = differ::<L>(height.lt(L::splat(0.0)), self.transmitted);
        let back = self.direction - geometric_normal.scale(L::splat(2.0) * height);
        (V3::select(wrong, back, self.direction), L::or(L::not(wrong), self.specular))
    }
}

/// Samples one of the lights for every hit, and adds the shadow rays that tell whether it is reached.
#[inline(always)]
pub fn sample_direct<L: Lanes, H: ShadedHits<L>, B: BsdfLanes<L>>(
    context: RenderContext,
    lights: &Lights,
    (hits, bsdf): (&H, &B),
    last: bool,
    shadows: &mut [ShadowRayQueue],
) {
    let (domain, zero, points) = (Domain::Light(0), L::splat(0.0), hits.points());
    let pick = if lights.len() > 1 { hits.extra(domain) } else { zero };
    let sampled = lights.sample_lanes(points.point, pick, hits.stratified(domain));
    let light = sampled.all;
    if L::COUNT == 1 && !L::any(light.good) {
        return;
    }
    let local = bsdf.local(light.direction);
    // A smooth normal and the true one may disagree about the side: no light leaks through.
    let above = zero.lt(points.geometric_normal.dot(light.direction));
    let mut lit = L::and(light.good, L::not(differ::<L>(above, zero.lt(bsdf.cosine(local)))));
    if L::COUNT == 1 && !L::any(lit) {
        return;
    }
    let value = bsdf.eval(local);
    lit = L::and(lit, L::or(value.x.ne(zero), L::or(value.y.ne(zero), value.z.ne(zero))));
    let lit = L::bits(lit) & hits.used();
    if lit == 0 {
        return;
    }
    let mut share = L::splat(1.0);
    if !last {
        let is_met = zero.lt(light.pdf);
        if L::any(is_met) {
            share = L::select(is_met, power_heuristic(light.pdf, bsdf.pdf(local)), share);
        }
    }
    let value = hits.fade(value, light.direction);
    let rays = ShadowRayBatch {
        origin: points.offset_origin(light.direction),
        direction: light.direction,
        distance: light.distance,
        target: light.target,
        contribution: hits.states().throughput * (value * light.contribution).scale(share),
    };
    // Those of one light after those of another.
    let (mut left, samples) = (lit, hits.samples());
    while left != 0 {
        let number = sampled.lights[left.trailing_zeros() as usize % LANES];
        let mut same = 0;
        for (i, light) in sampled.lights.iter().enumerate().take(L::COUNT) {
            same |= u32::from(*light == number) << i;
        }
        let bin = number as usize % shadows.len();
        shadows[bin].compress_store(context, left & same, &rays, &samples, lights.group(number));
        left &= !same;
    }
}

/// Where one of two masks is set.
#[inline(always)]
fn differ<L: Lanes>(a: L::Mask, b: L::Mask) -> L::Mask {
    L::or(L::and(a, L::not(b)), L::and(L::not(a), b))
}

/// Rays that paths have before chance decides whether they go on.
pub const MIN_ROULETTE_DEPTH: u32 = 3;

/// Rays that paths go on with.
pub struct ScatteredRays<L: Lanes> {
    /// A bit for each lane that goes on.
    pub going: u32,
    pub origin: V3<L>,
    pub direction: V3<L>,
    pub states: PathStateLanes<L>,
    pub sample: DirectionSample<L>,
}

impl<L: Lanes> ScatteredRays<L> {
    #[inline(always)]
    pub fn push(&self, next: &mut RayQueue) {
        next.compress_store(self.going, self.origin, self.direction, &self.states);
    }
}

/// The rays that paths go on with at this depth; `None` if none does.
#[inline(always)]
pub fn scatter<L: Lanes, H: ShadedHits<L>, B: BsdfLanes<L>>(
    hits: &H,
    bsdf: &B,
    depth: u32,
) -> Option<ScatteredRays<L>> {
    let (zero, one, points, states) = (L::splat(0.0), L::splat(1.0), hits.points(), hits.states());
    let sample = bsdf.sample();
    if L::COUNT == 1 && !L::any(sample.good) {
        return None;
    }
    let mut direction = sample.direction;
    let mut throughput = states.throughput * sample.weight;
    let mut good = sample.good;
    if B::HAS_SPECULAR {
        let (sent, fits) = sample.on_its_side(points.geometric_normal);
        direction = sent;
        good = L::and(good, fits);
        throughput = V3::select(sample.specular, throughput, hits.fade(throughput, direction));
    } else {
        good = L::and(good, zero.le(points.geometric_normal.dot(direction)));
        throughput = hits.fade(throughput, direction);
    }
    let worth = bsdf.worth(throughput, &sample);
    let mut going = L::bits(L::and(good, zero.lt(worth))) & hits.used();
    if L::COUNT == 1 && going == 0 {
        return None;
    }
    let nodes = hits.onward(RayNode::scattered);
    if depth >= MIN_ROULETTE_DEPTH {
        let doubtful = worth.lt(one);
        let chances = worth.store();
        for i in lanes(going & L::bits(doubtful)) {
            if hits.random_at(&nodes, i, Domain::Roulette) >= chances[i] {
                going &= !(1 << i);
            }
        }
        let by = L::select(doubtful, worth, one);
        throughput = V3 { x: throughput.x / by, y: throughput.y / by, z: throughput.z / by };
    }
    let cone = states.cone.scattered(sample.pdf);
    let medium = bsdf.medium(states.medium, &sample);
    let states = hits.at(PathStateLanes { throughput, pdf: sample.pdf, cone, medium, ..states }, &nodes);
    Some(ScatteredRays { going, origin: points.offset_origin(direction), direction, states, sample })
}
