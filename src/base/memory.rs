//! Memory that the program holds, where its allocator counts.
//!
//! A program that has a counting allocator says so once, as `main` of `anim` does. A library cannot choose the allocator
//! of the program that it is part of: where nobody has said anything, nothing is known.

use std::sync::OnceLock;

/// What a counting allocator can tell and do.
#[derive(Clone, Copy)]
pub struct AllocatorHooks {
    /// Bytes that are allocated now.
    pub held: fn() -> usize,
    /// Lets an allocation that would lead beyond so many bytes fail, which ends the process.
    pub limit: fn(usize),
}

static HOOKS: OnceLock<AllocatorHooks> = OnceLock::new();

/// Says once how the allocator of this program is asked.
pub fn install(hooks: AllocatorHooks) {
    // Whoever comes second speaks of the same allocator: a program has one.
    let _ = HOOKS.set(hooks);
}

/// Bytes that are allocated now.
pub fn held() -> Option<usize> {
    HOOKS.get().map(|hooks| (hooks.held)())
}

/// Lets allocations beyond so many bytes fail.
pub fn limit(bytes: usize) {
    if let Some(hooks) = HOOKS.get() {
        (hooks.limit)(bytes);
    }
}
