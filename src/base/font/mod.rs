//! The font that is built in, as outlines: labels of sheets are drawn with it, and text of any other kind may be.
//!
//! It is a part of Noto Sans Regular 2.004 (SIL Open Font License 1.1, `OFL.txt` beside this file): Latin with its
//! accents, Greek, Cyrillic, digits, punctuation, and the signs of Latin-1 such as the degree. `pyftsubset` cut it out with
//! `--no-hinting --layout-features=kern`. A character that it lacks is drawn as the usual empty box.

use std::sync::LazyLock;

use glam::DVec2;
use ttf_parser::gpos::{PairAdjustment, PositioningSubtable};
use ttf_parser::{Face, GlyphId, OutlineBuilder};

static FILE: &[u8] = include_bytes!("NotoSans-Regular.subset.ttf");
/// `None` only if the file above were broken, which a test rules out.
static FACE: LazyLock<Option<Face<'static>>> = LazyLock::new(|| Face::parse(FILE, 0).ok());

/// Height of capital letters over the base line, in ems.
pub const CAPITAL_HEIGHT: f64 = 0.714;
/// How far letters like `g` reach below the base line, in ems.
pub const DESCENT: f64 = 0.24;

/// A closed curve. Outer ones run clockwise and holes the other way, with y upwards (as TrueType has it): what lies
/// inside has a winding number other than zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    /// Where the first segment starts, in ems from the pen's place on the baseline.
    pub start: DVec2,
    /// The last one ends where the first starts.
    pub segments: Vec<Segment>,
}

/// A piece of a contour, from where the one before it ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Segment {
    /// A straight line to this point.
    Line(DVec2),
    /// A quadratic Bézier curve.
    Curve {
        /// The point that it bends towards.
        control: DVec2,
        /// Where it ends.
        end: DVec2,
    },
}

impl Contour {
    /// The contour as a polygon whose last point joins the first; curves become `steps` chords.
    pub fn polygon(&self, steps: u32) -> Vec<DVec2> {
        let mut points = vec![self.start];
        for segment in &self.segments {
            let from = points[points.len() - 1];
            match *segment {
                Segment::Line(end) => points.push(end),
                Segment::Curve { control, end } => points.extend((1..=steps).map(|i| {
                    let t = f64::from(i) / f64::from(steps);
                    from.lerp(control, t).lerp(control.lerp(end, t), t)
                })),
            }
        }
        if points.len() > 1 && points.last() == points.first() {
            points.pop();
        }
        points
    }
}

/// One line of text as outlines, in ems: the base line is y = 0 and the text starts at x = 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextOutline {
    /// Of all glyphs, each in its place.
    pub contours: Vec<Contour>,
    /// Where the next glyph would stand.
    pub width: f64,
}

/// The outlines of a line of text, kerned. Control characters are left out.
pub fn outline(text: &str) -> TextOutline {
    let mut line = TextOutline::default();
    let Some(face) = &*FACE else { return line };
    let em = f64::from(face.units_per_em());
    let mut before = None;
    for c in text.chars().filter(|c| !c.is_control()) {
        let glyph = face.glyph_index(c).unwrap_or_default();
        line.width += before.map_or(0.0, |before| f64::from(kerning(face, before, glyph)) / em);
        let mut pen = Pen { em, at: DVec2::new(line.width, 0.0), contours: Vec::new() };
        face.outline_glyph(glyph, &mut pen);
        line.contours.append(&mut pen.contours);
        line.width += f64::from(face.glyph_hor_advance(glyph).unwrap_or(0)) / em;
        before = Some(glyph);
    }
    line
}

/// The width of a line of text in ems.
pub fn width(text: &str) -> f64 {
    outline(text).width
}

