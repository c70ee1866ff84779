//! Skins and morphs -> the meshes that they bend.
//!
//! Reused when: mesh, weights and placements of joints are those that it was bent by last.

use std::sync::Arc;

use glam::DAffine3;

use super::hierarchy::Placement;
use super::origin::{relative, render_origin};
use super::stage::{AuthoredIndex, Despawned, Stage};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::digest::Digest;
use crate::components::skin::{deformed, deformed_digest};
use crate::components::*;

/// The mesh of an entity as it is bent, in place of its own.
#[derive(Clone, Debug)]
pub struct Deformed {
    key: Digest,
    pub mesh: Mesh,
    /// Whether it stands where its joints are: its points are in the space that is traced.
    pub in_world: bool,
}

impl Deformed {
    /// The digest of all that it follows from.
    pub fn digest(&self) -> Digest {
        self.key
    }
}

/// What bends a mesh, as the World stands.
struct Bending<'a> {
    mesh: &'a Mesh,
    morph: Option<&'a Morph>,
    skin: Option<(&'a Skin, Vec<DAffine3>)>,
}

type BendingParts<'q> = (&'q AuthoredIndex, &'q Mesh, Option<&'q Morph>, Option<&'q Skin>);

impl<'a> Bending<'a> {
    /// `None` if the mesh stays as it is.
    fn new(
        stage: &Stage,
        (order, mesh, morph, skin): <BendingParts<'a> as hecs::Query>::Item<'a>,
    ) -> Result<Option<Self>, Diagnostic> {
        let morph = morph.filter(|morph| morph.weights.iter().any(|weight| *weight != 0.0));
        if morph.is_none() && skin.is_none() {
            return Ok(None);
        }
        let with_joints = |skin| joints(stage, order.0 as usize, skin).map(|joints| (skin, joints));
        Ok(Some(Bending { mesh, morph, skin: skin.map(with_joints).transpose()? }))
    }

    fn skin(&self) -> Option<(&Skin, &[DAffine3])> {
        self.skin.as_ref().map(|(skin, joints)| (*skin, &joints[..]))
    }

    fn key(&self) -> Digest {
        deformed_digest(&self.mesh.data, self.morph, self.skin())
    }

    fn deformed(&self, key: Digest) -> Deformed {
        let data = deformed(&self.mesh.data, self.morph, self.skin()).into();
        Deformed { key, mesh: Mesh { data, ..self.mesh.clone() }, in_world: self.skin.is_some() }
    }
}

/// Brings the bent meshes of the World up to date.
///
/// # Errors
/// A joint that does not exist or was removed.
pub fn update(stage: &mut Stage) -> Result<(), Diagnostics> {
    let (mut bent, mut straight) = (Vec::new(), Vec::new());
    type All<'q> = (hecs::Entity, BendingParts<'q>, Option<&'q Deformed>);
    for (entity, parts, old) in stage.world.query::<All>().without::<&Despawned>().iter() {
        let Some(bending) = Bending::new(stage, parts)? else {
            straight.extend(old.map(|_| entity));
            continue;
        };
        let key = bending.key();
        let with_data = |data: &Arc<MeshData>| Mesh { data: data.clone(), ..bending.mesh.clone() };
        if !old.is_some_and(|old| old.key == key && with_data(&old.mesh.data) == old.mesh) {
            bent.push((entity, bending.deformed(key)));
        }
    }
    for (entity, deformed) in bent {
        // A live entity takes any component.
        let _ = stage.world.insert_one(entity, deformed);
    }
    for entity in straight {
        let _ = stage.world.remove_one::<Deformed>(entity);
    }
    Ok(())
}

/// The mesh of an entity as it is bent right now, if anything bends it.
///
/// # Errors
/// As [`update`].
pub fn now(stage: &Stage, index: usize) -> Result<Option<Deformed>, Diagnostic> {
    let Some(entity) = stage.live(index) else { return Ok(None) };
    let mut query = stage.world.query_one::<BendingParts>(entity);
    let Ok(parts) = query.get() else { return Ok(None) };
    Ok(Bending::new(stage, parts)?.map(|bending| bending.deformed(bending.key())))
}

/// Where the joints of an entity's skin are, in the space that is traced.
fn joints(stage: &Stage, index: usize, skin: &Skin) -> Result<Vec<DAffine3>, Diagnostic> {
    let origin = render_origin(stage);
    let place = |name: &Text| {
        let found = stage.names.get(name).and_then(|at| stage.live(*at));
        let entity = found.ok_or_else(|| stage.unknown(index, "joint", name, stage.names.keys()))?;
        Ok(relative(stage.world.get::<&Placement>(entity).ok().as_deref(), origin))
    };
    skin.joints.iter().map(place).collect()
}
