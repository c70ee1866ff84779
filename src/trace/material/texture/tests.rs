use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use super::*;
use crate::components::{Accel, Axes, Material, MeshData, MipMap, Pattern, TexelFilter, Texels, Texture};
use crate::trace::accel::{Accelerator, TraversalScratch};
use crate::trace::material::ShadingParams;
use crate::trace::primitive::{AffineMap, ConeFrustum, Geometry, LocalShape, ObjectSpace, SurfacePoint, Tag};
use crate::trace::soa::Ray;

fn plain() -> ShadingParams {
    ShadingParams::from(&Material { color: DVec3::ONE, ..Material::default() })
}

fn still() -> ObjectSpace {
    ObjectSpace { map: AffineMap::new(&DAffine3::IDENTITY), center: None }
}

fn pattern(pattern: Pattern) -> Texture {
    Texture { pattern: Some(pattern), turbulence: Some(0.0), ..Texture::default() }
}

fn painted(texture: &Texture, picture: Option<MipMap>) -> TextureSet {
    TextureSet { color: vec![TextureLayer::new(texture, picture.map(Arc::new))], ..TextureSet::default() }
}

fn bumpy(texture: &Texture, picture: Option<MipMap>) -> TextureSet {
    TextureSet { bump: Some(TextureLayer::new(texture, picture.map(Arc::new))), ..TextureSet::default() }
}

fn wearing(dress: TextureSet, frame: ObjectSpace) -> TextureBindings {
    let mut skins = TextureBindings::default();
    let number = skins.add(dress);
    skins.put(0, 0, &frame, false, number);
    skins
}

/// A scene of one textured entity.
struct TexturedScene {
    geometry: Geometry,
    accelerator: Accelerator,
    skins: TextureBindings,
}

impl TexturedScene {
    fn new(dress: TextureSet, push: impl FnOnce(&mut Geometry)) -> Self {
        let mut geometry = Geometry::default();
        push(&mut geometry);
        geometry.finish();
        let accelerator = Accelerator::build(&geometry, Accel::Brute, 2.0);
        TexturedScene { geometry, accelerator, skins: wearing(dress, still()) }
    }

    fn floor(dress: TextureSet) -> Self {
        Self::new(dress, |g| g.push_plane(Tag::default(), Vec3::ZERO, Vec3::Y))
    }

    /// What a ray from `from` towards `to` finds.
    fn look(&self, from: Vec3, to: Vec3, spread: f32) -> Option<(Vec3, SurfacePoint)> {
        let ray = Ray::new(from, (to - from).normalize());
        let hit = self.accelerator.closest(&self.geometry, &ray, &mut TraversalScratch::default())?;
        let mut surface = self.geometry.surface_point(&ray, &hit);
        let cone = RayCone { width: 0.0, spread }.at(hit.t);
        let found = self.skins.evaluate(&self.geometry, (&ray, &hit), cone, &mut surface, &plain());
        Some((found.unwrap().diffuse, surface))
    }
}

/// A picture without any order, of mean about one half.
fn speckles(width: u32, height: u32) -> MipMap {
    let texel = |i: u32| [1, 2, 3].map(|k| (crate::base::random::mix(u64::from(3 * i + k)) & 255) as u8);
    MipMap::new(width, height, Texels::Bytes((0..width * height).map(texel).collect()))
}

#[test]
fn entities_without_maps_pay_nothing_and_change_nothing() {
    let model = TexturedScene::floor(TextureSet::default());
    let ray = Ray::new(Vec3::Y, Vec3::NEG_Y);
    let hit = model.accelerator.closest(&model.geometry, &ray, &mut TraversalScratch::default()).unwrap();
    let mut surface = model.geometry.surface_point(&ray, &hit);
    let before = surface;
    let dressed =
        TextureBindings::default().evaluate(&model.geometry, (&ray, &hit), RayCone::default(), &mut surface, &plain());
    assert!(dressed.is_none() && surface == before);
}

/// No shimmering: far out a checker is grey whatever way the ray falls, and so is the mean on the way there.
#[test]
fn a_distant_checker_is_grey() {
    let model = TexturedScene::floor(painted(&pattern(Pattern::Checker), None));
    for i in 0..50 {
        let x = i as f32 * 0.137;
        let (color, _) = model.look(Vec3::new(x, 400.0, 0.0), Vec3::new(x, 0.0, 900.0 + x), 0.02).unwrap();
        assert!((color - Vec3::splat(0.5)).abs().max_element() < 0.02, "{color}");
    }
}

