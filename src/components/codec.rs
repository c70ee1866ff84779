//! Scenes and edits as bytes, for another process of this program; records have theirs from `record!`.

use std::sync::Arc;

use glam::DAffine3;

use super::*;
use crate::base::codec::{Codec, Decoder, Encoder, Malformed};
use crate::base::digest::Digest;
use crate::base::project::Folder;

impl Codec for Kind {
    fn encode(&self, to: &mut Encoder) {
        to.put(&(*self as u8));
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Kind::ALL.get(usize::from(from.get::<u8>()?)).copied().ok_or(Malformed)
    }
}

impl Codec for Component {
    fn encode(&self, to: &mut Encoder) {
        to.put(&self.kind());
        self.encode_fields(to);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        from.get::<Kind>()?.decode_fields(from)
    }
}

impl Codec for Focus {
    fn encode(&self, to: &mut Encoder) {
        match self {
            Focus::Entity(name) => {
                to.put(&0u8);
                to.put(name);
            }
            Focus::Point(point) => {
                to.put(&1u8);
                to.put(point);
            }
        }
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        match from.get::<u8>()? {
            0 => from.get().map(Focus::Entity),
            1 => from.get().map(Focus::Point),
            _ => Err(Malformed),
        }
    }
}

impl Codec for MaterialName {
    fn encode(&self, to: &mut Encoder) {
        to.put(&self.0);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        from.get().map(MaterialName)
    }
}

impl Codec for Scale {
    fn encode(&self, to: &mut Encoder) {
        to.put(&self.0);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        from.get().map(Scale)
    }
}

impl<const REST: i8> Codec for Axes<REST> {
    fn encode(&self, to: &mut Encoder) {
        to.put(&self.0);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        from.get().map(Axes)
    }
}

impl Codec for MeshData {
    fn encode(&self, to: &mut Encoder) {
        // Normals that were not given are computed again on the other side.
        to.put(&self.vertices);
        to.put(&self.triangles);
        to.put(&self.normals);
        to.put(&self.uvs);
        to.put(&self.colors);
        to.put(&self.smoothing);
        to.put(&self.materials);
        to.put(&self.groups);
        to.put(&self.second_uvs);
        to.put(&self.origin);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        let mut mesh = MeshData::new(from.get()?, from.get()?, from.get()?).with_uvs(from.get()?);
        (mesh.colors, mesh.smoothing) = (from.get()?, from.get()?);
        (mesh.materials, mesh.groups) = (from.get()?, from.get()?);
        (mesh.second_uvs, mesh.origin) = (from.get()?, from.get()?);
        Ok(mesh)
    }
}

impl Codec for FaceSet {
    fn encode(&self, to: &mut Encoder) {
        let FaceSet { name, runs } = self;
        to.put(name);
        to.put(runs);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(FaceSet { name: from.get()?, runs: from.get()? })
    }
}

impl Codec for Mesh {
    fn encode(&self, to: &mut Encoder) {
        let Mesh { file, frame, group, smooth, crease_angle, file_materials, data } = self;
        to.put(file);
        to.put(frame);
        to.put(group);
        to.put(smooth);
        to.put(crease_angle);
        to.put(file_materials);
        to.shared(data);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(Mesh {
            file: from.get()?,
            frame: from.get()?,
            group: from.get()?,
            smooth: from.get()?,
            crease_angle: from.get()?,
            file_materials: from.get()?,
            data: from.shared()?,
        })
    }
}

impl Codec for SkinData {
    fn encode(&self, to: &mut Encoder) {
        let (binds, influences) = self.parts();
        to.put(&binds.iter().map(|map| map.to_cols_array()).collect::<Vec<_>>());
        to.put(&influences.per_vertex);
        to.put(&influences.joints.iter().map(|joint| u32::from(*joint)).collect::<Vec<_>>());
        to.put(&influences.weights);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        let binds: Vec<[f64; 12]> = from.get()?;
        let per_vertex = from.get()?;
        let joints: Vec<u32> = from.get()?;
        let joints = joints.into_iter().map(|joint| joint as u16).collect();
        let influences = Influences { per_vertex, joints, weights: from.get()? };
        Ok(SkinData::new(binds.iter().map(DAffine3::from_cols_array).collect(), Arc::new(influences)))
    }
}

impl Codec for Skin {
    fn encode(&self, to: &mut Encoder) {
        let Skin { joints, data } = self;
        to.put(joints);
        to.shared(data);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(Skin { joints: from.get()?, data: from.shared()? })
    }
}

impl Codec for MorphTarget {
    fn encode(&self, to: &mut Encoder) {
        let MorphTarget { name, points, normals } = self;
        to.put(name);
        to.put(points);
        to.put(normals);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(MorphTarget { name: from.get()?, points: from.get()?, normals: from.get()? })
    }
}

