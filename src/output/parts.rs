//! What a picture file is made of: parts, where each lies, and every channel of them.

/// A rectangle of the plane that pictures lie in: its top left pixel, and its width and height.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelWindow {
    /// Column and row of the top left pixel.
    pub origin: [i32; 2],
    /// Columns and rows.
    pub size: [u32; 2],
}

impl PixelWindow {
    /// The rectangle that both cover; `None` if they have no pixel in common.
    pub fn common(self, other: Self) -> Option<Self> {
        let end = |window: Self, axis: usize| i64::from(window.origin[axis]) + i64::from(window.size[axis]);
        let origin: [i32; 2] = std::array::from_fn(|axis| self.origin[axis].max(other.origin[axis]));
        let side = |axis: usize| end(self, axis).min(end(other, axis)) - i64::from(origin[axis]);
        let size = [u32::try_from(side(0)).ok()?, u32::try_from(side(1)).ok()?];
        (size[0] > 0 && size[1] > 0).then_some(PixelWindow { origin, size })
    }

    /// How many pixels it has.
    pub fn pixels(self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }
}

impl std::fmt::Display for PixelWindow {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ([x, y], [width, height]) = (self.origin, self.size);
        if (x, y) == (0, 0) { write!(f, "{width}x{height}") } else { write!(f, "{width}x{height} at ({x}, {y})") }
    }
}

/// How the colours of a file are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorEncoding {
    /// From 0 to 1 along the sRGB curve, in so many bits: what a screen is sent.
    Srgb {
        /// 8 or 16.
        bits: u32,
    },
    /// Light, of any brightness.
    Linear,
}

/// A picture file.
#[derive(Clone, Debug, PartialEq)]
pub struct LayeredPicture {
    /// How its colours are stored.
    pub encoding: ColorEncoding,
    /// What is meant to be shown of the plane.
    pub display_window: PixelWindow,
    /// In the order of the file.
    pub parts: Vec<PicturePart>,
}

/// One part of a picture file.
#[derive(Clone, Debug, PartialEq)]
pub struct PicturePart {
    /// Files of a single part may leave it out.
    pub name: Option<String>,
    /// Where there are pixels.
    pub data_window: PixelWindow,
    /// In the order of the file.
    pub channels: Vec<PictureChannel>,
}

/// A channel of a part: a value for each pixel of its data window, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureChannel {
    /// As in the file, such as `R` or `depth.Z`.
    pub name: String,
    /// Its values.
    pub samples: ChannelSamples,
}

/// The values of a channel.
#[derive(Clone, Debug, PartialEq)]
pub enum ChannelSamples {
    /// Numbers of any kind.
    Float(Vec<f32>),
    /// Numbers of objects and the like, which a float cannot hold.
    Whole(Vec<u32>),
}

impl ChannelSamples {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            ChannelSamples::Float(values) => values.len(),
            ChannelSamples::Whole(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A value as a number; 0 for one that is not there.
    pub fn get(&self, index: usize) -> f64 {
        match self {
            ChannelSamples::Float(values) => values.get(index).map_or(0.0, |x| f64::from(*x)),
            ChannelSamples::Whole(values) => values.get(index).map_or(0.0, |x| f64::from(*x)),
        }
    }
}
