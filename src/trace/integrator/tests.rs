//! Shares of samples, and shading side by side against shading one by one.

use glam::{DAffine3, DVec3, Vec3};

use super::*;
use crate::components::{Accel, Camera, Filter, Integrator, Material, Model, Render, Shadows};
use crate::film::{AccumulatorOptions, FilterTable, PixelAccumulator};
use crate::trace::accel::Accelerator;
use crate::trace::camera::CameraRays;
use crate::trace::counters::Counters;
use crate::trace::light::{Lamp, LampCone, LightLinking, Lights};
use crate::trace::material::ShadingParams;
use crate::trace::material::texture::{TextureBindings, TextureSet};
use crate::trace::primitive::{AffineMap, Geometry, LocalShape, ObjectSpace, Sides, SpherePrim, Tag};
use crate::trace::sampler::Sampler;
use crate::trace::simd::Width;
use crate::trace::wavefront::{RayAccelerators, RenderContext, Settings, Worker, any_has_holes};

#[test]
fn shares_are_a_fair_partition_of_the_samples() {
    for (strata, of) in [(1, 1), (2, 4), (3, 7), (4, 16), (4, 5), (6, 1)] {
        let mut sizes = vec![0u32; of as usize];
        for pixel in 0..4000 {
            let sampler = Sampler::new(3, pixel, strata);
            let mut seen = vec![false; (strata * strata) as usize];
            for index in 0..of {
                for sample in (SampleSubset { index, of }).samples(&sampler) {
                    assert!(!std::mem::replace(&mut seen[sample as usize], true));
                    sizes[index as usize] += 1;
                }
            }
            assert!(seen.iter().all(|s| *s), "{strata} {of}");
        }
        let mean = f64::from(4000 * strata * strata) / f64::from(of);
        assert!(sizes.iter().all(|n| (f64::from(*n) / mean - 1.0).abs() < 0.03), "{strata} {of}: {sizes:?}");
    }
    let whole: Vec<u32> = SampleSubset::WHOLE.samples(&Sampler::new(1, 2, 3)).collect();
    assert_eq!(whole, (0..9).collect::<Vec<_>>());
}

