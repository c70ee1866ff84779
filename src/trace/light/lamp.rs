//! Lamps: points and parallelograms.

use std::f32::consts::PI;

use glam::Vec3;

use super::cone::LampCone;
use super::linking::LightLinking;
use crate::trace::sampler::concentric_disk;
use crate::trace::simd::{Lanes, V3};
use crate::trace::soa::Ray;

/// A lamp resolved into world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// The middle, in the space that is traced; a unit direction for a distant lamp.
    pub center: Vec3,
    /// Edges of the parallelogram around the centre; both zero for a point.
    pub edges: [Vec3; 2],
    /// Unit normal of the parallelogram; zero for a point and where the edges span no area.
    pub normal: Vec3,
    /// Linear; what a surface gets at distance 1, over pi for one that falls off.
    pub color: Vec3,
    /// Where a point shines to.
    pub cone: LampCone,
    /// Whether it is so far away that its light comes from the direction `center`, which then is a unit vector; the edges
    /// span the disk that it is seen as from distance 1.
    pub distant: bool,
    /// Whether the light weakens with the square of the distance.
    pub inverse_square: bool,
    /// Whether camera rays see it.
    pub visible: bool,
    /// Whether rays meet it that left a surface.
    pub reflected: bool,
    /// What it lights, and how it is found.
    pub linking: LightLinking,
    /// The light group that its light is added up in; 0 is that of all that has none of its own.
    pub group: u32,
}

/// How far away the ends of shadow rays towards a distant lamp are: beyond every coordinate.
const DISTANT: f32 = 1e9;

/// The end of a shadow ray from a point towards a disk in the direction `center`, with half axes `a` and `b`.
#[inline(always)]
pub fn distant_target<L: Lanes>(from: V3<L>, center: V3<L>, [a, b]: [V3<L>; 2], uv: [L; 2]) -> V3<L> {
    let [x, y] = concentric_disk(uv);
    let toward = (center + a.scale(x) + b.scale(y)).normalize_or(center);
    from + toward.scale(L::splat(DISTANT))
}

impl Lamp {
    /// Whether it has no extent.
    pub fn is_point(&self) -> bool {
        self.edges == [Vec3::ZERO; 2]
    }

    /// Where light comes from that reaches a point, by (u, v) in the unit square.
    #[inline]
    pub fn target(&self, from: Vec3, uv: [f32; 2]) -> Vec3 {
        self.targets::<f32>(from.into(), uv).into()
    }

    /// The same for points side by side.
    #[inline(always)]
    pub fn targets<L: Lanes>(&self, from: V3<L>, [u, v]: [L; 2]) -> V3<L> {
        let (a, b) = (V3::splat(self.edges[0]), V3::splat(self.edges[1]));
        if self.distant {
            return distant_target(from, V3::splat(self.center), [a, b], [u, v]);
        }
        let half = L::splat(0.5);
        V3::splat(self.center) + a.scale(u - half) + b.scale(v - half)
    }

    /// The point of the light at (u, v) in the unit square.
    pub fn point(&self, [u, v]: [f32; 2]) -> Vec3 {
        self.center + self.edges[0] * (u - 0.5) + self.edges[1] * (v - 0.5)
    }

    /// Area of one side; 0 for a point.
    pub fn area(&self) -> f32 {
        // Not `length`: the root of `libm` is an instruction of its own kind that costs 200 cycles among those of AVX.
        self.edges[0].cross(self.edges[1]).length_squared().sqrt()
    }

    /// Whether it has a surface that rays meet and that shines as a surface does.
    #[inline]
    pub fn is_surface(&self) -> bool {
        self.inverse_square && self.normal != Vec3::ZERO
    }

    /// Whether rays that were scattered may find its light as well as samples do.
    #[inline]
    pub fn is_met(&self) -> bool {
        self.is_surface() && self.reflected && !self.linking.sampled_only
    }

    /// Radiance of the surface, to both sides.
    #[inline]
    pub fn radiance(&self) -> Vec3 {
        self.color * (PI / self.area())
    }

    /// Distance at which a ray crosses the parallelogram.
    pub fn crossing(&self, ray: &Ray) -> Option<f32> {
        let (t, met) = self.crossed::<f32>(ray.origin.into(), ray.direction.into(), ray.t_max);
        met.then_some(t)
    }

    /// As [`Self::crossing`]: distances, and whether there is one before the end.
    #[inline(always)]
    pub fn crossed<L: Lanes>(&self, origin: V3<L>, direction: V3<L>, end: L) -> (L, L::Mask) {
        let (zero, half, normal) = (L::splat(0.0), L::splat(0.5), V3::splat(self.normal));
        let facing = direction.dot(normal);
        let height = (V3::splat(self.center) - origin).dot(normal);
        let t = height / facing;
        let met = L::and(zero.lt(height * facing), L::and(zero.lt(t), t.lt(end)));
        // Most rays run away from it.
        if !L::any(met) {
            return (t, met);
        }
        let p = origin + direction.scale(t) - V3::splat(self.center);
        let (a, b) = (V3::splat(self.edges[0]), V3::splat(self.edges[1]));
        let across = a.cross(b).dot(normal);
        let (u, v) = (p.cross(b).dot(normal) / across, a.cross(p).dot(normal) / across);
        (t, L::and(met, L::and(u.abs().le(half), v.abs().le(half))))
    }

    /// Density per steradian of the parallelogram's points at this distance in this direction.
    #[inline]
    pub fn pdf(&self, direction: Vec3, distance: f32) -> f32 {
        distance * distance / (self.area() * self.normal.dot(direction).abs()).max(1e-30)
    }
}
