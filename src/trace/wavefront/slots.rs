//! Where the light of a sample is added up: for each light group, or for each scene that a shadow catcher is seen in.

use super::path_state::PathState;
use crate::trace::material::ShadingParams;

/// Samples that go through the scene together: enough to keep packets full, few enough for the cache.
pub const BATCH: usize = 2048;

/// Rows of slots where there are shadow catchers, whose pictures have one light group.
pub const CATCHER_ROWS: usize = 5;

/// Where the light of a light group is added up for a sample.
#[inline]
pub fn accumulator_slot(sample: u32, group: u32) -> u32 {
    sample + group * BATCH as u32
}

/// The sample of such a slot.
#[inline(always)]
pub fn slot_sample(slot: u32) -> u32 {
    slot % BATCH as u32
}

/// The light group of a slot, or the row of it where there are shadow catchers.
#[inline]
pub fn slot_row(slot: u32) -> u32 {
    slot / BATCH as u32
}

/// What the light of a ray counts for, where there are catchers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CatcherRow {
    /// Light that the camera sees.
    Seen = 0,
    /// Light of a catcher, with objects and without.
    Both = 1,
    /// Light of a catcher that is there with the objects only.
    WithObjects = 2,
    /// Light of a catcher that is there without the objects only.
    WithoutObjects = 3,
    /// What the camera would see of the surroundings in place of a catcher.
    Behind = 4,
}

impl CatcherRow {
    /// The slot of a sample in this row.
    pub fn slot(self, sample: u32) -> u32 {
        accumulator_slot(sample, self as u32)
    }

    /// The row of a slot, in a scene with catchers or without.
    pub fn of(catchers: bool, slot: u32) -> CatcherRow {
        match slot_row(slot) {
            _ if !catchers => CatcherRow::Seen,
            0 => CatcherRow::Seen,
            1 => CatcherRow::Both,
            2 => CatcherRow::WithObjects,
            3 => CatcherRow::WithoutObjects,
            _ => CatcherRow::Behind,
        }
    }
}

/// Whether a ray goes on through surfaces of a material as if they were not there. Without catchers the slot of a path is
/// of the first row.
pub fn is_left_out(state: &PathState, material: &ShadingParams) -> bool {
    slot_row(state.sample) == CatcherRow::WithoutObjects as u32 && !material.stays_without_objects()
}
