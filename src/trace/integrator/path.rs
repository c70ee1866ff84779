//! Path tracing: every hit goes on in one direction (Kajiya 1986), and asks one light for its light on the way.
//!
//! Light that a ray meets by itself and light that was asked for are one and the same; each is weighed by how well its
//! way of sampling finds it (multiple importance sampling, Veach 1997). Surfaces that single rays alone find (mirrors,
//! polished glass) leave lights to the rays. Paths end by chance where little is left of their light, which keeps the
//! mean (Russian roulette), and at `max_depth` rays, the camera's being the first; the last surface asks for light with
//! its full weight, since no ray follows that could meet it.

use glam::Vec3;

use super::View;
use super::errand::{CLEAR, Errand, Shadows, Wave, place};
use super::wave::{Encounter, found};
use crate::trace::bsdf::{Bsdf, Frame, Transport};
use crate::trace::lights::Lights;
use crate::trace::sampler::Domain;
use crate::trace::{Counters, Ray};

/// Rays that every path may have before chance decides about it.
pub const SAFE_DEPTH: u32 = 3;

/// Adds the light of lamps that a ray crosses on its way to its end; they do not stop it.
#[inline]
pub fn cross_lamps(view: View, ray: &Ray, end: f32, errand: &Errand, camera: bool, colors: &mut [Vec3]) {
    view.lights.crossed(&Ray { t_max: end, ..*ray }, camera, |radiance, distance, asked, pass| {
        let mut weight = errand.weight * found(errand.pdf, asked);
        if errand.medium != CLEAR {
            weight *= view.materials[errand.medium as usize].left_after(distance);
        }
        colors[place(errand.sample, pass) as usize] += weight * radiance;
    });
}

/// Asks a light, and adds the ray that the path goes on with, if it does.
pub fn shade(
    view: View,
    met: &Encounter,
    depth: u32,
    shadows: &mut [Shadows],
    next: &mut Wave,
    counters: &mut Counters,
) {
    let bsdf = Bsdf::new(met.material, met.front, view.settings.fresnel, Transport::Radiance);
    let (frame, wo) = met.frame();
    let last = depth == view.settings.max_depth;
    if !bsdf.is_specular() && !shadows.is_empty() {
        ask(view, view.lights, met, &Seen { bsdf, frame, wo, last }, shadows);
    }
    if !last && let Some((ray, errand)) = scatter(met, &bsdf, &frame, wo, depth, counters) {
        next.push(ray, errand);
    }
}

/// A surface as a path sees it.
pub struct Seen {
    pub bsdf: Bsdf,
    pub frame: Frame,
    pub wo: Vec3,
    /// Whether no ray follows.
    pub last: bool,
}

/// Asks one of the lights whether it reaches the surface.
#[inline]
pub fn ask(view: View, lights: &Lights, met: &Encounter, seen: &Seen, shadows: &mut [Shadows]) {
    let Seen { bsdf, frame, wo, last } = seen;
    let (wo, last) = (*wo, *last);
    let Encounter { errand, surface, sampler, .. } = met;
    let domain = Domain::Light(0);
    let pick = if lights.len() > 1 { sampler.extra(errand.node, domain) } else { 0.0 };
    let Some(light) = lights.sample(surface.point, pick, sampler.stratified(errand.node, domain)) else { return };
    let wi = frame.to_local(light.direction);
    let above = surface.geometric_normal.dot(light.direction) > 0.0;
    // A smooth normal and the true one may disagree about the side: no light leaks through.
    if above != (wi.z > 0.0) {
        return;
    }
    let value = bsdf.eval(wo, wi);
    if value == Vec3::ZERO {
        return;
    }
    let share = if light.pdf > 0.0 && !last { found(light.pdf, bsdf.pdf(wo, wi)) } else { 1.0 };
    let value = value * surface.terminator(light.direction);
    let ray = Ray { origin: surface.leave(light.direction), direction: light.direction, t_max: light.distance };
    let bin = light.light as usize % shadows.len();
    let sample = place(errand.sample, lights.pass(light.light));
    shadows[bin].push(view, ray, light.target, sample, errand.weight * (value * light.gain * share));
}

/// The ray that a path goes on with, if it does.
#[inline]
pub fn scatter(
    met: &Encounter,
    bsdf: &Bsdf,
    frame: &Frame,
    wo: Vec3,
    depth: u32,
    counters: &mut Counters,
) -> Option<(Ray, Errand)> {
    let Encounter { errand, surface, material, sampler, front, .. } = met;
    let node = errand.node.scattered();
    let lobe = if let Bsdf::Lambert(_) = bsdf { 0.0 } else { sampler.extra(errand.node, Domain::Lobe) };
    let sampled = bsdf.sample(wo, sampler.stratified(errand.node, Domain::Bounce), lobe)?;
    let mut direction = frame.to_world(sampled.wi).normalize();
    let height = surface.geometric_normal.dot(direction);
    if (height < 0.0) != sampled.transmitted {
        if !sampled.specular {
            return None;
        }
        // A mirror's ray that a smooth normal sends to the wrong side is brought back.
        direction -= surface.geometric_normal * (2.0 * height);
    }
    let shown = if sampled.specular { 1.0 } else { surface.terminator(direction) };
    let mut weight = errand.weight * sampled.weight * shown;
    // What radiance loses on its way into glass it gets back on its way out: no reason to end a path.
    let inside = sampled.transmitted == *front && material.transmission > 0.0;
    let worth = weight.max_element() * if inside { (material.ior * material.ior).max(1.0) } else { 1.0 };
    if worth.is_nan() || worth <= 0.0 {
        return None;
    }
    if depth >= SAFE_DEPTH && worth < 1.0 {
        if sampler.random(node, Domain::Roulette)[0] >= worth {
            return None;
        }
        weight /= worth;
    }
    let medium = if sampled.transmitted { met.medium_behind() } else { errand.medium };
    if sampled.transmitted {
        counters.refraction_rays += 1;
    } else if sampled.specular {
        counters.reflection_rays += 1;
    } else {
        counters.diffuse_rays += 1;
    }
    let ray = Ray::new(surface.leave(direction), direction);
    Some((ray, Errand { node, weight, pdf: sampled.pdf, medium, cone: errand.scattered_cone(sampled.pdf), ..*errand }))
}
