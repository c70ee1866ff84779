//! Hits that are shaded side by side, eight at a time.

use super::View;
use super::errand::{Errands, Wave};
use super::wave::LEAST_FACING;
use crate::trace::Hits;
use crate::trace::geometry::EightHits;
use crate::trace::sampler::{Eight, Set};
use crate::trace::simd::{LANES, V3, Wide, set_lane, words_of};
use crate::trace::surface::Points;

/// A hit that is shaded beside others: indices of its ray and of its material.
pub type Place = [u32; 2];

/// What a wave met, and which of it is shaded side by side.
#[derive(Clone, Copy)]
pub struct Met<'a> {
    pub view: View<'a>,
    pub wave: &'a Wave,
    pub hits: &'a Hits,
    pub places: &'a [Place],
    pub samples: Set<'a>,
}

/// Eight hits, the last ones repeated where there are fewer.
pub struct Group<'a, L> {
    /// Cones are those at the hits.
    pub errands: Errands<L>,
    /// Of the rays.
    pub direction: V3<L>,
    /// Facing the rays.
    pub points: Points<L>,
    /// The normal that light is counted about on paths.
    pub normal: V3<L>,
    pub materials: [u32; LANES],
    pub albedo: V3<L>,
    pub samples: Eight<'a>,
    /// A bit for each lane that is in use.
    pub used: u32,
}

impl<'a> Met<'a> {
    #[inline(always)]
    pub fn group<L: Wide>(&self, places: &[Place]) -> Group<'a, L> {
        let (view, wave) = (self.view, self.wave);
        let (mut rays, mut materials) = ([0; LANES], [0; LANES]);
        let mut albedo = [[0.0; LANES]; 3];
        // A loop, not functions of arrays: see `Kernel::run`.
        for i in 0..LANES {
            let [ray, material] = places[i.min(places.len() - 1)];
            (rays[i], materials[i]) = (ray as usize, material);
            set_lane(&mut albedo, i, view.materials[material as usize].diffuse);
        }
        let (mut errands, origin, direction, hits): (Errands<L>, V3<L>, V3<L>, [L; 5]);
        if places.len() == LANES && rays[LANES - 1] - rays[0] == LANES - 1 {
            let first = rays[0];
            (origin, direction) = (wave.rays().origins(first), wave.rays().directions(first));
            (errands, hits) = (wave.errands(first), self.hits.rows(first));
        } else {
            (origin, direction, _) = wave.rays().gathered(&rays);
            (errands, hits) = (wave.errands_of(&rays), self.hits.gathered(&rays));
        }
        let [t, u, v, primitive, element] = hits;
        let points = view.geometry.surfaces(&EightHits {
            origin,
            direction,
            t,
            u,
            v,
            primitives: words_of(primitive),
            elements: words_of(element),
        });
        let points = points.facing(direction);
        errands.width = errands.width + errands.spread * t;
        let trusted = points.shading_normal.dot(direction).lt(L::splat(-LEAST_FACING));
        Group {
            direction,
            normal: V3::select(trusted, points.shading_normal, points.geometric_normal),
            points,
            materials,
            albedo: V3::load(&albedo),
            samples: self.samples.eight(words_of(errands.samples), errands.each_node()),
            errands,
            used: (1 << places.len()) - 1,
        }
    }
}
