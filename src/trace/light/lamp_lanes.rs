//! Light of lamps towards points side by side.

use std::f32::consts::PI;

use super::cone::share;
use super::lamp::{Lamp, distant_target};
use crate::trace::simd::{LANES, Lanes, V3, set_lane};

/// A lamp in every lane.
#[derive(Clone, Copy, Debug)]
pub struct LampLanes<L: Lanes> {
    center: V3<L>,
    edges: [V3<L>; 2],
    normal: V3<L>,
    color: V3<L>,
    area: L,
    /// The cone: axis, and dark and scale.
    axis: V3<L>,
    dark: L,
    fade: L,
    distant: L::Mask,
    inverse_square: L::Mask,
    surface: L::Mask,
    /// Those among them that scattered rays find too.
    met: L::Mask,
}

/// As [`LightSample`], where it is `good`.
#[derive(Clone, Copy, Debug)]
pub struct LightSampleLanes<L: Lanes> {
    pub direction: V3<L>,
    pub target: V3<L>,
    pub distance: L,
    pub contribution: V3<L>,
    pub pdf: L,
    pub good: L::Mask,
}

/// [`LightSampleLanes`] in eight lanes, and which lights it comes from.
pub struct LightSampleBatch<L: Lanes> {
    pub all: LightSampleLanes<L>,
    pub lights: [u32; LANES],
}

impl<L: Lanes> LampLanes<L> {
    /// The same lamp in all lanes.
    #[inline(always)]
    pub fn splat(lamp: &Lamp) -> Self {
        let zero = L::splat(0.0);
        let number = |yes: bool| if yes { 1.0 } else { 0.0 };
        LampLanes {
            center: V3::splat(lamp.center),
            edges: [V3::splat(lamp.edges[0]), V3::splat(lamp.edges[1])],
            normal: V3::splat(lamp.normal),
            color: V3::splat(lamp.color),
            area: L::splat(lamp.area()),
            axis: V3::splat(lamp.cone.axis),
            dark: L::splat(lamp.cone.dark),
            fade: L::splat(lamp.cone.scale),
            distant: zero.lt(L::splat(number(lamp.distant))),
            inverse_square: zero.lt(L::splat(number(lamp.inverse_square))),
            surface: zero.lt(L::splat(number(lamp.is_surface()))),
            met: zero.lt(L::splat(number(lamp.is_met()))),
        }
    }

    /// Light from the point of each at `u` towards a point, where the lamp is chosen with this chance.
    #[inline(always)]
    pub fn sample(&self, from: V3<L>, chance: L, [u, v]: [L; 2]) -> LightSampleLanes<L> {
        let (zero, one, half) = (L::splat(0.0), L::splat(1.0), L::splat(0.5));
        let mut target = self.center + self.edges[0].scale(u - half) + self.edges[1].scale(v - half);
        if L::any(self.distant) {
            target = V3::select(self.distant, distant_target(from, self.center, self.edges, [u, v]), target);
        }
        let offset = target - from;
        let square = offset.dot(offset);
        let distance = square.sqrt();
        let direction = offset.scale(one / distance);
        let facing = self.normal.dot(direction).abs();
        let mut contribution = self.color.scale(L::splat(PI) / chance);
        let weakened = V3 { x: contribution.x / square, y: contribution.y / square, z: contribution.z / square };
        contribution = V3::select(self.inverse_square, weakened, contribution);
        contribution = V3::select(self.surface, contribution.scale(facing), contribution);
        // Exactly 1 for what is no spot.
        contribution = contribution.scale(share(-self.axis.dot(direction), self.dark, self.fade));
        let pdf = distance * distance / (self.area * facing).max(L::splat(1e-30)) * chance;
        let pdf = L::select(self.met, pdf, zero);
        let faces = L::or(zero.lt(facing), L::not(self.surface));
        LightSampleLanes { direction, target, distance, contribution, pdf, good: L::and(zero.lt(square), faces) }
    }
}

impl<L: Lanes> LampLanes<L> {
    #[inline(always)]
    pub(super) fn gather(lamps: [&Lamp; LANES]) -> Self {
        let mut columns = [[[0.0; LANES]; 3]; 6];
        let (mut area, mut dark, mut fade) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let (mut inverse_square, mut surface, mut met, mut distant) = (0, 0, 0, 0);
        for (i, lamp) in lamps.into_iter().enumerate() {
            let [a, b] = lamp.edges;
            for (column, v) in columns.iter_mut().zip([lamp.center, a, b, lamp.normal, lamp.color, lamp.cone.axis]) {
                set_lane(column, i, v);
            }
            (area[i], dark[i], fade[i]) = (lamp.area(), lamp.cone.dark, lamp.cone.scale);
            distant |= u32::from(lamp.distant) << i;
            inverse_square |= u32::from(lamp.inverse_square) << i;
            surface |= u32::from(lamp.is_surface()) << i;
            met |= u32::from(lamp.is_met()) << i;
        }
        let [center, a, b, normal, color, axis] = &columns;
        LampLanes {
            center: V3::load(center),
            edges: [V3::load(a), V3::load(b)],
            normal: V3::load(normal),
            color: V3::load(color),
            area: L::load(&area),
            axis: V3::load(axis),
            dark: L::load(&dark),
            fade: L::load(&fade),
            distant: L::mask(distant),
            inverse_square: L::mask(inverse_square),
            surface: L::mask(surface),
            met: L::mask(met),
        }
    }
}
