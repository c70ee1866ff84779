//! `anim diff`: two pictures, or two folders of them.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::{Exit, print, say, usage};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::limits;
use crate::compare::flip::{Exposures, Viewing};
use crate::compare::judge::{FlipSettings, Judgement, Metric, Slack, Verdict, judge};
use crate::compare::report::{ReportItem, ReportPage};
use crate::compare::{self, Picture, difference_picture};
use crate::output::{LayeredPicture, write_atomic};

#[derive(clap::Args)]
#[command(
    after_help = "Every value of both files is compared: alpha, and all parts and channels of an EXR file, by name. What is there in \
            one of the two alone, or covers another rectangle, is a difference that no tolerance forgives. PNG values go from 0 to 1, \
            EXR values are what the file holds.

Metrics, and what --tolerance means for them:
  exact   no value differs
  max     the largest difference of a channel is at most the tolerance (a step of an 8-bit PNG is 0.0039)
  rmse    the root of the mean square difference of all channels is at most the tolerance
  psnr    the peak signal to noise ratio in decibels, for a peak of 1, is at least the tolerance
  flip    the mean FLIP error of every colour is at most the tolerance, 0 to 1; channels that are no colours are not judged

Examples:
  anim diff a.png b.png                              exit code 0 if they are equal, 1 if not
  anim diff before/ after/ -o apart/ --html apart.html
  anim diff a.exr b.exr --metric max --tolerance 1e-4
  anim diff a.png b.png --metric flip --tolerance 0.02 --json"
)]
pub struct DiffArguments {
    /// A picture or a folder of pictures
    a: PathBuf,
    /// What to compare it with
    b: PathBuf,
    /// What decides: exact, max, rmse, psnr or flip [default: exact, or max with a tolerance]
    #[arg(long, value_name = "NAME", value_parser = parse_metric)]
    metric: Option<Metric>,
    /// How much of the metric counts as equal
    #[arg(long, value_name = "NUMBER", value_parser = parse_tolerance, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// Write both pictures and eight times their difference, side by side: a file, or a folder for folders
    #[arg(short, long, value_name = "PLACE")]
    out: Option<PathBuf>,
    /// Print one JSON object a line for each pair
    #[arg(long)]
    json: bool,
    /// Write a page that shows the pairs that differ
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Pixels in one degree of the visual field, for FLIP [default: 67.02, a 4 k screen at arm's length]
    #[arg(long, value_name = "NUMBER", value_parser = parse_pixels_per_degree)]
    pixels_per_degree: Option<f64>,
    /// Stops at which FLIP compares EXR files: first, last and how many [default: derived from the first picture]
    #[arg(long, value_name = "FROM..TO/N", value_parser = parse_exposures, allow_hyphen_values = true)]
    exposures: Option<Exposures>,
}

fn parse_metric(text: &str) -> Result<Metric, String> {
    let words = || Metric::ALL.map(Metric::word).join(", ");
    Metric::ALL.into_iter().find(|metric| metric.word() == text).ok_or_else(|| format!("expected one of {}", words()))
}

fn parse_tolerance(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|t: &f64| *t >= 0.0).ok_or_else(|| "expected a number of at least 0".into())
}

fn parse_pixels_per_degree(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|n| (1.0..=1000.0).contains(n));
    number.ok_or_else(|| "expected a number from 1 to 1000".into())
}

fn parse_exposures(text: &str) -> Result<Exposures, String> {
    let parts = text.split_once('/').and_then(|(range, count)| {
        let (start, stop) = range.split_once("..")?;
        Some((start.parse().ok()?, stop.parse().ok()?, count.parse().ok()?))
    });
    let (start, stop, count): (f64, f64, u32) = parts.ok_or("expected FROM..TO/N, as in -4..8/13")?;
    let is_good = (-limits::EXPOSURE..=limits::EXPOSURE).contains(&start) && start <= stop && stop <= limits::EXPOSURE;
    if !is_good || !(1..=limits::FLIP_EXPOSURES).contains(&count) {
        let (most, stops) = (limits::FLIP_EXPOSURES, limits::EXPOSURE);
        return Err(format!("expected FROM..TO/N within {stops} stops, from low to high, and N from 1 to {most}"));
    }
    Ok(Exposures { start, stop, count })
}

