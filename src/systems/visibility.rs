//! World -> which primitives which rays meet, and which lights light what.
//!
//! Rays of the camera, rays that left a surface and rays to lights may each meet other bodies. Every set of bodies gets
//! an accelerator of its own over the same columns, so that no ray asks about what it does not meet; where nothing is
//! special there is one set, and nothing of this costs anything.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::stage::{Stage, Tags};
use crate::base::diagnostics::{Diagnostic, ScenePart, Subject};
use crate::base::limits;
use crate::components::*;
use crate::trace::accel::HiddenPrimitives;
use crate::trace::light::{LightLinking, LightLinks};
use crate::trace::primitive::Geometry;

/// Who meets what in a World.
#[derive(Default)]
pub struct RayVisibility {
    /// Every different set of hidden primitives; one at least once it is resolved.
    pub hidden: Vec<HiddenPrimitives>,
    /// The sets of rays of the camera and of rays that left a surface, and those of shadow rays by their number.
    pub camera: usize,
    pub scattered: usize,
    pub shadow: Vec<usize>,
    /// What the lamps of entities are linked to, where that is anything special.
    lamps: FxHashMap<usize, LightLinking>,
    /// What is special about lights, if anything is.
    pub links: Option<Arc<LightLinks>>,
}

/// Whose shadows are thrown.
#[derive(Clone, PartialEq)]
enum Casters {
    All,
    None,
    Linked(ShadowLink),
}

/// What entities say about who meets and lights them.
#[derive(Default)]
struct Special {
    visible: FxHashMap<usize, Visible>,
    light_links: Vec<(usize, LightLink)>,
    shadow_links: Vec<(usize, ShadowLink)>,
    /// Empty where no link asks for them.
    tags: FxHashMap<usize, Vec<Text>>,
}

/// Whether any light of the World is linked by tags.
pub fn has_links(stage: &Stage) -> bool {
    let mut links = stage.world.query::<hecs::Or<&LightLink, &ShadowLink>>();
    links.iter().next().is_some()
}

impl Special {
    fn new(stage: &Stage) -> Result<Special, Diagnostic> {
        let mut found = Special::default();
        stage.for_each_in_order::<&Visible>(|index, visible| {
            found.visible.insert(index, visible.clone());
            Ok(())
        })?;
        stage.for_each_in_order::<&LightLink>(|index, link| {
            found.light_links.push((index, link.clone()));
            Ok(())
        })?;
        stage.for_each_in_order::<&ShadowLink>(|index, link| {
            found.shadow_links.push((index, link.clone()));
            Ok(())
        })?;
        if !found.light_links.is_empty() || !found.shadow_links.is_empty() {
            stage.for_each_in_order::<&Tags>(|index, tags| {
                found.tags.insert(index, tags.0.clone());
                Ok(())
            })?;
        }
        Ok(found)
    }

    fn is_empty(&self) -> bool {
        self.visible.is_empty() && self.light_links.is_empty() && self.shadow_links.is_empty()
    }

    fn tags(&self, index: usize) -> &[Text] {
        self.tags.get(&index).map_or(&[], |tags| tags)
    }

    fn throws_shadow(&self, index: usize, casters: &Casters) -> bool {
        let is_caster = match casters {
            Casters::All => true,
            Casters::None => false,
            Casters::Linked(link) => link.chooses(self.tags(index)),
        };
        is_caster && self.visible.get(&index).is_none_or(|visible| visible.shadow)
    }
}

/// What is resolved so far.
struct Resolution<'a> {
    geometry: &'a Geometry,
    special: &'a Special,
    out: RayVisibility,
    casters: Vec<Casters>,
}

impl Resolution<'_> {
    /// The number of a set among all.
    fn set(&mut self, hidden: HiddenPrimitives) -> usize {
        let known = self.out.hidden.iter().position(|known| *known == hidden);
        known.unwrap_or_else(|| {
            self.out.hidden.push(hidden);
            self.out.hidden.len() - 1
        })
    }

    fn hidden_from(&mut self, shows: impl Fn(&Visible) -> bool) -> usize {
        let visible = &self.special.visible;
        let hidden = HiddenPrimitives::new(self.geometry, |entity| {
            visible.get(&(entity as usize)).is_some_and(|visible| !shows(visible))
        });
        self.set(hidden)
    }

    /// The number of the set of those that throw shadows.
    fn shadow_set(&mut self, index: usize, casters: Casters) -> Result<u32, Diagnostic> {
        if let Some(known) = self.casters.iter().position(|known| *known == casters) {
            return Ok(known as u32);
        }
        if self.casters.len() >= limits::SHADOW_SETS {
            let message = format!("more than {} different sets of bodies that throw shadows", limits::SHADOW_SETS);
            return Err(Diagnostic::error(message).about(subject(index, ShadowLink::KIND)));
        }
        let special = self.special;
        let hidden = HiddenPrimitives::new(self.geometry, |entity| !special.throws_shadow(entity as usize, &casters));
        let set = self.set(hidden);
        self.out.shadow.push(set);
        self.casters.push(casters);
        Ok(self.casters.len() as u32 - 1)
    }

    /// A light whose shadows are those of a set: where that differs from what rays meet on their way, it is only sampled.
    fn linking(&self, unlit: u64, shadow_set: u32) -> LightLinking {
        let sampled_only = self.out.shadow[shadow_set as usize] != self.out.scattered;
        LightLinking { unlit, shadow_set, sampled_only }
    }
}

