//! `anim check`: everything but the rendering.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::{AccessArguments, Exit, evaluation, exit_code, parse_define, print, say, say_printed};
use crate::base::diagnostics::Diagnostics;
use crate::script::Parameter;
use crate::shot::{self, OpenOptions, Shot};

#[derive(clap::Args)]
#[command(after_help = "Examples:
  anim check scripts/*.rhai scenes/*.ron        find mistakes without rendering
  anim check show.rhai --params                 what -D can set, with ranges and defaults
  anim check show.rhai --params --json          the same, for programs")]
pub struct CheckArguments {
    /// Scripts and scenes
    #[arg(required = true)]
    inputs: Vec<PathBuf>,
    /// Give a parameter of the scripts a value; may be repeated
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse_define)]
    defines: Vec<(String, String)>,
    /// Refuse what a tolerant reader of NFF and P3F skips with a warning
    #[arg(long)]
    strict: bool,
    /// List the parameters that the scripts declare
    #[arg(long)]
    params: bool,
    /// Answer in JSON, one object a line for each input
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
        match check(input, &arguments) {
            Ok(answer) => print(&answer),
            Err(problems) => {
                say(&problems);
                worst = worst.worse(exit_code(&problems));
            }
        }
    }
    Ok(worst)
}

/// Evaluates all frames of an input and says that it is good, or what its parameters are.
fn check(input: &Path, arguments: &CheckArguments) -> Result<String, Diagnostics> {
    let options = OpenOptions {
        defines: arguments.defines.clone(),
        strict: arguments.strict,
        access: arguments.access.access(),
        evaluation: evaluation()?,
        ..OpenOptions::default()
    };
    let (mut shot, warnings) = shot::open_with(input, options)?;
    say(&warnings);
    let frames: Vec<u32> = (1..=shot.frames()).collect();
    let checked = shot::plan::check(&mut shot, &frames);
    say_printed(&shot, arguments.log.as_deref())?;
    checked?;
    if arguments.params {
        return Ok(if arguments.json { parameters_json(input, &shot) } else { parameters_text(&shot) });
    }
    let what = if shot.is_sequence() { format!("{} frames", frames.len()) } else { "one picture".into() };
    let entities = shot.stage.entity_count();
    if arguments.json {
        let answer = json!({ "input": input.to_string_lossy(), "frames": frames.len(), "entities": entities });
        return Ok(format!("{answer}\n"));
    }
    Ok(format!("{}: {what}, {entities} entities: good\n", input.display()))
}

fn parameters_text(shot: &Shot) -> String {
    shot.parameters().iter().map(|parameter| format!("{}\n", parameter.line())).collect()
}

fn parameters_json(input: &Path, shot: &Shot) -> String {
    let list: Vec<Value> = shot.parameters().iter().map(Parameter::to_json).collect();
    format!("{}\n", json!({ "input": input.to_string_lossy(), "parameters": list }))
}
