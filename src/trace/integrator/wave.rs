//! One wave after the other: find hits, shade them, trace their shadow rays, go on with the rays they gave rise to.

use glam::Vec3;

use super::{LightSampling, View, path, recursive};
use crate::components::Integrator;
use crate::trace::lights::Light;
use crate::trace::sampler::{Domain, Node, Sampler};
use crate::trace::surfacing::Surfacing;
use crate::trace::{Hit, Ray, Surface, Worker};

/// A ray on its way, and what becomes of the light that it finds.
#[derive(Clone, Copy, Debug)]
pub struct Traveller {
    pub ray: Ray,
    /// Index of its sample in the batch.
    pub sample: u32,
    pub node: Node,
    /// Factor of its light in the colour of the sample.
    pub weight: Vec3,
}

/// Shadow rays towards one light, with what each adds if nothing stands in its way.
#[derive(Debug, Default)]
struct Shadows {
    rays: Vec<Ray>,
    /// Ends of the rays.
    targets: Vec<Vec3>,
    gains: Vec<(u32, Vec3)>,
}

/// Memory of the waves, kept from batch to batch.
#[derive(Debug, Default)]
pub struct Buffers {
    rays: Vec<Ray>,
    wave: Vec<Traveller>,
    next: Vec<Traveller>,
    hits: Vec<Option<Hit>>,
    /// By light.
    shadows: Vec<Shadows>,
    samplers: Vec<Sampler>,
    /// Colour of each sample.
    pub colors: Vec<Vec3>,
}

impl Buffers {
    pub fn begin(&mut self, samples: usize) {
        self.wave.clear();
        self.samplers.clear();
        self.colors.clear();
        self.colors.resize(samples, Vec3::ZERO);
    }

    /// Adds the camera ray of the next sample.
    pub fn start(&mut self, ray: Ray, sampler: Sampler) {
        let sample = self.samplers.len() as u32;
        self.samplers.push(sampler);
        self.wave.push(Traveller { ray, sample, node: Node::CAMERA, weight: Vec3::ONE });
    }
}

/// A ray, the surface that it met, and what the surface is of.
pub struct Encounter<'a> {
    pub by: Traveller,
    /// Faces the ray.
    pub surface: Surface,
    pub material: &'a Surfacing,
    /// Whether the ray comes from the outside.
    pub front: bool,
    pub sampler: Sampler,
}

/// Traces the camera rays in the buffers and all that follow from them.
pub fn trace(view: View, buffers: &mut Buffers, worker: &mut Worker) {
    buffers.shadows.resize_with(view.lights.len(), Shadows::default);
    for depth in 1..=view.settings.max_depth {
        if buffers.wave.is_empty() {
            return;
        }
        find(view, buffers, worker);
        if depth == 1 {
            worker.counters.primary_hits += buffers.hits.iter().flatten().count() as u64;
        }
        shade(view, buffers, depth == view.settings.max_depth, worker);
        for shadows in &mut buffers.shadows {
            settle(view, shadows, &mut buffers.colors, worker);
        }
        std::mem::swap(&mut buffers.wave, &mut buffers.next);
        buffers.next.clear();
    }
}

fn find(view: View, buffers: &mut Buffers, worker: &mut Worker) {
    buffers.rays.clear();
    buffers.rays.extend(buffers.wave.iter().map(|traveller| traveller.ray));
    buffers.hits.clear();
    let hits = &mut buffers.hits;
    view.accelerator.closest_all(view.geometry, &buffers.rays, worker, |_, hit| hits.push(hit));
}

fn shade(view: View, buffers: &mut Buffers, last: bool, worker: &mut Worker) {
    let Buffers { wave, next, hits, shadows, samplers, colors, .. } = buffers;
    for (by, hit) in wave.iter().zip(hits) {
        let Some(hit) = hit else {
            let sky = view.environment.map_or(view.settings.background, |sky| sky.lookup(by.ray.direction));
            colors[by.sample as usize] += by.weight * sky;
            continue;
        };
        let surface = view.geometry.surface(&by.ray, hit);
        let material = &view.materials[surface.material as usize];
        let front = by.ray.direction.dot(surface.geometric_normal) < 0.0;
        let surface = if front { surface } else { surface.flipped() };
        let met = Encounter { by: *by, surface, material, front, sampler: samplers[by.sample as usize] };
        if material.diffuse != Vec3::ZERO || material.specular != Vec3::ZERO {
            for (i, light) in view.lights.iter().enumerate() {
                direct(view, &met, light, Domain::Light(i as u32), &mut shadows[i]);
            }
        }
        if !last {
            match view.settings.integrator {
                Integrator::Path => path::scatter(view, &met, next, &mut worker.counters),
                Integrator::Whitted | Integrator::Distribution => {
                    recursive::spawn(view, &met, next, &mut worker.counters);
                }
            }
        }
    }
}

