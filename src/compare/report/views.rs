//! Pictures in a page: the colours and channels of a pair, as the viewer takes them.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde_json::{Value, json};

use crate::base::base64;
use crate::compare::colors::{ColorLayer, color_layers};
use crate::compare::comparison::name_of;
use crate::compare::flip::ErrorMap;
use crate::compare::judge::Judgement;
use crate::output::{ColorEncoding, LayeredPicture, PixelWindow, PngPixels, encode_small_png};

/// Numbers of a pair that a page may hold where they are no bytes: two pictures of 1024 x 1024 in floats.
const MOST_FLOATS: usize = 6 << 20;

/// What the viewer shows of a pair: its colours, and the channels that differ or that one of them lacks.
///
/// With them comes the number of differing channels that were left out, since the page would grow too large.
pub fn views(
    a: Option<&LayeredPicture>,
    b: Option<&LayeredPicture>,
    judgement: Option<&Judgement>,
) -> (Vec<Value>, usize) {
    let (colors_a, colors_b) = (a.map(color_layers).unwrap_or_default(), b.map(color_layers).unwrap_or_default());
    let mut views = Views { list: Vec::new(), left_out: 0, room: MOST_FLOATS };
    let mut names: Vec<&str> = colors_a.iter().chain(&colors_b).map(|layer| layer.name.as_str()).collect();
    names.dedup();
    let mut seen: Vec<&str> = Vec::new();
    for name in names {
        let is_first = seen.is_empty();
        if seen.contains(&name) || !(is_first || differs(judgement, |channel| belongs(channel, name))) {
            continue;
        }
        seen.push(name);
        let find = |layers: &'_ [ColorLayer]| layers.iter().position(|layer| layer.name == name);
        let (one, other) = (find(&colors_a).map(|i| &colors_a[i]), find(&colors_b).map(|i| &colors_b[i]));
        let map = judgement.and_then(|j| j.flip.iter().find(|flip| flip.name == name)).map(|flip| &flip.map);
        views.color(name, one, other, map);
    }
    let is_color = |channel: &str| colors_a.iter().chain(&colors_b).any(|layer| belongs(channel, &layer.name));
    for (name, planes) in planes(a, b) {
        let lacks = a.is_some() && b.is_some() && planes.iter().any(Option::is_none);
        if !is_color(&name) && (lacks || differs(judgement, |channel| channel == name)) {
            views.plane(&name, planes);
        }
    }
    (views.list, views.left_out)
}

/// Whether a channel is one of a colour's.
fn belongs(channel: &str, color: &str) -> bool {
    let last =
        if color.is_empty() { Some(channel) } else { channel.strip_prefix(color).and_then(|r| r.strip_prefix('.')) };
    last.is_some_and(|last| ["R", "G", "B", "Y"].contains(&last))
}

fn differs(judgement: Option<&Judgement>, is_wanted: impl Fn(&str) -> bool) -> bool {
    let channels = judgement.map(|judgement| &judgement.comparison.channels[..]).unwrap_or_default();
    channels.iter().any(|channel| channel.difference.pixels > 0 && is_wanted(&channel.name))
}

/// A channel's window and values.
type ChannelPlane = (PixelWindow, Vec<f32>);

/// Every channel of both pictures, by name, in the order of the first.
fn planes(a: Option<&LayeredPicture>, b: Option<&LayeredPicture>) -> Vec<(String, [Option<ChannelPlane>; 2])> {
    let mut all: Vec<(String, [Option<ChannelPlane>; 2])> = Vec::new();
    for (side, picture) in [a, b].into_iter().enumerate() {
        for part in picture.iter().flat_map(|picture| &picture.parts) {
            let is_single = picture.is_some_and(|picture| picture.parts.len() == 1);
            for channel in &part.channels {
                let values = (0..channel.samples.len()).map(|i| channel.samples.get(i) as f32).collect();
                let plane = Some((part.data_window, values));
                let name = name_of(part, channel, is_single);
                match all.iter_mut().find(|(known, _)| *known == name) {
                    Some((_, planes)) => planes[side] = plane,
                    None => all.push((name, if side == 0 { [plane, None] } else { [None, plane] })),
                }
            }
        }
    }
    all
}

