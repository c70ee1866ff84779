//! Moments between the ones that a script was evaluated for: what moves goes straight from one to the next.
//!
//! A frame with an open shutter is evaluated at a few moments, and each of its samples may have a time of its own. Where a
//! pixel takes more samples than there are moments, those in between are interpolated, number by number, so that fast
//! things leave a smear and not a row of beads. What jumps, as the camera does at a cut, is left as it is on either side.

use super::shutter::Slice;
use crate::base::rotation::shortest_turn;
use crate::components::*;

/// A jump is a step that is so many times as long as those before and behind it together.
const JUMP: f64 = 4.0;

/// The moments of a frame with `parts` moments in the place of each one.
pub fn refined(slices: Vec<Slice>, parts: u32) -> Vec<Slice> {
    let count = slices.len();
    if parts < 2 || count < 2 {
        return slices;
    }
    let spacing = slices[1].time - slices[0].time;
    let mut refined = Vec::with_capacity(count * parts as usize);
    for index in 0..count {
        for part in 0..parts {
            let offset = (f64::from(part) + 0.5) / f64::from(parts) - 0.5;
            let at = index as f64 + offset;
            let first = (at.floor().max(0.0) as usize).min(count - 2);
            let between = Between { slices: &slices, first, t: at - first as f64 };
            let own = &slices[index];
            refined.push(Slice {
                time: own.time + spacing * offset,
                edits: between.edits(&own.edits, |slice| Some(&slice.edits)),
                before: own.before.as_ref().map(|before| between.edits(before, |slice| slice.before.as_ref())),
            });
        }
    }
    refined
}

/// A place between two moments that follow each other; `t` is 0 at the first and 1 at the second, and may lie beyond.
struct Between<'a> {
    slices: &'a [Slice],
    first: usize,
    t: f64,
}

impl Between<'_> {
    /// Edits between those of the moments, or `own` where they have another shape.
    fn edits<'s>(&'s self, own: &[Edit], of: impl Fn(&'s Slice) -> Option<&'s Vec<Edit>>) -> Vec<Edit> {
        let at = |index: Option<usize>| self.slices.get(index?).and_then(&of);
        let (Some(a), Some(b)) = (at(Some(self.first)), at(Some(self.first + 1))) else { return own.to_vec() };
        if a.len() != own.len() || b.len() != own.len() {
            return own.to_vec();
        }
        let around = [at(self.first.checked_sub(1)), at(Some(self.first + 2))]
            .map(|all| all.filter(|all| all.len() == own.len()));
        let edit = |(i, own): (usize, &Edit)| {
            let step = MomentStep { ends: [&a[i], &b[i]], around: around.map(|all| all.map(|all| &all[i])), t: self.t };
            step.edit(own)
        };
        own.iter().enumerate().map(edit).collect()
    }
}

/// The same thing at two moments that follow each other, and at those before and behind, where there are any.
struct MomentStep<'a, T> {
    ends: [&'a T; 2],
    around: [Option<&'a T>; 2],
    t: f64,
}

impl<'a, T> MomentStep<'a, T> {
    /// A part of the thing, where both ends have it.
    fn part<U>(&self, of: impl Fn(&'a T) -> Option<&'a U>) -> Option<MomentStep<'a, U>> {
        let [a, b] = self.ends;
        Some(MomentStep { ends: [of(a)?, of(b)?], around: self.around.map(|one| one.and_then(&of)), t: self.t })
    }
}

impl MomentStep<'_, Edit> {
    fn edit(&self, own: &Edit) -> Edit {
        if self.ends[0] == self.ends[1] {
            return own.clone();
        }
        let mixed = match own {
            Edit::Camera(camera) => {
                let step = self.part(|edit| if let Edit::Camera(camera) = edit { Some(camera) } else { None });
                step.map(|step| Edit::Camera(step.record(camera)))
            }
            Edit::Material { index, material } => {
                let step = self.part(|edit| {
                    let Edit::Material { index: other, material } = edit else { return None };
                    (other == index).then_some(material)
                });
                step.map(|step| Edit::Material { index: *index, material: step.record(material) })
            }
            Edit::Put { entity, component } => {
                let step = self.part(|edit| {
                    let Edit::Put { entity: other, component } = edit else { return None };
                    (other == entity).then_some(component)
                });
                step.and_then(|step| Some(Edit::Put { entity: *entity, component: step.component(component)? }))
            }
            Edit::Spawn(desc) => {
                let step = self.part(|edit| if let Edit::Spawn(desc) = edit { Some(desc) } else { None });
                step.map(|step| Edit::Spawn(step.entity(desc)))
            }
            Edit::Cameras(_)
            | Edit::Render(_)
            | Edit::AddMaterial { .. }
            | Edit::Take { .. }
            | Edit::Tags { .. }
            | Edit::Despawn { .. } => None,
        };
        mixed.unwrap_or_else(|| own.clone())
    }
}

