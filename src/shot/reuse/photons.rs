//! Photon maps are kept from a frame to the next one if nothing has changed that photons depend on, as where only the
//! camera moves.

use super::ReusePolicy;
use crate::base::digest::Digest;
use crate::shot::plan::PlannedFrame;
use crate::systems::PartialFrame;
use crate::trace::integrator::photon::PhotonCache;

/// The photon maps of the frame before, and the digest of all that decides them.
#[derive(Default)]
pub struct PhotonReuse(Option<(Digest, PhotonCache)>);

fn key(run: &[Vec<&PlannedFrame>], index: usize) -> Option<Digest> {
    run.get(index)?[0].fingerprint.as_ref().ok()?.photons
}

impl PhotonReuse {
    /// Lends the frame at `index` of the run the maps that are kept, or room for maps that the next frame can use.
    pub fn lend(&mut self, policy: ReusePolicy, run: &[Vec<&PlannedFrame>], index: usize, frame: &mut PartialFrame) {
        let wanted = key(run, index).filter(|_| policy.reuse);
        let kept = self.0.take().filter(|(digest, _)| Some(*digest) == wanted).map(|(_, maps)| maps);
        let serves_next = wanted.is_some() && key(run, index + 1) == wanted;
        frame.photon_cache = kept.or_else(|| serves_next.then(|| PhotonCache::new(policy.memory << 20)));
    }

    /// Takes the maps back if the next frame can use them.
    pub fn take_back(&mut self, run: &[Vec<&PlannedFrame>], index: usize, frame: &mut PartialFrame) {
        let next = key(run, index + 1);
        let maps = frame.photon_cache.take().filter(|_| next == key(run, index));
        self.0 = next.zip(maps);
    }
}
