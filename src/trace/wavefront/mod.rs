//! Rays in waves: queues, and what happens to all rays of a queue at once. What a hit gives rise to is decided above,
//! in [`super::integrator`].
//!
//! | file | |
//! |---|---|
//! | `context` | [`RenderContext`]: everything that a frame is traced from; [`Settings`], resolved |
//! | `worker`, `buffers` | what one thread owns |
//! | `path_state`, `ray_queue` | what a ray carries, and rays on their way |
//! | `medium_stack` | the transparent bodies that a ray is in |
//! | `camera_rays` | the first rays of samples |
//! | `classify` | which rays want a look of their own |
//! | `interaction`, `batch` | hits to be shaded: one, and eight side by side |
//! | `shaded_hits` | [`ShadedHits`]: what shading asks of either, so that it is written once |
//! | `path_shading`, `lamp_shading` | that shading: of paths, and of Whitted and distribution pictures |
//! | `lambert`, `polished`, `mixed`, `blinn_phong` | the surfaces that are shaded eight at a time |
//! | `bodies` | the transparent bodies on both sides of eight of them |
//! | `slots` | where the light of samples is added up |
//! | `shadow_ray_queue`, `shadow_rays` | shadow rays, and what gets through |
//! | `holes` | surfaces that are not there everywhere, and the rays that go on behind them |
//! | `catchers` | surfaces that show shadows alone |
//! | `feature` | what a camera ray meets first, for the film's layers |

mod batch;
mod blinn_phong;
mod bodies;
mod buffers;
mod camera_rays;
mod catchers;
mod classify;
mod context;
mod feature;
mod holes;
mod interaction;
mod lambert;
mod lamp_shading;
mod medium_stack;
mod mixed;
mod path_shading;
mod path_state;
mod polished;
mod ray_queue;
mod shaded_hits;
mod shadow_ray_queue;
mod shadow_rays;
mod slots;
mod worker;

pub use batch::ShadingInput;
pub use blinn_phong::{BlinnPhongKernel, is_blinn_phong};
pub use buffers::{ShadingPlaces, WavefrontBuffers};
pub use camera_rays::CameraRayKernel;
pub use catchers::{caught_light, split_at_catchers};
pub use classify::ClassifyKernel;
pub use context::{LightSampling, Noise, RayAccelerators, RenderContext, Settings};
pub use feature::{first_hit_feature, scattered_albedo};
pub use holes::{any_has_holes, pass_surfaces};
pub use interaction::{SurfaceInteraction, shadow_ray_from};
pub use lambert::LambertKernel;
pub use lamp_shading::{BlinnPhongShading, LampShading, mirror_directions, push_mirrored, sample_lamp};
pub use medium_stack::{Crossing, MediumStack};
pub use mixed::MixedKernel;
pub use path_shading::{BsdfLanes, DirectionSample, MIN_ROULETTE_DEPTH, SpawnedRays, sample_direct, scatter};
pub use path_state::{EmissionFilter, EmissionScope, PathState};
pub use polished::PolishedKernel;
pub use ray_queue::RayQueue;
pub use shaded_hits::ShadedHits;
pub use shadow_ray_queue::ShadowRayQueue;
pub use shadow_rays::trace_shadow_rays;
pub use slots::{BATCH, accumulator_slot, slot_sample};
pub use worker::Worker;
