//! The sum that light groups add up to.

use glam::Vec3;

use crate::film::Film;

/// The frame that light groups add up to, each but the first times its factor, in their order.
pub fn weighted_sum(first: &Film, others: &[Film], factors: &[Vec3]) -> Film {
    let mut film = first.clone();
    for (other, factor) in others.iter().zip(factors) {
        for (sum, color) in film.pixels.iter_mut().zip(&other.pixels) {
            *sum = (Vec3::from(*sum) + Vec3::from(*color) * *factor).to_array();
        }
    }
    film
}
