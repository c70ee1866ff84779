//! The moments of a frame while the shutter is open.
//!
//! A frame is cut into slices of time (the accumulation of Haeberli and Akeley, SIGGRAPH 1990): the script is evaluated
//! for the middle of each, and each traces its share of every pixel's samples. So whatever moves is blurred, along
//! curves too, and shadows, mirror images and the lens with it.

use super::{Input, Shot, guarded};
use crate::base::diagnostics::Diagnostics;
use crate::components::{Camera, Edit, Render};
use crate::systems::{self, Stage, Undo};
use crate::trace::integrator::Share;

/// One moment of a frame as data.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// When it is, in frames from the frame's own time: what entities with `motion` go by.
    pub time: f64,
    pub edits: Vec<Edit>,
}

impl Shot {
    /// Everything that a frame, counted from 1, is made of: its moments in their order, one at least.
    ///
    /// The settings of the picture are those of the frame's own time, in every slice.
    ///
    /// # Errors
    /// A mistake in the script, with its place and the frame.
    pub fn slices(&self, frame: u32) -> Result<Vec<Slice>, Diagnostics> {
        self.input.slices(frame)
    }
}

impl Input {
    /// As [`Shot::slices`].
    pub(super) fn slices(&self, frame: u32) -> Result<Vec<Slice>, Diagnostics> {
        let own = self.edits(frame)?;
        let render = last_render(&own).cloned();
        let [open, close] = last_camera(&own).unwrap_or(self.rest.camera()).shutter.to_array();
        let count = if close > open { render.as_ref().unwrap_or(&self.settings).moments() } else { 1 };
        let slice = |i: u32| {
            let time = open + (close - open) * ((f64::from(i) + 0.5) / f64::from(count));
            if self.program.is_none() || time == 0.0 {
                return Ok(Slice { time, edits: own.clone() });
            }
            let mut edits = self.edits_at(frame, time)?;
            edits.retain(|edit| !matches!(edit, Edit::Render(_)));
            edits.extend(render.clone().map(Edit::Render));
            Ok(Slice { time, edits })
        };
        (0..count).map(slice).collect()
    }

    /// Does something with the World of each slice of a frame, in their order, while it says true; then takes all edits
    /// of the frame back.
    ///
    /// # Errors
    /// As [`Self::with_frame`].
    pub(super) fn with_slices(
        &self,
        stage: &mut Stage,
        frame: u32,
        slices: Vec<Slice>,
        mut work: impl FnMut(&mut Stage, Share) -> Result<bool, Diagnostics>,
    ) -> Result<(), Diagnostics> {
        let of = slices.len() as u32;
        let mut applied = Applied::default();
        let mut done = Ok(true);
        for (index, slice) in (0..).zip(slices) {
            let share = Share { index, of };
            done = applied.show(stage, slice).and_then(|()| guarded(stage, |stage| work(stage, share)));
            if !matches!(done, Ok(true)) {
                break;
            }
        }
        applied.take_back(stage);
        done.map(drop).map_err(|problems| self.in_frame(frame, problems))
    }
}

/// What stands in the World beyond its rest, and how to take it back.
#[derive(Default)]
struct Applied {
    edits: Vec<Edit>,
    undos: Vec<Undo>,
}

impl Applied {
    /// Puts a slice in the place of the one before. What both have in common is left alone.
    fn show(&mut self, stage: &mut Stage, slice: Slice) -> Result<(), Diagnostics> {
        let Slice { time, edits } = slice;
        stage.set_time(time);
        let step = match step(&self.edits, &edits) {
            Some(step) => step,
            None => {
                self.take_back(stage);
                edits.clone()
            }
        };
        self.undos.push(systems::animate(stage, step)?);
        self.edits = edits;
        Ok(())
    }

    fn take_back(&mut self, stage: &mut Stage) {
        while let Some(undo) = self.undos.pop() {
            systems::undo(stage, undo);
        }
    }
}

/// The edits that lead on from one list to another of the same shape; `None` if the way there leads over the rest.
fn step(from: &[Edit], to: &[Edit]) -> Option<Vec<Edit>> {
    if from.len() != to.len() {
        return None;
    }
    let pairs = || from.iter().zip(to).filter(|(a, b)| a != b);
    pairs().all(|(a, b)| replaces(a, b)).then(|| pairs().map(|(_, b)| b.clone()).collect())
}

/// Whether an edit overwrites all that another has done.
fn replaces(old: &Edit, new: &Edit) -> bool {
    match (old, new) {
        (Edit::Camera(_), Edit::Camera(_)) | (Edit::Render(_), Edit::Render(_)) => true,
        (Edit::Material { index: a, .. }, Edit::Material { index: b, .. }) => a == b,
        (Edit::Put { entity: a, component: old }, Edit::Put { entity: b, component: new }) => {
            a == b && old.kind() == new.kind()
        }
        (Edit::Tags { entity: a, .. }, Edit::Tags { entity: b, .. }) => a == b,
        _ => false,
    }
}

fn last_camera(edits: &[Edit]) -> Option<&Camera> {
    edits.iter().rev().find_map(|edit| if let Edit::Camera(camera) = edit { Some(camera) } else { None })
}

pub(super) fn last_render(edits: &[Edit]) -> Option<&Render> {
    edits.iter().rev().find_map(|edit| if let Edit::Render(render) = edit { Some(render) } else { None })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::components::{MaterialName, Sphere};

    fn ball(entity: usize, radius: f64) -> Edit {
        Edit::Put { entity, component: Sphere { radius, ..Sphere::default() }.into() }
    }

    #[test]
    fn a_step_holds_what_differs_and_nothing_that_cannot_be_overwritten() {
        let camera = |fov: f64| Edit::Camera(Camera { fov, ..Camera::default() });
        let from = [camera(40.0), ball(0, 1.0), ball(1, 2.0)];
        assert_eq!(step(&from, &from), Some(vec![]));
        let next = [camera(41.0), ball(0, 1.0), ball(1, 2.5)];
        assert_eq!(step(&from, &next), Some(vec![camera(41.0), ball(1, 2.5)]));
        assert_eq!(step(&from, &next[..2]), None);
        assert_eq!(step(&from, &[camera(40.0), ball(1, 1.0), ball(1, 2.0)]), None);
        let worn = Edit::Put { entity: 0, component: MaterialName("x".into()).into() };
        assert_eq!(step(&from, &[camera(40.0), worn, ball(1, 2.0)]), None);
        let gone = |entity| [Edit::Despawn { entity }];
        assert_eq!(step(&gone(0), &gone(1)), None);
    }
}