impl Codec for MorphData {
    fn encode(&self, to: &mut Encoder) {
        to.count(self.len() as u64);
        self.targets().iter().for_each(|target| to.put(target));
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        from.get().map(MorphData::new)
    }
}

impl Codec for Morph {
    fn encode(&self, to: &mut Encoder) {
        let Morph { weights, data } = self;
        to.put(weights);
        to.shared(data);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(Morph { weights: from.get()?, data: from.shared()? })
    }
}

impl Codec for Track {
    fn encode(&self, to: &mut Encoder) {
        let Track { node, property, interpolation, times, values, width } = self;
        to.put(node);
        to.put(property);
        to.put(interpolation);
        to.put(times);
        to.put(values);
        to.put(width);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(Track {
            node: from.get()?,
            property: from.get()?,
            interpolation: from.get()?,
            times: from.get()?,
            values: from.get()?,
            width: from.get()?,
        })
    }
}

impl Codec for Clip {
    fn encode(&self, to: &mut Encoder) {
        let Clip { name, tracks } = self;
        to.put(name);
        to.put(tracks);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(Clip { name: from.get()?, tracks: from.get()? })
    }
}

/// What scripts see of an asset: its clips. Its nodes are entities of the scene.
impl Codec for AssetData {
    fn encode(&self, to: &mut Encoder) {
        let AssetData { clips, nodes: _, materials: _, digest } = self;
        to.put(clips);
        to.put(&[(digest.0 >> 64) as u64, digest.0 as u64]);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        let clips = from.get()?;
        let [high, low] = from.get::<[u64; 2]>()?;
        let digest = Digest(u128::from(high) << 64 | u128::from(low));
        Ok(AssetData { clips, digest, ..AssetData::default() })
    }
}

impl Codec for Asset {
    fn encode(&self, to: &mut Encoder) {
        let Asset { file, scene, without, data } = self;
        to.put(file);
        to.put(scene);
        to.put(without);
        to.shared(data);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(Asset { file: from.get()?, scene: from.get()?, without: from.get()?, data: from.shared()? })
    }
}

impl Codec for EntityDesc {
    fn encode(&self, to: &mut Encoder) {
        to.put(&self.name);
        to.put(&self.tags);
        to.count(self.components().len() as u64);
        self.components().iter().for_each(|component| to.put(component));
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        let (name, tags) = (from.get()?, from.get()?);
        let components: Vec<Component> = from.get()?;
        let mut bag = EntityDesc::new(components);
        (bag.name, bag.tags) = (name, tags);
        Ok(bag)
    }
}

/// A scene without its pictures, which only the renderer looks at, and without its folder.
impl Codec for Scene {
    fn encode(&self, to: &mut Encoder) {
        let Scene { camera, cameras, render, materials, entities, base: _, images: _ } = self;
        to.put(camera);
        to.put(cameras);
        to.put(render);
        to.put(materials);
        to.put(entities);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(Scene {
            camera: from.get()?,
            cameras: from.get()?,
            render: from.get()?,
            materials: from.get()?,
            entities: from.get()?,
            base: Folder::default(),
            images: ImageCache::default(),
        })
    }
}

impl Codec for Edit {
    fn encode(&self, to: &mut Encoder) {
        let tag = |to: &mut Encoder, tag: u8| to.bytes.push(tag);
        match self {
            Edit::Camera(camera) => {
                tag(to, 0);
                to.put(camera);
            }
            Edit::Render(render) => {
                tag(to, 1);
                to.put(render);
            }
            Edit::Material { index, material } => {
                tag(to, 2);
                to.put(index);
                to.put(material);
            }
            Edit::AddMaterial { name, material } => {
                tag(to, 3);
                to.put(name);
                to.put(material);
            }
            Edit::Put { entity, component } => {
                tag(to, 4);
                to.put(entity);
                to.put(component);
            }
            Edit::Take { entity, kind } => {
                tag(to, 5);
                to.put(entity);
                to.put(kind);
            }
            Edit::Tags { entity, tags } => {
                tag(to, 6);
                to.put(entity);
                to.put(tags);
            }
            Edit::Spawn(bag) => {
                tag(to, 7);
                to.put(bag);
            }
            Edit::Despawn { entity } => {
                tag(to, 8);
                to.put(entity);
            }
            Edit::Cameras(cameras) => {
                tag(to, 9);
                to.put(cameras);
            }
        }
    }

    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(match from.get::<u8>()? {
            0 => Edit::Camera(from.get()?),
            1 => Edit::Render(from.get()?),
            2 => Edit::Material { index: from.get()?, material: from.get()? },
            3 => Edit::AddMaterial { name: from.get()?, material: from.get()? },
            4 => Edit::Put { entity: from.get()?, component: from.get()? },
            5 => Edit::Take { entity: from.get()?, kind: from.get()? },
            6 => Edit::Tags { entity: from.get()?, tags: from.get()? },
            7 => Edit::Spawn(from.get()?),
            8 => Edit::Despawn { entity: from.get()? },
            9 => Edit::Cameras(from.get()?),
            _ => return Err(Malformed),
        })
    }
}

