//! Colour spaces and tone curve of FLIP, with the constants of its authors.

/// Coefficients of the ACES curve (Narkowicz), with its exposure of 0.6 taken out: (ax² + bx + c) / (dx² + ex + f).
const ACES: [f64; 6] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];

pub fn aces(x: f64) -> f64 {
    let [a, b, c, d, e, f] = ACES;
    (x * x * a + x * b + c) / (x * x * d + x * e + f)
}

/// The light that the tone curve maps to 0.85.
pub fn almost_white() -> f64 {
    const TARGET: f64 = 0.85;
    let [a, b, c, d, e, f] = ACES;
    let (a, b, c) = (a - TARGET * d, b - TARGET * e, c - TARGET * f);
    let half = -0.5 * b / a;
    half + (half * half - c / a).sqrt()
}

/// Light that can be computed with: what is no number is dark, what is endless is as bright as `f32` can say.
pub fn positive(x: f32) -> f64 {
    if x > 0.0 { f64::from(x.min(f32::MAX)) } else { 0.0 }
}

/// Linear light of an sRGB-encoded value.
pub fn decoded(x: f32) -> f64 {
    let x = if x > 0.0 { f64::from(x.min(1.0)) } else { 0.0 };
    if x <= 0.040_45 { x / 12.92 } else { libm::pow((x + 0.055) / 1.055, 2.4) }
}

/// White of the screen (D65) in XYZ, and its inverse to the digits of the reference.
const WHITE: [f64; 3] = [0.950_428_545, 1.0, 1.088_900_371];
const OVER_WHITE: [f64; 3] = [1.052_156_925, 1.0, 0.918_357_670];

/// CIE XYZ of linear Rec. 709 light, relative to white.
fn relative_xyz([r, g, b]: [f64; 3]) -> [f64; 3] {
    let x = (10_135_552.0 * r + 8_788_810.0 * g + 4_435_075.0 * b) / 24_577_794.0;
    let y = (2_613_072.0 * r + 8_788_810.0 * g + 887_015.0 * b) / 12_288_897.0;
    let z = (1_425_312.0 * r + 8_788_810.0 * g + 70_074_185.0 * b) / 73_733_382.0;
    [x * OVER_WHITE[0], y * OVER_WHITE[1], z * OVER_WHITE[2]]
}

/// YCxCz: linear opponent channels, in which the eye's blur is modelled.
pub fn opponent(rgb: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = relative_xyz(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Linear Rec. 709 light of YCxCz, clamped to what a screen can show.
fn shown([y, cx, cz]: [f64; 3]) -> [f64; 3] {
    let y = (y + 16.0) / 116.0;
    let [x, y, z] = [(y + cx / 500.0) * WHITE[0], y * WHITE[1], (y - cz / 200.0) * WHITE[2]];
    let rgb = [
        3.241_003_275 * x - 1.537_398_934 * y - 0.498_615_861 * z,
        -0.969_224_334 * x + 1.875_930_071 * y + 0.041_554_224 * z,
        0.055_639_423 * x - 0.204_011_202 * y + 1.057_148_933 * z,
    ];
    rgb.map(|c| c.clamp(0.0, 1.0))
}

/// CIELAB of linear Rec. 709 light.
fn lab(rgb: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let root = |t: f64| match t > DELTA * DELTA * DELTA {
        true => libm::cbrt(t),
        false => t / (3.0 * DELTA * DELTA) + 4.0 / 29.0,
    };
    let [x, y, z] = relative_xyz(rgb).map(root);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Colours are less vivid where it is dark (Hunt).
fn hunt([lightness, a, b]: [f64; 3]) -> [f64; 3] {
    [lightness, 0.01 * lightness * a, 0.01 * lightness * b]
}

pub fn perceived(opponent: [f64; 3]) -> [f64; 3] {
    hunt(lab(shown(opponent)))
}

/// The distance of large colour differences: lightness and hue apart (Abasi et al.).
pub fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    let (da, db) = (a[1] - b[1], a[2] - b[2]);
    (a[0] - b[0]).abs() + (da * da + db * db).sqrt()
}

/// The power that makes distances of colours even with what people report.
pub const DISTANCE_POWER: f64 = 0.7;

/// The largest distance of two colours of a screen: of green and blue.
pub fn largest_distance() -> f64 {
    let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|rgb| hunt(lab(rgb)));
    libm::pow(hyab(green, blue), DISTANCE_POWER)
}
