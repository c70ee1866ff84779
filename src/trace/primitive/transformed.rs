//! Shapes with an inside under any affine map, tested in their own space.

use glam::{DAffine3, Vec3};

use super::aabox::{BoxPrim, cube};
use super::affine::AffineMap;
use super::area::NoArea;
use super::bounds::Bounds;
use super::closest_hit::ClosestHit;
use super::column::PrimitiveShape;
use super::cone::{ConeFrustum, offer_within, tube};
use super::prepared_ray::PreparedRay;
use super::sphere::{SpherePrim, globe};
use super::surface::BarePoint;
use super::tag::Sides;
use super::uv::{SurfaceUv, UvPoint};
use crate::trace::soa::{Hit, Ray};

/// What a shape with an inside provides in its own space.
pub trait Solid {
    /// Bounds in that space.
    fn local_bounds(&self) -> Bounds;
    /// Calls with every crossing at a distance above 0: distance, whether the ray enters, and a code that becomes `v` of
    /// the hit.
    fn crossings(&self, ray: &PreparedRay, found: &mut dyn FnMut(f32, bool, f32));
    /// The point next to another, where a crossing had this code.
    fn locate(&self, near: Vec3, code: f32) -> BarePoint;
    /// Texture coordinates there; `normal` is unit, outwards.
    fn local_uv(&self, point: Vec3, normal: Vec3, code: f32) -> SurfaceUv;
}

fn of_span(span: Option<[f32; 2]>, found: &mut dyn FnMut(f32, bool, f32)) {
    let Some([near, far]) = span else { return };
    if near > 0.0 {
        found(near, true, 0.0);
    }
    if far > 0.0 {
        found(far, false, 0.0);
    }
}

impl Solid for SpherePrim {
    fn local_bounds(&self) -> Bounds {
        self.bounds()
    }
    fn crossings(&self, ray: &PreparedRay, found: &mut dyn FnMut(f32, bool, f32)) {
        of_span(self.span(ray), found);
    }
    fn locate(&self, near: Vec3, _: f32) -> BarePoint {
        self.nearest(near)
    }
    fn local_uv(&self, point: Vec3, _: Vec3, _: f32) -> SurfaceUv {
        globe(point - self.center)
    }
}

impl Solid for BoxPrim {
    fn local_bounds(&self) -> Bounds {
        self.bounds()
    }
    fn crossings(&self, ray: &PreparedRay, found: &mut dyn FnMut(f32, bool, f32)) {
        of_span(self.span(ray), found);
    }
    fn locate(&self, near: Vec3, _: f32) -> BarePoint {
        self.nearest(near)
    }
    fn local_uv(&self, point: Vec3, normal: Vec3, _: f32) -> SurfaceUv {
        cube(point, normal, self.min, self.max)
    }
}

impl Solid for ConeFrustum {
    fn local_bounds(&self) -> Bounds {
        self.bounds()
    }
    fn crossings(&self, ray: &PreparedRay, found: &mut dyn FnMut(f32, bool, f32)) {
        ConeFrustum::crossings(self, ray, |t, enters, part| found(t, enters, part.code()));
    }
    fn locate(&self, near: Vec3, code: f32) -> BarePoint {
        self.nearest(near, code)
    }
    fn local_uv(&self, point: Vec3, _: Vec3, code: f32) -> SurfaceUv {
        tube(point, code, self)
    }
}

/// Lists the shapes that affine maps can be put to, once.
macro_rules! solids {
    ($( $Shape:ident: $Type:ty ),* $(,)?) => {
        /// A shape in its own space.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum LocalShape { $(
            #[doc = concat!("A [`", stringify!($Type), "`].")]
            $Shape($Type)
        ),* }

        impl LocalShape {
            fn solid(&self) -> &dyn Solid {
                match self { $( LocalShape::$Shape(shape) => shape ),* }
            }
        }
    };
}

solids! {
    Sphere: SpherePrim,
    Box: BoxPrim,
    Cone: ConeFrustum,
}

/// A shape under an affine map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransformedShape {
    shape: LocalShape,
    map: AffineMap,
    /// In the world: what its hits are held to, where an accelerator will look for them.
    bounds: Bounds,
}

impl TransformedShape {
    pub fn new(shape: LocalShape, to_world: &DAffine3) -> Self {
        let map = AffineMap::new(to_world);
        TransformedShape { shape, map, bounds: map.bounds(shape.solid().local_bounds()) }
    }
}

impl PrimitiveShape for TransformedShape {
    const IS_SAMPLED: bool = false;
    type Area = NoArea;

    fn bounds(&self) -> Bounds {
        self.bounds
    }

    fn intersect(&self, ray: &PreparedRay, sides: Sides, number: u32, closest: &mut ClosestHit) {
        offer_within(&self.bounds, ray, sides, number, closest, |keep| {
            let (local, per_unit) = self.map.local_ray(ray);
            self.shape.solid().crossings(&local, &mut |t, enters, code| keep(t * per_unit, enters, code));
        });
    }

    fn locate(&self, _: &Ray, near: impl Fn() -> Vec3, hit: &Hit) -> BarePoint {
        let local = self.shape.solid().locate(self.map.local(near()), hit.v);
        let (point, error) = self.map.world_point(local.point, local.error);
        BarePoint { point, normal: self.map.world_normal(local.normal), error }
    }

    fn uv(&self, at: &UvPoint, hit: &Hit) -> SurfaceUv {
        self.shape.solid().local_uv(at.local, at.normal, hit.v)
    }
}
