//! What is said of a test: the table, JSON lines, JUnit, annotations, and the page.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::results::{GoldenResult, Outcome};
use super::run::REPORT;
use super::{TestArguments, Tested, shown, tell};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::limits;
use crate::cli::{note, print, say};
use crate::compare::flip::Viewing;
use crate::compare::report::{JunitCase, ReportItem, ReportPage, SceneChange, junit};
use crate::output::write_atomic;

/// Says and writes all that was asked for.
///
/// # Errors
/// A file that cannot be written.
pub fn write(tested: &[Tested], arguments: &TestArguments) -> Result<(), Diagnostics> {
    let failing = tested.iter().flat_map(|tested| &tested.results).any(|result| result.outcome.fails());
    let page = if failing { Some(write_page(tested, arguments)?) } else { remove_page(tested, arguments) };
    if let Some(file) = &arguments.junit {
        let cases: Vec<JunitCase> = tested.iter().flat_map(|tested| &tested.results).map(case).collect();
        write_atomic(file, junit("anim test", &cases).as_bytes())?;
    }
    if arguments.json {
        tested.iter().flat_map(|tested| &tested.results).for_each(|result| print(&format!("{}\n", line(result))));
        print(&format!("{}\n", summary(tested, page.as_deref())));
    } else {
        table(tested, arguments, page.as_deref());
    }
    if std::env::var_os("GITHUB_ACTIONS").is_some_and(|value| value == "true") {
        annotate(tested, arguments);
    }
    Ok(())
}

const ORDER: [&str; 7] = ["unchanged", "equal", "within", "different", "missing", "failed", "accepted"];

/// How many there are of each outcome, in a fixed order, without those of which there is none.
fn counts(tested: &[Tested]) -> Vec<(&'static str, usize)> {
    let results = || tested.iter().flat_map(|tested| &tested.results);
    let count = |word: &'static str| (word, results().filter(|result| result.outcome.word() == word).count());
    ORDER.into_iter().map(count).filter(|(_, n)| *n > 0).collect()
}

fn counted(tested: &[Tested]) -> String {
    let parts: Vec<String> = counts(tested).into_iter().map(|(word, n)| format!("{n} {word}")).collect();
    parts.join(", ")
}

/// Lines of `why` that a table shows of one golden; the page shows all.
const SHOWN_WHY: usize = 4;

fn table(tested: &[Tested], arguments: &TestArguments, page: Option<&str>) {
    let shown_results = || {
        let results = tested.iter().flat_map(|tested| &tested.results);
        results.filter(|result| result.outcome.fails() || matches!(result.outcome, Outcome::Accepted | Outcome::Within))
    };
    let width = shown_results().map(|result| result.id().len()).max().unwrap_or(0).max(6);
    if shown_results().next().is_some() {
        tell(arguments, &format!("{:<width$}  {:<9}  what was found", "golden", "result"));
    }
    for result in shown_results() {
        let mut lines = result.lines.iter();
        let first = lines.next().map(String::as_str).unwrap_or_default();
        let row = format!("{:<width$}  {:<9}  {first}", result.id(), result.outcome.word());
        tell(arguments, row.trim_end());
        if matches!(result.outcome, Outcome::Accepted) {
            continue;
        }
        let indent = " ".repeat(width + 13);
        lines.for_each(|line| tell(arguments, &format!("{indent}{line}")));
        let why = result.why.iter().take(SHOWN_WHY);
        why.for_each(|change| tell(arguments, &format!("{indent}why: {change}")));
        if result.why.len() > SHOWN_WHY {
            tell(arguments, &format!("{indent}why: and {} more", result.why.len() - SHOWN_WHY));
        }
    }
    for tested in tested {
        for result in &tested.results {
            if let Outcome::Failed(problems) = &result.outcome {
                say(problems);
            }
        }
        if !tested.unnamed.is_empty() {
            let list: Vec<String> = tested.unnamed.iter().take(10).map(|path| shown(path)).collect();
            let more = tested.unnamed.len().saturating_sub(10);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let message = format!("no list names {}{more}", list.join(", "));
            say(&Diagnostic::warning(message).help("`anim test --prune` removes them").into());
        }
    }
    tell(arguments, &counted(tested));
    if let Some(page) = page {
        tell(arguments, &format!("see {page}"));
        tell(
            arguments,
            &format!(
                "what is right becomes golden with `{} --accept PATTERN`, or one by one with --review",
                command(tested)
            ),
        );
    }
    let equal = counts(tested).into_iter().any(|(word, _)| word == "equal");
    if equal && page.is_none() && !arguments.render {
        tell(
            arguments,
            &format!("equal ones are rendered each time; `{} --accept` renews what they carry", command(tested)),
        );
    }
}