/// Something of every kind under lamps of every kind.
fn scene() -> (Geometry, Vec<ShadingParams>, Vec<Lamp>) {
    let diffuse = Material { color: DVec3::new(0.8, 0.4, 0.2), ..Material::default() };
    let bare = Material { diffuse: 0.0, specular: 0.0, ..diffuse.clone() };
    let materials = [
        diffuse.clone(),
        Material { specular: 0.5, reflection: Some(0.0), ..diffuse.clone() },
        Material { diffuse: 0.2, specular: 0.4, ..Material::default() },
        Material { model: Model::Lambert, ..diffuse.clone() },
        Material { transmission: 0.9, ior: Some(1.5), ..Material::default() },
        Material { specular: 0.3, gloss: 0.2, ..diffuse.clone() },
        Material { model: Model::Principled, metallic: 0.5, roughness: 0.4, ..diffuse.clone() },
        Material { model: Model::Principled, transmission: 0.7, roughness: 0.2, ..diffuse.clone() },
        Material { opacity: 0.4, ..diffuse },
        Material { reflection: Some(0.8), specular_color: DVec3::new(1.0, 0.9, 0.5), ..bare.clone() },
        Material { transmission: 0.9, ior: Some(1.5), ..bare.clone() },
        Material { model: Model::Dielectric, ior: Some(1.5), absorption: DVec3::new(0.1, 0.5, 0.9), ..bare.clone() },
        Material { model: Model::Conductor, roughness: 0.0, ..bare.clone() },
        Material {
            model: Model::Conductor,
            roughness: 0.0,
            eta: Some(DVec3::new(0.2, 0.4, 1.4)),
            k: Some(DVec3::new(3.9, 2.4, 1.6)),
            ..bare.clone()
        },
        Material { model: Model::Dielectric, ior: Some(1.33), ..bare.clone() },
        Material { model: Model::Dielectric, ior: Some(1.5), roughness: 0.4, ..bare.clone() },
        Material { model: Model::Conductor, roughness: 0.3, ..bare.clone() },
        Material { model: Model::Plastic, ior: Some(1.5), roughness: 0.2, diffuse: 1.0, ..bare },
    ];
    let tag = |material: u32| Tag { entity: material, material, sides: Sides::Both, closed: true };
    let mut geometry = Geometry::default();
    for i in 0..9u32 {
        geometry.push_sphere(tag(i), Vec3::new(i as f32 * 0.7 - 1.8, 0.3, (i % 3) as f32 * 0.5), 0.33);
    }
    for i in 9..14u32 {
        geometry.push_sphere(tag(i), Vec3::new((i - 9) as f32 * 0.7 - 1.4, 1.1, 0.4), 0.33);
    }
    for i in 15..18u32 {
        geometry.push_sphere(tag(i), Vec3::new((i - 15) as f32 * 0.9 - 1.0, 1.7, 0.2), 0.3);
    }
    // A drop in the marble.
    geometry.push_sphere(tag(14), Vec3::new(0.05, 1.05, 0.5), 0.15);
    let corners = [Vec3::new(-2.0, 0.0, -1.5), Vec3::new(2.0, 0.0, -1.5), Vec3::new(0.0, 2.0, -1.7)];
    geometry.push_triangle(tag(3), corners, Some([Vec3::Z, Vec3::new(0.3, 0.0, 1.0), Vec3::new(-0.2, 0.1, 1.0)]));
    geometry.push_box(tag(0), Vec3::new(1.0, 0.0, 0.8), Vec3::new(1.4, 0.5, 1.2));
    geometry.push_cone(tag(2), Vec3::new(-1.3, 0.0, 1.0), 0.3, Vec3::new(-1.3, 0.7, 1.0), 0.1, true);
    let turned = DAffine3::from_rotation_z(0.4) * DAffine3::from_scale(DVec3::new(0.5, 0.2, 0.3));
    geometry.push_transformed(
        tag(0),
        LocalShape::Sphere(SpherePrim { center: Vec3::new(0.0, 4.0, 0.0), radius: 1.0 }),
        &turned,
    );
    geometry.push_plane(tag(0), Vec3::ZERO, Vec3::Y);
    geometry.finish();
    let lamp = |center: Vec3, edges: [Vec3; 2], inverse_square: bool| Lamp {
        center,
        edges,
        normal: edges[0].cross(edges[1]).normalize_or_zero(),
        color: Vec3::new(3.0, 2.5, 2.0),
        cone: LampCone::EVERYWHERE,
        distant: false,
        inverse_square,
        visible: true,
        reflected: true,
        linking: LightLinking::default(),
        group: 0,
    };
    let lamps = vec![
        lamp(Vec3::new(2.0, 3.0, 3.0), [Vec3::ZERO; 2], false),
        lamp(Vec3::new(-1.0, 2.5, 1.0), [Vec3::X, Vec3::Z], true),
        lamp(Vec3::new(0.0, 3.0, 4.0), [Vec3::ZERO; 2], true),
        Lamp { cone: LampCone::new(Vec3::NEG_Y, 0.9, 0.7), ..lamp(Vec3::new(0.5, 2.0, 0.2), [Vec3::ZERO; 2], true) },
        Lamp {
            distant: true,
            normal: Vec3::ZERO,
            ..lamp(Vec3::new(0.6, 0.8, 0.0), [Vec3::Z * 0.05, Vec3::new(0.8, -0.6, 0.0) * 0.05], false)
        },
    ];
    (geometry, materials.iter().map(ShadingParams::from).collect(), lamps)
}

/// How hits of a picture are shaded.
#[derive(Clone, Copy, PartialEq)]
enum Shaded {
    /// Eight at a time.
    Together,
    /// The same, and noted for the film's layers.
    Noted,
    /// Each for itself, as what has textures.
    Alone,
}

