//! Pictures of a frame under other colours of its lights, made from what each emitter has given to one that was traced:
//! what somebody sees who changes a lamp, until the exact picture is there.
//!
//! Light adds up, as in [`light_mix`](super::reuse::light_mix), which makes exact pictures so. Here nobody has said
//! before which colours will change, and the picture may be clamped, or filtered of noise, after all lights came together.
//! So each emitter is traced in its own colour into a light group of its own while nothing else is to be done; and an
//! exact picture of the same frame is multiplied, pixel by pixel, by the ratio of the sums under the new colours and under
//! its own. Where samples are neither clamped nor filtered that is the picture, but for rounding and noise; else it is near.

use std::sync::atomic::AtomicBool;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::bands;
use super::fingerprint::{EmitterColor, Fingerprint};
use super::plan::PlannedFrame;
use super::{Shot, Slice, files, moments, shutter};
use crate::base::diagnostics::Diagnostics;
use crate::base::digest::Digest;
use crate::base::limits;
use crate::components::{Edit, Integrator, Render, Scene};
use crate::film::Film;
use crate::systems::{self, EmitterId, FrameStats, LightGroups, PartialFrame};

/// Samples of a pixel that sums are made of at most: ratios of them are less noisy than they are.
const MOST_SAMPLES: u32 = 64;

/// What each emitter of a frame gives to its picture.
pub(super) struct EmitterFilms {
    /// Of the frame, whatever colours its emitters have.
    common: Digest,
    /// The colours that they were traced in.
    colors: Vec<EmitterColor>,
    /// All the rest, then one for each emitter; none of a frame that is no sum over lights, or too large.
    films: Vec<Film>,
}

impl EmitterFilms {
    pub fn bytes(&self) -> usize {
        self.films.iter().map(|film| size_of_val(&*film.pixels)).sum()
    }

    /// Whether a picture is of the same frame, and there is something to relight it by.
    pub fn can_light(&self, picture: &LitPicture) -> bool {
        let count = self.films.first().map(|film| film.pixels.len());
        self.common == picture.common && count == Some(picture.film.pixels.len())
    }

    /// Whether they say all that there is to say of a frame.
    pub fn are_of(&self, fingerprint: &Fingerprint) -> bool {
        self.common == fingerprint.hash_without_colors()
    }
}

/// An exact picture of a frame.
pub(super) struct LitPicture {
    hash: Digest,
    common: Digest,
    /// Of its emitters, once somebody has asked.
    colors: Vec<EmitterColor>,
    film: Film,
    render: Render,
}

impl LitPicture {
    pub fn new(fingerprint: &Fingerprint, film: &Film, render: &Render) -> LitPicture {
        let Film { width, height, pixels, origin, .. } = film;
        let film = Film { origin: *origin, pixels: pixels.clone(), ..Film::new(*width, *height) };
        let (hash, common) = (fingerprint.hash(), fingerprint.hash_without_colors());
        LitPicture { hash, common, colors: Vec::new(), film, render: render.clone() }
    }

    /// Whether it is of a frame, whatever colours the emitters of both have.
    pub fn is_like(&self, fingerprint: &Fingerprint) -> bool {
        self.common == fingerprint.hash_without_colors()
    }

    /// With the colours of the scene that it is of; `None` if it is of another one.
    pub fn of(self, fingerprint: &Fingerprint, scene: &Scene) -> Option<LitPicture> {
        (self.hash == fingerprint.hash()).then(|| LitPicture { colors: emitters_of(scene), ..self })
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&*self.film.pixels)
    }
}

/// Everything in a scene that emits light, with its colour.
fn emitters_of(scene: &Scene) -> Vec<EmitterColor> {
    let lamps = scene.entities.iter().enumerate().flat_map(|(entity, desc)| {
        let color = move |c: &crate::components::Component| Some((EmitterId::Lamp(entity, c.kind()), c.light_color()?));
        desc.components().iter().filter_map(color)
    });
    let materials = scene.materials.iter().enumerate().map(|(i, (_, one))| (EmitterId::Material(i), one.emission));
    let around = (EmitterId::Environment, scene.render.environment_color().1);
    let all = lamps.chain(materials).chain([around]).filter(|(_, color)| *color != DVec3::ZERO);
    all.map(|(emitter, color)| EmitterColor { emitter, color }).collect()
}

