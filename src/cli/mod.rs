//! The command line: one file per command, and the only room that prints.
//!
//! | file | commands |
//! |---|---|
//! | `render`, `watch`, `preview` | pictures; settings that several commands take are in `render/look`, shared work in `render/shared`, parts of pictures in `render/tiles` |
//! | `film/`, `sheet/`, `test/`, `diff` | films, contact sheets, golden frames, comparison |
//! | `check`, `plan`, `status`, `pictures` | what is wrong, what would be done, what is there, `anim info` |
//! | `scenes`, `set` | `anim dump` and `anim convert`; values of a scene file, in place |
//! | `pack`, `farm`, `merge` | other machines |
//! | `guide` | the reference, completions, manual pages |
//! | `first_word` | which command is meant |
//! | `frames`, `progress`, `lanes`, `threads` | the grammar of `--frames`, progress on stderr, what holds for the whole program |
//!
//! Raw flags are resolved here, once, into what the program works with. Results go to stdout; diagnostics and progress
//! to stderr. Exit codes: 0 done, 1 differences found, 2 usage, 3 the scene or script is wrong, 4 some frames failed,
//! 5 reading or writing failed, 130 interrupted.

mod check;
mod diff;
mod farm;
mod film;
mod first_word;
mod frames;
mod guide;
mod lanes;
mod merge;
mod pack;
mod pictures;
mod plan;
#[cfg(feature = "preview")]
mod preview;
mod progress;
mod render;
mod scenes;
mod set;
mod sheet;
mod status;
mod test;
mod threads;
#[cfg(feature = "preview")]
mod watch;

use std::ffi::OsString;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Mutex, OnceLock, PoisonError};

use clap::{Parser, Subcommand};
use first_word::{unknown_command, with_default_command};

use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics};
use crate::base::memory;
use crate::base::project::Access;
use crate::farm::archive;
use crate::output;
use crate::script::Evaluation;
use crate::script::host::{self, HOST_WORD, HostCommand};
use crate::shot::{self, OpenOptions, Overrides, Shot};