/// Units by which the second of two glyphs stands nearer to or further from the first.
fn kerning(face: &Face, left: GlyphId, right: GlyphId) -> i16 {
    let Some(table) = face.tables().gpos else { return 0 };
    let of_subtable = |subtable: PositioningSubtable| {
        let PositioningSubtable::Pair(pair) = subtable else { return None };
        let index = pair.coverage().get(left)?;
        let (value, _) = match pair {
            PairAdjustment::Format1 { sets, .. } => sets.get(index)?.get(right)?,
            PairAdjustment::Format2 { classes, matrix, .. } => {
                matrix.get((classes.0.get(left), classes.1.get(right)))?
            }
        };
        Some(value.x_advance)
    };
    table.lookups.into_iter().filter_map(|lookup| lookup.subtables.into_iter().find_map(of_subtable)).sum()
}

/// Collects the contours of a glyph that stands at `at`.
struct Pen {
    em: f64,
    at: DVec2,
    contours: Vec<Contour>,
}

impl Pen {
    fn point(&self, x: f32, y: f32) -> DVec2 {
        self.at + DVec2::new(f64::from(x), f64::from(y)) / self.em
    }

    fn add(&mut self, segment: Segment) {
        if let Some(contour) = self.contours.last_mut() {
            contour.segments.push(segment);
        }
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        let start = self.point(x, y);
        self.contours.push(Contour { start, segments: Vec::new() });
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let end = self.point(x, y);
        self.add(Segment::Line(end));
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (control, end) = (self.point(x1, y1), self.point(x, y));
        self.add(Segment::Curve { control, end });
    }

    /// TrueType outlines have no cubic curves: a chord stands for what cannot come.
    fn curve_to(&mut self, _: f32, _: f32, _: f32, _: f32, x: f32, y: f32) {
        self.line_to(x, y);
    }

    fn close(&mut self) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Signed area of a polygon, positive where it runs against the clock.
    fn area(points: &[DVec2]) -> f64 {
        let next = points.iter().cycle().skip(1);
        points.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f64>() / 2.0
    }

    #[test]
    fn the_file_can_be_read_and_measures_are_as_stated() {
        let face = FACE.as_ref().unwrap();
        assert_eq!(face.units_per_em(), 1000);
        let top = |text: &str| outline(text).contours[0].polygon(8).iter().map(|p| p.y).fold(0.0, f64::max);
        assert!((top("H") - CAPITAL_HEIGHT).abs() < 1e-9);
        let lowest = outline("gjpqy").contours.iter().flat_map(|c| c.polygon(8)).map(|p| p.y).fold(0.0, f64::min);
        assert!((-DESCENT..-DESCENT + 0.02).contains(&lowest), "{lowest}");
    }

    #[test]
    fn digits_are_equally_wide_and_pairs_are_kerned() {
        let ten: Vec<f64> = (0..10).map(|digit: u32| width(&digit.to_string())).collect();
        assert!(ten.iter().all(|one| *one == ten[0] && *one > 0.5));
        assert!(width("AV") < width("A") + width("V") - 0.02);
        assert_eq!(width("a\nb\u{7}"), width("ab"));
        assert_eq!((width(""), outline("").contours.len()), (0.0, 0));
    }

    #[test]
    fn outer_contours_run_clockwise_and_holes_against_it() {
        let o = outline("O").contours;
        assert_eq!(o.len(), 2);
        let areas: Vec<f64> = o.iter().map(|contour| area(&contour.polygon(8))).collect();
        assert!(areas.iter().any(|a| *a < -0.3) && areas.iter().any(|a| *a > 0.2), "{areas:?}");
    }

    #[test]
    fn greek_cyrillic_and_accents_are_there_and_the_rest_is_a_box() {
        let box_of = |text: &str| outline(text).contours.len();
        for text in ["\u{e9}", "\u{df}", "\u{3a9}", "\u{416}", "\u{b0}", "\u{2026}", "\u{20ac}", "\u{d7}"] {
            assert_ne!(outline(text), outline("\u{4e2d}"), "{text}");
        }
        assert!(box_of("\u{4e2d}") > 0);
    }
}
