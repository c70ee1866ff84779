//! Radiance HDR pictures, of any orientation and exposure.
//!
//! Texels are four bytes: three mantissas and the exponent they share, a row at a time, plain or in runs (Ward, Graphics
//! Gems II, 1991). The line before them says in which order rows and texels stand.

/// Sizes and order of a picture.
pub struct HdrHeader {
    /// Width and height of the picture as it is to be seen.
    pub size: [u32; 2],
    /// Whether lines of the file are columns.
    columns: bool,
    /// Whether the picture is to be turned over from left to right, and from top to bottom.
    flips: [bool; 2],
    /// Stored values are radiance times this.
    exposure: [f32; 3],
    /// Where the texels begin.
    start: usize,
}

pub fn is_hdr(bytes: &[u8]) -> bool {
    bytes.starts_with(b"#?RADIANCE") || bytes.starts_with(b"#?RGBE")
}

/// Reads the header.
///
/// # Errors
/// What in it cannot be read.
pub fn header(bytes: &[u8]) -> Result<HdrHeader, String> {
    let mut at = 0;
    let mut line = || -> Option<String> {
        let end = bytes.get(at..)?.iter().position(|b| *b == b'\n')?;
        let text = String::from_utf8_lossy(&bytes[at..at + end]).trim_end_matches('\r').to_string();
        at += end + 1;
        Some(text)
    };
    let early = || "the file ends too early".to_string();
    let mut exposure = [1.0f64; 3];
    line().ok_or_else(early)?;
    loop {
        let text = line().ok_or_else(early)?;
        if text.trim().is_empty() {
            break;
        }
        let Some((key, value)) = text.split_once('=') else { continue };
        let numbers: Vec<f64> = value.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        match (key.trim(), &numbers[..]) {
            ("FORMAT", _) if value.trim() != "32-bit_rle_rgbe" => {
                return Err(format!("its format is `{}`, and only 32-bit_rle_rgbe is read", value.trim()));
            }
            ("EXPOSURE", [x]) => exposure = exposure.map(|e| e * x),
            ("COLORCORR", [r, g, b]) => exposure = [exposure[0] * r, exposure[1] * g, exposure[2] * b],
            _ => {}
        }
    }
    if !exposure.iter().all(|x| (1e-30..1e30).contains(x)) {
        return Err("its exposure makes no sense".into());
    }
    let resolution = line().ok_or_else(early)?;
    let wrong =
        || format!("`{}` is no resolution, as -Y 512 +X 1024 is", resolution.chars().take(40).collect::<String>());
    let words: Vec<&str> = resolution.split_whitespace().collect();
    let [first, lines, second, length] = words[..] else { return Err(wrong()) };
    let [lines, length] = [lines, length].map(|word| word.parse::<u32>().ok());
    let (Some(lines), Some(length)) = (lines, length) else { return Err(wrong()) };
    let columns = match (first.get(1..), second.get(1..)) {
        (Some("Y"), Some("X")) => false,
        (Some("X"), Some("Y")) => true,
        _ => return Err(wrong()),
    };
    let [x, y] = if columns { [first, second] } else { [second, first] };
    let flips = match (x.as_bytes()[0], y.as_bytes()[0]) {
        (b'+', b'-') => [false, false],
        (b'-', b'-') => [true, false],
        (b'+', b'+') => [false, true],
        (b'-', b'+') => [true, true],
        _ => return Err(wrong()),
    };
    let size = if columns { [lines, length] } else { [length, lines] };
    Ok(HdrHeader { size, columns, flips, exposure: exposure.map(|e| e as f32), start: at })
}

/// The texels of a picture, in rows from the top.
///
/// # Errors
/// Data that end too early, or runs that are longer than their line.
pub fn texels(bytes: &[u8], header: &HdrHeader) -> Result<Vec<f32>, String> {
    let [width, height] = header.size.map(|side| side as usize);
    let (lines, length) = if header.columns { (width, height) } else { (height, width) };
    let mut data = &bytes[header.start..];
    let mut picture = vec![0.0; 3 * width * height];
    let mut line = vec![[0u8; 4]; length];
    for i in 0..lines {
        data = scanline(data, &mut line)?;
        for (j, [r, g, b, exponent]) in line.iter().enumerate() {
            let (x, y) = if header.columns { (i, j) } else { (j, i) };
            let x = if header.flips[0] { width - 1 - x } else { x };
            let y = if header.flips[1] { height - 1 - y } else { y };
            let unit = if *exponent == 0 { 0.0 } else { libm::ldexpf(1.0, i32::from(*exponent) - 136) };
            let texel = &mut picture[3 * (y * width + x)..][..3];
            for (channel, (value, exposure)) in texel.iter_mut().zip([r, g, b].into_iter().zip(header.exposure)) {
                *channel = f32::from(*value) * unit / exposure;
            }
        }
    }
    Ok(picture)
}

