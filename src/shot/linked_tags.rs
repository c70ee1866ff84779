//! Tags as far as they show: those that lights are linked by.

use std::collections::{BTreeMap, BTreeSet};

use crate::base::diagnostics::{ScenePart, Subject, suggestion};
use crate::base::digest::{Digest, Hasher};
use crate::components::*;

/// The tags and links of the scene that frames start from.
#[derive(Default)]
pub struct LinkedTags {
    /// Entities that have a tag, in order.
    tagged: BTreeMap<usize, Vec<Text>>,
    /// Tags that the links of each entity name.
    links: BTreeMap<usize, Vec<Text>>,
}

/// What the links of an entity name; empty without links.
fn named(desc: &EntityDesc) -> Vec<Text> {
    let light = desc.component::<LightLink>().into_iter().flat_map(LightLink::tags);
    let shadow = desc.component::<ShadowLink>().into_iter().flat_map(ShadowLink::tags);
    light.chain(shadow).cloned().collect()
}

impl LinkedTags {
    /// Of these entities.
    pub fn new(entities: &[EntityDesc]) -> LinkedTags {
        let mut found = LinkedTags::default();
        for (index, desc) in entities.iter().enumerate() {
            if !desc.tags.is_empty() {
                found.tagged.insert(index, desc.tags.clone());
            }
            let named = named(desc);
            if !named.is_empty() {
                found.links.insert(index, named);
            }
        }
        found
    }

    /// Which entities have which of the tags that links name, where some entities are others now, or gone; `None` where
    /// no link names any.
    pub fn edited(&self, now: &BTreeMap<usize, Option<EntityDesc>>) -> Option<Digest> {
        let at_rest = self.links.iter().filter(|(index, _)| !now.contains_key(index));
        let edited = now.values().flatten().flat_map(named);
        let wanted: BTreeSet<Text> = at_rest.flat_map(|(_, tags)| tags.iter().cloned()).chain(edited).collect();
        if wanted.is_empty() {
            return None;
        }
        let at_rest = self.tagged.iter().map(|(index, tags)| (*index, &tags[..]));
        let mut all: BTreeMap<usize, &[Text]> = at_rest.collect();
        all.extend(now.iter().map(|(index, desc)| (*index, desc.as_ref().map_or(&[][..], |desc| &desc.tags))));
        let mut hasher = Hasher::default();
        for (index, tags) in all {
            let shown: BTreeSet<&Text> = tags.iter().filter(|tag| wanted.contains(*tag)).collect();
            if !shown.is_empty() {
                hasher.word(index as u64);
                hasher.word(shown.len() as u64);
                shown.into_iter().for_each(|tag| hasher.text(tag));
            }
        }
        Some(hasher.finish())
    }
}

/// Links and visibilities that do nothing, or not all that they seem to: what of the scene, what to say, and help.
pub fn advice(scene: &Scene) -> Vec<(Subject, String, Option<String>)> {
    let known: BTreeSet<&str> = scene.entities.iter().flat_map(|desc| desc.tags.iter().map(|tag| &**tag)).collect();
    let mut found = Vec::new();
    for (index, desc) in scene.entities.iter().enumerate() {
        let subject =
            |kind: Kind, field| Subject { part: ScenePart::Entity(index), component: Some(kind.name()), field };
        let owner = desc.label(index);
        let links = [
            (LightLink::KIND, desc.component::<LightLink>().map(|link| [&link.includes, &link.excludes])),
            (ShadowLink::KIND, desc.component::<ShadowLink>().map(|link| [&link.includes, &link.excludes])),
        ];
        for (kind, lists) in links.into_iter().filter_map(|(kind, lists)| Some((kind, lists?))) {
            for (field, tags) in ["includes", "excludes"].into_iter().zip(lists) {
                for tag in tags.iter().filter(|tag| !known.contains(&***tag)) {
                    let message = format!("`{}` of {owner} names the tag `{tag}`, which no entity has", kind.name());
                    found.push((subject(kind, Some(field)), message, suggestion(tag, known.iter().copied())));
                }
            }
            if !emits(scene, desc) {
                let message = format!("`{}` of {owner} does nothing: the entity emits no light", kind.name());
                found.push((subject(kind, None), message, None));
            }
        }
        let shadow = desc.component::<Visible>().filter(|visible| !visible.shadow);
        let by_photons = shadow.map(|_| Visible::KIND).or(desc.component::<LightLink>().map(|_| LightLink::KIND));
        let by_photons = by_photons.or(desc.component::<ShadowLink>().map(|_| ShadowLink::KIND));
        if let Some(kind) = by_photons.filter(|_| scene.render.integrator == Integrator::Photon) {
            let message = format!(
                "`{}` of {owner} does not hold for photons: `Photon` obeys it for direct light alone",
                kind.name()
            );
            found.push((subject(kind, None), message, Some("`integrator: Path` obeys it for all light".into())));
        }
    }
    found
}

/// Whether an entity sends light of its own.
fn emits(scene: &Scene, desc: &EntityDesc) -> bool {
    let worn = desc.component::<MaterialName>().map(|name| &name.0);
    let worn = worn.into_iter().chain(desc.component::<Mesh>().into_iter().flat_map(Mesh::worn));
    let emissive = |name: &Text| {
        let material = scene.materials.iter().find(|(other, _)| other == name);
        material.is_some_and(|(_, material)| material.emission != glam::DVec3::ZERO)
    };
    let is_lamp = desc.components().iter().any(|component| component.kind().role() == Role::Light);
    is_lamp || worn.into_iter().any(emissive)
}
