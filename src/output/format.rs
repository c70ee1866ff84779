//! What a picture format is: how files of it are called, written, read and looked into.

use std::fmt;

use super::metadata::Metadata;
use crate::base::digest::Digest;
use crate::components::{Aov, Render};
use crate::film::Film;

/// One picture format: what a file of it is called, and how it is written, read and looked into.
pub struct Format {
    /// What people call it.
    pub name: &'static str,
    /// Endings of file names, in lower case and without the dot; the usual one first.
    pub extensions: &'static [&'static str],
    /// Bytes that every file of it starts with.
    pub signature: &'static [u8],
    /// Bits per channel that it can hold, of the setting `bit_depth`, with what they are.
    pub bit_depths: &'static [(u32, &'static str)],
    /// Whether a file can hold this layer beside the colours.
    pub holds: fn(Aov) -> bool,
    /// The bytes of a file: the picture as the settings want it, and the metadata in their order.
    ///
    /// The same arguments give the same bytes. The error says what the format cannot hold.
    pub encode: fn(&Film, &Render, &Metadata) -> Result<Vec<u8>, String>,
    /// As `encode`, of a picture of this size whose rows come in bands, from the top, each asked for when the one before is
    /// encoded: to the byte what the whole gives. Bands begin at multiples of sixteen rows of the frame, or at its top.
    pub encode_rows: EncodeRows,
    /// Colours of a file, top row first, in the file's own units: 0 to 1 of a format for the screen, linear and of any
    /// size otherwise. The error says what is wrong with the file, which may be damaged or hostile.
    pub decode: fn(&[u8]) -> Result<Decoded, String>,
    /// The digest of what a file shows, however it is stored; `None` if it is damaged.
    /// For a frame's file it is the one that `encode` has put among the metadata.
    pub pixels: fn(&[u8]) -> Option<Digest>,
    /// What a file says of itself, without its pixels. The error as for `decode`.
    pub read_header: fn(&[u8]) -> Result<PictureHeader, String>,
    /// The metadata of a file in which no byte is damaged.
    pub checked_metadata: fn(&[u8]) -> Option<Metadata>,
    /// The same picture with other values of some of its metadata: the bytes that encoding it with those would give.
    ///
    /// The second argument is the metadata of the file, the third what is to change. `None` if the file is not whole.
    pub relabel: fn(&[u8], &Metadata, &Metadata) -> Option<Vec<u8>>,
}

/// Encodes a picture of a size, as the settings want it and with these metadata, from rows that are asked for.
pub type EncodeRows = fn([u32; 2], &Render, &Metadata, &mut dyn FnMut() -> Option<Film>) -> Result<Vec<u8>, String>;

/// The colours of a picture file.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// RGB, top row first.
    pub pixels: Vec<[f32; 3]>,
}

/// What a picture file says of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureHeader {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Names of all channels in the file's order, of a format that names them.
    pub channels: Vec<String>,
    /// What the picture says of its making.
    pub metadata: Metadata,
}

impl fmt::Debug for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Format {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}
