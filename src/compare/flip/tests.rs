use super::*;

const WIDTH: i64 = 48;
const HEIGHT: i64 = 40;

type Levels = [i64; 3];
type Painter = fn(i64, i64) -> Levels;

fn scramble(x: i64, y: i64, seed: i64) -> i64 {
    let n = (x * 374_761_393 + y * 668_265_263 + seed * 2_246_822_519) & 0xFFFF_FFFF;
    let n = ((n ^ (n >> 13)) * 1_274_126_177) & 0xFFFF_FFFF;
    n ^ (n >> 16)
}

fn disc(x: i64, y: i64, radius: i64) -> bool {
    (x - 24).pow(2) + (y - 20).pow(2) < radius * radius
}

fn gradient(x: i64, y: i64) -> Levels {
    [x * 5 % 256, y * 6 % 256, (x + y) * 2 % 256]
}

fn checker(x: i64, y: i64) -> Levels {
    if (x / 6 + y / 6) % 2 == 1 { [230, 225, 220] } else { [20, 30, 40] }
}

fn noise(x: i64, y: i64, seed: i64) -> Levels {
    let n = scramble(x, y, seed);
    [n & 255, n >> 8 & 255, n >> 16 & 255]
}

fn bright(x: i64, y: i64, seed: i64) -> Levels {
    let n = scramble(x, y, seed);
    noise(x, y, seed).map(|c| c << (n >> 24 & 7))
}

fn lamp(x: i64, y: i64, radius: i64, light: i64) -> Levels {
    if disc(x, y, radius) { [light, light - 100, light / 2] } else { gradient(x, y).map(|c| c / 8) }
}

fn red_on_blue(x: i64, y: i64, radius: i64) -> Levels {
    if disc(x, y, radius) { [230, 20, 10] } else { [10, 20, 200] }
}

fn picture(paint: Painter, levels: f32) -> Vec<[f32; 3]> {
    let at = |i: i64| paint(i % WIDTH, i / WIDTH).map(|c| c as f32 / levels);
    (0..WIDTH * HEIGHT).map(at).collect()
}

fn viewing(pixels_per_degree: f64) -> Viewing {
    Viewing { pixels_per_degree }
}

/// Mean and largest error, and those of the pixels (0, 0), (24, 20), (30, 12) and (47, 39).
fn numbers(map: &ErrorMap) -> [f64; 6] {
    let at = |x: usize, y: usize| f64::from(map.errors[y * 48 + x]);
    [map.mean(), map.largest().into(), at(0, 0), at(24, 20), at(30, 12), at(47, 39)]
}

#[track_caller]
fn agrees(map: &ErrorMap, expected: [f64; 6]) {
    let found = numbers(map);
    for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!((found - expected).abs() < 1e-4, "number {i}: {found} instead of {expected}");
    }
}

/// `tests/flip/reference.py` prints these numbers with flip-evaluator 1.7.
#[test]
fn shown_pictures_have_the_errors_of_the_reference_implementation() {
    let usual = Viewing::default().pixels_per_degree;
    let pairs: [(Painter, Painter, f64, [f64; 6]); 7] = [
        (gradient, |x, y| gradient(x + 1, y), usual, [0.082776, 0.117415, 0.027016, 0.085658, 0.098096, 0.107280]),
        (checker, |x, y| checker(x + 1, y), usual, [0.318845, 0.983136, 0.037839, 0.457503, 0.266465, 0.817830]),
        (
            |x, y| noise(x, y, 1),
            |x, y| noise(x, y, 2),
            usual,
            [0.457865, 0.960659, 0.463866, 0.524328, 0.373393, 0.770781],
        ),
        (
            |x, y| noise(x, y, 1),
            |x, y| noise(x, y, 2),
            20.0,
            [0.850303, 0.990643, 0.900376, 0.813770, 0.961422, 0.852431],
        ),
        (|_, _| [0; 3], |_, _| [255; 3], usual, [0.967388; 6]),
        (
            |x, y| red_on_blue(x, y, 10),
            |x, y| red_on_blue(x, y, 11),
            usual,
            [0.095826, 0.479393, 0.0, 0.051259, 0.479393, 0.0],
        ),
        (
            gradient,
            |x, y| gradient(x, y).map(|c| c & 0xE0),
            usual,
            [0.278294, 0.426858, 0.048064, 0.316962, 0.301075, 0.250167],
        ),
    ];
    for (reference, test, pixels_per_degree, expected) in pairs {
        let (reference, test) = (picture(reference, 255.0), picture(test, 255.0));
        agrees(&ldr(48, &reference, &test, viewing(pixels_per_degree)), expected);
    }
}

