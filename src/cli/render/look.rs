//! Settings on the command line over those of the scene and the script.

use crate::base::diagnostics::suggestion;
use crate::base::limits;
use crate::components::{Accel, Aov, Integrator};
use crate::shot::Overrides;

/// Settings over those of the scene and the script.
#[derive(Clone, Default, clap::Args)]
pub struct LookArguments {
    /// Width and height in pixels, over the scene's
    #[arg(long, alias = "resolution", value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Render a part of each frame only: left, top, width and height in pixels. It is equal to the same part of the whole;
    /// a PNG holds the part alone, an EXR says where in the frame it lies
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_region)]
    region: Option<Region>,
    /// Render from one of the scene's `cameras`, whatever the script chooses
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Samples per pixel, over the scene's; rounded down to a square
    #[arg(long, alias = "samples", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=limits::SAMPLES as i64))]
    spp: Option<u32>,
    /// Seed of all sampling [default: follows from the camera's pose]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Side of the squares that point lights are widened to, over the scene's; gives soft shadows
    #[arg(long, value_name = "LENGTH")]
    light_size: Option<f64>,
    /// whitted, distribution, path or photon
    #[arg(long, value_name = "NAME", value_parser = |s: &str| Integrator::parse(s).ok_or_else(|| choices(Integrator::NAMES)))]
    integrator: Option<Integrator>,
    /// auto, bvh, grid or brute; the pictures do not depend on it
    #[arg(long, value_name = "NAME", value_parser = |s: &str| Accel::parse(s).ok_or_else(|| choices(Accel::NAMES)))]
    accel: Option<Accel>,
    /// Bits per channel of the picture: 8 or 16 of a PNG, 32 for floats instead of halves in an EXR
    #[arg(long, value_name = "BITS", value_parser = parse_depth)]
    depth: Option<u32>,
    /// Layers beside the colours of an EXR file, over the scene's: depth, normal, albedo, position, entity, material,
    /// motion, variance; `none` for none
    #[arg(long, value_name = "LIST", value_parser = parse_aovs)]
    aovs: Option<Aovs>,
    /// Filter noise out of the finished picture
    #[arg(long)]
    denoise: bool,
}

impl LookArguments {
    /// The same at another size.
    pub fn sized(&self, size: [u32; 2]) -> Self {
        LookArguments { size: Some(size), ..self.clone() }
    }

    /// The same for a part of each frame.
    pub fn with_region(&self, region: [u32; 4]) -> Self {
        LookArguments { region: Some(Region(region)), ..self.clone() }
    }

    /// The words of a command line that say the same.
    pub fn words(&self) -> Vec<String> {
        let list = |aovs: &Aovs| {
            let names: Vec<String> = aovs.0.iter().map(|aov| format!("{aov:?}").to_lowercase()).collect();
            if names.is_empty() { "none".into() } else { names.join(",") }
        };
        let given: [(&str, Option<String>); 10] = [
            ("--camera", self.camera.clone()),
            ("--size", self.size.map(|[width, height]| format!("{width}x{height}"))),
            ("--region", self.region.map(|Region(sides)| sides.map(|side| side.to_string()).join(","))),
            ("--spp", self.spp.map(|spp| spp.to_string())),
            ("--seed", self.seed.map(|seed| seed.to_string())),
            ("--light-size", self.light_size.map(|side| side.to_string())),
            ("--integrator", self.integrator.map(|integrator| format!("{integrator:?}").to_lowercase())),
            ("--accel", self.accel.map(|accel| format!("{accel:?}").to_lowercase())),
            ("--depth", self.depth.map(|depth| depth.to_string())),
            ("--aovs", self.aovs.as_ref().map(list)),
        ];
        let mut words = Vec::new();
        given
            .into_iter()
            .filter_map(|(flag, value)| Some([flag.to_string(), value?]))
            .for_each(|pair| words.extend(pair));
        if self.denoise {
            words.push("--denoise".into());
        }
        words
    }

    /// Whether any setting was given.
    pub fn is_given(&self) -> bool {
        self.overrides() != Overrides::default()
    }

    pub fn overrides(&self) -> Overrides {
        Overrides {
            size: self.size,
            region: self.region.map(|region| region.0),
            camera: self.camera.clone(),
            samples: self.spp,
            seed: self.seed,
            integrator: self.integrator,
            accel: self.accel,
            light_size: self.light_size,
            bit_depth: self.depth,
            aovs: self.aovs.as_ref().map(|aovs| aovs.0.clone()),
            denoise: self.denoise.then_some(true),
        }
    }
}

fn choices(names: &[&str]) -> String {
    format!("expected {}", names.join(", ").to_lowercase())
}

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let parts = text.split_once(['x', 'X']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    let size: [u32; 2] = parts.ok_or("expected WIDTHxHEIGHT, as in 640x360")?;
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    if size.iter().any(|s| !(1..=limits::FRAME_SIDE).contains(s)) || pixels > limits::FRAME_PIXELS {
        return Err(format!("sides go from 1 to {}, and at most {} pixels", limits::FRAME_SIDE, limits::FRAME_PIXELS));
    }
    Ok(size)
}

/// The four numbers of `--region`; a type of its own, since clap takes a list for an argument that is repeated.
#[derive(Clone, Copy)]
struct Region([u32; 4]);

fn parse_region(text: &str) -> Result<Region, String> {
    let numbers: Vec<u32> = text.split(',').map_while(|number| number.trim().parse().ok()).collect();
    let whole = <[u32; 4]>::try_from(numbers).ok().filter(|_| text.split(',').count() == 4);
    let [x, y, width, height] = whole.ok_or("expected X,Y,WIDTH,HEIGHT in pixels, as in 0,0,320,180")?;
    if width == 0 || height == 0 {
        return Err("a region has one pixel at least".into());
    }
    Ok(Region([x, y, width, height]))
}

/// What files of a part of frames are called, so that they do not take the place of whole ones.
pub fn name_of_part(name: &str, look: &LookArguments) -> String {
    match look.region {
        Some(Region([x, y, width, height])) => format!("{name}.region-{x}-{y}-{width}-{height}"),
        None => name.to_string(),
    }
}

fn parse_depth(text: &str) -> Result<u32, String> {
    match text {
        "8" => Ok(8),
        "16" => Ok(16),
        "32" => Ok(32),
        _ => Err("expected 8, 16 or 32".into()),
    }
}

/// The list of `--aovs`; a type of its own, since clap takes a `Vec` for an argument that is repeated.
#[derive(Clone)]
struct Aovs(Vec<Aov>);

fn parse_aovs(text: &str) -> Result<Aovs, String> {
    if text.eq_ignore_ascii_case("none") {
        return Ok(Aovs(Vec::new()));
    }
    let one = |word: &str| {
        Aov::parse(word.trim()).ok_or_else(|| {
            let near = suggestion(word, Aov::NAMES.iter().copied()).map_or(String::new(), |help| format!("; {help}"));
            format!("`{word}` is none of {}{near}", Aov::NAMES.join(", ").to_lowercase())
        })
    };
    text.split(',').map(one).collect::<Result<_, _>>().map(Aovs)
}
