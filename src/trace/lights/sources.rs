//! All lights of a frame, chosen among by power.
//!
//! What lies around the scene is one of them where [`Lights::under`] says so. A background of one colour is not: rays
//! that leave the scene find it as well as any choice would.

use std::f32::consts::PI;

use glam::Vec3;

use super::eight::{Arrival, Lamps};
use super::emitters::emitters;
use super::{Emission, Emitter, Incoming, Light};
use crate::trace::bsdf::{Frame, around, cosine_hemisphere};
use crate::trace::environment::Environment;
use crate::trace::geometry::Kind;
use crate::trace::surfacing::Surfacing;
use crate::trace::{Geometry, Hit, Ray, Surface};

/// How much of the way to a shining primitive a shadow ray goes: it must not meet the primitive itself.
const SHORT_OF: f32 = 1.0 - 1e-4;

/// Lamps, then emitters, numbered through.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lights {
    pub(super) lamps: Vec<Light>,
    emitters: Vec<Emitter>,
    /// For light towards a point, and for photons.
    pub(super) asked: Shares,
    sent: Shares,
    /// Lamps that rays meet.
    surfaces: Vec<u32>,
    /// Primitives from this number on have elements that count.
    first_instance: u32,
    /// What lies around the scene, and the chance that it is asked.
    pub(super) sky: Option<(Environment, f32)>,
    /// The pass of what lies around the scene, sampled or not.
    surround_pass: u32,
}

/// Least chance of either, where there is a sky and something else that shines.
const LEAST_CHANCE: f32 = 0.1;

/// Where on a ray to the sky its end is taken to be.
const SKY_DISTANCE: f32 = 1e9;

/// Things to choose among by weight.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Shares {
    /// Sums of weights up to and with each, over the sum of all.
    ends: Vec<f32>,
    total: f64,
}

impl Shares {
    fn new(weights: impl Iterator<Item = f64>) -> Self {
        let weights: Vec<f64> = weights.collect();
        let total: f64 = weights.iter().sum();
        let mut sum = 0.0;
        let mut end = |w: f64| {
            sum += w;
            (sum / total) as f32
        };
        let ends = if total > 0.0 { weights.into_iter().map(&mut end).collect() } else { Vec::new() };
        Shares { ends, total }
    }

    pub(super) fn chance(&self, i: usize) -> f32 {
        let before = if i == 0 { 0.0 } else { self.ends.get(i - 1).copied().unwrap_or(0.0) };
        self.ends.get(i).map_or(0.0, |end| end - before)
    }

    /// The one that a number in 0..1 falls to, and where in its share.
    pub(super) fn pick(&self, u: f32) -> Option<(usize, f32)> {
        let last = self.ends.len().checked_sub(1)?;
        let i = self.ends.partition_point(|end| *end <= u).min(last);
        let chance = self.chance(i);
        let before = if i == 0 { 0.0 } else { self.ends[i - 1] };
        (chance > 0.0).then(|| (i, ((u - before) / chance).clamp(0.0, 1.0 - f32::EPSILON / 2.0)))
    }
}

fn strength(v: Vec3) -> f64 {
    f64::from(v.x) + f64::from(v.y) + f64::from(v.z)
}

impl Lights {
    /// `lamps` in authored order, and what shines among the primitives.
    pub fn new(lamps: Vec<Light>, geometry: &Geometry, materials: &[Surfacing]) -> Self {
        let emitters = emitters(geometry, materials);
        let pi = std::f64::consts::PI;
        let of_lamp = |l: &Light| strength(l.color) * if l.is_surface() { 2.0 * pi * pi } else { 4.0 * pi * pi };
        let of_emitter = |e: &Emitter| strength(e.radiance) * f64::from(e.area() * e.sides()) * pi;
        // One that does not fall off is as strong at the scene's edge as elsewhere.
        let reach = f64::from(geometry.bounds().size().length_squared()).max(1.0) / 4.0;
        let asked = |l: &Light| of_lamp(l) * if l.inverse_square { 1.0 } else { reach };
        let sent = |l: &Light| if l.inverse_square { of_lamp(l) } else { 0.0 };
        Lights {
            asked: Shares::new(lamps.iter().map(asked).chain(emitters.iter().map(of_emitter))),
            sent: Shares::new(lamps.iter().map(sent).chain(emitters.iter().map(of_emitter))),
            surfaces: (0..lamps.len() as u32).filter(|i| lamps[*i as usize].is_surface()).collect(),
            lamps,
            emitters,
            first_instance: geometry.range(Kind::Instance).start,
            sky: None,
            surround_pass: 0,
        }
    }

