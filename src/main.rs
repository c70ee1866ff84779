//! The thin binary: arguments in, exit code out, and an allocator that counts, so that scripts have a budget of bytes.

use std::alloc::System;

use anim::base::memory::{self, AllocatorHooks};
use cap::Cap;

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

fn main() -> std::process::ExitCode {
    memory::install(AllocatorHooks {
        held: || ALLOCATOR.allocated(),
        // A limit below what is held already is none.
        limit: |bytes| ALLOCATOR.set_limit(bytes).unwrap_or_default(),
    });
    anim::cli::main(std::env::args_os().collect())
}
