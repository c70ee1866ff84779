//! Energy, reciprocity, and whether evaluation, sampling and density tell the same story.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::microfacet::Microfacets;
use super::*;
use crate::components::{Fresnel, Material, Model};
use crate::trace::material::{ShadingParams, TransportMode, share};
use crate::trace::sampler::sobol;

const ROUGHNESS: [f64; 6] = [0.0, 0.1, 0.3, 0.5, 0.8, 1.0];
const COSINES: [f32; 6] = [1.0, 0.8, 0.5, 0.2, 0.05, 0.01];

fn bsdf(material: &Material, front: bool) -> Bsdf {
    Bsdf::new(&ShadingParams::from(material), front, Fresnel::Exact, TransportMode::Power)
}

fn white(model: Model, roughness: f64) -> Material {
    Material { model, roughness, color: DVec3::ONE, ior: Some(1.5), ..Material::default() }
}

/// White surfaces that are metal, plastic, glass and mixtures of these.
fn principled(roughness: f64) -> [(&'static str, Material); 7] {
    let base = white(Model::Principled, roughness);
    [
        ("plastic", base.clone()),
        ("metal", Material { metallic: 1.0, ..base.clone() }),
        ("half metal", Material { metallic: 0.5, ..base.clone() }),
        ("bare", Material { reflection: Some(0.0), ..base.clone() }),
        ("glass", Material { transmission: 1.0, ..base.clone() }),
        ("thin glass", Material { transmission: 1.0, thin: true, ..base.clone() }),
        ("mixed", Material { metallic: 0.3, transmission: 0.6, ..base }),
    ]
}

fn shiny(gloss: f64) -> Material {
    let color = DVec3::new(0.5, 0.4, 0.3);
    Material { color, specular: 0.4, shininess: 30.0, reflection: Some(0.3), gloss, ..Material::default() }
}

/// Every model at several widths, seen from both sides where there are two.
fn all() -> Vec<(String, Bsdf)> {
    let mut found = Vec::new();
    for roughness in ROUGHNESS {
        for model in [Model::Lambert, Model::Conductor, Model::Dielectric, Model::Plastic] {
            let front = format!("{model:?} {roughness}");
            found.push((format!("{front} back"), bsdf(&white(model, roughness), false)));
            found.push((front, bsdf(&white(model, roughness), true)));
        }
    }
    for roughness in ROUGHNESS {
        for (kind, material) in principled(roughness) {
            for front in [true, false] {
                found.push((format!("Principled {kind} {roughness} {front}"), bsdf(&material, front)));
            }
        }
    }
    for gloss in [0.0, 0.2, 1.0] {
        found.push((format!("BlinnPhong {gloss}"), bsdf(&shiny(gloss), true)));
        let glass = Material { transmission: 0.8, ior: Some(1.5), ..shiny(gloss) };
        found.push((format!("BlinnPhong glass {gloss}"), bsdf(&glass, true)));
        found.push((format!("BlinnPhong glass {gloss} back"), bsdf(&glass, false)));
    }
    found
}

fn viewer(cosine: f32) -> Vec3 {
    let r = (1.0 - cosine * cosine).max(0.0).sqrt();
    Vec3::new(r * 0.6, r * 0.8, cosine)
}

/// So many samples, four to the power of `digits`, by points that fill the cube evenly.
fn samples(b: &Bsdf, wo: Vec3, digits: u32) -> impl Iterator<Item = Option<BsdfSample>> {
    let key = |n: u64| crate::base::random::mix(n);
    (0..1 << (2 * digits)).map(move |i| b.sample(wo, sobol::pair(i, digits, key(1)), sobol::single(i, digits, key(2))))
}

fn albedo(b: &Bsdf, wo: Vec3) -> Vec3 {
    let sum: DVec3 = samples(b, wo, 6).flatten().map(|s| s.weight.as_dvec3()).sum();
    (sum / 4096.0).as_vec3()
}

#[test]
fn white_surfaces_give_back_what_arrives() {
    let mut wrong = Vec::new();
    for roughness in ROUGHNESS {
        for model in [Model::Lambert, Model::Conductor, Model::Dielectric, Model::Plastic] {
            for front in [true, false] {
                for cosine in COSINES {
                    let found = albedo(&bsdf(&white(model, roughness), front), viewer(cosine)).x;
                    // Close to the horizon the tables are coarse.
                    let tolerance = if cosine < 0.1 { 0.04 } else { 0.02 };
                    if (found - 1.0).abs() > tolerance {
                        wrong.push(format!("{model:?} {roughness} {front} {cosine}: {found}"));
                    }
                }
            }
        }
    }
    for roughness in ROUGHNESS {
        for (kind, material) in principled(roughness) {
            for (front, cosine) in [true, false].into_iter().flat_map(|front| COSINES.map(|cosine| (front, cosine))) {
                let found = albedo(&bsdf(&material, front), viewer(cosine)).x;
                let tolerance = if cosine < 0.1 { 0.06 } else { 0.03 };
                if (found - 1.0).abs() > tolerance {
                    wrong.push(format!("Principled {kind} {roughness} {front} {cosine}: {found}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Of indices between those of the tables too, from both sides, at the angles that matter.
#[test]
fn ground_glass_of_any_index_loses_nothing() {
    let mut wrong = Vec::new();
    for ior in [1.05, 1.1, 1.33, 1.7, 2.4] {
        for roughness in [0.2, 0.45, 0.7, 1.0] {
            for (front, cosine) in [(true, 0.9), (true, 0.35), (false, 0.8), (false, 0.4), (false, 0.15)] {
                let glass = Material { ior: Some(ior), ..white(Model::Dielectric, roughness) };
                let found = glass_albedo(&glass, front, cosine);
                if (found - 1.0).abs() > 0.003 {
                    wrong.push(format!("{ior} {roughness} {front} {cosine}: {found}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What ground glass gives back, by the midpoint rule over its facets: each of them reflects and lets through.
fn glass_albedo(glass: &Material, front: bool, cosine: f32) -> f32 {
    const ACROSS: u32 = 60;
    let (b, params) = (bsdf(glass, front), ShadingParams::from(glass));
    let facets = Microfacets { alpha: params.alpha };
    let eta = if front { params.ior } else { 1.0 / params.ior };
    let wo = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let at = |i: u32| (i as f32 + 0.5) / ACROSS as f32;
    let facet = |i: u32| {
        let u = [0.5 * at(i % ACROSS), at(i / ACROSS)];
        let reflected = share(wo.dot(facets.sample(wo, u)), eta);
        let weight = |lobe: f32| b.sample(wo, u, lobe).map_or(0.0, |sampled| sampled.weight.x);
        let through = if reflected < 1.0 { (1.0 - reflected) * weight(1.0) } else { 0.0 };
        f64::from(reflected * weight(0.0) + through)
    };
    ((0..ACROSS * ACROSS).map(facet).sum::<f64>() / f64::from(ACROSS * ACROSS)) as f32
}

#[test]
fn no_conserving_surface_gives_back_more() {
    for roughness in ROUGHNESS {
        for model in [Model::Conductor, Model::Plastic] {
            for color in [0.0, 0.2, 0.7] {
                let material = Material { color: DVec3::splat(color), ..white(model, roughness) };
                for cosine in COSINES {
                    let found = albedo(&bsdf(&material, true), viewer(cosine)).x;
                    assert!((0.0..=1.01).contains(&found), "{model:?} {roughness} {color} {cosine}: {found}");
                }
            }
        }
    }
}

#[test]
fn light_goes_both_ways_alike() {
    let pairs = [(0.9, 0.3), (0.5, 0.5), (0.1, 0.7), (0.02, 0.4)];
    for (name, b) in all() {
        if name.starts_with("Dielectric")
            || name.starts_with("BlinnPhong")
            || name.contains("glass")
            || name.contains("mixed")
        {
            continue;
        }
        for (o, i) in pairs {
            let (wo, wi) = (viewer(o), Vec3::new(-viewer(i).y, viewer(i).x * 0.5, 0.0));
            let wi = Vec3::new(wi.x, wi.y, i).normalize();
            let (there, back) = (b.eval(wo, wi) * wo.z, b.eval(wi, wo) * wi.z);
            assert!((there - back).length() <= 1e-3 * there.length().max(1e-6), "{name} {o} {i}: {there} {back}");
        }
    }
}

/// Through ground glass: equal but for the factors that give lost energy back, and the indices' ratio.
#[test]
fn light_goes_through_ground_glass_both_ways_alike() {
    for roughness in [0.3, 0.6, 1.0] {
        let (outside, inside) =
            (bsdf(&white(Model::Dielectric, roughness), true), bsdf(&white(Model::Dielectric, roughness), false));
        let alpha = (roughness * roughness) as f32;
        for (o, i) in [(0.9, 0.8), (0.5, 0.9), (0.3, 0.6)] {
            let (above, below) = (viewer(o), viewer(i) * -1.0);
            let turned = |v: Vec3| Vec3::new(v.x, v.y, -v.z);
            // Each side stands its own frame on its feet.
            let there = outside.eval(above, below) / below.z.abs() * tables::glass(above.z, alpha, 1.5);
            let back = inside.eval(turned(below), turned(above)) / above.z * tables::glass(below.z, alpha, 1.0 / 1.5);
            // f(o -> i) n_o^2 is symmetric for power, f(o -> i) / n_i^2 for radiance (Veach 1997, section 5.2).
            let (there, back) = (there.x, back.x);
            assert!(there > 0.0);
            assert!((there / back / 2.25 - 1.0).abs() < 1e-3, "{roughness} {o} {i}: {there} {back}");
        }
    }
}

/// A grid of the sphere: what the density says of a cell against how many samples fall into it.
#[test]
fn samples_fall_where_their_density_says() {
    const ACROSS: usize = 12;
    const DOWN: usize = 12;
    let digits = 7;
    let total = f64::from(1u32 << (2 * digits));
    for (name, b) in all() {
        for cosine in [0.95, 0.4, 0.05] {
            let wo = viewer(cosine);
            let mut counted = vec![0.0f64; ACROSS * DOWN];
            for sampled in samples(&b, wo, digits).flatten().filter(|s| !s.specular) {
                let turn = libm::atan2f(sampled.wi.y, sampled.wi.x) / (2.0 * PI) + 0.5;
                let cell = |x: f32, n: usize| ((x * n as f32) as usize).min(n - 1);
                let (across, down) = (cell(turn, ACROSS), cell((1.0 - sampled.wi.z) / 2.0, DOWN));
                counted[down * ACROSS + across] += 1.0 / total;
            }
            let fine = 24;
            let mut difference = 0.0;
            for (cell, counted) in counted.iter().enumerate() {
                let mut expected = 0.0f64;
                for k in 0..fine * fine {
                    let u = (cell % ACROSS) as f32 + ((k % fine) as f32 + 0.5) / fine as f32;
                    let v = (cell / ACROSS) as f32 + ((k / fine) as f32 + 0.5) / fine as f32;
                    let (z, phi) = (1.0 - 2.0 * v / DOWN as f32, (u / ACROSS as f32 - 0.5) * 2.0 * PI);
                    let r = (1.0 - z * z).sqrt();
                    let wi = Vec3::new(r * libm::cosf(phi), r * libm::sinf(phi), z);
                    expected += f64::from(b.pdf(wo, wi));
                }
                expected *= 4.0 * std::f64::consts::PI / (ACROSS * DOWN * fine * fine) as f64;
                difference += (expected - counted).abs();
            }
            // Peaks too narrow for the quadrature are left to the test of single samples below.
            let narrow = name.contains(" 0.1") || (name.contains(" 0.3") && cosine < 0.1);
            assert!(narrow || difference < 0.06, "{name} {cosine}: {difference}");
        }
    }
}

#[test]
fn samples_weigh_what_evaluation_and_density_say() {
    for (name, b) in all() {
        for cosine in COSINES {
            let wo = viewer(cosine);
            for sampled in samples(&b, wo, 4).flatten() {
                let BsdfSample { wi, weight, pdf, specular, transmitted } = sampled;
                assert!(weight.is_finite() && weight.min_element() >= 0.0 && wi.is_finite(), "{name} {sampled:?}");
                assert!((wi.length() - 1.0).abs() < 1e-3 && transmitted == (wi.z < 0.0), "{name} {sampled:?}");
                if specular {
                    continue;
                }
                let (value, density) = (b.eval(wo, wi), b.pdf(wo, wi));
                assert!((density / pdf - 1.0).abs() < 1e-3, "{name} {cosine}: {density} {pdf}");
                let off = (value - weight * pdf).length();
                // The half vector is found again from the directions: near the horizon that costs digits.
                assert!(off <= 0.02 * value.length() + 1e-4, "{name} {cosine} {wi}: {value} {}", weight * pdf);
            }
        }
    }
}

/// The square of the indices' ratio: only radiance is squeezed.
#[test]
fn only_radiance_is_squeezed_in_glass() {
    let glass = ShadingParams::from(&white(Model::Dielectric, 0.0));
    let weight = |transport, front| {
        let b = Bsdf::new(&glass, front, Fresnel::Exact, transport);
        b.sample(Vec3::Z, [0.5; 2], 0.99).unwrap().weight.x
    };
    assert_eq!(weight(TransportMode::Power, true), 1.0);
    assert!((weight(TransportMode::Radiance, true) - 1.0 / 2.25).abs() < 1e-6);
    assert!((weight(TransportMode::Radiance, true) * weight(TransportMode::Radiance, false) - 1.0).abs() < 1e-6);
}

/// Lambert's albedo as a closed form, and Fresnel's for the polished ones.
#[test]
fn albedos_have_their_closed_forms() {
    let matt = Material { color: DVec3::new(0.2, 0.5, 0.9), ..white(Model::Lambert, 0.0) };
    assert!((albedo(&bsdf(&matt, true), viewer(0.3)) - Vec3::new(0.2, 0.5, 0.9)).length() < 1e-5);
    let black = Material { color: DVec3::ZERO, ..white(Model::Plastic, 0.0) };
    assert!((albedo(&bsdf(&black, true), Vec3::Z).x - 0.04).abs() < 1e-4);
    let b = shiny(0.0);
    let found = albedo(&bsdf(&Material { specular: 0.0, ..b }, true), viewer(0.7));
    assert!((found - (Vec3::new(0.5, 0.4, 0.3) + 0.3)).length() < 2e-2, "{found}");
}
