//! The choice of an accelerator, and the front that all of them share.

use super::hidden::HiddenPrimitives;
use super::scratch::TraversalScratch;
use crate::components::Accel;
use crate::trace::accel::bvh::Bvh;
use crate::trace::accel::grid::Grid;
use crate::trace::accel::packet::{alone, each_packet};
use crate::trace::primitive::{ClosestHit, Geometry, PreparedRay, PrimitiveKind};
use crate::trace::simd::Width;
use crate::trace::soa::{Hit, Hits, Ray, Rays};

/// How rays find the primitives that they meet; every structure finds the same hits.
pub struct Accelerator {
    structure: Structure,
    /// What is not there for the rays that go by it.
    hidden: HiddenPrimitives,
}

enum Structure {
    /// Every primitive is asked.
    Brute,
    /// A uniform grid (Amanatides and Woo 1987; Cleary and Wyvill 1988).
    Grid(Box<Grid>),
    /// A hierarchy of boxes with eight children a node.
    Bvh(Box<Bvh>),
}

/// A tree from which nothing is hidden.
impl From<Bvh> for Accelerator {
    fn from(bvh: Bvh) -> Self {
        Accelerator { structure: Structure::Bvh(Box::new(bvh)), hidden: HiddenPrimitives::NONE }
    }
}

/// A grid from which nothing is hidden.
impl From<Grid> for Accelerator {
    fn from(grid: Grid) -> Self {
        Accelerator { structure: Structure::Grid(Box::new(grid)), hidden: HiddenPrimitives::NONE }
    }
}

impl Accelerator {
    /// `density` is in cells per primitive.
    pub fn build(geometry: &Geometry, choice: Accel, density: f64) -> Self {
        Self::rebuild(geometry, choice, density, f64::INFINITY, None, HiddenPrimitives::NONE)
    }

    /// As [`Self::build`], for as many rays as are expected to go through it: for few, a tree is built fast instead of
    /// well. What `before` holds of meshes that are still there is kept, and a tree whose primitives only
    /// moved is fitted to them while that is good enough. Costs of rays may depend on `before`, hits do not. Primitives
    /// that are `hidden` are not there.
    pub fn rebuild(
        geometry: &Geometry,
        choice: Accel,
        density: f64,
        rays: f64,
        before: Option<&Accelerator>,
        hidden: HiddenPrimitives,
    ) -> Self {
        let width = Width::detect();
        let structure = match choice {
            Accel::Brute => Structure::Brute,
            Accel::Grid => {
                let before =
                    before.and_then(|b| if let Structure::Grid(grid) = &b.structure { Some(&**grid) } else { None });
                Structure::Grid(Box::new(Grid::build(geometry, density, width, before, &hidden)))
            }
            // No choice to make: see "What was found".
            Accel::Auto | Accel::Bvh => {
                let refits = before.is_some_and(|before| before.hidden == hidden);
                let before =
                    before.and_then(|b| if let Structure::Bvh(bvh) = &b.structure { Some(&**bvh) } else { None });
                Structure::Bvh(Box::new(Bvh::build(geometry, width, rays, (before, refits), &hidden)))
            }
        };
        Accelerator { structure, hidden }
    }

    /// Every primitive is asked, whatever the geometry: what the others are held to.
    #[cfg(test)]
    pub fn brute() -> Self {
        Accelerator { structure: Structure::Brute, hidden: HiddenPrimitives::NONE }
    }

    /// What is not there for the rays that go by it.
    pub fn hidden(&self) -> &HiddenPrimitives {
        &self.hidden
    }

    /// Whether it is an older one that was fitted to primitives that moved.
    pub fn is_fitted(&self) -> bool {
        matches!(&self.structure, Structure::Bvh(bvh) if bvh.is_fitted)
    }

    /// Whether it was built for few rays, and would be built better for so many.
    pub fn is_outgrown(&self, rays: f64) -> bool {
        matches!(&self.structure, Structure::Bvh(bvh) if bvh.is_outgrown(rays))
    }

    /// Memory of the structure, without the primitives it is built over.
    pub fn bytes(&self) -> usize {
        match &self.structure {
            Structure::Brute => 0,
            Structure::Grid(grid) => grid.bytes(),
            Structure::Bvh(bvh) => bvh.bytes(),
        }
    }