/// What the pairs are judged by.
struct Rule {
    slack: Slack,
    settings: FlipSettings,
}

impl DiffArguments {
    fn rule(&self) -> Result<Rule, Diagnostics> {
        let metric =
            self.metric.unwrap_or(if self.tolerance.is_some_and(|t| t > 0.0) { Metric::Max } else { Metric::Exact });
        let threshold = match (metric, self.tolerance) {
            (Metric::Exact, Some(t)) if t > 0.0 => {
                return Err(usage("--metric exact has no tolerance; use max, rmse, psnr or flip"));
            }
            (Metric::Psnr, None) => f64::INFINITY,
            (_, tolerance) => tolerance.unwrap_or(0.0),
        };
        let usual = Viewing::default().pixels_per_degree;
        let viewing = Viewing { pixels_per_degree: self.pixels_per_degree.unwrap_or(usual) };
        let settings = FlipSettings { viewing, exposures: self.exposures };
        Ok(Rule { slack: Slack { metric, threshold }, settings })
    }
}

/// What was found of one name.
enum PairResult {
    Pair(Box<Judgement>),
    /// Only one folder has it.
    Only(PathBuf),
}

pub fn diff(arguments: DiffArguments) -> Result<Exit, Diagnostics> {
    let DiffArguments { a, b, .. } = &arguments;
    let rule = arguments.rule()?;
    for path in [a, b] {
        std::fs::metadata(path).map_err(|e| Diagnostic::io(path.display(), "read", &e))?;
    }
    if a.is_dir() != b.is_dir() {
        return Err(usage("diff compares two pictures or two folders, not one with the other"));
    }
    let mut run = DiffRun { arguments: &arguments, rule, equal: true, items: Vec::new(), counts: [0; 4] };
    if a.is_dir() {
        run.folders(a, b)?;
    } else {
        let name = b.file_name().unwrap_or_default().to_string_lossy().into_owned();
        run.pair(&name, a, b, arguments.out.as_deref())?;
    }
    run.page()?;
    Ok(if run.equal { Exit::Done } else { Exit::Differences })
}

struct DiffRun<'a> {
    arguments: &'a DiffArguments,
    rule: Rule,
    equal: bool,
    items: Vec<ReportItem>,
    /// Pairs that are equal, within the tolerance, different; names that only one folder has.
    counts: [usize; 4],
}

