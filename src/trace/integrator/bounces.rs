//! One wave after the other: find hits, shade them, trace their shadow rays, go on with the rays they gave rise to.

use glam::Vec3;

use super::fog::FogWay;
use super::photon::PhotonPass;
use super::{path, photon, whitted};
use crate::components::{Integrator, Model};
use crate::trace::accel::{Accelerator, TraversalScratch};
use crate::trace::counters::Counters;
use crate::trace::material::{HoleCoverage, ShadingParams};
use crate::trace::primitive::Tag;
use crate::trace::sampler::{RayNode, SampleSet, Sampler, power_heuristic};
use crate::trace::simd::LANES;
use crate::trace::soa::Hit;
use crate::trace::wavefront::{
    BlinnPhongKernel, ClassifyKernel, Crossing, EmissionFilter, LambertKernel, MixedKernel, PathState, PolishedKernel,
    RenderContext, ShadingInput, ShadingPlaces, ShadowRayQueue, SurfaceInteraction, WavefrontBuffers, Worker,
    accumulator_slot, first_hit_feature, is_blinn_phong, pass_surfaces, scattered_albedo, slot_sample,
    split_at_catchers, trace_shadow_rays,
};

/// Bins of shadow rays for lights that are chosen among: those to one light run alike.
const BINS: usize = 32;

/// Estimates the light along rays: what the frame is traced from, and what a pass of photon mapping knows of its light.
#[derive(Clone, Copy)]
pub struct Estimator<'a> {
    /// What is traced.
    pub context: RenderContext<'a>,
    /// The photon map that light is looked up in, if the integrator has one.
    pub photons: Option<&'a PhotonPass>,
}

/// Traces the camera rays of these samples in the buffers and all that follow from them.
pub fn trace(estimator: Estimator, samples: SampleSet, buffers: &mut WavefrontBuffers, worker: &mut Worker) {
    let Estimator { context, .. } = estimator;
    let bins = match context.settings.integrator {
        Integrator::Path | Integrator::Photon => context.lights.len().min(BINS),
        // One for what shines among the primitives.
        Integrator::Whitted | Integrator::Distribution => context.lights.lamps().len() + 1,
    };
    // What is stopped by other bodies has queues of its own.
    buffers.shadows.resize_with(bins * context.accelerators.shadow.len(), ShadowRayQueue::default);
    for depth in 1..=context.settings.max_depth {
        if buffers.wave.rays().is_empty() {
            return;
        }
        find((context, context.accelerators.at_depth(depth)), samples, buffers, worker);
        if depth == 1 {
            worker.traversal.counters.primary_hits += buffers.hits.found_count();
        }
        shade(estimator, samples, buffers, depth, worker);
        for (shadows, i) in buffers.shadows.iter_mut().zip(0..) {
            let accelerator = context.accelerators.shadow[i / bins.max(1)];
            trace_shadow_rays((context, accelerator), shadows, &mut buffers.blocked, &mut buffers.colors, worker);
        }
        std::mem::swap(&mut buffers.wave, &mut buffers.next);
        buffers.next.clear();
    }
}

fn find(
    (context, accelerator): (RenderContext, &Accelerator),
    samples: SampleSet,
    buffers: &mut WavefrontBuffers,
    worker: &mut Worker,
) {
    let WavefrontBuffers { wave, hits, colors, caught, .. } = buffers;
    accelerator.closest_all(context.geometry, wave.rays(), &mut worker.traversal, hits);
    let sampler = |slot: u32| *samples.sampler(slot_sample(slot));
    pass_surfaces((context, accelerator), wave, hits, sampler, worker);
    if context.catchers {
        split_at_catchers((context, accelerator), (wave, hits), sampler, (colors, caught), worker);
    }
    if let Some(regions) = context.regions {
        let ended = |(i, hit): (usize, Option<Hit>)| {
            let (ray, state) = wave.get(i);
            (ray, slot_sample(state.sample), hit.map_or(ray.t_max, |hit| hit.t))
        };
        worker.footprint.add(regions, hits.iter().enumerate().map(ended));
    }
}

