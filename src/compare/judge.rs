//! Whether two pictures are near enough: metrics, and how much of each is forgiven.

use std::fmt;

use super::colors::{ColorLayer, color_layers};
use super::comparison::{Comparison, compare};
use super::flip::{self, ErrorMap, Exposures, Viewing};
use crate::output::{ColorEncoding, LayeredPicture};

/// A number that says how far two pictures are apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// Whether any value differs.
    Exact,
    /// The largest difference of a channel.
    Max,
    /// The root of the mean square difference of all channels.
    Rmse,
    /// The peak signal to noise ratio in decibels, for a peak of 1: larger is nearer.
    Psnr,
    /// The mean FLIP error of the colours.
    Flip,
}

impl Metric {
    /// Every metric.
    pub const ALL: [Metric; 5] = [Metric::Exact, Metric::Max, Metric::Rmse, Metric::Psnr, Metric::Flip];

    /// The metric as options and reports call it.
    pub fn word(self) -> &'static str {
        match self {
            Metric::Exact => "exact",
            Metric::Max => "max",
            Metric::Rmse => "rmse",
            Metric::Psnr => "psnr",
            Metric::Flip => "flip",
        }
    }
}

/// How much of a metric is forgiven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slack {
    /// What is measured.
    pub metric: Metric,
    /// At most this, or at least this for [`Metric::Psnr`]; nothing for [`Metric::Exact`].
    pub threshold: f64,
}

/// How FLIP looks at a pair of pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlipSettings {
    /// How far away the screen is, as far as FLIP knows.
    pub viewing: Viewing,
    /// For pictures of linear light; derived from the first picture where it is not given.
    pub exposures: Option<Exposures>,
}

/// The FLIP errors of a colour that both pictures have.
#[derive(Clone, Debug, PartialEq)]
pub struct FlipDifference {
    /// As [`ColorLayer::name`].
    pub name: String,
    /// Mean of the map, summed in `f64`.
    pub mean: f64,
    /// The error of every pixel.
    pub map: ErrorMap,
    /// Where linear light was compared.
    pub exposures: Option<Exposures>,
}

/// How near two pictures are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// They are the same in every channel and pixel.
    Equal,
    /// They differ, and as much as they do is forgiven.
    Within,
    /// They differ by more than is forgiven.
    Different,
}

/// Two pictures, compared and judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// What differs, channel by channel.
    pub comparison: Comparison,
    /// For every colour that both have; empty for equal pictures, and where nobody asked for it.
    pub flip: Vec<FlipDifference>,
    /// What FLIP was asked.
    pub settings: FlipSettings,
    /// What follows from it and the slack.
    pub verdict: Verdict,
}

impl Judgement {
    /// The largest mean FLIP error of their colours.
    pub fn worst_flip(&self) -> Option<f64> {
        self.flip.iter().map(|flip| flip.mean).reduce(f64::max)
    }

    /// Channels that differ and are part of no colour that FLIP compared.
    pub fn unjudged_channels(&self) -> Vec<String> {
        let is_seen = |name: &str| {
            let (color, last) = name.rsplit_once('.').unwrap_or(("", name));
            ["R", "G", "B", "Y"].contains(&last) && self.flip.iter().any(|flip| flip.name == color)
        };
        let differing = self.comparison.channels.iter().filter(|channel| channel.difference.pixels > 0);
        differing.map(|channel| channel.name.clone()).filter(|name| !is_seen(name)).collect()
    }

    /// What was found, for people; one line at least.
    pub fn lines(&self) -> Vec<String> {
        let Comparison { layout, difference, compared, .. } = &self.comparison;
        let mut lines = layout.clone();
        if difference.pixels > 0 {
            lines.push(format!(
                "{} of {compared} pixels differ, largest {:.5}, RMSE {:.6}, PSNR {:.2} dB",
                difference.pixels, difference.largest, difference.rmse, difference.psnr
            ));
        }
        for FlipDifference { name, mean, .. } in &self.flip {
            let of = if name.is_empty() { String::new() } else { format!(" of `{name}`") };
            lines.push(format!("FLIP{of} {mean:.4}"));
        }
        if lines.is_empty() {
            lines.push("equal".into());
        }
        lines
    }

    /// The number of a metric, where it was computed.
    pub fn number(&self, metric: Metric) -> Option<f64> {
        let difference = self.comparison.difference;
        match metric {
            Metric::Exact => Some(difference.pixels as f64),
            Metric::Max => Some(difference.largest),
            Metric::Rmse => Some(difference.rmse),
            Metric::Psnr => Some(difference.psnr),
            Metric::Flip if self.comparison.is_equal() => Some(0.0),
            Metric::Flip => self.worst_flip(),
        }
    }

    fn forgives(&self, slack: Slack) -> bool {
        let Some(number) = self.number(slack.metric) else { return false };
        match slack.metric {
            Metric::Exact => number == 0.0,
            Metric::Max | Metric::Rmse | Metric::Flip => number <= slack.threshold,
            Metric::Psnr => number >= slack.threshold,
        }
    }
}

