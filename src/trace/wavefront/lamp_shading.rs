//! Light of lamps and mirrors in Whitted and distribution pictures, written once: for one hit of any material, or for
//! eight Blinn-Phong surfaces side by side.

use std::marker::PhantomData;

use glam::Vec3;

use super::context::{LightSampling, RenderContext};
use super::path_state::{PathStateLanes, RayConeLanes};
use super::ray_queue::RayQueue;
use super::shaded_hits::{ShadedHits, linked_lanes};
use super::shadow_ray_queue::{ShadowRayBatch, ShadowRayQueue};
use crate::components::Model;
use crate::trace::counters::Counters;
use crate::trace::light::Lamp;
use crate::trace::sampler::{Domain, RayNode};
use crate::trace::simd::{LANES, Lanes, V3, lanes, set_lane};

/// What surfaces make of the light of lamps. Everything in it is to be marked `#[inline(always)]`.
pub trait LampShading<L: Lanes> {
    /// Whether lamps behind a surface light it too.
    fn lets_through(&self) -> bool;
    /// What the lanes that have a bit show of white light from these directions, whose cosines to the normal these are.
    fn color(&self, which: u32, direction: V3<L>, cosine: L) -> V3<L>;
}

/// Adds shadow rays to a lamp from the lanes that have a bit.
#[inline(always)]
pub fn sample_lamp<L: Lanes, H: ShadedHits<L>, S: LampShading<L>>(
    context: RenderContext,
    (hits, shading): (&H, &S),
    mut which: u32,
    (lamp, number): (&Lamp, usize),
    shadows: &mut [ShadowRayQueue],
) {
    if lamp.linking.unlit != 0 {
        which = linked_lanes(context.lights, hits, which, |_| lamp.linking);
        if which == 0 {
            return;
        }
    }
    let shadows = &mut shadows[context.shadow_queue(shadows.len(), number, || lamp.linking)];
    let (domain, center) = (Domain::Light(number as u32), [L::splat(0.5); 2]);
    let at = match context.settings.light_sampling {
        _ if lamp.is_point() => center,
        LightSampling::Center => center,
        LightSampling::Fixed(n) => {
            let cell = |i: u32| L::splat((i as f32 + 0.5) / n as f32);
            for k in 0..n * n {
                let at = [cell(k % n), cell(k / n)];
                add_lamp_light(context, (hits, shading), which, lamp, at, 1.0 / (n * n) as f32, shadows);
            }
            return;
        }
        LightSampling::Random => hits.random(domain),
        LightSampling::Jittered => hits.stratified(domain),
    };
    add_lamp_light(context, (hits, shading), which, lamp, at, 1.0, shadows);
}

/// Light from one point of a lamp, and the rays that tell whether anything stands between.
#[inline(always)]
fn add_lamp_light<L: Lanes, H: ShadedHits<L>, S: LampShading<L>>(
    context: RenderContext,
    (hits, shading): (&H, &S),
    which: u32,
    lamp: &Lamp,
    at: [L; 2],
    share: f32,
    shadows: &mut ShadowRayQueue,
) {
    let (zero, points, states) = (L::splat(0.0), hits.points(), hits.states());
    let target = lamp.targets(points.point, at);
    let way = target - points.point;
    let height = points.geometric_normal.dot(way);
    let (above, below, through) = (zero.lt(height), height.le(zero), shading.lets_through());
    let mut side = points.geometric_normal;
    if through {
        side = V3::select(above, side, -side);
    }
    let mut origin = points.offset_origin(side);
    let mut ahead = L::bits(above) & which;
    if !through {
        // Only the smooth normal may face it.
        let lost = L::bits(L::and(below, zero.lt(points.shading_normal.dot(way)))) & which;
        if lost != 0 {
            let found;
            (found, origin) = hits.smooth_starts(context, lost, origin);
            ahead |= found;
        }
        if L::COUNT == 1 && ahead == 0 {
            return;
        }
    }
    let offset = target - origin;
    let square = offset.dot(offset);
    let distance = square.sqrt();
    let direction = offset.scale(L::splat(1.0) / distance);
    // Not so where the light touches the surface either: the distance is 0, and the cosine no number.
    let cosine = points.shading_normal.dot(direction);
    let mut lit = L::bits(zero.lt(cosine)) & ahead;
    if through {
        lit |= L::bits(L::and(below, cosine.lt(zero))) & which;
    }
    if lit == 0 {
        return;
    }
    let color = hits.fade(shading.color(lit, direction, cosine), direction);
    let strength = if lamp.inverse_square { L::splat(share) / square } else { L::splat(share) };
    let strength = strength * lamp.cone.shares(direction);
    let contribution = states.throughput * (color * V3::splat(lamp.color)).scale(strength);
    let contribution = context.settings.clamps.limited_lanes(states.scatterings + L::splat(1.0), contribution);
    let rays = ShadowRayBatch { origin, direction, distance, target, contribution };
    shadows.compress_store(context, lit, &rays, &hits.samples(), lamp.group);
}