#[derive(Parser)]
#[command(
    name = "anim",
    version,
    about = "Renders animated 3D sequences from text: RON scenes, Rhai scripts, deterministic ray tracing.",
    after_help = "Examples:
  anim scripts/rackfocus.rhai                     all frames into frames/rackfocus/
  anim show.rhai --frames 1-10,20 --size 320x180  some frames, small
  anim scene.ron -o still.png                     one picture of a scene
  anim check scripts/*.rhai scenes/*.ron          find mistakes without rendering

Exit codes: 0 done, 1 differences found, 2 usage, 3 the scene or script is wrong, \
            4 some frames failed, 5 reading or writing failed, 130 interrupted."
)]
struct Arguments {
    /// Memory that the program may use; larger pictures are made in bands, and what cannot fit is refused [default:
    /// three quarters of what the machine or its control group has]
    #[arg(long, global = true, value_name = "MIB", value_parser = clap::value_parser!(u64).range(16..=1 << 24))]
    memory: Option<u64>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render the frames of a script, or one picture of a scene (`anim INPUT` is short for this)
    Render(render::RenderArguments),
    /// Load and evaluate every frame without rendering
    Check(check::CheckArguments),
    /// Show what rendering would do: which frames are there, which changed and how, what they cost
    Plan(plan::PlanArguments),
    /// Put everything that a shot needs into one archive, which renders to the same bytes anywhere
    Pack(pack::PackArguments),
    /// Show what a folder of frames has and lacks, and who is at work on it
    Status(status::StatusArguments),
    /// Write a job for a scheduler: Slurm, Open Job Description, make or ninja
    Farm(farm::FarmArguments),
    /// Join tiles of a picture to the bytes of the whole
    Merge(merge::MergeArguments),
    /// Make a film of a script or of frames: .mp4 .webm .mov .gif .apng .webp .y4m
    Film(Box<film::FilmArguments>),
    /// Put many pictures on one: frames of a sequence, several scenes, values of a parameter
    Sheet(Box<sheet::SheetArguments>),
    /// Write the resolved scene of one frame as RON
    Dump(scenes::DumpArguments),
    /// Write any scene that can be read as RON
    Convert(scenes::ConvertArguments),
    /// Show a page that follows every edit: pictures, timeline, mistakes, fields
    #[cfg(feature = "preview")]
    Preview(Box<preview::PreviewArguments>),
    /// Render again whenever a file of the input changes
    #[cfg(feature = "preview")]
    Watch(Box<watch::WatchArguments>),
    /// Set values in a scene file, in place
    Set(set::SetArguments),
    /// Compare two pictures, or two folders of them
    Diff(diff::DiffArguments),
    /// Test golden frames: render what changed, compare, and show why
    Test(test::TestArguments),
    /// Show what a picture or a film says of its making, or what a model holds
    Info(pictures::InfoArguments),
    /// The reference: fields, functions, mistakes, words of other tools
    Guide(guide::GuideArguments),
    /// Print completions for a shell
    Completions(guide::CompletionsArguments),
    /// Write manual pages into a folder
    Man(guide::ManArguments),
}

impl Command {
    /// Worker threads that were asked for.
    fn threads(&self) -> Option<usize> {
        if let Command::Render(arguments) = self { arguments.threads() } else { None }
    }
}

/// What an input is and how it is read; shared by the commands that open one.
#[derive(Clone, clap::Args)]
struct InputArguments {
    /// A script (.rhai), a scene (.ron, .nff, .p3f, .gltf, .glb, .obj, .ply, .stl, .aff) or an archive of `anim pack`; for a film also
    /// a folder or a pattern of frames
    input: PathBuf,
    /// Give a parameter of the script a value, or a limit of it, as in limits.operations=1e9; may be repeated
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse_define)]
    defines: Vec<(String, String)>,
    /// Refuse whatever is warned of: what a tolerant reader skips, and what `anim check` warns of where frames are rendered
    #[arg(long)]
    strict: bool,
    /// Write what the script prints to a file instead of stderr
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    #[command(flatten)]
    access: AccessArguments,
}

/// Shows what the script of a shot has printed: on stderr, or in the file of `--log`.
fn say_printed(shot: &Shot, log: Option<&Path>) -> Result<(), Diagnostics> {
    let lines = shot.take_printed();
    match log {
        Some(file) => {
            let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
            Ok(output::write_atomic(file, text.as_bytes())?)
        }
        None => {
            say(&Diagnostics::default().after(lines));
            Ok(())
        }
    }
}

/// What inputs may read; shared by all commands that read some.
#[derive(clap::Args, Clone, Default)]
struct AccessArguments {
    /// The project root: files that a script or scene names are read below it only [default: the nearest folder above
    /// the input with .git, golden.ron or scenes/, or else the input's own]
    #[arg(long, value_name = "DIR")]
    root: Option<PathBuf>,
    /// Let inputs read files of this folder too; may be repeated
    #[arg(long, value_name = "DIR")]
    allow_read: Vec<PathBuf>,
}

impl AccessArguments {
    fn access(&self) -> Access {
        Access { root: self.root.clone(), allow_read: self.allow_read.clone() }
    }
}

impl InputArguments {
    /// How the input is opened: its script in processes of its own.
    fn options(&self, overrides: Overrides) -> Result<OpenOptions, Diagnostics> {
        let (defines, access) = (self.defines.clone(), self.access.access());
        let evaluation = evaluation()?;
        Ok(OpenOptions { defines, strict: self.strict, overrides, access, evaluation, ..OpenOptions::default() })
    }
}

/// Opens a script, a scene or an archive of one.
fn open(input: &Path, mut options: OpenOptions) -> Result<(Shot, Diagnostics), Diagnostics> {
    if !archive::is_archive(input) {
        return shot::open_with(input, options);
    }
    let unpacked = archive::unpack(input)?;
    if let Some((flag, _)) =
        [("--root", options.access.root.is_some()), ("--allow-read", !options.access.allow_read.is_empty())]
            .iter()
            .find(|(_, given)| *given)
    {
        return Err(usage(format!("{flag}: {} reads nothing but what is in it", input.display())));
    }
    for (name, value) in &unpacked.manifest.parameters {
        if !options.defines.iter().any(|(known, _)| known == name) {
            options.defines.push((name.clone(), value.clone()));
        }
    }
    options.access = Access { root: Some(unpacked.root().to_path_buf()), allow_read: Vec::new() };
    options.unpacked = Some(unpacked.folder());
    show_as(unpacked.root(), input);
    let (shot, warnings) = shot::open_with(&unpacked.input(), options)?;
    let version = unpacked.version_warning(input);
    Ok((shot, Diagnostics(version.into_iter().chain(warnings.0).collect())))
}

/// Folders that archives were unpacked into, and what messages call them.
static UNPACKED: Mutex<Vec<(String, String)>> = Mutex::new(Vec::new());

/// Messages call a folder by the name of the archive that was unpacked into it.
fn show_as(folder: &Path, archive: &Path) {
    let names = [Some(folder.to_path_buf()), folder.canonicalize().ok()].into_iter().flatten();
    let mut known = UNPACKED.lock().unwrap_or_else(PoisonError::into_inner);
    known.extend(names.map(|name| (name.to_string_lossy().into_owned(), archive.to_string_lossy().into_owned())));
}

/// Scripts are evaluated in processes of their own.
fn evaluation() -> Result<Evaluation, Diagnostics> {
    let command = HostCommand::this_program();
    let command = command.map_err(|e| Diagnostic::io("this program", "find", &e))?;
    Ok(Evaluation::Hosted(command))
}

fn parse_define(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_string(), value.to_string())),
        _ => Err("expected NAME=VALUE".into()),
    }
}

/// Exit codes that users rely on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Exit {
    Done = 0,
    Differences = 1,
    Usage = 2,
    Input = 3,
    Failed = 4,
    Io = 5,
    Interrupted = 130,
}

impl Exit {
    /// The exit code of two outcomes together: what stopped the program counts before what is wrong with an input, and
    /// that before differences.
    fn worse(self, other: Exit) -> Exit {
        let rank = |exit: &Exit| match exit {
            Exit::Done => 0,
            Exit::Differences => 1,
            Exit::Failed => 2,
            Exit::Input => 3,
            Exit::Io => 4,
            Exit::Usage => 5,
            Exit::Interrupted => 6,
        };
        std::cmp::max_by_key(self, other, rank)
    }
}

/// Runs the program; `arguments` start with its own name.
pub fn main(arguments: Vec<OsString>) -> ExitCode {
    if arguments.get(1).is_some_and(|word| word == HOST_WORD) {
        return host::serve();
    }
    if let Some(problem) = unknown_command(&arguments) {
        say(&problem.into());
        return ExitCode::from(Exit::Usage as u8);
    }
    let parsed = match Arguments::try_parse_from(with_default_command(arguments)) {
        Ok(parsed) => parsed,
        Err(error) => return ExitCode::from(told(&error)),
    };
    if let Some(bytes) = parsed.memory.map(|mib| mib << 20).or_else(|| memory::of_machine().map(|all| all / 4 * 3)) {
        memory::set_budget(bytes);
    }
    let threads = threads::start(parsed.command.threads());
    let outcome = threads.and_then(|()| lanes::start()).and_then(|()| run(parsed.command));
    let exit = outcome.unwrap_or_else(|problems| {
        say(&problems);
        exit_code(&problems)
    });
    let exit = match LOST_OUTPUT.get().filter(|_| matches!(exit, Exit::Done | Exit::Differences)) {
        Some(lost) => {
            say(&lost.clone().into());
            Exit::Io
        }
        None => exit,
    };
    ExitCode::from(exit as u8)
}

/// Carries out a command.
fn run(command: Command) -> Result<Exit, Diagnostics> {
    match command {
        Command::Render(arguments) => render::run(arguments),
        Command::Check(arguments) => check::run(arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Pack(arguments) => pack::run(&arguments),
        Command::Farm(arguments) => farm::run(&arguments),
        Command::Status(arguments) => status::run(&arguments),
        Command::Merge(arguments) => merge::run(&arguments),
        Command::Film(arguments) => film::run(&arguments),
        Command::Sheet(arguments) => sheet::run(*arguments),
        Command::Dump(arguments) => scenes::dump(arguments),
        Command::Convert(arguments) => scenes::convert(arguments),
        #[cfg(feature = "preview")]
        Command::Preview(arguments) => preview::run(&arguments),
        #[cfg(feature = "preview")]
        Command::Watch(arguments) => watch::run(&arguments),
        Command::Set(arguments) => set::run(&arguments),
        Command::Diff(arguments) => diff::diff(arguments),
        Command::Test(arguments) => test::run(arguments),
        Command::Info(arguments) => pictures::info(arguments),
        Command::Guide(arguments) => guide::run(&arguments),
        Command::Completions(arguments) => guide::completions(&arguments),
        Command::Man(arguments) => guide::man(&arguments),
    }
}

/// Prints what the reader of arguments has to say: help, the version, or what is wrong with them; gives the exit code.
fn told(error: &clap::Error) -> u8 {
    let is_lost = |e: &std::io::Error| !error.use_stderr() && e.kind() != std::io::ErrorKind::BrokenPipe;
    match error.print().and_then(|()| std::io::stdout().flush()) {
        Err(lost) if is_lost(&lost) => {
            say(&Diagnostic::io("the help to standard output", "write", &lost).into());
            Exit::Io as u8
        }
        _ => error.exit_code() as u8,
    }
}

/// The worst cause decides: an interruption, then usage, then reading and writing, then the input.
fn exit_code(problems: &Diagnostics) -> Exit {
    let has = |cause| problems.0.iter().any(|d| d.is_error() && d.cause == cause);
    if has(Cause::Interrupted) {
        Exit::Interrupted
    } else if has(Cause::Usage) {
        Exit::Usage
    } else if has(Cause::Io) {
        Exit::Io
    } else {
        Exit::Input
    }
}

fn usage(message: impl Into<String>) -> Diagnostics {
    Diagnostic::error(message).because(Cause::Usage).into()
}

/// Shows diagnostics on stderr, coloured at a terminal.
fn say(problems: &Diagnostics) {
    if problems.0.is_empty() {
        return;
    }
    let mut text = problems.to_string();
    for (folder, archive) in UNPACKED.lock().unwrap_or_else(PoisonError::into_inner).iter() {
        text = text.replace(folder, archive);
    }
    if progress::is_for_escapes() && std::env::var_os("NO_COLOR").is_none() {
        text = text.replace("error: ", "\x1b[1;31merror:\x1b[0m ").replace("warning: ", "\x1b[1;33mwarning:\x1b[0m ");
    }
    note(&text);
}

/// Writes a line to stderr as it is.
fn note(text: &str) {
    if cfg!(test) {
        // Only this way does it go to whoever runs the tests, if one fails.
        eprintln!("{text}");
        return;
    }
    // A closed stderr leaves nobody to tell.
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Whether results go to a person rather than to a file or another program.
fn stdout_is_terminal() -> bool {
    std::io::stdout().is_terminal() && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// Writes a result to stdout. A reader that has gone away is no failure; whatever else keeps a result from being written
/// is one, and ends the command with that code when its work is done.
fn print(text: &str) {
    if cfg!(test) {
        print!("{text}");
        return;
    }
    let mut out = std::io::stdout().lock();
    if let Err(error) = out.write_all(text.as_bytes()).and_then(|()| out.flush())
        && error.kind() != std::io::ErrorKind::BrokenPipe
    {
        let _ = LOST_OUTPUT.set(Diagnostic::io("the result to standard output", "write", &error));
    }
}

/// Why a result could not be written, if one could not.
static LOST_OUTPUT: OnceLock<Diagnostic> = OnceLock::new();

#[cfg(test)]
mod full_disk;

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        let arguments = text.split(' ').map(OsString::from).collect();
        with_default_command(arguments).into_iter().map(|a| a.into_string().unwrap()).collect()
    }

    #[test]
    fn an_input_alone_is_rendered() {
        assert_eq!(words("anim a.rhai")[1], "render");
        assert_eq!(words("anim --threads 2 a.rhai")[1], "render");
        assert_eq!(words("anim check a.rhai")[1], "check");
        assert_eq!(words("anim --help").len(), 2);
        assert_eq!(words("anim").len(), 1);
    }

    #[test]
    fn causes_have_their_exit_codes() {
        let of = |cause| exit_code(&Diagnostic::error("x").because(cause).into());
        assert_eq!(of(Cause::Usage), Exit::Usage);
        assert_eq!(of(Cause::Io), Exit::Io);
        assert_eq!(of(Cause::Interrupted), Exit::Interrupted);
        assert_eq!(of(Cause::Input), Exit::Input);
    }

    #[test]
    fn the_worst_outcome_decides() {
        for (a, b, worst) in [
            (Exit::Done, Exit::Input, Exit::Input),
            (Exit::Io, Exit::Input, Exit::Io),
            (Exit::Usage, Exit::Io, Exit::Usage),
            (Exit::Done, Exit::Done, Exit::Done),
        ] {
            assert_eq!((a.worse(b), b.worse(a)), (worst, worst));
        }
    }

    #[test]
    fn the_arguments_are_well_formed() {
        use clap::CommandFactory;
        Arguments::command().debug_assert();
    }
}
