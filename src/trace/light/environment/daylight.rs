//! The sky of a clear day and the sun in it, from the light that air and haze scatter once.
//!
//! The model of Nishita, Sirai, Tadamura and Nakamae (SIGGRAPH 1993) with an ozone layer: sunlight is dimmed on its way
//! down, scattered once by air (Rayleigh) and haze (Mie, by the phase function of Cornette and Shanks), and dimmed on its
//! way to the eye. It takes no tables, holds for a sun below the horizon, and reddens by itself; a fit to measured skies
//! as Hosek's and Wilkie's is brighter near the horizon, for there light is scattered more than once.
//!
//! The sky is worked out in rows of equal steps of height above the horizon and drawn into a picture of the whole sphere,
//! the sun with it, by the share of each texel that its disk covers. So it is sampled, mirrored and rotated as any
//! environment.

use glam::DVec3;

use crate::components::{MipMap, Texels};

/// Size of the picture: texels of a third of a degree, two across the sun.
const WIDTH: u32 = 1024;
const HEIGHT: u32 = 512;
/// Directions that the sky is worked out for: azimuths from the sun to its opposite, and heights.
const AZIMUTHS: usize = 48;
const HEIGHTS: usize = 48;

/// Metres: radii of the ground and of the top of the air, and what density falls to 1/e in, of air and of haze.
const GROUND: f64 = 6_360e3;
const TOP: f64 = 6_420e3;
const AIR_SCALE: f64 = 8_000.0;
const HAZE_SCALE: f64 = 1_200.0;
/// Per metre at sea level, at 680, 550 and 440 nm.
const AIR: DVec3 = DVec3::new(5.802e-6, 13.558e-6, 33.1e-6);
/// Absorption of ozone where it is densest, at 25 km; it thins out linearly 15 km above and below.
const OZONE: DVec3 = DVec3::new(0.650e-6, 1.881e-6, 0.085e-6);
/// How far forward haze scatters.
const FORWARD: f64 = 0.76;
/// Share of light that haze absorbs of what it takes away.
const HAZE_LOSS: f64 = 0.1;
/// Steps along a ray of sight, and from each to the sun.
const STEPS: u32 = 24;
const SUN_STEPS: u32 = 8;
/// Irradiance of the sun above the air: so much that a white surface straight below a high sun has a radiance of about 1.
const SUN_IRRADIANCE: f64 = 1.2 * std::f64::consts::PI;
/// Share of light that the ground sends back.
const GROUND_ALBEDO: f64 = 0.25;

/// Air with haze in it, and where the sun stands.
struct Atmosphere {
    /// Unit, towards the sun.
    sun: DVec3,
    /// Scattering of haze at sea level, per metre.
    haze: f64,
}

/// The picture of the sphere (as `EnvironmentMap::Sphere` has it) under a sun in this direction, of any length, with an
/// angular diameter in degrees. `turbidity` is what air and haze take from a beam over what air alone takes, 1 and up.
pub fn daylight_map(sun: DVec3, turbidity: f64, diameter: f64) -> MipMap {
    let sun = sun.normalize_or(DVec3::Y);
    // Optical depth at 550 nm straight up.
    let of_air = AIR.y * AIR_SCALE;
    let atmosphere = Atmosphere { sun, haze: (turbidity - 1.0) * of_air / HAZE_SCALE };
    let sky = atmosphere.table();
    let beam = atmosphere.transmittance(0.0, sun) * SUN_IRRADIANCE;
    let ground = (beam * sun.y.max(0.0) + irradiance(&sky)) * (GROUND_ALBEDO / std::f64::consts::PI);
    let direction = |x: f64, y: f64| {
        let (sin, cos) = libm::sincos((x / f64::from(WIDTH) - 0.5) * std::f64::consts::TAU);
        let (height, across) = libm::sincos((0.5 - y / f64::from(HEIGHT)) * std::f64::consts::PI);
        DVec3::new(across * sin, height, -across * cos)
    };
    let mut texels = Vec::with_capacity((WIDTH * HEIGHT) as usize);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let d = direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
            texels.push(if d.y > 0.0 { atmosphere.look_up(&sky, d) } else { ground });
        }
    }
    add_sun(&mut texels, sun, beam, diameter, direction);
    MipMap::new(WIDTH, HEIGHT, Texels::Floats(texels.into_iter().map(|c| c.as_vec3().to_array()).collect()))
}

