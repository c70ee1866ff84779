//! `anim render --tiles`: a part of each frame, which `anim merge` joins.

use std::sync::atomic::AtomicBool;

use super::super::{Exit, usage};
use super::{FrameArguments, RenderArguments, plan_into, render};
use crate::base::diagnostics::Diagnostics;
use crate::farm::archive::ENDING;
use crate::farm::tiles::part_of;

/// Renders the i-th of n parts.
pub fn render_tile(arguments: &RenderArguments, [i, n]: [u32; 2], cancel: &AtomicBool) -> Result<Exit, Diagnostics> {
    let wanted = FrameArguments { shard: None, ..arguments.wanted.clone() };
    let input = wanted.input.input.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let stem = input.strip_suffix(ENDING).or_else(|| input.rsplit_once('.').map(|(stem, _)| stem)).unwrap_or(&input);
    let out = wanted.out.clone().unwrap_or_else(|| format!("{stem}.tile-{i}-of-{n}.exr"));
    if !out.to_lowercase().ends_with(".exr") {
        return Err(usage(format!(
            "-o {out}: a tile is an EXR file, which says where in the frame it lies: {stem}.{i}.exr"
        )));
    }
    if arguments.claims {
        return Err(usage("--claims: tiles are told apart by their numbers, and need no claims"));
    }
    let (_, whole) = plan_into(&wanted, Some(&out), cancel)?;
    let mut sizes = whole.frames.iter().filter_map(|planned| Some(planned.fingerprint.as_ref().ok()?.size));
    let size = sizes.next().unwrap_or([1, 1]);
    if let Some(other) = sizes.find(|other| *other != size) {
        return Err(usage(format!(
            "--tiles: one frame has {size:?} pixels and another {other:?}; give all one --size"
        )));
    }
    let part = part_of(size, i, n).ok_or_else(|| {
        usage(format!("--tiles {i}/{n}: a frame of {}x{} has not so many squares of 16 pixels", size[0], size[1]))
    })?;
    let wanted = FrameArguments { look: wanted.look.with_region(part), ..wanted };
    let (mut shot, mut plan) = plan_into(&wanted, Some(&out), cancel)?;
    for (planned, whole) in plan.frames.iter_mut().zip(&whole.frames) {
        planned.whole = Some(whole.hash);
    }
    if let Some([i, n]) = arguments.wanted.shard {
        plan.keep_shard(i, n);
    }
    render(arguments, &mut shot, plan, cancel, &|_| {})
}
