//! `anim test`: golden frames of the user's scripts.
//!
//! A list (`golden.ron`, read by `load::golden`) names frames; their golden pictures lie in a folder beside it and carry
//! the hash of what they were made from. Frames of the same hash are not rendered; the others are, into a folder of new
//! pictures, and compared. Goldens are only ever written by `--accept` and `--review`.

mod accept;
mod init;
mod output;
mod patterns;
mod results;
mod run;

use std::path::{Path, PathBuf};

use super::progress::Mode;
use super::render::{on_threads, parse_threads};
use super::{AccessArguments, Exit, exit_code, print, say, usage};
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics};
use crate::load::golden::{GOLDEN_FILE, GoldenList, load_golden_list};
use patterns::GoldenPatterns;
use results::{GoldenResult, Outcome};

#[derive(clap::Args)]
#[command(after_help = "What comes of a frame:
  unchanged   the golden carries the hash of this very frame; it is not rendered (--render does it all the same)
  equal       made from something else, and every pixel is as it was
  within      different, and forgiven by `flip` or `max` in the list
  different   fails
  missing     fails: there is no golden yet; nothing is written until you accept it
  failed      fails: the script is wrong, or the frame could not be rendered

Patterns name goldens as their files are called, without the ending: show, show.3, show.1-12, sh*, show.*, several with \
            commas between them.

Examples:
  anim test --init show.rhai       write golden.ron with a few frames of the script
  anim test --accept               render what is missing or different, and make it golden
  anim test                        exit code 0 if all is as it was, 1 if not, with a page that shows why
  anim test --review               look at what differs one by one, and accept or reject it
  anim test --only 'lens*' --render
  anim test --junit results.xml --json

Exit codes: 0 all as it was, 1 differences found, 3 the list or a script is wrong, 5 reading or writing failed.

`anim guide golden` tells the whole story, with recipes for continuous integration.")]
pub struct TestArguments {
    /// Lists of golden frames, or folders with a golden.ron [default: golden.ron]; with --init: scripts and scenes
    files: Vec<PathBuf>,
    /// Make what was found golden: all of it, or what the pattern matches
    #[arg(long, value_name = "PATTERN", num_args = 0..=1, default_missing_value = "*", conflicts_with = "review")]
    accept: Option<String>,
    /// Show what differs one by one and ask what is right
    #[arg(long, conflicts_with = "json")]
    review: bool,
    /// Test only the goldens that the pattern matches
    #[arg(long, value_name = "PATTERN")]
    only: Option<String>,
    /// Render every frame, also where the golden carries its hash
    #[arg(long)]
    render: bool,
    /// Remove goldens that no list names
    #[arg(long, conflicts_with = "only")]
    prune: bool,
    /// Write a golden.ron for scripts and scenes; an existing one is left alone
    #[arg(long, conflicts_with_all = ["accept", "review", "only", "render", "prune"])]
    init: bool,
    /// Folder for new pictures and the page [default: .new beside the goldens]
    #[arg(short, long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// File of the page that shows what differs [default: report.html in the folder of new pictures]
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Print one JSON object a line for each golden, and a last one that sums up
    #[arg(long)]
    json: bool,
    /// Write the results as JUnit XML
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    #[command(flatten)]
    access: AccessArguments,
    /// Worker threads; the pictures do not depend on them [default: one per core]
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    threads: Option<usize>,
    /// How progress is shown on stderr
    #[arg(long, value_enum, default_value = "auto")]
    progress: Mode,
}

pub fn run(arguments: TestArguments) -> Result<Exit, Diagnostics> {
    if arguments.init {
        return init::run(&arguments.files, &arguments.access);
    }
    on_threads(arguments.threads, || test(&arguments))
}

/// A list with all that came of it.
struct Tested {
    list: GoldenList,
    /// Folder of new pictures.
    out: PathBuf,
    results: Vec<GoldenResult>,
    /// Goldens that nothing names.
    unnamed: Vec<PathBuf>,
}