/// Adds the disk of the sun: its irradiance is exact, whatever the texels make of its rim.
fn add_sun(texels: &mut [DVec3], sun: DVec3, beam: DVec3, diameter: f64, direction: impl Fn(f64, f64) -> DVec3) {
    const LOOKS: u32 = 4;
    let radius = (0.5 * diameter).max(0.3).to_radians();
    let border = libm::cos(radius);
    let mut covered = Vec::new();
    let mut whole = 0.0;
    for y in 0..HEIGHT {
        // Rows far from the sun hold nothing of it.
        let row = direction(0.0, f64::from(y) + 0.5).y;
        if (libm::asin(row) - libm::asin(sun.y.clamp(-1.0, 1.0))).abs() > radius + 0.01 {
            continue;
        }
        let angle = std::f64::consts::TAU / f64::from(WIDTH) * std::f64::consts::PI / f64::from(HEIGHT);
        let angle = angle * (1.0 - row * row).max(0.0).sqrt();
        for x in 0..WIDTH {
            let inside = (0..LOOKS * LOOKS).filter(|i| {
                let at = |k: u32| (f64::from(k) + 0.5) / f64::from(LOOKS);
                direction(f64::from(x) + at(i % LOOKS), f64::from(y) + at(i / LOOKS)).dot(sun) >= border
            });
            let share = inside.count() as f64 / f64::from(LOOKS * LOOKS);
            if share > 0.0 {
                covered.push(((y * WIDTH + x) as usize, share));
                whole += share * angle;
            }
        }
    }
    for (texel, share) in covered {
        texels[texel] += beam * (share / whole);
    }
}

/// Irradiance of a horizontal surface by the sky alone, from its table.
fn irradiance(sky: &[DVec3]) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for (i, radiance) in sky.iter().enumerate() {
        let (low, high) = (height_of((i / AZIMUTHS) as f64 - 0.5), height_of((i / AZIMUTHS) as f64 + 0.5));
        // Solid angle by the cosine to the vertical.
        let share = 0.5 * (high * high - low * low);
        sum += *radiance * (share * std::f64::consts::TAU / AZIMUTHS as f64);
    }
    sum
}

/// Height of a row of the table: close rows near the horizon, where the sky changes most.
fn height_of(row: f64) -> f64 {
    let share = (row / (HEIGHTS - 1) as f64).clamp(0.0, 1.0);
    share * share
}

impl Atmosphere {
    /// Radiance of the sky by height and azimuth from the sun.
    fn table(&self) -> Vec<DVec3> {
        let level = DVec3::new(self.sun.x, 0.0, self.sun.z).normalize_or(DVec3::X);
        let aside = DVec3::new(-level.z, 0.0, level.x);
        let mut sky = Vec::with_capacity(HEIGHTS * AZIMUTHS);
        for row in 0..HEIGHTS {
            let y = height_of(row as f64).max(1e-4);
            let across = (1.0 - y * y).max(0.0).sqrt();
            for column in 0..AZIMUTHS {
                let (sin, cos) = libm::sincos(std::f64::consts::PI * column as f64 / (AZIMUTHS - 1) as f64);
                sky.push(self.radiance((level * cos + aside * sin) * across + DVec3::Y * y));
            }
        }
        sky
    }

    /// The table between its entries; `d` is above the horizon.
    fn look_up(&self, sky: &[DVec3], d: DVec3) -> DVec3 {
        let (a, b) = (DVec3::new(d.x, 0.0, d.z), DVec3::new(self.sun.x, 0.0, self.sun.z));
        let azimuth = libm::atan2(a.cross(b).length(), a.dot(b)) / std::f64::consts::PI;
        let at = |x: f64, count: usize| {
            let x = x.clamp(0.0, 1.0) * (count - 1) as f64;
            let cell = (x as usize).min(count - 2);
            (cell, x - cell as f64)
        };
        let ((row, up), (column, along)) = (at(d.y.max(0.0).sqrt(), HEIGHTS), at(azimuth, AZIMUTHS));
        let entry = |row: usize, column: usize| sky[row * AZIMUTHS + column];
        let low = entry(row, column).lerp(entry(row, column + 1), along);
        low.lerp(entry(row + 1, column).lerp(entry(row + 1, column + 1), along), up)
    }

    /// Light that is scattered once towards an observer on the ground.
    fn radiance(&self, d: DVec3) -> DVec3 {
        let cosine = d.dot(self.sun);
        let of_air = 3.0 / (16.0 * std::f64::consts::PI) * (1.0 + cosine * cosine);
        let g2 = FORWARD * FORWARD;
        let spread = 1.0 + g2 - 2.0 * FORWARD * cosine;
        let of_haze = 3.0 / (8.0 * std::f64::consts::PI) * (1.0 - g2) * (1.0 + cosine * cosine)
            / ((2.0 + g2) * spread * spread.sqrt());
        let from = DVec3::Y * (GROUND + 1.0);
        let length = distance_to_sphere(from, d, TOP);
        let (mut depth, mut sum) = (DVec3::ZERO, DVec3::ZERO);
        for (at, step) in stations(length, STEPS) {
            let p = from + d * at;
            let height = p.length() - GROUND;
            depth += self.extinction(height) * (0.5 * step);
            let (air, haze) = (libm::exp(-height / AIR_SCALE), libm::exp(-height / HAZE_SCALE));
            let scattered = AIR * (air * of_air) + DVec3::splat(self.haze * haze * of_haze);
            sum += scattered * self.transmittance(height, self.turned_sun(p)) * exponential(-depth) * step;
            depth += self.extinction(height) * (0.5 * step);
        }
        sum * SUN_IRRADIANCE
    }

    /// Direction to the sun as seen at a point, where up is y.
    fn turned_sun(&self, p: DVec3) -> DVec3 {
        let y = p.normalize().dot(self.sun);
        DVec3::new((1.0 - y * y).max(0.0).sqrt(), y, 0.0)
    }