    /// The same lights under a sky that is prepared for sampling.
    pub fn under(mut self, sky: Option<&Environment>, geometry: &Geometry) -> Self {
        let Some(sky) = sky.filter(|sky| sky.is_prepared()) else { return self };
        // What falls through the disk around the scene.
        let across = std::f64::consts::PI * f64::from(geometry.bounds().size().length_squared()).max(1.0) / 4.0;
        let power = 3.0 * sky.luminous() * across;
        let chance = match self.asked.total {
            0.0 => 1.0,
            others => ((power / (power + others)) as f32).clamp(LEAST_CHANCE, 1.0 - LEAST_CHANCE),
        };
        self.sky = Some((sky.clone(), chance));
        self
    }

    /// The same lights, the light of what lies around the scene in a pass of its own.
    pub fn surrounded_in(self, pass: u32) -> Self {
        Lights { surround_pass: pass, ..self }
    }

    /// The pass of what lies around the scene.
    #[inline]
    pub fn surround_pass(&self) -> u32 {
        self.surround_pass
    }

    pub fn lamps(&self) -> &[Light] {
        &self.lamps
    }

    pub fn emitters(&self) -> &[Emitter] {
        &self.emitters
    }

    /// How many there are to choose among.
    pub fn len(&self) -> usize {
        self.lamps.len() + self.emitters.len() + usize::from(self.sky.is_some())
    }

