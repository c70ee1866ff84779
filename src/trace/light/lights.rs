//! All lights of a frame, chosen among by power.
//!
//! What lies around the scene is one of them where [`Lights::under`] says so. A background of one colour is not: rays
//! that leave the scene find it as well as any choice would.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::Vec3;

use super::distribution::DiscreteDistribution;
use super::emitter::{Emitter, emitters};
use super::lamp::Lamp;
use super::lamp_lanes::{LampLanes, LightSampleLanes};
use super::linking::{LightLinking, LightLinks};
use super::many::ManyLights;
use super::sample::{EmittedPhoton, LightSample};
use crate::components::LightSampler;
use crate::trace::light::environment::Environment;
use crate::trace::material::ShadingParams;
use crate::trace::primitive::{Geometry, PrimitiveKind, SurfacePoint};
use crate::trace::sampler::{Frame, around, cosine_hemisphere};
use crate::trace::soa::{Hit, Ray};

/// How much of the way to a shining primitive a shadow ray goes: it must not meet the primitive itself.
const SHORT_OF: f32 = 1.0 - 1e-4;

/// Lamps, then emitters, numbered through.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lights {
    /// In authored order.
    pub lamps: Vec<Lamp>,
    emitters: Vec<Emitter>,
    /// For light towards a point, and for photons.
    pub direct: DiscreteDistribution,
    /// In its place, where there are many lights.
    many: Option<ManyLights>,
    photon: DiscreteDistribution,
    /// Lamps that rays meet.
    surfaces: Vec<u32>,
    /// Primitives from this number on have elements that count.
    first_instance: u32,
    /// What lies around the scene, and the chance that it is sampled.
    pub sky: Option<(Environment, f32)>,
    /// The light group of what lies around the scene, sampled or not.
    environment_group: u32,
    /// What is special about some of them, if anything is.
    links: Option<Arc<LightLinks>>,
}

/// Least chance of either, where there is a sky and something else that shines.
const LEAST_CHANCE: f32 = 0.1;

/// Where on a ray to the sky its end is taken to be.
const SKY_DISTANCE: f32 = 1e9;

fn strength(v: Vec3) -> f64 {
    f64::from(v.x) + f64::from(v.y) + f64::from(v.z)
}

impl Lights {
    /// `lamps` in authored order, and what shines among the primitives.
    pub fn new(lamps: Vec<Lamp>, geometry: &Geometry, materials: &[ShadingParams]) -> Self {
        let emitters = emitters(geometry, materials);
        let pi = std::f64::consts::PI;
        let of_lamp = |l: &Lamp| {
            let all = strength(l.color) * if l.is_surface() { 2.0 * pi * pi } else { 4.0 * pi * pi };
            all * f64::from(l.cone.solid_share())
        };
        let of_emitter = |e: &Emitter| strength(e.radiance) * f64::from(e.area() * e.sides()) * pi;
        // One that does not fall off is as strong at the scene's edge as elsewhere.
        let reach = f64::from(geometry.bounds().size().length_squared()).max(1.0) / 4.0;
        let asked = |l: &Lamp| of_lamp(l) * if l.inverse_square { 1.0 } else { reach };
        let sent = |l: &Lamp| if l.inverse_square { of_lamp(l) } else { 0.0 };
        Lights {
            direct: DiscreteDistribution::new(lamps.iter().map(asked).chain(emitters.iter().map(of_emitter))),
            photon: DiscreteDistribution::new(lamps.iter().map(sent).chain(emitters.iter().map(of_emitter))),
            surfaces: (0..lamps.len() as u32).filter(|i| lamps[*i as usize].is_surface()).collect(),
            lamps,
            emitters,
            many: None,
            first_instance: geometry.range(PrimitiveKind::Instance).start,
            sky: None,
            environment_group: 0,
            links: None,
        }
    }

    /// The same lights under a sky that is prepared for sampling.
    pub fn under(mut self, sky: Option<&Environment>, geometry: &Geometry) -> Self {
        let Some(sky) = sky.filter(|sky| sky.is_prepared()) else { return self };
        // What falls through the disk around the scene.
        let across = std::f64::consts::PI * f64::from(geometry.bounds().size().length_squared()).max(1.0) / 4.0;
        let power = 3.0 * sky.luminous() * across;
        let chance = match self.direct.total {
            0.0 => 1.0,
            others => ((power / (power + others)) as f32).clamp(LEAST_CHANCE, 1.0 - LEAST_CHANCE),
        };
        self.sky = Some((sky.clone(), chance));
        self
    }

