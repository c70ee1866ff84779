//! `anim check`: everything but the rendering.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use super::{AccessArguments, Exit, evaluation, exit_code, parse_define, print, say, say_printed};
use crate::base::diagnostics::{Diagnostic, Diagnostics, Severity};
use crate::script::Parameter;
use crate::shot::{self, OpenOptions, Shot};

#[derive(clap::Args)]
#[command(after_help = "Examples:
  anim check scripts/*.rhai scenes/*.ron        find mistakes without rendering
  anim check show.rhai --strict                 warnings count as mistakes: nothing moves, no light, ...
  anim check show.rhai --json                   mistakes and warnings with their places, for editors
  anim check show.rhai --params                 what -D can set, with ranges and defaults
  anim check show.rhai --params --json          the same, for programs")]
pub struct CheckArguments {
    /// Scripts and scenes
    #[arg(required = true)]
    inputs: Vec<PathBuf>,
    /// Give a parameter of the scripts a value, or a limit, as in limits.operations=1e9; may be repeated
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse_define)]
    defines: Vec<(String, String)>,
    /// Make every warning a mistake: what a file holds and is not used, a scene without light, frames that do not differ
    #[arg(long)]
    strict: bool,
    /// List the parameters that the scripts declare
    #[arg(long)]
    params: bool,
    /// Answer in JSON, one object a line for each input: frames, entities, and `diagnostics` with severity, message, file,
    /// line, column (from 1), width and help
    #[arg(long)]
    json: bool,
    /// Write what the scripts print to a file instead of stderr
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    #[command(flatten)]
    access: AccessArguments,
}

pub fn run(arguments: CheckArguments) -> Result<Exit, Diagnostics> {
    let mut worst = Exit::Done;
    for input in &arguments.inputs {
        let mut said = Diagnostics::default();
        let outcome =
            check(input, &arguments, &mut said).and_then(|answer| refuse_warnings(answer, &mut said, &arguments));
        if let Err(problems) = &outcome {
            worst = worst.worse(exit_code(problems));
        }
        match outcome {
            Ok(answer) if arguments.json => print(&json_line(input, &answer.json, &said)),
            Ok(answer) => {
                say(&said);
                print(&answer.text);
            }
            Err(problems) if arguments.json => {
                said.0.extend(problems.0);
                print(&json_line(input, &Map::new(), &said));
            }
            Err(problems) => {
                say(&said);
                say(&problems);
            }
        }
    }
    Ok(worst)
}

/// What is known of an input that is good: for people, and for programs.
struct CheckAnswer {
    text: String,
    json: Map<String, Value>,
}

/// With `--strict` a warning is a mistake.
fn refuse_warnings(
    answer: CheckAnswer,
    said: &mut Diagnostics,
    arguments: &CheckArguments,
) -> Result<CheckAnswer, Diagnostics> {
    if !arguments.strict || said.0.iter().all(|one| one.severity != Severity::Warning) {
        return Ok(answer);
    }
    Err(std::mem::take(said).refused())
}

/// Evaluates all frames of an input, and says what it is if it is good. Warnings go to `said`.
fn check(input: &Path, arguments: &CheckArguments, said: &mut Diagnostics) -> Result<CheckAnswer, Diagnostics> {
    let options = OpenOptions {
        defines: arguments.defines.clone(),
        strict: arguments.strict,
        access: arguments.access.access(),
        evaluation: evaluation()?,
        ..OpenOptions::default()
    };
    let (mut shot, warnings) = super::open(input, options)?;
    said.0.extend(warnings.0);
    let frames: Vec<u32> = (1..=shot.frames()).collect();
    let checked = shot::plan::check(&mut shot, &frames);
    say_printed(&shot, arguments.log.as_deref())?;
    let fingerprints = checked?;
    said.0.extend(shot::advice::advice(&mut shot, &fingerprints).0);
    let mut json = Map::new();
    if arguments.params {
        json.insert("parameters".into(), shot.parameters().iter().map(Parameter::to_json).collect());
        return Ok(CheckAnswer { text: parameters_text(&shot), json });
    }
    let what = if shot.is_sequence() { format!("{} frames", frames.len()) } else { "one picture".into() };
    let entities = shot.stage.entity_count();
    json.insert("frames".into(), frames.len().into());
    json.insert("entities".into(), entities.into());
    let word = if said.0.is_empty() { "good".to_string() } else { count_of(said.0.len(), "warning") };
    Ok(CheckAnswer { text: format!("{}: {what}, {entities} entities: {word}\n", input.display()), json })
}

fn count_of(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}

/// An input as one line of JSON.
fn json_line(input: &Path, answer: &Map<String, Value>, said: &Diagnostics) -> String {
    let mut out = Map::new();
    out.insert("input".into(), input.to_string_lossy().into());
    out.extend(answer.clone());
    out.insert("good".into(), (!said.has_errors()).into());
    out.insert("diagnostics".into(), said.0.iter().map(Diagnostic::to_json).collect());
    format!("{}\n", Value::Object(out))
}

fn parameters_text(shot: &Shot) -> String {
    shot.parameters().iter().map(|parameter| format!("{}\n", parameter.line())).collect()
}