impl MomentStep<'_, EntityDesc> {
    fn entity(&self, own: &EntityDesc) -> EntityDesc {
        let mut mixed = own.clone();
        for component in own.components() {
            let kind = component.kind();
            if let Some(between) = self.part(|desc| desc.get(kind)).and_then(|step| step.component(component)) {
                mixed.put(between);
            }
        }
        mixed
    }
}

impl MomentStep<'_, Component> {
    /// `None` for another kind of component than those at the ends, and for what is not made of numbers.
    fn component(&self, own: &Component) -> Option<Component> {
        let kind = own.kind();
        if self.ends.iter().any(|end| end.kind() != kind) || self.ends[0] == self.ends[1] {
            return None;
        }
        let mut mixed = own.clone();
        let records = self.around.map(|one| one.filter(|one| one.kind() == kind).map(Component::record));
        mix(mixed.record_mut(), self.ends.map(Component::record), records, self.t);
        mixed.record().check().is_ok().then_some(mixed)
    }
}

impl<T: Record + Clone> MomentStep<'_, T> {
    fn record(&self, own: &T) -> T {
        let mut mixed = own.clone();
        mix(
            &mut mixed,
            self.ends.map(|end| end as &dyn Record),
            self.around.map(|one| one.map(|one| one as &dyn Record)),
            self.t,
        );
        if mixed.check().is_ok() { mixed } else { own.clone() }
    }
}

/// Sets every field of `mixed` that is a number, or numbers, to what lies between the ends.
fn mix(mixed: &mut dyn Record, [a, b]: [&dyn Record; 2], around: [Option<&dyn Record>; 2], t: f64) {
    let fields = mixed.fields().iter().zip(mixed.classes());
    for (field, _) in fields.filter(|(_, class)| **class != FieldClass::Data) {
        let numbers = |record: &dyn Record| record.get(field).and_then(|value| numbers_of(&value));
        let (Some(from), Some(to)) = (numbers(a), numbers(b)) else { continue };
        let (from, to) = alike(from, to);
        if from == to || from.len() != to.len() {
            continue;
        }
        let turns = *field == "rotation";
        let step =
            |from: f64, to: f64| if turns && (to - from).abs() > 180.0 { shortest_turn(from, to) } else { to - from };
        let length = |from: &[f64], to: &[f64]| -> f64 { from.iter().zip(to).map(|(a, b)| step(*a, *b).abs()).sum() };
        let neighbours = around.map(|record| record.and_then(numbers).map(|all| alike(all, from.clone()).0));
        let before = neighbours[0].as_ref().map(|all| length(all, &from));
        let behind = neighbours[1].as_ref().map(|all| length(&to, all));
        if let Some(usual) = before.into_iter().chain(behind).reduce(|a, b| a + b)
            && length(&from, &to) > JUMP * usual
        {
            continue;
        }
        let between: Vec<Value> = from.iter().zip(&to).map(|(a, b)| Value::Number(a + step(*a, *b) * t)).collect();
        // A field that takes no such numbers, as one of whole ones, keeps what it has.
        let value = if between.len() == 1 && !matches!(a.get(field), Some(Value::List(_))) {
            between.into_iter().next().unwrap_or(Value::Unit)
        } else {
            Value::List(between)
        };
        let _ = mixed.set(field, &value);
    }
}

/// One number for all three of another value.
fn alike(a: Vec<f64>, b: Vec<f64>) -> (Vec<f64>, Vec<f64>) {
    match (a.len(), b.len()) {
        (1, 3) => (vec![a[0]; 3], b),
        (3, 1) => (a, vec![b[0]; 3]),
        _ => (a, b),
    }
}

/// The numbers of a value that is made of fractions alone.
fn numbers_of(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Number(x) => Some(vec![*x]),
        Value::Vec3(v) => Some(v.to_array().to_vec()),
        Value::List(items) if !items.is_empty() => {
            items.iter().map(|item| if let Value::Number(x) = item { Some(*x) } else { None }).collect()
        }
        Value::Unit | Value::Bool(_) | Value::Int(_) | Value::Text(_) | Value::List(_) | Value::Map(_) => None,
    }
}
