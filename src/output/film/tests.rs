//! Films of every format that is written in the process, read again by other decoders.

use std::io::Cursor;

use super::*;
use crate::base::rate::Rate;

/// A film of so many frames at 24000/1001 frames a second that plays for ever.
pub fn spec(width: u32, height: u32, frames: u64) -> FilmSpec {
    let note = |keyword: &str, text: &str| (keyword.to_string(), text.to_string());
    let metadata = vec![
        note("Software", "anim"),
        note("Source", "sch\u{f6}n & <gut>.rhai"),
        note("Hash", "0123456789abcdef0123456789abcdef"),
        note("Settings", &"size=5x3 samples=16 ".repeat(20)),
    ];
    FilmSpec {
        size: [width, height],
        rate: Rate::new(24_000, 1001).unwrap(),
        frames,
        alpha: false,
        deep: false,
        plays: 0,
        metadata,
    }
}

/// A square that moves over a slope; the third frame is the second one again.
pub fn frames(width: u32, height: u32, count: u32) -> Vec<FilmFrame> {
    let frame = |n: u32| {
        let n = if n == 2 { 1 } else { n };
        let color = |x: u32, y: u32| match x.abs_diff(n % width) < 2 && y < height / 2 {
            true => [200, 30, 40, 255],
            false => [(x * 255 / width) as u8, (y * 255 / height) as u8, 90, 255],
        };
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| color(x, y))).collect();
        FilmFrame { width, height, pixels: FramePixels::Bytes(pixels) }
    };
    (0..count).map(frame).collect()
}

/// The bytes of a film, by way of a file.
fn film(ending: &str, spec: &FilmSpec, frames: &[FilmFrame], options: FilmOptions, palette: GifPalette) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film").with_extension(ending);
    let mut writer = FilmWriter::create(&path, spec, &options, palette).unwrap();
    frames.iter().for_each(|frame| writer.add(frame).unwrap());
    assert!(!path.exists());
    assert_eq!(writer.finish().unwrap(), frames.len() as u64);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    let info = read_film_info(&path).unwrap().unwrap();
    assert_eq!((info.size, &info.metadata), (spec.size, &spec.metadata), "{ending}");
    std::fs::read(&path).unwrap()
}

fn plain(ending: &str, spec: &FilmSpec, frames: &[FilmFrame]) -> Vec<u8> {
    let mut finder = PaletteFinder::new(PaletteChoice::Shared, frames.len() as u64);
    frames.iter().for_each(|frame| finder.add(frame));
    film(ending, spec, frames, FilmOptions::default(), finder.choose())
}

/// Every canvas of an animation with its delay, as the `image` crate's readers give them.
fn canvases(bytes: &[u8]) -> Vec<(Vec<[u8; 4]>, u64)> {
    let cursor = || Cursor::new(bytes);
    if bytes.starts_with(b"RIFF") {
        let mut decoder = image_webp::WebPDecoder::new(cursor()).unwrap();
        let channels = if decoder.has_alpha() { 4 } else { 3 };
        let mut buffer = vec![0; decoder.output_buffer_size().unwrap()];
        let pixels = |buffer: &[u8]| {
            buffer.chunks_exact(channels).map(|p| [p[0], p[1], p[2], p.get(3).copied().unwrap_or(255)]).collect()
        };
        return (0..decoder.num_frames())
            .map(|_| {
                let delay = decoder.read_frame(&mut buffer).unwrap();
                (pixels(&buffer), u64::from(delay))
            })
            .collect();
    }
    if bytes.starts_with(b"GIF") {
        return gif_canvases(bytes);
    }
    let decoder = image::codecs::png::PngDecoder::new(cursor()).unwrap();
    let frames = image::AnimationDecoder::into_frames(decoder.apng().unwrap()).collect_frames().unwrap();
    let delay = |frame: &image::Frame| {
        let (above, below) = frame.delay().numer_denom_ms();
        u64::from(above / below)
    };
    frames.iter().map(|frame| (frame.buffer().pixels().map(|p| p.0).collect(), delay(frame))).collect()
}

fn gif_canvases(bytes: &[u8]) -> Vec<(Vec<[u8; 4]>, u64)> {
    let mut options = ::gif::DecodeOptions::new();
    options.set_color_output(::gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).unwrap();
    let width = usize::from(decoder.width());
    let mut canvas = vec![[0; 4]; width * usize::from(decoder.height())];
    let mut all = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        for (i, pixel) in frame.buffer.as_chunks::<4>().0.iter().enumerate().filter(|(_, p)| p[3] > 0) {
            let (x, y) = (i % usize::from(frame.width), i / usize::from(frame.width));
            canvas[(y + usize::from(frame.top)) * width + x + usize::from(frame.left)] = *pixel;
        }
        all.push((canvas.clone(), u64::from(frame.delay) * 10));
        if frame.dispose == ::gif::DisposalMethod::Background {
            canvas.fill([0; 4]);
        }
    }
    all
}

