//! `anim guide`: the reference, offline; `anim completions` and `anim man`: what shells and readers of manuals want.

use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use clap::CommandFactory;

use super::{Arguments, Exit, print, stdout_is_terminal, usage};
use crate::base::diagnostics::{Diagnostic, Diagnostics, suggestion};
use crate::guide::{self, definitions, html, json, pictures, text};
use crate::output::write_atomic;

#[derive(clap::Args)]
#[command(after_help = "Examples:
  anim guide                      the list of pages
  anim guide script               every function of scripts, with examples
  anim guide coming-from          words of POV-Ray, Blender and P3F in ours
  anim guide --html guide/        the same as a site that can be searched")]
pub struct GuideArguments {
    /// Which page [default: the list of all]
    page: Option<String>,
    /// Write all pages as a site into a folder
    #[arg(long, value_name = "FOLDER", conflicts_with = "page")]
    html: Option<PathBuf>,
    /// Write the pages of the site alone, without their small pictures
    #[arg(long, requires = "html")]
    no_pictures: bool,
    /// All pages, or the one that is named, as JSON
    #[arg(long)]
    json: bool,
    /// The JSON Schema of scenes, for editors
    #[arg(long, conflicts_with_all = ["page", "html", "json"])]
    schema: bool,
    /// Write the definitions of all functions for the language server of Rhai into a folder
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["page", "html", "json", "schema"])]
    definitions: Option<PathBuf>,
    /// Print at once, without a pager
    #[arg(long)]
    no_pager: bool,
}

#[derive(clap::Args)]
pub struct CompletionsArguments {
    /// Of which shell
    shell: clap_complete::Shell,
}

#[derive(clap::Args)]
pub struct ManArguments {
    /// Where the pages go
    folder: PathBuf,
}

pub fn run(arguments: &GuideArguments) -> Result<Exit, Diagnostics> {
    if let Some(folder) = &arguments.html {
        let files = html::files(!arguments.no_pictures);
        for (name, text) in &files {
            write_atomic(&folder.join(name), text.as_bytes())?;
        }
        let pictures = if arguments.no_pictures { Vec::new() } else { pictures::pictures() };
        for picture in &pictures {
            write_atomic(&folder.join(picture.file()), &picture.encode()?)?;
        }
        let count = files.len() + pictures.len();
        print(&format!("{}: {count} files\n", folder.join("index.html").display()));
        return Ok(Exit::Done);
    }
    if let Some(folder) = &arguments.definitions {
        let path = folder.join(definitions::FILE);
        write_atomic(&path, definitions::file().as_bytes())?;
        print(&format!("{}\n", path.display()));
        return Ok(Exit::Done);
    }
    if arguments.schema {
        print(&format!("{:#}\n", json::schema()));
        return Ok(Exit::Done);
    }
    let page = match &arguments.page {
        None => None,
        Some(name) => Some(guide::find(name).ok_or_else(|| unknown(name))?),
    };
    if arguments.json {
        let all = json::pages();
        let one = page.and_then(|page| all.as_array()?.iter().find(|one| one["name"] == page.name).cloned());
        print(&format!("{:#}\n", one.unwrap_or(all)));
        return Ok(Exit::Done);
    }
    let is_terminal = stdout_is_terminal();
    let is_colored = is_terminal && std::env::var_os("NO_COLOR").is_none();
    match page {
        None => print(&text::contents(is_colored)),
        Some(page) => show(&text::page(page, is_colored), is_terminal && !arguments.no_pager),
    }
    Ok(Exit::Done)
}

fn unknown(name: &str) -> Diagnostics {
    let help =
        suggestion(name, guide::PAGES.iter().map(|page| page.name)).unwrap_or_else(|| "anim guide lists all".into());
    Diagnostics::from(
        Diagnostic::error(format!("there is no page `{name}`"))
            .help(help)
            .because(crate::base::diagnostics::Cause::Usage),
    )
}

/// Hands a text to the user's pager; prints it where there is none.
fn show(text: &str, wants_pager: bool) {
    let pager = std::env::var("PAGER").unwrap_or_else(|_| "less -FRX".into());
    let mut words = pager.split_whitespace();
    let started = words
        .next()
        .filter(|_| wants_pager)
        .and_then(|program| Command::new(program).args(words).stdin(Stdio::piped()).spawn().ok());
    let Some(mut child) = started else { return print(text) };
    if let Some(mut input) = child.stdin.take() {
        // A reader who has seen enough hangs up.
        let _ = input.write_all(text.as_bytes());
    }
    let _ = child.wait();
}

pub fn completions(arguments: &CompletionsArguments) -> Result<Exit, Diagnostics> {
    let mut out = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), "anim", &mut out);
    print(&String::from_utf8_lossy(&out));
    Ok(Exit::Done)
}

/// A page for the program and one for each of its commands.
pub fn man(arguments: &ManArguments) -> Result<Exit, Diagnostics> {
    let mut program = Arguments::command();
    program.build();
    let mut pages = vec![("anim".to_string(), program.clone())];
    pages.extend(program.get_subcommands().map(|command| {
        let name = format!("anim-{}", command.get_name());
        (name.clone(), command.clone().display_name(name))
    }));
    for (name, command) in &pages {
        let mut page = Vec::new();
        let rendered = clap_mangen::Man::new(command.clone()).render(&mut page);
        rendered.map_err(|e| usage(format!("cannot write the page of {name}: {e}")))?;
        write_atomic(&arguments.folder.join(format!("{name}.1")), &page)?;
    }
    print(&format!("{}: {} pages\n", arguments.folder.display(), pages.len()));
    Ok(Exit::Done)
}
