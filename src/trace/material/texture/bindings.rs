//! Textures ready to be looked up, and which entities have any.

use std::sync::Arc;

use glam::{Mat3, Vec3, Vec4};

use super::image::{Edges, ImageSampler};
use super::pattern::PatternSampler;
use super::perturb_normal;
use super::ray_cone::RayCone;
use crate::base::color::luminance;
use crate::base::math::sin_cos_degrees;
use crate::components::{Channel, MipMap, Pattern, Space, Texture};
use crate::trace::material::{MapValues, ShadingParams};
use crate::trace::primitive::{Geometry, ObjectSpace, SurfacePoint, SurfaceUv};
use crate::trace::soa::{Hit, Ray};

/// Where a texture gets its colours from.
#[derive(Clone, Debug, PartialEq)]
enum TexelSource {
    MipMap(Arc<MipMap>, ImageSampler),
    Pattern(PatternSampler),
}

/// One texture, ready to be looked up.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureLayer {
    source: TexelSource,
    space: Space,
    /// From the coordinates of its space to its own.
    linear: Mat3,
    offset: Vec3,
    tint: Vec3,
    depth: Option<f32>,
    channel: Channel,
    /// Whether it is laid out by the second texture coordinates.
    second_uv: bool,
}

/// A footprint beyond all numbers, in texture coordinates.
const ENDLESS: f32 = 1e9;

impl TextureLayer {
    /// `picture` is the one that the texture names, if it names one.
    pub fn new(texture: &Texture, picture: Option<Arc<MipMap>>) -> Self {
        let wrap = [texture.wrap, texture.wrap_v.unwrap_or(texture.wrap)];
        let sheet = ImageSampler { wrap, filter: texture.filter };
        let source = match picture {
            Some(picture) => TexelSource::MipMap(picture, sheet),
            None => TexelSource::Pattern(PatternSampler::new(texture, texture.pattern.unwrap_or(Pattern::Checker))),
        };
        let (sin, cos) = sin_cos_degrees(texture.rotation);
        let (sin, cos) = (sin as f32, cos as f32);
        let rotation = Mat3::from_cols(Vec3::new(cos, sin, 0.0), Vec3::new(-sin, cos, 0.0), Vec3::Z);
        TextureLayer {
            source,
            space: texture.layout(),
            linear: rotation * Mat3::from_diagonal(texture.scale.0.as_vec3()),
            offset: texture.offset.0.as_vec3(),
            tint: texture.tint.as_vec3(),
            depth: texture.depth.map(|x| x as f32),
            channel: texture.channel,
            second_uv: texture.uv_set == 1,
        }
    }

    /// The colour at a spot.
    fn color(&self, spot: &TextureContext) -> Vec3 {
        self.tint * self.at(spot, self.coordinates(spot), self.axes(spot))
    }

    /// The one number that counts at a spot.
    fn number(&self, spot: &TextureContext) -> f32 {
        let color = self.color(spot);
        if self.channel == Channel::Color { luminance(color.to_array()) } else { color.x }
    }

    /// Texture coordinates of a spot.
    fn coordinates(&self, spot: &TextureContext) -> Vec3 {
        let p = match self.space {
            Space::Uv => spot.uv(self.second_uv).uv.extend(0.0),
            Space::Object => spot.frame.map.local(spot.point),
            Space::World => spot.point,
        };
        let p = self.linear * p + self.offset;
        if p.is_finite() { p } else { Vec3::ZERO }
    }

    /// Axes of the spot's footprint in texture coordinates.
    fn axes(&self, spot: &TextureContext) -> [Vec3; 2] {
        spot.axes.map(|a| {
            let a = match self.space {
                Space::Uv => spot.uv(self.second_uv).along(a).extend(0.0),
                Space::Object => spot.frame.map.to_local * a,
                Space::World => a,
            };
            let a = self.linear * a;
            if a.is_finite() { a } else { Vec3::splat(ENDLESS) }
        })
    }

