//! What facets give back of the light that arrives, as tables: single scattering loses the rest to other facets.
//!
//! Axes are the root of the cosine, the roughness (root of alpha) and, for glass, (n - 1) / (n + 1) of the index ahead
//! over the index behind. Filled when first asked for, from Sobol points over visible facets: those of mirrors at once,
//! those of glass index by index, since a scene has few.

use std::array::from_fn;
use std::sync::OnceLock;

use glam::Vec3;

use super::microfacet::{Microfacets, mirrored};
use crate::trace::material::{behind, share};
use crate::trace::sampler::sobol;

/// Steps along the cosine and the roughness.
const COSINES: usize = 32;

const WIDTHS: usize = 24;

/// Steps of the index, from -`FARTHEST_INDEX` to it: a quarter to 4, past which the last serves. Next to 1 the share of
/// light that is totally reflected changes fast with the index: with a fourth of these steps ground glass of index 1.1
/// lost 6 % at the rim of a ball.
const INDICES: usize = 49;

const FARTHEST_INDEX: f32 = 0.6;

/// Facets per node, a power of four, and a key for how they are scattered.
const POINTS: usize = 256;

const KEY: u64 = 0x5a17_ab1e_00fa_ce75;

type AlbedoPlane = [[f32; COSINES]; WIDTHS];

/// Of perfect mirrors, and the mean over the hemisphere.
struct Metal {
    all: AlbedoPlane,
    mean: [f32; WIDTHS],
}

/// Of glass of one index: reflected, its mean over the hemisphere, and reflected or let through.
struct Glass {
    reflected: AlbedoPlane,
    reflected_mean: [f32; WIDTHS],
    all: AlbedoPlane,
}

fn metals() -> &'static Metal {
    static TABLE: OnceLock<Metal> = OnceLock::new();
    TABLE.get_or_init(|| {
        let mut all = [[0.0; COSINES]; WIDTHS];
        each_node(|w, c, facet| all[w][c] += facet.mirrored);
        Metal { mean: mean(&all), all }
    })
}

/// The tables of one step of the index.
fn glass_of(index: usize) -> &'static Glass {
    static TABLES: [OnceLock<Glass>; INDICES] = [const { OnceLock::new() }; INDICES];
    TABLES[index].get_or_init(|| {
        let step = (index as f32 / (INDICES - 1) as f32 * 2.0 - 1.0) * FARTHEST_INDEX;
        let eta = (1.0 + step) / (1.0 - step);
        let (mut reflected, mut all): (AlbedoPlane, AlbedoPlane) = ([[0.0; COSINES]; WIDTHS], [[0.0; COSINES]; WIDTHS]);
        each_node(|w, c, facet| {
            let share = share(facet.wo.dot(facet.h), eta);
            let back = share * facet.mirrored;
            reflected[w][c] += back;
            all[w][c] += back + (1.0 - share) * facet.through(eta);
        });
        Glass { reflected_mean: mean(&reflected), reflected, all }
    })
}

/// A value of glass between two steps of the index.
fn at_index(eta: f32, value: impl Fn(&Glass) -> f32) -> f32 {
    let (i, f) = of_index(eta);
    value(glass_of(i)) * (1.0 - f) + value(glass_of(i + 1)) * f
}

/// A facet that `wo` sees, one of many.
struct Microfacet {
    facets: Microfacets,
    wo: Vec3,
    h: Vec3,
    /// Share of its mirrored light that gets away, over the number of facets.
    mirrored: f32,
}

impl Microfacet {
    /// As `mirrored`, of light that is bent.
    fn through(&self, eta: f32) -> f32 {
        let Some(wi) = behind(self.wo, self.h, eta).filter(|wi| wi.z < 0.0) else { return 0.0 };
        self.facets.seen_by_both(self.wo, wi) / self.facets.seen(self.wo) / POINTS as f32
    }
}

