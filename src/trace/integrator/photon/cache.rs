//! Photons that are kept for other pictures of the same scene.

use super::pass::PhotonPass;

/// Photons of the first passes, as many as there is room for.
pub struct PhotonCache {
    passes: Vec<PhotonPass>,
    bytes: usize,
    /// Most bytes that it may hold.
    room: u64,
}

impl PhotonCache {
    /// A cache of at most `room` bytes, with nothing in it.
    pub fn new(room: u64) -> Self {
        PhotonCache { passes: Vec::new(), bytes: 0, room }
    }

    /// The photons of a pass, counted from 0.
    pub fn get(&self, pass: u32) -> Option<&PhotonPass> {
        self.passes.get(pass as usize)
    }

    /// Keeps the photons of a pass, if it is the next one and there is room.
    pub fn put(&mut self, pass: u32, photons: PhotonPass) {
        // All share the guide of the first.
        let guide = if pass == 0 { photons.guide().caustic.bytes() } else { 0 };
        let bytes = self.bytes + photons.bytes() + guide;
        if self.passes.len() == pass as usize && bytes as u64 <= self.room {
            self.passes.push(photons);
            self.bytes = bytes;
        }
    }

    /// Memory that is taken.
    pub fn bytes(&self) -> usize {
        self.bytes
    }
}
