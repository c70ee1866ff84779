//! Testing a list: plan the frames, render what the goldens cannot vouch for, compare.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::results::{GoldenResult, Outcome};
use super::{GoldenPatterns, TestArguments, Tested, shown};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::limits;
use crate::cli::{diff, evaluation, frames, progress::Progress, say};
use crate::compare::golden::{self, GoldenPicture};
use crate::compare::judge::{FlipSettings, Judgement, Metric, Slack, Verdict, judge};
use crate::compare::report::{ReportItem, SceneChange};
use crate::load::golden::{GoldenEntry, GoldenList};
use crate::output::names::Target;
use crate::shot::plan::{self, PlannedFrame};
use crate::shot::run::{self, Event, ReusePolicy};
use crate::shot::{self, OpenOptions, Overrides, Shot};

/// Folder of new pictures, beside the goldens.
pub const NEW: &str = ".new";
/// The page, in the folder of new pictures.
pub const REPORT: &str = "report.html";
/// What a folder of new pictures holds beside them.
const KEPT_OUT: [&str; 2] = [".gitignore", crate::output::manifest::NAME];

/// What came of a list.
pub struct ListRun {
    pub results: Vec<GoldenResult>,
    /// File names of all goldens that the list names.
    pub named: BTreeSet<String>,
    pub is_cancelled: bool,
}

/// Tests what a list names and the patterns match.
///
/// # Errors
/// A file that cannot be written. Mistakes of scripts stay with their goldens.
pub fn run(
    list: &GoldenList,
    out: &Path,
    only: &GoldenPatterns,
    arguments: &TestArguments,
    cancel: &AtomicBool,
) -> Result<ListRun, Diagnostics> {
    let mut done = ListRun { results: Vec::new(), named: BTreeSet::new(), is_cancelled: false };
    for entry in &list.entries {
        let tester = Tester { list, entry, out, only, arguments, cancel };
        match tester.run(&mut done)? {
            true => {}
            false => {
                done.is_cancelled = true;
                break;
            }
        }
    }
    Ok(done)
}

/// One entry on its way through the test.
struct Tester<'a> {
    list: &'a GoldenList,
    entry: &'a GoldenEntry,
    out: &'a Path,
    only: &'a GoldenPatterns,
    arguments: &'a TestArguments,
    cancel: &'a AtomicBool,
}

