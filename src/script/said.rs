//! `print` and `debug`: lines that a script says, with their place and the frames that said them.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ::rhai::{Dynamic, NativeCallContext};

use super::Moment;
use super::context::ScriptContext;
use super::errors::Fallible;
use super::parameters::Parameter;
use super::table::{Chapter, Function};
use crate::base::codec::{Codec, Decoder, Encoder, Malformed};
use crate::base::diagnostics::ranges;
use crate::base::limits;

/// One call of `print` or `debug`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Said {
    /// The script or module, as the error messages name it; empty for the script itself.
    pub file: Arc<str>,
    /// Counted from 1; 0 where it is not known.
    pub line: u32,
    pub text: String,
}

/// When something was said.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum When {
    /// While the top level of the script ran.
    Top,
    Setup,
    /// A frame, counted from 1.
    Frame(u32),
}

impl When {
    /// The time of a call: that of a frame, or of `setup` if there is none.
    pub fn of(time: Option<Moment>) -> When {
        time.map_or(When::Setup, |(frame, _)| When::Frame(frame))
    }
}

/// What one run says beside its result.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Remarks {
    pub said: Vec<Said>,
    /// Parameters that it has declared, those of earlier runs among them.
    pub parameters: Vec<Parameter>,
}

/// What all runs of a script have said beside their results.
pub struct Journal {
    script: String,
    kept: Mutex<(Log, Vec<Parameter>)>,
}

impl Journal {
    /// `script` is the file as messages name it.
    pub fn new(script: &str) -> Self {
        Journal { script: script.into(), kept: Mutex::default() }
    }

    fn lock(&self) -> MutexGuard<'_, (Log, Vec<Parameter>)> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn add(&self, remarks: Remarks, when: When) {
        if remarks.said.is_empty() && remarks.parameters.is_empty() {
            return;
        }
        let (log, known) = &mut *self.lock();
        log.add(remarks.said, when);
        for parameter in remarks.parameters {
            if !known.iter().any(|one| one.name == parameter.name) {
                known.push(parameter);
            }
        }
    }

    pub fn parameters(&self) -> Vec<Parameter> {
        self.lock().1.clone()
    }

    /// What was printed since this was asked last.
    pub fn take_printed(&self) -> Vec<String> {
        std::mem::take(&mut self.lock().0).lines(&self.script)
    }
}

impl Codec for Said {
    fn encode(&self, to: &mut Encoder) {
        let Said { file, line, text } = self;
        to.put(file);
        to.put(line);
        to.put(text);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(Said { file: from.get()?, line: from.get()?, text: from.get()? })
    }
}

impl Codec for Remarks {
    fn encode(&self, to: &mut Encoder) {
        to.put(&self.said);
        to.put(&self.parameters);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(Remarks { said: from.get()?, parameters: from.get()? })
    }
}

/// Everything that a script has said, each distinct line once with all of its frames.
#[derive(Clone, Debug, Default)]
pub struct Log(BTreeMap<Said, Vec<When>>);

impl Log {
    pub fn add(&mut self, said: impl IntoIterator<Item = Said>, when: When) {
        for line in said {
            if self.0.len() >= limits::SCRIPT_PRINTS && !self.0.contains_key(&line) {
                continue;
            }
            let times = self.0.entry(line).or_default();
            // A frame whose shutter is open, or that is evaluated twice, says everything again.
            if !times.contains(&when) {
                times.push(when);
            }
        }
    }

