//! How a surface scatters light: one small value per hit, with evaluation, sampling and density.
//!
//! Directions are unit vectors that point away from the surface, in its own `Frame`: z is the shading normal on the
//! side of the viewer, so that `wo.z` is positive. `wi` lies below (z < 0) where light goes through. A value is a BSDF
//! in the usual measure, with 1 / pi in Lambert's law: a lamp of `color` c, whose light a diffuse surface turns into
//! `albedo * c * cosine`, has an irradiance of pi c straight before it.
//!
//! Light that goes through is scaled by the square of the indices' ratio where it is radiance that is followed, from
//! the eye, and not where it is power, from a light ([`TransportMode`](super::TransportMode); Veach 1997, section 5.2).
//!
//! | file | |
//! |---|---|
//! | `models` | [`Bsdf`]: all models as one value; evaluation, density, sampling |
//! | `blinn_phong` | Lambert, Blinn's highlight, a mirror that may be spread (gloss), and clear glass |
//! | `conductor`, `dielectric`, `plastic` | microfacet metal, glass polished or ground, a coat over a diffuse base |
//! | [`principled`](Principled) | metallic-roughness |
//! | `microfacet`, `tables` | GGX facets, and what they give back of what single scattering loses |
//! | `bsdf_sample` | [`BsdfSample`]: a direction that was sampled |

mod blinn_phong;
mod bsdf_sample;
mod conductor;
mod dielectric;
mod microfacet;
mod models;
mod plastic;
mod principled;
mod tables;

pub use bsdf_sample::BsdfSample;
pub use conductor::polished_metal;
pub use models::Bsdf;
pub use principled::Principled;

#[cfg(test)]
mod tests;