/// The command that tests the same lists.
fn command(tested: &[Tested]) -> String {
    let usual = tested.len() == 1 && tested[0].list.file == Path::new(crate::load::golden::GOLDEN_FILE);
    let files = tested.iter().map(|tested| format!(" {}", quoted(&shown(&tested.list.file))));
    if usual { "anim test".into() } else { format!("anim test{}", files.collect::<String>()) }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "@%+=:,./_-".contains(c);
    if word.chars().all(is_plain) { word.to_string() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

fn line(result: &GoldenResult) -> Value {
    let problems = match &result.outcome {
        Outcome::Failed(problems) => Some(problems.to_string()),
        _ => None,
    };
    json!({
        "golden": result.id(),
        "frame": (result.frame > 0).then_some(result.frame),
        "result": result.outcome.word(),
        "script": shown(&result.script),
        "file": shown(&result.golden),
        "new": result.new.as_deref().map(shown),
        "found": result.lines,
        "numbers": result.numbers,
        "why": result.why.iter().map(change).collect::<Vec<_>>(),
        "problems": problems,
    })
}

fn change(change: &SceneChange) -> Value {
    json!({ "what": change.what, "before": change.before, "after": change.after })
}

fn summary(tested: &[Tested], page: Option<&str>) -> Value {
    let counts: serde_json::Map<String, Value> =
        counts(tested).into_iter().map(|(word, n)| (word.to_string(), n.into())).collect();
    let unnamed: Vec<String> = tested.iter().flat_map(|tested| &tested.unnamed).map(|path| shown(path)).collect();
    json!({ "summary": counts, "unnamed": unnamed, "report": page })
}

fn case(result: &GoldenResult) -> JunitCase {
    let problems = match &result.outcome {
        Outcome::Failed(problems) => problems.to_string(),
        _ => String::new(),
    };
    let why = result.why.iter().map(|change| format!("why: {change}"));
    let details: Vec<String> = result.lines.iter().cloned().chain(why).chain([problems]).collect();
    let first = result.lines.first().map(String::as_str).unwrap_or_default();
    JunitCase {
        suite: result.name.clone(),
        name: result.id(),
        failure: result.outcome.fails().then(|| format!("{}: {first}", result.outcome.word())),
        details: details.join("\n").trim_end().to_string(),
    }
}

/// Workflow commands of GitHub Actions: an error at the entry of each golden that fails. They are read from stderr too,
/// which leaves stdout to the results.
fn annotate(tested: &[Tested], arguments: &TestArguments) {
    for result in tested.iter().flat_map(|tested| &tested.results).filter(|result| result.outcome.fails()) {
        let why = result.why.iter().take(SHOWN_WHY).map(|change| format!("why: {change}"));
        let text: Vec<String> = result.lines.iter().cloned().chain(why).collect();
        let line = format!(
            "::error file={},line={},title={}::{}",
            property(&result.place.file),
            result.place.line.max(1),
            property(&format!("{} is {}", result.id(), result.outcome.word())),
            message(&text.join("\n")),
        );
        if arguments.json { note(&line) } else { print(&format!("{line}\n")) }
    }
}

fn message(text: &str) -> String {
    text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A")
}

fn property(text: &str) -> String {
    message(text).replace(':', "%3A").replace(',', "%2C")
}

fn page_file(tested: &[Tested], arguments: &TestArguments) -> PathBuf {
    let usual = || tested.first().map(|tested| tested.out.join(REPORT)).unwrap_or_else(|| REPORT.into());
    arguments.report.clone().unwrap_or_else(usual)
}

/// A page of an earlier run tells what is no longer so.
fn remove_page(tested: &[Tested], arguments: &TestArguments) -> Option<String> {
    if arguments.report.is_none() {
        // It may not be there.
        let _ = std::fs::remove_file(page_file(tested, arguments));
    }
    None
}

fn write_page(tested: &[Tested], arguments: &TestArguments) -> Result<String, Diagnostics> {
    let file = page_file(tested, arguments);
    let failing: Vec<&GoldenResult> =
        tested.iter().flat_map(|tested| &tested.results).filter(|result| result.outcome.fails()).collect();
    let total = tested.iter().map(|tested| tested.results.len()).sum::<usize>();
    let usual = Viewing::default().pixels_per_degree;
    let viewing = tested.first().and_then(|tested| tested.list.pixels_per_degree).unwrap_or(usual);
    let title = match failing.len() {
        1 => format!("1 of {total} golden frames is not as it was"),
        n => format!("{n} of {total} golden frames are not as they were"),
    };
    let items = failing.into_iter().filter_map(|result| result.item.clone()).collect();
    let page = ReportPage {
        title,
        summary: format!("{}; FLIP at {viewing:.2} pixels per degree", counted(tested)),
        names: ["golden", "now"],
        command: Some(command(tested)),
        items: within_size(items),
    };
    write_atomic(&file, page.to_html().as_bytes())?;
    Ok(shown(&file))
}

/// Leaves out the pictures of items behind those that fill the page.
fn within_size(mut items: Vec<ReportItem>) -> Vec<ReportItem> {
    let mut room = limits::REPORT_BYTES;
    for item in &mut items {
        let bytes = item.picture_bytes();
        if bytes > room {
            item.leave_out_pictures(
                "its pictures are not shown: the page would grow too large; test fewer with --only",
            );
        } else {
            room -= bytes;
        }
    }
    items
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn workflow_commands_are_escaped() {
        assert_eq!(message("50 %\n::error::x"), "50 %25%0A::error::x");
        assert_eq!(property("a:b,c%"), "a%3Ab%2Cc%25");
        assert_eq!((quoted("a/b.ron"), quoted("it's")), ("a/b.ron".into(), "'it'\\''s'".into()));
    }
}
