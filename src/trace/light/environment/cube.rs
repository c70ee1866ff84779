//! A cube map in the P3D course's arrangement.
//!
//! +x shows the left face and -x the right one, +y top, -y bottom, +z front, -z back; t runs up from the bottom row.

use glam::Vec3;

/// Names of the faces in their order.
pub const FACES: [&str; 6] = ["right", "left", "top", "bottom", "front", "back"];

/// One face; texels are RGB, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Texels of a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Linear red, green and blue, row by row from the top.
    pub texels: Vec<[f32; 3]>,
}

/// Six faces in the order of [`FACES`].
#[derive(Clone, Debug, PartialEq)]
pub struct CubeMap {
    /// Right, left, top, bottom, front and back.
    pub faces: [Face; 6],
}

impl CubeMap {
    /// The colour in a direction, bilinear within its face.
    pub fn lookup(&self, d: Vec3) -> Vec3 {
        let a = d.abs();
        let (face, s, t, along) = if a.x >= a.y && a.x >= a.z {
            if d.x > 0.0 { (1, d.z, d.y, a.x) } else { (0, -d.z, d.y, a.x) }
        } else if a.y >= a.z {
            if d.y > 0.0 { (2, -d.x, -d.z, a.y) } else { (3, -d.x, d.z, a.y) }
        } else if d.z > 0.0 {
            (4, -d.x, d.y, a.z)
        } else {
            (5, d.x, d.y, a.z)
        };
        self.faces[face].bilinear((s / along + 1.0) / 2.0, (t / along + 1.0) / 2.0)
    }
}

impl Face {
    /// `s` from the left, `t` from the bottom, both in 0..1.
    fn bilinear(&self, s: f32, t: f32) -> Vec3 {
        let x = (s * self.width as f32 - 0.5).clamp(0.0, (self.width - 1) as f32);
        let y = ((1.0 - t) * self.height as f32 - 0.5).clamp(0.0, (self.height - 1) as f32);
        let texel = |x: u32, y: u32| {
            let (x, y) = (x.min(self.width - 1), y.min(self.height - 1));
            Vec3::from_array(self.texels[(y * self.width + x) as usize])
        };
        let (x0, y0) = (x as u32, y as u32);
        let (fx, fy) = (x - x0 as f32, y - y0 as f32);
        let top = texel(x0, y0) * (1.0 - fx) + texel(x0 + 1, y0) * fx;
        let bottom = texel(x0, y0 + 1) * (1.0 - fx) + texel(x0 + 1, y0 + 1) * fx;
        top * (1.0 - fy) + bottom * fy
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A face whose red runs with s and whose green runs with t.
    fn ramp(blue: f32) -> Face {
        let texel = |i: u32| [(i % 64) as f32 / 63.0, 1.0 - (i / 64) as f32 / 63.0, blue];
        Face { width: 64, height: 64, texels: (0..64 * 64).map(texel).collect() }
    }

    #[test]
    fn directions_meet_the_faces_that_the_course_gives_them() {
        let sky = CubeMap { faces: std::array::from_fn(|i| ramp(i as f32)) };
        for (direction, face) in
            [(Vec3::NEG_X, 0), (Vec3::X, 1), (Vec3::Y, 2), (Vec3::NEG_Y, 3), (Vec3::Z, 4), (Vec3::NEG_Z, 5)]
        {
            assert_eq!(sky.lookup(direction).z, face as f32);
        }
        // Front: s grows to -x, t to +y.
        let corner = sky.lookup(Vec3::new(-0.9, 0.8, 1.0));
        assert!((corner.x - 0.95).abs() < 0.02 && (corner.y - 0.9).abs() < 0.02, "{corner}");
        let left = sky.lookup(Vec3::new(1.0, 0.0, 0.9));
        assert!((left.x - 0.95).abs() < 0.02, "{left}");
    }
}