impl DiffRun<'_> {
    fn folders(&mut self, a: &Path, b: &Path) -> Result<(), Diagnostics> {
        let (in_a, in_b) = (pictures_in(a)?, pictures_in(b)?);
        if in_a.is_empty() && in_b.is_empty() {
            // Two folders without a picture are most likely two wrong folders.
            let message = format!("there are no pictures in {} and {}", a.display(), b.display());
            return Err(Diagnostic::error(message).help("pictures end in .png or .exr").into());
        }
        let out = self.arguments.out.as_deref();
        if out.is_some_and(Path::is_file) {
            return Err(usage("-o: two folders need a folder for the pictures of their differences"));
        }
        let mut names: Vec<&String> = in_a.iter().chain(&in_b).collect();
        names.sort();
        names.dedup();
        for name in names {
            match (in_a.contains(name), in_b.contains(name)) {
                (true, true) => {
                    let target = out.map(|out| out.join(name).with_extension("png"));
                    self.pair(name, &a.join(name), &b.join(name), target.as_deref())?;
                }
                (true, false) => self.only(name, a),
                (false, _) => self.only(name, b),
            }
        }
        let [equal, within, different, alone] = self.counts;
        if !self.arguments.json && !self.equal {
            print(&format!("{} equal, {different} different, {alone} only in one folder\n", equal + within));
        }
        Ok(())
    }

    fn only(&mut self, name: &str, folder: &Path) {
        self.equal = false;
        self.counts[3] += 1;
        let line = format!("only in {}", folder.display());
        self.say(name, &PairResult::Only(folder.to_path_buf()));
        if self.arguments.html.is_some() {
            let read = compare::read(&folder.join(name)).ok();
            let is_first = folder == self.arguments.a;
            let (a, b) = if is_first { (read.as_ref(), None) } else { (None, read.as_ref()) };
            let item = ReportItem { id: name.into(), status: "missing", lines: vec![line], ..ReportItem::default() };
            self.items.push(item.with_pictures(a, b, None));
        }
    }

    fn pair(&mut self, name: &str, a: &Path, b: &Path, out: Option<&Path>) -> Result<(), Diagnostics> {
        let (pa, pb) = (compare::read(a)?, compare::read(b)?);
        let judged = judge(&pa, &pb, &[self.rule.slack], self.rule.settings, self.arguments.html.is_some());
        let is_single = self.arguments.a.is_file();
        if let Some(out) = out.filter(|_| is_single || judged.verdict == Verdict::Different) {
            write_difference(&pa, &pb, a, b, out)?;
        }
        let (which, status) = match judged.verdict {
            Verdict::Equal => (0, "equal"),
            Verdict::Within => (1, "within"),
            Verdict::Different => (2, "different"),
        };
        self.counts[which] += 1;
        self.equal &= judged.verdict != Verdict::Different;
        if self.arguments.html.is_some() && judged.verdict != Verdict::Equal {
            let files = [a, b].map(|path| Some(path.display().to_string()));
            let lines = judged.lines();
            let item = ReportItem { id: name.into(), status, lines, files, ..ReportItem::default() };
            self.items.push(item.with_pictures(Some(&pa), Some(&pb), Some(&judged)));
        }
        self.say(&b.display().to_string(), &PairResult::Pair(Box::new(judged)));
        Ok(())
    }

    fn say(&self, name: &str, found: &PairResult) {
        if self.arguments.json {
            print(&format!("{}\n", line(name, found, self.rule.slack)));
            return;
        }
        match found {
            PairResult::Only(folder) => print(&format!("{name}: only in {}\n", folder.display())),
            PairResult::Pair(judged) if judged.verdict == Verdict::Different => print(&text(name, judged)),
            PairResult::Pair(judged) => self.warn_of_unjudged(name, judged),
        }
    }

    /// FLIP sees colours alone.
    fn warn_of_unjudged(&self, name: &str, judged: &Judgement) {
        let unjudged = judged.unjudged_channels();
        if self.rule.slack.metric == Metric::Flip && !unjudged.is_empty() {
            let list = unjudged.join("`, `");
            let message = format!("{name}: `{list}` differ and are not judged: FLIP compares colours");
            say(&Diagnostic::warning(message).into());
        }
    }

    fn page(&mut self) -> Result<(), Diagnostics> {
        let Some(file) = &self.arguments.html else { return Ok(()) };
        let [equal, within, different, alone] = self.counts;
        let title = match different + alone {
            0 => "No picture differs".to_string(),
            1 => "1 picture differs".to_string(),
            n => format!("{n} pictures differ"),
        };
        let (a, b) = (self.arguments.a.display(), self.arguments.b.display());
        let counts =
            format!("{equal} equal, {within} within the tolerance, {different} different, {alone} in one alone");
        let viewing = self.rule.settings.viewing.pixels_per_degree;
        let page = ReportPage {
            title,
            summary: format!("{a} and {b}: {counts}; FLIP at {viewing:.2} pixels per degree"),
            names: ["first", "second"],
            command: None,
            items: std::mem::take(&mut self.items),
        };
        write_atomic(file, page.to_html().as_bytes())?;
        Ok(())
    }
}

