//! What paths do at surfaces, written once: one of any material, or eight that follow Lambert's law side by side.

use glam::Vec3;

use super::context::RenderContext;
use super::interaction::shadow_ray_from;
use super::path_state::PathStateLanes;
use super::ray_queue::RayQueue;
use super::shaded_hits::{ShadedHits, linked_lanes};
use super::shadow_ray_queue::{ShadowRayBatch, ShadowRayQueue};
use crate::trace::light::Lights;
use crate::trace::sampler::{Domain, RayNode, power_heuristic};
use crate::trace::simd::{LANES, Lanes, V3, lane, lanes, set_lane};
use crate::trace::soa::Ray;

/// How surfaces scatter light, one or eight. Everything in it is to be marked `#[inline(always)]`.
pub trait BsdfLanes<L: Lanes> {
    /// A direction as the BSDF wants it.
    type Local: Copy;
    /// Whether some of it goes in single directions, or through the surface.
    const HAS_SPECULAR: bool;

    /// A direction of the world.
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
    /// The transparent bodies that the rays are in which follow.
    fn medium(&self, medium: [L; 2], sample: &DirectionSample<L>) -> [L; 2];
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
    /// Whether it goes through the surface.
    pub transmitted: L::Mask,
}

/// Light that is absorbed.
impl Default for DirectionSample<f32> {
    fn default() -> Self {
        let zero = V3::splat(Vec3::ZERO);
        DirectionSample { direction: zero, weight: zero, pdf: 0.0, good: false, specular: false, transmitted: false }
    }
}

/// Rays that leave surfaces.
pub struct SpawnedRays<L: Lanes> {
    /// Where they start.
    pub origin: V3<L>,
    /// Unit.
    pub direction: V3<L>,
    /// A bit for each that leaves.
    pub going: u32,
}