fn shade(estimator: Estimator, samples: SampleSet, buffers: &mut WavefrontBuffers, depth: u32, worker: &mut Worker) {
    let Estimator { context, photons } = estimator;
    let path = context.settings.follows_paths();
    // Light of shining primitives in pictures that look for it beside that of lamps is found for each hit alone.
    let side_by_side = photons.is_none() && (path || context.lights.emitters().is_empty());
    let WavefrontBuffers { wave, hits, special, crossed, .. } = &mut *buffers;
    let lamps = path && context.lights.met(depth == 1).next().is_some();
    context.lanes.run(ClassifyKernel { context, wave, hits, lamps, camera: depth == 1, special, crossed });
    let mut places = std::mem::take(&mut buffers.places);
    places.clear();
    // Neighbours are mostly on one primitive, or at least of one material.
    let (mut primitive, mut tag, mut shading) = (u32::MAX, Tag::default(), Shading::Alone);
    let mut known = u32::MAX;
    for i in 0..buffers.wave.rays().len() {
        let is = |flags: &[u8]| flags[i / LANES] >> (i % LANES) & 1 == 1;
        if is(&buffers.special) {
            let crossed = is(&buffers.crossed);
            match arrive(estimator, samples, i, buffers, (depth, crossed), &mut worker.traversal.counters) {
                Arrival::Surface => {}
                Arrival::Nowhere => continue,
                Arrival::Scattered => {
                    if context.settings.features && depth == 1 {
                        // The film's layers look through fog.
                        shade_alone(estimator, samples, (i, Look::First), buffers, depth, &mut worker.traversal);
                    }
                    continue;
                }
            }
        }
        let met = buffers.hits.primitive(i);
        if met != primitive {
            (primitive, tag) = (met, context.geometry.tag(met));
            if tag.material != known {
                known = tag.material;
                let material = &context.materials[known as usize];
                shading = if side_by_side { Shading::of(context, material) } else { Shading::Alone };
            }
        }
        let to = match shading {
            _ if context.textures.is_textured(tag.entity) => None,
            Shading::Usual => Some(&mut places.usual),
            Shading::Polished => Some(&mut places.polished),
            Shading::Mixed => Some(&mut places.mixed),
            Shading::Alone => None,
        };
        let Some(to) = to else {
            shade_alone(estimator, samples, (i, Look::Whole), buffers, depth, &mut worker.traversal);
            continue;
        };
        to.push([i as u32, tag.material]);
        // What is seen in mirrors and through glass is noted too.
        if context.settings.features && buffers.wave.states().get(i).scatterings == 0.0 {
            shade_alone(estimator, samples, (i, Look::Noted), buffers, depth, &mut worker.traversal);
        }
    }
    shade_together((context, samples), &places, buffers, depth, &mut worker.traversal.counters);
    buffers.places = places;
}

/// Shades what is shaded side by side.
fn shade_together(
    (context, samples): (RenderContext, SampleSet),
    places: &ShadingPlaces,
    buffers: &mut WavefrontBuffers,
    depth: u32,
    counters: &mut Counters,
) {
    let WavefrontBuffers { wave, next, hits, shadows, .. } = buffers;
    let met = ShadingInput { context, wave, hits, places: &places.usual, samples };
    let last = depth == context.settings.max_depth;
    if !context.settings.follows_paths() {
        context.lanes.run(BlinnPhongKernel { met, last, shadows, next, counters });
        return;
    }
    context.lanes.run(LambertKernel { met, depth, shadows, next, counters });
    if !places.polished.is_empty() && !last {
        let met = ShadingInput { places: &places.polished, ..met };
        context.lanes.run(PolishedKernel { met, depth, next, counters });
    }
    if !places.mixed.is_empty() {
        let met = ShadingInput { places: &places.mixed, ..met };
        context.lanes.run(MixedKernel { met, depth, shadows, next, counters });
    }
}

/// How surfaces of a material are shaded.
#[derive(Clone, Copy)]
enum Shading {
    /// Side by side: those of Lambert's law on paths, those of Blinn-Phong's elsewhere.
    Usual,
    /// Side by side, on paths: mirrors and clear glass.
    Polished,
    /// Side by side, on paths: all that sends out no light.
    Mixed,
    /// One by one.
    Alone,
}

impl Shading {
    fn of(context: RenderContext, material: &ShadingParams) -> Shading {
        let path = context.settings.follows_paths();
        match if path { material.is_lambertian() } else { is_blinn_phong(context, material) } {
            true => Shading::Usual,
            false if !path || material.emission != Vec3::ZERO || material.model == Model::Unlit => Shading::Alone,
            false if material.is_polished() => Shading::Polished,
            false => Shading::Mixed,
        }
    }
}

/// What is done about a hit that is looked at alone.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Look {
    /// What the film's layers know of the first hit of a sample is noted.
    First,
    /// So is all else that the film is to know of a hit.
    Noted,
    /// It is shaded as well.
    Whole,
}