#[test]
fn lossless_films_give_back_every_pixel_and_their_time() {
    let (spec, frames) = (spec(9, 6, 30), frames(9, 6, 30));
    // So few colours that a GIF of them has them all.
    for ending in ["apng", "webp", "gif"] {
        let bytes = plain(ending, &spec, &frames);
        assert_eq!(bytes, plain(ending, &spec, &frames));
        let found = canvases(&bytes);
        assert_eq!(found.len(), 30, "{ending}");
        for (i, ((canvas, _), frame)) in found.iter().zip(&frames).enumerate() {
            assert_eq!(canvas, &*frame.bytes(), "{ending} {i}");
        }
        // 30 x 1001 / 24000 s.
        let total: u64 = found.iter().map(|(_, delay)| delay).sum();
        assert!(total.abs_diff(1251) <= if ending == "gif" { 5 } else { 1 }, "{ending}: {total}");
    }
}

#[test]
fn frames_of_which_little_changes_are_small() {
    let (spec, frames) = (spec(200, 100, 40), frames(200, 100, 40));
    for ending in ["apng", "webp", "gif"] {
        let alone = plain(ending, &FilmSpec { frames: 1, ..spec.clone() }, &frames[..1]).len();
        let all = plain(ending, &spec, &frames).len();
        assert!(all < alone * 10, "{ending}: {alone} {all}");
    }
}

#[test]
fn what_shows_through_stays_so() {
    let hole = |from: u32| {
        let alpha = |x: u32| if (from..from + 4).contains(&x) { 0 } else { 255 };
        let color = |x: u32| if alpha(x) == 0 { [0; 4] } else { [200, x as u8 * 9, 60, 255] };
        let pixels = (0..8).flat_map(|_| (0..12).map(color)).collect();
        FilmFrame { width: 12, height: 8, pixels: FramePixels::Bytes(pixels) }
    };
    let frames: Vec<FilmFrame> = [0, 3, 3, 7, 1].into_iter().map(hole).collect();
    let spec = FilmSpec { alpha: true, ..spec(12, 8, 5) };
    for ending in ["apng", "webp", "gif"] {
        let found = canvases(&plain(ending, &spec, &frames));
        assert_eq!(found.len(), 5, "{ending}");
        for (i, ((canvas, _), frame)) in found.iter().zip(&frames).enumerate() {
            assert_eq!(canvas, &*frame.bytes(), "{ending} {i}");
        }
    }
}

#[test]
fn sixteen_bits_stay_sixteen_in_apng() {
    let pixels = (0..64u16).map(|i| [i * 1000, 65_535 - i, i, u16::MAX]).collect();
    let frame = FilmFrame { width: 8, height: 8, pixels: FramePixels::Words(pixels) };
    let spec = FilmSpec { deep: true, ..spec(8, 8, 1) };
    let bytes = plain("apng", &spec, std::slice::from_ref(&frame));
    let read = image::load_from_memory_with_format(&bytes, image::ImageFormat::Png).unwrap();
    assert_eq!(read.to_rgba16().pixels().map(|p| p.0).collect::<Vec<_>>(), &*frame.words());
}

#[test]
fn a_film_that_ends_early_counts_what_it_has() {
    let (spec, frames) = (spec(9, 6, 7), frames(9, 6, 5));
    for ending in ["apng", "webp", "gif"] {
        assert_eq!(canvases(&plain(ending, &spec, &frames)).len(), 5, "{ending}");
    }
}

