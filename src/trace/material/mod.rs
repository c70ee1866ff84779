//! Materials: how surfaces look and scatter.
//!
//! | room | |
//! |---|---|
//! | `params` | [`ShadingParams`]: a material with every weight multiplied out |
//! | `fog` | [`FogMedium`]: what air takes and scatters |
//! | `fresnel` | mirrors and glass: reflection, refraction, Fresnel's shares |
//! | [`bsdf`] | a file each: Blinn-Phong, conductor, dielectric, plastic, principled |
//! | [`texture`] | image and procedural textures, ray cones, bump and normal maps |

pub mod bsdf;
mod fog;
mod fresnel;
mod params;
pub mod texture;

pub use fog::FogMedium;
pub use fresnel::{
    TransportMode, behind, behind_lanes, fresnel, fresnel_lanes, mean_metal_reflectance, metal_reflectance, reflect,
    refract, scale, share,
};
pub use params::{HoleCoverage, MapValues, SMOOTH, ShadingParams};