/// The settings of a picture of which only sums of light are wanted.
fn plain(render: &Render) -> Render {
    let round = if render.noise_threshold.is_some() { render.min_samples } else { MOST_SAMPLES };
    let samples = render.samples.min(round);
    Render { aovs: Vec::new(), samples, denoise: false, noise_threshold: None, ..render.clone() }
}

impl Shot {
    /// Traces what each emitter gives to a frame; `None` if `cancel` was raised. There are no films of a frame that is no
    /// sum over lights, that has more than [`limits::LIGHT_GROUPS`] emitters, or whose films would take more than `room` bytes.
    ///
    /// # Errors
    /// The mistakes of the frame.
    pub(super) fn emitter_films(
        &mut self,
        planned: &PlannedFrame,
        scene: &Scene,
        room: u64,
        cancel: &AtomicBool,
    ) -> Result<Option<EmitterFilms>, Diagnostics> {
        let fingerprint = planned.fingerprint.as_ref().map_err(Clone::clone)?;
        let colors = emitters_of(scene);
        let mut found = EmitterFilms { common: fingerprint.hash_without_colors(), colors, films: Vec::new() };
        let groups = found.colors.len();
        let pixels = u64::from(fingerprint.size[0]) * u64::from(fingerprint.size[1]);
        let bytes = pixels * systems::bytes_of_pixel(&plain(&scene.render), groups + 1);
        let is_sum = scene.render.integrator != Integrator::Photon
            && !scene.materials.iter().any(|(_, material)| material.shadow_catcher);
        if !is_sum || !(1..=limits::LIGHT_GROUPS).contains(&groups) || bytes > room {
            return Ok(Some(found));
        }
        let emitters = found.colors.iter().map(|one| (one.emitter, 1.0)).collect();
        let light_groups = LightGroups { emitters, keep_colors: true };
        let mut partial = PartialFrame::default();
        partial.light_groups = light_groups;
        let Shot { stage, input, .. } = self;
        let mut slices = input.slices(planned.frame)?;
        for Slice { edits, .. } in &mut slices {
            let settings = plain(shutter::last_render(edits).unwrap_or(&input.settings));
            edits.push(Edit::Render(settings));
        }
        let parts = bands::settings_of(&slices, &input.settings).parts_of_moment();
        let mut whole = true;
        input.with_slices(stage, planned.frame, moments::refined(slices, parts), |stage, share| {
            files::load_all(stage)?;
            whole = systems::render_samples(stage, share, &mut partial, cancel, &|_, _| {})?;
            Ok(whole)
        })?;
        if !whole {
            return Ok(None);
        }
        found.films = partial.resolve()?.0;
        Ok(Some(found))
    }

    /// A frame with `trial` edits under other colours than those of the picture that is known, if nothing else differs.
    ///
    /// # Errors
    /// The mistakes of the frame.
    pub(super) fn relit(
        &mut self,
        frame: u32,
        trial: &[Edit],
        films: &EmitterFilms,
        known: &LitPicture,
    ) -> Result<Option<(Film, Render, FrameStats)>, Diagnostics> {
        if !films.can_light(known) {
            return Ok(None);
        }
        let mut slices = self.input.slices(frame)?;
        slices.iter_mut().for_each(|slice| slice.edits.extend(trial.iter().cloned()));
        let fingerprints: Vec<Fingerprint> = slices.iter().map(|slice| slice.fingerprint(&self.input.base)).collect();
        if !films.are_of(&Fingerprint::of_moments(&fingerprints)) {
            return Ok(None);
        }
        let mut edits = self.input.edits(frame)?;
        edits.extend(trial.iter().cloned());
        let scene = self.input.with_frame(&mut self.stage, frame, edits, |stage| Ok(systems::collect(stage)))?;
        let now = emitters_of(&scene);
        let (Some(new), Some(old)) = (factors(&films.colors, &now), factors(&films.colors, &known.colors)) else {
            return Ok(None);
        };
        let film = relit(&known.film, &films.films, &new, &old);
        let render = known.render.clone().with_environment_color(scene.render.environment_color().1);
        let stats = FrameStats { passes: films.films.len(), passes_kept: films.films.len(), ..FrameStats::default() };
        Ok(Some((film, render, stats)))
    }
}

