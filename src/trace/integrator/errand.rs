//! What rays are sent for: one by one, and column by column.

use glam::Vec3;

use super::{BATCH, View};
use crate::trace::columns::Columns;
use crate::trace::sampler::Node;
use crate::trace::simd::{LANES, V3, Wide, bits_of, words_of};
use crate::trace::texture::Cone;
use crate::trace::{Ray, Rays};

/// What becomes of the light that a ray finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errand {
    pub node: Node,
    /// Index of its sample in the batch.
    pub sample: u32,
    /// Factor of its light in the colour of the sample.
    pub weight: Vec3,
    /// Of the ray where it starts; in an [`super::wave::Encounter`] where it ends.
    pub cone: Cone,
    /// Density per steradian with which the direction was sampled; 0 if nothing else could have found it.
    pub pdf: f32,
    /// Material of the body that the ray runs in and that swallows light, or [`CLEAR`].
    pub medium: u32,
    pub seeks: Seeks,
}

/// Whose light a ray still brings home. Other rays than those of photon mapping seek all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seeks {
    All,
    /// What comes straight from a light, and then as `Unsent`: photons have told the rest.
    Direct,
    /// That of lights which send no photons.
    Unsent,
}

/// No medium that swallows light. As a number of a column it is NaN.
pub const CLEAR: u32 = u32::MAX;

/// How much wider the cones of rays get that a diffuse surface scatters, in radians: far less than they are apart, so
/// that what they find of a texture stays true to its place.
pub const DIFFUSE_SPREAD: f32 = 0.1;

impl Errand {
    /// The errand of the first ray of a sample or photon.
    pub fn first(sample: u32, cone: Cone) -> Errand {
        let (node, weight) = (Node::CAMERA, Vec3::ONE);
        Errand { node, sample, weight, cone, pdf: 0.0, medium: CLEAR, seeks: Seeks::All }
    }

    /// The errand of a ray in the one possible direction.
    pub fn onward(&self, node: Node, weight: Vec3) -> Errand {
        Errand { node, weight: self.weight * weight, pdf: 0.0, ..*self }
    }

    /// The cone of a ray whose direction was sampled with this density, 0 for the one possible direction: the wider the
    /// lobe, the wider the cone.
    pub fn scattered_cone(&self, pdf: f32) -> Cone {
        if pdf > 0.0 { self.cone.widened((0.5 / pdf.sqrt()).min(DIFFUSE_SPREAD)) } else { self.cone }
    }

    #[inline(always)]
    fn row(&self) -> [f32; 11] {
        let [low, high] = self.node.halves().map(f32::from_bits);
        let (sample, medium) = (f32::from_bits(self.sample), f32::from_bits(self.medium));
        let (w, seeks) = (self.weight, f32::from_bits(self.seeks as u32));
        [low, high, sample, w.x, w.y, w.z, self.cone.width, self.cone.spread, self.pdf, medium, seeks]
    }

    #[inline(always)]
    fn of_row([low, high, sample, x, y, z, width, spread, pdf, medium, seeks]: [f32; 11]) -> Errand {
        Errand {
            node: Node::of_halves([low.to_bits(), high.to_bits()]),
            sample: sample.to_bits(),
            weight: Vec3::new(x, y, z),
            cone: Cone { width, spread },
            pdf,
            medium: medium.to_bits(),
            seeks: match seeks.to_bits() {
                0 => Seeks::All,
                1 => Seeks::Direct,
                _ => Seeks::Unsent,
            },
        }
    }
}

/// Errands side by side; whole numbers by their bits.
#[derive(Clone, Copy, Debug)]
pub struct Errands<L> {
    /// Halves of the nodes.
    pub nodes: [L; 2],
    pub samples: L,
    pub weight: V3<L>,
    pub width: L,
    pub spread: L,
    pub pdf: L,
    pub media: L,
    pub seeks: L,
}