impl Tester<'_> {
    /// Gives whether it was not interrupted.
    fn run(&self, done: &mut ListRun) -> Result<bool, Diagnostics> {
        let (mut shot, wanted) = match self.open() {
            Ok(opened) => opened,
            Err(problems) => {
                // Which frames there would be nobody knows: goldens of the name are left alone.
                done.named.extend(goldens_of(&self.list.folder, &self.entry.name));
                if self.only.touches(&self.entry.name) {
                    done.results.push(self.failed(0, problems));
                }
                return Ok(true);
            }
        };
        done.named.extend(wanted.iter().map(|frame| self.file_name(*frame)));
        let wanted: Vec<u32> = wanted.into_iter().filter(|frame| self.only.matches(&self.entry.name, *frame)).collect();
        if wanted.is_empty() {
            return Ok(true);
        }
        let target = Target::Pattern {
            before: self.out.join(&self.entry.name).to_string_lossy().into_owned() + ".",
            digits: 4,
            after: ".png".into(),
        };
        let mut plan = match plan::make(&mut shot, &wanted, target) {
            Ok(plan) => plan,
            Err(problems) => {
                done.results.extend(wanted.iter().map(|frame| self.failed(*frame, problems.clone())));
                return Ok(true);
            }
        };
        let planned = std::mem::take(&mut plan.frames);
        let is_known = |planned: &PlannedFrame| {
            !self.arguments.render && golden::hash_of(&self.golden(planned.frame)) == Some(planned.hash)
        };
        let (known, others): (Vec<_>, Vec<_>) = planned.into_iter().partition(is_known);
        plan.frames = others;
        let unrendered = self.render(&mut shot, &mut plan)?;
        let Some(unrendered) = unrendered else { return Ok(false) };
        let mut results: Vec<GoldenResult> =
            known.iter().map(|planned| self.result(planned.frame, Outcome::Unchanged)).collect();
        for planned in &plan.frames {
            let failed = unrendered.iter().find(|(frame, _)| *frame == planned.frame);
            let problems = planned.fingerprint.as_ref().err().or(failed.map(|(_, problems)| problems));
            results.push(match problems {
                Some(problems) => self.failed(planned.frame, problems.clone()),
                None => self.compared(&mut shot, planned)?,
            });
        }
        results.sort_by_key(|result| wanted.iter().position(|frame| *frame == result.frame));
        done.results.extend(results);
        Ok(true)
    }

    fn open(&self) -> Result<(Shot, Vec<u32>), Diagnostics> {
        let settings = &self.entry.settings;
        let overrides = Overrides {
            size: settings.size,
            samples: settings.samples,
            seed: settings.seed,
            integrator: settings.integrator,
            bit_depth: Some(settings.bit_depth.unwrap_or(8)),
            aovs: Some(Vec::new()),
            ..Overrides::default()
        };
        let options = OpenOptions {
            defines: self.entry.parameters.clone(),
            strict: false,
            overrides,
            access: self.arguments.access.access(),
            evaluation: evaluation()?,
            ..OpenOptions::default()
        };
        let (shot, warnings) = shot::open_with(&self.entry.script, options)?;
        say(&warnings);
        let count = shot.frames();
        let frames = match &self.entry.frames {
            Some(list) => frames::parse(list, count).map_err(|message| {
                let message = message.replacen("--frames", "frames", 1);
                Diagnostics::from(Diagnostic::error(message).at(self.entry.place.clone()))
            })?,
            None => (1..=count).collect(),
        };
        Ok((shot, frames))
    }

    /// Renders what is left of the plan; gives the frames that failed, or `None` if it was interrupted.
    fn render(&self, shot: &mut Shot, plan: &mut plan::Plan) -> Result<Option<Vec<(u32, Diagnostics)>>, Diagnostics> {
        if plan.frames.iter().all(|planned| planned.fingerprint.is_err()) {
            return Ok(Some(Vec::new()));
        }
        keep_out_of_git(self.out)?;
        if !self.arguments.render {
            plan.inspect(&shot.source);
        }
        let progress = Progress::new(self.arguments.progress, plan.frames.len());
        let watch = |event: Event| match event {
            Event::Tiles { frame, done, total } => progress.tiles(frame, done, total),
            Event::Written(report) => progress.written(report.frame, &report.file.to_string_lossy()),
            Event::Failed(_) => {}
        };
        let policy = ReusePolicy { reuse: true, memory: limits::REUSE_MEMORY };
        let outcome = run::run(shot, plan, policy, self.cancel, &watch);
        progress.clear();
        let outcome = outcome?;
        Ok((!outcome.cancelled).then_some(outcome.failed))
    }

    fn compared(&self, shot: &mut Shot, planned: &PlannedFrame) -> Result<GoldenResult, Diagnostics> {
        let new = GoldenPicture::read(&planned.file)?;
        let path = self.golden(planned.frame);
        let mut result = self.result(planned.frame, Outcome::Missing);
        result.new = Some(planned.file.clone());
        let known = path.exists().then(|| GoldenPicture::read(&path));
        let judged = match &known {
            Some(Ok(known)) => Some(judge(&known.picture, &new.picture, &self.slack(), self.flip_settings(), true)),
            // A golden that is no picture is different from any; what it was can be made golden again.
            Some(Err(problem)) => {
                result.outcome = Outcome::Different;
                result.lines.push(problem.message.clone());
                None
            }
            None => {
                result.lines.push("there is no golden yet".into());
                None
            }
        };
        if let Some(judged) = &judged {
            result.outcome = match judged.verdict {
                Verdict::Equal => Outcome::Equal,
                Verdict::Within => Outcome::Within,
                Verdict::Different => Outcome::Different,
            };
            if judged.verdict != Verdict::Equal {
                result.lines = lines(judged);
                result.numbers = Some(diff::numbers(judged));
            }
        }
        let is_equal = matches!(result.outcome, Outcome::Equal);
        if is_equal && self.arguments.accept.is_none() {
            return Ok(result);
        }
        let description = planned.fingerprint.as_ref().ok().map(|f| shot.describe(planned.frame, f)).transpose()?;
        result.description = description.as_ref().map(golden::fitting_text);
        if let (Some(Ok(known)), false) = (&known, is_equal) {
            result.why = why(known, description.as_ref());
        }
        if result.outcome.fails() {
            let golden = known.as_ref().and_then(|known| known.as_ref().ok()).map(|known| &known.picture);
            result.item = Some(item(&result).with_pictures(golden, Some(&new.picture), judged.as_ref()));
        }
        Ok(result)
    }

    fn slack(&self) -> Vec<Slack> {
        let settings = &self.entry.settings;
        let flip = settings.flip.map(|threshold| Slack { metric: Metric::Flip, threshold });
        // Half a step more, so that rounding of the values decides nothing.
        let max = settings.max.map(|steps| Slack { metric: Metric::Max, threshold: (steps + 0.001) / 255.0 });
        flip.into_iter().chain(max).collect()
    }

    fn flip_settings(&self) -> FlipSettings {
        let mut settings = FlipSettings::default();
        if let Some(pixels_per_degree) = self.list.pixels_per_degree {
            settings.viewing.pixels_per_degree = pixels_per_degree;
        }
        settings
    }

    fn file_name(&self, frame: u32) -> String {
        format!("{}.{frame:04}.png", self.entry.name)
    }

    fn golden(&self, frame: u32) -> PathBuf {
        self.list.folder.join(self.file_name(frame))
    }

    fn result(&self, frame: u32, outcome: Outcome) -> GoldenResult {
        GoldenResult {
            name: self.entry.name.clone(),
            frame,
            place: self.entry.place.clone(),
            script: self.entry.script.clone(),
            golden: self.golden(frame),
            new: None,
            outcome,
            lines: Vec::new(),
            numbers: None,
            why: Vec::new(),
            description: None,
            item: None,
        }
    }

    fn failed(&self, frame: u32, problems: Diagnostics) -> GoldenResult {
        let first = problems.0.first().map(|problem| problem.message.clone()).unwrap_or_default();
        let message = problems.to_string();
        let mut result = self.result(frame, Outcome::Failed(problems));
        result.lines.push(first);
        result.item = Some(ReportItem { message: Some(message), ..item(&result) });
        result
    }
}