/// The exact integral over the footprints of a row of pixels, against one filtered look for each.
#[test]
fn a_textured_plane_equals_its_integral() {
    let picture = speckles(64, 64);
    let sources = [
        (Texture { image: Some("x".into()), ..Texture::default() }, Some(picture), 0.06),
        (pattern(Pattern::Checker), None, 0.03),
        (pattern(Pattern::Stripes), None, 0.03),
    ];
    for (texture, picture, tolerance) in sources {
        let filtered = TexturedScene::floor(painted(&texture, picture.clone()));
        let pointwise =
            TexturedScene::floor(painted(&Texture { filter: TexelFilter::Bilinear, ..texture.clone() }, picture));
        for height in [1.0f32, 4.0, 30.0] {
            let spread = 0.02;
            let (mut error, mut count) = (0.0f32, 0);
            for i in 0..12 {
                let eye = Vec3::new(0.31 * i as f32, height, 0.17 * i as f32);
                let pixel = |dx: f32, dy: f32| eye + Vec3::new(0.2 + dx * spread, -1.0, 0.3 + dy * spread);
                let (found, _) = filtered.look(eye, pixel(0.0, 0.0), spread).unwrap();
                let n = 32;
                let mut sum = Vec3::ZERO;
                for k in 0..n * n {
                    let at = |k: u32| (k as f32 + 0.5) / n as f32 - 0.5;
                    sum += pointwise.look(eye, pixel(at(k % n), at(k / n)), 0.0).unwrap().0;
                }
                error += (found - sum / (n * n) as f32).abs().max_element();
                count += 1;
            }
            assert!(error / (count as f32) < tolerance, "{:?} {height}: {}", texture.pattern, error / count as f32);
        }
    }
}

#[test]
fn a_globe_has_no_seam_and_no_mixed_poles() {
    // Dark in the south, bright in the north, smooth around.
    let texel = |i: u32| {
        let (x, y) = (i % 64, i / 64);
        [1.0 - y as f32 / 31.0, 0.5 + 0.5 * libm::cosf(std::f32::consts::TAU * (x as f32 + 0.5) / 64.0), 0.0]
    };
    let picture = MipMap::new(64, 32, Texels::Floats((0..64 * 32).map(texel).collect()));
    let texture = Texture { image: Some("x".into()), ..Texture::default() };
    let model =
        TexturedScene::new(painted(&texture, Some(picture)), |g| g.push_sphere(Tag::default(), Vec3::ZERO, 1.0));
    for spread in [0.0, 0.01, 0.1] {
        let look = |p: Vec3| model.look(p.normalize() * 3.0, Vec3::ZERO, spread).unwrap().0;
        for y in [-0.9f32, -0.3, 0.0, 0.5, 0.95] {
            let (west, east) = (look(Vec3::new(1e-3, y, -1.0)), look(Vec3::new(-1e-3, y, -1.0)));
            assert!((west - east).length() < 0.01, "{spread} {y}: {west} {east}");
            assert!((west.y - look(Vec3::new(0.0, y, -1.0)).y).abs() < 0.02);
        }
        for (pole, red) in [(Vec3::Y, 1.0), (Vec3::NEG_Y, 0.0)] {
            for aside in [Vec3::ZERO, Vec3::X, Vec3::Z, Vec3::NEG_X] {
                let color = look(pole + aside * 1e-3);
                assert!((color.x - red).abs() < 0.15, "{spread} {pole}: {color}");
            }
        }
    }
}