impl<L: Wide> Errands<L> {
    /// As [`Errand::first`].
    #[inline(always)]
    pub fn first(samples: &[u32; LANES], cone: Cone) -> Self {
        let mut rows = [L::splat(0.0); 11];
        for (x, y) in rows.iter_mut().zip(&Errand::first(0, cone).row()) {
            *x = L::splat(*y);
        }
        Errands { samples: bits_of(samples), ..Self::of_rows(rows) }
    }

    #[inline(always)]
    fn rows(&self) -> [L; 11] {
        let ([low, high], w) = (self.nodes, self.weight);
        [low, high, self.samples, w.x, w.y, w.z, self.width, self.spread, self.pdf, self.media, self.seeks]
    }

    #[inline(always)]
    fn of_rows([low, high, samples, x, y, z, width, spread, pdf, media, seeks]: [L; 11]) -> Self {
        Errands { nodes: [low, high], samples, weight: V3 { x, y, z }, width, spread, pdf, media, seeks }
    }

    /// The nodes one by one.
    #[inline(always)]
    pub fn each_node(&self) -> [Node; LANES] {
        let (low, high) = (words_of(self.nodes[0]), words_of(self.nodes[1]));
        let mut nodes = [Node::CAMERA; LANES];
        for (i, node) in nodes.iter_mut().enumerate() {
            *node = Node::of_halves([low[i], high[i]]);
        }
        nodes
    }

    /// The same errands at other nodes.
    #[inline(always)]
    pub fn at(self, nodes: &[Node; LANES]) -> Self {
        let mut halves = [[0; LANES]; 2];
        for (i, node) in nodes.iter().enumerate() {
            [halves[0][i], halves[1][i]] = node.halves();
        }
        Errands { nodes: [bits_of(&halves[0]), bits_of(&halves[1])], ..self }
    }
}

/// Rays on their way, and their errands.
#[derive(Debug, Default)]
pub struct Wave {
    rays: Rays,
    errands: Columns<11>,
}

impl Wave {
    #[inline]
    pub fn push(&mut self, ray: Ray, errand: Errand) {
        self.rays.push(ray);
        self.errands.push(errand.row());
    }

    /// Adds the endless rays of the lanes that have a bit.
    #[inline(always)]
    pub fn put<L: Wide>(&mut self, which: u32, origin: V3<L>, direction: V3<L>, errands: &Errands<L>) {
        self.rays.put(which, origin, direction, L::splat(f32::INFINITY));
        self.errands.put(which, &errands.rows());
    }

    pub fn rays(&self) -> &Rays {
        &self.rays
    }

    #[inline(always)]
    pub fn get(&self, i: usize) -> (Ray, Errand) {
        (self.rays.get(i), self.errand(i))
    }

    #[inline(always)]
    pub fn errand(&self, i: usize) -> Errand {
        Errand::of_row(self.errands.row(i))
    }

    pub fn set_errand(&mut self, i: usize, errand: &Errand) {
        self.errands.set(i, errand.row());
    }

    /// Of the eight rays from number `i` on.
    #[inline(always)]
    pub fn errands<L: Wide>(&self, i: usize) -> Errands<L> {
        Errands::of_rows(self.errands.rows(i))
    }

    /// Of rays anywhere.
    #[inline(always)]
    pub fn errands_of<L: Wide>(&self, numbers: &[usize; LANES]) -> Errands<L> {
        Errands::of_rows(self.errands.gathered(numbers))
    }

    /// Media of the eight rays from number `i` on.
    #[inline(always)]
    pub fn media<L: Wide>(&self, i: usize) -> L {
        self.errands.eight(9, i)
    }

    pub fn clear(&mut self) {
        self.rays.clear();
        self.errands.clear();
    }
}

/// Where the light of a pass is added up for a sample.
#[inline]
pub fn place(sample: u32, pass: u32) -> u32 {
    sample + pass * BATCH as u32
}

/// The sample of such a place.
#[inline]
pub fn sample_at(place: u32) -> u32 {
    place % BATCH as u32
}

/// Shadow rays towards one light, with what each adds if nothing stands in its way.
#[derive(Debug, Default)]
pub struct Shadows {
    pub rays: Rays,
    /// Ends of the rays, where transparent surfaces do not stop them.
    targets: Columns<3>,
    /// Bits of the place that the light is added to, and the light.
    gains: Columns<4>,
}

