//! Columns -> accelerator, as good as the rays that are expected are worth.

use super::stage::{AccelKey, Stage};
use crate::components::{Integrator, Render};
use crate::trace::accel::Accelerator;
use crate::trace::integrator::SampleSubset;

/// Rays that a sample gives rise to, the camera's included, where it does not follow a path: more than most do, for too
/// poor a tree costs more than one that is too good.
const RAYS_PER_SAMPLE: f64 = 8.0;

/// Builds the accelerator if the columns or its settings changed, or if it serves more rays than it was built for; true
/// if it did. The World stands as a share of a picture's samples wants it.
pub fn update(stage: &mut Stage, share: SampleSubset, rebuilt: bool) -> bool {
    let settings = stage.settings();
    let key = AccelKey { choice: settings.accel, density: settings.grid_density };
    let of_picture = rays_of(&settings);
    let now = of_picture / f64::from(share.of);
    let at_most = of_picture * f64::from(stage.frames_left);
    let kept = &mut stage.derived;
    let before = kept.accelerator.as_ref().map(|(_, accelerator)| accelerator);
    // One that lasted so long is expected to last as long again, and the first one as long as there is anything to draw.
    let expected = if before.is_some() { kept.served.max(now).min(at_most) } else { at_most };
    let fits = kept
        .accelerator
        .as_ref()
        .is_some_and(|(known, accelerator)| *known == key && !accelerator.is_outgrown(expected));
    let is_new = rebuilt || !fits;
    if is_new {
        let built = Accelerator::rebuild(&kept.geometry, key.choice, key.density, expected, before);
        if !built.is_fitted() {
            kept.served = 0.0;
        }
        kept.accelerator = Some((key, built));
    }
    kept.served += now;
    is_new
}

/// Rays that a picture is expected to take: rather more than it does.
fn rays_of(settings: &Render) -> f64 {
    let pixels = f64::from(settings.size[0]) * f64::from(settings.size[1]);
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
