//! Frames in parts of about the same cost, for as many machines.
//!
//! Parts are rows of frames that follow each other. A frame that shares work with one before it (the same pixels, light
//! groups, kept samples, photon maps) costs less in one part with it than at the head of another: whoever cuts between
//! them pays that again. The longest part is made as short as it can be; frames that share stay together where a cut
//! costs more machine time than it saves. It depends on costs alone, and takes time in
//! proportion to the number of frames.

use std::ops::Range;

/// What one frame costs, in the unit of all of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameCost {
    /// By itself.
    pub alone: f64,
    /// Behind the frame that it shares work with; at most as much.
    pub shared: f64,
    /// The place of the last frame before it that it shares work with.
    pub with: Option<usize>,
}

/// Frames in parts, and what that costs.
#[derive(Clone, Debug, PartialEq)]
pub struct Chunks {
    /// As many as were asked for, in order; together all frames. The last ones are empty if there is nothing for them.
    pub ranges: Vec<Range<usize>>,
    /// What each costs, with what it does again.
    pub costs: Vec<f64>,
    /// What all frames cost in one part.
    pub whole: f64,
}

impl Chunks {
    /// What is done again because frames that share work are in different parts.
    pub fn price(&self) -> f64 {
        let price = self.costs.iter().sum::<f64>() - self.whole;
        // Below that it is what sums in another order differ by.
        if price > 1e-9 * self.whole { price } else { 0.0 }
    }

    /// What the dearest part costs.
    pub fn longest(&self) -> f64 {
        self.costs.iter().copied().fold(0.0, f64::max)
    }
}

/// A cut that does more than this share of a part again is dear: frames stay together there, if that pays.
const DEAR_CUT: f64 = 0.1;
/// Halvings of the bound on the longest part: far below the precision of any estimate.
const HALVINGS: usize = 40;

/// Splits frames into `parts`, at least one.
pub fn split(frames: &[FrameCost], parts: usize) -> Chunks {
    let parts = parts.max(1);
    let prices = cut_prices(frames);
    let anywhere = balanced(frames, &prices, parts, &vec![true; prices.len()]);
    let mean = anywhere.whole / parts as f64;
    let is_cheap: Vec<bool> = prices.iter().map(|price| *price <= DEAR_CUT * mean).collect();
    let together = balanced(frames, &prices, parts, &is_cheap);
    let saved_time = (together.longest() - anywhere.longest()) * parts as f64;
    if anywhere.price() - together.price() > saved_time { together } else { anywhere }
}

/// What each cut does again, by the place of the frame behind it: the first frame behind it of every group that has
/// frames on both sides.
fn cut_prices(frames: &[FrameCost]) -> Vec<f64> {
    let mut steps = vec![0.0; frames.len() + 2];
    for (i, frame) in frames.iter().enumerate() {
        if let Some(with) = frame.with {
            steps[with + 1] += frame.alone - frame.shared;
            steps[i + 1] -= frame.alone - frame.shared;
        }
    }
    let mut price = 0.0;
    let sums = steps[..=frames.len()].iter().map(|step| {
        price += step;
        f64::max(price, 0.0)
    });
    sums.collect()
}

/// What a frame costs in a part that starts at `start`.
fn cost_in(frames: &[FrameCost], start: usize, at: usize) -> f64 {
    let frame = &frames[at];
    if frame.with.is_some_and(|with| with >= start) { frame.shared } else { frame.alone }
}

fn cost_of(frames: &[FrameCost], range: Range<usize>) -> f64 {
    range.clone().map(|at| cost_in(frames, range.start, at)).sum()
}

/// The last end of a part from every place that costs at most `bound` and may be cut; the place itself if there is none.
fn ends(frames: &[FrameCost], bound: f64, may_cut: &[bool]) -> Vec<usize> {
    let count = frames.len();
    let mut sharers = vec![Vec::new(); count];
    for (at, frame) in frames.iter().enumerate() {
        if let Some(with) = frame.with {
            sharers[with].push(at);
        }
    }
    let mut last_cut = vec![0; count + 1];
    for end in 1..=count {
        last_cut[end] = if end == count || may_cut[end] { end } else { last_cut[end - 1] };
    }
    let (mut end, mut cost) = (0, 0.0);
    let mut ends = Vec::with_capacity(count);
    for start in 0..count {
        if end <= start {
            (end, cost) = (start, 0.0);
        }
        while end < count && cost + cost_in(frames, start, end) <= bound {
            cost += cost_in(frames, start, end);
            end += 1;
        }
        ends.push(last_cut[end].max(start));
        if end > start {
            // Whoever shared with the frame that is left behind does its work from here on.
            cost -= frames[start].alone;
            let behind = sharers[start].iter().filter(|at| **at < end);
            cost += behind.map(|at| frames[*at].alone - frames[*at].shared).sum::<f64>();
        }
        while cost > bound && end > start + 1 {
            end -= 1;
            cost -= cost_in(frames, start + 1, end);
        }
    }
    ends
}

/// How many parts hold all frames from every place on, if they end where they may; more than anybody has if none do.
fn parts_needed(ends: &[usize]) -> Vec<usize> {
    let count = ends.len();
    let mut needed = vec![0; count + 1];
    for start in (0..count).rev() {
        needed[start] = if ends[start] > start { needed[ends[start]] + 1 } else { usize::MAX / 2 };
    }
    needed
}

