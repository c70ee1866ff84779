//! What facets give back of the light that arrives, as tables: single scattering loses the rest to other facets.
//!
//! Axes are the root of the cosine, the roughness (root of alpha) and, for glass, (n - 1) / (n + 1) of the index ahead
//! over the index behind, with most of its steps near 1. Filled row by row when first asked for, by the midpoint rule over
//! visible facets: a scene has few indices and roughnesses. Between the nodes and at them, what glass of any index from
//! 1.02 to 2.4 gives back is right to 0.3 %, 0.05 % on average; points that are scattered by chance err by a third of that
//! again where light is totally reflected.

use std::array::from_fn;
use std::sync::OnceLock;

use glam::Vec3;

use super::microfacet::{Microfacets, mirrored};
use crate::trace::material::{behind, share};

/// Steps along the cosine and the roughness.
const COSINES: usize = 32;

const WIDTHS: usize = 24;

/// Steps of the index, from -`FARTHEST_INDEX` to it: a quarter to 4, past which the last serves. Next to 1 the share of
/// light that is totally reflected changes fast with the index: with a tenth of these steps ground glass of index 1.1
/// lost 6 % at the rim of a ball. Nodes lie at the power 1.5 of even steps.
const INDICES: usize = 121;

const FARTHEST_INDEX: f32 = 0.6;

/// Facets per node along both coordinates of their sampling.
const ACROSS: usize = 48;

const POINTS: usize = ACROSS * ACROSS;

type AlbedoRow = [f32; COSINES];

/// By cosine: of perfect mirrors, and the mean over the hemisphere.
struct MetalRow {
    all: AlbedoRow,
    mean: f32,
}

/// By cosine, of glass: reflected, its mean over the hemisphere, and reflected or let through.
struct GlassRow {
    reflected: AlbedoRow,
    reflected_mean: f32,
    all: AlbedoRow,
}

/// Facets that are mirrors, of one width.
fn metal_row(width: usize) -> &'static MetalRow {
    static ROWS: [OnceLock<MetalRow>; WIDTHS] = [const { OnceLock::new() }; WIDTHS];
    ROWS[width].get_or_init(|| {
        let mut all = [0.0; COSINES];
        each_facet(width, |c, facet| all[c] += facet.mirrored);
        MetalRow { mean: mean(&all), all }
    })
}

/// Facets of glass, of one width and one step of the index.
fn glass_row(index: usize, width: usize) -> &'static GlassRow {
    static ROWS: [OnceLock<GlassRow>; INDICES * WIDTHS] = [const { OnceLock::new() }; INDICES * WIDTHS];
    ROWS[index * WIDTHS + width].get_or_init(|| {
        let along = index as f32 / (INDICES - 1) as f32 * 2.0 - 1.0;
        let step = along * along.abs().sqrt() * FARTHEST_INDEX;
        let eta = (1.0 + step) / (1.0 - step);
        let (mut reflected, mut all) = ([0.0; COSINES], [0.0; COSINES]);
        each_facet(width, |c, facet| {
            let share = share(facet.wo.dot(facet.h), eta);
            let back = share * facet.mirrored;
            reflected[c] += back;
            all[c] += back + (1.0 - share) * facet.through(eta);
        });
        GlassRow { reflected_mean: mean(&reflected), reflected, all }
    })
}

/// A value of glass between two steps of the index and two widths.
fn of_glass(alpha: f32, eta: f32, value: impl Fn(&GlassRow) -> f32) -> f32 {
    let ((i, fi), (w, fw)) = (of_index(eta), of_alpha(alpha));
    let at = |i: usize| value(glass_row(i, w)) * (1.0 - fw) + value(glass_row(i, w + 1)) * fw;
    at(i) * (1.0 - fi) + at(i + 1) * fi
}

/// A value of mirrors between two widths.
fn of_metal(alpha: f32, value: impl Fn(&MetalRow) -> f32) -> f32 {
    let (w, f) = of_alpha(alpha);
    value(metal_row(w)) * (1.0 - f) + value(metal_row(w + 1)) * f
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

/// Calls `add` with every facet of every cosine, for one width.
fn each_facet(w: usize, mut add: impl FnMut(usize, &Microfacet)) {
    // Seen from `wo` both halves of the turn are alike.
    let at = |i: usize| (i as f32 + 0.5) / ACROSS as f32;
    let points: [[f32; 2]; POINTS] = from_fn(|i| [0.5 * at(i % ACROSS), at(i / ACROSS)]);
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
            add(c, &Microfacet { facets, wo, h, mirrored: seen / POINTS as f32 });
        }
    }
}

/// The mean over the hemisphere, by the cosine.
fn mean(row: &AlbedoRow) -> f32 {
    const STEPS: usize = 64;
    let at = |i: usize| {
        let z = (i as f32 + 0.5) / STEPS as f32;
        2.0 * z * in_row(row, of_cosine(z))
    };
    (0..STEPS).map(at).sum::<f32>() / STEPS as f32
}

/// Cell of a number in 0..1 on an axis of so many nodes, and how far along in it.
pub fn place(x: f32, nodes: usize) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0) * (nodes - 1) as f32;
    let cell = (x as usize).min(nodes - 2);
    (cell, x - cell as f32)
}

fn in_row(row: &AlbedoRow, (c, f): (usize, f32)) -> f32 {
    row[c] * (1.0 - f) + row[c + 1] * f
}

fn of_index(eta: f32) -> (usize, f32) {
    let step = (eta - 1.0) / (eta + 1.0) / FARTHEST_INDEX;
    // The power of 2 / 3, with the sign.
    let along = libm::cbrtf(step * step).copysign(step);
    place((along + 1.0) * 0.5, INDICES)
}

fn of_cosine(z: f32) -> (usize, f32) {
    place(z.abs().sqrt(), COSINES)
}

fn of_alpha(alpha: f32) -> (usize, f32) {
    place(alpha.sqrt(), WIDTHS)
}

/// Share that mirrors as facets give back towards `z`.
pub fn metal(z: f32, alpha: f32) -> f32 {
    of_metal(alpha, |row| in_row(&row.all, of_cosine(z)))
}

/// The same over the hemisphere.
pub fn metal_mean(alpha: f32) -> f32 {
    of_metal(alpha, |row| row.mean)
}

/// Share that facets of glass reflect.
pub fn reflected(z: f32, alpha: f32, eta: f32) -> f32 {
    of_glass(alpha, eta, |row| in_row(&row.reflected, of_cosine(z)))
}

/// The same over the hemisphere.
pub fn reflected_mean(alpha: f32, eta: f32) -> f32 {
    of_glass(alpha, eta, |row| row.reflected_mean)
}

/// Share that facets of glass reflect or let through.
pub fn glass(z: f32, alpha: f32, eta: f32) -> f32 {
    of_glass(alpha, eta, |row| in_row(&row.all, of_cosine(z)))
}
