//! What one thread owns while it traces.

use super::buffers::WavefrontBuffers;
use crate::trace::accel::TraversalScratch;
use crate::trace::counters::Counters;
use crate::trace::reuse::Footprint;

/// Memory and counters of one thread, each part for the room that works with it.
#[derive(Default)]
pub struct Worker {
    /// Walks through accelerators, and what they cost.
    pub traversal: TraversalScratch,
    /// Waves of rays.
    pub waves: WavefrontBuffers,
    /// What the rays of the tile crossed, where that is noted.
    pub footprint: Footprint,
}

impl Worker {
    /// Forgets how packets fared: what a tile costs does not depend on the tiles before.
    pub fn start_tile(&mut self) {
        self.traversal.start_tile();
    }

    /// The counters since the last call.
    pub fn take_counters(&mut self) -> Counters {
        std::mem::take(&mut self.traversal.counters)
    }
}