/// Parts whose longest is as short as it can be, and which are otherwise alike.
fn balanced(frames: &[FrameCost], prices: &[f64], parts: usize, may_cut: &[bool]) -> Chunks {
    let whole = cost_of(frames, 0..frames.len());
    let (mut low, mut high) = (0.0, whole * (1.0 + 1e-9));
    for _ in 0..HALVINGS {
        let middle = (low + high) / 2.0;
        let fits = parts_needed(&ends(frames, middle, may_cut))[0] <= parts;
        if fits { high = middle } else { low = middle }
    }
    let ends = ends(frames, high, may_cut);
    let needed = parts_needed(&ends);
    let mut ranges = Vec::with_capacity(parts);
    let (mut start, mut left) = (0, whole);
    for others in (0..parts).rev() {
        let most = if others == 0 { frames.len() } else { ends.get(start).copied().unwrap_or(start) };
        let share = left / (others + 1) as f64;
        let end = best_end(frames, prices, start, most, share, may_cut);
        // What is left must still fit into the other parts.
        let end = if others == 0 || needed[end] > others { most } else { end };
        left -= cost_of(frames, start..end);
        ranges.push(start..end);
        start = end;
    }
    let costs = ranges.iter().map(|range| cost_of(frames, range.clone())).collect();
    Chunks { ranges, costs, whole }
}

/// The end from `start` to `most` where a part costs nearest to its share, and the cut least.
fn best_end(frames: &[FrameCost], prices: &[f64], start: usize, most: usize, share: f64, may_cut: &[bool]) -> usize {
    let (mut cost, mut best) = (0.0, (f64::INFINITY, most));
    for end in start + 1..=most {
        cost += cost_in(frames, start, end - 1);
        let badness = (cost - share).abs() + prices[end];
        if badness < best.0 && (end == frames.len() || may_cut[end]) {
            best = (badness, end);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn alike(count: usize, cost: f64) -> Vec<FrameCost> {
        vec![FrameCost { alone: cost, shared: cost, with: None }; count]
    }

    /// Groups of frames of which the first one of each part does the work.
    fn groups(count: usize, size: usize, alone: f64, shared: f64) -> Vec<FrameCost> {
        (0..count).map(|i| FrameCost { alone, shared, with: (i % size > 0).then(|| i - 1) }).collect()
    }

    #[test]
    fn parts_of_equal_frames_are_equal() {
        for (count, parts) in [(60, 12), (10, 3), (7, 7), (100, 1)] {
            let lengths: Vec<usize> = split(&alike(count, 2.0), parts).ranges.iter().map(|r| r.len()).collect();
            assert!(lengths.iter().all(|n| n.abs_diff(count / parts) <= 1), "{lengths:?}");
        }
    }

    #[test]
    fn one_dear_frame_stands_alone_and_the_others_share_the_rest() {
        let mut frames = alike(100, 1.0);
        frames[50].alone = 40.0;
        frames[50].shared = 40.0;
        let chunks = split(&frames, 20);
        assert!(chunks.longest() < 46.0, "{chunks:?}");
        assert!(chunks.costs.iter().filter(|cost| **cost > 0.0).count() > 15, "{:?}", chunks.costs);
    }

    #[test]
    fn frames_that_share_stay_together_where_a_cut_costs_more_than_it_saves() {
        let frames = groups(96, 12, 10.0, 0.1);
        let chunks = split(&frames, 4);
        assert!(chunks.ranges.iter().all(|range| range.start % 12 == 0), "{chunks:?}");
        assert_eq!(chunks.price(), 0.0);
        // One group on two machines would be traced twice to save a tenth.
        let one = split(&groups(24, 24, 10.0, 0.1), 2);
        assert_eq!((one.ranges.clone(), one.price()), (vec![0..24, 24..24], 0.0));
        // Cheap to begin again, much to do: it is cut, and says what that costs.
        let cut = split(&groups(96, 96, 2.0, 1.0), 4);
        assert!(cut.longest() < 27.0 && (cut.price() - 3.0).abs() < 1e-9, "{cut:?}");
    }

    #[test]
    fn nothing_is_split_too() {
        assert_eq!(split(&[], 3).ranges, vec![0..0, 0..0, 0..0]);
        assert_eq!(split(&alike(2, 1.0), 4).ranges.iter().map(|r| r.len()).sum::<usize>(), 2);
        assert_eq!(split(&alike(3, 0.0), 2).ranges.iter().map(|r| r.len()).sum::<usize>(), 3);
    }

    /// The least possible cost of the longest part, by trying all cuts.
    fn least(frames: &[FrameCost], start: usize, parts: usize) -> f64 {
        if parts == 1 {
            return cost_of(frames, start..frames.len());
        }
        let ends = start..=frames.len();
        ends.map(|end| cost_of(frames, start..end).max(least(frames, end, parts - 1))).fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        #[test]
        fn parts_are_the_whole_in_order(costs in prop::collection::vec((0.0f64..9.0, 0u8..4), 0..60), parts in 1usize..70) {
            let frames: Vec<FrameCost> = costs.iter().enumerate().map(|(i, (alone, kind))| {
                let with = (*kind == 0 && i > 0).then(|| i - 1);
                FrameCost { alone: *alone, shared: alone / 4.0, with }
            }).collect();
            let chunks = split(&frames, parts);
            prop_assert_eq!(chunks.ranges.len(), parts);
            let mut at = 0;
            for range in &chunks.ranges {
                prop_assert_eq!(range.start, at);
                prop_assert!(range.end >= range.start);
                at = range.end;
            }
            prop_assert_eq!(at, frames.len());
        }

        #[test]
        fn the_longest_part_is_as_short_as_any(costs in prop::collection::vec(0.5f64..9.0, 1..11), parts in 1usize..5) {
            let frames: Vec<FrameCost> =
                costs.iter().map(|cost| FrameCost { alone: *cost, shared: *cost, with: None }).collect();
            let best = least(&frames, 0, parts);
            prop_assert!(split(&frames, parts).longest() <= best * (1.0 + 1e-6));
        }
    }
}
