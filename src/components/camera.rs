//! The camera and its lens.

use glam::{DAffine3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::record::ranges::{above, at_least, between, coordinate, position};
use super::record::{Check, Invalid, choice, record};
use super::value::{FieldValue, Mismatch, Text, Value};
use crate::base::math::sin_cos_degrees;

choice! {
    /// Outline of the lens opening, and so of every blurred highlight.
    pub enum Lens {
        /// A disk of radius `aperture`; a regular polygon in it with `blades`.
        Disk,
        /// A square of half side `aperture`.
        Square,
    }
}

choice! {
    /// How the world is laid out in the picture.
    pub enum Projection {
        /// As an eye sees it: what is twice as far is half as large.
        Perspective,
        /// Along parallel rays: what is far is as large as what is near.
        Orthographic,
        /// All directions around the camera, longitude across and latitude up, as environments are stored. `at` is in the
        /// middle; a picture twice as wide as high has square pixels.
        Equirectangular,
    }
}

/// What the lens is focused on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Focus {
    /// The origin of a named entity.
    Entity(Text),
    /// A point in world space.
    Point(DVec3),
}

impl FieldValue for Focus {
    fn to_value(&self) -> Value {
        match self {
            Focus::Entity(name) => Value::Text(name.clone()),
            Focus::Point(p) => Value::Vec3(*p),
        }
    }
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        if let Value::Text(name) = value {
            return Ok(Focus::Entity(name.clone()));
        }
        let point = DVec3::from_value(value).map(Focus::Point);
        point.map_err(|_| Mismatch::new("the name of an entity or a point", value))
    }
}

record! {
    /// A camera with a thin lens (Cook, Porter and Carpenter, SIGGRAPH 1984).
    pub struct Camera {
        /// Position of the lens centre, world space.
        pub from: DVec3 = DVec3::new(0.0, 1.0, 5.0),
        /// The point in the middle of the picture, world space; not the same as `from`.
        pub at: DVec3 = DVec3::ZERO,
        /// Upwards, of any length, not along the view.
        pub up: DVec3 = DVec3::Y,
        /// Vertical field of view in degrees, above 0 and below 180.
        pub fov: f64 = 40.0,
        /// How the world is laid out in the picture.
        pub projection: Projection = Projection::Perspective,
        /// Height of what an orthographic camera sees, world units, above 0; if not given, what the field of view spans at
        /// the distance of `at`, so that what stands there keeps its size from one projection to the other.
        pub height: Option<f64> = None,
        /// Lens shift: how far the picture is moved over what the lens shows, in shares of its width to the right and of
        /// its height up, each from -10 to 10. (0, 0.5) brings what was in the middle to the lower edge; upright lines
        /// stay upright while `at` is level.
        pub shift: DVec2 = DVec2::ZERO,
        /// Distance from the lens to the plane in focus, along the view axis, world units. Wins over `focus`.
        pub focus_distance: Option<f64> = None => Lens,
        /// What to focus on; the distance from `from` to `at` if neither is given.
        pub focus: Option<Focus> = None => Lens,
        /// Lens radius in world units; 0 is a pinhole with everything in focus.
        pub aperture: f64 = 0.0 => Lens,
        /// Outline of the opening.
        pub lens: Lens = Lens::Disk => Lens,
        /// Blades of the iris, 3 to 64: the corners of the opening, and of every blurred highlight; 0 for a round one.
        pub blades: u32 = 0 => Lens,
        /// Degrees that the blades are turned by, counter-clockwise as the picture shows them; at 0 a corner is at the top.
        pub blade_angle: f64 = 0.0 => Lens,
        /// As a photographer says it: focal length in mm, takes the place of `fov`.
        pub focal_length: Option<f64> = None,
        /// Focal length over lens diameter; with `focal_length` takes the place of `aperture`.
        pub f_stop: Option<f64> = None => Lens,
        /// Width of the sensor in mm; with `focal_length` gives the field of view.
        pub sensor_width: f64 = 36.0,
        /// Metres in a world unit: what brings millimetres into the scene.
        pub meters_per_unit: f64 = 1.0 => Lens,
        /// Name of the entity that carries the camera, which looks along its local -z with +y up: takes the place of
        /// `from`, `at` and `up`, and, if it has a `viewpoint`, of `fov`.
        pub entity: Option<Text> = None,
        /// When the shutter opens and closes, in frames from the frame's own time: (0, 0.5) is a shutter of 180 degrees,
        /// (-0.25, 0.25) the same around the frame, (0, 0) an instant. Everything that moves meanwhile is blurred: what a
        /// script animates, since `frame` is called for moments inside the interval too, and entities with `motion`.
        pub shutter: DVec2 = DVec2::ZERO => Shutter,
    }
}