/// The part of the page that tells of a result, without its pictures.
fn item(result: &GoldenResult) -> ReportItem {
    ReportItem {
        id: result.id(),
        status: result.outcome.word(),
        lines: result.lines.clone(),
        message: None,
        why: result.why.clone(),
        files: [result.golden.exists().then(|| shown(&result.golden)), result.new.as_deref().map(shown)],
        is_acceptable: !matches!(result.outcome, Outcome::Failed(_)),
        ..ReportItem::default()
    }
}

/// What was found, with differences in steps of 1/255 where the pictures are of 8 bits.
fn lines(judged: &Judgement) -> Vec<String> {
    let mut lines = judged.lines();
    let difference = judged.comparison.difference;
    if let Some(line) = lines.iter_mut().find(|line| line.contains("pixels differ")) {
        let steps = (difference.largest * 255.0 * 100.0).round() / 100.0;
        *line = format!(
            "{} of {} pixels differ, by {steps} of 255 at most, RMSE {:.5}",
            difference.pixels, judged.comparison.compared, difference.rmse
        );
    }
    lines
}

/// What the frame is made from now, and the golden was not.
fn why(known: &GoldenPicture, now: Option<&crate::compare::description::FrameDescription>) -> Vec<SceneChange> {
    let tell = |what: &str| vec![SceneChange { what: what.into(), before: None, after: None }];
    let (Some(before), Some(now)) = (&known.description, now) else {
        return tell("the golden does not say what it was made from; once it is accepted, it does");
    };
    let changes = before.changes(now);
    if changes.is_empty() {
        return tell(
            "it is made from the same as the golden, by the same version: the golden's pixels were changed, or anim renders otherwise on this machine",
        );
    }
    changes
}

/// A folder of new pictures is no part of a repository; the file in it says so to git.
fn keep_out_of_git(folder: &Path) -> Result<(), Diagnostics> {
    let file = folder.join(".gitignore");
    if file.exists() {
        return Ok(());
    }
    Ok(crate::output::write_atomic(&file, b"*\n")?)
}

/// Goldens in the folder that belong to an entry of this name.
fn goldens_of(folder: &Path, name: &str) -> Vec<String> {
    pictures_in(folder).into_iter().filter(|file| entry_of(file) == Some(name)).collect()
}

/// The name of the entry that a golden's file belongs to.
fn entry_of(file: &str) -> Option<&str> {
    let (name, number) = file.strip_suffix(".png")?.rsplit_once('.')?;
    (number.len() >= 4 && number.bytes().all(|b| b.is_ascii_digit())).then_some(name)
}

fn pictures_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.filter(|name| name.ends_with(".png")).collect();
    names.sort();
    names
}

/// Pictures in the folder of goldens that the list does not name.
pub fn unnamed(list: &GoldenList, named: &BTreeSet<String>) -> Vec<PathBuf> {
    let others = pictures_in(&list.folder).into_iter().filter(|file| !named.contains(file));
    others.map(|file| list.folder.join(file)).collect()
}

/// Removes new pictures that nobody has to look at any more, and the folder, if nothing is left in it.
pub fn tidy(tested: &Tested) {
    for result in tested.results.iter().filter(|result| !result.outcome.fails()) {
        // From a run before, if this one rendered nothing.
        let new = result.new.clone().unwrap_or_else(|| tested.out.join(result.id() + ".png"));
        let _ = std::fs::remove_file(new);
    }
    let Ok(entries) = std::fs::read_dir(&tested.out) else { return };
    let names: Vec<String> = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    if names.iter().all(|name| KEPT_OUT.contains(&name.as_str())) {
        names.iter().for_each(|name| drop(std::fs::remove_file(tested.out.join(name))));
        // Only an empty folder goes.
        let _ = std::fs::remove_dir(&tested.out);
    }
}
