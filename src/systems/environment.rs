//! What lies around the scene -> the environment that rays find.
//!
//! Reused when: its file, or the clear sky that is asked for, is that of the frame before; turned and dimmed for free.

use std::sync::Arc;

use super::origin::render_origin;
use super::stage::Stage;
use super::textures;
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::components::{Daylight, Integrator, Render};
use crate::trace::light::environment::{Environment, EnvironmentMap, daylight_map};
use crate::trace::material::FogMedium;
use crate::trace::primitive::Bounds;

/// The environment that the settings ask for, from the file that was loaded for it; what sampling needs of it, if it is
/// to be `sampled`, is kept with it.
pub fn update(stage: &mut Stage, settings: &Render, sampled: bool) -> Result<Option<Environment>, Diagnostics> {
    let Render { environment_intensity: intensity, environment_rotation: rotation, .. } = *settings;
    let Some(key) = textures::environment_key(stage) else {
        if let Some(daylight) = &settings.daylight {
            return Ok(Some(daylight_of(stage, daylight, [intensity, rotation], sampled)));
        }
        let sky = settings.sky.map(|colors| EnvironmentMap::Sky(colors.map(|c| c.as_vec3())));
        return Ok(sky.map(|source| {
            let mut sky = Environment::new(source, intensity, rotation);
            if sampled {
                sky.prepare();
            }
            sky
        }));
    };
    let mut kept = match stage.derived.environment.take() {
        Some((known, kept)) if known == key => kept.placed(intensity, rotation),
        _ => {
            let loaded = stage.files.environment.as_ref().filter(|(known, _)| *known == key);
            let Some((_, source)) = loaded else {
                return Err(Diagnostic::bug(format!("the environment `{}` was not loaded", key.0)).into());
            };
            Environment::new(source.clone(), intensity, rotation)
        }
    };
    if sampled {
        kept.prepare();
    }
    stage.derived.environment = Some((key, kept.clone()));
    Ok(Some(kept))
}

/// The fog that the settings ask for, in the space that is traced.
pub fn fog(stage: &Stage, settings: &Render) -> Option<FogMedium> {
    let fog = settings.fog.as_ref().filter(|fog| fog.density > 0.0)?;
    let origin = render_origin(stage);
    let bounds = fog.bounds.map(|corners| Bounds::around(&corners.map(|corner| (corner - origin).as_vec3())));
    Some(FogMedium {
        density: fog.density as f32,
        color: fog.color.as_vec3(),
        anisotropy: fog.anisotropy as f32,
        bounds,
        scatters: settings.integrator == Integrator::Path,
    })
}

/// The environment of a clear sky, kept while that stays the same.
fn daylight_of(stage: &mut Stage, daylight: &Daylight, [intensity, rotation]: [f64; 2], sampled: bool) -> Environment {
    let kept = stage.derived.daylight.take().filter(|(known, _)| known == daylight);
    let mut sky = match kept {
        Some((_, kept)) => kept.placed(intensity, rotation),
        None => {
            let map = daylight_map(daylight.sun, daylight.turbidity, daylight.sun_size);
            Environment::new(EnvironmentMap::Sphere(Arc::new(map)), intensity, rotation)
        }
    };
    if sampled {
        sky.prepare();
    }
    stage.derived.daylight = Some((daylight.clone(), sky.clone()));
    sky
}
