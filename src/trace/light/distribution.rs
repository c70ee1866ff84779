//! Choosing among things by weight.

/// Things to choose among by weight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DiscreteDistribution {
    /// Sums of weights up to and with each, over the sum of all.
    pub(super) ends: Vec<f32>,
    pub(super) total: f64,
}

impl DiscreteDistribution {
    pub(super) fn new(weights: impl Iterator<Item = f64>) -> Self {
        let weights: Vec<f64> = weights.collect();
        let total: f64 = weights.iter().sum();
        let mut sum = 0.0;
        let mut end = |w: f64| {
            sum += w;
            (sum / total) as f32
        };
        let ends = if total > 0.0 { weights.into_iter().map(&mut end).collect() } else { Vec::new() };
        DiscreteDistribution { ends, total }
    }

    pub fn chance(&self, i: usize) -> f32 {
        let before = if i == 0 { 0.0 } else { self.ends.get(i - 1).copied().unwrap_or(0.0) };
        self.ends.get(i).map_or(0.0, |end| end - before)
    }

    /// The one that a number in 0..1 falls to, and where in its share.
    pub fn pick(&self, u: f32) -> Option<(usize, f32)> {
        let last = self.ends.len().checked_sub(1)?;
        let i = self.ends.partition_point(|end| *end <= u).min(last);
        let chance = self.chance(i);
        let before = if i == 0 { 0.0 } else { self.ends[i - 1] };
        (chance > 0.0).then(|| (i, ((u - before) / chance).clamp(0.0, 1.0 - f32::EPSILON / 2.0)))
    }
}