    /// Gradients of the texture coordinates along the surface, per world unit.
    fn gradients(&self, spot: &TextureContext) -> [Vec3; 3] {
        let flat = |g: Vec3| g - spot.normal * spot.normal.dot(g);
        let of_space = match self.space {
            Space::Uv => {
                let [u, v] = spot.uv(self.second_uv).gradients;
                [u, v, Vec3::ZERO]
            }
            Space::Object => spot.frame.map.to_local.transpose().to_cols_array_2d().map(|c| flat(Vec3::from_array(c))),
            Space::World => [flat(Vec3::X), flat(Vec3::Y), flat(Vec3::Z)],
        };
        let rows = self.linear.transpose().to_cols_array_2d();
        rows.map(|r| of_space[0] * r[0] + of_space[1] * r[1] + of_space[2] * r[2])
    }

    fn at(&self, spot: &TextureContext, p: Vec3, axes: [Vec3; 2]) -> Vec3 {
        let color = match &self.source {
            TexelSource::MipMap(picture, sheet) => {
                sheet.color(picture, p.truncate(), axes.map(Vec3::truncate), self.edges(spot))
            }
            TexelSource::Pattern(motif) => motif.color(p, axes),
        };
        match self.channel {
            // An alpha channel was read as grey.
            Channel::Color | Channel::Alpha => color,
            Channel::Red => Vec3::splat(color.x),
            Channel::Green => Vec3::splat(color.y),
            Channel::Blue => Vec3::splat(color.z),
        }
    }

    /// Where the surface's coordinates end, in those of the texture; nowhere if they are turned against each other.
    fn edges(&self, spot: &TextureContext) -> Edges {
        let m = &self.linear;
        let turned = m.x_axis.y != 0.0 || m.y_axis.x != 0.0;
        std::array::from_fn(|k| {
            let (low, high) = (self.offset[k], self.offset[k] + m.col(k)[k]);
            (spot.uv(self.second_uv).ends[k] && !turned).then_some([low.min(high), low.max(high)])
        })
    }

    /// Gradient of the luminance along the surface, by differences over the footprint, or over a texel if that is more.
    fn slope(&self, spot: &TextureContext) -> Vec3 {
        let (p, axes, gradients) = (self.coordinates(spot), self.axes(spot), self.gradients(spot));
        let least = match &self.source {
            TexelSource::MipMap(picture, _) => {
                let level = &picture.levels[0];
                Vec3::new(0.5 / level.width as f32, 0.5 / level.height as f32, 1.0)
            }
            TexelSource::Pattern(_) => Vec3::splat(1e-3),
        };
        let mut sum = Vec3::ZERO;
        for k in 0..3 {
            if gradients[k] == Vec3::ZERO {
                continue;
            }
            let reach = (axes[0][k].abs().max(axes[1][k].abs()) * 0.5).clamp(least[k], 0.5_f32.max(least[k]));
            let mut step = Vec3::ZERO;
            step[k] = reach;
            let height = |p: Vec3| luminance((self.tint * self.at(spot, p, axes)).to_array());
            sum += gradients[k] * ((height(p + step) - height(p - step)) / (2.0 * reach));
        }
        sum
    }
}

/// The maps of a material, and the texture of the entity that has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextureSet {
    /// All are multiplied with the colour.
    pub color: Vec<TextureLayer>,
    /// For the highlight.
    pub specular: Option<TextureLayer>,
    /// For emitted light.
    pub emission: Option<TextureLayer>,
    /// For the mirror's share.
    pub reflection: Option<TextureLayer>,
    /// For the roughness.
    pub roughness: Option<TextureLayer>,
    /// For the share of metal.
    pub metallic: Option<TextureLayer>,
    /// For the share that goes through.
    pub transmission: Option<TextureLayer>,
    /// For the opacity.
    pub opacity: Option<TextureLayer>,
    /// Heights that bend the normal.
    pub bump: Option<TextureLayer>,
    /// Normals in the axes of the surface.
    pub normal: Option<TextureLayer>,
}

impl TextureSet {
    /// Whether there is no texture at all.
    pub fn is_empty(&self) -> bool {
        self.layers().next().is_none()
    }

