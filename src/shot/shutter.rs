//! The moments of a frame while the shutter is open.
//!
//! A frame is cut into slices of time (the accumulation of Haeberli and Akeley, SIGGRAPH 1990): the script is evaluated
//! for the middle of each, and each traces its share of every pixel's samples. So whatever moves is blurred, along
//! curves too, and shadows, mirror images and the lens with it.
//!
//! Where motion is a layer, each slice goes with the same moment of the frame before.

use super::fingerprint::{BaseFingerprint, Fingerprint};
use super::{Input, Shot, guarded};
use crate::base::diagnostics::Diagnostics;
use crate::components::{Aov, Camera, Edit, Render};
use crate::script::TimeMode;
use crate::systems::{self, PreviousFrame, Stage, Undo};
use crate::trace::integrator::SampleSubset;

/// One moment of a frame as data.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// When it is, in frames from the frame's own time: what entities with `motion` go by.
    pub time: f64,
    /// What leads from the base scene to this moment.
    pub edits: Vec<Edit>,
    /// The edits one frame earlier, where there is one and its layers tell what has moved since.
    pub before: Option<Vec<Edit>>,
}

impl Slice {
    /// The moment as data.
    pub(super) fn fingerprint(&self, rest: &BaseFingerprint) -> Fingerprint {
        rest.fingerprint_after(&self.edits, self.before.as_deref())
    }
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
        let [open, close] = last_camera(&own).unwrap_or(self.base.camera()).shutter.to_array();
        let settings = render.as_ref().unwrap_or(&self.settings);
        let count = if close > open { settings.moments() } else { 1 };
        let earlier = self.frame_before(frame).filter(|_| settings.aovs.contains(&Aov::Motion));
        let edits_at = |frame: u32, time: f64| {
            let mut edits = self.edits_at(frame, time)?;
            edits.retain(|edit| !matches!(edit, Edit::Render(_)));
            edits.extend(render.clone().map(Edit::Render));
            Ok::<_, Diagnostics>(edits)
        };
        let slice = |i: u32| {
            let time = open + (close - open) * ((f64::from(i) + 0.5) / f64::from(count));
            let is_own = self.program.is_none() || time == 0.0;
            let edits = if is_own { own.clone() } else { edits_at(frame, time)? };
            let before = earlier.map(|earlier| edits_at(earlier, time)).transpose()?;
            Ok(Slice { time, edits, before })
        };
        (0..count).map(slice).collect()
    }

    /// The frame that is seen before another one: the last before the first of a loop, none before the first of a clip.
    fn frame_before(&self, frame: u32) -> Option<u32> {
        let header = self.program.as_ref()?.0.header();
        match header.mode {
            _ if frame > 1 => Some(frame - 1),
            TimeMode::Loop => Some(header.frames),
            TimeMode::Clip => None,
        }
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
        mut work: impl FnMut(&mut Stage, SampleSubset) -> Result<bool, Diagnostics>,
    ) -> Result<(), Diagnostics> {
        let of = slices.len() as u32;
        let mut applied = Applied::default();
        let mut done = Ok(true);
        for (index, slice) in (0..).zip(slices) {
            let share = SampleSubset { index, of };
            done = applied.show(stage, slice).and_then(|()| guarded(stage, |stage| work(stage, share)));
            if !matches!(done, Ok(true)) {
                break;
            }
        }
        applied.take_back(stage);
        stage.set_previous_frame(None);
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
    /// Puts a slice in the place of the one before, with its past.
    fn show(&mut self, stage: &mut Stage, slice: Slice) -> Result<(), Diagnostics> {
        let Slice { time, edits, before } = slice;
        stage.set_time(time);
        stage.set_previous_frame(None);
        if let Some(before) = before {
            self.go_to(stage, before).map_err(in_the_frame_before)?;
            stage.set_previous_frame(Some(PreviousFrame::of(stage)));
        }
        self.go_to(stage, edits)
    }

    /// Puts edits in the place of those before. What both have in common is left alone.
    fn go_to(&mut self, stage: &mut Stage, edits: Vec<Edit>) -> Result<(), Diagnostics> {
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
        self.edits.clear();
        while let Some(undo) = self.undos.pop() {
            systems::undo(stage, undo);
        }
    }
}

fn in_the_frame_before(mut problems: Diagnostics) -> Diagnostics {
    problems.0.iter_mut().for_each(|problem| problem.message = format!("in the frame before: {}", problem.message));
    problems
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
        (Edit::Camera(_), Edit::Camera(_))
        | (Edit::Cameras(_), Edit::Cameras(_))
        | (Edit::Render(_), Edit::Render(_)) => true,
        (Edit::Material { index: a, .. }, Edit::Material { index: b, .. }) => a == b,
        (Edit::Put { entity: a, component: old }, Edit::Put { entity: b, component: new }) => {
            a == b && old.kind() == new.kind()
        }
        (Edit::Tags { entity: a, .. }, Edit::Tags { entity: b, .. }) => a == b,
        (
            Edit::Camera(_)
            | Edit::Cameras(_)
            | Edit::Render(_)
            | Edit::Material { .. }
            | Edit::Put { .. }
            | Edit::Tags { .. }
            | Edit::AddMaterial { .. }
            | Edit::Take { .. }
            | Edit::Spawn(_)
            | Edit::Despawn { .. },
            _,
        ) => false,
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
        let material = Edit::Put { entity: 0, component: MaterialName("x".into()).into() };
        assert_eq!(step(&from, &[camera(40.0), material, ball(1, 2.0)]), None);
        let gone = |entity| [Edit::Despawn { entity }];
        assert_eq!(step(&gone(0), &gone(1)), None);
    }
}
