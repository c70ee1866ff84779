//! A clip of an asset as a sequence, for inputs that move without a script.

use std::sync::Arc;

use ::rhai::Dynamic;

use super::Moment;
use super::clips::{Playing, play};
use super::context::ScriptContext;
use super::handles::SceneHandle;
use super::overlay::{NameIndex, Overlay};
use super::time::{FrameTime, Header};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::components::{Edit, Scene, Text};

/// The frames of one clip.
pub struct ClipFrames {
    /// The entity whose asset has the clip.
    pub entity: Text,
    /// Its name.
    pub clip: Text,
    /// Seconds of the clip at the first and at the last frame.
    pub span: [f64; 2],
}

impl ClipFrames {
    /// The edits of a frame at a time.
    ///
    /// # Errors
    /// What the clip makes of the scene is out of range.
    pub fn call(&self, header: &Header, scene: &Arc<Scene>, time: Option<Moment>) -> Result<Vec<Edit>, Diagnostics> {
        let Some((number, offset)) = time else { return Ok(Vec::new()) };
        let [start, end] = self.span;
        let seconds = start + (end - start) * FrameTime::new(header, number, offset, 0, Dynamic::UNIT).share();
        let overlay = Overlay::new(scene.clone(), Arc::new(NameIndex::new(scene)));
        let mut handle = SceneHandle::new(overlay, 0, offset, ScriptContext::default());
        let playing = Playing { seconds, repeat: false, weight: 1.0 };
        let played = handle.get(&self.entity).and_then(|mut entity| play(&mut entity, &self.clip, playing));
        match played {
            Ok(_) => Ok(handle.into_edits()),
            Err(error) => Err(Diagnostic::error(error.to_string()).into()),
        }
    }
}
