//! `v`: the camera, in all its dialects.
//!
//! A P3F lens is given in ratios: its radius in pixels of the view plane, its focal distance in distances from the eye to
//! the point looked at. Both become world units here, by the resolution that the file states.

use glam::{DVec2, DVec3};

use super::NffReader;
use super::lexer::Word;
use crate::base::limits;
use crate::base::math::sin_cos_degrees;
use crate::components::{Camera, Check};

const KEYS: [&str; 18] = [
    "from",
    "at",
    "up",
    "angle",
    "hither",
    "resolution",
    "aperture",
    "focal",
    "time0",
    "time1",
    "timeOpen",
    "timeClose",
    "lensRadius",
    "apperture",
    "focalp",
    "viewp",
    "view",
    "upp",
];

/// Lens and shutter as the file says them.
#[derive(Default)]
struct Optics {
    /// P3F: radius in pixels.
    aperture: Option<f64>,
    /// World units.
    radius: Option<f64>,
    /// P3F: in distances from eye to target; a distance where `apperture` goes with it.
    focal: Option<f64>,
    distance: Option<f64>,
    shutter: DVec2,
}

impl NffReader<'_> {
    pub fn camera(&mut self, word: Word) {
        let mut camera = Camera { from: DVec3::ZERO, at: DVec3::NEG_Z, fov: 45.0, ..Camera::default() };
        let mut optics = Optics::default();
        while let Some(key) = self.lexer.peek() {
            let known = KEYS.contains(&key.text);
            // A misspelt key has the numbers of one behind it; a record would be known.
            if !known && (super::KEYWORDS.contains(&key.text) || !self.is_stray_key(key)) {
                break;
            }
            self.lexer.next();
            self.read_numbers();
            self.camera_key(key, &mut camera, &mut optics);
        }
        let height = f64::from(self.scene.render.size[1]);
        let distance = camera.from.distance(camera.at);
        let (sin, cos) = sin_cos_degrees(camera.fov / 2.0);
        let pixel = 2.0 * distance * (sin / cos) / height;
        self.p3f |= optics.aperture.is_some();
        camera.aperture = optics.radius.or(optics.aperture.map(|a| a * pixel)).unwrap_or(0.0);
        camera.focus_distance = optics.distance.or(optics.focal.map(|f| f * distance)).filter(|d| *d > 0.0);
        // A file that states only when the shutter opens means an instant.
        camera.shutter = DVec2::new(optics.shutter.x, optics.shutter.y.max(optics.shutter.x));
        match camera.check() {
            Ok(()) => {
                self.scene.camera = camera;
                self.has_camera = true;
            }
            Err(invalid) => self.error(word, format!("camera: {}", invalid.message)),
        }
    }

    /// Whether an unknown word inside `v` is a key with numbers, and not the start of something else.
    fn is_stray_key(&self, key: Word) -> bool {
        let rest = &self.lexer.text[key.start + key.text.len()..];
        !key.is_number()
            && key.text.chars().all(char::is_alphabetic)
            && key.text.len() > 1
            && rest.split_whitespace().next().is_some_and(|next| next.parse::<f64>().is_ok())
            && !self.has_camera
            && self.scene.entities.is_empty()
    }

    fn camera_key(&mut self, key: Word, camera: &mut Camera, optics: &mut Optics) {
        let n = self.numbers.clone();
        let wanted = match key.text {
            "from" | "at" | "up" | "upp" => 3,
            "resolution" => 2,
            _ => 1,
        };
        if n.len() < wanted {
            return self.warn(key, format!("`{}` needs {wanted} numbers and has {}; skipped", key.text, n.len()));
        }
        let vector = || DVec3::new(n[0], n[1], n[2]);
        match key.text {
            "from" => camera.from = vector(),
            "at" => camera.at = vector(),
            "up" => camera.up = vector(),
            "upp" => {
                self.warn(key, "`upp` is read as `up`");
                camera.up = vector();
            }
            "angle" => camera.fov = n[0],
            "resolution" => {
                self.scene.render.size = [n[0], n[1]].map(|s| (s as u32).clamp(1, limits::FRAME_SIDE));
            }
            "aperture" => optics.aperture = Some(n[0]),
            "focal" => optics.focal = Some(n[0]),
            "lensRadius" => optics.radius = Some(n[0]),
            "apperture" => {
                // In this dialect `focal` is a distance; a lens radius before it is scaled by it.
                optics.radius = Some(optics.radius.unwrap_or(1.0) * n[0]);
                optics.distance = optics.distance.or(optics.focal);
            }
            "focalp" => optics.distance = Some(n[0]),
            "time0" | "timeOpen" => optics.shutter.x = n[0],
            "time1" | "timeClose" => optics.shutter.y = n[0],
            "hither" | "viewp" | "view" => {}
            other => self.warn(key, format!("unknown key `{other}` of the camera; skipped")),
        }
    }
}
