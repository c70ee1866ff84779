//! Light along a ray: Whitted (CACM 1980) and distribution ray tracing (Cook, Porter, Carpenter, SIGGRAPH 1984).
//!
//! Both are one recursion. What a Whitted picture leaves out (lens, gloss, soft shadows) is switched off when the
//! settings are resolved, so that the recursion never asks which integrator runs. Every hit that reflects or refracts
//! spawns its rays down to the depth cap; no contribution is cut off for being small.

use glam::Vec3;

use super::camera::CameraRays;
use super::environment::CubeMap;
use super::lights::Light;
use super::sampler::{Domain, Node, Sampler};
use super::surfacing::{Surfacing, fresnel, reflect, refract};
use super::{Accelerator, Geometry, Ray, Surface, Worker};
use crate::components::{Fresnel, Integrator, Render, Shadows};

/// Where on a light a shadow ray ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightSampling {
    Center,
    /// n x n cell centres.
    Fixed(u32),
    Random,
    Jittered,
}

/// Settings of the recursion, resolved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    pub strata: u32,
    pub max_depth: u32,
    pub light_sampling: LightSampling,
    pub gloss: bool,
    pub lens: bool,
    pub transparent_shadows: bool,
    pub fresnel: Fresnel,
    pub background: Vec3,
    pub seed: u64,
}

impl Settings {
    /// Resolves the settings of a scene; `seed` is that of the frame.
    pub fn new(render: &Render, seed: u64) -> Self {
        let distribution = render.integrator == Integrator::Distribution;
        let strata = render.strata();
        let light_sampling = match render.shadows {
            _ if !distribution => LightSampling::Center,
            Shadows::Hard => LightSampling::Center,
            Shadows::Auto if strata > 1 => LightSampling::Jittered,
            Shadows::Auto | Shadows::Fixed => LightSampling::Fixed(render.shadow_samples.isqrt().max(1)),
            Shadows::Random => LightSampling::Random,
            Shadows::Jittered => LightSampling::Jittered,
        };
        Settings {
            strata,
            max_depth: render.max_depth,
            light_sampling,
            gloss: distribution,
            lens: distribution,
            transparent_shadows: render.transparent_shadows,
            fresnel: render.fresnel,
            background: render.background.as_vec3(),
            seed,
        }
    }
}

/// Everything that a frame is traced from.
#[derive(Clone, Copy)]
pub struct View<'a> {
    pub geometry: &'a Geometry,
    pub accelerator: &'a Accelerator,
    pub materials: &'a [Surfacing],
    pub lights: &'a [Light],
    pub camera: &'a CameraRays,
    /// Takes the place of the background colour.
    pub environment: Option<&'a CubeMap>,
    pub settings: &'a Settings,
    pub width: u32,
}

/// One pixel's samples in flight.
struct Path<'a> {
    view: View<'a>,
    sampler: Sampler,
    worker: &'a mut Worker,
}

/// Linear colour of pixel (x, y), counted from the top left: the mean of its samples, each clamped to 0..1.
pub fn pixel(view: View, x: u32, y: u32, worker: &mut Worker) -> [f32; 3] {
    let strata = view.settings.strata;
    let mut sampler = Sampler::new(view.settings.seed, y * view.width + x, strata);
    let mut sum = Vec3::ZERO;
    for sample in 0..strata * strata {
        sampler.sample = sample;
        let offset = if strata == 1 { [0.5; 2] } else { sampler.in_own_cell(Node::CAMERA, Domain::Pixel) };
        let ray = view.camera.ray(x, y, offset, &sampler);
        let mut path = Path { view, sampler, worker };
        path.worker.counters.primary_rays += 1;
        sum += path.radiance(&ray, 1, Node::CAMERA).clamp(Vec3::ZERO, Vec3::ONE);
    }
    (sum / (strata * strata) as f32).to_array()
}

