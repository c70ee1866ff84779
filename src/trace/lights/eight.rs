//! Light of lamps towards points side by side.

use std::f32::consts::PI;

use super::{Incoming, Light, Lights};
use crate::trace::simd::{LANES, Lanes, V3, Wide, lane, set_lane};

/// A lamp in every lane.
#[derive(Clone, Copy, Debug)]
pub struct Lamps<L: Lanes> {
    center: V3<L>,
    edges: [V3<L>; 2],
    normal: V3<L>,
    color: V3<L>,
    area: L,
    inverse_square: L::Mask,
    surface: L::Mask,
}

/// As [`Incoming`], where it is `good`.
#[derive(Clone, Copy, Debug)]
pub struct Arrival<L: Lanes> {
    pub direction: V3<L>,
    pub target: V3<L>,
    pub distance: L,
    pub gain: V3<L>,
    pub pdf: L,
    pub good: L::Mask,
}

/// [`Arrival`] in eight lanes, and which lights it comes from.
pub struct Arrivals<L: Lanes> {
    pub all: Arrival<L>,
    pub lights: [u32; LANES],
}

impl<L: Lanes> Lamps<L> {
    /// The same lamp in all lanes.
    #[inline(always)]
    pub fn splat(lamp: &Light) -> Self {
        let zero = L::splat(0.0);
        let number = |yes: bool| if yes { 1.0 } else { 0.0 };
        Lamps {
            center: V3::splat(lamp.center),
            edges: [V3::splat(lamp.edges[0]), V3::splat(lamp.edges[1])],
            normal: V3::splat(lamp.normal),
            color: V3::splat(lamp.color),
            area: L::splat(lamp.area()),
            inverse_square: zero.lt(L::splat(number(lamp.inverse_square))),
            surface: zero.lt(L::splat(number(lamp.is_surface()))),
        }
    }

    /// Light from the point of each at `u` towards a point, where the lamp is chosen with this chance.
    #[inline(always)]
    pub fn sample(&self, from: V3<L>, chance: L, [u, v]: [L; 2]) -> Arrival<L> {
        let (zero, one, half) = (L::splat(0.0), L::splat(1.0), L::splat(0.5));
        let target = self.center + self.edges[0].scale(u - half) + self.edges[1].scale(v - half);
        let offset = target - from;
        let square = offset.dot(offset);
        let distance = square.sqrt();
        let direction = offset.scale(one / distance);
        let facing = self.normal.dot(direction).abs();
        let mut gain = self.color.scale(L::splat(PI) / chance);
        let weakened = V3 { x: gain.x / square, y: gain.y / square, z: gain.z / square };
        gain = V3::select(self.inverse_square, weakened, gain);
        gain = V3::select(self.surface, gain.scale(facing), gain);
        let pdf = distance * distance / (self.area * facing).max(L::splat(1e-30)) * chance;
        let pdf = L::select(self.surface, pdf, zero);
        let faces = L::either(zero.lt(facing), L::not(self.surface));
        Arrival { direction, target, distance, gain, pdf, good: L::both(zero.lt(square), faces) }
    }
}

impl<L: Wide> Lamps<L> {
    #[inline(always)]
    fn gather(lamps: [&Light; LANES]) -> Self {
        let mut columns = [[[0.0; LANES]; 3]; 5];
        let mut area = [0.0; LANES];
        let (mut inverse_square, mut surface) = (0, 0);
        for (i, lamp) in lamps.into_iter().enumerate() {
            let [a, b] = lamp.edges;
            for (column, v) in columns.iter_mut().zip([lamp.center, a, b, lamp.normal, lamp.color]) {
                set_lane(column, i, v);
            }
            area[i] = lamp.area();
            inverse_square |= u32::from(lamp.inverse_square) << i;
            surface |= u32::from(lamp.is_surface()) << i;
        }
        let [center, a, b, normal, color] = &columns;
        Lamps {
            center: V3::load(center),
            edges: [V3::load(a), V3::load(b)],
            normal: V3::load(normal),
            color: V3::load(color),
            area: L::load(&area),
            inverse_square: L::mask(inverse_square),
            surface: L::mask(surface),
        }
    }
}

impl Lights {
    /// As [`Self::sample`] for eight points.
    #[inline(always)]
    pub fn sample_eight<L: Wide>(&self, from: V3<L>, pick: &[f32; LANES], u: [L; 2]) -> Arrivals<L> {
        let Some(first) = self.lamps.first().filter(|_| self.sky.is_none()) else {
            return self.one_by_one(from, pick, u);
        };
        let chance = self.asked.chance(0);
        if self.len() == 1 && chance > 0.0 {
            let all = Lamps::splat(first).sample(from, L::splat(chance), u);
            return Arrivals { all, lights: [0; LANES] };
        }
        let (mut lights, mut chances, mut lamps) = ([0; LANES], [1.0; LANES], [first; LANES]);
        let mut alike = true;
        for i in 0..LANES {
            let Some((light, _)) = self.asked.pick(pick[i]).filter(|(light, _)| *light < self.lamps.len()) else {
                return self.one_by_one(from, pick, u);
            };
            (lights[i], chances[i], lamps[i]) = (light as u32, self.asked.chance(light), &self.lamps[light]);
            alike &= lights[i] == lights[0];
        }
        let columns = if alike { Lamps::splat(lamps[0]) } else { Lamps::gather(lamps) };
        Arrivals { all: columns.sample(from, L::load(&chances), u), lights }
    }

    #[inline(always)]
    fn one_by_one<L: Wide>(&self, from: V3<L>, pick: &[f32; LANES], u: [L; 2]) -> Arrivals<L> {
        let (from, u) = (from.store(), [u[0].store(), u[1].store()]);
        let (mut vectors, mut numbers) = ([[[0.0; LANES]; 3]; 3], [[0.0; LANES]; 2]);
        let (mut lights, mut good) = ([0; LANES], 0);
        for i in 0..LANES {
            let Some(light) = self.sample(lane(&from, i), pick[i], [u[0][i], u[1][i]]) else { continue };
            let Incoming { direction, target, distance, gain, pdf, light } = light;
            for (column, v) in vectors.iter_mut().zip([direction, target, gain]) {
                set_lane(column, i, v);
            }
            [numbers[0][i], numbers[1][i]] = [distance, pdf];
            lights[i] = light;
            good |= 1 << i;
        }
        let ([direction, target, gain], [distance, pdf]) = (&vectors, &numbers);
        let all = Arrival {
            direction: V3::load(direction),
            target: V3::load(target),
            distance: L::load(distance),
            gain: V3::load(gain),
            pdf: L::load(pdf),
            good: L::mask(good),
        };
        Arrivals { all, lights }
    }
}
