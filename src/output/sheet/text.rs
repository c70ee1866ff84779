//! Lines of text as coverage: how much of each pixel lies inside of the letters, exactly.

use glam::DVec2;

use crate::base::font::{self, TextOutline};

/// Chords for a curve of a letter; at the sizes of labels the rest is less than a hundredth of a pixel.
const STEPS: u32 = 8;

/// How much of each pixel is covered, 0 to 1.
pub struct Coverage {
    width: usize,
    /// The first row, counted downwards from the base line.
    top: i64,
    values: Vec<f32>,
}

impl Coverage {
    /// Rows from the highest to the lowest, each with its number: 0 is the one below the base line.
    pub fn rows(&self) -> impl Iterator<Item = (i64, &[f32])> {
        (self.top..).zip(self.values.chunks_exact(self.width.max(1)))
    }
}

/// The longest start of a line that fits into so many ems, with an ellipsis if that is not all of it.
pub fn shortened(line: &str, room: f64) -> String {
    if font::width(line) <= room {
        return line.to_string();
    }
    let ends = line.char_indices().map(|(i, _)| i).collect::<Vec<_>>();
    let cut = |end: &usize| format!("{}\u{2026}", line[..*end].trim_end());
    ends.iter().rev().map(cut).find(|shorter| font::width(shorter) <= room).unwrap_or_default()
}

/// Covers pixels with a line of text of `size` pixels to the em, which starts at the left edge.
pub fn coverage(line: &TextOutline, size: f64) -> Coverage {
    let polygons: Vec<Vec<DVec2>> = line.contours.iter().map(|contour| contour.polygon(STEPS)).collect();
    // Pixels from the left and downwards from the base line.
    let at = |p: &DVec2| DVec2::new(p.x * size, -p.y * size);
    let points = || polygons.iter().flatten().map(at);
    let high = points().map(|p| p.y).fold(0.0, f64::min).floor();
    let low = points().map(|p| p.y).fold(0.0, f64::max).ceil();
    let right = points().map(|p| p.x).fold(0.0, f64::max).ceil();
    let (width, height) = (right.max(0.0) as usize + 1, (low - high) as usize + 1);
    // Signed area between the edges and the right side: summed up along a row it is the coverage.
    let mut edges = vec![0.0f64; (width + 1) * height];
    for polygon in &polygons {
        let next = polygon.iter().cycle().skip(1);
        for (a, b) in polygon.iter().zip(next) {
            let up = DVec2::new(0.0, -high);
            add_edge(&mut edges, width + 1, at(a) + up, at(b) + up);
        }
    }
    let mut values = Vec::with_capacity(width * height);
    for row in edges.chunks_exact(width + 1) {
        let mut sum = 0.0;
        values.extend(row[..width].iter().map(|edge| {
            sum += edge;
            sum.abs().min(1.0) as f32
        }));
    }
    Coverage { width, top: high as i64, values }
}

/// Adds what lies to the right of an edge, with the sign of its direction, as differences along the rows.
fn add_edge(edges: &mut [f64], width: usize, a: DVec2, b: DVec2) {
    if a.y == b.y {
        return;
    }
    let (sign, above, below) = if a.y < b.y { (1.0, a, b) } else { (-1.0, b, a) };
    let slope = (below.x - above.x) / (below.y - above.y);
    let rows = above.y.floor() as usize..below.y.ceil() as usize;
    for row in rows {
        let (from, to) = (above.y.max(row as f64), below.y.min((row + 1) as f64));
        if to <= from {
            continue;
        }
        let x_at = |y: f64| (above.x + (y - above.y) * slope).max(0.0);
        let (x0, x1) = (x_at(from), x_at(to));
        let (left, right) = (x0.min(x1), x0.max(x1));
        let line = &mut edges[row * width..(row + 1) * width];
        let height = (to - from) * sign;
        let (first, last) = (left.floor() as usize, right.ceil().max(left.floor() + 1.0) as usize);
        // The share of the height that has passed, and the mean distance to the right side of each pixel.
        let span = right - left;
        let mut covered = 0.0;
        for pixel in first..last {
            let (l, r) = (left.max(pixel as f64), right.min((pixel + 1) as f64));
            let share = if span > 0.0 { (r - l) / span } else { 1.0 };
            let middle = if span > 0.0 { (l + r) / 2.0 } else { left };
            let inside = (pixel + 1) as f64 - middle;
            if let Some(here) = line.get_mut(pixel) {
                *here += height * share * inside;
            }
            if let Some(next) = line.get_mut(pixel + 1) {
                *next += height * share * (1.0 - inside);
            }
            covered += share;
        }
        debug_assert!((covered - 1.0).abs() < 1e-6);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ink(text: &str, size: f64) -> f64 {
        coverage(&font::outline(text), size).values.iter().map(|x| f64::from(*x)).sum()
    }

    /// The area of the letters by the shoelace formula: what the pixels together have to cover.
    fn area(text: &str, size: f64) -> f64 {
        let of = |points: Vec<DVec2>| {
            let next = points.iter().cycle().skip(1);
            points.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f64>() / 2.0
        };
        let all: f64 = font::outline(text).contours.iter().map(|contour| of(contour.polygon(STEPS))).sum();
        all.abs() * size * size
    }

    #[test]
    fn letters_cover_their_area() {
        for text in ["H", "O", "g%", "Frame 0012, \u{e9}\u{416}", "l"] {
            for size in [13.0, 20.5, 64.0] {
                let (found, wanted) = (ink(text, size), area(text, size));
                assert!((found - wanted).abs() < 0.002 * wanted + 0.01, "{text} {size}: {found} {wanted}");
            }
        }
        assert_eq!(ink("", 20.0) + ink(" ", 20.0), 0.0);
    }

    #[test]
    fn rows_are_counted_from_the_base_line() {
        let coverage = coverage(&font::outline("H"), 100.0);
        let rows: Vec<i64> = coverage.rows().filter(|(_, row)| row.iter().any(|x| *x > 0.5)).map(|(y, _)| y).collect();
        assert_eq!((rows[0], rows[rows.len() - 1]), (-71, -1));
    }

    #[test]
    fn long_lines_are_shortened() {
        assert_eq!(shortened("short", 10.0), "short");
        let line = shortened("a label that is much too long for its tile", 8.0);
        assert!(line.starts_with("a label") && line.ends_with('\u{2026}') && font::width(&line) <= 8.0, "{line}");
        assert_eq!(shortened("abc", 0.1), "");
    }
}
