//! A tree that is built fast: the leaves are cut from a curve that fills space, and only what is above them is chosen by
//! surface area, among a sixth as many boxes as there are primitives.
//!
//! Clusters by a curve under a hierarchy by surface area are those of HLBVH (Pantaleoni and Luebke 2010; Garanzha,
//! Pantaleoni and McAllister 2011), upside down: there the curve orders what is above, here what is below, where most
//! of a build's time goes. Where the curve is cut is not left to the bits of its codes: of all ways to cut a stretch of
//! it into blocks, the one whose blocks are expected to cost least is found by dynamic programming.

use rayon::prelude::*;

use super::build::{Extent, Ground, Range, Ref, plant, refs};
use super::{Child, Held, LANES, Leaves, Source, Tree, curve};

/// References of one stretch.
const STRETCH: usize = 4096;

/// What a block costs beside its primitives, in primitives.
const BLOCK: usize = 8;

/// The tree over the first `count` primitives of a source, the same on any number of threads.
pub fn fast<S: Source>(source: &S, count: u32) -> Tree {
    let mut refs = refs(source, count);
    let middles = Range::of_many(&mut refs).middles;
    let order = curve::along(&refs, middles);
    let cuts: Vec<Vec<Cut>> = order.par_chunks(STRETCH).map(|stretch| cut(&refs, stretch)).collect();
    let (mut boxes, mut runs) = (Vec::new(), Vec::new());
    let mut next = 0;
    // By kind.
    let mut indices = [0; 6];
    for Cut { bounds, held, count } in cuts.into_iter().flatten() {
        let index = &mut indices[held as usize];
        // To the tree above, each is one of those that have a leaf of their own.
        boxes.push(Ref::new(bounds, Child::new(held, count, *index).bits(), Held::List));
        *index += 1;
        runs.push(next..next + count);
        next += count;
    }
    let leaf = |refs: &[Ref], _: &mut Leaves| Child::of_bits(refs[0].number());
    let mut tree = plant(&mut boxes, &Ground { block: 1, leaf });
    tree.leaves = Leaves::of(source, &order, &runs);
    tree
}

/// A block that was cut off.
struct Cut {
    bounds: Extent,
    held: Held,
    count: usize,
}

/// Cuts a stretch of the curve into blocks of one kind, so that the sum of what they cost is least.
fn cut(refs: &[Ref], stretch: &[u32]) -> Vec<Cut> {
    let stretch: Vec<Ref> = stretch.iter().map(|n| refs[*n as usize]).collect();
    // Of everything before each place: the least cost, and how many the last block then holds.
    let mut costs = vec![0.0f32; stretch.len() + 1];
    let mut lasts = vec![1u8; stretch.len() + 1];
    for end in 1..=stretch.len() {
        let held = stretch[end - 1].held();
        let most = if held == Held::List as u32 { 1 } else { LANES };
        let (mut bounds, mut best) = (Extent::EMPTY, f32::INFINITY);
        for (count, r) in (1..=most).zip(stretch[..end].iter().rev()) {
            if r.held() != held {
                break;
            }
            bounds.add(r.low, r.high);
            let cost = costs[end - count] + bounds.half_area() * (BLOCK + count) as f32;
            if cost < best {
                best = cost;
                lasts[end] = count as u8;
            }
        }
        costs[end] = best;
    }
    let mut cuts = Vec::with_capacity(stretch.len() / 4);
    let mut end = stretch.len();
    while end > 0 {
        let count = usize::from(lasts[end]);
        let some = &stretch[end - count..end];
        let bounds = some.iter().fold(Extent::EMPTY, |all, r| all.union(Extent { low: r.low, high: r.high }));
        cuts.push(Cut { bounds, held: Held::of_bits(some[0].held()), count });
        end -= count;
    }
    cuts.reverse();
    cuts
}
