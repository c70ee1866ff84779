//! What must be known of a JPEG before it is decoded.

/// Which decoder a JPEG needs, and whether it is whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct JpegScan {
    /// Whether the picture data end with their marker: the decoder fills up with grey what is missing.
    pub is_whole: bool,
    /// Whether its components stand one after the other, of different sizes, and not in progressive passes. The decoder
    /// in use (zune-jpeg 0.5) puts their blocks in the wrong places, without saying so.
    pub is_apart: bool,
}

/// Walks over the segments of a JPEG.
pub fn scan(bytes: &[u8]) -> JpegScan {
    let mut found = JpegScan::default();
    let (mut at, mut sequential, mut components, mut subsampled) = (2, false, 0, false);
    loop {
        // Any number of fill bytes may stand before a marker.
        while bytes.get(at..at + 2) == Some(&[0xff, 0xff]) {
            at += 1;
        }
        let Some([0xff, marker, high, low]) = bytes.get(at..at + 4) else { return found };
        let body = at + 4;
        at += 2 + usize::from(u16::from_be_bytes([*high, *low]));
        let body = bytes.get(body..at).unwrap_or(&[]);
        match *marker {
            0xc0..=0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf => {
                sequential = matches!(*marker, 0xc0 | 0xc1);
                components = body.get(5).copied().unwrap_or(0);
                subsampled = body.get(6..).unwrap_or(&[]).chunks_exact(3).any(|c| c[1] != body[7]);
            }
            0xda => {
                let in_scan = body.first().copied().unwrap_or(0);
                found.is_apart = sequential && subsampled && in_scan < components;
                let rest = bytes.get(at..).unwrap_or(&[]);
                found.is_whole = rest.windows(2).any(|pair| pair == [0xff, 0xd9]);
                return found;
            }
            _ => {}
        }
    }
}
