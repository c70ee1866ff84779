//! Light in fog: what it takes of a ray, and what it adds.
//!
//! On paths every way through fog is asked for the light that lamps send into it, at one point of it: where fog scatters
//! most of what is left of the ray, or where the way passes the lamp (equi-angular sampling, Kulla and Fajardo 2012), as
//! chance decides; the two are weighed by their mixed density. Beside that a path may be scattered before it comes to a
//! surface (distance sampling): its ray then looks for the light of surfaces and of what cannot be sampled, for samples
//! have told the rest.

use glam::Vec3;

use crate::trace::counters::Counters;
use crate::trace::material::FogMedium;
use crate::trace::sampler::{Domain, Sampler};
use crate::trace::soa::Ray;
use crate::trace::wavefront::{
    MIN_ROULETTE_DEPTH, PathState, RayQueue, RenderContext, ShadowRayQueue, accumulator_slot,
};

/// Below this share of the length of a way a lamp is taken to lie on it.
const LEAST_APART: f32 = 1e-5;

/// What a ray runs through.
#[derive(Clone, Copy)]
pub struct FogWay<'a> {
    pub fog: &'a FogMedium,
    pub ray: Ray,
    /// Where it enters the fog, and where it leaves it.
    pub span: [f32; 2],
}

impl<'a> FogWay<'a> {
    /// Of a ray that ends at `end`; `None` if it does not run in the fog.
    pub fn new(fog: &'a FogMedium, ray: &Ray, end: f32) -> Option<Self> {
        let span = fog.span(ray.origin, ray.direction, end);
        (span[0] < span[1]).then_some(FogWay { fog, ray: *ray, span })
    }

    /// Share of light that gets through.
    pub fn transmittance(&self) -> f32 {
        self.fog.through(self.span[1] - self.span[0])
    }

    /// A distance on the way, by what the fog takes there, and by how it sees a point if there is one: with the density.
    fn distance(&self, lamp: Option<Vec3>, [choice, place]: [f32; 2]) -> (f32, f32) {
        let (density, [enter, leave]) = (self.fog.density, self.span);
        let taken = 1.0 - self.transmittance();
        let by_fog = |t: f32| density * self.fog.through(t - enter) / taken;
        let at_fog = |u: f32| (enter - libm::logf(1.0 - u * taken) / density).clamp(enter, leave.min(f32::MAX));
        let Some(angles) = lamp.and_then(|lamp| Angles::new(self, lamp)) else {
            let t = at_fog(place);
            return (t, by_fog(t));
        };
        let t = if choice < 0.5 { angles.distance(place).clamp(enter, leave) } else { at_fog(place) };
        (t, 0.5 * (by_fog(t) + angles.density(t)))
    }

    /// Asks a light for what it sends into the fog on the way.
    pub fn sample_direct(
        &self,
        context: RenderContext,
        state: &PathState,
        sampler: &Sampler,
        shadows: &mut [ShadowRayQueue],
    ) {
        let (lights, node) = (context.lights, state.node);
        if shadows.is_empty() || self.fog.color == Vec3::ZERO {
            return;
        }
        let Some(way) = lights.pick_for_way(sampler.extra(node, Domain::InScatter)) else { return };
        let at = sampler.stratified(node, Domain::InScatterLight);
        let (t, density) = self.distance(lights.point_for_way(way, at), sampler.stratified(node, Domain::InScatter));
        let point = self.ray.origin + self.ray.direction * t;
        let Some(light) = lights.sample_for_way(way, point, at) else { return };
        let left = self.fog.density * self.fog.through(t - self.span[0]);
        let phase = self.fog.phase(self.ray.direction.dot(light.direction));
        let contribution = state.throughput * self.fog.color * light.contribution * (left * phase / density);
        if !(contribution.max_element() > 0.0 && contribution.is_finite()) {
            return;
        }
        let contribution = context.settings.clamps.limited(state.scatterings + 1.0, contribution);
        let queue = context.shadow_queue(shadows.len(), light.light as usize, || lights.linking(light.light));
        let ray = Ray { origin: point, direction: light.direction, t_max: light.distance };
        let slot = accumulator_slot(state.sample, lights.group(light.light));
        shadows[queue].push(context, ray, light.target, slot, contribution);
    }

    /// Whether the fog scatters a path before the end of its way; the ray that it goes on with is added, if one is.
    pub fn scatters(
        &self,
        (depth, last): (u32, bool),
        state: &PathState,
        sampler: &Sampler,
        next: &mut RayQueue,
        counters: &mut Counters,
    ) -> bool {
        let u = sampler.extra(state.node, Domain::FreeFlight);
        let t = self.span[0] - libm::logf(1.0 - u) / self.fog.density;
        if t >= self.span[1] {
            return false;
        }
        let node = state.node.scattered();
        let mut throughput = state.throughput * self.fog.color;
        let worth = throughput.max_element();
        if last || worth <= 0.0 {
            return true;
        }
        if depth >= MIN_ROULETTE_DEPTH && worth < 1.0 {
            if sampler.random(node, Domain::Roulette)[0] >= worth {
                return true;
            }
            throughput /= worth;
        }
        let direction = self.fog.scattered(self.ray.direction, sampler.stratified(state.node, Domain::FreeFlight));
        let mut state = PathState {
            node,
            throughput,
            cone: state.cone.at(t),
            // As little as can be: whatever is sampled counts in full there, and not here.
            pdf: f32::MIN_POSITIVE,
            scatterings: state.scatterings + 1.0,
            ..*state
        };
        state.cone = state.scattered_cone(state.pdf);
        state.scope.receiver = None;
        counters.diffuse_rays += 1;
        next.push(Ray::new(self.ray.origin + self.ray.direction * t, direction), state);
        true
    }
}

/// A way as it is seen from a point beside it.
struct Angles {
    /// Where on the way it is nearest to the point, and how far that is.
    nearest: f32,
    apart: f32,
    from: f32,
    to: f32,
}

impl Angles {
    fn new(way: &FogWay, point: Vec3) -> Option<Angles> {
        let offset = point - way.ray.origin;
        let nearest = offset.dot(way.ray.direction);
        let apart = (offset - way.ray.direction * nearest).length();
        if apart <= LEAST_APART * (1.0 + nearest.abs()) {
            return None;
        }
        let angle = |t: f32| libm::atanf((t - nearest) / apart);
        let (from, to) = (angle(way.span[0]), angle(way.span[1]));
        (from < to).then_some(Angles { nearest, apart, from, to })
    }

    fn distance(&self, u: f32) -> f32 {
        self.nearest + self.apart * libm::tanf(self.from + (self.to - self.from) * u)
    }

    fn density(&self, t: f32) -> f32 {
        let beyond = t - self.nearest;
        self.apart / ((self.to - self.from) * (self.apart * self.apart + beyond * beyond))
    }
}