#[test]
fn still_pixels_do_not_change_however_the_palette_is_chosen() {
    let (width, height) = (64, 48);
    let frame = |n: u32| {
        let color = |x: u32, y: u32| match x < 32 {
            true => [(x * 8) as u8, (y * 5) as u8, ((x * 7 + y * 3) % 256) as u8, 255],
            false => [((x * 4 + n * 31) % 256) as u8, ((y * 5 + n * 17) % 256) as u8, (n * 40) as u8, 255],
        };
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| color(x, y))).collect();
        FilmFrame { width, height, pixels: FramePixels::Bytes(pixels) }
    };
    let frames: Vec<FilmFrame> = (0..6).map(frame).collect();
    let spec = spec(width, height, 6);
    let mut finder = PaletteFinder::new(PaletteChoice::Auto, 6);
    frames.iter().for_each(|frame| finder.add(frame));
    for palette in [finder.choose(), GifPalette::PerFrame] {
        let found = canvases(&film("gif", &spec, &frames, FilmOptions::default(), palette.clone()));
        for (canvas, _) in &found {
            let left = |i: &usize| i % 64 < 32;
            assert!((0..canvas.len()).filter(left).all(|i| canvas[i] == found[0].0[i]), "{palette:?}");
        }
        // Near what was meant: the mean over the picture is, since dithering keeps it.
        for ((canvas, _), frame) in found.iter().zip(&frames) {
            let mean = |pixels: &[[u8; 4]]| pixels.iter().map(|p| f64::from(p[1])).sum::<f64>() / pixels.len() as f64;
            assert!((mean(canvas) - mean(&frame.bytes())).abs() < 3.0);
        }
    }
}

#[test]
fn one_palette_serves_a_film_of_one_kind_and_not_one_of_many() {
    let plane = |n: u32| {
        let pixels = (0..4096u32).map(|i| {
            let (a, b) = ((i % 64 * 4) as u8, (i / 64 * 4) as u8);
            match n % 6 {
                0 => [a, b, 0, 255],
                1 => [a, 0, b, 255],
                2 => [0, a, b, 255],
                3 => [255, a, b, 255],
                4 => [a, 255, b, 255],
                _ => [a, b, 255, 255],
            }
        });
        FilmFrame { width: 64, height: 64, pixels: FramePixels::Bytes(pixels.collect()) }
    };
    let choose = |numbers: &[u32]| {
        let mut finder = PaletteFinder::new(PaletteChoice::Auto, numbers.len() as u64);
        numbers.iter().for_each(|n| finder.add(&plane(*n)));
        finder.choose()
    };
    assert!(matches!(choose(&[0, 0, 0, 0]), GifPalette::Shared(_)));
    assert_eq!(choose(&[0, 1, 2, 3, 4, 5]), GifPalette::PerFrame);
}

#[test]
fn a_gif_leaves_out_what_browsers_would_show_for_too_long() {
    let rate = Rate::new(60, 1).unwrap();
    let spec = FilmSpec { rate, ..spec(9, 6, 60) };
    let found = canvases(&plain("gif", &spec, &frames(9, 6, 60)));
    assert_eq!(found.len() as u64, 60 - left_out(FilmFormat::Gif, &spec));
    assert!(found.iter().all(|(_, delay)| *delay >= 20), "{found:?}");
    assert_eq!(found.iter().map(|(_, delay)| delay).sum::<u64>(), 1000);
    assert_eq!(left_out(FilmFormat::Gif, &FilmSpec { rate: Rate::new(50, 1).unwrap(), ..spec }), 0);
}

#[test]
fn how_often_a_film_plays_is_in_it() {
    let frames = frames(9, 6, 2);
    for (plays, again) in [(0, Some(0)), (1, None), (3, Some(2))] {
        let spec = FilmSpec { plays, ..spec(9, 6, 2) };
        let bytes = plain("gif", &spec, &frames);
        let block = bytes.windows(11).position(|window| window == b"NETSCAPE2.0");
        assert_eq!(block.map(|at| u16::from_le_bytes([bytes[at + 13], bytes[at + 14]])), again);
        let bytes = plain("apng", &spec, &frames);
        let at = bytes.windows(4).position(|window| window == b"acTL").unwrap();
        assert_eq!(bytes[at + 4..at + 12], [0, 0, 0, 2, 0, 0, 0, plays as u8]);
        let bytes = plain("webp", &spec, &frames);
        let at = bytes.windows(4).position(|window| window == b"ANIM").unwrap();
        assert_eq!(bytes[at + 12..at + 14], [plays as u8, 0]);
    }
}

#[test]
fn a_frame_of_another_size_is_refused_and_leaves_no_film() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film.gif");
    let spec = spec(9, 6, 2);
    let mut writer = FilmWriter::create(&path, &spec, &FilmOptions::default(), GifPalette::PerFrame).unwrap();
    writer.add(&frames(9, 6, 1)[0]).unwrap();
    assert!(writer.add(&frames(8, 6, 1)[0]).unwrap_err().message.contains("8x6"));
    drop(writer);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    let wrong =
        FilmWriter::create(&folder.path().join("film.avi"), &spec, &FilmOptions::default(), GifPalette::PerFrame);
    assert!(wrong.err().unwrap().message.contains(".apng .gif .webp .y4m .mp4 .webm .mov"));
}