    /// The accelerator as scenes and options call it.
    pub fn name(&self) -> &'static str {
        match &self.structure {
            Structure::Brute => "brute",
            Structure::Grid(_) => "grid",
            Structure::Bvh(_) => "bvh",
        }
    }

    /// The nearest hit before `t_max`.
    pub fn closest(&self, geometry: &Geometry, ray: &Ray, scratch: &mut TraversalScratch) -> Option<Hit> {
        let (skip, finite) = self.finite::<false>(geometry, ray, scratch);
        let ClosestHit { t, primitive, element, u, v, found } = finite;
        let finite = found.then_some(Hit { t: skip + t, primitive, element, u, v });
        self.with_planes(geometry, ray, finite, scratch)
    }

    /// [`Self::closest`] of many rays: those that go the same way cost less together.
    pub fn closest_all(&self, geometry: &Geometry, rays: &Rays, scratch: &mut TraversalScratch, hits: &mut Hits) {
        hits.reset(rays.len());
        match &self.structure {
            Structure::Brute => {
                rays.iter().enumerate().for_each(|(i, ray)| hits.set(i, self.closest(geometry, &ray, scratch)));
                return;
            }
            Structure::Grid(grid) => each_packet::<_, _, false>(&**grid, geometry, rays, scratch, hits),
            Structure::Bvh(bvh) => each_packet::<_, _, false>(&**bvh, geometry, rays, scratch, hits),
        }
        if !geometry.range(PrimitiveKind::Plane).is_empty() {
            for (i, ray) in rays.iter().enumerate() {
                hits.set(i, self.with_planes(geometry, &ray, hits.get(i), scratch));
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
        match &self.structure {
            Structure::Brute => {
                rays.iter().zip(blocked).for_each(|(ray, blocked)| *blocked = self.occluded(geometry, &ray, scratch));
                return;
            }
            Structure::Grid(grid) => each_packet::<_, _, true>(&**grid, geometry, rays, scratch, &mut blocked[..]),
            Structure::Bvh(bvh) => each_packet::<_, _, true>(&**bvh, geometry, rays, scratch, &mut blocked[..]),
        }
        if !geometry.range(PrimitiveKind::Plane).is_empty() {
            for (ray, blocked) in rays.iter().zip(blocked) {
                *blocked = *blocked || self.planes_block(geometry, &ray, scratch);
            }
        }
    }

    /// Whether anything lies between the origin and `t_max`: true exactly if [`Self::closest`] finds something.
    pub fn occluded(&self, geometry: &Geometry, ray: &Ray, scratch: &mut TraversalScratch) -> bool {
        self.planes_block(geometry, ray, scratch) || self.finite::<true>(geometry, ray, scratch).1.found
    }

    /// What a ray meets among the finite primitives: how far it was moved up to them, and its hit from there.
    #[inline]
    fn finite<const ANY: bool>(
        &self,
        geometry: &Geometry,
        ray: &Ray,
        scratch: &mut TraversalScratch,
    ) -> (f32, ClosestHit) {
        match &self.structure {
            Structure::Brute => {
                let (skip, ray) = geometry.approach(ray);
                let (probe, mut best) = (PreparedRay::from(&ray), ClosestHit::within(ray.t_max));
                for n in (0..geometry.finite()).filter(|n| !self.hidden.contains(*n)) {
                    scratch.counters.intersection_tests += 1;
                    geometry.intersect(n, &probe, &mut best);
                    if ANY && best.found {
                        break;
                    }
                }
                (skip, best)
            }
            Structure::Grid(grid) => alone::<_, ANY>(&**grid, geometry, ray, scratch),
            Structure::Bvh(bvh) => alone::<_, ANY>(&**bvh, geometry, ray, scratch),
        }
    }

    /// The nearer of the hit among the finite primitives and those of the planes.
    #[inline(always)]
    fn with_planes(
        &self,
        geometry: &Geometry,
        ray: &Ray,
        finite: Option<Hit>,
        scratch: &mut TraversalScratch,
    ) -> Option<Hit> {
        let mut best = match finite {
            Some(Hit { t, primitive, element, u, v }) => ClosestHit { t, primitive, element, u, v, found: true },
            None => ClosestHit::within(ray.t_max),
        };
        self.intersect_planes(geometry, ray, &mut best, scratch);
        let ClosestHit { t, primitive, element, u, v, found } = best;
        found.then_some(Hit { t, primitive, element, u, v })
    }

    /// Whether a plane lies between the origin and `t_max`.
    #[inline(always)]
    fn planes_block(&self, geometry: &Geometry, ray: &Ray, scratch: &mut TraversalScratch) -> bool {
        let mut best = ClosestHit::within(ray.t_max);
        self.intersect_planes(geometry, ray, &mut best, scratch);
        best.found
    }

    #[inline(always)]
    fn intersect_planes(&self, geometry: &Geometry, ray: &Ray, best: &mut ClosestHit, scratch: &mut TraversalScratch) {
        let planes = geometry.range(PrimitiveKind::Plane);
        if !planes.is_empty() {
            let probe = PreparedRay::from(ray);
            scratch.counters.intersection_tests += u64::from(planes.end - planes.start);
            planes.filter(|n| !self.hidden.contains(*n)).for_each(|n| geometry.intersect(n, &probe, best));
        }
    }
}