    /// Share of sunlight that gets down to a height above the ground, from a direction; none through the ground.
    fn transmittance(&self, height: f64, d: DVec3) -> DVec3 {
        let from = DVec3::Y * (GROUND + height.max(1.0));
        let nearest = from - d * from.dot(d);
        if d.y < 0.0 && nearest.length() < GROUND {
            return DVec3::ZERO;
        }
        let length = distance_to_sphere(from, d, TOP);
        let mut depth = DVec3::ZERO;
        for (at, step) in stations(length, SUN_STEPS) {
            depth += self.extinction((from + d * at).length() - GROUND) * step;
        }
        exponential(-depth)
    }

    /// What air, haze and ozone take from light, per metre.
    fn extinction(&self, height: f64) -> DVec3 {
        let (air, haze) = (libm::exp(-height / AIR_SCALE), libm::exp(-height / HAZE_SCALE));
        let ozone = (1.0 - (height - 25e3).abs() / 15e3).max(0.0);
        AIR * air + DVec3::splat(self.haze * haze * (1.0 + HAZE_LOSS)) + OZONE * ozone
    }
}

/// Middles and lengths of steps along a way: short ones first, for the air is densest at the ground.
fn stations(length: f64, steps: u32) -> impl Iterator<Item = (f64, f64)> {
    let end = move |i: u32| {
        let share = f64::from(i) / f64::from(steps);
        length * share * share
    };
    (0..steps).map(move |i| (0.5 * (end(i) + end(i + 1)), end(i + 1) - end(i)))
}

/// How far it is from inside a sphere around the origin to it.
fn distance_to_sphere(from: DVec3, d: DVec3, radius: f64) -> f64 {
    let b = from.dot(d);
    (b * b - from.length_squared() + radius * radius).max(0.0).sqrt() - b
}

fn exponential(v: DVec3) -> DVec3 {
    DVec3::new(libm::exp(v.x), libm::exp(v.y), libm::exp(v.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sky_at(elevation: f64, turbidity: f64) -> Atmosphere {
        let (sin, cos) = libm::sincos(elevation.to_radians());
        Atmosphere { sun: DVec3::new(cos, sin, 0.0), haze: (turbidity - 1.0) * AIR.y * AIR_SCALE / HAZE_SCALE }
    }

    #[test]
    fn a_beam_straight_down_is_dimmed_by_the_optical_depth_of_air() {
        let found = sky_at(90.0, 1.0).transmittance(0.0, DVec3::Y);
        for (found, air, ozone) in [(found.x, AIR.x, OZONE.x), (found.y, AIR.y, OZONE.y), (found.z, AIR.z, OZONE.z)] {
            // Of an exponential and of a tent 30 km wide.
            let expected = libm::exp(-(air * AIR_SCALE + ozone * 15e3));
            assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
        }
        let hazy = sky_at(90.0, 3.0).transmittance(0.0, DVec3::Y);
        assert!(hazy.y < found.y && sky_at(-3.0, 2.0).transmittance(0.0, sky_at(-3.0, 2.0).sun) == DVec3::ZERO);
    }

    #[test]
    fn a_clear_sky_is_blue_and_a_low_sun_is_red() {
        let noon = sky_at(60.0, 2.0).radiance(DVec3::new(-0.3, 0.9, 0.3).normalize());
        assert!(noon.z > 1.5 * noon.y && noon.y > 1.2 * noon.x, "{noon}");
        let evening = sky_at(3.0, 2.0);
        let beam = evening.transmittance(0.0, evening.sun);
        assert!(beam.x > 3.0 * beam.z, "{beam}");
        let near = evening.radiance(DVec3::new(0.99, 0.1, 0.1).normalize());
        let far = evening.radiance(DVec3::new(-0.99, 0.1, 0.1).normalize());
        assert!(near.x > near.z && near.element_sum() > far.element_sum(), "{near} {far}");
    }

    #[test]
    fn the_sun_brings_its_irradiance_whatever_its_size() {
        let light = |diameter: f64| {
            let map = daylight_map(DVec3::new(0.3, 0.8, -0.2), 2.0, diameter);
            let mut sum = 0.0;
            for y in 0..HEIGHT / 2 {
                let height = libm::sin((0.5 - (f64::from(y) + 0.5) / f64::from(HEIGHT)) * std::f64::consts::PI);
                let angle = std::f64::consts::TAU / f64::from(WIDTH) * std::f64::consts::PI / f64::from(HEIGHT);
                let angle = angle * (1.0 - height * height).sqrt();
                sum += (0..WIDTH).map(|x| f64::from(map.levels[0].texel(x, y).y)).sum::<f64>() * angle * height;
            }
            sum / std::f64::consts::PI
        };
        let (sharp, wide) = (light(0.545), light(6.0));
        // A white surface on the ground has a radiance of about 1.
        assert!((sharp / wide - 1.0).abs() < 0.02 && sharp > 0.7 && sharp < 1.4, "{sharp} {wide}");
    }
}
