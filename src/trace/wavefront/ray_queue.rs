//! Rays on their way with their path states, column by column.

use super::path_state::{PathState, PathStateLanes, PathStates};
use crate::trace::simd::{Lanes, V3};
use crate::trace::soa::{Ray, RayLanes, Rays};

/// Rays on their way, and their path states.
#[derive(Debug, Default)]
pub struct RayQueue {
    rays: Rays,
    states: PathStates,
}

impl RayQueue {
    /// Adds a ray.
    #[inline]
    pub fn push(&mut self, ray: Ray, state: PathState) {
        self.rays.push(ray);
        self.states.push(state);
    }

    /// Adds the endless rays of the lanes that have a bit.
    #[inline(always)]
    pub fn compress_store<L: Lanes>(
        &mut self,
        which: u32,
        origin: V3<L>,
        direction: V3<L>,
        states: &PathStateLanes<L>,
    ) {
        self.rays.compress_store(which, &RayLanes { origin, direction, t_max: L::splat(f32::INFINITY) });
        self.states.compress_store(which, states);
    }

    /// The rays alone.
    pub fn rays(&self) -> &Rays {
        &self.rays
    }

    /// What the rays carry.
    #[inline(always)]
    pub fn states(&self) -> &PathStates {
        &self.states
    }

    /// A ray with what it carries.
    #[inline(always)]
    pub fn get(&self, i: usize) -> (Ray, PathState) {
        (self.rays.get(i), self.states.get(i))
    }

    /// Replaces a ray and what it carries.
    pub fn set(&mut self, i: usize, ray: &Ray, state: &PathState) {
        self.rays.set(i, *ray);
        self.states.set(i, *state);
    }

    /// Replaces what a ray carries.
    pub fn set_state(&mut self, i: usize, state: &PathState) {
        self.states.set(i, *state);
    }

    /// Forgets all; memory stays.
    pub fn clear(&mut self) {
        self.rays.clear();
        self.states.clear();
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::components::{Material, Model};
    use crate::trace::material::ShadingParams;
    use crate::trace::material::texture::RayCone;
    use crate::trace::primitive::Tag;
    use crate::trace::sampler::RayNode;
    use crate::trace::simd::{Kernel, Wide, Width};
    use crate::trace::wavefront::medium_stack::{Crossing, MediumStack};
    use crate::trace::wavefront::path_state::{EmissionFilter, EmissionScope};

    fn state(i: u32) -> PathState {
        let x = i as f32;
        PathState {
            node: if i.is_multiple_of(3) {
                RayNode::CAMERA.scattered()
            } else {
                RayNode::CAMERA.reflected().refracted()
            },
            sample: 7 * i,
            throughput: Vec3::new(x, 0.5 * x, -x),
            cone: RayCone { width: 0.1 * x, spread: 0.01 * x },
            pdf: 2.0 * x,
            medium: if i.is_multiple_of(2) { MediumStack::AIR } else { in_glass(i) },
            scatterings: i as f32,
            scope: EmissionScope {
                filter: [EmissionFilter::All, EmissionFilter::DirectOnly, EmissionFilter::NonPhoton][i as usize % 3],
                receiver: i.checked_sub(4),
            },
        }
    }

    fn in_glass(material: u32) -> MediumStack {
        let glass = Material { model: Model::Dielectric, ior: Some(1.5), ..Material::default() };
        let materials = vec![ShadingParams::from(&glass); material as usize + 1];
        let tag = Tag { material, closed: true, ..Tag::default() };
        Crossing::new(&materials, MediumStack::AIR, tag, true).behind
    }

    fn ray(i: u32) -> Ray {
        Ray::new(Vec3::splat(i as f32), Vec3::X)
    }

    struct Copy<'a>(&'a RayQueue, &'a mut RayQueue);

    impl Kernel for Copy<'_> {
        type Output = ();

        #[inline(always)]
        fn run<L: Wide>(self) {
            let (from, to) = (self.0, self.1);
            let (origin, direction) = (from.rays().origin::<L>(2), from.rays().direction(2));
            let states = from.states().lanes::<L>(2);
            to.compress_store(0b1010_0110, origin, direction, &states.at(&states.each_node()));
            let turned = [9, 8, 7, 6, 5, 4, 3, 2];
            to.compress_store(0xff, origin, direction, &from.states().gather::<L>(&turned));
        }
    }

    #[test]
    fn path_states_are_the_same_in_rows_and_in_lanes() {
        let mut wave = RayQueue::default();
        (0..10).for_each(|i| wave.push(ray(i), state(i)));
        assert!((0..10).all(|i| wave.get(i as usize) == (ray(i), state(i))));
        for width in Width::all() {
            let mut copy = RayQueue::default();
            width.run(Copy(&wave, &mut copy));
            let got: Vec<_> = (0..copy.rays().len()).map(|i| copy.get(i)).collect();
            let some = [3, 4, 7, 9].map(|i| (ray(i), state(i)));
            let turned = (2..10).map(|i| (ray(i), state(11 - i)));
            assert_eq!(got, some.into_iter().chain(turned).collect::<Vec<_>>(), "{width:?}");
        }
    }
}
