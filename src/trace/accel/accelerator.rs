//! The choice of an accelerator, and the front that all of them share.

use super::scratch::TraversalScratch;
use crate::components::Accel;
use crate::trace::accel::bvh::Bvh;
use crate::trace::accel::grid::Grid;
use crate::trace::accel::packet::{alone, each_packet};
use crate::trace::primitive::{ClosestHit, Geometry, PreparedRay, PrimitiveKind};
use crate::trace::simd::Width;
use crate::trace::soa::{Hit, Hits, Ray, Rays};

/// How rays find the primitives that they meet; every one finds the same hits.
pub enum Accelerator {
    /// Every primitive is asked.
    Brute,
    /// A uniform grid (Amanatides and Woo 1987; Cleary and Wyvill 1988).
    Grid(Box<Grid>),
    /// A hierarchy of boxes with eight children a node.
    Bvh(Box<Bvh>),
}

impl Accelerator {
    /// `density` is in cells per primitive.
    pub fn build(geometry: &Geometry, choice: Accel, density: f64) -> Self {
        Self::rebuild(geometry, choice, density, f64::INFINITY, None)
    }

    /// As [`Self::build`], for as many rays as are expected to go through it: for few, a tree is built fast instead of
    /// well. What `before` holds of meshes that are still there is kept, and a tree whose primitives only
    /// moved is fitted to them while that is good enough. Costs of rays may depend on `before`, hits do not.
    pub fn rebuild(geometry: &Geometry, choice: Accel, density: f64, rays: f64, before: Option<&Accelerator>) -> Self {
        let width = Width::detect();
        match choice {
            Accel::Brute => Accelerator::Brute,
            Accel::Grid => {
                let before = if let Some(Accelerator::Grid(grid)) = before { Some(&**grid) } else { None };
                Accelerator::Grid(Box::new(Grid::build(geometry, density, width, before)))
            }
            // No choice to make: see "What was found".
            Accel::Auto | Accel::Bvh => {
                let before = if let Some(Accelerator::Bvh(bvh)) = before { Some(&**bvh) } else { None };
                Accelerator::Bvh(Box::new(Bvh::build(geometry, width, rays, before)))
            }
        }
    }

    /// Whether it is an older one that was fitted to primitives that moved.
    pub fn is_fitted(&self) -> bool {
        matches!(self, Accelerator::Bvh(bvh) if bvh.is_fitted)
    }

    /// Whether it was built for few rays, and would be built better for so many.
    pub fn is_outgrown(&self, rays: f64) -> bool {
        matches!(self, Accelerator::Bvh(bvh) if bvh.is_outgrown(rays))
    }

    /// Memory of the structure, without the primitives it is built over.
    pub fn bytes(&self) -> usize {
        match self {
            Accelerator::Brute => 0,
            Accelerator::Grid(grid) => grid.bytes(),
            Accelerator::Bvh(bvh) => bvh.bytes(),
        }
    }

