//! The denoiser against pictures whose truth is known.

use glam::Vec3;

use super::*;
use crate::base::random::{combine, unit_f32};
use crate::film::PixelBounds;

/// Light and albedo of a pixel, and whether its samples are noisy.
type Truth = dyn Fn(usize, usize) -> (f32, f32, bool);

/// A film of so many samples of a flat wall.
fn film(width: u32, height: u32, samples: u32, truth: &Truth) -> Film {
    let mut film = Film::new(width, height);
    for i in 0..(width * height) as usize {
        let (light, albedo, noisy) = truth(i % width as usize, i / width as usize);
        let seen = SeenFeature { albedo: Vec3::splat(albedo), normal: Vec3::Z };
        let mut sum = DenoiseSum::default();
        for sample in 0..samples {
            let noise = unit_f32(combine(combine(3, i as u64), u64::from(sample))) - 0.5;
            let color = Vec3::splat(albedo * light * if noisy { 1.0 + 2.0 * noise } else { 1.0 });
            sum.add(sample >= samples / 2, color, 1.0, Some((Vec3::splat(albedo), 5.0)), &seen);
        }
        let pixel = sum.resolve().unwrap();
        film.pixels[i] = (0.5 * (pixel.halves[0].color + pixel.halves[1].color)).to_array();
        film.layers.halves.push(pixel);
    }
    film
}

/// Root of the mean squared relative error over some columns.
fn error(film: &Film, truth: &Truth, columns: std::ops::Range<usize>) -> f32 {
    let width = film.width as usize;
    let squares = film.pixels.iter().enumerate().filter(|(i, _)| columns.contains(&(i % width))).map(|(i, pixel)| {
        let (light, albedo, _) = truth(i % width, i / width);
        let e = pixel[0] / (light * albedo) - 1.0;
        e * e
    });
    (squares.sum::<f32>() / (columns.len() * film.height as usize) as f32).sqrt()
}

#[test]
fn noise_goes_and_edges_of_paint_and_of_light_stay() {
    let truth = |x: usize, y: usize| {
        let (paint, shadow) = (x >= 32, y >= 24);
        (if shadow { 0.3 } else { 1.0 }, if paint { 0.8 } else { 0.4 }, true)
    };
    let mut film = film(64, 48, 16, &truth);
    let before = error(&film, &truth, 0..64);
    denoise(&mut film);
    let after = error(&film, &truth, 0..64);
    assert!(after < 0.25 * before, "{before} {after}");
    assert!(error(&film, &truth, 30..34) < 0.3 * before);
    assert!(film.layers.halves.is_empty());
}

#[test]
fn what_is_without_noise_stays_beside_what_is_noisy() {
    // Fine stripes that nothing explains but the light itself, and noise beside them.
    let truth = |x: usize, _: usize| (if x < 32 { [0.5, 1.0][x % 2] } else { 1.0 }, 0.5, x >= 32);
    let mut film = film(64, 32, 16, &truth);
    let noisy = error(&film, &truth, 40..64);
    denoise(&mut film);
    assert!(error(&film, &truth, 0..24) < 0.01, "{}", error(&film, &truth, 0..24));
    assert!(error(&film, &truth, 40..64) < 0.3 * noisy);
}