    /// The same lights, the light of what lies around the scene in a group of its own.
    pub fn environment_in_group(self, group: u32) -> Self {
        Lights { environment_group: group, ..self }
    }

    /// The same lights, what is special about some of them being this; that of lamps stands with them.
    pub fn linked(mut self, links: Option<Arc<LightLinks>>) -> Self {
        if let Some(links) = &links {
            self.emitters.iter_mut().for_each(|emitter| emitter.linking = links.of_emissive(emitter.entity));
        }
        self.links = links;
        self
    }

    /// What is special about some of them, if anything is.
    pub fn links(&self) -> Option<&Arc<LightLinks>> {
        self.links.as_ref()
    }

    /// Whether some bodies are not lit by all lights.
    #[inline(always)]
    pub fn has_receivers(&self) -> bool {
        self.links.as_ref().is_some_and(|links| !links.receivers.is_empty())
    }

    /// What is special about a light by its number.
    pub fn linking(&self, light: u32) -> LightLinking {
        let Some(links) = &self.links else { return LightLinking::default() };
        let light = light as usize;
        if let Some(lamp) = self.lamps.get(light) {
            return lamp.linking;
        }
        self.emitters.get(light - self.lamps.len()).map_or(links.usual, |emitter| emitter.linking)
    }

    /// Whether a light lights an entity.
    #[inline]
    pub fn is_linked(&self, light: LightLinking, entity: u32) -> bool {
        self.links.as_ref().is_none_or(|links| links.lights(light, entity))
    }

    /// Whether the surfaces of an entity that emit light light another one.
    #[inline]
    pub fn is_lit_by(&self, emissive: u32, entity: u32) -> bool {
        self.links.as_ref().is_none_or(|links| links.lights(links.of_emissive(emissive), entity))
    }

    /// The density that a way of light is weighed by which samples alone may count: scattered rays then add nothing.
    fn asked(&self, linking: LightLinking, density: f32) -> f32 {
        if linking.sampled_only { f32::INFINITY } else { density }
    }

    /// The same lights, one of many chosen in this way.
    pub fn chosen_by(self, sampler: LightSampler) -> Self {
        let many = match sampler {
            LightSampler::Power => None,
            LightSampler::Bvh => ManyLights::new(&self.lamps, &self.emitters),
        };
        Lights { many, ..self }
    }

    /// One that shines towards a point, for a number in 0..1, and the chance of it among all but the sky.
    #[inline]
    pub(super) fn choose(&self, from: Vec3, pick: f32) -> Option<(usize, f32)> {
        match &self.many {
            Some(many) => many.pick(from, pick),
            None => self.direct.pick(pick).map(|(i, _)| (i, self.direct.chance(i))),
        }
    }

    /// The chance that [`Self::choose`] gives a light.
    #[inline]
    fn chance(&self, from: Vec3, light: usize) -> f32 {
        match &self.many {
            Some(many) => many.chance(from, light),
            None => self.direct.chance(light),
        }
    }

    /// The light group of what lies around the scene.
    #[inline]
    pub fn environment_group(&self) -> u32 {
        self.environment_group
    }

    /// In authored order.
    pub fn lamps(&self) -> &[Lamp] {
        &self.lamps
    }

    /// In the order of hits.
    pub fn emitters(&self) -> &[Emitter] {
        &self.emitters
    }

    /// How many there are to choose among.
    pub fn len(&self) -> usize {
        self.lamps.len() + self.emitters.len() + usize::from(self.sky.is_some())
    }

    /// The chance that [`Self::sample`] takes something else than the environment.
    pub(super) fn earthly(&self) -> f32 {
        self.sky.as_ref().map_or(1.0, |(_, chance)| 1.0 - chance)
    }

    /// Whether nothing shines.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All chances that [`Self::sample`] chooses by, and whether scattered rays count what they meet, to tell whether two
    /// pictures choose alike.
    pub fn chances(&self) -> Vec<f32> {
        let alone = |links: &Arc<LightLinks>| if links.usual.sampled_only { 1.0 } else { 0.0 };
        let alone = self.links.as_ref().map_or(0.0, alone);
        self.direct.ends.iter().copied().chain([self.earthly(), alone]).collect()
    }