/// What becomes of a ray.
enum Arrival {
    /// It meets a surface.
    Surface,
    /// It leaves the scene.
    Nowhere,
    /// Fog scatters it first.
    Scattered,
}

/// Adds the light that a ray meets on its way, and takes what is absorbed.
fn arrive(
    estimator: Estimator,
    samples: SampleSet,
    i: usize,
    buffers: &mut WavefrontBuffers,
    (depth, crossed): (u32, bool),
    counters: &mut Counters,
) -> Arrival {
    let Estimator { context, .. } = estimator;
    let ((ray, mut state), hit) = (buffers.wave.get(i), buffers.hits.get(i));
    let met = hit.map_or(f32::INFINITY, |hit| hit.t);
    if crossed && state.scope.filter != EmissionFilter::NonPhoton {
        path::cross_lamps(context, &ray, met, &state, depth == 1, &mut buffers.colors);
    }
    if let Some(medium) = state.medium.material(context.materials) {
        if context.materials[medium as usize].absorbs() {
            state.throughput *= context.materials[medium as usize].transmittance(met);
            buffers.wave.set_state(i, &state);
        }
    } else if let Some(way) = context.fog.and_then(|fog| FogWay::new(fog, &ray, met)) {
        if hit.is_none() && state.node == RayNode::CAMERA && context.settings.transparent {
            buffers.veils[slot_sample(state.sample) as usize] = 1.0 - way.transmittance();
        }
        let sampler = *samples.sampler(slot_sample(state.sample));
        if pass_fog(context, &way, &mut state, &sampler, buffers, depth, counters) {
            return Arrival::Scattered;
        }
        buffers.wave.set_state(i, &state);
    }
    let WavefrontBuffers { colors, seen, .. } = buffers;
    if hit.is_none() {
        let place = accumulator_slot(state.sample, context.lights.environment_group());
        let is_left_out = context.settings.transparent && state.node == RayNode::CAMERA;
        let radiance = if is_left_out { Vec3::ZERO } else { environment(estimator, ray.direction, &state) };
        let light = state.throughput * radiance;
        if context.settings.features && state.scatterings == 0.0 {
            seen[slot_sample(state.sample) as usize].add(state.throughput, radiance, Vec3::ZERO);
        }
        colors[place as usize] += context.settings.clamps.limited(state.scatterings, light);
        return Arrival::Nowhere;
    }
    Arrival::Surface
}

/// Adds the light of fog on the way of a ray; true if it is scattered before its end.
fn pass_fog(
    context: RenderContext,
    way: &FogWay,
    state: &mut PathState,
    sampler: &Sampler,
    buffers: &mut WavefrontBuffers,
    depth: u32,
    counters: &mut Counters,
) -> bool {
    let WavefrontBuffers { next, shadows, colors, seen, .. } = buffers;
    let (fog, left) = (way.fog, way.transmittance());
    let is_seen = context.settings.features && state.scatterings == 0.0;
    if fog.scatters {
        way.sample_direct(context, state, sampler, shadows);
        let last = depth == context.settings.max_depth;
        let is_scattered = way.scatters((depth, last), state, sampler, next, counters);
        if is_scattered && is_seen {
            seen[slot_sample(state.sample) as usize].add(state.throughput, fog.color, Vec3::ZERO);
        }
        return is_scattered;
    }
    if is_seen {
        seen[slot_sample(state.sample) as usize].add(state.throughput * (1.0 - left), fog.color, Vec3::ZERO);
    }
    // What photons have told, or a surface scattered, has no share of the colour of fog.
    if state.scatterings == 0.0 || !context.settings.follows_paths() {
        let light = state.throughput * fog.color * (1.0 - left);
        let place = accumulator_slot(state.sample, 0);
        colors[place as usize] += context.settings.clamps.limited(state.scatterings, light);
    }
    state.throughput *= left;
    false
}

