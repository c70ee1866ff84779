//! How much of the disk around a point that photons are looked for in is surface at all.
//!
//! Density is power over area. Where the surface ends at a wall, at an edge or under another body, no photons lie beyond,
//! and the area of the whole disk would be too much: pictures get dark along edges and in corners. So rays along the surface
//! tell in eight directions how far it goes on: it ends where a ray that rises slowly from the point meets something
//! opaque, or where nothing of the kind of surface that photons count on lies below that ray. The ends are joined to a
//! polygon; photons outside of it do not count (those behind a thin wall belong to another room), and the density is
//! that over the share of the kernel that lies in the polygon.

use glam::{Vec2, Vec3};

use super::map::{AGREEMENT, THICKNESS};
use crate::trace::accel::TraversalScratch;
use crate::trace::material::HoleCoverage;
use crate::trace::primitive::PrimitiveKind;
use crate::trace::sampler::{sin_cos_half_turns, tangents};
use crate::trace::soa::Ray;
use crate::trace::wavefront::{RenderContext, SurfaceInteraction};

const DIRECTIONS: usize = 8;

/// Halvings of the interval in which a surface ends.
const HALVINGS: u32 = 4;

/// Transparent surfaces that a ray along the surface goes through.
const PANES: u32 = 4;

/// Angles at which the kernel is integrated between two directions.
const ANGLES: u32 = 4;

/// Least share of the kernel: the thinnest tip of a surface is not taken to be brighter than photons can tell.
const LEAST_SHARE: f32 = 0.1;

/// The surface around a point, as far as photons are looked for.
pub struct SurfaceDomain {
    /// Unit, in the tangent plane, the first two directions' quarter.
    axes: [Vec3; 2],
    reach: f32,
    /// How far it goes on in each direction, at most `reach`.
    ends: [f32; DIRECTIONS],
}

/// Cosines of the directions; their sines are those of the direction two before.
const COSINES: [f32; DIRECTIONS + 1] = {
    const HALF: f32 = std::f32::consts::FRAC_1_SQRT_2;
    [1.0, HALF, 0.0, -HALF, -1.0, -HALF, 0.0, HALF, 1.0]
};

fn unit(direction: usize) -> Vec2 {
    let direction = direction % DIRECTIONS;
    Vec2::new(COSINES[direction], COSINES[(direction + DIRECTIONS - 2) % DIRECTIONS])
}

impl SurfaceDomain {
    /// Looks around a hit as far as `reach`; `turn`, from 0 to 1, says how the directions lie.
    pub fn new(
        context: RenderContext,
        met: &SurfaceInteraction,
        reach: f32,
        turn: f32,
        traversal: &mut TraversalScratch,
    ) -> SurfaceDomain {
        let normal = met.surface.geometric_normal;
        let [x, y] = tangents::<f32>(normal.into()).map(Vec3::from);
        let [sine, cosine] = sin_cos_half_turns(0.5 * turn);
        let axes = [x * cosine + y * sine, y * cosine - x * sine];
        let is_endless = context.geometry.range(PrimitiveKind::Plane).contains(&met.hit.primitive);
        let mut ends = [reach; DIRECTIONS];
        for (k, end) in ends.iter_mut().enumerate() {
            let along = unit(k);
            let along = axes[0] * along.x + axes[1] * along.y;
            let mut probe = DomainProbe { context, point: met.surface.point, normal, along, reach, traversal };
            let free = probe.free(met.surface.offset_origin(normal));
            // A little before what stands there.
            *end = if is_endless { free } else { probe.last_on_surface(free) };
        }
        SurfaceDomain { axes, reach, ends }
    }

    /// Whether the surface goes on everywhere.
    pub fn is_whole(&self) -> bool {
        self.ends.iter().all(|end| *end >= self.reach)
    }

    /// Whether a place, as seen from the middle, belongs to it.
    pub fn contains(&self, offset: Vec3) -> bool {
        let at = Vec2::new(offset.dot(self.axes[0]), offset.dot(self.axes[1]));
        let [wide, right, up] = [at.x.abs() > at.y.abs(), at.x > 0.0, at.y > 0.0];
        let sector = match (up, right, wide) {
            (true, true, true) => 0,
            (true, true, false) => 1,
            (true, false, false) => 2,
            (true, false, true) => 3,
            (false, false, true) => 4,
            (false, false, false) => 5,
            (false, true, false) => 6,
            (false, true, true) => 7,
        };
        let [from, to] = [self.ends[sector], self.ends[(sector + 1) % DIRECTIONS]];
        if from >= self.reach && to >= self.reach {
            return true;
        }
        let [from, to] = [unit(sector) * from, unit(sector + 1) * to];
        (to - from).perp_dot(at - from) >= 0.0
    }

    /// Share of the kernel of a radius, at most the reach, that lies in it.
    pub fn share(&self, radius: f32) -> f32 {
        let mut sum = 0.0;
        for (k, from) in self.ends.iter().enumerate() {
            let to = self.ends[(k + 1) % DIRECTIONS];
            for angle in 0..ANGLES {
                let part = (angle as f32 + 0.5) / ANGLES as f32;
                let end = if *from >= self.reach && to >= self.reach { radius } else { chord(*from, to, part) };
                // Epanechnikov's kernel up to there, over the same of the whole.
                let square = (end / radius).min(1.0) * (end / radius).min(1.0);
                sum += square * (2.0 - square);
            }
        }
        (sum / (DIRECTIONS as u32 * ANGLES) as f32).max(LEAST_SHARE)
    }
}

