use super::*;
use crate::components::Material;
use crate::components::{Axes, Texels};
use crate::trace::geometry::Map;
use crate::trace::{Accelerator, Tag, Worker};
use glam::{DAffine3, DVec3};
