//! `anim sheet`: many pictures on one, of a sequence, of several scenes, or of a parameter's values.

mod label;
mod sweep;

use std::path::{Path, PathBuf};

use super::progress::Mode;
use super::render::{self, FrameArguments, LookArguments, RenderArguments};
use super::{AccessArguments, Exit, InputArguments, frames, parse_define, print, usage};
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics};
use crate::base::digest::{Digest, Hasher};
use crate::base::rate::Rate;
use crate::base::{files, limits};
use crate::farm::archive::is_archive;
use crate::output::film::{FilmFrame, Reel};
use crate::output::sheet::{SheetLayout, SheetTile, draw_sheet};
use crate::output::{self, Format, Metadata, encode_rgb8};
use label::LabelTemplate;
use sweep::{MOST_TILES, Sweep, combinations};

#[derive(clap::Args)]
#[command(after_help = "What is on a sheet:
  a script, a folder or a pattern of frames   frames spread evenly over the sequence, or those of --frames
  several inputs                              one picture of each
  a script and --sweep                        one picture for each value; two sweeps make a grid

Labels name {frame} {seconds} {name} and every parameter of --sweep and -D; {seconds:.2} has two decimals, {frame:04} \
            four digits. Pictures are shrunk to fit in linear light, never enlarged.