    fn layers(&self) -> impl Iterator<Item = &TextureLayer> {
        let looks = [&self.specular, &self.emission, &self.reflection, &self.roughness, &self.metallic];
        let others = [&self.transmission, &self.opacity, &self.bump, &self.normal];
        self.color.iter().chain(looks.into_iter().chain(others).flatten())
    }

    /// Whether the first, and whether the second texture coordinates are needed.
    fn wants_uv(&self) -> [bool; 2] {
        [false, true].map(|second| self.layers().any(|layer| layer.space == Space::Uv && layer.second_uv == second))
    }
}

/// The textures of an entity, and the space that they stand in.
#[derive(Clone, Debug, PartialEq)]
struct TextureBinding {
    frame: ObjectSpace,
    /// World units per local unit, on the whole.
    unit: f32,
    /// Whether the vertices of its mesh have colours.
    colored: bool,
    /// Number of a material, and index of the texture set that goes with it.
    first: [u32; 2],
    /// As `first`, for entities that are made of several materials.
    others: Vec<[u32; 2]>,
}

impl TextureBinding {
    /// Index of the texture set that goes with a material.
    #[inline]
    fn set_of(&self, material: u32) -> Option<u32> {
        let mut all = std::iter::once(&self.first).chain(&self.others);
        all.find(|[known, _]| *known == material).map(|[_, set]| *set)
    }
}

/// Which entities have which textures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextureBindings {
    /// Index of the binding by entity, as far as any has one.
    by_entity: Vec<u32>,
    skins: Vec<TextureBinding>,
    dresses: Vec<(TextureSet, [bool; 2])>,
}

/// Number of no binding.
const BARE: u32 = u32::MAX;

/// A point with all that textures depend on.
struct TextureContext<'a> {
    point: Vec3,
    /// Geometric.
    normal: Vec3,
    /// Axes of the footprint, world space.
    axes: [Vec3; 2],
    /// By the first and the second texture coordinates, as far as they are needed.
    uvs: [SurfaceUv; 2],
    frame: &'a ObjectSpace,
}

impl TextureContext<'_> {
    fn uv(&self, second: bool) -> &SurfaceUv {
        &self.uvs[usize::from(second)]
    }
}

impl TextureBindings {
    /// Adds a set that entities can be bound to; gives its number.
    pub fn add(&mut self, dress: TextureSet) -> u32 {
        let wants_uv = dress.wants_uv();
        self.dresses.push((dress, wants_uv));
        self.dresses.len() as u32 - 1
    }

    /// Binds an entity that stands in this space to a texture set, where it is made of a material; `colored` says
    /// whether the vertices of its mesh have colours.
    pub fn put(&mut self, entity: u32, material: u32, frame: &ObjectSpace, colored: bool, set: u32) {
        let at = entity as usize;
        if self.by_entity.len() <= at {
            self.by_entity.resize(at + 1, BARE);
        }
        if let Some(binding) = self.skins.get_mut(self.by_entity[at] as usize) {
            if binding.set_of(material).is_none() {
                binding.others.push([material, set]);
            }
            return;
        }
        self.by_entity[at] = self.skins.len() as u32;
        let unit = libm::cbrtf(frame.map.to_world.determinant().abs());
        self.skins.push(TextureBinding { frame: *frame, unit, colored, first: [material, set], others: Vec::new() });
    }

    /// Whether what the entity is made of has maps.
    #[inline]
    pub fn is_textured(&self, entity: u32) -> bool {
        self.by_entity.get(entity as usize).is_some_and(|skin| (*skin as usize) < self.skins.len())
    }

    /// The material of the point that a ray met, and its normal bent, if the entity has any textures.
    ///
    /// `surface` faces outwards, `cone` is that of the ray at its end, `base` the material without maps.
    #[inline]
    pub fn evaluate(
        &self,
        geometry: &Geometry,
        (ray, hit): (&Ray, &Hit),
        cone: RayCone,
        surface: &mut SurfacePoint,
        base: &ShadingParams,
    ) -> Option<ShadingParams> {
        let skin = self.skins.get(*self.by_entity.get(surface.entity as usize)? as usize)?;
        let set = skin.set_of(surface.material)?;
        Some(self.evaluate_binding(geometry, (ray, hit), cone, surface, (skin, set, base)))
    }