impl<L: Lanes> DirectionSample<L> {
    /// Rays in these directions, of the lanes that have a bit. A smooth normal may send one to the wrong side: a single
    /// direction is brought back, and light that is scattered starts where the smooth surface is, if that is known.
    #[inline(always)]
    pub fn spawn_rays<H: ShadedHits<L>>(&self, context: RenderContext, hits: &H, which: u32) -> SpawnedRays<L> {
        let points = hits.points();
        let height = points.geometric_normal.dot(self.direction);
        let wrong = differ::<L>(height.lt(L::splat(0.0)), self.transmitted);
        let back = self.direction - points.geometric_normal.scale(L::splat(2.0) * height);
        let direction = V3::select(L::and(wrong, self.specular), back, self.direction);
        let mut going = L::bits(L::or(L::not(wrong), self.specular)) & which;
        let mut origin = points.offset_origin(direction);
        let lost = which & !going & L::bits(L::not(self.transmitted));
        if lost != 0 {
            let found;
            (found, origin) = hits.smooth_starts(context, lost, origin);
            going |= found;
        }
        SpawnedRays { origin, direction, going }
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
    let (domain, zero, points, states) = (Domain::Light(0), L::splat(0.0), hits.points(), hits.states());
    let pick = if lights.len() > 1 { hits.extra(domain) } else { zero };
    let sampled = lights.sample_lanes(points.point, pick, hits.stratified(domain));
    let light = sampled.all;
    if L::COUNT == 1 && !L::any(light.good) {
        return;
    }
    let local = bsdf.local(light.direction);
    let above = zero.lt(points.geometric_normal.dot(light.direction));
    let faces = zero.lt(bsdf.cosine(local));
    // A smooth normal and the true one may disagree about the side: no light leaks through.
    let wrong = differ::<L>(above, faces);
    if L::COUNT == 1 && L::any(wrong) && !L::any(faces) {
        return;
    }
    let value = bsdf.eval(local);
    let scatters = L::or(value.x.ne(zero), L::or(value.y.ne(zero), value.z.ne(zero)));
    let mut seen = L::bits(L::and(light.good, scatters)) & hits.used();
    if lights.has_receivers() {
        seen = linked_lanes(lights, hits, seen, |i| lights.linking(sampled.lights[i]));
    }
    let mut lit = seen & !L::bits(wrong);
    let mut rays = ShadowRayBatch {
        origin: points.offset_origin(light.direction),
        direction: light.direction,
        distance: light.distance,
        target: light.target,
        contribution: V3::splat(Vec3::ZERO),
    };
    let lost = seen & L::bits(L::and(wrong, faces));
    if lost != 0 {
        let found;
        (found, rays.origin) = hits.smooth_starts(context, lost, rays.origin);
        lit |= found;
        turn_to_target(found, points.point, &mut rays);
    }
    if lit == 0 {
        return;
    }
    let mut share = L::splat(1.0);
    let is_met = zero.lt(light.pdf);
    if !last && L::any(is_met) {
        share = L::select(is_met, power_heuristic(light.pdf, bsdf.pdf(local)), share);
    }
    let value = hits.fade(value, light.direction);
    let contribution = states.throughput * (value * light.contribution).scale(share);
    rays.contribution = context.settings.clamps.limited_lanes(states.scatterings + L::splat(1.0), contribution);
    // Those of one light after those of another.
    let (mut left, samples) = (lit, hits.samples());
    while left != 0 {
        let number = sampled.lights[left.trailing_zeros() as usize % LANES];
        let mut same = 0;
        for (i, light) in sampled.lights.iter().enumerate().take(L::COUNT) {
            same |= u32::from(*light == number) << i;
        }
        let bin = context.shadow_queue(shadows.len(), number as usize, || lights.linking(number));
        shadows[bin].compress_store(context, left & same, &rays, &samples, lights.group(number));
        left &= !same;
    }
}

/// Points shadow rays of the lanes that have a bit at their targets, from other starts than the points that light was
/// sampled for.
#[inline(always)]
fn turn_to_target<L: Lanes>(bits: u32, point: V3<L>, rays: &mut ShadowRayBatch<L>) {
    let ends = [point.store(), rays.origin.store(), rays.target.store()];
    let (mut directions, mut distances) = (rays.direction.store(), rays.distance.store());
    turn_each(bits, &ends, &mut directions, &mut distances);
    (rays.direction, rays.distance) = (V3::load(&directions), L::load(&distances));
}

#[cold]
fn turn_each(
    bits: u32,
    [point, origin, target]: &[[[f32; LANES]; 3]; 3],
    directions: &mut [[f32; LANES]; 3],
    distances: &mut [f32; LANES],
) {
    for i in lanes(bits) {
        let along = Ray { origin: lane(origin, i), direction: lane(directions, i), t_max: distances[i] };
        let ray = shadow_ray_from(along.origin, lane(point, i), lane(target, i), along);
        set_lane(directions, i, ray.direction);
        distances[i] = ray.t_max;
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
    /// Where they go.
    pub spawned: SpawnedRays<L>,
    /// What they carry.
    pub states: PathStateLanes<L>,
    /// Where their directions come from.
    pub sample: DirectionSample<L>,
}

impl<L: Lanes> ScatteredRays<L> {
    /// Adds them to a queue.
    #[inline(always)]
    pub fn push(&self, next: &mut RayQueue) {
        let SpawnedRays { origin, direction, going } = self.spawned;
        next.compress_store(going, origin, direction, &self.states);
    }
}

/// The rays that paths go on with at this depth; `None` if none does.
#[inline(always)]
pub fn scatter<L: Lanes, H: ShadedHits<L>, B: BsdfLanes<L>>(
    context: RenderContext,
    hits: &H,
    bsdf: &B,
    depth: u32,
) -> Option<ScatteredRays<L>> {
    let (zero, one, states) = (L::splat(0.0), L::splat(1.0), hits.states());
    let sample = bsdf.sample();
    if L::COUNT == 1 && !L::any(sample.good) {
        return None;
    }
    let mut spawned = sample.spawn_rays(context, hits, L::bits(sample.good) & hits.used());
    let whole = states.throughput * sample.weight;
    let mut throughput = hits.fade(whole, spawned.direction);
    if B::HAS_SPECULAR {
        throughput = V3::select(sample.specular, whole, throughput);
    }
    let worth = bsdf.worth(throughput, &sample);
    spawned.going &= L::bits(zero.lt(worth));
    if L::COUNT == 1 && spawned.going == 0 {
        return None;
    }
    let nodes = hits.onward(RayNode::scattered);
    if depth >= MIN_ROULETTE_DEPTH {
        let doubtful = worth.lt(one);
        let chances = worth.store();
        for i in lanes(spawned.going & L::bits(doubtful)) {
            if hits.random_at(&nodes, i, Domain::Roulette) >= chances[i] {
                spawned.going &= !(1 << i);
            }
        }
        let by = L::select(doubtful, worth, one);
        throughput = V3 { x: throughput.x / by, y: throughput.y / by, z: throughput.z / by };
    }
    let cone = states.cone.scattered(sample.pdf);
    let medium = bsdf.medium(states.medium, &sample);
    let scatterings = states.scatterings + L::select(sample.specular, zero, one);
    let states = PathStateLanes { throughput, pdf: sample.pdf, cone, medium, scatterings, ..states };
    Some(ScatteredRays { spawned, states: hits.at(states, &nodes), sample })
}
