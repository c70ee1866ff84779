//! Pictures in memory: those of frames, for playing them and for going back.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde_json::{Value, json};

use crate::base::limits;
use crate::film::Film;

/// A picture as the page shows it.
#[derive(Clone, Debug)]
pub struct ShownPicture {
    /// Number of the frame.
    pub frame: u32,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// RGB, as the file has it in 8 bits.
    pub rgb: Arc<Vec<u8>>,
    /// Linear light, of the pictures that were made last.
    pub film: Option<Arc<Film>>,
    /// The bytes of the frame's file, of a picture that is the frame.
    pub file: Option<Arc<Vec<u8>>>,
}

impl ShownPicture {
    fn bytes(&self) -> usize {
        let film = self.film.as_ref().map_or(0, |film| size_of_val(&*film.pixels));
        self.rgb.len() + film + self.file.as_ref().map_or(0, |file| file.len())
    }
}

/// The picture of the frame that is looked at.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurrentPicture {
    /// Number of the frame.
    pub frame: u32,
    /// The picture in the store; 0 for none.
    pub picture: u64,
    /// `sketch`, `mixed`, `refining` or `exact`.
    pub kind: &'static str,
    /// The exact picture that stood there before the last edit.
    pub before: u64,
    /// What it took to make it.
    pub seconds: f64,
    /// Share of the samples that were kept.
    pub kept: f64,
    /// Whether the bytes of its file are there.
    pub has_file: bool,
}

impl CurrentPicture {
    /// As the page reads it.
    pub fn to_json(&self) -> Value {
        let CurrentPicture { frame, picture, kind, before, seconds, kept, has_file } = self;
        json!({ "frame": frame, "picture": picture, "kind": kind, "before": before, "seconds": seconds, "kept": kept,
            "has_file": has_file })
    }
}

/// Pictures by number; the oldest give way.
#[derive(Debug)]
pub struct PictureStore {
    /// Most bytes that are kept, but for the newest picture.
    most: usize,
    pictures: BTreeMap<u64, ShownPicture>,
    /// Those with linear light, the oldest first.
    films: Vec<u64>,
    next: u64,
    bytes: usize,
}

/// Pictures that keep their linear light.
const FILMS: usize = 4;

impl Default for PictureStore {
    fn default() -> Self {
        let most = limits::PREVIEW_PICTURE_BYTES;
        PictureStore { most, pictures: BTreeMap::new(), films: Vec::new(), next: 0, bytes: 0 }
    }
}

impl PictureStore {
    /// Changes how many bytes are kept at most.
    pub fn set_most(&mut self, bytes: usize) {
        self.most = bytes;
    }

    /// Most bytes that are kept.
    pub fn most(&self) -> usize {
        self.most
    }

    /// Adds a picture and gives its number. Older ones give way, but for those in `wanted`.
    pub fn add(&mut self, picture: ShownPicture, wanted: impl Fn(u64) -> bool) -> u64 {
        self.next += 1;
        self.bytes += picture.bytes();
        if picture.film.is_some() {
            self.films.push(self.next);
        }
        self.pictures.insert(self.next, picture);
        let many = self.films.len().saturating_sub(FILMS);
        for id in self.films.drain(..many) {
            if let Some(film) = self.pictures.get_mut(&id).and_then(|picture| picture.film.take()) {
                self.bytes -= size_of_val(&*film.pixels);
            }
        }
        let old: Vec<u64> = self.pictures.range(..self.next).map(|(id, _)| *id).collect();
        for pass in [false, true] {
            for id in &old {
                if self.bytes > self.most && (pass || !wanted(*id)) {
                    self.remove(*id);
                }
            }
        }
        self.next
    }

    /// A picture that is still there.
    pub fn get(&self, id: u64) -> Option<&ShownPicture> {
        self.pictures.get(&id)
    }

    /// Forgets a picture.
    pub fn remove(&mut self, id: u64) {
        if let Some(picture) = self.pictures.remove(&id) {
            self.bytes -= picture.bytes();
        }
    }

    /// Adds the bytes of its file to a picture.
    pub fn set_file(&mut self, id: u64, file: Option<Arc<Vec<u8>>>) {
        if let (Some(picture), Some(file)) = (self.pictures.get_mut(&id), file) {
            self.bytes += file.len();
            picture.file = Some(file);
        }
    }

    /// Memory that is taken.
    pub fn bytes(&self) -> usize {
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_bounded_and_what_is_wanted_stays_longest() {
        let side = 2_048;
        let picture = |frame| ShownPicture {
            frame,
            size: [side, side],
            rgb: Arc::new(vec![0; (3 * side * side) as usize]),
            film: None,
            file: None,
        };
        let mut store = PictureStore::default();
        let first = store.add(picture(1), |_| false);
        for frame in 2..80 {
            let id = store.add(picture(frame), |id| id == first);
            assert!(store.get(id).is_some() && store.bytes() <= limits::PREVIEW_PICTURE_BYTES);
        }
        assert!(store.get(first).is_some() && store.get(2).is_none());
        for id in 1..200 {
            store.remove(id);
        }
        assert_eq!(store.bytes(), 0);
    }
}