    #[inline(never)]
    fn evaluate_binding(
        &self,
        geometry: &Geometry,
        (ray, hit): (&Ray, &Hit),
        cone: RayCone,
        surface: &mut SurfacePoint,
        (skin, set, base): (&TextureBinding, u32, &ShadingParams),
    ) -> ShadingParams {
        let (dress, wants_uv) = &self.dresses[set as usize];
        let spot = spot(geometry, (ray, hit), cone, surface, (skin, *wants_uv));
        let own = if skin.colored { geometry.vertex_color(hit) } else { Vec4::ONE };
        let color = dress.color.iter().fold(own.truncate(), |c, layer| c * layer.color(&spot));
        let specular = dress.specular.as_ref().map_or(Vec3::ONE, |layer| layer.color(&spot));
        let emission = dress.emission.as_ref().map_or(Vec3::ONE, |layer| layer.color(&spot));
        let number = |layer: &Option<TextureLayer>| layer.as_ref().map_or(1.0, |layer| layer.number(&spot));
        let before = surface.shading_normal;
        let mut bent = before;
        if let Some(layer) = &dress.normal {
            let texel = layer.at(&spot, layer.coordinates(&spot), layer.axes(&spot));
            let [gu, gv, _] = layer.gradients(&spot);
            bent = perturb_normal::mapped(bent, texel, layer.depth.unwrap_or(1.0), [gu, gv]);
        }
        if let Some(layer) = &dress.bump {
            let height = layer.depth.unwrap_or(Texture::DEPTH as f32) * skin.unit;
            bent = perturb_normal::displaced(bent, layer.slope(&spot) * height);
        }
        if bent != before {
            surface.perturb_normal(bent, ray.direction);
        }
        base.mapped(&MapValues {
            color,
            specular,
            emission,
            reflection: number(&dress.reflection),
            roughness: number(&dress.roughness),
            metallic: number(&dress.metallic),
            transmission: number(&dress.transmission),
            opacity: number(&dress.opacity) * base.vertex_opacity(own.w),
        })
    }

    /// How much of a surface is there at the point that a ray met, by its material without maps and the map of it.
    pub fn opacity(
        &self,
        geometry: &Geometry,
        (ray, hit): (&Ray, &Hit),
        cone: RayCone,
        surface: &SurfacePoint,
        base: &ShadingParams,
    ) -> f32 {
        let skin = self.by_entity.get(surface.entity as usize).and_then(|skin| self.skins.get(*skin as usize));
        let Some(skin) = skin else { return base.opacity };
        let Some(set) = skin.set_of(surface.material) else { return base.opacity };
        let own = if skin.colored { base.vertex_opacity(geometry.vertex_color(hit).w) } else { 1.0 };
        let (dress, wants_uv) = &self.dresses[set as usize];
        let map = dress
            .opacity
            .as_ref()
            .map_or(1.0, |layer| layer.number(&spot(geometry, (ray, hit), cone, surface, (skin, *wants_uv))));
        base.opacity * own * map
    }
}

/// All that textures depend on at the point that a ray met.
fn spot<'a>(
    geometry: &Geometry,
    (ray, hit): (&Ray, &Hit),
    cone: RayCone,
    surface: &SurfacePoint,
    (skin, wants_uv): (&'a TextureBinding, [bool; 2]),
) -> TextureContext<'a> {
    let normal = surface.geometric_normal;
    let uv = |second: usize| match wants_uv[second] {
        true => geometry.surface_uv(hit, surface, &skin.frame, second == 1),
        false => SurfaceUv::default(),
    };
    TextureContext {
        point: surface.point,
        normal,
        axes: cone.footprint(ray.direction, normal),
        uvs: [uv(0), uv(1)],
        frame: &skin.frame,
    }
}
