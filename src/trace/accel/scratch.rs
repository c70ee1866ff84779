//! What one thread owns while it walks through accelerators.

use super::stream::{LooseRays, StreamScratch};
use crate::trace::counters::Counters;

/// Slots of a mailbox: enough for the primitives that a ray meets again in neighbouring cells.
const SLOTS: usize = 64;

/// What one thread owns while it walks through accelerators, and what that costs.
pub struct TraversalScratch {
    /// What was counted since they were taken last.
    pub counters: Counters,
    /// Primitive and ray of the last test in each slot; a slot that was taken over only costs a second test.
    pub mailbox: [(u32, u32); SLOTS],
    /// The number of the ray whose marks count.
    pub ray: u32,
    /// Children of nodes that are still to be visited, nearest last.
    pub stack: Vec<u64>,
    /// Rays in the order in which packets take them.
    pub order: Vec<u32>,
    /// Rays of a batch without a packet, and room for streams of them.
    pub loose: LooseRays,
    /// For many rays at once.
    pub streams: StreamScratch,
    /// Packets in a row whose rays parted ways, and how many to trace without one before the next attempt.
    pub failures: u32,
    /// Streams that are not tried, since those before them did not pay.
    pub wait: u32,
}

impl Default for TraversalScratch {
    fn default() -> Self {
        TraversalScratch {
            counters: Counters::default(),
            mailbox: [(u32::MAX, 0); SLOTS],
            ray: 0,
            stack: Vec::new(),
            order: Vec::new(),
            loose: LooseRays::default(),
            streams: StreamScratch::default(),
            failures: 0,
            wait: 0,
        }
    }
}

impl TraversalScratch {
    /// Forgets how packets fared: what a tile costs does not depend on the tiles before.
    pub fn start_tile(&mut self) {
        (self.failures, self.wait) = (0, 0);
    }

    /// Makes all marks those of rays before.
    pub fn next_ray(&mut self) {
        self.ray = self.ray.wrapping_add(1);
        if self.ray == 0 {
            self.mailbox = [(u32::MAX, 0); SLOTS];
            self.ray = 1;
        }
    }

    /// Whether this ray has not met the primitive yet, as far as the mailbox remembers.
    #[inline]
    pub fn is_new(&mut self, primitive: u32) -> bool {
        let slot = &mut self.mailbox[primitive as usize % SLOTS];
        let new = *slot != (primitive, self.ray);
        *slot = (primitive, self.ray);
        new
    }
}