Examples:
  anim sheet show.rhai -o show.png
  anim sheet frames/show --count 20 --columns 5 --label '{frame:04}'
  anim sheet lens.rhai --sweep ratio=5..30/6 --frames 12 --size 320x240
  anim sheet show.rhai --sweep aperture=0..0.4/5 --sweep focus=2..8/4
  anim sheet scenes/*.ron --spp 4")]
pub struct SheetArguments {
    /// Scripts, scenes, or a folder or pattern of frames
    #[arg(required = true)]
    inputs: Vec<PathBuf>,
    /// Give a parameter of the script a value; may be repeated
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse_define)]
    defines: Vec<(String, String)>,
    /// Values of a parameter, as in aperture=0..0.4/9 or lens=Disk,Square; may be given twice
    #[arg(long = "sweep", value_name = "NAME=VALUES", value_parser = Sweep::parse)]
    sweeps: Vec<Sweep>,
    /// Which frames: numbers, ranges and steps, as in 1-10,20,30-60x5
    #[arg(long, value_name = "LIST")]
    frames: Option<String>,
    /// How many frames of a sequence [default: 12, or all if there are fewer]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MOST_TILES as i64))]
    count: Option<u32>,
    /// Pictures side by side [default: what fills a screen; the values of the first of two sweeps]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MOST_TILES as i64))]
    columns: Option<u32>,
    /// Width of a picture on the sheet in pixels [default: what makes the sheet 1920 wide]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=limits::FRAME_SIDE as i64))]
    tile: Option<u32>,
    /// What is written below each picture; '' for nothing [default: the frame, the values, or the name]
    #[arg(long, value_name = "TEXT", value_parser = LabelTemplate::parse)]
    label: Option<LabelTemplate>,
    /// The sheet [default: frames/NAME.sheet.png]
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Render every picture, whatever is there already
    #[arg(long)]
    force: bool,
    /// Worker threads; the pictures do not depend on them [default: one per core]
    #[arg(long, value_name = "N", value_parser = render::parse_threads)]
    threads: Option<usize>,
    /// How progress is shown on stderr
    #[arg(long, value_enum, default_value = "auto")]
    progress: Mode,
    #[command(flatten)]
    access: AccessArguments,
    #[command(flatten)]
    look: LookArguments,
}

/// Frames of a sequence unless the user says how many: three rows of four.
const USUAL_COUNT: u32 = 12;

/// A picture that is on disk, and what a label can say of it.
struct Shown {
    file: PathBuf,
    values: Vec<(String, String)>,
}

pub fn run(arguments: SheetArguments) -> Result<Exit, Diagnostics> {
    let out = match &arguments.out {
        Some(out) if !out.to_string_lossy().to_lowercase().ends_with(".png") || out.is_dir() => {
            return Err(usage(format!("-o {}: a sheet is a .png file", out.display())));
        }
        Some(out) => out.clone(),
        None => PathBuf::from(format!("frames/{}.sheet.png", name_of(&arguments.inputs[0]))),
    };
    if arguments.sweeps.len() > 2 {
        return Err(usage("--sweep: a sheet has two sides, so that at most two parameters can be swept"));
    }
    output::probe(&out)?;
    let threads = arguments.threads;
    render::on_threads(threads, || {
        let shown = match shown(&arguments)? {
            Ok(shown) => shown,
            Err(exit) => return Ok(exit),
        };
        sheet(&arguments, &out, &shown)
    })
}

fn name_of(input: &Path) -> String {
    let name = input.file_stem().unwrap_or_default().to_string_lossy();
    let name = name.trim_end_matches(['.', '#', '_', '-']);
    if name.is_empty() || name.contains(['#', '%']) { "sheet".into() } else { name.to_string() }
}

/// Sees to it that all pictures are there; an exit code if some cannot be.
fn shown(arguments: &SheetArguments) -> Result<Result<Vec<Shown>, Exit>, Diagnostics> {
    let [input] = &arguments.inputs[..] else { return several(arguments) };
    let is_reel = !is_archive(input) && (input.is_dir() || Reel::is_pattern(input));
    if !arguments.sweeps.is_empty() {
        return if is_reel {
            Err(usage("--sweep: finished frames have no parameters"))
        } else {
            swept(arguments, input)
        };
    }
    if is_reel { of_reel(arguments, input).map(Ok) } else { of_input(arguments, input) }
}

/// Frames that are there.
fn of_reel(arguments: &SheetArguments, input: &Path) -> Result<Vec<Shown>, Diagnostics> {
    if arguments.force || !arguments.defines.is_empty() || arguments.look.is_given() {
        let message = format!("{} is a row of finished frames: nothing of it is rendered", input.display());
        return Err(usage(message));
    }
    let mut reel = Reel::find(input)?;
    let numbers: Vec<u32> = reel.frames.iter().map(|(number, _)| *number).collect();
    let wanted = match &arguments.frames {
        Some(list) => frames::parse(list, numbers[numbers.len() - 1]).map_err(usage)?,
        None => numbers,
    };
    reel.select(&spread(&wanted, arguments))?;
    let name = name_of(input);
    Ok(reel.frames.into_iter().map(|(number, file)| Shown { file, values: values(number, None, &name, &[]) }).collect())
}

/// The wanted ones if they were counted out, or so many of them as fit, first and last among them.
fn spread(wanted: &[u32], arguments: &SheetArguments) -> Vec<u32> {
    let count = match (arguments.count, &arguments.frames) {
        (Some(count), _) => count as usize,
        (None, Some(_)) => wanted.len(),
        (None, None) => USUAL_COUNT as usize,
    };
    if count >= wanted.len() {
        return wanted.to_vec();
    }
    let steps = (count - 1).max(1);
    (0..count).map(|i| wanted[(2 * i * (wanted.len() - 1) + steps) / (2 * steps)]).collect()
}

fn values(frame: u32, rate: Option<Rate>, name: &str, more: &[(String, String)]) -> Vec<(String, String)> {
    let value = |name: &str, value: String| (name.to_string(), value);
    let mut values = vec![value("frame", frame.to_string())];
    if let Some(rate) = rate {
        values.push(value("seconds", (f64::from(frame.saturating_sub(1)) / rate.per_second()).to_string()));
    }
    values.push(value("name", name.to_string()));
    values.extend(more.iter().cloned());
    values
}

/// What `anim render` would be given for these frames.
fn rendering(
    arguments: &SheetArguments,
    input: &Path,
    defines: Vec<(String, String)>,
    frames: Option<String>,
    out: Option<String>,
) -> RenderArguments {
    let access = arguments.access.clone();
    let input = InputArguments { input: input.to_path_buf(), defines, strict: false, log: None, access };
    let wanted = FrameArguments { input, frames, shard: None, out, look: arguments.look.clone() };
    RenderArguments::quiet(wanted, arguments.force, arguments.progress)
}

/// Frames of a script, or the one picture of a scene.
fn of_input(arguments: &SheetArguments, input: &Path) -> Result<Result<Vec<Shown>, Exit>, Diagnostics> {
    let all = rendering(arguments, input, arguments.defines.clone(), arguments.frames.clone(), None);
    let cancel = render::on_interrupt()?;
    let (mut shot, mut plan) = render::plan(&all.wanted, &cancel)?;
    let numbers: Vec<u32> = plan.frames.iter().map(|planned| planned.frame).collect();
    let kept = spread(&numbers, arguments);
    plan.keep(&kept);
    let rate = shot.rate();
    let shown = plan.frames.iter().map(|planned| Shown {
        file: planned.file.clone(),
        values: values(planned.frame, rate, &shot.name, &arguments.defines),
    });
    let shown = shown.collect();
    let exit = render::render(&all, &mut shot, plan, &cancel, &|_| {})?;
    Ok(if exit == Exit::Done { Ok(shown) } else { Err(exit) })
}

/// The frame that every picture of a sheet of several inputs or values shows.
fn one_frame(arguments: &SheetArguments, what: &str) -> Result<u32, Diagnostics> {
    if arguments.count.is_some() {
        return Err(usage(format!("--count: a sheet of {what} has one picture for each")));
    }
    match &arguments.frames {
        None => Ok(1),
        Some(text) => text.trim().parse().ok().filter(|n| *n > 0).ok_or_else(|| {
            usage(format!("--frames {text}: a sheet of {what} shows one frame of each, as in --frames 12"))
        }),
    }
}

/// One picture of each input.
fn several(arguments: &SheetArguments) -> Result<Result<Vec<Shown>, Exit>, Diagnostics> {
    if !arguments.sweeps.is_empty() {
        return Err(usage("--sweep: only one script can be swept"));
    }
    if arguments.inputs.len() > MOST_TILES {
        return Err(usage(format!("a sheet has at most {MOST_TILES} pictures, not {}", arguments.inputs.len())));
    }
    let frame = one_frame(arguments, "several inputs")?;
    let cancel = render::on_interrupt()?;
    let mut all = Vec::new();
    for input in &arguments.inputs {
        if Format::of_path(input).is_some() {
            all.push(Shown { file: input.clone(), values: values(frame, None, &name_of(input), &arguments.defines) });
            continue;
        }
        let one = rendering(arguments, input, arguments.defines.clone(), Some(frame.to_string()), None);
        let (mut shot, plan) = render::plan(&one.wanted, &cancel)?;
        let values = values(frame, shot.rate(), &shot.name, &arguments.defines);
        all.extend(plan.frames.iter().map(|planned| Shown { file: planned.file.clone(), values: values.clone() }));
        let exit = render::render(&one, &mut shot, plan, &cancel, &|_| {})?;
        if exit != Exit::Done {
            return Ok(Err(exit));
        }
    }
    Ok(Ok(all))
}

/// One picture for each value, in files that keep them from being rendered again.
fn swept(arguments: &SheetArguments, input: &Path) -> Result<Result<Vec<Shown>, Exit>, Diagnostics> {
    let frame = one_frame(arguments, "values")?;
    let sweeps = &arguments.sweeps;
    let twice = |name: &String| sweeps.iter().filter(|sweep| sweep.name == *name).count() > 1;
    let defined = |name: &String| arguments.defines.iter().any(|(known, _)| known == name);
    if let Some(sweep) = sweeps.iter().find(|sweep| twice(&sweep.name) || defined(&sweep.name)) {
        return Err(usage(format!("--sweep {}: that parameter has a value already", sweep.name)));
    }
    let sets = combinations(sweeps);
    if sets.len() > MOST_TILES {
        return Err(usage(format!("a sheet has at most {MOST_TILES} pictures, not {}", sets.len())));
    }
    let cancel = render::on_interrupt()?;
    let mut all = Vec::new();
    for set in sets {
        let file = swept_file(&name_of(input), &set, frame);
        let defines = [arguments.defines.clone(), set].concat();
        let one = rendering(arguments, input, defines.clone(), Some(frame.to_string()), Some(file.clone()));
        let (mut shot, plan) = render::plan(&one.wanted, &cancel)?;
        all.push(Shown { file: file.into(), values: values(frame, shot.rate(), &shot.name, &defines) });
        let exit = render::render(&one, &mut shot, plan, &cancel, &|_| {})?;
        if exit != Exit::Done {
            return Ok(Err(exit));
        }
    }
    Ok(Ok(all))
}

/// Where a picture of a sweep is kept: a name that says its values, as far as names of files can.
fn swept_file(name: &str, set: &[(String, String)], frame: u32) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "._=-".contains(c) { c } else { '_' };
    let text: Vec<String> = set.iter().map(|(name, value)| format!("{name}={value}")).collect();
    let text = text.join(",");
    let safe: String = text.chars().take(80).map(|c| if c == ',' { ',' } else { plain(c) }).collect();
    // Values that look alike in a file's name are told apart by their digest.
    let more = if safe == text { String::new() } else { format!(",{}", &Digest::of(text.as_bytes()).to_string()[..8]) };
    format!("frames/{name}.sweep/{safe}{more}.{frame:04}.png")
}

fn sheet(arguments: &SheetArguments, out: &Path, shown: &[Shown]) -> Result<Exit, Diagnostics> {
    let template = match &arguments.label {
        Some(template) => template.clone(),
        None => usual_label(arguments).map_err(usage)?,
    };
    let label = |one: &Shown| template.fill(&one.values).map_err(usage);
    let labels: Vec<String> = shown.iter().map(label).collect::<Result<_, _>>()?;
    let mut tiles = Vec::with_capacity(shown.len());
    let mut hasher = Hasher::default();
    for (one, label) in shown.iter().zip(labels) {
        let bytes = files::read_bytes(&one.file, limits::FRAME_FILE_BYTES)?;
        let unreadable = |why| Diagnostic::error(format!("cannot read {}: {why}", one.file.display()));
        let (picture, metadata) = FilmFrame::read(&bytes).map_err(unreadable)?;
        let hash = metadata.into_iter().find(|(keyword, _)| keyword == "Hash").map(|(_, hash)| hash);
        hasher.text(&hash.unwrap_or_else(|| Digest::of(&bytes).to_string()));
        tiles.push(SheetTile { picture, label });
    }
    let size: [u32; 2] = std::array::from_fn(|i| {
        tiles.iter().map(|tile| [tile.picture.width, tile.picture.height][i]).max().unwrap_or(1)
    });
    let columns = arguments.columns.or_else(|| match &arguments.sweeps[..] {
        [first, _] => Some(first.values.len() as u32),
        _ => None,
    });
    let count = tiles.len() as u32;
    let layout = SheetLayout::new(count, size, columns, arguments.tile, !template.is_empty()).map_err(usage)?;
    let [width, height] = layout.size().map(|side| side as u32);
    let bytes =
        encode_rgb8(&draw_sheet(&layout, &tiles), [width, height], &metadata(arguments, hasher.finish(), &tiles))
            .map_err(|e| Diagnostic::error(format!("cannot encode {}: {e}", out.display())).because(Cause::Io))?;
    output::write_atomic(out, &bytes)?;
    print(&format!("{}: {count} pictures, {width}x{height}\n", out.display()));
    Ok(Exit::Done)
}

/// The frame of a sequence, the values of a sweep, the name of what stands beside others.
fn usual_label(arguments: &SheetArguments) -> Result<LabelTemplate, String> {
    let swept: Vec<String> = arguments.sweeps.iter().map(|s| format!("{} {{{}}}", s.name, s.name)).collect();
    LabelTemplate::parse(match &swept[..] {
        [] if arguments.inputs.len() > 1 => "{name}",
        [] => "{frame}",
        _ => return LabelTemplate::parse(&swept.join("   ")),
    })
}

/// What the sheet says of its making.
fn metadata(arguments: &SheetArguments, hash: Digest, tiles: &[SheetTile]) -> Metadata {
    let note = |keyword: &str, text: String| (keyword.to_string(), text);
    let sources = arguments.inputs.iter().map(|input| input.file_name().unwrap_or_default().to_string_lossy());
    let labels: Vec<&str> = tiles.iter().map(|tile| tile.label.as_str()).collect();
    vec![
        note("Software", concat!("anim ", env!("CARGO_PKG_VERSION")).into()),
        note("Source", sources.collect::<Vec<_>>().join(" ")),
        note("Sheet", labels.join(" | ")),
        note("SheetHash", hash.to_string()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_a_sweep_say_their_values_and_never_meet() {
        let set = |value: &str| vec![("a".to_string(), value.to_string()), ("lens".into(), "Disk".into())];
        assert_eq!(swept_file("show", &set("0.1"), 12), "frames/show.sweep/a=0.1,lens=Disk.0012.png");
        let [one, other] = ["a/b", "a b"].map(|value| swept_file("show", &set(value), 1));
        assert!(one != other && !one["frames/show.sweep/".len()..].contains('/'), "{one} {other}");
        assert!(
            output::names::resolve(Some(&swept_file("show", &set(&"x".repeat(999)), 1)), "show", Some(1), 1).is_ok()
        );
    }
}