/// Shadow rays from a surface to a light.
fn direct(view: View, met: &Encounter, light: &Light, domain: Domain, shadows: &mut Shadows) {
    let sampler = &met.sampler;
    let at = match view.settings.light_sampling {
        _ if light.is_point() => [0.5; 2],
        LightSampling::Center => [0.5; 2],
        LightSampling::Fixed(n) => {
            let cell = |i: u32| (i as f32 + 0.5) / n as f32;
            for k in 0..n * n {
                lit(view, met, light, [cell(k % n), cell(k / n)], 1.0 / (n * n) as f32, shadows);
            }
            return;
        }
        LightSampling::Random => sampler.random(met.by.node, domain),
        LightSampling::Jittered => sampler.stratified(met.by.node, domain),
    };
    lit(view, met, light, at, 1.0, shadows);
}

/// Blinn-Phong light from one point of a light, and the ray that tells whether anything stands between.
fn lit(view: View, met: &Encounter, light: &Light, at: [f32; 2], share: f32, shadows: &mut Shadows) {
    let Encounter { by, surface, material, .. } = met;
    let target = light.point(at);
    let to_light = target - surface.point;
    let distance = to_light.length();
    if distance == 0.0 {
        return;
    }
    let direction = to_light / distance;
    let cosine = surface.shading_normal.dot(direction);
    if cosine <= 0.0 || surface.geometric_normal.dot(direction) <= 0.0 {
        return;
    }
    let mut color = material.diffuse * cosine;
    if material.specular != Vec3::ZERO {
        let half = (direction - by.ray.direction).normalize_or_zero();
        let base = half.dot(surface.shading_normal).max(0.0);
        color += material.specular * libm::powf(base, material.shininess);
    }
    let mut strength = if light.inverse_square { share / (distance * distance) } else { share };
    if view.settings.integrator == Integrator::Path && light.inverse_square && !light.is_point() {
        // A path tracer's area light is a Lambertian emitter.
        strength *= light.normal().dot(direction).abs();
    }
    let from = surface.leave(direction);
    let offset = target - from;
    let t_max = offset.length();
    let ray = Ray { origin: from, direction: if t_max > 0.0 { offset / t_max } else { direction }, t_max };
    shadows.rays.push(ray);
    shadows.targets.push(target);
    shadows.gains.push((by.sample, by.weight * (color * light.color * strength)));
}

/// Traces the shadow rays towards a light and adds what gets through.
fn settle(view: View, shadows: &mut Shadows, colors: &mut [Vec3], worker: &mut Worker) {
    let Shadows { rays, targets, gains } = shadows;
    worker.counters.shadow_rays += rays.len() as u64;
    let mut hits = 0;
    if view.settings.transparent_shadows {
        for ((ray, target), (sample, gain)) in rays.iter().zip(&*targets).zip(&*gains) {
            let share = visibility(view, *ray, *target, worker);
            hits += u64::from(share == 0.0);
            colors[*sample as usize] += *gain * share;
        }
    } else {
        view.accelerator.occluded_all(view.geometry, rays, worker, |i, blocked| {
            hits += u64::from(blocked);
            if !blocked {
                let (sample, gain) = gains[i];
                colors[sample as usize] += gain;
            }
        });
    }
    worker.counters.shadow_hits += hits;
    rays.clear();
    targets.clear();
    gains.clear();
}

/// Share of light that gets along the ray to `target`, dimmed by each transparent surface on its way.
fn visibility(view: View, mut ray: Ray, target: Vec3, worker: &mut Worker) -> f32 {
    let mut share = 1.0;
    while let Some(hit) = view.accelerator.closest(view.geometry, &ray, worker) {
        let surface = view.geometry.surface(&ray, &hit);
        share *= view.materials[surface.material as usize].transmission;
        let origin = surface.leave(ray.direction);
        let rest = (target - origin).dot(ray.direction);
        // A ray that does not get ahead has reached the light, as far as `f32` can tell.
        if share == 0.0 || rest <= 0.0 || rest >= ray.t_max {
            break;
        }
        ray = Ray { origin, t_max: rest, ..ray };
    }
    share
}