#[test]
fn linear_pictures_have_the_errors_of_the_reference_implementation() {
    let near = |a: f64, b: f64| (a - b).abs() < 1e-4;
    let usual = Viewing::default();
    let (reference, test) = (picture(|x, y| bright(x, y, 3), 256.0), picture(|x, y| bright(x, y, 4), 256.0));
    let found = exposures(&reference);
    assert!(near(found.start, -5.84814) && near(found.stop, -1.19171) && found.count == 5, "{found:?}");
    let map = hdr(48, &reference, &test, usual, found);
    agrees(&map, [0.497017, 0.970584, 0.456232, 0.448011, 0.332496, 0.759180]);

    let reference = picture(|x, y| lamp(x, y, 6, 9000), 256.0);
    let test = picture(|x, y| lamp(x, y, 6, 11_000), 256.0);
    let found = exposures(&reference);
    assert!(near(found.start, -3.98742) && near(found.stop, 5.20343) && found.count == 10, "{found:?}");
    agrees(&hdr(48, &reference, &test, usual, found), [0.014976, 0.151717, 0.0, 0.151717, 0.013837, 0.0]);

    let test = picture(|x, y| lamp(x, y, 7, 9000), 256.0);
    let given = Exposures { start: -6.0, stop: 2.0, count: 5 };
    let map = hdr(48, &reference, &test, viewing(40.0), given);
    agrees(&map, [0.064542, 0.911449, 0.0, 0.010199, 0.050624, 0.0]);
}

#[test]
fn a_picture_and_itself_differ_nowhere() {
    let noisy = picture(|x, y| bright(x, y, 5), 64.0);
    assert_eq!(ldr(48, &noisy, &noisy, Viewing::default()).largest(), 0.0);
    assert_eq!(hdr(48, &noisy, &noisy, Viewing::default(), exposures(&noisy)).largest(), 0.0);
}

#[test]
fn bands_leave_no_seams() {
    // Taller than a band, and the same picture turned: columns of one are rows of the other.
    let (width, height) = (7, 2 * BAND + 5);
    let color = |x: usize, y: usize, seed| noise(x as i64, y as i64, seed).map(|c| c as f32 / 255.0);
    let tall = |seed| -> Vec<[f32; 3]> { (0..width * height).map(|i| color(i % width, i / width, seed)).collect() };
    let wide = |seed| -> Vec<[f32; 3]> { (0..width * height).map(|i| color(i / height, i % height, seed)).collect() };
    let one = ldr(width as u32, &tall(1), &tall(2), Viewing::default());
    let other = ldr(height as u32, &wide(1), &wide(2), Viewing::default());
    for i in 0..width * height {
        let turned = other.errors[(i % width) * height + i / width];
        assert!((one.errors[i] - turned).abs() < 1e-6, "pixel {i}");
    }
}

#[test]
fn values_that_are_no_numbers_are_errors_and_nothing_worse() {
    let mut reference = vec![[0.5f32; 3]; 64];
    let mut test = reference.clone();
    test[9] = [f32::NAN, 0.5, 0.5];
    (reference[20], test[20]) = ([f32::NAN; 3], [f32::NAN; 3]);
    (reference[30], test[30]) = ([f32::INFINITY, -1.0, f32::MAX], [f32::INFINITY, -1.0, f32::MAX]);
    let map = hdr(8, &reference, &test, Viewing::default(), exposures(&reference));
    assert_eq!(map.errors[9], 1.0);
    assert!(map.errors.iter().all(|e| (0.0..=1.0).contains(e)), "{:?}", map.errors);
    let map = ldr(8, &reference, &test, Viewing::default());
    assert!(map.errors.iter().all(|e| (0.0..=1.0).contains(e)));
}

#[test]
fn black_and_empty_pictures_have_exposures() {
    let black = vec![[0.0; 3]; 4];
    assert_eq!(exposures(&black), Exposures { start: 0.0, stop: 0.0, count: 1 });
    assert_eq!(exposures(&[]).count, 1);
    let mut lamp = black.clone();
    lamp[2] = [3.0; 3];
    let found = exposures(&lamp);
    assert!(found.start.is_finite() && found.stop.is_finite() && found.count == 2, "{found:?}");
    let mut endless = vec![[1e-30; 3]; 4];
    endless[0] = [f32::INFINITY; 3];
    assert_eq!(exposures(&endless).count, limits::FLIP_EXPOSURES);
    assert_eq!(ldr(5, &[], &[], Viewing::default()).mean(), 0.0);
    assert_eq!(ldr(0, &[], &[], Viewing::default()).errors.len(), 0);
}

#[test]
fn one_pixel_seen_from_afar_is_still_compared() {
    let map = ldr(1, &[[0.0; 3]], &[[1.0; 3]], viewing(1.0));
    assert!((map.errors[0] - 0.967_388).abs() < 1e-4, "{map:?}");
}
