//! Animations of a glTF file -> clips.

use super::document::{Document, at, field, item};
use super::json::KeysJson;
use super::warnings::Warnings;
use crate::components::{Clip, KeyInterpolation, Text, Track, TrackProperty};
use crate::load::names::Names;
use crate::load::resolve::Problem;
use crate::load::spans::Step;

/// What clips need to know of a node.
pub struct AnimatedNode {
    /// What the node is called in the asset; `None` if it is not shown.
    pub name: Option<Text>,
    /// Morph targets of its mesh.
    pub targets: usize,
}

impl Document {
    /// The clips of the file, each name once.
    ///
    /// # Errors
    /// Keys that are not in order, or values that do not fit them.
    pub fn clips(
        &self,
        node: &dyn Fn(usize) -> Option<AnimatedNode>,
        warnings: &mut Warnings,
    ) -> Result<Vec<Clip>, Problem> {
        let (mut clips, mut names) = (Vec::new(), Names::default());
        for (i, animation) in self.root.animations.iter().enumerate() {
            let path = at("animations", i);
            let plain = animation.name.clone().filter(|name| !name.is_empty()).unwrap_or(format!("clip{i}"));
            let name = names.give(&plain);
            let mut tracks = Vec::new();
            for (k, channel) in animation.channels.iter().enumerate() {
                let path = item(field(path.clone(), "channels"), k);
                let property = match channel.target.path.as_str() {
                    "translation" => TrackProperty::Translation,
                    "rotation" => TrackProperty::Rotation,
                    "scale" => TrackProperty::Scale,
                    "weights" => TrackProperty::Weights,
                    other => {
                        warnings.add(&format!("animated {other}"), || {
                            let what = if other == "pointer" { "a pointer" } else { other };
                            Problem::new(path.clone(), format!("the animation of {what} is not used"))
                        });
                        continue;
                    }
                };
                // A channel without a target is there for an extension.
                let Some(target) = channel.target.node else { continue };
                let Some(found) = node(target.0) else {
                    let message = format!("there is no node {}; there are {}", target.0, self.root.nodes.len());
                    return Err(Problem::new(field(path, "target"), message));
                };
                let width = match property {
                    TrackProperty::Translation | TrackProperty::Scale => 3,
                    TrackProperty::Rotation => 4,
                    TrackProperty::Weights => found.targets,
                    TrackProperty::Visibility => 1,
                };
                let Some(node) = found.name.filter(|_| width > 0) else { continue };
                let Some(keys) = animation.samplers.get(channel.sampler.0) else {
                    let message = format!("there is no sampler {} in this animation", channel.sampler.0);
                    return Err(Problem::new(field(path, "sampler"), message));
                };
                let path = item(field(at("animations", i), "samplers"), channel.sampler.0);
                tracks.push(self.track(keys, (node, property, width), path)?);
            }
            clips.push(Clip { name, tracks });
        }
        Ok(clips)
    }

    fn track(
        &self,
        keys: &KeysJson,
        (node, property, width): (Text, TrackProperty, usize),
        path: Vec<Step>,
    ) -> Result<Track, Problem> {
        let interpolation = match keys.interpolation.as_deref().unwrap_or("LINEAR") {
            "STEP" => KeyInterpolation::Step,
            "LINEAR" => KeyInterpolation::Linear,
            "CUBICSPLINE" => KeyInterpolation::CubicSpline,
            other => {
                let message = format!("unknown interpolation `{other}`; known: STEP, LINEAR, CUBICSPLINE");
                return Err(Problem::new(field(path, "interpolation"), message));
            }
        };
        let (times, _) = self.floats(keys.input.0, &["SCALAR"])?;
        let shape = match property {
            TrackProperty::Translation | TrackProperty::Scale => "VEC3",
            TrackProperty::Rotation => "VEC4",
            TrackProperty::Weights | TrackProperty::Visibility => "SCALAR",
        };
        let (values, _) = self.floats(keys.output.0, &[shape])?;
        let in_order = times.windows(2).all(|pair| pair[0] <= pair[1]);
        if !in_order || !times.iter().all(|t| t.is_finite()) {
            return Err(Problem::new(field(path, "input"), "the times of keys must rise"));
        }
        if let Some(bad) = values.iter().find(|x| !x.is_finite()) {
            return Err(Problem::new(field(path, "output"), format!("a key is {bad}, which is no number")));
        }
        let each = if interpolation == KeyInterpolation::CubicSpline { 3 * width } else { width };
        if times.is_empty() || values.len() != times.len() * each {
            let message = format!("{} numbers for {} keys: {each} a key", values.len(), times.len());
            return Err(Problem::new(field(path, "output"), message));
        }
        Ok(Track { node, property, interpolation, times, values, width })
    }
}