fn write_difference(
    pa: &LayeredPicture,
    pb: &LayeredPicture,
    a: &Path,
    b: &Path,
    out: &Path,
) -> Result<(), Diagnostics> {
    let shown = |picture: &LayeredPicture, path: &Path| {
        let no_colors = || Diagnostic::error(format!("{}: there are no channels R, G and B to show", path.display()));
        Picture::shown(picture).ok_or_else(no_colors)
    };
    Ok(write_atomic(out, &difference_picture(&shown(pa, a)?, &shown(pb, b)?).to_png()?)?)
}

fn pictures_in(folder: &Path) -> Result<Vec<String>, Diagnostic> {
    let entries = std::fs::read_dir(folder).map_err(|e| Diagnostic::io(folder.display(), "read", &e))?;
    let mut names: Vec<String> = entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.retain(|name| [".png", ".exr"].iter().any(|ending| name.to_lowercase().ends_with(ending)));
    names.sort();
    Ok(names)
}

/// What differs, for people: a line, and one for each channel that differs where there are more than colours.
fn text(name: &str, judged: &Judgement) -> String {
    let mut text = format!("{name}: {judged}\n");
    let channels = &judged.comparison.channels;
    if channels.iter().any(|channel| !["R", "G", "B"].contains(&channel.name.as_str())) {
        for channel in channels.iter().filter(|channel| channel.difference.pixels > 0) {
            let (d, [x, y]) = (channel.difference, channel.worst);
            let numbers = format!("{} pixels, largest {:.5} at {x}, {y}, RMSE {:.6}", d.pixels, d.largest, d.rmse);
            let _ = writeln!(text, "  channel `{}`: {numbers}", channel.name);
        }
    }
    text
}

fn line(name: &str, found: &PairResult, slack: Slack) -> Value {
    let judged = match found {
        PairResult::Only(folder) => {
            return json!({ "file": name, "result": "missing", "only_in": folder.to_string_lossy() });
        }
        PairResult::Pair(judged) => judged,
    };
    let result = match judged.verdict {
        Verdict::Equal => "equal",
        Verdict::Within => "within",
        Verdict::Different => "different",
    };
    let mut value = numbers(judged);
    value["file"] = name.into();
    value["result"] = result.into();
    value["metric"] = slack.metric.word().into();
    value["tolerance"] = slack.threshold.into();
    value
}

/// The numbers of a comparison as JSON; what is infinite is null.
pub fn numbers(judged: &Judgement) -> Value {
    let comparison = &judged.comparison;
    let channel = |c: &compare::comparison::ChannelDifference| {
        json!({
            "name": c.name, "pixels": c.difference.pixels, "largest": c.difference.largest, "rmse": c.difference.rmse,
            "worst": c.worst,
        })
    };
    let flip = |f: &compare::judge::FlipDifference| {
        let exposures = f.exposures.map(|e| json!({ "from": e.start, "to": e.stop, "count": e.count }));
        json!({
            "color": f.name, "mean": f.mean, "largest": f.map.largest(),
            "pixels_per_degree": judged.settings.viewing.pixels_per_degree, "exposures": exposures,
        })
    };
    let d = comparison.difference;
    json!({
        "pixels": d.pixels,
        "of": comparison.compared,
        "largest": d.largest,
        "rmse": d.rmse,
        "psnr": d.psnr,
        "layout": comparison.layout,
        "channels": comparison.channels.iter().filter(|c| c.difference.pixels > 0).map(channel).collect::<Vec<_>>(),
        "flip": judged.flip.iter().map(flip).collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposures_and_metrics_are_read_and_refused() {
        assert_eq!(parse_exposures("-4..8/13"), Ok(Exposures { start: -4.0, stop: 8.0, count: 13 }));
        for wrong in ["", "1..2", "8..-4/3", "1..2/0", "1..2/65", "-99..2/3", "a..b/2", "NaN..1/2"] {
            assert!(parse_exposures(wrong).is_err(), "{wrong}");
        }
        assert_eq!(parse_metric("psnr"), Ok(Metric::Psnr));
        assert!(parse_metric("mse").unwrap_err().contains("rmse"));
        assert!(parse_tolerance("-1").is_err() && parse_tolerance("NaN").is_err());
    }
}