record! {
    /// What a camera that an entity carries sees: see `entity` of the camera.
    pub struct Viewpoint {
        /// Vertical field of view in degrees, above 0 and below 180.
        pub fov: f64 = 40.0,
        /// How the world is laid out in the picture; takes the place of the camera's.
        pub projection: Projection = Projection::Perspective,
        /// Height of what an orthographic camera sees, world units, above 0; the camera's if not given.
        pub height: Option<f64> = None,
    }
}

impl Check for Viewpoint {
    fn check(&self) -> Result<(), Invalid> {
        between("fov", self.fov, 1e-6, 179.999)?;
        self.height.map_or(Ok(()), |height| above("height", height, 0.0))
    }
}

impl Camera {
    /// Half the height of the picture at distance 1, for a picture of the given width / height.
    pub fn half_height(&self, aspect: f64) -> f64 {
        match self.focal_length {
            Some(mm) => self.sensor_width / (2.0 * mm) / aspect,
            None => {
                let (sin, cos) = sin_cos_degrees(self.fov / 2.0);
                sin / cos
            }
        }
    }

    /// Half the height of what an orthographic camera sees, world units.
    pub fn half_extent(&self, aspect: f64) -> f64 {
        match self.height {
            Some(height) => height / 2.0,
            None => self.half_height(aspect) * self.from.distance(self.at),
        }
    }

    /// Lens radius in world units.
    pub fn lens_radius(&self) -> f64 {
        match (self.focal_length, self.f_stop) {
            (Some(mm), Some(stop)) => mm / 1000.0 / (2.0 * stop) / self.meters_per_unit,
            (None, _) | (_, None) => self.aperture,
        }
    }

    /// The camera where an entity carries it: `map` leads from the entity's local space to the world.
    pub fn carried(self, map: &DAffine3, viewpoint: Option<&Viewpoint>) -> Camera {
        let (ahead, up) = ((-map.matrix3.z_axis).normalize_or_zero(), map.matrix3.y_axis.normalize_or_zero());
        let focal_length = self.focal_length.filter(|_| viewpoint.is_none());
        let from = map.translation;
        let at = from + ahead * self.from.distance(self.at);
        let f_stop = self.f_stop.filter(|_| focal_length.is_some());
        let aperture = self.lens_radius();
        let placed = Camera { from, at, up, focal_length, f_stop, aperture, ..self };
        match viewpoint.cloned() {
            Some(Viewpoint { fov, projection, height }) => {
                Camera { fov, projection, height: height.or(placed.height), ..placed }
            }
            None => placed,
        }
    }

    /// Unit vector from the camera into the picture.
    pub fn axis(&self) -> DVec3 {
        (self.at - self.from).normalize_or(DVec3::NEG_Z)
    }
}

