//! What a thousand machines make of a plan, by simulation: `cargo bench --bench farm`.
//!
//! 10,000 frames with costs that were measured (`farm_costs.csv`: millions of steps and tests of rays of shows, beside
//! what the plan had estimated) go to 100 and 1,000 workers. One task in a hundred fails at a random point and is begun
//! again a minute later, when its claims are found to be stale; two workers in a hundred run at a fifth of the speed. The
//! planner knows estimates alone; time is measured work. `ideal` is the larger of work over total speed and the longest
//! frame.
//!
//! - `array`: one part for each worker, none helps another
//! - `array x8`: eight parts for each, taken in their order
//! - `claims`: parts as before, dear frames first, and who is done takes unclaimed units of others, the dearest first, as
//!   `anim render --shard I/N --claims` does

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;
use std::time::Instant;

use anim::farm::share::{order, units};
use anim::shot::chunks::{FrameCost, split};

const FRAMES: usize = 10_000;
/// Mean seconds of a frame on a worker of usual speed.
const FRAME_SECONDS: f64 = 60.0;
const FAILING: f64 = 0.01;
const SLOW: f64 = 0.02;
const SLOWNESS: f64 = 5.0;
/// Until a claim counts as stale.
const PATIENCE: f64 = 60.0;
const RUNS: u64 = 20;

/// Numbers that look random and are the same in every run.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Estimates and seconds of frames: shows one after another, each as often as it takes.
fn frames() -> (Vec<FrameCost>, Vec<f64>) {
    let text = include_str!("farm_costs.csv");
    let rows: Vec<(f64, f64)> = text
        .lines()
        .skip(1)
        .map(|line| {
            let mut words = line.split(',').skip(2).map(|word| word.parse().expect("a number"));
            (words.next().expect("an estimate"), words.next().expect("a measure"))
        })
        .collect();
    let all: Vec<(f64, f64)> = rows.iter().cycle().take(FRAMES).copied().collect();
    let mean = all.iter().map(|(_, measured)| measured).sum::<f64>() / FRAMES as f64;
    let cost = |(estimate, _): &(f64, f64)| FrameCost { alone: *estimate, shared: *estimate, with: None };
    (all.iter().map(cost).collect(), all.iter().map(|(_, measured)| measured / mean * FRAME_SECONDS).collect())
}

/// When workers are free again, the earliest first; times in whole microseconds.
type Free = BinaryHeap<Reverse<(u64, usize)>>;

fn micros(seconds: f64) -> u64 {
    (seconds * 1e6) as u64
}

/// Seconds until all is done, if worker `w` asks `next` for rows of frames and makes them one after another.
fn run(
    seconds: &[f64],
    speeds: &[f64],
    dice: &mut Dice,
    failing: f64,
    next: &mut dyn FnMut(usize) -> Option<Range<usize>>,
) -> f64 {
    let mut free: Free = (0..speeds.len()).map(|worker| Reverse((0, worker))).collect();
    // Rows that failed, and from when on others may take them.
    let mut lost: Vec<(u64, Range<usize>)> = Vec::new();
    let mut end = 0;
    while let Some(Reverse((at, worker))) = free.pop() {
        let due = lost.iter().position(|(from, _)| *from <= at);
        let row = match due {
            Some(place) => Some(lost.swap_remove(place).1),
            None => next(worker),
        };
        let Some(row) = row else {
            if let Some(from) = lost.iter().map(|(from, _)| *from).min() {
                free.push(Reverse((from, worker)));
            }
            continue;
        };
        let work: f64 = seconds[row.clone()].iter().sum::<f64>() / speeds[worker];
        if dice.next() < failing {
            let until = at + micros(work * dice.next());
            lost.push((until + micros(PATIENCE), row));
            free.push(Reverse((until + micros(PATIENCE), worker)));
            continue;
        }
        end = end.max(at + micros(work));
        free.push(Reverse((at + micros(work), worker)));
    }
    end as f64 / 1e6
}

fn main() {
    let (costs, seconds) = frames();
    let work: f64 = seconds.iter().sum();
    let longest = seconds.iter().copied().fold(0.0, f64::max);
    println!(
        "{FRAMES} frames, {:.0} s each on average, {longest:.0} s the longest; medians of {RUNS} runs, worst in brackets",
        work / FRAMES as f64
    );
    println!("workers  ideal      array             array x8          claims            planner");
    for workers in [100usize, 1_000] {
        let start = Instant::now();
        let parts = split(&costs, workers);
        let small = split(&costs, (8 * workers).min(FRAMES));
        let most = parts.whole / (workers * 16) as f64;
        let of_parts: Vec<_> = parts.ranges.iter().map(|part| units(&costs, part.clone(), most)).collect();
        let first = order(&of_parts, 0);
        let planned = start.elapsed();
        let orders: Vec<_> = (0..workers).map(|worker| order(&of_parts, worker)).collect();
        assert_eq!(first, orders[0]);
        let mut ratios: [Vec<f64>; 3] = Default::default();
        let mut ideals = Vec::new();
        for seed in 0..RUNS {
            let mut dice = Dice(seed * 1_000 + workers as u64);
            let speeds: Vec<f64> =
                (0..workers).map(|_| if dice.next() < SLOW { 1.0 / SLOWNESS } else { 1.0 }).collect();
            let ideal = (work / speeds.iter().sum::<f64>()).max(longest);
            ideals.push(ideal);
            let mut own: Vec<Option<Range<usize>>> = parts.ranges.iter().cloned().map(Some).collect();
            let array = run(&seconds, &speeds, &mut dice, FAILING, &mut |worker| own[worker].take());
            let mut rows = small.ranges.iter().filter(|row| !row.is_empty()).cloned();
            let eight = run(&seconds, &speeds, &mut dice, FAILING, &mut |_| rows.next());
            let claims = with_claims(&seconds, &speeds, &orders, &mut dice);
            ratios.iter_mut().zip([array, eight, claims]).for_each(|(list, time)| list.push(time / ideal));
        }
        let shown = ratios.map(|mut list| {
            list.sort_by(f64::total_cmp);
            format!("{:.2} ({:.2})", list[list.len() / 2], list[list.len() - 1])
        });
        ideals.sort_by(f64::total_cmp);
        let [array, eight, claims] = shown;
        println!(
            "{workers:>7}  {:>6.0} s  {array:<16}  {eight:<16}  {claims:<16}  {:.3} s",
            ideals[ideals.len() / 2],
            planned.as_secs_f64()
        );
    }
}

/// Workers take the first unit of their order that nobody has taken. One unit in a hundred is lost, which is harsher than
/// one task.
fn with_claims(seconds: &[f64], speeds: &[f64], orders: &[Vec<Range<usize>>], dice: &mut Dice) -> f64 {
    let mut is_taken = vec![false; seconds.len()];
    let mut tried = vec![0; orders.len()];
    run(seconds, speeds, dice, FAILING, &mut |worker| {
        let (order, tried) = (&orders[worker], &mut tried[worker]);
        while order.get(*tried).is_some_and(|unit| is_taken[unit.start]) {
            *tried += 1;
        }
        let unit = order.get(*tried)?.clone();
        is_taken[unit.clone()].fill(true);
        Some(unit)
    })
}