    /// Power of all that sends photons out, summed over the channels.
    pub fn power(&self) -> f64 {
        self.photon.total
    }

    /// Light of one light, chosen by power, towards a point.
    pub fn sample(&self, from: Vec3, pick: f32, u: [f32; 2]) -> Option<LightSample> {
        let earthly = self.earthly();
        if pick >= earthly {
            return self.sky_light(from, u);
        }
        let (i, chance) = self.choose(from, pick / earthly)?;
        self.sample_one(i, chance * earthly, from, u)
    }

    /// Light of one light by its number, the sky apart, that was chosen with this chance.
    pub(super) fn sample_one(&self, i: usize, chance: f32, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        match self.lamps.get(i) {
            Some(lamp) => from_lamp(lamp, from, chance, u, i as u32),
            None => from_emitter(&self.emitters[i - self.lamps.len()], from, chance, u, i as u32),
        }
    }

    pub(super) fn sky_light(&self, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let (sky, chance) = self.sky.as_ref()?;
        let sample = sky.sample(u)?;
        let pdf = sample.pdf * chance;
        let target = from + sample.direction * SKY_DISTANCE;
        let (distance, contribution, light) = (f32::INFINITY, sample.radiance / pdf, self.len() as u32 - 1);
        let is_sampled = pdf > 0.0;
        let alone = self.links.as_ref().is_some_and(|links| links.usual.sampled_only);
        let pdf = if alone { 0.0 } else { pdf };
        is_sampled.then_some(LightSample { direction: sample.direction, target, distance, contribution, pdf, light })
    }

    /// Light of one of the shining primitives alone, chosen by power.
    pub fn sample_emitters(&self, from: Vec3, pick: f32, u: [f32; 2]) -> Option<LightSample> {
        let first = self.lamps.len();
        let before = if first == 0 { 0.0 } else { self.direct.ends.get(first - 1).copied()? };
        let share = 1.0 - before;
        let (i, _) = self.direct.pick(before + pick * share)?;
        let emitter = self.emitters.get(i.checked_sub(first)?)?;
        from_emitter(emitter, from, self.direct.chance(i) / share, u, i as u32)
    }

    /// Density with which [`Self::sample`] takes the point of a shining primitive that a ray met; 0 for one that is
    /// never sampled.
    pub fn pdf(&self, ray: &Ray, hit: &Hit, surface: &SurfacePoint) -> f32 {
        let Some(i) = self.emitter_of(hit) else { return 0.0 };
        let chance = self.chance(ray.origin, self.lamps.len() + i) * self.earthly();
        let emitter = &self.emitters[i];
        self.asked(emitter.linking, chance * emitter.pdf(ray.origin, surface.point, surface.geometric_normal))
    }

    /// The number of the emitter that was hit.
    fn emitter_of(&self, hit: &Hit) -> Option<usize> {
        let element = if hit.primitive < self.first_instance { 0 } else { hit.element };
        self.emitters.binary_search_by_key(&(hit.primitive, element), |e| (e.primitive, e.element)).ok()
    }

    /// As [`Self::pdf`], of [`Self::sample_emitters`].
    pub fn pdf_emitters(&self, ray: &Ray, hit: &Hit, surface: &SurfacePoint) -> f32 {
        let first = self.lamps.len();
        let before = if first == 0 { 0.0 } else { self.direct.ends.get(first - 1).copied().unwrap_or(0.0) };
        let Some(i) = self.emitter_of(hit) else { return 0.0 };
        let chance = self.direct.chance(first + i) / (1.0 - before).max(1e-9);
        let emitter = &self.emitters[i];
        self.asked(emitter.linking, chance * emitter.pdf(ray.origin, surface.point, surface.geometric_normal))
    }

    /// Density with which [`Self::sample`] takes a direction to the sky.
    pub fn sky_pdf(&self, direction: Vec3) -> f32 {
        let usual = self.links.as_ref().map_or(LightLinking::default(), |links| links.usual);
        self.sky.as_ref().map_or(0.0, |(sky, chance)| self.asked(usual, chance * sky.pdf(direction)))
    }

    /// The light group of a light by its number.
    #[inline]
    pub fn group(&self, light: u32) -> u32 {
        let light = light as usize;
        if let Some(lamp) = self.lamps.get(light) {
            return lamp.group;
        }
        self.emitters.get(light - self.lamps.len()).map_or(self.environment_group, |emitter| emitter.group)
    }

