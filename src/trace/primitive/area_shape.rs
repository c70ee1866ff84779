//! The list of shapes that can be sampled.

use glam::Vec3;

use super::aabox::BoxPrim;
use super::area::{AreaSample, AreaSampling, NoArea};
use super::bounds::Bounds;
use super::sphere::SpherePrim;
use super::triangle::AreaTriangle;

/// Lists the shapes that can be sampled, once.
macro_rules! area_shapes {
    ($( $Shape:ident: $Type:ty ),* $(,)?) => {
        /// Any shape that can be sampled, in the world.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum AreaShape { $(
            #[doc = concat!("A `", stringify!($Type), "`.")]
            $Shape($Type)
        ),* }

        impl AreaShape {
            /// As `AreaSampling::IS_CLOSED`.
            pub fn is_closed(&self) -> bool {
                match self { $( AreaShape::$Shape(_) => <$Type>::IS_CLOSED ),* }
            }

            /// As `AreaSampling::area`.
            pub fn area(&self) -> f32 {
                match self { $( AreaShape::$Shape(shape) => shape.area() ),* }
            }

            /// As `AreaSampling::point`.
            pub fn point(&self, u: [f32; 2]) -> (Vec3, Vec3) {
                match self { $( AreaShape::$Shape(shape) => shape.point(u) ),* }
            }

            /// As `AreaSampling::area_bounds`.
            pub fn area_bounds(&self) -> Bounds {
                match self { $( AreaShape::$Shape(shape) => shape.area_bounds() ),* }
            }

            /// As `AreaSampling::extent`.
            pub fn extent(&self) -> Vec3 {
                match self { $( AreaShape::$Shape(shape) => shape.extent() ),* }
            }

            /// As `AreaSampling::sample`.
            pub fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<AreaSample> {
                match self { $( AreaShape::$Shape(shape) => shape.sample(from, u) ),* }
            }

            /// As `AreaSampling::pdf`.
            pub fn pdf(&self, from: Vec3, point: Vec3, normal: Vec3) -> f32 {
                match self { $( AreaShape::$Shape(shape) => shape.pdf(from, point, normal) ),* }
            }
        }

        $( impl From<$Type> for AreaShape {
            fn from(shape: $Type) -> Self {
                AreaShape::$Shape(shape)
            }
        } )*
    };
}

impl From<NoArea> for AreaShape {
    fn from(none: NoArea) -> Self {
        match none {}
    }
}

area_shapes! {
    Sphere: SpherePrim,
    Triangle: AreaTriangle,
    Box: BoxPrim,
}
