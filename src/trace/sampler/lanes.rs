//! Samplers side by side: where eight take points of one sequence, these are computed in lanes.

use super::sobol;
use super::sobol::SobolIndices;
use super::stateless::{Domain, RayNode, STRATA, Sampler};
use crate::trace::simd::{LANES, Wide};

/// A sample of a pixel, and its decisions.
pub type PixelSample = ([u32; 2], Sampler);

/// Many samples.
#[derive(Clone, Copy)]
pub struct SampleSet<'a> {
    all: &'a [PixelSample],
    /// Their numbers in the sequence that all are of, and the digits of a pixel's; none where they are of more than
    /// one.
    numbers: &'a [u32],
    digits: u32,
}

impl<'a> SampleSet<'a> {
    /// `numbers` is memory for the set.
    pub fn new(all: &'a [PixelSample], numbers: &'a mut Vec<u32>) -> Self {
        numbers.clear();
        let Some((_, first)) = all.first().filter(|(_, first)| first.place != STRATA) else {
            return SampleSet { all, numbers, digits: 0 };
        };
        let alike = |s: &Sampler| {
            let set = s.sample >> (2 * s.digits);
            s.pixel_key == first.pixel_key && s.digits == first.digits && set == 0
        };
        if all.iter().all(|(_, sampler)| alike(sampler)) {
            numbers.extend(all.iter().map(|(_, s)| s.place << (2 * s.digits) | s.sample));
        }
        SampleSet { all, numbers, digits: first.digits }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.all.len()
    }

    /// Column and row of a sample's pixel.
    #[inline(always)]
    pub fn pixel(&self, sample: u32) -> [u32; 2] {
        self.all[sample as usize].0
    }

    /// What a sample draws its numbers from.
    #[inline(always)]
    pub fn sampler(&self, sample: u32) -> &'a Sampler {
        &self.all[sample as usize].1
    }

    /// Eight of them, each at a node of its tree of rays.
    #[inline(always)]
    pub fn eight(self, which: [u32; LANES], nodes: [RayNode; LANES]) -> SampleLanes<'a> {
        let mut together = None;
        if !self.numbers.is_empty() && same(&nodes) {
            let mut numbers = [0; LANES];
            for (number, sample) in numbers.iter_mut().zip(&which) {
                *number = self.numbers[*sample as usize];
            }
            together = Some(SobolIndices::new(numbers, self.digits));
        }
        SampleLanes { set: self, which, nodes, together }
    }
}

#[inline(always)]
fn same(nodes: &[RayNode; LANES]) -> bool {
    let mut same = true;
    for node in nodes {
        same &= *node == nodes[0];
    }
    same
}

/// Eight samples, each at a node of its tree of rays.
pub struct SampleLanes<'a> {
    set: SampleSet<'a>,
    which: [u32; LANES],
    nodes: [RayNode; LANES],
    /// Numbers in the sequence that all are of, if they are at one node.
    together: Option<SobolIndices>,
}