/// Shades what one ray met, of whatever material, or only notes what it is for the film's layers.
fn shade_alone(
    estimator: Estimator,
    samples: SampleSet,
    (i, look): (usize, Look),
    buffers: &mut WavefrontBuffers,
    depth: u32,
    traversal: &mut TraversalScratch,
) {
    let Estimator { context, photons } = estimator;
    let WavefrontBuffers { wave, hits, next, shadows, colors, features, seen, .. } = buffers;
    let Some(hit) = &hits.get(i) else { return };
    let (ray, mut state) = wave.get(i);
    let (ray, sampler) = (&ray, *samples.sampler(slot_sample(state.sample)));
    let mut surface = context.geometry.surface_point(ray, hit);
    let mut material = &context.materials[surface.material as usize];
    state.cone = state.cone.at(hit.t);
    let textured = context.textures.evaluate(context.geometry, (ray, hit), state.cone, &mut surface, material);
    if let Some(textured) = &textured {
        material = textured;
    }
    let is_lit = state.scope.receiver.is_none_or(|entity| context.lights.is_lit_by(surface.entity, entity));
    if material.emission != Vec3::ZERO && is_lit && look == Look::Whole {
        let asked = match context.settings.integrator {
            _ if state.pdf == 0.0 && state.scope.filter != EmissionFilter::NonPhoton => 0.0,
            Integrator::Path | Integrator::Photon => context.lights.pdf(ray, hit, &surface),
            Integrator::Whitted | Integrator::Distribution => context.lights.pdf_emitters(ray, hit, &surface),
        };
        // Photons come from the lights that are sampled.
        if state.scope.filter != EmissionFilter::NonPhoton || asked == 0.0 {
            let place = accumulator_slot(state.sample, material.group);
            let shown = material.emission * split_cover(context, material);
            let light = state.throughput * (shown * power_heuristic(state.pdf, asked));
            colors[place as usize] += context.settings.clamps.limited(state.scatterings, light);
        }
    }
    if material.model == Model::Unlit
        && look == Look::Whole
        && state.pdf == 0.0
        && state.scope.filter != EmissionFilter::NonPhoton
    {
        let shown = material.diffuse * split_cover(context, material);
        let light = context.settings.clamps.limited(state.scatterings, state.throughput * shown);
        colors[accumulator_slot(state.sample, 0) as usize] += light;
    }
    if context.lights.has_receivers() {
        state.scope.receiver = Some(surface.entity);
    }
    let front = ray.direction.dot(surface.geometric_normal) < 0.0;
    let surface = if front { surface } else { surface.flipped() };
    let crossing = Crossing::new(context.materials, state.medium, context.geometry.tag(hit.primitive), front);
    let nested = (crossing.ior != material.ior).then_some(ShadingParams { ior: crossing.ior, ..*material });
    let (material, behind) = (nested.as_ref().unwrap_or(material), crossing.behind);
    state.medium = crossing.before;
    let hit = *hit;
    let met = SurfaceInteraction { direction: ray.direction, state, surface, material, behind, hit, front, sampler };
    if context.settings.features && depth == 1 {
        features[slot_sample(state.sample) as usize] = Some(first_hit_feature(context, &met));
    }
    if look == Look::First {
        return;
    }
    if context.settings.features && state.scatterings == 0.0 {
        let albedo = scattered_albedo(material);
        if albedo != Vec3::ZERO {
            seen[slot_sample(state.sample) as usize].add(state.throughput, albedo, met.surface.shading_normal);
        }
    }
    if look == Look::Noted {
        return;
    }
    if let Some(photons) = photons {
        let color = &mut colors[state.sample as usize];
        photon::shade(context, photons, &met, depth, photon::PathOutput { color, shadows, next }, traversal);
    } else if context.settings.follows_paths() {
        path::shade(context, &met, depth, shadows, next, &mut traversal.counters);
    } else {
        let last = depth == context.settings.max_depth;
        whitted::shade(context, &met, last, shadows, next, &mut traversal.counters);
    }
}

/// How much of a surface is there for a ray that has met it and is followed both ways: elsewhere chance has decided.
fn split_cover(context: RenderContext, material: &ShadingParams) -> f32 {
    let is_split = context.settings.splits_holes && material.coverage == HoleCoverage::Partial;
    if is_split { material.opacity } else { 1.0 }
}

/// What a ray sees that leaves the scene, by its weight. Where the environment was sampled too, both look at the same
/// point.
fn environment(estimator: Estimator, direction: Vec3, state: &PathState) -> Vec3 {
    let Estimator { context, photons } = estimator;
    match context.environment {
        _ if state.pdf == 0.0 => context.surroundings(direction, state.cone),
        None => context.settings.background,
        Some(sky) => {
            let asked = match photons {
                Some(photons) if state.scope.filter == EmissionFilter::NonPhoton => photons.non_photon(),
                _ => context.lights,
            };
            sky.lookup(direction) * power_heuristic(state.pdf, asked.sky_pdf(direction))
        }
    }
}
