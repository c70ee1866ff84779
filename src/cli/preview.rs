//! `anim preview`: a page on this machine that shows a shot while it is written.

use std::io::IsTerminal;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::Ordering;

use super::render::{self, LookArguments};
use super::{Exit, InputArguments, note, print, usage};
use crate::base::diagnostics::Diagnostics;
use crate::base::limits;
use crate::output::FilmFormat;
use crate::preview::{PreviewOptions, server};
use crate::shot::OpenOptions;
use crate::shot::reuse::ReusePolicy;

#[derive(clap::Args)]
#[command(
    after_help = "The page shows the frame a moment after every edit, first a quick picture, then the exact one: the bytes that \
            `anim render` would write. Of other colours of lights it first shows what each light gave before, mixed anew. Mistakes lie over the last good picture. Point at a pixel to see what it is, click to see where \
            that is written, and change it there. Nobody but you can open it: it listens on this machine alone, at an address with a \
            secret in it, and asks for nothing from elsewhere. Ends with Ctrl-C.

Examples:
  anim preview scripts/rackfocus.rhai --open          in the browser, at once
  anim preview scene.ron --size 640x360 --spp 16      smaller than the scene asks for"
)]
pub struct PreviewArguments {
    #[command(flatten)]
    input: InputArguments,
    /// The port to listen on; 0 for any that is free
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    port: u16,
    /// Open the page in the browser
    #[arg(long)]
    open: bool,
    /// Where `Render` writes frames, and where those that are there already lie, as for `anim render`
    #[arg(short, long, value_name = "PLACE")]
    out: Option<String>,
    #[command(flatten)]
    look: LookArguments,
    /// Memory in MiB for pictures, and for what is kept of the work from one to the next
    #[arg(long, value_name = "MIB", default_value_t = limits::REUSE_MEMORY, value_parser = clap::value_parser!(u64).range(0..=1 << 24))]
    reuse_memory: u64,
}

pub fn run(arguments: &PreviewArguments) -> Result<Exit, Diagnostics> {
    let input = arguments.input.input.clone();
    if !input.is_file() {
        return Err(usage(format!("{}: there is no such file", input.display())));
    }
    if arguments.out.as_ref().is_some_and(|out| FilmFormat::of_path(Path::new(out)).is_some()) {
        return Err(usage("-o: the preview writes frames; `anim film` makes a film of them"));
    }
    let cancel = render::on_interrupt()?;
    let open = OpenOptions { keep_scene: true, ..arguments.input.options(arguments.look.overrides())? };
    let policy = ReusePolicy { reuse: true, memory: arguments.reuse_memory };
    let options = PreviewOptions { input, open, out: arguments.out.clone(), policy, port: arguments.port };
    let ready = |address: &str| {
        print(&format!("{address}\n"));
        if arguments.open && !opened(address) {
            note("there is no browser to open: copy the address above into one");
        }
        if std::io::stderr().is_terminal() {
            note("Ctrl-C ends the preview");
        }
    };
    server::serve(options, ready, move || cancel.load(Ordering::Relaxed))?;
    Ok(Exit::Interrupted)
}

/// Opens an address in the browser of the desktop.
fn opened(address: &str) -> bool {
    let commands: &[&[&str]] = if cfg!(target_os = "macos") {
        &[&["open"]]
    } else if cfg!(windows) {
        &[&["rundll32", "url.dll,FileProtocolHandler"]]
    } else {
        &[&["xdg-open"], &["wslview"]]
    };
    commands.iter().any(|words| {
        let quiet = || Stdio::null();
        Command::new(words[0])
            .args(&words[1..])
            .arg(address)
            .stdin(quiet())
            .stdout(quiet())
            .stderr(quiet())
            .spawn()
            .is_ok()
    })
}
