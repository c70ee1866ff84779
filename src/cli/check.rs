//! `anim check`: everything but the rendering.

use std::path::PathBuf;

use super::{AccessArguments, Exit, evaluation, exit_code, parse_define, print, say};
use crate::base::diagnostics::Diagnostics;
use crate::shot::{self, OpenOptions};

#[derive(clap::Args)]
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
    #[command(flatten)]
    access: AccessArguments,
}

pub fn run(arguments: CheckArguments) -> Result<Exit, Diagnostics> {
    let mut worst = Exit::Done;
    for input in &arguments.inputs {
        let options = OpenOptions {
            defines: arguments.defines.clone(),
            strict: arguments.strict,
            access: arguments.access.access(),
            evaluation: evaluation()?,
            ..OpenOptions::default()
        };
        let checked = shot::open_with(input, options).and_then(|(mut shot, warnings)| {
            say(&warnings);
            let frames: Vec<u32> = (1..=shot.frames()).collect();
            shot::plan::check(&mut shot, &frames)?;
            let what = if shot.is_sequence() { format!("{} frames", frames.len()) } else { "one picture".into() };
            Ok(format!("{}: {what}, {} entities: good\n", input.display(), shot.stage.entity_count()))
        });
        match checked {
            Ok(line) => print(&line),
            Err(problems) => {
                say(&problems);
                worst = worst.worse(exit_code(&problems));
            }
        }
    }
    Ok(worst)
}
