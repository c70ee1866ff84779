//! One wave after the other: find hits, shade them, trace their shadow rays, go on with the rays they gave rise to.

use glam::Vec3;

use super::{LightSampling, View, feature, path, recursive};
use crate::components::Integrator;
use crate::film::Feature;
use crate::trace::lights::Light;
use crate::trace::sampler::{Domain, Node, Sampler};
use crate::trace::surfacing::Surfacing;
use crate::trace::texture::Cone;
use crate::trace::{Hit, Ray, Surface, Worker};

/// What becomes of the light that a ray finds.
#[derive(Clone, Copy, Debug)]
pub struct Errand {
    pub node: Node,
    /// Index of its sample in the batch.
    pub sample: u32,
    /// Factor of its light in the colour of the sample.
    pub weight: Vec3,
    /// Of the ray where it starts; in an [`Encounter`] where it ends.
    pub cone: Cone,
}

/// Rays on their way, and their errands.
#[derive(Debug, Default)]
pub struct Wave {
    rays: Vec<Ray>,
    errands: Vec<Errand>,
}

impl Wave {
    #[inline]
    pub fn push(&mut self, ray: Ray, errand: Errand) {
        self.rays.push(ray);
        self.errands.push(errand);
    }

    fn clear(&mut self) {
        self.rays.clear();
        self.errands.clear();
    }
}

/// Shadow rays towards one light, with what each adds if nothing stands in its way.
#[derive(Debug, Default)]
struct Shadows {
    rays: Vec<Ray>,
    /// Ends of the rays, where transparent surfaces do not stop them.
    targets: Vec<Vec3>,
    gains: Vec<(u32, Vec3)>,
}

/// A sample's part in its pixel.
#[derive(Clone, Copy, Debug)]
pub struct Lot {
    pub weight: f32,
    /// Square of its distance from the pixel's centre.
    pub off_center: f32,
}

/// Memory of the waves, kept from batch to batch.
#[derive(Debug, Default)]
pub struct Buffers {
    wave: Wave,
    next: Wave,
    hits: Vec<Option<Hit>>,
    blocked: Vec<bool>,
    /// By light.
    shadows: Vec<Shadows>,
    samplers: Vec<Sampler>,
    /// Colour of each sample.
    pub colors: Vec<Vec3>,
    /// Where each sample lies in its pixel.
    pub lots: Vec<Lot>,
    /// What the camera ray of each sample met; empty unless the film wants it.
    pub features: Vec<Option<Feature>>,
}

impl Buffers {
    pub fn begin(&mut self, samples: usize, features: bool) {
        self.wave.clear();
        self.samplers.clear();
        self.lots.clear();
        self.features.clear();
        self.features.resize(if features { samples } else { 0 }, None);
        self.colors.clear();
        self.colors.resize(samples, Vec3::ZERO);
    }

    /// Adds the camera ray of the next sample.
    pub fn start(&mut self, ray: Ray, sampler: Sampler, cone: Cone, lot: Lot) {
        let sample = self.samplers.len() as u32;
        self.samplers.push(sampler);
        self.lots.push(lot);
        self.wave.push(ray, Errand { sample, node: Node::CAMERA, weight: Vec3::ONE, cone });
    }
}

/// A ray, the surface that it met, and what the surface is of.
pub struct Encounter<'a> {
    pub direction: Vec3,
    pub errand: Errand,
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
        if buffers.wave.rays.is_empty() {
            return;
        }
        find(view, buffers, worker);
        if depth == 1 {
            worker.counters.primary_hits += buffers.hits.iter().flatten().count() as u64;
        }
        shade(view, buffers, depth == view.settings.max_depth, worker);
        for shadows in &mut buffers.shadows {
            settle(view, shadows, &mut buffers.blocked, &mut buffers.colors, worker);
        }
        std::mem::swap(&mut buffers.wave, &mut buffers.next);
        buffers.next.clear();
    }
}

