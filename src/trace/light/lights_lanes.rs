//! One light of all towards points, one or eight side by side.

use super::lamp_lanes::{LampLanes, LightSampleBatch, LightSampleLanes};
use super::lights::Lights;
use super::sample::LightSample;
use crate::trace::simd::{LANES, Lanes, V3, lane, set_lane};

impl Lights {
    /// Light of one light, chosen by power, towards each point: as [`Self::sample`].
    #[inline(always)]
    pub fn sample_lanes<L: Lanes>(&self, from: V3<L>, pick: L, u: [L; 2]) -> LightSampleBatch<L> {
        let pick = &pick.store();
        // Lamps alone are sampled side by side.
        let Some(first) = self.lamps.first().filter(|_| L::COUNT > 1 && self.sky.is_none()) else {
            return self.one_by_one(from, pick, u);
        };
        let chance = self.direct.chance(0);
        if self.len() == 1 && chance > 0.0 {
            let all = LampLanes::splat(first).sample(from, L::splat(chance), u);
            return LightSampleBatch { all, lights: [0; LANES] };
        }
        let (mut lights, mut chances, mut lamps) = ([0; LANES], [1.0; LANES], [first; LANES]);
        let points = from.store();
        let mut alike = true;
        for i in 0..LANES {
            let Some((light, chance)) =
                self.choose(lane(&points, i), pick[i]).filter(|(light, _)| *light < self.lamps.len())
            else {
                return self.one_by_one(from, pick, u);
            };
            (lights[i], chances[i], lamps[i]) = (light as u32, chance, &self.lamps[light]);
            alike &= lights[i] == lights[0];
        }
        let columns = if alike { LampLanes::splat(lamps[0]) } else { LampLanes::gather(lamps) };
        LightSampleBatch { all: columns.sample(from, L::load(&chances), u), lights }
    }

    #[inline(always)]
    fn one_by_one<L: Lanes>(&self, from: V3<L>, pick: &[f32; LANES], u: [L; 2]) -> LightSampleBatch<L> {
        let (from, u) = (from.store(), [u[0].store(), u[1].store()]);
        let (mut vectors, mut numbers) = ([[[0.0; LANES]; 3]; 3], [[0.0; LANES]; 2]);
        let (mut lights, mut good) = ([0; LANES], 0);
        for i in 0..L::COUNT {
            let Some(light) = self.sample(lane(&from, i), pick[i], [u[0][i], u[1][i]]) else { continue };
            let LightSample { direction, target, distance, contribution, pdf, light } = light;
            for (column, v) in vectors.iter_mut().zip([direction, target, contribution]) {
                set_lane(column, i, v);
            }
            [numbers[0][i], numbers[1][i]] = [distance, pdf];
            lights[i] = light;
            good |= 1 << i;
        }
        let ([direction, target, contribution], [distance, pdf]) = (&vectors, &numbers);
        let all = LightSampleLanes {
            direction: V3::load(direction),
            target: V3::load(target),
            distance: L::load(distance),
            contribution: V3::load(contribution),
            pdf: L::load(pdf),
            good: L::mask(good),
        };
        LightSampleBatch { all, lights }
    }
}
