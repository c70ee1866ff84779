//! Samplers side by side: where eight take points of one sequence, these are computed in lanes.

use super::{Domain, Node, STRATA, Sampler, sobol};
use crate::trace::simd::{LANES, Wide};

/// Eight samples, each at a node of its tree of rays.
pub struct Eight<'a> {
    samplers: [&'a Sampler; LANES],
    nodes: [Node; LANES],
    /// Numbers in the sequence that all are of, and their digits.
    together: Option<([u32; LANES], u32)>,
}

impl<'a> Eight<'a> {
    #[inline(always)]
    pub fn new(samplers: [&'a Sampler; LANES], nodes: [Node; LANES]) -> Self {
        let first = samplers[0];
        let alike = |i: usize| {
            let s = samplers[i];
            let set = s.sample >> (2 * s.digits);
            s.pixel_key == first.pixel_key && s.digits == first.digits && nodes[i] == nodes[0] && set == 0
        };
        let mut together = first.place != STRATA;
        let mut numbers = [0; LANES];
        for i in 0..LANES {
            together &= alike(i);
            numbers[i] = samplers[i].place << (2 * first.digits) | samplers[i].sample;
        }
        Eight { samplers, nodes, together: together.then_some((numbers, sobol::BLOCK_BITS + first.digits)) }
    }

    /// As [`Sampler::stratified`].
    #[inline(always)]
    pub fn stratified<L: Wide>(&self, domain: Domain) -> [L; 2] {
        if let Some((numbers, digits)) = &self.together {
            return sobol::pairs(numbers, *digits, self.samplers[0].key(self.nodes[0], domain));
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
        if let Some((numbers, digits)) = &self.together {
            return sobol::singles(numbers, *digits, !self.samplers[0].key(self.nodes[0], domain));
        }
        self.each(|sampler, node| [sampler.extra(node, domain), 0.0])[0]
    }

    #[inline(always)]
    fn each<L: Wide>(&self, f: impl Fn(&Sampler, Node) -> [f32; 2]) -> [L; 2] {
        let mut columns = [[0.0; LANES]; 2];
        let [xs, ys] = &mut columns;
        for (i, (x, y)) in xs.iter_mut().zip(ys).enumerate() {
            [*x, *y] = f(self.samplers[i], self.nodes[i]);
        }
        [L::load(&columns[0]), L::load(&columns[1])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::simd::{Kernel, Width};

    struct Drawn<'a>(Eight<'a>, Domain);

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
            for (other_block, strata) in [(false, false), (true, false), (false, true)] {
                let samplers: Vec<Sampler> = (0..LANES as u32)
                    .map(|i| {
                        let place = [i / 3 + if other_block { 7 * i } else { 0 }, 5];
                        let sampler = Sampler::sobol(9, place, samples);
                        let sampler = if strata { Sampler::new(9, i / 3, samples.isqrt()) } else { sampler };
                        Sampler { sample: i * 5 % samples, ..sampler }
                    })
                    .collect();
                let node = Node::CAMERA.scattered();
                let eight = || Eight::new(std::array::from_fn(|i| &samplers[i]), [node; LANES]);
                assert_eq!(eight().together.is_some(), !other_block && !strata);
                for width in Width::all() {
                    let [a, b, c, d, e] = width.run(Drawn(eight(), domain));
                    for (i, s) in samplers.iter().enumerate() {
                        assert_eq!([a[i], b[i]], s.stratified(node, domain), "{width:?} {samples}");
                        assert_eq!([c[i], d[i]], s.in_own_cell(node, domain), "{width:?} {samples}");
                        assert_eq!(e[i], s.extra(node, domain), "{width:?} {samples}");
                    }
                }
            }
        }
    }
}