/// Reads one line; gives what follows it.
fn scanline<'a>(mut data: &'a [u8], line: &mut [[u8; 4]]) -> Result<&'a [u8], String> {
    let early = || "the file ends too early".to_string();
    let length = line.len();
    let start = data.get(..4).ok_or_else(early)?;
    let is_packed = start[0] == 2 && start[1] == 2 && usize::from(u16::from_be_bytes([start[2], start[3]])) == length;
    if is_packed && (8..32768).contains(&length) {
        data = &data[4..];
        for channel in 0..4 {
            let mut at = 0;
            while at < length {
                let count = usize::from(*data.first().ok_or_else(early)?);
                let (run, bytes) = if count > 128 { (count - 128, 1) } else { (count, count) };
                if run == 0 || at + run > length {
                    return Err("a run of texels is longer than its line".into());
                }
                let values = data.get(1..1 + bytes).ok_or_else(early)?;
                for (i, texel) in line[at..at + run].iter_mut().enumerate() {
                    texel[channel] = if count > 128 { values[0] } else { values[i] };
                }
                (data, at) = (&data[1 + bytes..], at + run);
            }
        }
        return Ok(data);
    }
    let (mut at, mut shift) = (0, 0);
    while at < length {
        let texel: [u8; 4] = data.get(..4).ok_or_else(early)?.try_into().map_err(|_| early())?;
        data = &data[4..];
        if texel[..3] == [1; 3] {
            let run = usize::from(texel[3]) << shift;
            let Some(last) = at.checked_sub(1).map(|i| line[i]).filter(|_| at + run <= length) else {
                return Err("a run of texels is longer than its line".into());
            };
            line[at..at + run].fill(last);
            (at, shift) = (at + run, (shift + 8).min(24));
        } else {
            line[at] = texel;
            (at, shift) = (at + 1, 0);
        }
    }
    Ok(data)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(bytes: &[u8]) -> Result<([u32; 2], Vec<f32>), String> {
        let header = header(bytes)?;
        Ok((header.size, texels(bytes, &header)?))
    }

    #[test]
    fn a_resolution_of_other_letters_is_none() {
        for resolution in ["\u{fffd} 2 X 6", "-Y 2 \u{e9} 6", "Y 2 X 6", "- 2 + 6"] {
            let said = read(format!("#?RADIANCE\n\n{resolution}\n").as_bytes()).unwrap_err();
            assert!(said.contains("is no resolution"), "{said}");
        }
    }

    /// Red values of a picture whose texels count from 1, with this resolution.
    fn reds(resolution: &str) -> Vec<f32> {
        let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{resolution}\n").into_bytes();
        (1..=6).for_each(|i| bytes.extend([i, 0, 0, 136]));
        read(&bytes).unwrap().1.chunks(3).map(|texel| texel[0]).collect()
    }

    #[test]
    fn every_orientation_is_turned_upright() {
        assert_eq!(reds("-Y 2 +X 3"), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(reds("+Y 2 +X 3"), [4.0, 5.0, 6.0, 1.0, 2.0, 3.0]);
        assert_eq!(reds("-Y 2 -X 3"), [3.0, 2.0, 1.0, 6.0, 5.0, 4.0]);
        assert_eq!(reds("+Y 2 -X 3"), [6.0, 5.0, 4.0, 3.0, 2.0, 1.0]);
        // Columns of the picture are the lines of the file.
        assert_eq!(reds("+X 3 -Y 2"), [1.0, 3.0, 5.0, 2.0, 4.0, 6.0]);
        assert_eq!(reds("-X 3 +Y 2"), [6.0, 4.0, 2.0, 5.0, 3.0, 1.0]);
    }

    #[test]
    fn headers_of_every_program_are_read() {
        let texel = [128, 64, 0, 129];
        let with = |header: &str| read(&[header.as_bytes(), &texel].concat()).unwrap().1;
        assert_eq!(with("#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 1 +X 1\r\n"), [1.0, 0.5, 0.0]);
        assert_eq!(
            with("#?RGBE\n# c\nEXPOSURE=2\nEXPOSURE= 0.5\nEXPOSURE=0.25\nGAMMA=1\n\n-Y 1 +X 1\n"),
            [4.0, 2.0, 0.0]
        );
    }

    #[test]
    fn packed_lines_are_unpacked() {
        let mut bytes = b"#?RADIANCE\n\n-Y 1 +X 9\n".to_vec();
        bytes.extend([2, 2, 0, 9, 128 + 9, 7, 4, 1, 2, 3, 4, 128 + 5, 9, 9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 128 + 9, 136]);
        let (_, picture) = read(&bytes).unwrap();
        let texels: Vec<&[f32]> = picture.chunks(3).collect();
        assert_eq!(
            (texels[0], texels[3], texels[8]),
            (&[7.0, 1.0, 0.0][..], &[7.0, 4.0, 0.0][..], &[7.0, 9.0, 0.0][..])
        );
        assert!(read(&bytes[..bytes.len() - 1]).unwrap_err().contains("too early"));
        let mut old = b"#?RADIANCE\n\n-Y 1 +X 4\n".to_vec();
        old.extend([9, 0, 0, 136, 1, 1, 1, 3]);
        assert_eq!(read(&old).unwrap().1.iter().sum::<f32>(), 36.0);
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..80), packed in any::<bool>()) {
            let mut file = b"#?RADIANCE\nEXPOSURE=1\n\n-Y 3 +X 10\n".to_vec();
            if packed {
                file.extend([2, 2, 0, 10]);
            }
            file.extend(&bytes);
            let _ = read(&file);
            let _ = read(&[b"#?RADIANCE\n", &bytes[..]].concat());
        }
    }
}
