//! Two picture files, channel by channel: what only one of them has, and how far the rest is apart.

use crate::output::{ChannelSamples, LayeredPicture, PictureChannel, PicturePart, PixelWindow};

/// Numbers that say how far two pictures are apart, in the pictures' own units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Difference {
    /// Pixels that differ at all.
    pub pixels: usize,
    /// Largest difference of one channel; infinite where one picture holds a number and the other none.
    pub largest: f64,
    /// Root of the mean square over all channels.
    pub rmse: f64,
    /// Peak signal to noise ratio in decibels, for a peak of 1; infinite for equal pictures.
    pub psnr: f64,
}

/// Squares and extremes of some values, on their way to a [`Difference`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ErrorSums {
    squares: f64,
    count: usize,
    largest: f64,
}

impl ErrorSums {
    /// Takes in a pair of values; gives whether they differ.
    pub(super) fn add(&mut self, a: f64, b: f64) -> bool {
        let apart = apart(a, b);
        self.squares += apart * apart;
        self.count += 1;
        self.largest = self.largest.max(apart);
        apart > 0.0
    }

    fn join(self, other: ErrorSums) -> ErrorSums {
        ErrorSums {
            squares: self.squares + other.squares,
            count: self.count + other.count,
            largest: self.largest.max(other.largest),
        }
    }

    pub(super) fn difference(self, pixels: usize) -> Difference {
        let rmse = (self.squares / self.count.max(1) as f64).sqrt();
        Difference { pixels, largest: self.largest, rmse, psnr: -20.0 * libm::log10(rmse) }
    }
}

/// The distance of two values: 0 for equal ones, and for two of which neither is a number.
pub(super) fn apart(a: f64, b: f64) -> f64 {
    if a == b || (a.is_nan() && b.is_nan()) {
        return 0.0;
    }
    let apart = (a - b).abs();
    if apart.is_nan() { f64::INFINITY } else { apart }
}

/// A channel that both pictures have.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelDifference {
    /// As in the file, such as `R` or `depth.Z`.
    pub name: String,
    /// How much it differs.
    pub difference: Difference,
    /// The pixel of the largest difference, counted from the top left of what both pictures cover.
    pub worst: [u32; 2],
}

/// Two picture files, compared value by value.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// What is there in one picture and not in the other, or lies elsewhere: one sentence each.
    pub layout: Vec<String>,
    /// The channels that both have, in the order of the first.
    pub channels: Vec<ChannelDifference>,
    /// All channels together.
    pub difference: Difference,
    /// Pixels that were compared.
    pub compared: usize,
}

impl Comparison {
    /// Whether the two hold the same values, in the same places.
    pub fn is_equal(&self) -> bool {
        self.layout.is_empty() && self.difference.pixels == 0
    }
}

/// A channel with its place in the file.
struct Placed<'a> {
    /// Part and channel, as compositors write it: `ViewLayer.Combined.R`.
    name: String,
    window: PixelWindow,
    channel: &'a PictureChannel,
}

fn placed(picture: &LayeredPicture) -> Vec<Placed<'_>> {
    let is_single = picture.parts.len() == 1;
    let all = picture.parts.iter().flat_map(|part| {
        let place =
            move |channel| Placed { name: name_of(part, channel, is_single), window: part.data_window, channel };
        part.channels.iter().map(place)
    });
    all.collect()
}

/// The name of a channel in its file. What a single part is called tells nothing; a part may be named in its channels.
pub(super) fn name_of(part: &PicturePart, channel: &PictureChannel, is_single: bool) -> String {
    match part.name.as_deref() {
        Some(name) if !is_single && !channel.name.starts_with(&format!("{name}.")) => {
            format!("{name}.{}", channel.name)
        }
        _ => channel.name.clone(),
    }
}