/// A height that runs straight up along u, on a floor: the normal that it has by calculus.
#[test]
fn a_ramp_tilts_the_normal_by_its_slope() {
    let texel = |i: u32| [(i % 256) as f32 / 256.0; 3];
    let picture = MipMap::new(256, 1, Texels::Floats((0..256).map(texel).collect()));
    let texture = Texture { image: Some("x".into()), depth: Some(0.5), ..Texture::default() };
    let model = TexturedScene::floor(bumpy(&texture, Some(picture)));
    for (from, side) in [(Vec3::new(0.4, 3.0, 0.2), 1.0), (Vec3::new(0.4, -3.0, 0.2), -1.0)] {
        let (_, surface) = model.look(from, Vec3::new(0.4, 0.0, 0.2), 1e-4).unwrap();
        let expected = Vec3::new(-0.5, 1.0, 0.0).normalize();
        assert!((surface.shading_normal - expected).length() < 1e-2, "{side} {}", surface.shading_normal);
        assert!(surface.bent && surface.geometric_normal == Vec3::Y);
    }
}

/// Bumps on every kind of primitive, seen from everywhere: the normal is unit, on the right side, and seen.
#[test]
fn bumps_never_turn_a_normal_away() {
    let tag = Tag::default();
    let map = crate::base::math::placement(DVec3::ZERO, DVec3::new(10.0, 20.0, 30.0), DVec3::new(1.0, 1.4, -0.8));
    let corners = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];
    let normals = corners.map(|p| p + Vec3::Z * 2.0);
    let mesh = Arc::new(MeshData::new(corners.to_vec(), vec![[0, 1, 2]], normals.to_vec()));
    let cone = LocalShape::Cone(ConeFrustum::new(Vec3::NEG_Y, 1.0, Vec3::Y, 0.0, true));
    let kinds: [&dyn Fn(&mut Geometry); 7] = [
        &|g| g.push_sphere(tag, Vec3::ZERO, 1.0),
        &|g| g.push_triangle(tag, corners, Some(normals)),
        &|g| g.push_box(tag, -Vec3::ONE, Vec3::ONE),
        &|g| g.push_cone(tag, Vec3::NEG_Y, 1.0, Vec3::Y, 0.5, true),
        &|g| g.push_transformed(tag, cone, &map),
        &|g| g.push_mesh(tag, &mesh, true, &map),
        &|g| g.push_instance(tag, &mesh, true, &map),
    ];
    let noise = Texture { depth: Some(0.7), scale: Axes(DVec3::splat(5.0)), ..pattern(Pattern::Noise) };
    let image = Texture { image: Some("x".into()), depth: Some(-0.7), ..Texture::default() };
    for (which, push) in kinds.into_iter().enumerate() {
        for dress in [bumpy(&noise, None), bumpy(&image, Some(speckles(32, 32)))] {
            let model = TexturedScene::new(dress, push);
            let (mut met, mut bent) = (0, 0);
            for i in 0..300u64 {
                let random = |k: u64| crate::base::random::unit_f32(crate::base::random::combine(k, i)) - 0.5;
                let from = Vec3::new(random(1), random(2), random(3)).normalize() * 4.0;
                let to = Vec3::new(random(4), random(5), random(6));
                let Some((_, surface)) = model.look(from, to, 0.01) else { continue };
                let (n, g, d) = (surface.shading_normal, surface.geometric_normal, (to - from).normalize());
                met += 1;
                if !surface.bent {
                    continue;
                }
                bent += 1;
                assert!((n.length() - 1.0).abs() < 1e-4, "{which} {n}");
                assert!(n.dot(g) > 0.0 && n.dot(d) * g.dot(d) > 0.0, "{which}: {n} {g} {d}");
            }
            assert!(met > 10 && bent * 2 > met, "{which}: {bent} of {met}");
        }
    }
}

/// A flat height or a flat normal map changes no bit of the normal.
#[test]
fn flat_maps_bend_nothing() {
    let flat = MipMap::new(2, 2, Texels::Floats(vec![[0.5, 0.5, 1.0]; 4]));
    let texture = Texture { image: Some("x".into()), ..Texture::default() };
    let layer = TextureLayer::new(&texture, Some(Arc::new(flat)));
    for dress in [
        TextureSet { bump: Some(layer.clone()), ..TextureSet::default() },
        TextureSet { normal: Some(layer), ..TextureSet::default() },
    ] {
        let model = TexturedScene::new(dress, |g| g.push_sphere(Tag::default(), Vec3::ZERO, 1.0));
        let (_, surface) = model.look(Vec3::new(0.0, 0.0, 4.0), Vec3::new(0.0, 0.0, 1.0), 0.01).unwrap();
        assert_eq!(surface.shading_normal, surface.geometric_normal);
    }
}