impl SampleLanes<'_> {
    /// Where in its tree of rays each is.
    #[inline(always)]
    pub fn nodes(&self) -> &[RayNode; LANES] {
        &self.nodes
    }

    /// Numbers of the samples in their set.
    #[inline(always)]
    pub fn which(&self) -> &[u32; LANES] {
        &self.which
    }

    /// What the sample of a lane draws its numbers from.
    #[inline(always)]
    pub fn sampler(&self, i: usize) -> &Sampler {
        self.set.sampler(self.which[i])
    }

    /// The nodes that these lead to.
    #[inline(always)]
    pub fn onward(&self, to: fn(RayNode) -> RayNode) -> [RayNode; LANES] {
        let (mut from, mut next) = (self.nodes[0], to(self.nodes[0]));
        let mut nodes = self.nodes;
        for node in &mut nodes {
            if *node != from {
                (from, next) = (*node, to(*node));
            }
            *node = next;
        }
        nodes
    }

    /// As [`Sampler::stratified`].
    #[inline(always)]
    pub fn stratified<L: Wide>(&self, domain: Domain) -> [L; 2] {
        if let Some(numbers) = &self.together {
            return sobol::pairs(numbers, self.sampler(0).key(self.nodes[0], domain));
        }
        self.each(|sampler, node| sampler.stratified(node, domain))
    }

    /// As [`Sampler::in_own_cell`].
    #[inline(always)]
    pub fn in_own_cell<L: Wide>(&self, domain: Domain) -> [L; 2] {
        if self.together.is_some() {
            return self.stratified(domain);
        }
        self.each(|sampler, node| sampler.in_own_cell(node, domain))
    }

    /// As [`Sampler::random`].
    #[inline(always)]
    pub fn random<L: Wide>(&self, domain: Domain) -> [L; 2] {
        self.each(|sampler, node| sampler.random(node, domain))
    }

    /// As [`Sampler::extra`].
    #[inline(always)]
    pub fn extra<L: Wide>(&self, domain: Domain) -> L {
        if let Some(numbers) = &self.together {
            return sobol::singles(numbers, !self.sampler(0).key(self.nodes[0], domain));
        }
        self.each(|sampler, node| [sampler.extra(node, domain), 0.0])[0]
    }

    #[inline(always)]
    fn each<L: Wide>(&self, f: impl Fn(&Sampler, RayNode) -> [f32; 2]) -> [L; 2] {
        let mut columns = [[0.0; LANES]; 2];
        let [xs, ys] = &mut columns;
        for (i, (x, y)) in xs.iter_mut().zip(ys).enumerate() {
            [*x, *y] = f(self.sampler(i), self.nodes[i]);
        }
        [L::load(&columns[0]), L::load(&columns[1])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::simd::{Kernel, Width};

    struct Drawn<'a>(SampleLanes<'a>, Domain);

    impl Kernel for Drawn<'_> {
        type Output = [[f32; LANES]; 5];

        #[inline(always)]
        fn run<L: Wide>(self) -> Self::Output {
            let ([a, b], [c, d]) = (self.0.stratified::<L>(self.1), self.0.in_own_cell::<L>(self.1));
            [a, b, c, d, self.0.extra::<L>(self.1)].map(L::store)
        }
    }

    #[test]
    fn eight_draw_what_each_would() {
        let domain = Domain::Light(3);
        for samples in [1, 9, 16, 100] {
            for (other_block, strata, spread) in
                [(false, false, 3), (false, false, 8), (true, false, 3), (false, true, 3)]
            {
                let all: Vec<PixelSample> = (0..LANES as u32)
                    .map(|i| {
                        let place = [i / spread + if other_block { 7 * i } else { 0 }, 5];
                        let sampler = Sampler::sobol(9, place, samples);
                        let sampler = if strata { Sampler::new(9, i / 3, samples.isqrt()) } else { sampler };
                        (place, Sampler { sample: i * 5 % samples, ..sampler })
                    })
                    .collect();
                let node = RayNode::CAMERA.scattered();
                let mut numbers = Vec::new();
                let set = SampleSet::new(&all, &mut numbers);
                let eight = || set.eight([0, 1, 2, 3, 4, 5, 6, 7], [node; LANES]);
                assert_eq!(eight().together.is_some(), !other_block && !strata);
                for width in Width::all() {
                    let [a, b, c, d, e] = width.run(Drawn(eight(), domain));
                    for (i, (_, s)) in all.iter().enumerate() {
                        assert_eq!([a[i], b[i]], s.stratified(node, domain), "{width:?} {samples}");
                        assert_eq!([c[i], d[i]], s.in_own_cell(node, domain), "{width:?} {samples}");
                        assert_eq!(e[i], s.extra(node, domain), "{width:?} {samples}");
                    }
                }
            }
        }
    }
}