    /// Lamps that rays meet, or those of the camera, with their numbers.
    #[inline(always)]
    pub fn met(&self, camera: bool) -> impl Iterator<Item = (usize, &Lamp)> {
        let lamps = self.surfaces.iter().map(|i| (*i as usize, &self.lamps[*i as usize]));
        lamps.filter(move |(_, lamp)| if camera { lamp.visible } else { lamp.reflected })
    }

    /// Every lamp that a ray crosses before it ends: radiance, distance, density of [`Self::sample`], and its light
    /// group. `receiver` is the entity that the ray left, if it left one.
    #[inline]
    pub fn crossed(&self, ray: &Ray, camera: bool, receiver: Option<u32>, mut found: impl FnMut(Vec3, f32, f32, u32)) {
        for (i, lamp) in self.met(camera) {
            if receiver.is_some_and(|entity| !self.is_linked(lamp.linking, entity)) {
                continue;
            }
            if let Some(t) = lamp.crossing(ray) {
                let asked = self.chance(ray.origin, i) * self.earthly() * lamp.pdf(ray.direction, t);
                let asked = self.asked(lamp.linking, asked);
                found(lamp.radiance(), t, asked, lamp.group);
            }
        }
    }

    /// A photon: a light chosen by power, a point of it, a direction.
    pub fn emit(&self, pick: f32, at: [f32; 2], toward: [f32; 2]) -> Option<EmittedPhoton> {
        let (i, rest) = self.photon.pick(pick)?;
        let chance = self.photon.chance(i);
        let Some(lamp) = self.lamps.get(i) else {
            let emitter = &self.emitters[i - self.lamps.len()];
            let surface = emitter.surface(at);
            let direction =
                Frame::new(surface.geometric_normal * emitter.side(rest)).to_world(cosine_hemisphere(toward));
            let power = emitter.radiance * (PI * emitter.area() * emitter.sides() / chance);
            return Some(EmittedPhoton { ray: Ray::new(surface.offset_origin(direction), direction), power });
        };
        if lamp.is_surface() {
            let side = if rest < 0.5 { lamp.normal } else { -lamp.normal };
            let direction = Frame::new(side).to_world(cosine_hemisphere(toward));
            // Radiance, pi and area of one side; twice that for both.
            let power = lamp.color * (2.0 * PI * PI / chance);
            return Some(EmittedPhoton { ray: Ray::new(lamp.point(at), direction), power });
        }
        if !lamp.cone.is_everywhere() {
            let reach = 1.0 - lamp.cone.dark;
            let direction = Frame::new(lamp.cone.axis).to_world(around(1.0 - reach * toward[0], toward[1]));
            let power = lamp.color * (2.0 * PI * PI * reach * lamp.cone.share(direction) / chance);
            return Some(EmittedPhoton { ray: Ray::new(lamp.point(at), direction), power });
        }
        let direction = around(1.0 - 2.0 * toward[0], toward[1]);
        Some(EmittedPhoton { ray: Ray::new(lamp.point(at), direction), power: lamp.color * (4.0 * PI * PI / chance) })
    }
}

fn from_lamp(lamp: &Lamp, from: Vec3, chance: f32, u: [f32; 2], light: u32) -> Option<LightSample> {
    let arrival = LampLanes::<f32>::splat(lamp).sample(from.into(), chance, u);
    let LightSampleLanes { direction, target, distance, contribution, pdf, good } = arrival;
    let (direction, target, contribution) = (direction.into(), target.into(), contribution.into());
    good.then_some(LightSample { direction, target, distance, contribution, pdf, light })
}

fn from_emitter(emitter: &Emitter, from: Vec3, chance: f32, u: [f32; 2], light: u32) -> Option<LightSample> {
    let shining = emitter.sample(from, u)?;
    let offset = shining.point - from;
    let distance = offset.length();
    let direction = offset * (1.0 / distance);
    let density = shining.pdf * chance;
    let pdf = if emitter.linking.sampled_only { 0.0 } else { density };
    let lit = distance > 0.0 && emitter.emits_towards(shining.normal, -direction);
    lit.then(|| LightSample {
        direction,
        target: shining.point,
        distance: distance * SHORT_OF,
        contribution: emitter.radiance / density,
        pdf,
        light,
    })
}
