//! Lines of text as bodies, in the font that is built in.

use glam::DVec2;

use super::outline::{Outline, extrude};
use crate::base::font;
use crate::components::mesh::MeshData;

/// Where lines of text stand to each other, and to x = 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextAlign {
    /// They start there.
    #[default]
    Left,
    /// Their middles are there.
    Center,
    /// They end there.
    Right,
}

/// How a text is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextLayout {
    /// An em in world units: capitals are 0.714 of it.
    pub size: f64,
    /// Thickness in world units; 0 for a face alone.
    pub depth: f64,
    /// How its lines stand to each other.
    pub align: TextAlign,
    /// From one base line to the next, in ems.
    pub line_spacing: f64,
    /// Chords of a curve of a letter.
    pub steps: u32,
}

impl Default for TextLayout {
    fn default() -> Self {
        TextLayout { size: 1.0, depth: 0.2, align: TextAlign::Left, line_spacing: 1.3, steps: 8 }
    }
}

/// A text whose first base line is y = 0, towards +z.
pub fn text(text: &str, layout: &TextLayout) -> MeshData {
    let mut outlines: Vec<Outline> = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let set = font::outline(line);
        let start = match layout.align {
            TextAlign::Left => 0.0,
            TextAlign::Center => -set.width / 2.0,
            TextAlign::Right => -set.width,
        };
        let pen = DVec2::new(start, -layout.line_spacing * number as f64);
        let place = |point: DVec2| (point + pen) * layout.size;
        let polygons = set.contours.iter().map(|contour| contour.polygon(layout.steps));
        outlines.extend(polygons.map(|polygon| polygon.into_iter().map(place).collect()));
    }
    extrude(&outlines, layout.depth)
}
