//! Looking up pictures: wrapping, bilinear, and along the longer axis of a footprint in smaller copies.

use glam::{Vec2, Vec3};

use crate::components::{MipLevel, MipMap, TexelFilter, Wrap};

/// How a picture is looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageSampler {
    /// Along u and along v.
    pub wrap: [Wrap; 2],
    /// What lies between texels.
    pub filter: TexelFilter,
}

/// Where the surface's own coordinates end, in texture coordinates, least and greatest: no texel from beyond is mixed
/// in, so that a pole does not show the other one.
pub type Edges = [Option<[f32; 2]>; 2];

/// Looks along the longer axis of a footprint: longer ellipses get wider, and so blurred.
const TAPS: f32 = 8.0;

impl ImageSampler {
    /// The colour at `uv` (v from the bottom row up), over a footprint with these axes.
    pub fn color(self, picture: &MipMap, uv: Vec2, axes: [Vec2; 2], edges: Edges) -> Vec3 {
        let level = &picture.levels[0];
        match self.filter {
            TexelFilter::Nearest => self.nearest(level, uv, edges),
            TexelFilter::Bilinear => self.bilinear(level, uv, edges),
            TexelFilter::Mip => self.averaged(picture, uv, axes, edges),
        }
    }

    fn averaged(self, picture: &MipMap, uv: Vec2, [a, b]: [Vec2; 2], edges: Edges) -> Vec3 {
        let side = Vec2::new(picture.levels[0].width as f32, picture.levels[0].height as f32);
        let (long, short) = ((a * side).length(), (b * side).length());
        let (axis, long, short) = if long >= short { (a, long, short) } else { (b, short, long) };
        let last = (picture.levels.len() - 1) as f32;
        if !long.is_finite() || !axis.is_finite() {
            return self.bilinear(&picture.levels[last as usize], uv, edges);
        }
        if long <= 1.0 {
            return self.bilinear(&picture.levels[0], uv, edges);
        }
        let short = short.max(long / TAPS).max(1.0);
        let taps = (long / short).ceil().clamp(1.0, TAPS);
        let lod = libm::log2f(short).clamp(0.0, last);
        let (fine, mix) = (lod.floor(), lod - lod.floor());
        let mut sum = Vec3::ZERO;
        for i in 0..taps as u32 {
            let at = uv + axis * ((i as f32 + 0.5) / taps - 0.5);
            let mut color = self.bilinear(&picture.levels[fine as usize], at, edges);
            if mix > 0.0 {
                let coarse = self.bilinear(&picture.levels[fine as usize + 1], at, edges);
                color += (coarse - color) * mix;
            }
            sum += color;
        }
        sum / taps
    }

    fn nearest(self, level: &MipLevel, uv: Vec2, edges: Edges) -> Vec3 {
        let [x, y] = self.place(level, uv, edges, 0.0);
        level.texel(self.column(x.floor(), level), self.row(y.floor(), level))
    }

    fn bilinear(self, level: &MipLevel, uv: Vec2, edges: Edges) -> Vec3 {
        let [x, y] = self.place(level, uv, edges, 0.5).map(|x| x - 0.5);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let columns = [self.column(x.floor(), level), self.column(x.floor() + 1.0, level)];
        let rows = [self.row(y.floor(), level), self.row(y.floor() + 1.0, level)];
        let row = |y: u32| {
            let (left, right) = (level.texel(columns[0], y), level.texel(columns[1], y));
            left + (right - left) * fx
        };
        let (top, bottom) = (row(rows[0]), row(rows[1]));
        top + (bottom - top) * fy
    }

    /// Texture coordinates as a place on a level, in texels from the top left; within one repeat.
    fn place(self, level: &MipLevel, uv: Vec2, edges: Edges, margin: f32) -> [f32; 2] {
        let along = |x: f32, side: u32, edge: Option<[f32; 2]>, wrap: Wrap| {
            let side = side as f32;
            let mut x = x;
            if let Some([low, high]) = edge {
                // Half a texel inside, where there is so much room.
                let margin = (margin / side).min(0.5 * (high - low));
                x = x.clamp(low + margin, high - margin);
            }
            let folded = match wrap {
                Wrap::Repeat => x - x.floor(),
                Wrap::Mirror => {
                    let x = x - 2.0 * (0.5 * x).floor();
                    x.min(2.0 - x)
                }
                Wrap::Clamp => x.clamp(0.0, 1.0),
            };
            folded * side
        };
        let x = along(uv.x, level.width, edges[0], self.wrap[0]);
        let y = along(uv.y, level.height, edges[1], self.wrap[1]);
        [x, level.height as f32 - y]
    }

    fn column(self, x: f32, level: &MipLevel) -> u32 {
        index(x, level.width, self.wrap[0])
    }

