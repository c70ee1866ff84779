//! Hits that are shaded side by side, eight at a time.

use super::View;
use super::wave::{Errand, LEAST_FACING, Sample, Wave};
use crate::trace::sampler::{Eight, Node, Sampler};
use crate::trace::simd::{LANES, V3, Wide, set_lane};
use crate::trace::surface::Points;
use crate::trace::texture::Cone;
use crate::trace::{Hit, Ray};

/// A hit that is shaded beside others: indices of its ray and of its material.
pub type Place = [u32; 2];

/// What a wave met, and which of it is shaded side by side.
#[derive(Clone, Copy)]
pub struct Met<'a> {
    pub view: View<'a>,
    pub wave: &'a Wave,
    pub hits: &'a [Option<Hit>],
    pub places: &'a [Place],
    pub samples: &'a [Sample],
}

/// Eight hits, the last ones repeated where there are fewer.
pub struct Group<'a, L> {
    pub errands: [&'a Errand; LANES],
    /// Of the rays.
    pub direction: V3<L>,
    /// Facing the rays.
    pub points: Points<L>,
    /// The normal that light is counted about on paths.
    pub normal: V3<L>,
    pub materials: [u32; LANES],
    pub albedo: V3<L>,
    /// Of the light that the rays bring home.
    pub weight: V3<L>,
    pub samples: Eight<'a>,
    /// A bit for each lane that is in use.
    pub used: u32,
    /// Lengths of the rays.
    t: [f32; LANES],
}

impl<'a> Met<'a> {
    #[inline(always)]
    pub fn group<L: Wide>(&self, places: &[Place]) -> Group<'a, L> {
        let (view, wave) = (self.view, self.wave);
        let first = places[0][0] as usize;
        let mut rays: [&Ray; LANES] = [&wave.rays()[first]; LANES];
        let mut errands: [&Errand; LANES] = [&wave.errands()[first]; LANES];
        let mut samplers: [&Sampler; LANES] = [&self.samples[0].1; LANES];
        let mut nodes = [Node::CAMERA; LANES];
        let mut hits = [Hit::default(); LANES];
        let (mut materials, mut t) = ([0; LANES], [0.0; LANES]);
        let [mut direction, mut albedo, mut weight] = [[[0.0; LANES]; 3]; 3];
        // A loop, not functions of arrays: see `Kernel::run`.
        for i in 0..LANES {
            let [ray, material] = places[i.min(places.len() - 1)];
            rays[i] = &wave.rays()[ray as usize];
            errands[i] = &wave.errands()[ray as usize];
            samplers[i] = &self.samples[errands[i].sample as usize].1;
            nodes[i] = errands[i].node;
            hits[i] = self.hits[ray as usize].unwrap_or_default();
            materials[i] = material;
            t[i] = hits[i].t;
            set_lane(&mut direction, i, rays[i].direction);
            set_lane(&mut albedo, i, view.materials[material as usize].diffuse);
            set_lane(&mut weight, i, errands[i].weight);
        }
        let direction = V3::<L>::load(&direction);
        let points = view.geometry.surfaces::<L>(rays, &hits).facing(direction);
        let trusted = points.shading_normal.dot(direction).lt(L::splat(-LEAST_FACING));
        Group {
            direction,
            normal: V3::select(trusted, points.shading_normal, points.geometric_normal),
            points,
            materials,
            albedo: V3::load(&albedo),
            weight: V3::load(&weight),
            samples: Eight::new(samplers, nodes),
            errands,
            used: (1 << places.len()) - 1,
            t,
        }
    }
}

impl<L> Group<'_, L> {
    /// The cone of a ray at its end.
    #[inline(always)]
    pub fn cone(&self, i: usize) -> Cone {
        self.errands[i].cone.at(self.t[i])
    }
}
