//! The colours of a picture file: which of its channels they are, and how they look.

use super::comparison::name_of;
use crate::output::{ChannelSamples, ColorEncoding, LayeredPicture, PictureChannel, PicturePart, PixelWindow};

/// Three channels of a picture file that are one colour.
#[derive(Clone, Debug, PartialEq)]
pub struct ColorLayer {
    /// What stands before `.R`, `.G` and `.B`; empty for the plain channels of a picture.
    pub name: String,
    /// Where its pixels lie.
    pub window: PixelWindow,
    /// How its values are stored.
    pub encoding: ColorEncoding,
    /// Row by row from the top.
    pub colors: Vec<[f32; 3]>,
}

/// Channels of one part, by the name of the colour that they belong to.
fn named<'a>(part: &'a PicturePart, is_single: bool, prefix: &str, last: &str) -> Option<&'a PictureChannel> {
    let wanted = if prefix.is_empty() { last.to_string() } else { format!("{prefix}.{last}") };
    part.channels.iter().find(|channel| name_of(part, channel, is_single) == wanted)
}

/// All colours of a picture file, its plain picture first, and next what compositors call combined.
///
/// A lone channel `Y` is a grey picture. Where a PNG lets something through, its colours are seen over a middle grey.
pub fn color_layers(picture: &LayeredPicture) -> Vec<ColorLayer> {
    let is_single = picture.parts.len() == 1;
    let mut layers = Vec::new();
    for part in &picture.parts {
        for channel in &part.channels {
            let name = name_of(part, channel, is_single);
            let (prefix, last) = name.rsplit_once('.').unwrap_or(("", &name));
            let others = ["R", "G", "B"].map(|last| named(part, is_single, prefix, last));
            let [Some(red), Some(green), Some(blue)] = others else {
                if last == "Y" && others.iter().all(Option::is_none) && is_plain_gray(part, is_single, prefix) {
                    layers.push(layer(picture, part, prefix, [channel; 3], None));
                }
                continue;
            };
            // Once for each colour.
            if last == "R" {
                let alpha = named(part, is_single, prefix, "A");
                layers.push(layer(picture, part, prefix, [red, green, blue], alpha));
            }
        }
    }
    layers.sort_by_key(|layer| match layer.name.as_str() {
        "" => 0,
        name if name.to_lowercase().ends_with("combined") => 1,
        _ => 2,
    });
    layers
}

/// `P.X`, `P.Y` and `P.Z` are a vector.
fn is_plain_gray(part: &PicturePart, is_single: bool, prefix: &str) -> bool {
    named(part, is_single, prefix, "X").is_none()
}

fn layer(
    picture: &LayeredPicture,
    part: &PicturePart,
    name: &str,
    channels: [&PictureChannel; 3],
    alpha: Option<&PictureChannel>,
) -> ColorLayer {
    let value = |channel: &PictureChannel, i: usize| match &channel.samples {
        ChannelSamples::Float(values) => values[i],
        ChannelSamples::Whole(values) => values[i] as f32,
    };
    let is_shown = matches!(picture.encoding, ColorEncoding::Srgb { .. });
    let alpha = alpha.filter(|_| is_shown);
    let color = |i: usize| {
        let color = channels.map(|channel| value(channel, i));
        let share = alpha.map_or(1.0, |alpha| value(alpha, i));
        if share == 1.0 { color } else { color.map(|c| 0.5 + (c - 0.5) * share) }
    };
    let colors = (0..part.data_window.pixels()).map(color).collect();
    ColorLayer { name: name.to_string(), window: part.data_window, encoding: picture.encoding, colors }
}

impl ColorLayer {
    /// The colours of a rectangle that lies within the layer's own.
    pub fn crop(&self, window: PixelWindow) -> Vec<[f32; 3]> {
        if window == self.window {
            return self.colors.clone();
        }
        let at = |axis: usize| (i64::from(window.origin[axis]) - i64::from(self.window.origin[axis])) as usize;
        let (left, top, width) = (at(0), at(1), self.window.size[0] as usize);
        let rows = (0..window.size[1] as usize).map(|y| (top + y) * width + left);
        rows.flat_map(|start| &self.colors[start..start + window.size[0] as usize]).copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(encoding: ColorEncoding, parts: &[(&str, &[&str])]) -> LayeredPicture {
        let window = PixelWindow { origin: [0, 0], size: [2, 1] };
        let channel = |(i, name): (usize, &&str)| PictureChannel {
            name: name.to_string(),
            samples: ChannelSamples::Float(vec![i as f32, 0.25]),
        };
        let part = |(name, channels): &(&str, &[&str])| PicturePart {
            name: Some(name.to_string()),
            data_window: window,
            channels: channels.iter().enumerate().map(channel).collect(),
        };
        LayeredPicture { encoding, display_window: window, parts: parts.iter().map(part).collect() }
    }

    fn names(parts: &[(&str, &[&str])]) -> Vec<String> {
        color_layers(&picture(ColorEncoding::Linear, parts)).into_iter().map(|layer| layer.name).collect()
    }

    #[test]
    fn colors_are_found_in_any_layout() {
        assert_eq!(names(&[("", &["A", "B", "G", "R", "Z"])]), [""]);
        assert_eq!(
            names(&[("", &["B", "G", "R", "albedo.B", "albedo.G", "albedo.R", "N.X", "N.Y", "N.Z"])]),
            ["", "albedo"]
        );
        let blender: &[(&str, &[&str])] = &[
            ("V.Albedo", &["V.Albedo.B", "V.Albedo.G", "V.Albedo.R"]),
            ("V.Combined", &["V.Combined.A", "V.Combined.B", "V.Combined.G", "V.Combined.R"]),
            ("V.Depth", &["V.Depth.Z"]),
        ];
        assert_eq!(names(blender), ["V.Combined", "V.Albedo"]);
        assert_eq!(names(&[("beauty", &["B", "G", "R"]), ("depth", &["Z"])]), ["beauty"]);
        assert_eq!(names(&[("", &["Y"])]), [""]);
        assert!(names(&[("", &["Z"])]).is_empty());
    }

    #[test]
    fn what_shines_through_a_png_is_grey() {
        let parts: &[(&str, &[&str])] = &[("", &["A", "R", "G", "B"])];
        let shown = color_layers(&picture(ColorEncoding::Srgb { bits: 8 }, parts)).remove(0);
        // The first pixel has alpha 0, the second a quarter.
        assert_eq!(shown.colors, [[0.5; 3], [0.4375; 3]]);
        let linear = color_layers(&picture(ColorEncoding::Linear, parts)).remove(0);
        assert_eq!(linear.colors[0], [1.0, 2.0, 3.0]);
        let right = PixelWindow { origin: [1, 0], size: [1, 1] };
        assert_eq!(linear.crop(right), [[0.25; 3]]);
    }
}
