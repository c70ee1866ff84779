//! Path tracing: every hit goes on in one direction (Kajiya 1986), and asks all lights for their light on the way.
//!
//! A surface scatters as Lambert's law has it, as a mirror, or as glass; which of these a path takes is drawn in
//! proportion to their weights. Highlights are those of the lights only. An area light with inverse square falloff is a
//! Lambertian emitter whose `color` is what arrives at distance 1 straight before it: radiance times area over pi.

use glam::Vec3;

use super::View;
use super::recursive::{division, mirrored, transmitted};
use super::wave::{Encounter, Errand, Wave};
use crate::trace::sampler::{Domain, concentric_disk};
use crate::trace::{Counters, Ray};

/// Adds the ray that the path goes on with, if it does.
pub fn scatter(view: View, met: &Encounter, next: &mut Wave, counters: &mut Counters) {
    let material = met.material;
    let node = met.errand.node;
    if material.transmission > 0.0 {
        let (refracted, reflected, through) = division(view, met);
        let color = material.mirror_color * reflected;
        let chance = reflected / (reflected + through);
        if refracted.is_none() || met.sampler.extra(node, Domain::Lobe) < chance {
            counters.reflection_rays += 1;
            mirrored(view, met, color / chance, next);
        } else if let Some(direction) = refracted {
            counters.refraction_rays += 1;
            transmitted(met, direction, Vec3::splat(through / (1.0 - chance)), next);
        }
        return;
    }
    let mirror = material.mirror_color * material.reflection;
    let (shiny, matt) = (mirror.max_element(), material.diffuse.max_element());
    if shiny <= 0.0 && matt <= 0.0 {
        return;
    }
    let chance = shiny / (shiny + matt);
    if matt <= 0.0 || (shiny > 0.0 && met.sampler.extra(node, Domain::Lobe) < chance) {
        counters.reflection_rays += 1;
        mirrored(view, met, mirror / chance, next);
    } else {
        counters.diffuse_rays += 1;
        diffuse(met, material.diffuse / (1.0 - chance), next);
    }
}

/// How much wider the cones of rays get that a diffuse surface scatters, in radians: far less than they are apart, so
/// that what they find of a texture stays true to its place.
const DIFFUSE_SPREAD: f32 = 0.1;

/// Adds a ray by the cosine around the normal: the cosine and the density cancel.
fn diffuse(met: &Encounter, weight: Vec3, next: &mut Wave) {
    let Encounter { errand, surface, .. } = met;
    let node = errand.node.scattered();
    let [x, y] = concentric_disk(met.sampler.stratified(node, Domain::Bounce));
    let z = (1.0 - x * x - y * y).max(0.0).sqrt();
    let normal = surface.shading_normal;
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let direction = (tangent * x + bitangent * y + normal * z).normalize();
    // Below the surface nothing arrives.
    if direction.dot(surface.geometric_normal) <= 0.0 {
        return;
    }
    let ray = Ray::new(surface.leave(direction), direction);
    let weight = errand.weight * weight * surface.terminator(direction);
    let cone = errand.cone.widened(DIFFUSE_SPREAD);
    next.push(ray, Errand { sample: errand.sample, node, weight, cone });
}
