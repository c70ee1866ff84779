//! The frustum around rays that run along one axis, against the boxes of a node.
//!
//! Depth is measured along that axis. Over it, the greatest of the rays' coordinates on another axis is a convex
//! function, so that the chord between its ends bounds it, and the chord of the least bounds that. Four such lines and
//! the ends make the frustum; a box is met between the depths at which its planes cross them.

use super::group::{GROUPS, RayGroup};
use crate::trace::primitive::{Bounds, MARGIN, finite_recip};
use crate::trace::simd::{LANES, Lanes, Wide};

/// Eight boxes: by axis, side (least, greatest) and box.
type NodeBoxes = [[[f32; LANES]; 2]; 3];

/// A side, as a bound on the depth at which a box can be met: (plane of the box - start) / slope.
struct FrustumEdge<L: Wide> {
    /// 1 / slope of the side over depth.
    per_slope: L,
    /// start / slope - depth there.
    less: L,
    /// Whether boxes lie inside from that depth on, and not up to it.
    from: L::Mask,
}

impl<L: Wide> FrustumEdge<L> {
    /// The line through `start` at the front and `end` at the back; boxes are inside above it or below it.
    #[inline(always)]
    fn new(start: f32, end: f32, [front, back]: [f32; 2], above: bool) -> Self {
        let per_slope = finite_recip((end - start) / (back - front));
        let from = (per_slope > 0.0) != above;
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        FrustumEdge {
            per_slope: L::splat(per_slope),
            less: L::splat(start * per_slope - front),
            from: if from { zero.lt(one) } else { one.lt(zero) },
        }
    }

    /// Narrows the depths between which boxes with these planes can be met.
    #[inline(always)]
    fn clip(&self, plane: L, range: [L; 2]) -> [L; 2] {
        let depth = plane.scale_sub(self.per_slope, self.less);
        let [front, back] = range;
        [L::select(self.from, front.max(depth), front), L::select(self.from, back, back.min(depth))]
    }
}

/// Least and greatest coordinates of rays at two depths.
struct AxisSpread<L> {
    low: [L; 2],
    high: [L; 2],
}

impl<L: Wide> AxisSpread<L> {
    #[inline(always)]
    fn new() -> Self {
        let (least, most) = (L::splat(f32::INFINITY), L::splat(f32::NEG_INFINITY));
        AxisSpread { low: [least; 2], high: [most; 2] }
    }

    #[inline(always)]
    fn add(&mut self, origin: L, slope: L, origin_depth: L, range: [f32; 2]) {
        let start = origin + slope * (L::splat(range[0]) - origin_depth);
        let end = origin + slope * (L::splat(range[1]) - origin_depth);
        self.low = [self.low[0].min(start), self.low[1].min(end)];
        self.high = [self.high[0].max(start), self.high[1].max(end)];
    }

    /// The lines below and above: where they are at the front and at the back.
    #[inline(always)]
    fn lines(&self, margin: f32) -> [[f32; 2]; 2] {
        let [low, high] = [self.low, self.high];
        let [low, high] = [[low[0].reduce_min(), low[1].reduce_min()], [high[0].reduce_max(), high[1].reduce_max()]];
        let reach = low[0].abs().max(low[1].abs()).max(high[0].abs()).max(high[1].abs());
        let wide = margin + reach * MARGIN;
        [[low[0] - wide, low[1] - wide], [high[0] + wide, high[1] + wide]]
    }
}

/// The rays of a group along one axis.
struct RayColumn<L: Wide> {
    inverse: L,
    /// Origin times inverse, with the margin that makes near planes nearer.
    near: L,
    far: L,
    /// Whether the greater plane of a box is met first.
    backward: L::Mask,
}

impl<L: Wide> RayColumn<L> {
    #[inline(always)]
    fn new(origin: L, direction: L, margin: f32) -> Self {
        let inverse = finite_recip(direction);
        let backward = inverse.lt(L::splat(0.0));
        let ahead = L::select(backward, L::splat(-margin), L::splat(margin));
        RayColumn { inverse, near: (origin + ahead) * inverse, far: (origin - ahead) * inverse, backward }
    }