/// The linear colours of a small picture, and how many rays it took.
fn picture(render: &Render, lanes: Width, shaded: Shaded) -> (Vec<[f32; 3]>, Counters) {
    let (geometry, materials, lamps) = scene();
    let mut textures = TextureBindings::default();
    if shaded == Shaded::Alone {
        let none = textures.add(TextureSet::default());
        let frame = ObjectSpace { map: AffineMap::new(&DAffine3::IDENTITY), center: None };
        (0..materials.len() as u32).for_each(|i| textures.put(i, i, &frame, false, none));
    }
    let features = shaded == Shaded::Noted;
    let accelerator = Accelerator::build(&geometry, Accel::Bvh, 1.0);
    let camera = Camera {
        from: DVec3::new(0.0, 1.5, 6.0),
        at: DVec3::new(0.0, 0.5, 0.0),
        fov: 40.0,
        aperture: 0.1,
        ..Camera::default()
    };
    let settings = Settings { features, ..Settings::new(render, 5) };
    let context = RenderContext {
        lights: &Lights::new(lamps, &geometry, &materials),
        geometry: &geometry,
        accelerators: RayAccelerators { camera: &accelerator, scattered: &accelerator, shadow: &[&accelerator] },
        materials: &materials,
        textures: &textures,
        camera: &CameraRays::new(&camera, [20, 15], 6.0),
        origin: Vec3::ZERO,
        motion: None,
        environment: None,
        fog: None,
        settings: &settings,
        holes: any_has_holes(&materials),
        glass: materials.iter().any(|material| material.is_clear()),
        absorbs: materials.iter().any(|material| material.absorbs()),
        catchers: materials.iter().any(|material| material.shadow_catcher),
        lanes,
        filter: &FilterTable::new(Filter::Tent, 2.0),
        width: 20,
        light_groups: 1,
        regions: None,
    };
    let places: Vec<[u32; 2]> = (0..300).map(|i| [i % 20, i / 20]).collect();
    let gather = AccumulatorOptions { signed: false, moments: false, features, halves: false };
    let mut tally = [PixelAccumulator::new(places.len(), gather)];
    let mut worker = Worker::default();
    render_pixels(Estimator { context, photons: None }, &places, SampleSubset::WHOLE, &mut tally, &mut worker);
    ((0..places.len()).map(|i| tally[0].color(i)).collect(), worker.traversal.counters)
}

fn settings(integrator: Integrator, samples: u32, shadows: Shadows) -> Render {
    Render { integrator, samples, shadows, max_depth: 4, ..Render::default() }
}

#[test]
fn side_by_side_is_as_one_by_one() {
    for samples in [1, 5, 16] {
        let render = settings(Integrator::Path, samples, Shadows::Auto);
        let (together, counted) = picture(&render, Width::detect(), Shaded::Together);
        let (alone, as_well) = picture(&render, Width::detect(), Shaded::Alone);
        for rays in [|c: &Counters| c.shadow_rays, |c: &Counters| c.reflection_rays, |c: &Counters| c.refraction_rays] {
            assert_eq!(rays(&counted), rays(&as_well), "{samples}");
        }
        assert!(counted.refraction_rays > 0 && counted.reflection_rays > 0);
        assert_eq!(together, alone, "{samples}");
    }
    for shadows in [Shadows::Fixed, Shadows::Random, Shadows::Jittered, Shadows::Hard] {
        for integrator in [Integrator::Whitted, Integrator::Distribution] {
            let render = settings(integrator, 4, shadows);
            let (together, counted) = picture(&render, Width::detect(), Shaded::Together);
            let (alone, as_well) = picture(&render, Width::detect(), Shaded::Alone);
            assert_eq!(counted.shadow_rays, as_well.shadow_rays, "{integrator:?} {shadows:?}");
            assert_eq!(counted.reflection_rays, as_well.reflection_rays, "{integrator:?} {shadows:?}");
            // Sums are taken in another order.
            for (a, b) in together.iter().flatten().zip(alone.iter().flatten()) {
                assert!((a - b).abs() <= 1e-5 * a.max(1.0), "{integrator:?} {shadows:?}: {a} {b}");
            }
        }
    }
}

#[test]
fn pictures_are_the_same_in_all_widths() {
    for integrator in [Integrator::Path, Integrator::Distribution, Integrator::Whitted] {
        let render = settings(integrator, 4, Shadows::Jittered);
        let (expected, _) = picture(&render, Width::detect(), Shaded::Together);
        assert!(expected.iter().flatten().sum::<f32>() > 10.0);
        for width in Width::all() {
            assert_eq!(picture(&render, width, Shaded::Together).0, expected, "{integrator:?} {width:?}");
        }
    }
}

#[test]
fn what_is_noted_for_the_film_changes_no_colour() {
    for integrator in [Integrator::Path, Integrator::Distribution, Integrator::Whitted] {
        let render = settings(integrator, 4, Shadows::Jittered);
        let (bare, counted) = picture(&render, Width::detect(), Shaded::Together);
        let (noted, as_well) = picture(&render, Width::detect(), Shaded::Noted);
        assert_eq!((bare, counted.shadow_rays), (noted, as_well.shadow_rays), "{integrator:?}");
    }
}