/// Lambert's law with Blinn's highlights.
pub struct BlinnPhongShading<'a, L, H> {
    hits: &'a H,
    lanes: PhantomData<L>,
}

impl<'a, L: Lanes, H: ShadedHits<L>> BlinnPhongShading<'a, L, H> {
    /// Of these hits, each with its material.
    #[inline(always)]
    pub fn new(hits: &'a H) -> Self {
        BlinnPhongShading { hits, lanes: PhantomData }
    }

    /// Highlights, if any of the surfaces has one.
    #[inline(always)]
    fn highlights(&self, which: u32, direction: V3<L>) -> Option<V3<L>> {
        let material = |i: usize| self.hits.material(i);
        let shiny = |i: &usize| material(*i).model != Model::Lambert && material(*i).specular != Vec3::ZERO;
        lanes(which).find(shiny)?;
        let half = (direction - self.hits.direction()).normalize_or(V3::splat(Vec3::ZERO));
        let base = half.dot(self.hits.points().shading_normal).max(L::splat(0.0)).store();
        let mut shine = [[0.0; LANES]; 3];
        for i in lanes(which).filter(shiny) {
            set_lane(&mut shine, i, material(i).specular * libm::powf(base[i], material(i).shininess));
        }
        Some(V3::load(&shine))
    }
}

impl<L: Lanes, H: ShadedHits<L>> LampShading<L> for BlinnPhongShading<'_, L, H> {
    #[inline(always)]
    fn lets_through(&self) -> bool {
        false
    }
    #[inline(always)]
    fn color(&self, which: u32, direction: V3<L>, cosine: L) -> V3<L> {
        let color = self.hits.diffuse().scale(cosine);
        match self.highlights(which, direction) {
            Some(shine) => color + shine,
            None => color,
        }
    }
}

/// Where mirrors show things from.
#[inline(always)]
pub fn mirror_directions<L: Lanes, H: ShadedHits<L>>(hits: &H) -> V3<L> {
    let (direction, normal) = (hits.direction(), hits.points().shading_normal);
    direction - normal.scale(L::splat(2.0) * direction.dot(normal))
}

/// Adds the rays that show what the mirrors show that have a bit, but those that stand for too little of the picture to be
/// followed.
#[inline(always)]
pub fn push_mirrored<L: Lanes, H: ShadedHits<L>>(
    context: RenderContext,
    hits: &H,
    mut which: u32,
    (mut direction, cone): (V3<L>, RayConeLanes<L>),
    weight: V3<L>,
    (next, counters): (&mut RayQueue, &mut Counters),
) {
    let (points, states) = (hits.points(), hits.states());
    let throughput = states.throughput * weight;
    if context.settings.min_weight > 0.0 {
        which &= L::bits(L::splat(context.settings.min_weight).le(throughput.max_element()));
    }
    if which == 0 {
        return;
    }
    counters.reflection_rays += u64::from(which.count_ones());
    // Smooth normals and gloss may send the ray below the surface: mirror it back up.
    let height = direction.dot(points.geometric_normal);
    let risen = direction - points.geometric_normal.scale(L::splat(2.0) * height);
    direction = V3::select(height.lt(L::splat(0.0)), risen, direction);
    let states = PathStateLanes { throughput, pdf: L::splat(0.0), cone, ..states };
    let states = hits.at(states, &hits.onward(RayNode::reflected));
    next.compress_store(which, points.offset_origin(direction), direction, &states);
}