    /// The chance that [`Self::sample`] asks something else than the sky.
    fn earthly(&self) -> f32 {
        self.sky.as_ref().map_or(1.0, |(_, chance)| 1.0 - chance)
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All that [`Self::sample`] draws lots by, to tell whether two pictures draw alike.
    pub fn chances(&self) -> Vec<f32> {
        self.asked.ends.iter().copied().chain([self.earthly()]).collect()
    }

    /// Power of all that sends photons out, summed over the channels.
    pub fn power(&self) -> f64 {
        self.sent.total
    }

    /// Light of one light, chosen by power, towards a point.
    pub fn sample(&self, from: Vec3, pick: f32, u: [f32; 2]) -> Option<Incoming> {
        let earthly = self.earthly();
        if pick >= earthly {
            return self.sky_light(from, u);
        }
        let (i, _) = self.asked.pick(pick / earthly)?;
        let chance = self.asked.chance(i) * earthly;
        match self.lamps.get(i) {
            Some(lamp) => from_lamp(lamp, from, chance, u, i as u32),
            None => from_emitter(&self.emitters[i - self.lamps.len()], from, chance, u, i as u32),
        }
    }

    fn sky_light(&self, from: Vec3, u: [f32; 2]) -> Option<Incoming> {
        let (sky, chance) = self.sky.as_ref()?;
        let sample = sky.sample(u)?;
        let pdf = sample.pdf * chance;
        let target = from + sample.direction * SKY_DISTANCE;
        let (distance, gain, light) = (f32::INFINITY, sample.radiance / pdf, self.len() as u32 - 1);
        (pdf > 0.0).then_some(Incoming { direction: sample.direction, target, distance, gain, pdf, light })
    }

    /// Light of one of the shining primitives alone, chosen by power.
    pub fn sample_emitters(&self, from: Vec3, pick: f32, u: [f32; 2]) -> Option<Incoming> {
        let first = self.lamps.len();
        let before = if first == 0 { 0.0 } else { self.asked.ends.get(first - 1).copied()? };
        let share = 1.0 - before;
        let (i, _) = self.asked.pick(before + pick * share)?;
        let emitter = self.emitters.get(i.checked_sub(first)?)?;
        from_emitter(emitter, from, self.asked.chance(i) / share, u, i as u32)
    }

    /// Density with which [`Self::sample`] takes the point of a shining primitive that a ray met; 0 for one that is
    /// never sampled.
    pub fn pdf(&self, ray: &Ray, hit: &Hit, surface: &Surface) -> f32 {
        let key = |e: &Emitter| (e.primitive, e.element);
        let element = if hit.primitive < self.first_instance { 0 } else { hit.element };
        let Ok(i) = self.emitters.binary_search_by_key(&(hit.primitive, element), key) else { return 0.0 };
        let chance = self.asked.chance(self.lamps.len() + i) * self.earthly();
        chance * self.emitters[i].pdf(ray.origin, surface.point, surface.geometric_normal)
    }

    /// As [`Self::pdf`], of [`Self::sample_emitters`].
    pub fn pdf_emitters(&self, ray: &Ray, hit: &Hit, surface: &Surface) -> f32 {
        let first = self.lamps.len();
        let before = if first == 0 { 0.0 } else { self.asked.ends.get(first - 1).copied().unwrap_or(0.0) };
        self.pdf(ray, hit, surface) / ((1.0 - before) * self.earthly()).max(1e-9)
    }

    /// Density with which [`Self::sample`] takes a direction to the sky.
    pub fn sky_pdf(&self, direction: Vec3) -> f32 {
        self.sky.as_ref().map_or(0.0, |(sky, chance)| chance * sky.pdf(direction))
    }

    /// The pass of a light by its number.
    #[inline]
    pub fn pass(&self, light: u32) -> u32 {
        let light = light as usize;
        if let Some(lamp) = self.lamps.get(light) {
            return lamp.pass;
        }
        self.emitters.get(light - self.lamps.len()).map_or(self.surround_pass, |emitter| emitter.pass)
    }

    /// Lamps that rays meet, or those of the camera, with their numbers.
    #[inline(always)]
    pub fn met(&self, camera: bool) -> impl Iterator<Item = (usize, &Light)> {
        let lamps = self.surfaces.iter().map(|i| (*i as usize, &self.lamps[*i as usize]));
        lamps.filter(move |(_, lamp)| lamp.visible || !camera)
    }

    /// Every lamp that a ray crosses before it ends: radiance, distance, density of [`Self::sample`], and its pass.
    #[inline]
    pub fn crossed(&self, ray: &Ray, camera: bool, mut found: impl FnMut(Vec3, f32, f32, u32)) {
        for (i, lamp) in self.met(camera) {
            if let Some(t) = lamp.crossing(ray) {
                let asked = self.asked.chance(i) * self.earthly() * lamp.pdf(ray.direction, t);
                found(lamp.radiance(), t, asked, lamp.pass);
            }
        }
    }

    /// A photon: a light chosen by power, a point of it, a direction.
    pub fn emit(&self, pick: f32, at: [f32; 2], toward: [f32; 2]) -> Option<Emission> {
        let (i, rest) = self.sent.pick(pick)?;
        let chance = self.sent.chance(i);
        let Some(lamp) = self.lamps.get(i) else {
            let emitter = &self.emitters[i - self.lamps.len()];
            let surface = emitter.surface(at);
            let direction =
                Frame::new(surface.geometric_normal * emitter.side(rest)).to_world(cosine_hemisphere(toward));
            let power = emitter.radiance * (PI * emitter.area() * emitter.sides() / chance);
            return Some(Emission { ray: Ray::new(surface.leave(direction), direction), power });
        };
        if lamp.is_surface() {
            let side = if rest < 0.5 { lamp.normal } else { -lamp.normal };
            let direction = Frame::new(side).to_world(cosine_hemisphere(toward));
            // Radiance, pi and area of one side; twice that for both.
            let power = lamp.color * (2.0 * PI * PI / chance);
            return Some(Emission { ray: Ray::new(lamp.point(at), direction), power });
        }
        let direction = around(1.0 - 2.0 * toward[0], toward[1]);
        Some(Emission { ray: Ray::new(lamp.point(at), direction), power: lamp.color * (4.0 * PI * PI / chance) })
    }
}

fn from_lamp(lamp: &Light, from: Vec3, chance: f32, u: [f32; 2], light: u32) -> Option<Incoming> {
    let arrival = Lamps::<f32>::splat(lamp).sample(from.into(), chance, u);
    let Arrival { direction, target, distance, gain, pdf, good } = arrival;
    let (direction, target, gain) = (direction.into(), target.into(), gain.into());
    good.then_some(Incoming { direction, target, distance, gain, pdf, light })
}

fn from_emitter(emitter: &Emitter, from: Vec3, chance: f32, u: [f32; 2], light: u32) -> Option<Incoming> {
    let shining = emitter.sample(from, u)?;
    let offset = shining.point - from;
    let distance = offset.length();
    let direction = offset * (1.0 / distance);
    let pdf = shining.pdf * chance;
    let lit = distance > 0.0 && emitter.shines(shining.normal, -direction);
    lit.then(|| Incoming {
        direction,
        target: shining.point,
        distance: distance * SHORT_OF,
        gain: emitter.radiance / pdf,
        pdf,
        light,
    })
}