    /// The accelerator as scenes and options call it.
    pub fn name(&self) -> &'static str {
        match self {
            Accelerator::Brute => "brute",
            Accelerator::Grid(_) => "grid",
            Accelerator::Bvh(_) => "bvh",
        }
    }

    /// The nearest hit before `t_max`.
    pub fn closest(&self, geometry: &Geometry, ray: &Ray, scratch: &mut TraversalScratch) -> Option<Hit> {
        let (skip, finite) = self.finite::<false>(geometry, ray, scratch);
        let ClosestHit { t, primitive, element, u, v, found } = finite;
        let finite = found.then_some(Hit { t: skip + t, primitive, element, u, v });
        with_planes(geometry, ray, finite, scratch)
    }

    /// [`Self::closest`] of many rays: those that go the same way cost less together.
    pub fn closest_all(&self, geometry: &Geometry, rays: &Rays, scratch: &mut TraversalScratch, hits: &mut Hits) {
        hits.reset(rays.len());
        match self {
            Accelerator::Brute => {
                rays.iter().enumerate().for_each(|(i, ray)| hits.set(i, self.closest(geometry, &ray, scratch)));
                return;
            }
            Accelerator::Grid(grid) => each_packet::<_, _, false>(&**grid, geometry, rays, scratch, hits),
            Accelerator::Bvh(bvh) => each_packet::<_, _, false>(&**bvh, geometry, rays, scratch, hits),
        }
        if !geometry.range(PrimitiveKind::Plane).is_empty() {
            for (i, ray) in rays.iter().enumerate() {
                hits.set(i, with_planes(geometry, &ray, hits.get(i), scratch));
            }
        }
    }

    /// [`Self::occluded`] of many rays.
    pub fn occluded_all(
        &self,
        geometry: &Geometry,
        rays: &Rays,
        scratch: &mut TraversalScratch,
        blocked: &mut Vec<bool>,
    ) {
        blocked.resize(rays.len(), true);
        match self {
            Accelerator::Brute => {
                rays.iter().zip(blocked).for_each(|(ray, blocked)| *blocked = self.occluded(geometry, &ray, scratch));
                return;
            }
            Accelerator::Grid(grid) => each_packet::<_, _, true>(&**grid, geometry, rays, scratch, &mut blocked[..]),
            Accelerator::Bvh(bvh) => each_packet::<_, _, true>(&**bvh, geometry, rays, scratch, &mut blocked[..]),
        }
        if !geometry.range(PrimitiveKind::Plane).is_empty() {
            for (ray, blocked) in rays.iter().zip(blocked) {
                *blocked = *blocked || planes_block(geometry, &ray, scratch);
            }
        }
    }

    /// Whether anything lies between the origin and `t_max`: true exactly if [`Self::closest`] finds something.
    pub fn occluded(&self, geometry: &Geometry, ray: &Ray, scratch: &mut TraversalScratch) -> bool {
        planes_block(geometry, ray, scratch) || self.finite::<true>(geometry, ray, scratch).1.found
    }

    /// What a ray meets among the finite primitives: how far it was moved up to them, and its hit from there.
    #[inline]
    fn finite<const ANY: bool>(
        &self,
        geometry: &Geometry,
        ray: &Ray,
        scratch: &mut TraversalScratch,
    ) -> (f32, ClosestHit) {
        match self {
            Accelerator::Brute => {
                let (skip, ray) = geometry.approach(ray);
                let (probe, mut best) = (PreparedRay::from(&ray), ClosestHit::within(ray.t_max));
                for n in 0..geometry.finite() {
                    scratch.counters.intersection_tests += 1;
                    geometry.intersect(n, &probe, &mut best);
                    if ANY && best.found {
                        break;
                    }
                }
                (skip, best)
            }
            Accelerator::Grid(grid) => alone::<_, ANY>(&**grid, geometry, ray, scratch),
            Accelerator::Bvh(bvh) => alone::<_, ANY>(&**bvh, geometry, ray, scratch),
        }
    }
}

/// The nearer of the hit among the finite primitives and those of the planes.
#[inline(always)]
fn with_planes(geometry: &Geometry, ray: &Ray, finite: Option<Hit>, scratch: &mut TraversalScratch) -> Option<Hit> {
    let mut best = match finite {
        Some(Hit { t, primitive, element, u, v }) => ClosestHit { t, primitive, element, u, v, found: true },
        None => ClosestHit::within(ray.t_max),
    };
    intersect_planes(geometry, ray, &mut best, scratch);
    let ClosestHit { t, primitive, element, u, v, found } = best;
    found.then_some(Hit { t, primitive, element, u, v })
}

/// Whether a plane lies between the origin and `t_max`.
#[inline(always)]
fn planes_block(geometry: &Geometry, ray: &Ray, scratch: &mut TraversalScratch) -> bool {
    let mut best = ClosestHit::within(ray.t_max);
    intersect_planes(geometry, ray, &mut best, scratch);
    best.found
}

#[inline(always)]
fn intersect_planes(geometry: &Geometry, ray: &Ray, best: &mut ClosestHit, scratch: &mut TraversalScratch) {
    let planes = geometry.range(PrimitiveKind::Plane);
    if !planes.is_empty() {
        let probe = PreparedRay::from(ray);
        scratch.counters.intersection_tests += u64::from(planes.end - planes.start);
        planes.for_each(|n| geometry.intersect(n, &probe, best));
    }
}
