//! Bump and normal maps: what they do to the shading normal, and how far a bent normal may be believed.

use glam::{Vec2, Vec3};

use crate::trace::material::reflect;
use crate::trace::primitive::SurfacePoint;

/// The normal of a surface displaced along `normal` by a height with this gradient along the surface (Blinn, SIGGRAPH
/// 1978, as surface gradients: Mikkelsen, 2010).
pub fn displaced(normal: Vec3, gradient: Vec3) -> Vec3 {
    let along = gradient - normal * normal.dot(gradient);
    (normal - along).normalize_or(normal)
}

/// The normal that a texel of a normal map stands for. Its x runs the way that u grows along the surface, y likewise
/// for v but square to x, z along the shading normal; `gradients` are those of u and v.
pub fn mapped(normal: Vec3, texel: Vec3, depth: f32, [gu, gv]: [Vec3; 2]) -> Vec3 {
    let turned = normal.dot(gu.cross(gv));
    let tangent = gv.cross(normal) * turned.signum();
    let Some(tangent) = (tangent - normal * normal.dot(tangent)).try_normalize() else { return normal };
    let bitangent = normal.cross(tangent) * turned.signum();
    let slope = Vec2::new(2.0 * texel.x - 1.0, 2.0 * texel.y - 1.0) * depth;
    let height = (2.0 * texel.z - 1.0).max(1e-3);
    (tangent * slope.x + bitangent * slope.y + normal * height).normalize_or(normal)
}

/// How far mirror rays stay above the surface, as a cosine.
const CLEARANCE: f32 = 0.02;

impl SurfacePoint {
    /// Turns the shading normal to `normal`, or as far towards it as a viewer can see: the mirror ray of `direction`
    /// must leave the surface (Keller et al., The Iray Light Transport Simulation and Rendering System, 2017).
    ///
    /// Normals may face either side of the surface; both are kept on the geometric normal's side.
    pub fn perturb_normal(&mut self, normal: Vec3, direction: Vec3) {
        let side = if direction.dot(self.geometric_normal) > 0.0 { -1.0 } else { 1.0 };
        let (out, bent) = (self.geometric_normal * side, normal * side);
        let facing = -direction.dot(out);
        let mirrored = reflect(direction, bent);
        let least = (0.9 * facing).min(CLEARANCE);
        let short = least - mirrored.dot(out);
        let good = short <= 0.0 && direction.dot(bent) < 0.0 && bent.dot(out) > 0.0;
        let bent = if good {
            bent
        } else {
            let lifted = (mirrored + out * short.max(0.0)).normalize_or(out);
            (lifted - direction).normalize_or(out)
        };
        self.shading_normal = bent * side;
        self.bent = true;
    }

    /// Factor of the light from `direction` where a map has bent the normal: it fades out where the surface itself
    /// turns away, in place of a hard edge (Chiang, Li and Burley, Taming the Shadow Terminator, SIGGRAPH Talks 2019).
    #[inline]
    pub fn terminator(&self, direction: Vec3) -> f32 {
        if !self.bent {
            return 1.0;
        }
        let (out, normal) = (self.geometric_normal, self.shading_normal);
        let (lit, shown) = (out.dot(direction), normal.dot(direction));
        if (lit > 0.0) != (shown > 0.0) {
            return 0.0;
        }
        if lit <= 0.0 {
            // Light that comes through from behind has no terminator.
            return 1.0;
        }
        let g = (lit / (shown * out.dot(normal))).min(1.0);
        if g < 1.0 { g * (1.0 + g - g * g) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn unit() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-1.0f32..1.0).prop_map(|v| Vec3::from_array(v).normalize_or(Vec3::Y))
    }

    proptest! {
        /// Whatever a map says and wherever the viewer stands: the normal faces both, and mirrors leave the surface.
        #[test]
        fn bent_normals_face_the_viewer_and_mirrors_leave(out in unit(), normal in unit(), direction in unit()) {
            prop_assume!(direction.dot(out).abs() > 1e-4);
            let mut surface = SurfacePoint { geometric_normal: out, shading_normal: out, ..SurfacePoint::default() };
            let normal = if normal.dot(out) < 0.0 { -normal } else { normal };
            surface.perturb_normal(normal, direction);
            let side = if direction.dot(out) > 0.0 { -1.0 } else { 1.0 };
            let (n, g) = (surface.shading_normal * side, out * side);
            prop_assert!((n.length() - 1.0).abs() < 1e-5);
            prop_assert!(n.dot(direction) < 0.0 && n.dot(g) > 0.0);
            prop_assert!(reflect(direction, n).dot(g) > -1e-5);
        }

        #[test]
        fn the_terminator_is_a_smooth_share(out in unit(), normal in unit(), light in unit()) {
            prop_assume!(out.dot(normal) > 0.0);
            let surface = SurfacePoint { geometric_normal: out, shading_normal: normal, bent: true, ..SurfacePoint::default() };
            let share = surface.terminator(light);
            prop_assert!((0.0..=1.0 + 1e-6).contains(&share));
            let plain = SurfacePoint { bent: false, ..surface };
            prop_assert_eq!(plain.terminator(light), 1.0);
        }
    }

    #[test]
    fn a_good_normal_is_taken_as_it_is() {
        let mut surface =
            SurfacePoint { geometric_normal: Vec3::Y, shading_normal: Vec3::Y, ..SurfacePoint::default() };
        let normal = Vec3::new(0.2, 1.0, 0.1).normalize();
        surface.perturb_normal(normal, Vec3::new(0.1, -1.0, 0.0).normalize());
        assert_eq!(surface.shading_normal, normal);
        // From behind it is the other side of the same shape.
        surface.perturb_normal(normal, Vec3::new(0.1, 1.0, 0.0).normalize());
        assert_eq!(surface.shading_normal, normal);
    }

    #[test]
    fn maps_tilt_the_way_they_say() {
        // A height that grows along x tilts the normal back.
        assert!(displaced(Vec3::Y, Vec3::X * 0.5).x < 0.0);
        let flat = Vec3::new(0.5, 0.5, 1.0);
        let gradients = [Vec3::X, Vec3::NEG_Z];
        assert_eq!(mapped(Vec3::Y, flat, 1.0, gradients), Vec3::Y);
        let right = mapped(Vec3::Y, Vec3::new(0.8, 0.5, 0.9), 1.0, gradients);
        let up = mapped(Vec3::Y, Vec3::new(0.5, 0.8, 0.9), 1.0, gradients);
        assert!(right.x > 0.3 && right.z.abs() < 1e-6 && up.z < -0.3 && up.x.abs() < 1e-6, "{right} {up}");
        // Mirrored texture coordinates: x still runs with u, y with v.
        let mirrored = mapped(Vec3::Y, Vec3::new(0.8, 0.8, 0.9), 1.0, [Vec3::NEG_X, Vec3::NEG_Z]);
        assert!(mirrored.x < 0.0 && mirrored.z < 0.0, "{mirrored}");
        assert_eq!(mapped(Vec3::Y, Vec3::ZERO, 1.0, [Vec3::ZERO; 2]), Vec3::Y);
    }
}
