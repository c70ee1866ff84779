//! `anim pack`: everything that a shot needs, in one archive.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::render::{self, FrameArguments, LookArguments};
use super::{Exit, InputArguments, print, say, usage};
use crate::base::diagnostics::{Diagnostic, Diagnostics, ranges};
use crate::base::digest::Digest;
use crate::farm::archive::{self, ENDING, FOLDER_ENDING, PackSummary};
use crate::shot::plan::Plan;

#[derive(clap::Args)]
#[command(
    after_help = "The archive holds the script, its modules, the scene, meshes, textures and data, under the paths that they have below \
            the project's root, and the values of -D. Whoever renders it gets the same bytes; that every frame is the same is checked \
            before `anim pack` ends. Equal input gives an equal archive.

With -o NAME.anim the archive is a folder instead: contents are named by their digest, so that copying it a second time \
            (rsync, `aws s3 sync`) sends only what is new.

Examples:
  anim pack show.rhai                                -> show.anim.zip
  anim pack show.rhai -D variant=night -o night.anim.zip
  anim pack show.rhai -o /mnt/farm/show.anim         a folder that only grows by what changed
  anim render show.anim.zip --shard 2/8              what another machine does with it"
)]
pub struct PackArguments {
    #[command(flatten)]
    input: InputArguments,
    /// The archive: NAME.anim.zip, or NAME.anim for a folder [default: the input's name, here]
    #[arg(short, long, value_name = "ARCHIVE")]
    out: Option<PathBuf>,
}

pub fn run(arguments: &PackArguments) -> Result<Exit, Diagnostics> {
    let cancel = render::on_interrupt()?;
    if archive::is_archive(&arguments.input.input) {
        return Err(usage(format!("{} is an archive already", arguments.input.input.display())));
    }
    if let Some(out) = &arguments.out {
        check_name(out)?;
    }
    let (shot, plan) = render::plan(&frames_of(&arguments.input), &cancel)?;
    let mistakes = plan.summary();
    if mistakes.has_errors() {
        return Err(mistakes);
    }
    let out = arguments.out.clone().unwrap_or_else(|| format!("{}{ENDING}", shot.name).into());
    let summary = archive::write(&shot, &arguments.input.defines, &out)?;
    if let Err(problems) = verify(&out, &plan, &cancel) {
        if out.is_file() {
            // An archive that makes other frames is worse than none. If it stays, the error has said so.
            let _ = std::fs::remove_file(&out);
        }
        return Err(problems);
    }
    let PackSummary { files, bytes, written } = summary;
    let size = std::fs::metadata(&out).ok().filter(|out| out.is_file()).map_or(bytes, |out| out.len());
    let new = if out.is_dir() { format!(", {written} new") } else { String::new() };
    let frames = plan.frames.len();
    print(&format!("{}: {frames} frames, {files} files{new}, {:.1} MiB\n", out.display(), size as f64 / 1_048_576.0));
    Ok(Exit::Done)
}

fn check_name(out: &Path) -> Result<(), Diagnostics> {
    let name = out.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    if name.ends_with(".zip") || (name.ends_with(FOLDER_ENDING) && !out.is_file()) {
        return Ok(());
    }
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    Err(usage(format!(
        "-o {}: an archive is called {stem}{ENDING}, or {stem}{FOLDER_ENDING} if it is to be a folder",
        out.display()
    )))
}

/// All frames of an input, as it is.
fn frames_of(input: &InputArguments) -> FrameArguments {
    FrameArguments { input: input.clone(), frames: None, shard: None, out: None, look: LookArguments::default() }
}

/// Opens the archive and sees to it that every frame is the one that was packed.
fn verify(archive: &Path, packed: &Plan, cancel: &AtomicBool) -> Result<(), Diagnostics> {
    let input = InputArguments {
        input: archive.to_path_buf(),
        defines: Vec::new(),
        strict: false,
        log: None,
        access: Default::default(),
    };
    let help = "is a file named by its absolute path? names relative to the scene or script go with it";
    let (_, unpacked) = render::plan(&frames_of(&input), cancel).inspect_err(|_| {
        let message = format!("{} does not hold all that its frames need", archive.display());
        say(&Diagnostic::error(message).help(help).into());
    })?;
    let hashes = |plan: &Plan| -> Vec<Digest> { plan.frames.iter().map(|planned| planned.hash).collect() };
    let differ = |pair: &(Digest, Digest)| pair.0 != pair.1;
    let pairs = hashes(packed).into_iter().zip(hashes(&unpacked));
    let numbers: Vec<u32> = (1..).zip(pairs).filter(|(_, pair)| differ(pair)).map(|(frame, _)| frame).collect();
    if numbers.is_empty() && unpacked.frames.len() == packed.frames.len() {
        return Ok(());
    }
    let message = format!("frames of {} are not those of its input: {}", archive.display(), ranges(&numbers));
    Err(Diagnostic::error(message).help("did a file change meanwhile? pack again").into())
}