impl Check for Camera {
    fn check(&self) -> Result<(), Invalid> {
        position("from", self.from)?;
        position("at", self.at)?;
        position("up", self.up)?;
        let fail = |field, message: &str| Err(Invalid { field, message: message.into() });
        if self.from == self.at {
            return fail("at", "`at` must not be the same point as `from`");
        }
        if self.up.cross(self.at - self.from).normalize_or_zero() == DVec3::ZERO {
            return fail("up", "`up` must not be zero or along the view from `from` to `at`");
        }
        between("fov", self.fov, 1e-6, 179.999)?;
        at_least("aperture", self.aperture, 0.0)?;
        if let Some(distance) = self.focus_distance {
            above("focus_distance", distance, 0.0)?;
        }
        if let Some(Focus::Point(p)) = self.focus {
            position("focus", p)?;
        }
        if let Some(mm) = self.focal_length {
            above("focal_length", mm, 0.0)?;
        }
        if let Some(stop) = self.f_stop {
            above("f_stop", stop, 0.0)?;
            if self.focal_length.is_none() {
                return fail("f_stop", "`f_stop` needs `focal_length`: the lens is focal_length / f_stop wide");
            }
        }
        above("sensor_width", self.sensor_width, 0.0)?;
        above("meters_per_unit", self.meters_per_unit, 0.0)?;
        if let Some(height) = self.height {
            above("height", height, 0.0)?;
        }
        between("shift", self.shift.x, -10.0, 10.0)?;
        between("shift", self.shift.y, -10.0, 10.0)?;
        coordinate("blade_angle", self.blade_angle)?;
        match (self.blades, self.lens) {
            (0, _) | (3..=64, Lens::Disk) => {}
            (3..=64, Lens::Square) => return fail("blades", "`blades` shape a lens that is a `Disk`, not a `Square`"),
            (other, _) => {
                let message = format!("`blades` must be 0 for a round opening, or from 3 to 64, not {other}");
                return Err(Invalid { field: "blades", message });
            }
        }
        if self.projection == Projection::Equirectangular {
            if self.shift != DVec2::ZERO {
                return fail("shift", "`shift` has no meaning for an `Equirectangular` camera, which sees all around");
            }
            if self.lens_radius() > 0.0 {
                let field = if self.f_stop.is_some() && self.focal_length.is_some() { "f_stop" } else { "aperture" };
                let message = format!("an `Equirectangular` camera has no lens: `{field}` must not be given");
                return Err(Invalid { field, message });
            }
        }
        coordinate("shutter", self.shutter.x)?;
        coordinate("shutter", self.shutter.y)?;
        if self.shutter.y < self.shutter.x {
            return fail("shutter", "`shutter` must not close before it opens");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_photographers_lens_has_its_known_numbers() {
        // 50 mm on full frame sees 39.6 degrees across; at f/2 the opening is 25 mm wide.
        let camera = Camera { focal_length: Some(50.0), f_stop: Some(2.0), ..Camera::default() };
        assert!((camera.half_height(1.0) - 0.36).abs() < 1e-12);
        assert!((camera.lens_radius() - 0.0125).abs() < 1e-12);
        assert!((Camera { fov: 90.0, ..Camera::default() }.half_height(2.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn impossible_cameras_are_named() {
        let field = |camera: Camera| camera.check().unwrap_err().field;
        let good = Camera::default;
        assert_eq!(field(Camera { at: good().from, ..good() }), "at");
        assert_eq!(field(Camera { up: good().at - good().from, ..good() }), "up");
        assert_eq!(field(Camera { fov: f64::NAN, ..good() }), "fov");
        assert_eq!(field(Camera { f_stop: Some(2.8), ..good() }), "f_stop");
        assert_eq!(field(Camera { shutter: DVec2::new(0.5, 0.0), ..good() }), "shutter");
        assert_eq!(field(Camera { height: Some(0.0), ..good() }), "height");
        assert_eq!(field(Camera { blades: 2, ..good() }), "blades");
        assert_eq!(field(Camera { blades: 6, lens: Lens::Square, ..good() }), "blades");
        let around = || Camera { projection: Projection::Equirectangular, ..good() };
        assert_eq!(field(Camera { aperture: 0.1, ..around() }), "aperture");
        assert_eq!(field(Camera { focal_length: Some(35.0), f_stop: Some(2.0), ..around() }), "f_stop");
        assert_eq!(field(Camera { shift: DVec2::Y, ..around() }), "shift");
        assert!(around().check().is_ok());
        assert!(good().check().is_ok());
    }
}