#[test]
fn an_edge_out_of_focus_is_a_smooth_ramp() {
    // A dark thing before a bright one in even light: samples meet either, by a share that rises from left to right.
    let (width, height, samples) = (64, 48, 9);
    let share = |x: usize| ((x as f32 - 16.0) / 32.0).clamp(0.0, 1.0);
    let truth = move |x: usize, _: usize| (0.05 + 0.6 * share(x), 1.0, true);
    let mut film = Film::new(width, height);
    for i in 0..(width * height) as usize {
        let mut sum = DenoiseSum::default();
        for sample in 0..samples {
            let is_bright = unit_f32(combine(combine(7, i as u64), sample)) < share(i % width as usize);
            let albedo = Vec3::splat(if is_bright { 0.65 } else { 0.05 });
            let seen = SeenFeature { albedo, normal: Vec3::Z };
            sum.add(sample % 2 == 1, albedo, 1.0, Some((albedo, if is_bright { 9.0 } else { 3.0 })), &seen);
        }
        let pixel = sum.resolve().unwrap();
        film.pixels[i] = (0.5 * (pixel.halves[0].color + pixel.halves[1].color)).to_array();
        film.layers.halves.push(pixel);
    }
    let total = |film: &Film| film.pixels.iter().map(|p| p[0]).sum::<f32>();
    let (before, light) = (error(&film, &truth, 20..44), total(&film));
    denoise(&mut film);
    let after = error(&film, &truth, 20..44);
    assert!(after < 0.65 * before, "{before} {after}");
    assert!((total(&film) / light - 1.0).abs() < 0.004, "{} {light}", total(&film));
}

#[test]
fn fireflies_do_not_poison_their_neighbours_nor_lose_their_light() {
    let truth = |_: usize, _: usize| (1.0, 0.5, true);
    let mut film = film(64, 64, 16, &truth);
    let bright = &mut film.layers.halves[32 * 64 + 32];
    bright.halves[0].color = Vec3::splat(60.0);
    bright.variance = Vec3::splat(400.0);
    let sum: f32 = film.layers.halves.iter().map(|p| 0.5 * (p.halves[0].color + p.halves[1].color).x).sum();
    let mut huge = film.clone();
    denoise(&mut film);
    let kept: f32 = film.pixels.iter().map(|p| p[0]).sum();
    assert!((kept / sum - 1.0).abs() < 0.01, "{kept} {sum}");
    let far = film.pixels.iter().enumerate().filter(|(i, _)| i % 64 < 8);
    assert!(far.into_iter().all(|(_, p)| (p[0] - 0.5).abs() < 0.2));
    huge.layers.halves[32 * 64 + 32].halves[0].color = Vec3::splat(1e30);
    huge.layers.halves[32 * 64 + 32].variance = Vec3::splat(f32::MAX);
    denoise(&mut huge);
    assert!(huge.pixels.iter().flatten().all(|x| x.is_finite()));
}

#[test]
fn one_sample_a_pixel_stays_as_it_is_and_few_are_filtered() {
    let truth = |_: usize, _: usize| (1.0, 0.5, true);
    let mut few = film(32, 32, 4, &truth);
    let before = error(&few, &truth, 0..32);
    denoise(&mut few);
    assert!(error(&few, &truth, 0..32) < 0.3 * before);
    let mut plain = Film::new(2, 2);
    plain.pixels[1] = [7.0; 3];
    let known = plain.clone();
    denoise(&mut plain);
    assert_eq!(plain, known);
}

#[test]
fn the_picture_is_the_same_on_any_number_of_threads() {
    let truth = |x: usize, y: usize| (if (x / 9 + y / 7).is_multiple_of(2) { 1.0 } else { 0.2 }, 0.5, true);
    let whole = film(50, 37, 16, &truth);
    let on = |threads: usize| {
        let mut film = whole.clone();
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| denoise(&mut film));
        film
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn a_part_with_its_surroundings_is_filtered_as_in_the_whole() {
    let truth = |x: usize, y: usize| (if (x / 19 + y / 17).is_multiple_of(2) { 1.0 } else { 0.2 }, 0.5, true);
    let size = [150, 70];
    let whole = film(size[0], size[1], 16, &truth);
    let part = PixelBounds { origin: [70, 62], size: [5, 4] };
    let around = part.grown(DENOISE_REACH, size);
    assert!(around.count() < whole.pixels.len());
    let mut cropped = whole.cropped(PixelBounds::whole(size), around);
    denoise(&mut cropped);
    let mut filtered = whole;
    denoise(&mut filtered);
    assert_eq!(cropped.cropped(around, part).pixels, filtered.cropped(PixelBounds::whole(size), part).pixels);
}