    /// A line for each distinct one: where it was said, in which frames, and what; in the order of file and line.
    pub fn lines(&self, script: &str) -> Vec<String> {
        let line = |(said, times): (&Said, &Vec<When>)| {
            let file = if said.file.is_empty() { script } else { &*said.file };
            let place = if said.line > 0 { format!("{file}:{}", said.line) } else { file.to_string() };
            let mut frames: Vec<u32> =
                times.iter().filter_map(|when| if let When::Frame(n) = when { Some(*n) } else { None }).collect();
            frames.sort_unstable();
            let mut when = Vec::new();
            if times.contains(&When::Setup) {
                when.push("in setup".to_string());
            }
            match frames.len() {
                0 => {}
                1 => when.push(format!("in frame {}", frames[0])),
                _ => when.push(format!("in frames {}", ranges(&frames))),
            }
            let when = if when.is_empty() { String::new() } else { format!(" {}:", when.join(" and ")) };
            format!("{place}:{when} {}", said.text)
        };
        let mut lines: Vec<String> = self.0.iter().map(line).collect();
        if self.0.len() >= limits::SCRIPT_PRINTS {
            lines.push(format!("{script}: no more than {} lines are kept of what a script prints", self.0.len()));
        }
        lines
    }
}

fn say(context: &NativeCallContext, text: &str) -> Fallible<()> {
    let shared = ScriptContext::current(PRINT)?;
    let at = context.call_position();
    let file = context.fn_source().unwrap_or("").into();
    let line = at.line().unwrap_or(0) as u32;
    for part in text.split('\n') {
        let cut: String = part.chars().take(limits::TEXT_BYTES).collect();
        let text = if cut.len() < part.len() { format!("{cut}...") } else { cut };
        shared.say(Said { file: Arc::clone(&file), line, text });
    }
    Ok(())
}

/// The text of a value as `print` shows it: what strings interpolate.
fn shown(context: &NativeCallContext, value: &mut Dynamic, function: &str) -> Fallible<String> {
    if let Ok(text) = value.clone().into_immutable_string()
        && function == "to_string"
    {
        return Ok(text.to_string());
    }
    context.call_native_fn_raw(function, true, &mut [value]).map(|text| text.to_string())
}

pub const CHAPTER: Chapter = Chapter {
    title: "Saying something",
    functions: &[
        Function {
            name: "print",
            forms: &["print(value)", "print()"],
            text: "Writes a line to stderr, with its place in the script and the frames that said it: each distinct line once. \
                   `--log FILE` writes them to a file.",
            arguments: &[("value", "anything; an empty line if left out")],
            example: "print(`t is ${f.t}`);",
            register: |engine| {
                engine.register_fn(PRINT, |context: NativeCallContext| say(&context, "")).register_fn(
                    PRINT,
                    |context: NativeCallContext, mut value: Dynamic| -> Fallible<()> {
                        let text = shown(&context, &mut value, "to_string")?;
                        say(&context, &text)
                    },
                );
            },
        },
        Function {
            name: "debug",
            forms: &["debug(value)"],
            text: "As `print`, with texts in quotes and lists and maps as they are written in a script.",
            arguments: &[("value", "anything")],
            example: "debug([1, \"two\", 3.0]);",
            register: |engine| {
                engine.register_fn(DEBUG, |context: NativeCallContext, mut value: Dynamic| -> Fallible<()> {
                    let text = shown(&context, &mut value, "to_debug")?;
                    say(&context, &text)
                });
            },
        },
    ],
};

/// What `print` and `debug` are called inside the engine, which treats its own names as its own.
pub const PRINT: &str = "anim_print";
pub const DEBUG: &str = "anim_debug";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_line_is_shown_once_with_its_frames() {
        let said = |line, text: &str| Said { file: "".into(), line, text: text.into() };
        let mut log = Log::default();
        for frame in [3, 1, 2, 7] {
            log.add([said(4, "same"), said(4, &format!("frame {frame}"))], When::Frame(frame));
        }
        log.add([said(4, "same")], When::Frame(3));
        log.add([said(2, "once")], When::Setup);
        log.add([said(1, "first")], When::Top);
        let lines = log.lines("a.rhai");
        assert_eq!(lines[0], "a.rhai:1: first");
        assert_eq!(lines[1], "a.rhai:2: in setup: once");
        assert!(lines.contains(&"a.rhai:4: in frames 1-3, 7: same".to_string()), "{lines:?}");
        assert!(lines.contains(&"a.rhai:4: in frame 2: frame 2".to_string()), "{lines:?}");
    }
}