/// Calls `add` with every facet of every node of the tables.
fn each_node(mut add: impl FnMut(usize, usize, &Microfacet)) {
    let points: [[f32; 2]; POINTS] = from_fn(|i| sobol::pair(i as u32, POINTS.ilog2() / 2, KEY));
    for w in 0..WIDTHS {
        let width = w as f32 / (WIDTHS - 1) as f32;
        // The first row stands for the polished surface.
        let facets = Microfacets { alpha: (width * width).max(1e-4) };
        for c in 0..COSINES {
            let root = c as f32 / (COSINES - 1) as f32;
            let z = (root * root).max(1e-4);
            let wo = Vec3::new((1.0 - z * z).sqrt(), 0.0, z);
            for u in points {
                let h = facets.sample(wo, u);
                let wi = mirrored(wo, h);
                let seen = if wi.z > 0.0 { facets.seen_by_both(wo, wi) / facets.seen(wo) } else { 0.0 };
                add(w, c, &Microfacet { facets, wo, h, mirrored: seen / POINTS as f32 });
            }
        }
    }
}

/// The mean over the hemisphere, by the cosine.
fn mean(plane: &AlbedoPlane) -> [f32; WIDTHS] {
    const STEPS: usize = 64;
    from_fn(|w| {
        let at = |i: usize| {
            let z = (i as f32 + 0.5) / STEPS as f32;
            let (c, f) = place(z.sqrt(), COSINES);
            2.0 * z * (plane[w][c] * (1.0 - f) + plane[w][c + 1] * f)
        };
        (0..STEPS).map(at).sum::<f32>() / STEPS as f32
    })
}

/// Cell of a number in 0..1 on an axis of so many nodes, and how far along in it.
pub fn place(x: f32, nodes: usize) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0) * (nodes - 1) as f32;
    let cell = (x as usize).min(nodes - 2);
    (cell, x - cell as f32)
}

fn in_plane(plane: &AlbedoPlane, (c, fc): (usize, f32), (w, fw): (usize, f32)) -> f32 {
    let row = |w: usize| plane[w][c] * (1.0 - fc) + plane[w][c + 1] * fc;
    row(w) * (1.0 - fw) + row(w + 1) * fw
}

fn of_index(eta: f32) -> (usize, f32) {
    let step = (eta - 1.0) / (eta + 1.0);
    place((step / FARTHEST_INDEX + 1.0) * 0.5, INDICES)
}

fn of_cosine(z: f32) -> (usize, f32) {
    place(z.abs().sqrt(), COSINES)
}

fn of_alpha(alpha: f32) -> (usize, f32) {
    place(alpha.sqrt(), WIDTHS)
}

/// Share that mirrors as facets give back towards `z`.
pub fn metal(z: f32, alpha: f32) -> f32 {
    in_plane(&metals().all, of_cosine(z), of_alpha(alpha))
}

/// The same over the hemisphere.
pub fn metal_mean(alpha: f32) -> f32 {
    let (w, f) = of_alpha(alpha);
    let row = &metals().mean;
    row[w] * (1.0 - f) + row[w + 1] * f
}

/// Share that facets of glass reflect.
pub fn reflected(z: f32, alpha: f32, eta: f32) -> f32 {
    at_index(eta, |glass| in_plane(&glass.reflected, of_cosine(z), of_alpha(alpha)))
}

/// The same over the hemisphere.
pub fn reflected_mean(alpha: f32, eta: f32) -> f32 {
    let (w, fw) = of_alpha(alpha);
    at_index(eta, |glass| glass.reflected_mean[w] * (1.0 - fw) + glass.reflected_mean[w + 1] * fw)
}

/// Share that facets of glass reflect or let through.
pub fn glass(z: f32, alpha: f32, eta: f32) -> f32 {
    at_index(eta, |glass| in_plane(&glass.all, of_cosine(z), of_alpha(alpha)))
}
