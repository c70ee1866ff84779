//! Shadow rays: what gets through is added to its sample.

use glam::Vec3;

use super::context::RenderContext;
use super::holes::missing;
use super::shadow_ray_queue::{ShadowRay, ShadowRayQueue};
use super::slots::{CatcherRow, slot_sample};
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
    if context.settings.transparent_shadows {
        blocked.clear();
        blocked.resize(rays.len(), true);
    } else {
        accelerator.occluded_all(context.geometry, rays, &mut worker.traversal, blocked);
    }
    // In the order of the wave, whatever order the rays were traced in.
    for (i, blocked) in blocked.iter().enumerate() {
        let ShadowRay { slot, mut contribution } = shadows.get(i);
        if let Some(fog) = context.fog {
            let ray = rays.get(i);
            contribution *= fog.transmittance(ray.origin, ray.direction, ray.t_max);
        }
        let mut share = if *blocked { 0.0 } else { 1.0 };
        if *blocked && context.dims_shadow_rays() {
            let way = (rays.get(i), shadows.target(i));
            share = dimmed((context, accelerator), way, (slot, contribution), colors, worker);
        }
        hits += u64::from(if context.settings.transparent_shadows { share == 0.0 } else { *blocked });
        if share > 0.0 {
            colors[slot as usize] += contribution * share;
        }
    }
    worker.traversal.counters.shadow_hits += hits;
    shadows.clear();
}

/// Share of light that gets along a ray that something stops; what a catcher sees of it in one of its two scenes alone is
/// added there.
fn dimmed(
    (context, accelerator): (RenderContext, &Accelerator),
    (ray, target): (Ray, Vec3),
    (slot, contribution): (u32, Vec3),
    colors: &mut [Vec3],
    worker: &mut Worker,
) -> f32 {
    let sample = slot_sample(slot);
    let mut visible = |leaves_out| visibility((context, accelerator), ray, target, (sample, leaves_out), worker);
    let row = CatcherRow::of(context.catchers, slot);
    if row == CatcherRow::WithoutObjects {
        return visible(true);
    }
    let lets_through = context.settings.transparent_shadows || context.holes;
    let share = if lets_through { visible(false) } else { 0.0 };
    if row != CatcherRow::Both || share == 1.0 {
        return share;
    }
    let without = visible(true);
    if without == share {
        return share;
    }
    colors[CatcherRow::WithObjects.slot(sample) as usize] += contribution * share;
    colors[CatcherRow::WithoutObjects.slot(sample) as usize] += contribution * without;
    0.0
}

/// Share of light that gets along the ray to `target`, dimmed by each transparent surface on its way, and by each that
/// is not wholly there. The second of the pair says whether objects are left out that cast shadows on catchers.
fn visibility(
    (context, accelerator): (RenderContext, &Accelerator),
    mut ray: Ray,
    target: Vec3,
    (sample, leaves_out): (u32, bool),
    worker: &mut Worker,
) -> f32 {
    let mut share = 1.0;
    while let Some(hit) = accelerator.closest(context.geometry, &ray, &mut worker.traversal) {
        let surface = context.geometry.surface_point(&ray, &hit);
        let material = &context.materials[surface.material as usize];
        let through = match context.settings.transparent_shadows {
            _ if leaves_out && !material.stays_without_objects() => 1.0,
            true => material.transmission,
            false => 0.0,
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