/// Shadow rays side by side.
pub struct Asked<L> {
    pub origin: V3<L>,
    pub direction: V3<L>,
    pub distance: L,
    pub target: V3<L>,
    pub gain: V3<L>,
}

impl Shadows {
    /// Asks whether the way to `target` is free.
    #[inline]
    pub fn push(&mut self, view: View, ray: Ray, target: Vec3, place: u32, gain: Vec3) {
        self.rays.push(ray);
        if view.settings.transparent_shadows {
            self.targets.push(target.to_array());
        }
        self.gains.push([f32::from_bits(place), gain.x, gain.y, gain.z]);
    }

    /// Asks for the lanes that have a bit, which belong to these samples and whose light goes to this pass.
    #[inline(always)]
    pub fn put<L: Wide>(&mut self, view: View, which: u32, asked: &Asked<L>, samples: &[u32; LANES], pass: u32) {
        let Asked { origin, direction, distance, target, gain } = *asked;
        self.rays.put(which, origin, direction, distance);
        if view.settings.transparent_shadows {
            self.targets.put(which, &[target.x, target.y, target.z]);
        }
        let mut places = *samples;
        for at in &mut places {
            *at = place(*at, pass);
        }
        self.gains.put(which, &[bits_of(&places), gain.x, gain.y, gain.z]);
    }

    /// Where the light of one ray is added, and how much it is.
    #[inline(always)]
    pub fn gain(&self, i: usize) -> (u32, Vec3) {
        let [place, x, y, z] = self.gains.row(i);
        (place.to_bits(), Vec3::new(x, y, z))
    }

    pub fn target(&self, i: usize) -> Vec3 {
        Vec3::from_array(self.targets.row(i))
    }

    pub fn clear(&mut self) {
        self.rays.clear();
        self.targets.clear();
        self.gains.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::simd::{Kernel, Width};

    fn errand(i: u32) -> Errand {
        let x = i as f32;
        Errand {
            node: if i.is_multiple_of(3) { Node::CAMERA.scattered() } else { Node::CAMERA.reflected().refracted() },
            sample: 7 * i,
            weight: Vec3::new(x, 0.5 * x, -x),
            cone: Cone { width: 0.1 * x, spread: 0.01 * x },
            pdf: 2.0 * x,
            medium: if i.is_multiple_of(2) { CLEAR } else { i },
            seeks: [Seeks::All, Seeks::Direct, Seeks::Unsent][i as usize % 3],
        }
    }

    fn ray(i: u32) -> Ray {
        Ray::new(Vec3::splat(i as f32), Vec3::X)
    }

    struct Copy<'a>(&'a Wave, &'a mut Wave);

    impl Kernel for Copy<'_> {
        type Output = ();

        #[inline(always)]
        fn run<L: Wide>(self) {
            let (from, to) = (self.0, self.1);
            let (origin, direction) = (from.rays().origins::<L>(2), from.rays().directions(2));
            let errands = from.errands::<L>(2);
            to.put(0b1010_0110, origin, direction, &errands.at(&errands.each_node()));
            let turned = [9, 8, 7, 6, 5, 4, 3, 2];
            to.put(0xff, origin, direction, &from.errands_of::<L>(&turned));
        }
    }

    #[test]
    fn errands_are_the_same_in_rows_and_in_lanes() {
        let mut wave = Wave::default();
        (0..10).for_each(|i| wave.push(ray(i), errand(i)));
        assert!((0..10).all(|i| wave.get(i as usize) == (ray(i), errand(i))));
        for width in Width::all() {
            let mut copy = Wave::default();
            width.run(Copy(&wave, &mut copy));
            let got: Vec<_> = (0..copy.rays().len()).map(|i| copy.get(i)).collect();
            let some = [3, 4, 7, 9].map(|i| (ray(i), errand(i)));
            let turned = (2..10).map(|i| (ray(i), errand(11 - i)));
            assert_eq!(got, some.into_iter().chain(turned).collect::<Vec<_>>(), "{width:?}");
        }
    }
}