    /// Where the rays enter and leave between the planes of one child.
    #[inline(always)]
    fn cross(&self, planes: &[[f32; LANES]; 2], child: usize) -> [L; 2] {
        let (low, high) = (L::splat(planes[0][child]), L::splat(planes[1][child]));
        let (first, last) = (L::select(self.backward, high, low), L::select(self.backward, low, high));
        [first.scale_sub(self.inverse, self.near), last.scale_sub(self.inverse, self.far)]
    }
}

/// Rays as boxes want them: together and one by one.
pub struct PacketFrustum<L: Wide> {
    /// The axis along which depth is measured, last of three.
    axes: [usize; 3],
    /// 1 where rays run up that axis, -1 where down.
    sign: f32,
    /// Depths between which the frustum bounds the rays.
    range: [f32; 2],
    x_edges: [FrustumEdge<L>; 2],
    y_edges: [FrustumEdge<L>; 2],
    /// The lines below and above the rays along the other axes: where they are at the front and at the back.
    x_lines: [[f32; 2]; 2],
    y_lines: [[f32; 2]; 2],
    columns: [[RayColumn<L>; 3]; GROUPS],
    /// What rounding may do to a depth.
    slack: f32,
}

impl<L: Wide> PacketFrustum<L> {
    /// `None` if no ray comes near what has these bounds, and coordinates up to `extent`.
    #[inline(always)]
    pub fn new(groups: &[RayGroup<L>; GROUPS], bounds: Bounds, extent: f32) -> Option<Self> {
        let axes = groups[0].beam.axes;
        let z = axes[2];
        let sign = if groups[0].direction[2].store()[0] < 0.0 { -1.0 } else { 1.0 };
        let signs = L::splat(sign);
        let mut reach = L::splat(0.0);
        let (mut starts, mut ends) = (L::splat(f32::INFINITY), L::splat(f32::NEG_INFINITY));
        for group in groups {
            let [x, y, z] = group.origin;
            reach = reach.max(x.abs()).max(y.abs()).max(z.abs());
            starts = starts.min(z * signs);
            ends = ends.max(z * signs + group.direction[2] * signs * group.t);
        }
        let own = reach.reduce_max() * MARGIN;
        let margin = own + extent * MARGIN;
        let (low, high) = (bounds.min[z] * sign, bounds.max[z] * sign);
        let front = Lanes::max(starts.reduce_min(), Lanes::min(low, high)) - margin;
        let back = Lanes::min(ends.reduce_max(), Lanes::max(low, high)) + margin;
        if front >= back {
            return None;
        }
        let range = [front, back];
        let (mut across, mut along) = (AxisSpread::new(), AxisSpread::new());
        for group in groups {
            let [x, y, z] = group.origin;
            let [dx, dy, dz] = group.direction;
            let (depth, per_depth) = (z * signs, L::splat(1.0) / (dz * signs));
            across.add(x, dx * per_depth, depth, range);
            along.add(y, dy * per_depth, depth, range);
        }
        let (x_lines, y_lines) = (across.lines(margin), along.lines(margin));
        let [[a, b], [c, d]] = x_lines;
        let x_edges = [FrustumEdge::new(a, b, range, true), FrustumEdge::new(c, d, range, false)];
        let [[a, b], [c, d]] = y_lines;
        let y_edges = [FrustumEdge::new(a, b, range, true), FrustumEdge::new(c, d, range, false)];
        Some(PacketFrustum {
            axes,
            sign,
            range,
            x_edges,
            y_edges,
            x_lines,
            y_lines,
            columns: [columns(&groups[0], own), columns(&groups[1], own)],
            slack: margin,
        })
    }

    /// The axes, depth last.
    #[inline(always)]
    pub fn axes(&self) -> [usize; 3] {
        self.axes
    }

    /// Whether depth grows with the coordinate.
    #[inline(always)]
    pub fn up(&self) -> bool {
        self.sign > 0.0
    }

    /// Depths between which the frustum bounds the rays.
    #[inline(always)]
    pub fn range(&self) -> [f32; 2] {
        self.range
    }