/// Compares all that two picture files hold.
pub fn compare(a: &LayeredPicture, b: &LayeredPicture) -> Comparison {
    let (in_a, in_b) = (placed(a), placed(b));
    let mut layout = Vec::new();
    if a.display_window != b.display_window {
        layout.push(format!("the picture is {}, not {}", b.display_window, a.display_window));
    }
    let find = |all: &[Placed], name: &str| all.iter().position(|placed| placed.name == name);
    let only = |all: &[Placed], others: &[Placed]| -> Vec<String> {
        all.iter().filter(|placed| find(others, &placed.name).is_none()).map(|placed| placed.name.clone()).collect()
    };
    let lack = |names: Vec<String>, which: &str| {
        let plural = if names.len() == 1 { "channel" } else { "channels" };
        (!names.is_empty()).then(|| format!("{plural} {} only in the {which}", quoted(&names)))
    };
    layout.extend(lack(only(&in_a, &in_b), "first"));
    layout.extend(lack(only(&in_b, &in_a), "second"));
    let mut moved: Vec<([PixelWindow; 2], Vec<String>)> = Vec::new();
    let (mut channels, mut total) = (Vec::new(), ErrorSums::default());
    let mut masks: Vec<(PixelWindow, Vec<bool>)> = Vec::new();
    for one in &in_a {
        let Some(other) = find(&in_b, &one.name).map(|i| &in_b[i]) else { continue };
        let windows = [one.window, other.window];
        if one.window != other.window && windows != [a.display_window, b.display_window] {
            match moved.iter_mut().find(|(known, _)| *known == windows) {
                Some((_, names)) => names.push(one.name.clone()),
                None => moved.push((windows, vec![one.name.clone()])),
            }
        }
        let Some(window) = one.window.common(other.window) else { continue };
        let at = masks.iter().position(|(known, _)| *known == window).unwrap_or_else(|| {
            masks.push((window, vec![false; window.pixels()]));
            masks.len() - 1
        });
        let (sums, found) = compare_channel(one, other, window, &mut masks[at].1);
        total = total.join(sums);
        channels.push(found);
    }
    layout.extend(moved.into_iter().map(|([a, b], names)| {
        let covers = if names.len() == 1 { "covers" } else { "cover" };
        format!("{} {covers} {b}, not {a}", quoted(&names))
    }));
    let pixels = masks.iter().map(|(_, mask)| mask.iter().filter(|differs| **differs).count()).sum();
    let compared = masks.iter().map(|(window, _)| window.pixels()).sum();
    Comparison { layout, channels, difference: total.difference(pixels), compared }
}

/// A few names, or some of many.
fn quoted(names: &[String]) -> String {
    const SHOWN: usize = 8;
    let list: Vec<String> = names.iter().take(SHOWN).map(|name| format!("`{name}`")).collect();
    match names.len() {
        0..=SHOWN => list.join(", "),
        more => format!("{} and {} more", list.join(", "), more - SHOWN),
    }
}

fn compare_channel(a: &Placed, b: &Placed, window: PixelWindow, mask: &mut [bool]) -> (ErrorSums, ChannelDifference) {
    let (mut sums, mut pixels, mut worst, mut most) = (ErrorSums::default(), 0, [0, 0], 0.0);
    let [width, height] = window.size;
    let mut take = |x: u32, y: u32, va: f64, vb: f64| {
        if sums.add(va, vb) {
            pixels += 1;
            mask[(y * width + x) as usize] = true;
            if sums.largest > most {
                (most, worst) = (sums.largest, [x, y]);
            }
        }
    };
    for y in 0..height {
        let (row_a, row_b) = (row(a.window, window, y), row(b.window, window, y));
        for x in 0..width {
            let at = x as usize;
            match (&a.channel.samples, &b.channel.samples) {
                // The usual case, without a look at each value's kind.
                (ChannelSamples::Float(of_a), ChannelSamples::Float(of_b)) => {
                    take(x, y, f64::from(of_a[row_a + at]), f64::from(of_b[row_b + at]));
                }
                (of_a, of_b) => take(x, y, of_a.get(row_a + at), of_b.get(row_b + at)),
            }
        }
    }
    let difference = sums.difference(pixels);
    (sums, ChannelDifference { name: a.name.clone(), difference, worst })
}

