//! The arithmetic of mirrors and glass.

use glam::Vec3;

use crate::components::Fresnel;
use crate::trace::simd::{Lanes, V3};

/// Direction of the mirror ray; `normal` is on either side, both unit.
pub fn reflect(direction: Vec3, normal: Vec3) -> Vec3 {
    direction - normal * (2.0 * direction.dot(normal))
}

/// Snell's law: the refracted direction, or `None` on total internal reflection.
///
/// `normal` faces against `direction`; `eta` is the index behind the ray over the index ahead of it. Unit vectors.
pub fn refract(direction: Vec3, normal: Vec3, eta: f32) -> Option<Vec3> {
    let cos_in = -direction.dot(normal);
    let sin2_out = eta * eta * (1.0 - cos_in * cos_in).max(0.0);
    if sin2_out >= 1.0 {
        return None;
    }
    let cos_out = (1.0 - sin2_out).sqrt();
    Some((direction * eta + normal * (eta * cos_in - cos_out)).normalize())
}

/// Share of unpolarised light that is reflected; 1 on total internal reflection.
///
/// `cos_in` is the cosine on the side that the ray comes from, `eta` as in [`refract`].
pub fn fresnel(model: Fresnel, cos_in: f32, eta: f32) -> f32 {
    fresnel_lanes(model, cos_in, eta)
}

/// As [`fresnel`], one or eight.
#[inline(always)]
pub fn fresnel_lanes<L: Lanes>(model: Fresnel, cos_in: L, eta: L) -> L {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let cos_in = cos_in.max(zero).min(one);
    let sin2_out = eta * eta * (one - cos_in * cos_in);
    let is_total = one.le(sin2_out);
    let cos_out = (one - sin2_out).sqrt();
    let share = if model == Fresnel::Schlick {
        let r0 = (eta - one) / (eta + one);
        let r0 = r0 * r0;
        // From the denser side the angle that counts is the one outside.
        let m = one - L::select(one.lt(eta), cos_out, cos_in);
        r0 + (one - r0) * (m * m * m * m * m)
    } else {
        let across = (eta * cos_in - cos_out) / (eta * cos_in + cos_out);
        let along = (cos_in - eta * cos_out) / (cos_in + eta * cos_out);
        (across * across + along * along) / L::splat(2.0)
    };
    L::select(is_total, one, share)
}

/// Fresnel reflectance for unpolarised light.
pub fn share(cosine: f32, eta: f32) -> f32 {
    fresnel(Fresnel::Exact, cosine, 1.0 / eta)
}

/// Fresnel reflectance of a metal for unpolarised light, per channel (Born and Wolf; in this form by Lagarde 2013).
pub fn metal_reflectance(cosine: f32, eta: Vec3, k: Vec3) -> Vec3 {
    let c2 = cosine * cosine;
    let s2 = 1.0 - c2;
    let (eta2, k2) = (eta * eta, k * k);
    let t0 = eta2 - k2 - Vec3::splat(s2);
    let both = (t0 * t0 + 4.0 * eta2 * k2).map(|x| x.max(0.0).sqrt());
    let a = ((both + t0) * 0.5).map(|x| x.max(0.0).sqrt());
    let (t1, t2) = (both + Vec3::splat(c2), a * (2.0 * cosine));
    let across = (t1 - t2) / (t1 + t2).max(Vec3::splat(1e-12));
    let (t3, t4) = (both * c2 + Vec3::splat(s2 * s2), t2 * s2);
    let along = across * (t3 - t4) / (t3 + t4).max(Vec3::splat(1e-12));
    (across + along) * 0.5
}

/// Mean Fresnel reflectance of a metal over the hemisphere, by the cosine: the midpoint rule, good to four digits.
pub fn mean_metal_reflectance(eta: Vec3, k: Vec3) -> Vec3 {
    const STEPS: u32 = 64;
    let at = |i: u32| {
        let cosine = (i as f32 + 0.5) / STEPS as f32;
        metal_reflectance(cosine, eta, k) * (2.0 * cosine)
    };
    (0..STEPS).map(at).sum::<Vec3>() / STEPS as f32
}

/// The direction in which `wo` goes on behind a facet; `None` where it is totally reflected.
pub fn behind(wo: Vec3, h: Vec3, eta: f32) -> Option<Vec3> {
    let (direction, passes) = behind_lanes::<f32>(wo.into(), h.into(), eta);
    passes.then(|| direction.into())
}

/// As [`behind`], one or eight: directions, and where there are any.
#[inline(always)]
pub fn behind_lanes<L: Lanes>(wo: V3<L>, h: V3<L>, eta: L) -> (V3<L>, L::Mask) {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let cos_o = wo.dot(h);
    let sin2 = (one - cos_o * cos_o).max(zero) / (eta * eta);
    let bent = V3 { x: wo.x / eta, y: wo.y / eta, z: wo.z / eta };
    ((h.scale(cos_o / eta - (one - sin2).sqrt()) - bent).normalize(), sin2.lt(one))
}

/// Factor of what goes through where the index changes by `eta`.
pub fn scale(eta: f32, transport: TransportMode) -> f32 {
    match transport {
        TransportMode::Radiance => 1.0 / (eta * eta),
        TransportMode::Power => 1.0,
    }
}

/// What a path carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransportMode {
    /// From the eye: radiance.
    Radiance,
    /// From a light: power.
    Power,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fresnel_has_its_known_values() {
        let glass = 1.0 / 1.5;
        for model in [Fresnel::Exact, Fresnel::Schlick] {
            assert!((fresnel(model, 1.0, glass) - 0.04).abs() < 1e-6);
            assert!((fresnel(model, 0.0, glass) - 1.0).abs() < 1e-5);
            assert_eq!(fresnel(model, 0.5, 1.5), 1.0);
        }
        assert_eq!(fresnel(Fresnel::Exact, 0.7, 1.0), 0.0);
        // Brewster's angle: only the polarisation across the plane is reflected; half of ((n^2-1)/(n^2+1))^2.
        let cos = 1.0 / (1.0 + 1.5f32 * 1.5).sqrt();
        let half = 0.5 * (1.25f32 / 3.25) * (1.25 / 3.25);
        assert!((fresnel(Fresnel::Exact, cos, glass) - half).abs() < 1e-6);
    }

    #[test]
    fn fresnel_is_the_same_from_both_sides() {
        for i in 1..100 {
            let cos_in = i as f32 / 100.0;
            let cos_out = (1.0 - (1.0 - cos_in * cos_in) / 2.25f32).sqrt();
            for model in [Fresnel::Exact, Fresnel::Schlick] {
                let (there, back) = (fresnel(model, cos_in, 1.0 / 1.5), fresnel(model, cos_out, 1.5));
                assert!((there - back).abs() < 1e-4, "{model:?} {cos_in} {there} {back}");
            }
        }
    }

    #[test]
    fn refraction_obeys_snell_and_total_reflection() {
        let normal = Vec3::Y;
        for degrees in [0.0f32, 20.0, 45.0, 80.0] {
            let a = degrees.to_radians();
            let direction = Vec3::new(a.sin(), -a.cos(), 0.0);
            let out = refract(direction, normal, 1.0 / 1.5).unwrap();
            assert!((out.x * 1.5 - a.sin()).abs() < 1e-5 && out.y < 0.0);
            assert_eq!(refract(direction, normal, 1.5).is_some(), 1.5 * a.sin() < 1.0);
        }
        assert_eq!(reflect(Vec3::new(0.6, -0.8, 0.0), normal), Vec3::new(0.6, 0.8, 0.0));
    }
}