impl Path<'_> {
    fn radiance(&mut self, ray: &Ray, depth: u32, node: Node) -> Vec3 {
        let view = self.view;
        let Some(hit) = view.accelerator.closest(view.geometry, ray, self.worker) else {
            return self.background(ray.direction);
        };
        if depth == 1 {
            self.worker.counters.primary_hits += 1;
        }
        let surface = view.geometry.surface(ray, &hit);
        let material = &view.materials[surface.material as usize];
        let front = ray.direction.dot(surface.geometric_normal) < 0.0;
        let facing = if front { surface } else { surface.flipped() };
        let mut color = self.direct(ray, &facing, material, node);
        if depth < view.settings.max_depth {
            if material.transmission > 0.0 {
                color += self.dielectric(ray, &facing, material, front, depth, node);
            } else if material.reflection > 0.0 {
                color += material.mirror_color
                    * material.reflection
                    * self.mirrored(ray, &facing, material.gloss, depth, node);
            }
        }
        color
    }

    fn background(&self, direction: Vec3) -> Vec3 {
        self.view.environment.map_or(self.view.settings.background, |sky| sky.lookup(direction))
    }

    /// Light that arrives straight from the lights. `surface` faces the ray.
    fn direct(&mut self, ray: &Ray, surface: &Surface, material: &Surfacing, node: Node) -> Vec3 {
        let mut sum = Vec3::ZERO;
        if material.diffuse == Vec3::ZERO && material.specular == Vec3::ZERO {
            return sum;
        }
        for (i, light) in self.view.lights.iter().enumerate() {
            let domain = Domain::Light(i as u32);
            sum += match self.view.settings.light_sampling {
                _ if light.is_point() => self.lit(ray, surface, material, light, [0.5; 2]),
                LightSampling::Center => self.lit(ray, surface, material, light, [0.5; 2]),
                LightSampling::Fixed(n) => {
                    let cell = |i: u32| (i as f32 + 0.5) / n as f32;
                    let mut points = Vec3::ZERO;
                    for k in 0..n * n {
                        points += self.lit(ray, surface, material, light, [cell(k % n), cell(k / n)]);
                    }
                    points / (n * n) as f32
                }
                LightSampling::Random => {
                    let at = self.sampler.random(node, domain);
                    self.lit(ray, surface, material, light, at)
                }
                LightSampling::Jittered => {
                    let at = self.sampler.stratified(node, domain);
                    self.lit(ray, surface, material, light, at)
                }
            };
        }
        sum
    }

    /// Blinn-Phong light from one point of a light, if nothing stands between.
    fn lit(&mut self, ray: &Ray, surface: &Surface, material: &Surfacing, light: &Light, at: [f32; 2]) -> Vec3 {
        let to_light = light.point(at) - surface.point;
        let distance = to_light.length();
        if distance == 0.0 {
            return Vec3::ZERO;
        }
        let direction = to_light / distance;
        let cosine = surface.shading_normal.dot(direction);
        if cosine <= 0.0 || surface.geometric_normal.dot(direction) <= 0.0 {
            return Vec3::ZERO;
        }
        let visible = self.visibility(surface.leave(direction), light.point(at));
        if visible == 0.0 {
            return Vec3::ZERO;
        }
        let mut color = material.diffuse * cosine;
        if material.specular != Vec3::ZERO {
            let half = (direction - ray.direction).normalize_or_zero();
            let base = half.dot(surface.shading_normal).max(0.0);
            color += material.specular * libm::powf(base, material.shininess);
        }
        let strength = if light.inverse_square { visible / (distance * distance) } else { visible };
        color * light.color * strength
    }

    /// Share of light that gets from `to` to `from`: 0 or 1, or between where transparent surfaces let it through.
    fn visibility(&mut self, from: Vec3, to: Vec3) -> f32 {
        let offset = to - from;
        let t_max = offset.length();
        if t_max == 0.0 {
            return 1.0;
        }
        let mut ray = Ray { origin: from, direction: offset / t_max, t_max };
        self.worker.counters.shadow_rays += 1;
        let view = self.view;
        if !view.settings.transparent_shadows {
            let blocked = view.accelerator.occluded(view.geometry, &ray, self.worker);
            self.worker.counters.shadow_hits += u64::from(blocked);
            return if blocked { 0.0 } else { 1.0 };
        }
        let mut share = 1.0;
        while let Some(hit) = view.accelerator.closest(view.geometry, &ray, self.worker) {
            let surface = view.geometry.surface(&ray, &hit);
            share *= view.materials[surface.material as usize].transmission;
            let origin = surface.leave(ray.direction);
            let rest = (to - origin).dot(ray.direction);
            // A ray that does not get ahead has reached the light, as far as `f32` can tell.
            if share == 0.0 || rest <= 0.0 || rest >= ray.t_max {
                break;
            }
            ray = Ray { origin, t_max: rest, ..ray };
        }
        self.worker.counters.shadow_hits += u64::from(share == 0.0);
        share
    }

    /// What a mirror shows. `surface` faces the ray.
    fn mirrored(&mut self, ray: &Ray, surface: &Surface, gloss: f32, depth: u32, node: Node) -> Vec3 {
        let node = node.reflected();
        let mut direction = reflect(ray.direction, surface.shading_normal);
        if gloss > 0.0 && self.view.settings.gloss {
            let square = self.sampler.stratified(node, Domain::Gloss);
            let radius = libm::cbrtf(self.sampler.extra(node, Domain::Gloss));
            direction = (direction + sphere_point(square) * (gloss * radius)).normalize_or(direction);
        }
        // Smooth normals and gloss may send the ray below the surface: mirror it back up.
        let height = direction.dot(surface.geometric_normal);
        if height < 0.0 {
            direction -= surface.geometric_normal * (2.0 * height);
        }
        self.worker.counters.reflection_rays += 1;
        self.radiance(&Ray::new(surface.leave(direction), direction), depth + 1, node)
    }

    /// Reflection and refraction at a transparent surface, which faces the ray; `entering` from outside.
    fn dielectric(
        &mut self,
        ray: &Ray,
        surface: &Surface,
        material: &Surfacing,
        entering: bool,
        depth: u32,
        node: Node,
    ) -> Vec3 {
        let eta = if entering { 1.0 / material.ior } else { material.ior };
        let normal = surface.shading_normal;
        let refracted = refract(ray.direction, normal, eta);
        let model = self.view.settings.fresnel;
        let reflected = match refracted {
            None if model == Fresnel::Off => (material.reflection + material.transmission).min(1.0),
            None => 1.0,
            Some(_) if model == Fresnel::Off => material.reflection,
            Some(_) => fresnel(model, -ray.direction.dot(normal), eta),
        };
        let mut color = Vec3::ZERO;
        if reflected > 0.0 {
            color += material.mirror_color * reflected * self.mirrored(ray, surface, material.gloss, depth, node);
        }
        if let Some(mut direction) = refracted {
            let share = match model {
                Fresnel::Off => material.transmission,
                _ => (1.0 - fresnel(model, -ray.direction.dot(normal), eta)) * material.transmission,
            };
            // A smooth normal may bend the ray back out: keep it on the far side.
            let height = direction.dot(surface.geometric_normal);
            if height > 0.0 {
                direction -= surface.geometric_normal * (2.0 * height);
            }
            self.worker.counters.refraction_rays += 1;
            let ahead = Ray::new(surface.leave(direction), direction);
            color += share * self.radiance(&ahead, depth + 1, node.refracted());
        }
        color
    }
}

/// Uniform point on the unit sphere.
fn sphere_point([x, y]: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = libm::sincosf(std::f32::consts::TAU * y);
    Vec3::new(r * cos, r * sin, z)
}
