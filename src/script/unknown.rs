//! What is said of a property that an entity does not have.

use super::elsewhere;
use super::errors::{Fallible, complain};
use super::handles::EntityHandle;
use super::vocabulary::field_of_material;
use crate::base::diagnostics::{did_you_mean, nearest};
use crate::components::*;

impl EntityHandle {
    /// The answer to a property that there is not; `own` are those that there are.
    pub(super) fn unknown<T>(&self, property: &str, own: &[&str]) -> Fallible<T> {
        let message = format!("unknown property `{property}` of {}", self.label());
        let help = self.help_for(property, own).or_else(|| elsewhere::of_field(property, own.iter().copied()));
        complain(message, help)
    }

    fn help_for(&self, property: &str, own: &[&str]) -> Option<String> {
        if ["x", "y", "z"].contains(&property) {
            return Some(format!("its place is a vector: write .translation.{property}"));
        }
        let meant = did_you_mean(property, own);
        // A word for a surface or for how bright something is belongs to a part of the entity, if it has one.
        let is_slip = nearest(property, ["color"]).is_some();
        let is_vague = |help: &String| help.contains("`material`") || (help.contains("`color`") && !is_slip);
        if let Some(help) = meant.filter(|help| !is_vague(help)) {
            return Some(help);
        }
        let carried: Vec<Component> = Kind::ALL.iter().filter_map(|kind| self.component(*kind)).collect();
        let named = |component: &Component| component.record().fields().contains(&property);
        if let Some(component) = carried.iter().find(|component| named(component)) {
            return Some(format!("its {0} has it: write .{0}.{property}", component.kind().name()));
        }
        let lights = carried.iter().filter(|component| component.kind().role() == Role::Light);
        for light in lights {
            if let Some(help) = did_you_mean(property, light.record().fields()) {
                return Some(format!("{help} It is a field of its {0}: .{0}", light.kind().name()));
            }
        }
        let worn = carried.iter().find(|component| component.kind() == Kind::MaterialName)?.record().get("name")?;
        let Value::Text(name) = worn else { return None };
        let field = field_of_material(property)?;
        Some(format!("that is its material's: s.material(\"{name}\").{field}"))
    }
}