fn subject(index: usize, kind: Kind) -> Subject {
    Subject { part: ScenePart::Entity(index), component: Some(kind.name()), field: None }
}

impl RayVisibility {
    /// What is special about the lamps of an entity.
    pub fn of_lamp(&self, index: usize) -> LightLinking {
        let usual = self.links.as_ref().map_or(LightLinking::default(), |links| links.usual);
        self.lamps.get(&index).copied().unwrap_or(usual)
    }

    /// As the World stands, over these columns.
    ///
    /// # Errors
    /// More different links than a frame may have.
    pub fn new(stage: &Stage, geometry: &Geometry) -> Result<RayVisibility, Diagnostic> {
        let special = Special::new(stage)?;
        if special.is_empty() {
            return Ok(RayVisibility {
                hidden: vec![HiddenPrimitives::NONE],
                shadow: vec![0],
                ..RayVisibility::default()
            });
        }
        let mut resolution =
            Resolution { geometry, special: &special, out: RayVisibility::default(), casters: Vec::new() };
        resolution.out.scattered = resolution.hidden_from(|visible| visible.reflection);
        resolution.out.camera = resolution.hidden_from(|visible| visible.camera != Some(false));
        resolution.shadow_set(0, Casters::All)?;
        let (unlit, receivers) = receivers(stage, &special)?;
        let mut links = LightLinks { receivers, usual: resolution.linking(0, 0), ..LightLinks::default() };
        let has_body = |index: usize| stage.live(index).is_some_and(|entity| has_shape(stage, entity));
        let of_lights = special.visible.iter().filter(|(_, visible)| !visible.shadow).map(|(index, _)| *index);
        let mut lights: Vec<usize> = of_lights.filter(|index| !has_body(*index)).collect();
        lights.extend(special.light_links.iter().map(|(index, _)| *index));
        lights.extend(special.shadow_links.iter().map(|(index, _)| *index));
        lights.sort_unstable();
        lights.dedup();
        for index in lights {
            let link = special.shadow_links.iter().find(|(one, _)| *one == index);
            let casters = link.map_or(Casters::All, |(_, link)| Casters::Linked(link.clone()));
            let throws_none = special.visible.get(&index).is_some_and(|visible| !visible.shadow) && !has_body(index);
            let of_lamp = resolution.shadow_set(index, if throws_none { Casters::None } else { casters.clone() })?;
            let of_surface = resolution.shadow_set(index, casters)?;
            let unlit = unlit.get(&index).copied().unwrap_or(0);
            resolution.out.lamps.insert(index, resolution.linking(unlit, of_lamp));
            links.emissive.insert(index as u32, resolution.linking(unlit, of_surface));
        }
        resolution.out.links = Some(Arc::new(links));
        Ok(resolution.out)
    }
}

/// Whether an entity has a surface.
fn has_shape(stage: &Stage, entity: hecs::Entity) -> bool {
    let shapes = Kind::ALL.iter().filter(|kind| kind.role() == Role::Shape);
    shapes.into_iter().any(|kind| super::stage::get(&stage.world, entity, *kind).is_some())
}

/// A bit for every different link, by light; and by entity the bits of the links that leave it out.
fn receivers(stage: &Stage, special: &Special) -> Result<(FxHashMap<usize, u64>, Vec<u64>), Diagnostic> {
    let (mut bits, mut known): (FxHashMap<usize, u64>, Vec<&LightLink>) = Default::default();
    for (index, link) in &special.light_links {
        if *link == LightLink::default() {
            continue;
        }
        let number = known.iter().position(|other| *other == link).unwrap_or_else(|| {
            known.push(link);
            known.len() - 1
        });
        if number >= limits::LIGHT_LINKS {
            let message = format!("more than {} different links of lights to bodies", limits::LIGHT_LINKS);
            return Err(Diagnostic::error(message).about(subject(*index, LightLink::KIND)));
        }
        bits.insert(*index, 1 << number);
    }
    if known.is_empty() {
        return Ok((bits, Vec::new()));
    }
    let unlit = |index: usize| {
        let tags = special.tags(index);
        known.iter().zip(0..).fold(0, |unlit, (link, bit)| unlit | u64::from(!link.chooses(tags)) << bit)
    };
    Ok((bits, (0..stage.entities.len()).map(unlit).collect()))
}
