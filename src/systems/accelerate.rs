//! Columns -> accelerator, as good as the rays that are expected are worth.

use std::sync::Arc;

use super::stage::{AccelKey, BuiltAccelerator, Stage};
use crate::base::diagnostics::Diagnostic;
use crate::base::memory;
use crate::components::{Accel, Integrator, Render};
use crate::trace::accel::{Accelerator, HiddenPrimitives};
use crate::trace::integrator::SampleSubset;
use crate::trace::primitive::Geometry;

/// Rays that a sample gives rise to, the camera's included, where it does not follow a path: more than most do, for too
/// poor a tree costs more than one that is too good.
const RAYS_PER_SAMPLE: f64 = 8.0;

/// Accelerators over these columns, one for each set of primitives that is `hidden` in it; and how many of them are new.
///
/// Each is the one that was built before if columns, hidden primitives and settings are the same and it was built for as
/// many rays as are expected, or a new one.
///
/// `share` says for how many of a picture's samples the World stands as it does, `of_picture` what part of its pixels are
/// traced now, 0 to 1.
///
/// # Errors
/// More memory is needed than may be used.
pub fn update(
    stage: &mut Stage,
    share: SampleSubset,
    of_picture: f64,
    geometry: &Arc<Geometry>,
    hidden: &[HiddenPrimitives],
) -> Result<(Vec<Arc<Accelerator>>, u32), Diagnostic> {
    let (mut old, mut built, mut count) = (std::mem::take(&mut stage.derived.accelerators), Vec::new(), 0);
    for hidden in hidden {
        let same = old.iter().position(|before| before.accelerator.hidden() == hidden).map(|i| old.swap_remove(i));
        // Trees of meshes that are shared serve all of them.
        let model = old.first().or(built.first()).map(|other: &BuiltAccelerator| other.accelerator.clone());
        let (one, is_new) = update_one(stage, (share, of_picture), geometry, (same, model), hidden)?;
        count += u32::from(is_new);
        built.push(one);
    }
    let all = built.iter().map(|built| built.accelerator.clone()).collect();
    stage.derived.accelerators = built;
    Ok((all, count))
}

/// One of them; `before` is the one that hides the same, if there is one, and any other.
fn update_one(
    stage: &Stage,
    (share, of_picture): (SampleSubset, f64),
    geometry: &Arc<Geometry>,
    (before, other): (Option<BuiltAccelerator>, Option<Arc<Accelerator>>),
    hidden: &HiddenPrimitives,
) -> Result<(BuiltAccelerator, bool), Diagnostic> {
    let settings = stage.settings();
    let key = AccelKey { choice: settings.accel, density: settings.grid_density };
    let rays = rays_of(&settings);
    let now = rays * of_picture / f64::from(share.of);
    let at_most = rays * f64::from(stage.frames_left);
    // One that lasted so long is expected to last as long again, and the first one as long as there are frames.
    let expected = before.as_ref().map_or(at_most, |before| before.served.max(now).min(at_most));
    let fits = |built: &BuiltAccelerator| {
        std::ptr::eq(built.geometry.as_ptr(), Arc::as_ptr(geometry))
            && built.key == key
            && !built.accelerator.is_outgrown(expected)
    };
    let is_new = !before.as_ref().is_some_and(fits);
    let mut built = match before {
        Some(before) if !is_new => before,
        before => {
            check_memory(geometry.len() as u64, settings.accel)?;
            let known = before.as_ref().map(|before| &*before.accelerator).or(other.as_deref());
            let (choice, density) = (key.choice, key.density);
            let accelerator = Accelerator::rebuild(geometry, choice, density, expected, known, hidden.clone());
            // A tree that was only refitted goes on serving; a new one starts to.
            let served = before.filter(|_| accelerator.is_fitted()).map_or(0.0, |before| before.served);
            BuiltAccelerator { geometry: Arc::downgrade(geometry), key, accelerator: Arc::new(accelerator), served }
        }
    };
    built.served += now;
    Ok((built, is_new))
}

/// Bytes that an accelerator takes for each primitive while it is built: what is sorted, and what comes of it. Measured
/// on spheres and triangles, and rounded up.
fn check_memory(primitives: u64, accel: Accel) -> Result<(), Diagnostic> {
    let bytes = match accel {
        Accel::Brute => 64,
        Accel::Auto | Accel::Bvh => 160,
        Accel::Grid => 320,
    };
    memory::check(primitives * bytes, || format!("{primitives} primitives and the structure that finds them"))
}

/// Rays that a picture is expected to take: rather more than it does.
fn rays_of(settings: &Render) -> f64 {
    let [_, [width, height]] = settings.pixel_bounds();
    let pixels = f64::from(width) * f64::from(height);
    let samples = f64::from(settings.strata()) * f64::from(settings.strata()) * f64::from(settings.rounds());
    let depth = f64::from(settings.max_depth);
    let of_photons = f64::from(settings.photons) * f64::from(settings.photon_passes) * depth;
    match settings.integrator {
        Integrator::Whitted | Integrator::Distribution => pixels * samples * RAYS_PER_SAMPLE,
        // At every point of a path, one ray onwards and one to a light.
        Integrator::Path => pixels * samples * 2.0 * depth,
        Integrator::Photon => pixels * samples * RAYS_PER_SAMPLE + of_photons,
    }
}
