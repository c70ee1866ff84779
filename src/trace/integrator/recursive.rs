//! Whitted and distribution ray tracing: every mirror is followed, and at glass both ways.

use glam::Vec3;

use super::View;
use super::wave::{Encounter, Errand, Wave};
use crate::components::Fresnel;
use crate::trace::sampler::Domain;
use crate::trace::surfacing::{fresnel, reflect, refract};
use crate::trace::{Counters, Ray};

/// Adds the rays that a hit gives rise to.
pub fn spawn(view: View, met: &Encounter, next: &mut Wave, counters: &mut Counters) {
    let material = met.material;
    if material.transmission > 0.0 {
        dielectric(view, met, next, counters);
    } else if material.reflection > 0.0 {
        counters.reflection_rays += 1;
        mirrored(view, met, material.mirror_color * material.reflection, next);
    }
}

/// Adds the ray that shows what a mirror shows.
pub fn mirrored(view: View, met: &Encounter, weight: Vec3, next: &mut Wave) {
    let Encounter { errand, surface, material, .. } = met;
    let node = errand.node.reflected();
    let mut direction = reflect(met.direction, surface.shading_normal);
    let mut cone = errand.cone;
    if material.gloss > 0.0 && view.settings.gloss {
        cone = cone.widened(material.gloss);
        let square = met.sampler.stratified(node, Domain::Gloss);
        let radius = libm::cbrtf(met.sampler.extra(node, Domain::Gloss));
        direction = (direction + sphere_point(square) * (material.gloss * radius)).normalize_or(direction);
    }
    // Smooth normals and gloss may send the ray below the surface: mirror it back up.
    let height = direction.dot(surface.geometric_normal);
    if height < 0.0 {
        direction -= surface.geometric_normal * (2.0 * height);
    }
    let ray = Ray::new(surface.leave(direction), direction);
    next.push(ray, Errand { sample: errand.sample, node, weight: errand.weight * weight, cone });
}

/// Adds the ray that goes through the surface in the refracted direction.
pub fn transmitted(met: &Encounter, mut direction: Vec3, weight: Vec3, next: &mut Wave) {
    let Encounter { errand, surface, .. } = met;
    // A smooth normal may bend the ray back out: keep it on the far side.
    let height = direction.dot(surface.geometric_normal);
    if height > 0.0 {
        direction -= surface.geometric_normal * (2.0 * height);
    }
    let ray = Ray::new(surface.leave(direction), direction);
    let node = errand.node.refracted();
    next.push(ray, Errand { sample: errand.sample, node, weight: errand.weight * weight, cone: errand.cone });
}

/// How a transparent surface divides light: the refracted direction, and weights of reflection and refraction.
pub fn division(view: View, met: &Encounter) -> (Option<Vec3>, f32, f32) {
    let (direction, material) = (met.direction, met.material);
    let eta = if met.front { 1.0 / material.ior } else { material.ior };
    let normal = met.surface.shading_normal;
    let refracted = refract(direction, normal, eta);
    let model = view.settings.fresnel;
    match refracted {
        None if model == Fresnel::Off => (None, (material.reflection + material.transmission).min(1.0), 0.0),
        None => (None, 1.0, 0.0),
        Some(_) if model == Fresnel::Off => (refracted, material.reflection, material.transmission),
        Some(_) => {
            let share = fresnel(model, -direction.dot(normal), eta);
            (refracted, share, (1.0 - share) * material.transmission)
        }
    }
}

fn dielectric(view: View, met: &Encounter, next: &mut Wave, counters: &mut Counters) {
    let (refracted, reflected, through) = division(view, met);
    if reflected > 0.0 {
        counters.reflection_rays += 1;
        mirrored(view, met, met.material.mirror_color * reflected, next);
    }
    if let Some(direction) = refracted {
        counters.refraction_rays += 1;
        transmitted(met, direction, Vec3::splat(through), next);
    }
}

/// Uniform point on the unit sphere.
fn sphere_point([x, y]: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = libm::sincosf(std::f32::consts::TAU * y);
    Vec3::new(r * cos, r * sin, z)
}