struct Views {
    list: Vec<Value>,
    left_out: usize,
    /// Numbers that the page may still take.
    room: usize,
}

impl Views {
    fn color(&mut self, name: &str, a: Option<&ColorLayer>, b: Option<&ColorLayer>, map: Option<&ErrorMap>) {
        let Some(encoding) = a.or(b).map(|layer| layer.encoding) else { return };
        let source = |layer: &ColorLayer| match layer.encoding {
            ColorEncoding::Srgb { bits: 8 } => png(layer.window.size, &PngPixels::Rgb(&bytes(&layer.colors))),
            ColorEncoding::Srgb { .. } | ColorEncoding::Linear => floats(
                layer.window.size,
                &std::array::from_fn::<_, 3, _>(|c| layer.colors.iter().map(|x| x[c]).collect()),
            ),
        };
        let needs = |layer: &ColorLayer| if is_bytes(layer.encoding) { 0 } else { 3 * layer.colors.len() };
        if !self.take(a.map_or(0, needs) + b.map_or(0, needs)) {
            return;
        }
        self.list.push(json!({
            "name": name,
            "encoding": word(encoding),
            "bits": bits(encoding),
            "a": a.map(source),
            "b": b.map(source),
            "flip": map.map(|map| {
                let gray: Vec<u8> = map.errors.iter().map(|error| (error * 255.0 + 0.5) as u8).collect();
                png([map.width, map.height], &PngPixels::Gray(&gray))
            }),
        }));
    }

    fn plane(&mut self, name: &str, planes: [Option<ChannelPlane>; 2]) {
        if !self.take(planes.iter().flatten().map(|(_, values)| values.len()).sum()) {
            return;
        }
        let [a, b] = planes.map(|plane| plane.map(|(window, values)| floats(window.size, &[values])));
        self.list.push(json!({ "name": name, "encoding": "linear", "bits": 32, "a": a, "b": b, "flip": null }));
    }

    fn take(&mut self, numbers: usize) -> bool {
        // The first picture is shown whatever it takes.
        let fits = numbers <= self.room || self.list.is_empty();
        self.room = self.room.saturating_sub(numbers);
        self.left_out += usize::from(!fits);
        fits
    }
}

fn is_bytes(encoding: ColorEncoding) -> bool {
    encoding == ColorEncoding::Srgb { bits: 8 }
}

fn word(encoding: ColorEncoding) -> &'static str {
    match encoding {
        ColorEncoding::Srgb { .. } => "srgb",
        ColorEncoding::Linear => "linear",
    }
}

fn bits(encoding: ColorEncoding) -> u32 {
    match encoding {
        ColorEncoding::Srgb { bits } => bits,
        ColorEncoding::Linear => 32,
    }
}

fn bytes(colors: &[[f32; 3]]) -> Vec<u8> {
    colors.iter().flatten().map(|x| (x * 255.0 + 0.5) as u8).collect()
}

fn png(size: [u32; 2], pixels: &PngPixels) -> Value {
    let none = Vec::new();
    // Pixels that fill their size are always writable.
    let file = encode_small_png(size, pixels, &none, &none).unwrap_or_default();
    json!({ "png": format!("data:image/png;base64,{}", base64::encode(&file)) })
}

fn floats([width, height]: [u32; 2], planes: &[Vec<f32>]) -> Value {
    let raw: Vec<u8> = planes.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    // Writing to memory does not fail.
    let packed = encoder.write_all(&raw).and_then(|()| encoder.finish()).unwrap_or_default();
    json!({ "floats": base64::encode(&packed), "width": width, "height": height, "planes": planes.len() })
}
