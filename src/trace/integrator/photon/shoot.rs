//! Photons from the lights to where they come to rest.

use glam::Vec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

use super::super::View;
use super::super::errand::{CLEAR, Errand, Wave};
use super::super::path;
use super::super::wave::Encounter;
use super::map::Photon;
use crate::base::limits;
use crate::base::random::combine;
use crate::trace::bsdf::{Bsdf, Transport};
use crate::trace::sampler::{Sampler, sobol};
use crate::trace::texture::Cone;
use crate::trace::{Counters, Hit, Hits, Ray, Worker};

/// Photons that are on their way together.
const CHUNK: u32 = 4096;

/// Photons at rest: those that came by mirrors and glass alone, and the rest. None of them comes straight from a light.
#[derive(Debug, Default)]
pub struct Landed {
    pub caustic: Vec<Photon>,
    pub diffuse: Vec<Photon>,
}

/// Sends `count` photons out; `None` if `cancel` was raised. The camera of the view plays no part.
///
/// Photon i is a function of the key, the count and i. They land in the order of chunks, and in each by the number of
/// their rays, then by i.
pub fn shoot(view: View, key: u64, count: u32, cancel: &AtomicBool) -> Option<(Landed, Counters)> {
    let chunk = |worker: &mut Worker, index: u32| {
        if cancel.load(Ordering::Relaxed) {
            return None;
        }
        let first = index * CHUNK;
        worker.start_tile();
        let landed = Flight::new(view, key, count).run(first..(first + CHUNK).min(count), worker);
        Some((landed, std::mem::take(&mut worker.counters)))
    };
    let chunks: Option<Vec<_>> = (0..count.div_ceil(CHUNK)).into_par_iter().map_init(Worker::default, chunk).collect();
    let (mut all, mut counters) = (Landed::default(), Counters::default());
    for (landed, cost) in chunks? {
        all.caustic.extend(landed.caustic);
        all.diffuse.extend(landed.diffuse);
        counters += cost;
    }
    Some((all, counters))
}

struct Flight<'a> {
    view: View<'a>,
    key: u64,
    count: u32,
    wave: Wave,
    next: Wave,
    hits: Hits,
    /// Of each photon of the chunk: what it left the lights with, and whether a matt surface has scattered it since.
    powers: Vec<Vec3>,
    scattered: Vec<bool>,
    landed: Landed,
}

impl<'a> Flight<'a> {
    fn new(view: View<'a>, key: u64, count: u32) -> Self {
        Flight {
            view,
            key,
            count,
            wave: Wave::default(),
            next: Wave::default(),
            hits: Hits::default(),
            powers: Vec::new(),
            scattered: Vec::new(),
            landed: Landed::default(),
        }
    }

    fn run(mut self, photons: std::ops::Range<u32>, worker: &mut Worker) -> Landed {
        self.emit(photons.clone());
        let view = self.view;
        // So many that what comes to rest stays within bounds.
        let most = view.settings.max_depth.min(1 + limits::PHOTONS_AT_REST / self.count);
        for rays in 1..=most {
            let under_way = self.wave.rays().len();
            worker.counters.photon_rays += under_way as u64;
            view.accelerator.closest_all(view.geometry, self.wave.rays(), worker, &mut self.hits);
            for i in 0..under_way {
                if let Some(hit) = self.hits.get(i) {
                    let (ray, errand) = self.wave.get(i);
                    if let Some((ray, errand)) = self.meet(photons.start, (ray, &hit), errand, rays, rays == most) {
                        self.next.push(ray, errand);
                    }
                }
            }
            std::mem::swap(&mut self.wave, &mut self.next);
            self.next.clear();
        }
        self.landed
    }

    fn emit(&mut self, photons: std::ops::Range<u32>) {
        let digits = sobol::digits(self.count);
        for photon in photons.clone() {
            let pair = |dimension: u64| sobol::pair(photon, digits, combine(self.key, dimension));
            let pick = sobol::single(photon, digits, combine(self.key, 0));
            let sent = self.view.lights.emit(pick, pair(1), pair(2));
            let power = sent.map_or(Vec3::ZERO, |sent| sent.power / self.count as f32);
            self.powers.push(power);
            self.scattered.push(false);
            if let Some(sent) = sent {
                self.wave.push(sent.ray, Errand::first(photon - photons.start, Cone::default()));
            }
        }
    }

    /// What becomes of a photon where it meets a surface: it may come to rest there, and it may go on.
    fn meet(
        &mut self,
        first: u32,
        (ray, hit): (Ray, &Hit),
        mut errand: Errand,
        rays: u32,
        last: bool,
    ) -> Option<(Ray, Errand)> {
        let view = self.view;
        let photon = errand.sample as usize;
        if errand.medium != CLEAR {
            errand.weight *= view.materials[errand.medium as usize].left_after(hit.t);
        }
        let mut surface = view.geometry.surface(&ray, hit);
        let mut material = &view.materials[surface.material as usize];
        errand.cone = errand.cone.at(hit.t);
        let dressed = view.skins.dress(view.geometry, (&ray, hit), errand.cone, &mut surface, material);
        if let Some(dressed) = &dressed {
            material = dressed;
        }
        let front = ray.direction.dot(surface.geometric_normal) < 0.0;
        let surface = if front { surface } else { surface.flipped() };
        let sampler = Sampler::new(self.key, first + errand.sample, 1);
        let met = Encounter { direction: ray.direction, errand, surface, material, front, sampler };
        let bsdf = Bsdf::new(material, front, view.settings.fresnel, Transport::Power);
        let (frame, wo) = met.frame();
        if rays > 1 && bsdf.is_matt() {
            let landed = Photon {
                position: surface.point,
                toward: -ray.direction,
                normal: surface.geometric_normal,
                power: self.powers[photon] * errand.weight,
                rays,
            };
            if self.scattered[photon] { &mut self.landed.diffuse } else { &mut self.landed.caustic }.push(landed);
        }
        if last {
            return None;
        }
        // Rays of photons are counted as such alone.
        let (onward, mut errand) = path::scatter(&met, &bsdf, &frame, wo, rays, &mut Counters::default())?;
        self.scattered[photon] |= errand.pdf > 0.0;
        // Light that is followed from the other end: smooth normals are not symmetric (Veach 1997, section 5.3.2).
        let [(true_in, smooth_in), (true_out, smooth_out)] =
            [-ray.direction, onward.direction].map(|d| (surface.geometric_normal.dot(d).abs(), frame.z.dot(d).abs()));
        let correction = smooth_in * true_out / (true_in * smooth_out).max(1e-6);
        errand.weight *= correction.min(MOST_CORRECTED);
        Some((onward, errand))
    }
}

/// Where a smooth normal and the true one part widely, no photon becomes so strong that it shows as a spot.
const MOST_CORRECTED: f32 = 8.0;
