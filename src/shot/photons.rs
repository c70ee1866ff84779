//! Photons are kept from a frame to the next one if nothing has changed that they could see, as where the camera moves.

use super::plan::Planned;
use super::reuse::Policy;
use crate::base::digest::Digest;
use crate::systems::Exposure;
use crate::trace::integrator::PhotonCache;

/// The photons of the frame before, and the digest of all that decides them.
#[derive(Default)]
pub struct Photons(Option<(Digest, PhotonCache)>);

fn key(run: &[Vec<&Planned>], index: usize) -> Option<Digest> {
    run.get(index)?[0].outline.as_ref().ok()?.photons
}

impl Photons {
    /// Lends the exposure of the frame at `index` of the run what is kept, or room for what the next one can use.
    pub fn lend(&mut self, policy: Policy, run: &[Vec<&Planned>], index: usize, exposure: &mut Exposure) {
        let wanted = key(run, index).filter(|_| policy.reuse);
        let kept = self.0.take().filter(|(digest, _)| Some(*digest) == wanted).map(|(_, shelf)| shelf);
        let serves_next = wanted.is_some() && key(run, index + 1) == wanted;
        exposure.shelf = kept.or_else(|| serves_next.then(|| PhotonCache::new(policy.memory << 20)));
    }

    /// Takes back what the next frame can use.
    pub fn take_back(&mut self, run: &[Vec<&Planned>], index: usize, exposure: &mut Exposure) {
        let next = key(run, index + 1);
        let shelf = exposure.shelf.take().filter(|_| next == key(run, index));
        self.0 = next.zip(shelf);
    }
}