    fn row(self, y: f32, level: &MipLevel) -> u32 {
        index(y, level.height, self.wrap[1])
    }
}

fn index(x: f32, side: u32, wrap: Wrap) -> u32 {
    let (x, side) = (x as i64, i64::from(side));
    (if wrap == Wrap::Repeat { x.rem_euclid(side) } else { x.clamp(0, side - 1) }) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::components::Texels;

    const FREE: Edges = [None; 2];

    fn sheet(wrap: Wrap, filter: TexelFilter) -> ImageSampler {
        ImageSampler { wrap: [wrap; 2], filter }
    }

    /// Red counts columns from the left, green rows from the top.
    fn numbered(width: u32, height: u32) -> MipMap {
        let texel = |i: u32| [(i % width) as f32, (i / width) as f32, 1.0];
        MipMap::new(width, height, Texels::Floats((0..width * height).map(texel).collect()))
    }

    #[test]
    fn v_runs_up_and_texels_sit_at_their_middles() {
        let picture = numbered(4, 2);
        for filter in [TexelFilter::Nearest, TexelFilter::Bilinear, TexelFilter::Mip] {
            let at = |u, v| sheet(Wrap::Repeat, filter).color(&picture, Vec2::new(u, v), [Vec2::ZERO; 2], FREE);
            assert_eq!(at(0.125, 0.25).truncate(), Vec2::new(0.0, 1.0));
            assert_eq!(at(0.875, 0.75).truncate(), Vec2::new(3.0, 0.0));
            assert_eq!(at(5.375, -0.25).truncate(), Vec2::new(1.0, 0.0));
        }
        let between =
            sheet(Wrap::Repeat, TexelFilter::Bilinear).color(&picture, Vec2::new(0.25, 0.5), [Vec2::ZERO; 2], FREE);
        assert_eq!(between, Vec3::new(0.5, 0.5, 1.0));
    }

    #[test]
    fn wraps_do_what_they_say() {
        let picture = numbered(4, 4);
        let at =
            |wrap, u| sheet(wrap, TexelFilter::Bilinear).color(&picture, Vec2::new(u, 0.5), [Vec2::ZERO; 2], FREE).x;
        assert_eq!(at(Wrap::Repeat, 0.0), 1.5);
        assert_eq!(at(Wrap::Repeat, 1.0), 1.5);
        assert_eq!(at(Wrap::Mirror, 0.0), 0.0);
        assert!((at(Wrap::Mirror, 1.25) - at(Wrap::Mirror, 0.75)).abs() < 1e-5);
        assert!((at(Wrap::Mirror, -0.3) - at(Wrap::Mirror, 0.3)).abs() < 1e-5);
        assert_eq!(at(Wrap::Clamp, 9.0), 3.0);
        assert_eq!(at(Wrap::Clamp, -1e30), 0.0);
    }

    #[test]
    fn nothing_is_mixed_in_from_beyond_an_edge() {
        let picture = numbered(4, 4);
        let v =
            |v| sheet(Wrap::Repeat, TexelFilter::Bilinear).color(&picture, Vec2::new(0.5, v), [Vec2::ZERO; 2], FREE).y;
        assert_eq!(v(1.0), 1.5);
        let edges = [None, Some([0.0, 1.0])];
        let v =
            |v| sheet(Wrap::Repeat, TexelFilter::Bilinear).color(&picture, Vec2::new(0.5, v), [Vec2::ZERO; 2], edges).y;
        assert_eq!((v(1.0), v(0.0)), (0.0, 3.0));
    }

    /// A footprint as large as the picture, or far larger, shows its mean; a long one the mean along it.
    #[test]
    fn footprints_are_averaged() {
        let picture = numbered(64, 64);
        let mip = sheet(Wrap::Repeat, TexelFilter::Mip);
        for size in [1.0, 100.0, 1e30, f32::INFINITY] {
            let color = mip.color(&picture, Vec2::new(0.3, 0.8), [Vec2::X * size, Vec2::Y * size], FREE);
            assert!((color - Vec3::new(31.5, 31.5, 1.0)).length() < 1e-3, "{size}: {color}");
        }
        let clamp = sheet(Wrap::Clamp, TexelFilter::Mip);
        let color = clamp.color(&picture, Vec2::splat(0.5), [Vec2::X * 0.25, Vec2::Y * 0.03125], FREE);
        assert!((color - Vec3::new(31.5, 31.5, 1.0)).length() < 1e-3, "{color}");
        let color = clamp.color(&picture, Vec2::new(0.5, 0.25), [Vec2::X * 0.25, Vec2::Y * 0.03125], FREE);
        assert!((color.y - 47.5).abs() < 1e-3, "{color}");
    }
}
