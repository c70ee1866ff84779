//! Frames that are too large to be made at once: band by band, each encoded before the next is traced.
//!
//! A pixel does not depend on what is traced with it, so that the file is to the byte what making the frame at once
//! gives; noise is filtered out of rows as soon as all around them is there.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use glam::Vec3;

use super::{Shot, Slice, files, shutter};
use crate::base::diagnostics::{Diagnostic, Diagnostics};
use crate::base::digest::Digest;
use crate::base::{limits, memory};
use crate::components::Render;
use crate::film::{Film, PixelBounds, RowDenoiser};
use crate::output::{Format, Provenance, frame_metadata, with_whole};
use crate::systems::{self, FrameStats, LightGroups, PartialFrame, TileGrid};

/// How a frame is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameSize {
    /// At once.
    Usual,
    /// In bands, unless something of it is kept for other frames, or of others for it.
    Large,
    /// In bands: all of it is more than may be held.
    Huge,
}

/// How large a frame with these settings and so many light groups is.
pub fn size_of_frame(settings: &Render, light_groups: usize) -> FrameSize {
    let bytes = TileGrid::new(settings).traced.count() as u64 * systems::bytes_of_pixel(settings, light_groups);
    if memory::left().is_some_and(|left| left < bytes) {
        FrameSize::Huge
    } else if bytes > limits::FRAME_AT_ONCE {
        FrameSize::Large
    } else {
        FrameSize::Usual
    }
}

/// What a frame that is made in bands is made of.
pub struct BandedFrame<'a> {
    pub frame: u32,
    pub slices: Vec<Slice>,
    pub settings: Render,
    /// Emitters with a film of their own, and the factors of all films but the first.
    pub light_groups: LightGroups,
    pub factors: Vec<Vec3>,
    /// Of the file that the frame is encoded for.
    pub provenance: &'a Provenance,
    /// The hash of the whole frame, of a tile.
    pub whole: Option<Digest>,
    pub file: &'a Path,
}

/// The bytes of a frame's file, and what it cost; `None` if `cancel` was raised. `progress` is told of tiles that are
/// done, out of all.
///
/// # Errors
/// Those of the frame; a file that cannot hold it.
pub fn render(
    shot: &mut Shot,
    frame: &BandedFrame,
    format: &Format,
    cancel: &AtomicBool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Option<(Vec<u8>, FrameStats)>, Diagnostics> {
    let mut bands = BandRenderer::new(shot, frame);
    let Some(first) = bands.next(cancel, progress)? else { return Ok(None) };
    let metadata = frame_metadata(frame.provenance, bands.stats.seed, &frame.settings);
    let metadata = with_whole(metadata, frame.whole);
    let (mut first, mut failure, mut cancelled) = (Some(first), None, false);
    let mut next = || {
        first.take().or_else(|| match bands.next(cancel, progress) {
            Ok(rows) => {
                cancelled = rows.is_none();
                rows
            }
            Err(problems) => {
                failure = Some(problems);
                None
            }
        })
    };
    let [_, size] = frame.settings.pixel_bounds();
    let encoded = (format.encode_rows)(size, &frame.settings, &metadata, &mut next);
    if let Some(problems) = failure {
        return Err(problems);
    }
    if cancelled {
        return Ok(None);
    }
    let failed = |why: String| Diagnostic::error(format!("cannot encode {}: {why}", frame.file.display()));
    Ok(Some((encoded.map_err(failed)?, bands.stats)))
}

/// The bands of one frame, from the top.
struct BandRenderer<'a> {
    shot: &'a mut Shot,
    frame: &'a BandedFrame<'a>,
    bounds: PixelBounds,
    left: std::vec::IntoIter<PixelBounds>,
    /// One for each light group, where noise is filtered out.
    denoisers: Vec<RowDenoiser>,
    /// Tiles of all bands, and of those that are done.
    tiles: [usize; 2],
    stats: FrameStats,
}

impl<'a> BandRenderer<'a> {
    fn new(shot: &'a mut Shot, frame: &'a BandedFrame<'a>) -> Self {
        let settings = &frame.settings;
        let (grid, groups) = (TileGrid::new(settings), frame.factors.len() + 1);
        // What is left serves the bands before and behind, and the file, too.
        let bytes = memory::left().map_or(limits::BAND_BYTES, |left| limits::BAND_BYTES.min(left / 4));
        let rows = grid.rows_within(bytes, systems::bytes_of_pixel(settings, groups));
        let denoiser = |_| RowDenoiser::new(grid.traced);
        let denoisers = if settings.denoise { (0..groups).map(denoiser).collect() } else { Vec::new() };
        let left: Vec<PixelBounds> = grid.bands(rows).collect();
        let (left, tiles) = (left.into_iter(), [grid.count(), 0]);
        BandRenderer { shot, frame, bounds: grid.bounds, left, denoisers, tiles, stats: FrameStats::default() }
    }

    /// The next rows of the frame; `None` if `cancel` was raised, or all are given.
    fn next(
        &mut self,
        cancel: &AtomicBool,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Option<Film>, Diagnostics> {
        while let Some(band) = self.left.next() {
            let Some(films) = self.trace(band, cancel, progress)? else { return Ok(None) };
            let mut ready: Vec<(PixelBounds, Film)> = Vec::new();
            if self.denoisers.is_empty() {
                ready.extend(films.into_iter().map(|film| (band, film)));
            } else {
                let pairs = self.denoisers.iter_mut().zip(films);
                ready.extend(pairs.filter_map(|(denoiser, film)| denoiser.add(band, film)));
            }
            // Of what was traced around a region nothing is shown.
            let shown = ready.first().and_then(|(bounds, _)| bounds.common(self.bounds));
            let (Some(shown), Some(((bounds, first), others))) = (shown, ready.split_first()) else { continue };
            let crop = |film: &Film| film.cropped(*bounds, shown);
            let others: Vec<Film> = others.iter().map(|(_, film)| crop(film)).collect();
            return Ok(Some(systems::weighted_sum(&crop(first), &others, &self.frame.factors)));
        }
        Ok(None)
    }

    /// Traces a band, a film for each light group.
    fn trace(
        &mut self,
        band: PixelBounds,
        cancel: &AtomicBool,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Option<Vec<Film>>, Diagnostics> {
        let BandedFrame { frame, slices, light_groups, .. } = self.frame;
        let mut partial = PartialFrame::of_band(band, light_groups.clone());
        let [total, before] = self.tiles;
        let of_band = TileGrid::of_band(band).count();
        let tiles = |done: usize, of: usize| progress(before + done * of_band / of.max(1), total);
        let (Shot { stage, input, .. }, mut whole) = (&mut *self.shot, true);
        input.with_slices(stage, *frame, slices.clone(), |stage, share| {
            files::load_all(stage)?;
            whole = systems::render_samples(stage, share, &mut partial, cancel, &tiles)?;
            Ok(whole)
        })?;
        if !whole {
            return Ok(None);
        }
        let (films, stats) = partial.resolve()?;
        self.tiles[1] += of_band;
        self.stats.add_band(stats);
        Ok(Some(films))
    }
}

/// The settings that the slices of a frame are rendered with.
pub fn settings_of<'a>(slices: &'a [Slice], usual: &'a Render) -> &'a Render {
    slices.first().and_then(|slice| shutter::last_render(&slice.edits)).unwrap_or(usual)
}