fn find(view: View, buffers: &mut Buffers, worker: &mut Worker) {
    buffers.hits.clear();
    buffers.hits.resize(buffers.wave.rays.len(), None);
    let hits = &mut buffers.hits;
    view.accelerator.closest_all(view.geometry, &buffers.wave.rays, worker, |i, hit| hits[i] = hit);
}

fn shade(view: View, buffers: &mut Buffers, last: bool, worker: &mut Worker) {
    let Buffers { wave, next, hits, shadows, samplers, colors, features, .. } = buffers;
    for ((ray, errand), hit) in wave.rays.iter().zip(&wave.errands).zip(hits) {
        let (direction, sample) = (ray.direction, errand.sample as usize);
        let Some(hit) = hit else {
            let sky = view.environment.map_or(view.settings.background, |sky| sky.lookup_wide(direction, errand.cone));
            colors[sample] += errand.weight * sky;
            continue;
        };
        let mut surface = view.geometry.surface(ray, hit);
        let mut material = &view.materials[surface.material as usize];
        let errand = Errand { cone: errand.cone.at(hit.t), ..*errand };
        let dressed = view.skins.dress(view.geometry, (ray, hit), errand.cone, &mut surface, material);
        if let Some(dressed) = &dressed {
            material = dressed;
        }
        let front = direction.dot(surface.geometric_normal) < 0.0;
        let surface = if front { surface } else { surface.flipped() };
        let met = Encounter { direction, errand, surface, material, front, sampler: samplers[sample] };
        if view.settings.features && errand.node == Node::CAMERA {
            features[sample] = Some(feature::seen(view, &met));
        }
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
        LightSampling::Random => sampler.random(met.errand.node, domain),
        LightSampling::Jittered => sampler.stratified(met.errand.node, domain),
    };
    lit(view, met, light, at, 1.0, shadows);
}

/// Blinn-Phong light from one point of a light, and the ray that tells whether anything stands between.
fn lit(view: View, met: &Encounter, light: &Light, at: [f32; 2], share: f32, shadows: &mut Shadows) {
    let Encounter { errand, surface, material, .. } = met;
    let target = light.point(at);
    if surface.geometric_normal.dot(target - surface.point) <= 0.0 {
        return;
    }
    let from = surface.leave(surface.geometric_normal);
    let offset = target - from;
    let square = offset.length_squared();
    let distance = square.sqrt();
    let direction = offset * (1.0 / distance);
    let cosine = surface.shading_normal.dot(direction);
    // Not so where the light touches the surface either: the distance is 0, and the cosine no number.
    if cosine.is_nan() || cosine <= 0.0 {
        return;
    }
    let mut color = material.diffuse * cosine;
    if material.specular != Vec3::ZERO {
        let half = (direction - met.direction).normalize_or_zero();
        let base = half.dot(surface.shading_normal).max(0.0);
        color += material.specular * libm::powf(base, material.shininess);
    }
    color *= surface.terminator(direction);
    let mut strength = if light.inverse_square { share / square } else { share };
    if view.settings.integrator == Integrator::Path && light.inverse_square && !light.is_point() {
        // A path tracer's area light is a Lambertian emitter.
        strength *= light.normal.dot(direction).abs();
    }
    let ray = Ray { origin: from, direction, t_max: distance };
    shadows.rays.push(ray);
    if view.settings.transparent_shadows {
        shadows.targets.push(target);
    }
    shadows.gains.push((errand.sample, errand.weight * (color * light.color * strength)));
}

/// Traces the shadow rays towards a light and adds what gets through.
fn settle(view: View, shadows: &mut Shadows, blocked: &mut Vec<bool>, colors: &mut [Vec3], worker: &mut Worker) {
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
        blocked.clear();
        blocked.resize(rays.len(), true);
        view.accelerator.occluded_all(view.geometry, rays, worker, |i, met| blocked[i] = met);
        // In the order of the wave, whatever order the rays were traced in.
        for ((sample, gain), blocked) in gains.iter().zip(&*blocked) {
            hits += u64::from(*blocked);
            if !blocked {
                colors[*sample as usize] += *gain;
            }
        }
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