/// Where a row of the common window starts in a part.
fn row(part: PixelWindow, common: PixelWindow, y: u32) -> usize {
    let [dx, dy] = std::array::from_fn(|axis| (i64::from(common.origin[axis]) - i64::from(part.origin[axis])) as usize);
    (dy + y as usize) * part.size[0] as usize + dx
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::ColorEncoding;

    fn channel(name: &str, values: &[f32]) -> PictureChannel {
        PictureChannel { name: name.into(), samples: ChannelSamples::Float(values.to_vec()) }
    }

    fn part(name: Option<&str>, origin: [i32; 2], size: [u32; 2], channels: Vec<PictureChannel>) -> PicturePart {
        PicturePart { name: name.map(str::to_string), data_window: PixelWindow { origin, size }, channels }
    }

    fn picture(size: [u32; 2], parts: Vec<PicturePart>) -> LayeredPicture {
        let display_window = PixelWindow { origin: [0, 0], size };
        LayeredPicture { encoding: ColorEncoding::Linear, display_window, parts }
    }

    #[test]
    fn every_channel_counts_and_the_worst_pixel_is_named() {
        let with = |z: f32| {
            let channels = vec![channel("A", &[1.0; 4]), channel("Z", &[1.0, 2.0, z, f32::NAN])];
            picture([2, 2], vec![part(None, [0, 0], [2, 2], channels)])
        };
        assert!(compare(&with(3.0), &with(3.0)).is_equal());
        let found = compare(&with(3.0), &with(5.0));
        assert_eq!((found.difference.pixels, found.difference.largest, found.compared), (1, 2.0, 4));
        assert_eq!(found.channels[0].difference.pixels, 0);
        assert_eq!((found.channels[1].name.as_str(), found.channels[1].worst), ("Z", [0, 1]));
        assert!((found.difference.rmse - (4.0f64 / 8.0).sqrt()).abs() < 1e-12);
        assert_eq!(compare(&with(3.0), &with(f32::NAN)).difference.largest, f64::INFINITY);
        // Signed zeros are one number.
        assert!(compare(&with(0.0), &with(-0.0)).is_equal());
    }

    #[test]
    fn what_only_one_has_is_named() {
        let color = |names: &[&str]| names.iter().map(|name| channel(name, &[0.5])).collect::<Vec<_>>();
        let whole = picture([1, 1], vec![part(None, [0, 0], [1, 1], color(&["A", "R", "Z"]))]);
        let bare = picture([1, 1], vec![part(None, [0, 0], [1, 1], color(&["R"]))]);
        let found = compare(&whole, &bare);
        assert_eq!(found.layout, ["channels `A`, `Z` only in the first"]);
        assert_eq!(compare(&bare, &whole).layout, ["channels `A`, `Z` only in the second"]);
        assert!(!found.is_equal() && found.difference.pixels == 0);
    }

    #[test]
    fn parts_are_compared_by_name_and_where_they_lie() {
        let combined =
            |origin, values: &[f32]| part(Some("V.Combined"), origin, [2, 1], vec![channel("V.Combined.R", values)]);
        let depth = |value: f32| part(Some("V.Depth"), [0, 0], [1, 1], vec![channel("Z", &[value])]);
        let a = picture([4, 1], vec![combined([0, 0], &[1.0, 2.0]), depth(7.0)]);
        let b = picture([4, 1], vec![depth(7.0), combined([0, 0], &[1.0, 2.0])]);
        assert!(compare(&a, &b).is_equal());
        let moved = picture([4, 1], vec![combined([1, 0], &[2.0, 9.0]), depth(7.0)]);
        let found = compare(&a, &moved);
        assert_eq!(found.layout, ["`V.Combined.R` covers 2x1 at (1, 0), not 2x1"]);
        assert_eq!(found.difference.pixels, 0, "what both cover is equal");
        // One part with the channels of both is the same picture.
        let flat = vec![channel("V.Combined.R", &[1.0, 2.0]), channel("V.Depth.Z", &[7.0, 7.0])];
        let flat = picture([4, 1], vec![part(None, [0, 0], [2, 1], flat)]);
        assert_eq!(compare(&a, &flat).layout, ["`V.Depth.Z` covers 2x1, not 1x1"]);
    }

    #[test]
    fn another_size_is_said_once() {
        let of = |w: u32, h: u32| {
            let values = vec![0.0; (w * h) as usize];
            picture([w, h], vec![part(None, [0, 0], [w, h], ["R", "G"].map(|name| channel(name, &values)).to_vec())])
        };
        assert_eq!(compare(&of(2, 1), &of(3, 4)).layout, ["the picture is 3x4, not 2x1"]);
    }

    #[test]
    fn whole_numbers_are_not_rounded() {
        let of = |id: u32| {
            let channels = vec![PictureChannel { name: "id".into(), samples: ChannelSamples::Whole(vec![id]) }];
            picture([1, 1], vec![part(None, [0, 0], [1, 1], channels)])
        };
        assert_eq!(compare(&of(u32::MAX), &of(u32::MAX - 1)).difference.largest, 1.0);
    }
}
