//! Shadow rays: what gets through is added to its sample.

use glam::Vec3;

use super::context::RenderContext;
use super::holes::missing;
use super::shadow_ray_queue::{ShadowRay, ShadowRayQueue, slot_sample};
use super::worker::Worker;
use crate::trace::accel::Accelerator;
use crate::trace::soa::Ray;

/// Traces the shadow rays towards a light and adds what gets through; the accelerator finds what throws shadows in it.
pub fn trace_shadow_rays(
    (context, accelerator): (RenderContext, &Accelerator),
    shadows: &mut ShadowRayQueue,
    blocked: &mut Vec<bool>,
    colors: &mut [Vec3],
    worker: &mut Worker,
) {
    let rays = &shadows.rays;
    worker.traversal.counters.shadow_rays += rays.len() as u64;
    if let Some(regions) = context.regions {
        let rays = rays.iter().enumerate().map(|(i, ray)| (ray, slot_sample(shadows.get(i).slot), ray.t_max));
        worker.footprint.add(regions, rays);
    }
    let mut hits = 0;
    let in_fog = |ray: &Ray, contribution: Vec3| {
        contribution * context.fog.map_or(1.0, |fog| fog.transmittance(ray.origin, ray.direction, ray.t_max))
    };
    if context.settings.transparent_shadows {
        for (i, ray) in rays.iter().enumerate() {
            let ShadowRay { slot, contribution } = shadows.get(i);
            let share = visibility((context, accelerator), ray, shadows.target(i), slot_sample(slot), worker);
            hits += u64::from(share == 0.0);
            colors[slot as usize] += in_fog(&ray, contribution) * share;
        }
    } else {
        accelerator.occluded_all(context.geometry, rays, &mut worker.traversal, blocked);
        // In the order of the wave, whatever order the rays were traced in.
        for (i, blocked) in blocked.iter().enumerate() {
            hits += u64::from(*blocked);
            if !blocked {
                let ShadowRay { slot, contribution } = shadows.get(i);
                colors[slot as usize] +=
                    if context.fog.is_some() { in_fog(&rays.get(i), contribution) } else { contribution };
            } else if context.holes {
                let ShadowRay { slot, contribution } = shadows.get(i);
                let share =
                    visibility((context, accelerator), rays.get(i), shadows.target(i), slot_sample(slot), worker);
                colors[slot as usize] += in_fog(&rays.get(i), contribution) * share;
            }
        }
    }
    worker.traversal.counters.shadow_hits += hits;
    shadows.clear();
}

/// Share of light that gets along the ray to `target`, dimmed by each transparent surface on its way, and by each that
/// is not wholly there.
fn visibility(
    (context, accelerator): (RenderContext, &Accelerator),
    mut ray: Ray,
    target: Vec3,
    sample: u32,
    worker: &mut Worker,
) -> f32 {
    let mut share = 1.0;
    while let Some(hit) = accelerator.closest(context.geometry, &ray, &mut worker.traversal) {
        let surface = context.geometry.surface_point(&ray, &hit);
        let through = if context.settings.transparent_shadows {
            context.materials[surface.material as usize].transmission
        } else {
            0.0
        };
        let missing = missing(context, &ray, &hit, &surface);
        share *= missing + (1.0 - missing) * through;
        let origin = surface.offset_origin(ray.direction);
        let rest = (target - origin).dot(ray.direction);
        // A ray that does not get ahead has reached the light, as far as `f32` can tell.
        if share == 0.0 || rest <= 0.0 || rest >= ray.t_max {
            break;
        }
        ray = Ray { origin, t_max: rest, ..ray };
        if let Some(regions) = context.regions {
            worker.footprint.add(regions, std::iter::once((ray, sample, rest)));
        }
    }
    share
}