/// Distance of the straight line between the ends of two neighbouring directions, part of the way from one to the other.
fn chord(from: f32, to: f32, part: f32) -> f32 {
    // Eighths of a turn: half turns are what the sine takes.
    let sine = |part: f32| sin_cos_half_turns(0.25 * part)[0];
    let below = from * sine(part) + to * sine(1.0 - part);
    if below > 0.0 { from * to * sine(1.0) / below } else { 0.0 }
}

/// Looks along a surface in one direction.
struct DomainProbe<'a, 'b> {
    context: RenderContext<'a>,
    point: Vec3,
    normal: Vec3,
    along: Vec3,
    reach: f32,
    traversal: &'b mut TraversalScratch,
}

impl DomainProbe<'_, '_> {
    /// How far a ray gets that rises to where photons are no longer looked for.
    fn free(&mut self, origin: Vec3) -> f32 {
        let end = self.point + (self.along + self.normal * THICKNESS) * self.reach;
        let way = end - origin;
        let length = way.length();
        let mut ray = Ray { origin, direction: way / length, t_max: length };
        for _ in 0..PANES {
            let Some(hit) = self.context.accelerators.scattered.closest(self.context.geometry, &ray, self.traversal)
            else {
                return self.reach;
            };
            let surface = self.context.geometry.surface_point(&ray, &hit);
            let material = &self.context.materials[surface.material as usize];
            if material.transmission == 0.0 && material.coverage == HoleCoverage::Full {
                return (surface.point - self.point).dot(self.along).clamp(0.0, self.reach);
            }
            let next = surface.offset_origin(ray.direction);
            ray = Ray { origin: next, t_max: (end - next).dot(ray.direction).max(0.0), ..ray };
        }
        self.reach
    }

    /// The farthest place before `end` that lies on the surface, which does not come back once it has ended.
    fn last_on_surface(&mut self, end: f32) -> f32 {
        // Not in the wall itself.
        if self.is_surface(0.98 * end) {
            return end;
        }
        let (mut on, mut off) = (0.0, end);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (on + off);
            if self.is_surface(middle) {
                on = middle;
            } else {
                off = middle;
            }
        }
        0.5 * (on + off)
    }

    /// Whether photons that lie at this distance count.
    fn is_surface(&mut self, distance: f32) -> bool {
        let up = THICKNESS * distance;
        let origin = self.point + self.along * distance + self.normal * up;
        let ray = Ray { origin, direction: -self.normal, t_max: up + THICKNESS * self.reach };
        let Some(hit) = self.context.accelerators.scattered.closest(self.context.geometry, &ray, self.traversal) else {
            return false;
        };
        self.context.geometry.surface_point(&ray, &hit).geometric_normal.dot(self.normal).abs() > AGREEMENT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn domain(ends: [f32; DIRECTIONS]) -> SurfaceDomain {
        SurfaceDomain { axes: [Vec3::X, Vec3::Y], reach: 1.0, ends }
    }

    #[test]
    fn a_whole_disk_holds_all_of_the_kernel() {
        let whole = domain([1.0; DIRECTIONS]);
        assert!(whole.is_whole() && whole.contains(Vec3::new(0.9, 0.3, 0.0)));
        assert!((whole.share(1.0) - 1.0).abs() < 1e-6 && (whole.share(0.3) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_straight_wall_takes_what_lies_behind_it() {
        // A wall at x = 0.25: the integral of the kernel in the polygon before it, by a fine sum.
        let wall = 0.25f32;
        let at = |k: usize| match unit(k).x {
            x if x > 1e-3 => (wall / x).min(1.0),
            _ => 1.0,
        };
        let cut = domain(std::array::from_fn(at));
        let (mut within, mut before, mut all, mut behind) = (0.0, 0.0, 0.0, 0);
        for i in 0..200 {
            for j in 0..200 {
                let p = Vec3::new(i as f32 / 100.0 - 0.995, j as f32 / 100.0 - 0.995, 0.0);
                let kernel = (1.0 - p.length_squared()).max(0.0);
                all += kernel;
                within += if cut.contains(p) { kernel } else { 0.0 };
                before += if p.x < wall { kernel } else { 0.0 };
                behind += u32::from(kernel > 0.0 && cut.contains(p) && p.x > wall + 1e-3);
            }
        }
        // What counts is what the density is over.
        assert!((cut.share(1.0) - within / all).abs() < 0.01, "{} {}", cut.share(1.0), within / all);
        // The polygon cuts off corners of the disk alone.
        assert!(behind == 0 && within > 0.9 * before, "{behind} {within} {before}");
        assert!(cut.share(0.2) > 0.999);
    }

    #[test]
    fn chords_are_straight() {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        for part in [0.0f32, 0.3, 0.5, 1.0] {
            let angle = part * std::f32::consts::FRAC_PI_4;
            assert!((chord(0.5, 0.5 / half, part) - 0.5 / libm::cosf(angle)).abs() < 1e-5, "{part}");
        }
        assert_eq!(chord(0.0, 0.0, 0.5), 0.0);
    }
}