/// Compares two pictures and judges them: what is not equal must be forgiven by every `slack`; none forgives nothing.
///
/// What is there in one picture alone, or lies elsewhere, is never forgiven. With `always_flip` FLIP is computed for any
/// pictures that differ, whatever they are judged by.
pub fn judge(
    a: &LayeredPicture,
    b: &LayeredPicture,
    slack: &[Slack],
    settings: FlipSettings,
    always_flip: bool,
) -> Judgement {
    let comparison = compare(a, b);
    let mut judgement = Judgement { comparison, flip: Vec::new(), settings, verdict: Verdict::Equal };
    if judgement.comparison.is_equal() {
        return judgement;
    }
    if always_flip || slack.iter().any(|slack| slack.metric == Metric::Flip) {
        judgement.flip = flip_differences(a, b, settings);
    }
    let forgiven = !slack.is_empty() && slack.iter().all(|slack| judgement.forgives(*slack));
    let is_whole = judgement.comparison.layout.is_empty();
    judgement.verdict = if forgiven && is_whole { Verdict::Within } else { Verdict::Different };
    judgement
}

/// The FLIP errors of every colour that both pictures have, where both cover the plane.
fn flip_differences(a: &LayeredPicture, b: &LayeredPicture, settings: FlipSettings) -> Vec<FlipDifference> {
    let others = color_layers(b);
    let pairs = color_layers(a).into_iter().filter_map(|one| {
        let other = others.iter().find(|other| other.name == one.name)?;
        flip_difference(&one, other, settings)
    });
    pairs.collect()
}

fn flip_difference(a: &ColorLayer, b: &ColorLayer, settings: FlipSettings) -> Option<FlipDifference> {
    let window = a.window.common(b.window)?;
    let (reference, test) = (a.crop(window), b.crop(window));
    let width = window.size[0];
    let is_linear = |layer: &ColorLayer| layer.encoding == ColorEncoding::Linear;
    // A picture for the screen can only be compared as it is shown, with one of light it cannot.
    let (map, exposures) = match (is_linear(a), is_linear(b)) {
        (false, false) => (flip::ldr(width, &reference, &test, settings.viewing), None),
        (true, true) => {
            let exposures = settings.exposures.unwrap_or_else(|| flip::exposures(&reference));
            (flip::hdr(width, &reference, &test, settings.viewing, exposures), Some(exposures))
        }
        _ => return None,
    };
    Some(FlipDifference { name: a.name.clone(), mean: map.mean(), map, exposures })
}

/// What was found, in one line for people: the layout first, then the numbers.
impl fmt::Display for Judgement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.lines().join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{ChannelSamples, PictureChannel, PicturePart, PixelWindow};

    fn gray(encoding: ColorEncoding, value: f32) -> LayeredPicture {
        let window = PixelWindow { origin: [0, 0], size: [4, 4] };
        let channel =
            |name: &str| PictureChannel { name: name.into(), samples: ChannelSamples::Float(vec![value; 16]) };
        let channels = ["R", "G", "B"].map(channel).to_vec();
        LayeredPicture {
            encoding,
            display_window: window,
            parts: vec![PicturePart { name: None, data_window: window, channels }],
        }
    }

    fn verdict(a: f32, b: f32, metric: Metric, threshold: f64) -> Verdict {
        let pair = [a, b].map(|value| gray(ColorEncoding::Srgb { bits: 8 }, value));
        judge(&pair[0], &pair[1], &[Slack { metric, threshold }], FlipSettings::default(), false).verdict
    }

    #[test]
    fn each_metric_forgives_what_it_may() {
        assert_eq!(verdict(0.5, 0.5, Metric::Exact, 0.0), Verdict::Equal);
        assert_eq!(verdict(0.5, 0.51, Metric::Exact, 1.0), Verdict::Different);
        for (metric, inside, outside) in [
            (Metric::Max, 0.011, 0.009),
            (Metric::Rmse, 0.011, 0.009),
            (Metric::Psnr, 39.0, 41.0),
            (Metric::Flip, 0.2, 0.0001),
        ] {
            assert_eq!(verdict(0.5, 0.51, metric, inside), Verdict::Within, "{metric:?}");
            assert_eq!(verdict(0.5, 0.51, metric, outside), Verdict::Different, "{metric:?}");
        }
    }

    #[test]
    fn every_slack_must_forgive_and_layout_is_never_forgiven() {
        let (a, b) = (gray(ColorEncoding::Linear, 0.5), gray(ColorEncoding::Linear, 0.51));
        let slack = |metric, threshold| Slack { metric, threshold };
        let run = |a: &LayeredPicture, b: &LayeredPicture, slack: &[Slack]| {
            judge(a, b, slack, FlipSettings::default(), false).verdict
        };
        assert_eq!(run(&a, &b, &[]), Verdict::Different);
        assert_eq!(run(&a, &b, &[slack(Metric::Max, 0.1), slack(Metric::Flip, 0.9)]), Verdict::Within);
        assert_eq!(run(&a, &b, &[slack(Metric::Max, 0.1), slack(Metric::Rmse, 0.001)]), Verdict::Different);
        let mut bare = b.clone();
        bare.parts[0].channels.remove(0);
        assert_eq!(run(&a, &bare, &[slack(Metric::Max, 9.0)]), Verdict::Different);
        let shown = gray(ColorEncoding::Srgb { bits: 8 }, 0.51);
        assert_eq!(run(&a, &shown, &[slack(Metric::Flip, 1.0)]), Verdict::Different, "light and screen have no FLIP");
    }

    #[test]
    fn the_line_for_people_names_what_was_found() {
        let (a, b) = (gray(ColorEncoding::Srgb { bits: 8 }, 0.5), gray(ColorEncoding::Srgb { bits: 8 }, 0.6));
        let line = judge(&a, &b, &[], FlipSettings::default(), true).to_string();
        assert!(line.starts_with("16 of 16 pixels differ, largest 0.10000") && line.contains("FLIP 0."), "{line}");
        assert_eq!(judge(&a, &a, &[], FlipSettings::default(), true).to_string(), "equal");
    }
}
