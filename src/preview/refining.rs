//! Pictures that grow sharp: the tiles of the exact picture over a quick one, as they are traced.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::board::Board;
use super::pictures::{CurrentPicture, ShownPicture};
use crate::film::{DisplayTransform, PixelAccumulator};
use crate::systems::TileSink;

/// Least time between two pictures of one that is being traced.
pub const REFRESH: Duration = Duration::from_millis(120);

/// Shows tiles over `small`, the picture that `current` tells of, enlarged to `size`.
pub fn sink(
    board: &Arc<Board>,
    small: &ShownPicture,
    size: [u32; 2],
    current: CurrentPicture,
    display: DisplayTransform,
) -> TileSink {
    let state = Mutex::new(Refining { rgb: enlarged(small, size), size, last: Instant::now(), current });
    let board = board.clone();
    Arc::new(move |pixels: &[[u32; 2]], sums: &PixelAccumulator| {
        let mut refining = state.lock().unwrap_or_else(PoisonError::into_inner);
        refining.draw(pixels, sums, display);
        if refining.last.elapsed() >= REFRESH {
            refining.last = Instant::now();
            refining.show(&board);
        }
    })
}

/// A picture that is being traced, over the quick one.
struct Refining {
    rgb: Vec<u8>,
    size: [u32; 2],
    last: Instant,
    current: CurrentPicture,
}

impl Refining {
    fn draw(&mut self, pixels: &[[u32; 2]], sums: &PixelAccumulator, display: DisplayTransform) {
        for (i, [x, y]) in pixels.iter().enumerate() {
            let color = display.expose(sums.shown(i)).map(|x| display.byte(x));
            let at = 3 * (*y as usize * self.size[0] as usize + *x as usize);
            if let Some(place) = self.rgb.get_mut(at..at + 3) {
                place.copy_from_slice(&color);
            }
        }
    }

    fn show(&mut self, board: &Board) {
        let (size, rgb, frame) = (self.size, Arc::new(self.rgb.clone()), self.current.frame);
        board.show(|shown| {
            let before = self.current.picture;
            self.current.picture =
                shown.pictures.add(ShownPicture { frame, size, rgb, film: None, file: None }, |_| true);
            if ["refining", "sketch", "mixed"].contains(&self.current.kind) {
                shown.pictures.remove(before);
            }
            self.current.kind = "refining";
            shown.state["current"] = self.current.to_json();
        });
    }
}

/// The pixels of a picture at another size, each the nearest one.
fn enlarged(picture: &ShownPicture, [width, height]: [u32; 2]) -> Vec<u8> {
    let [w, h] = picture.size;
    let mut rgb = Vec::with_capacity(3 * width as usize * height as usize);
    for y in 0..height {
        let row = (u64::from(y) * u64::from(h) / u64::from(height)) as usize;
        for x in 0..width {
            let column = (u64::from(x) * u64::from(w) / u64::from(width)) as usize;
            let at = 3 * (row * w as usize + column);
            rgb.extend_from_slice(picture.rgb.get(at..at + 3).unwrap_or(&[0; 3]));
        }
    }
    rgb
}