impl Codec for Value {
    fn encode(&self, to: &mut Encoder) {
        match self {
            Value::Unit => to.put(&0u8),
            Value::Bool(b) => {
                to.put(&1u8);
                to.put(b);
            }
            Value::Int(i) => {
                to.put(&2u8);
                to.put(i);
            }
            Value::Number(x) => {
                to.put(&3u8);
                to.put(x);
            }
            Value::Text(text) => {
                to.put(&4u8);
                to.put(text);
            }
            Value::Vec3(v) => {
                to.put(&5u8);
                to.put(v);
            }
            Value::List(items) => {
                to.put(&6u8);
                to.put(items);
            }
            Value::Map(entries) => {
                to.put(&7u8);
                to.put(entries);
            }
        }
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(match from.get::<u8>()? {
            0 => Value::Unit,
            1 => Value::Bool(from.get()?),
            2 => Value::Int(from.get()?),
            3 => Value::Number(from.get()?),
            4 => Value::Text(from.get()?),
            5 => Value::Vec3(from.get()?),
            6 => Value::List(from.get()?),
            7 => Value::Map(from.get()?),
            _ => return Err(Malformed),
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::base::codec::SharedTable;

    fn decoder(bytes: &[u8]) -> Decoder<'_> {
        Decoder::new(bytes, SharedTable::default(), false)
    }

    #[test]
    fn every_kind_of_component_and_edit_comes_back() {
        let texture = Texture { pattern: Some(Pattern::Wood), depth: Some(-0.0), ..Texture::default() };
        let material = Material { bump: Some(Box::new(texture)), eta: Some(DVec3::ONE), ..Material::default() };
        let mut data = MeshData::new(vec![Vec3::X, Vec3::Y, Vec3::Z], vec![[0, 1, 2]], vec![]);
        data.materials = vec![FaceSet { name: "red".into(), runs: vec![[0, 1]] }];
        (data.colors, data.smoothing) = (vec![glam::Vec4::ONE; 3], vec![7]);
        let mesh = Mesh { frame: Some(1.5), smooth: Some(true), data: Arc::new(data), ..Mesh::default() };
        let mut components: Vec<Component> = Kind::ALL.iter().map(|kind| kind.default_component()).collect();
        components.push(mesh.into());
        let influences = Influences { per_vertex: 1, joints: vec![3, 0], weights: vec![0.5, 1.0] };
        let skin = SkinData::new(vec![DAffine3::from_translation(DVec3::X)], Arc::new(influences));
        components.push(Skin { joints: vec!["j".into()], data: Arc::new(skin) }.into());
        let target = MorphTarget { name: "t".into(), points: vec![Vec3::X], normals: vec![] };
        components.push(Morph { weights: vec![0.25], data: Arc::new(MorphData::new(vec![target])) }.into());
        let mut bag = EntityDesc::new(components).named("\u{e4}");
        bag.tags = vec!["a".into(), "".into()];
        let camera = Camera { focus: Some(Focus::Entity("x".into())), f_stop: Some(2.8), ..Camera::default() };
        let render = Render { seed: Some(u64::MAX), aovs: vec![Aov::Depth, Aov::Variance], ..Render::default() };
        let edits = vec![
            Edit::Camera(camera.clone()),
            Edit::Camera(Camera { focus: Some(Focus::Point(DVec3::X)), ..camera.clone() }),
            Edit::Render(render.clone()),
            Edit::Material { index: 300, material: material.clone() },
            Edit::AddMaterial { name: "m".into(), material: material.clone() },
            Edit::Put {
                entity: 70_000,
                component: Transform { parent: Some("p".into()), ..Transform::default() }.into(),
            },
            Edit::Take { entity: 1, kind: Kind::AreaLight },
            Edit::Tags { entity: 0, tags: vec![] },
            Edit::Spawn(bag.clone()),
            Edit::Despawn { entity: 3 },
            Edit::Cameras(vec![("close".into(), camera.clone())]),
        ];
        let mut encoder = Encoder::default();
        encoder.put(&edits);
        assert_eq!(decoder(&encoder.bytes).get(), Ok(edits));
        for end in 0..encoder.bytes.len() {
            assert_eq!(decoder(&encoder.bytes[..end]).get::<Vec<Edit>>(), Err(Malformed), "cut at {end}");
        }
        let scene = Scene {
            cameras: vec![("far".into(), camera.clone())],
            camera,
            render,
            materials: vec![("m".into(), material)],
            entities: vec![bag],
            ..Scene::default()
        };
        let mut encoder = Encoder::default();
        encoder.put(&scene);
        assert_eq!(decoder(&encoder.bytes).get(), Ok(scene));
    }
}