/// What to multiply the light of each emitter by, from the colours that it was traced in to other ones; `None` if light
/// would have to come out of nothing.
fn factors(traced: &[EmitterColor], now: &[EmitterColor]) -> Option<Vec<Vec3>> {
    if now.iter().any(|one| traced.iter().all(|other| other.emitter != one.emitter)) {
        return None;
    }
    let factor = |one: &EmitterColor| {
        let color = now.iter().find(|other| other.emitter == one.emitter).map_or(DVec3::ZERO, |other| other.color);
        let of_channel = |k: usize| match (one.color[k], color[k]) {
            (0.0, 0.0) => Some(0.0),
            (0.0, _) => None,
            (then, now) => Some((now / then) as f32),
        };
        Some(Vec3::new(of_channel(0)?, of_channel(1)?, of_channel(2)?))
    };
    traced.iter().map(factor).collect()
}

/// A picture times the ratio of two sums of the emitters' films.
fn relit(known: &Film, films: &[Film], new: &[Vec3], old: &[Vec3]) -> Film {
    let sum = |pixel: usize, factors: &[Vec3]| {
        let all = films[1..].iter().zip(factors).map(|(film, factor)| Vec3::from(film.pixels[pixel]) * *factor);
        all.fold(Vec3::from(films[0].pixels[pixel]), |sum, light| sum + light)
    };
    let pixel = |(pixel, color): (usize, &[f32; 3])| {
        let (new, old) = (sum(pixel, new), sum(pixel, old));
        // Where there was no light there is nothing to multiply.
        [0, 1, 2].map(|k| if old[k] > 1e-6 { color[k] * (new[k] / old[k]) } else { color[k] + new[k] - old[k] })
    };
    let pixels = known.pixels.par_iter().enumerate().map(pixel).collect();
    Film { pixels, ..known.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn emitter(number: usize, color: [f64; 3]) -> EmitterColor {
        EmitterColor { emitter: EmitterId::Material(number), color: color.into() }
    }

    fn film(pixels: [[f32; 3]; 2]) -> Film {
        Film { pixels: pixels.to_vec(), ..Film::new(2, 1) }
    }

    #[test]
    fn a_picture_is_relit_in_proportion_to_what_each_emitter_gives() {
        let films = [film([[0.1; 3], [0.0; 3]]), film([[0.3; 3], [0.5; 3]]), film([[0.1; 3], [0.0; 3]])];
        let traced = [emitter(0, [2.0, 2.0, 2.0]), emitter(1, [1.0, 0.0, 1.0])];
        let same = factors(&traced, &traced).unwrap();
        let known = film([[0.5, 0.4, 0.5], [0.5; 3]]);
        let close = |a: &Film, b: [[f32; 3]; 2]| {
            a.pixels.iter().flatten().zip(b.as_flattened()).all(|(a, b)| (a - b).abs() < 1e-6)
        };
        assert!(close(&relit(&known, &films, &same, &same), [[0.5, 0.4, 0.5], [0.5; 3]]));
        let dimmed = factors(&traced, &[emitter(0, [1.0, 4.0, 2.0]), traced[1]]).unwrap();
        let expected = [[0.35, 0.7, 0.5], [0.25, 1.0, 0.5]];
        assert!(close(&relit(&known, &films, &dimmed, &same), expected));
        // An emitter that is gone, and back to where it was.
        let gone = factors(&traced, &[traced[1]]).unwrap();
        let dark = relit(&known, &films, &gone, &same);
        assert!(close(&dark, [[0.2, 0.1, 0.2], [0.0; 3]]));
        assert!(close(&relit(&dark, &films, &same, &gone), [[0.5, 0.4, 0.5], [0.5; 3]]));
    }

    #[test]
    fn light_does_not_come_out_of_nothing() {
        let traced = [emitter(0, [1.0, 0.0, 1.0])];
        assert!(factors(&traced, &[emitter(0, [1.0, 0.1, 1.0])]).is_none());
        assert!(factors(&traced, &[emitter(0, [2.0, 0.0, 0.0])]).is_some());
        assert!(factors(&traced, &[emitter(0, [1.0; 3]), emitter(7, [1.0; 3])]).is_none());
    }
}