    /// Least and greatest coordinate of the rays between two depths in its range, along the other axes.
    #[inline(always)]
    pub fn across(&self, depths: [f32; 2]) -> [[f32; 2]; 2] {
        let [front, back] = self.range;
        let [from, to] = [(depths[0] - front) / (back - front), (depths[1] - front) / (back - front)];
        let spread = |[low, high]: [[f32; 2]; 2]| {
            let at = |[start, end]: [f32; 2], share: f32| start + (end - start) * share;
            [Lanes::min(at(low, from), at(low, to)), Lanes::max(at(high, from), at(high, to))]
        };
        [spread(self.x_lines), spread(self.y_lines)]
    }

    /// The greatest depth that still matters to any ray.
    #[inline(always)]
    pub fn limit(&self, groups: &[RayGroup<L>; GROUPS]) -> f32 {
        let sign = L::splat(self.sign);
        let mut most = L::splat(f32::NEG_INFINITY);
        for group in groups {
            most = most.max(group.origin[2] * sign + group.direction[2] * sign * group.t);
        }
        Lanes::min(most.reduce_max() + self.slack, self.range[1])
    }

    /// The depth that stands for these bits in what [`Self::intersect`] gives.
    #[inline(always)]
    pub fn depth(&self, bits: u32) -> f32 {
        f32::from_bits(bits) + self.range[0]
    }

    /// Children that any ray may meet before the depth `limit`, and from which depth on, counted from the front: not
    /// negative, so that their bits are in their order.
    #[inline(always)]
    pub fn intersect(&self, boxes: &NodeBoxes, limit: f32) -> (L, u32) {
        let [x, y, z] = boxes;
        let x = [L::load(&x[0]), L::load(&x[1])];
        let y = [L::load(&y[0]), L::load(&y[1])];
        let z = [L::load(&z[0]), L::load(&z[1])];
        self.clip([x, y, z], limit)
    }

    /// As [`Self::intersect`], for boxes that are in registers.
    #[inline(always)]
    pub fn clip(&self, boxes: [[L; 2]; 3], limit: f32) -> (L, u32) {
        let [x, y, z] = self.axes;
        let sign = L::splat(self.sign);
        let (low, high) = (boxes[z][0] * sign, boxes[z][1] * sign);
        let (first, last) = if self.sign > 0.0 { (low, high) } else { (high, low) };
        let range = [first.max(L::splat(self.range[0])), last.min(L::splat(limit))];
        // Inside are boxes whose upper plane is above the lower line, and whose lower plane is below the upper one.
        let [below, above] = &self.x_edges;
        let range = below.clip(boxes[x][1], range);
        let range = above.clip(boxes[x][0], range);
        let [below, above] = &self.y_edges;
        let range = below.clip(boxes[y][1], range);
        let [front, back] = above.clip(boxes[y][0], range);
        (front - L::splat(self.range[0]), L::bits(front.le(back)))
    }

    /// Rays of a group that meet the box of one child, which has a margin of its own, before their own limits.
    #[inline(always)]
    pub fn rays(&self, group: usize, boxes: &NodeBoxes, child: usize, limits: L) -> u32 {
        let child = child & (LANES - 1);
        let [x, y, z] = &self.columns[group & (GROUPS - 1)];
        let [near_x, far_x] = x.cross(&boxes[self.axes[0]], child);
        let [near_y, far_y] = y.cross(&boxes[self.axes[1]], child);
        let [near_z, far_z] = z.cross(&boxes[self.axes[2]], child);
        let near = near_x.max(near_y).max(near_z.max(L::splat(0.0)));
        let far = far_x.min(far_y).min(far_z.min(limits));
        L::bits(near.le(far))
    }
}

#[inline(always)]
fn columns<L: Wide>(group: &RayGroup<L>, margin: f32) -> [RayColumn<L>; 3] {
    let ([x, y, z], [dx, dy, dz]) = (group.origin, group.direction);
    [RayColumn::new(x, dx, margin), RayColumn::new(y, dy, margin), RayColumn::new(z, dz, margin)]
}