fn test(arguments: &TestArguments) -> Result<Exit, Diagnostics> {
    let lists = lists(&arguments.files)?;
    let only =
        GoldenPatterns::parse(arguments.only.as_deref().unwrap_or("*")).map_err(|e| usage(format!("--only: {e}")))?;
    let accepted = arguments.accept.as_deref().map(GoldenPatterns::parse).transpose();
    let accepted = accepted.map_err(|e| usage(format!("--accept: {e}")))?;
    let cancel = super::render::on_interrupt()?;
    let mut tested: Vec<Tested> = Vec::new();
    for list in lists {
        let out = out_folder(arguments, &list, tested.len());
        let run = run::run(&list, &out, &only, arguments, &cancel)?;
        if run.is_cancelled {
            say(&Diagnostic::warning("interrupted: nothing was written but new pictures").into());
            return Ok(Exit::Interrupted);
        }
        let unnamed = if arguments.only.is_none() { run::unnamed(&list, &run.named) } else { Vec::new() };
        tested.push(Tested { list, out, results: run.results, unnamed });
    }
    let found = tested.iter().map(|tested| tested.results.len()).sum::<usize>();
    if found == 0 {
        let what = arguments.only.as_deref().unwrap_or_default();
        return Err(usage(format!("--only {what}: no golden is called so")));
    }
    match &accepted {
        Some(patterns) => accept::accept(&mut tested, patterns, arguments.accept.as_deref().unwrap_or("*"))?,
        None if arguments.review => accept::review(&mut tested)?,
        None => {}
    }
    if arguments.prune {
        accept::prune(&mut tested, arguments)?;
    }
    output::write(&tested, arguments)?;
    tested.iter().for_each(run::tidy);
    Ok(exit(&tested))
}

/// Mistakes of scripts first, then differences.
fn exit(tested: &[Tested]) -> Exit {
    let results = || tested.iter().flat_map(|tested| &tested.results);
    let exit = |result: &GoldenResult| match &result.outcome {
        Outcome::Failed(problems) => exit_code(problems),
        outcome if outcome.fails() => Exit::Differences,
        _ => Exit::Done,
    };
    results().map(exit).fold(Exit::Done, Exit::worse)
}

/// The lists that were named; that of this folder where none was.
fn lists(files: &[PathBuf]) -> Result<Vec<GoldenList>, Diagnostics> {
    let usual = [PathBuf::from(GOLDEN_FILE)];
    let named = if files.is_empty() { &usual[..] } else { files };
    let mut lists: Vec<GoldenList> = Vec::new();
    for path in named {
        let path = if path.is_dir() { path.join(GOLDEN_FILE) } else { path.clone() };
        if !path.exists() && (files.is_empty() || path.ends_with(GOLDEN_FILE)) {
            let help = "`anim test --init SCRIPT.rhai` writes one".to_string();
            return Err(Diagnostic::error(format!("there is no {}", path.display()))
                .help(help)
                .because(Cause::Usage)
                .into());
        }
        if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("ron")) {
            let help = "a list of golden frames is a golden.ron; --init writes one for scripts";
            let message = format!("{} is no list of golden frames", path.display());
            return Err(Diagnostic::error(message).help(help).because(Cause::Usage).into());
        }
        lists.push(load_golden_list(&path)?);
    }
    Ok(lists)
}

/// Each list has its own folder of new pictures, so that names cannot meet.
fn out_folder(arguments: &TestArguments, list: &GoldenList, index: usize) -> PathBuf {
    match &arguments.out {
        Some(out) if index == 0 => out.clone(),
        Some(out) => out.join((index + 1).to_string()),
        None => list.folder.join(run::NEW),
    }
}

/// A path as it is shown and copied.
fn shown(path: &Path) -> String {
    path.display().to_string()
}

/// Prints a line that people read; not where the results are for programs.
fn tell(arguments: &TestArguments, line: &str) {
    if !arguments.json {
        print(&format!("{line}\n"));
    }
}
