//! Frame rates as fractions: 24000/1001 is not 23.976, and after an hour the difference is four frames.

use std::fmt;

/// Frames per second, as a fraction in lowest terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate {
    numerator: u32,
    denominator: u32,
}

/// Largest denominator that is looked for behind a decimal number.
const FINEST: u64 = 1_000_000;
/// Whole rates that television slowed down by 1000/1001 ...
const SLOWED: [u32; 5] = [24, 30, 48, 60, 120];
/// ... and how far a decimal number may be from such a rate to mean it: 23.98 is 24000/1001 too.
const NEAR_SLOWED: f64 = 0.005;

impl Rate {
    /// That of cinema, where nothing else is said.
    pub const USUAL: Rate = Rate { numerator: 24, denominator: 1 };

    /// A rate of `numerator` / `denominator` frames per second; `None` if either is 0.
    pub fn new(numerator: u32, denominator: u32) -> Option<Rate> {
        let divisor = greatest_common_divisor(numerator, denominator);
        let is_rate = numerator > 0 && denominator > 0;
        is_rate.then(|| Rate { numerator: numerator / divisor, denominator: denominator / divisor })
    }

    /// The fraction that a number stands for: exactly it where one with a denominator up to a million is, the nearest
    /// one otherwise. 23.976, 29.97, 47.952, 59.94 and 119.88 (and their roundings) are 24000/1001 and so on.
    ///
    /// `None` if it is no number above 0, or too large or small for a fraction of 32 bits.
    pub fn from_number(number: f64) -> Option<Rate> {
        if !(number > 0.0 && number.is_finite()) {
            return None;
        }
        for whole in SLOWED {
            let slowed = f64::from(whole) * 1000.0 / 1001.0;
            if (number - slowed).abs() < NEAR_SLOWED {
                return Rate::new(whole * 1000, 1001);
            }
        }
        let (numerator, denominator) = fraction(number)?;
        Rate::new(u32::try_from(numerator).ok()?, u32::try_from(denominator).ok()?)
    }

    /// Reads `24`, `23.976` or `24000/1001`.
    pub fn parse(text: &str) -> Option<Rate> {
        match text.split_once('/') {
            Some((above, below)) => Rate::new(above.trim().parse().ok()?, below.trim().parse().ok()?),
            None => Rate::from_number(text.trim().parse().ok()?),
        }
    }

    /// Frames of `denominator` seconds.
    pub fn numerator(self) -> u32 {
        self.numerator
    }

    /// Seconds that `numerator` frames take.
    pub fn denominator(self) -> u32 {
        self.denominator
    }

    /// Frames per second.
    pub fn per_second(self) -> f64 {
        f64::from(self.numerator) / f64::from(self.denominator)
    }

    /// A rate `times` slower, for frames of which only every so many is shown.
    pub fn slower(self, times: u32) -> Option<Rate> {
        let below = u64::from(self.denominator) * u64::from(times);
        let divisor = greatest_common_divisor(self.numerator, times).max(1);
        let below = u32::try_from(below / u64::from(divisor)).ok()?;
        Rate::new(self.numerator / divisor, below)
    }

    /// When a frame counted from 0 begins, in so many parts of a second, to the nearest one.
    pub fn start(self, frame: u64, parts_per_second: u32) -> u64 {
        let numerator = u128::from(self.numerator);
        let parts = u128::from(frame) * u128::from(self.denominator) * u128::from(parts_per_second);
        u64::try_from((2 * parts + numerator) / (2 * numerator)).unwrap_or(u64::MAX)
    }

    /// How long a frame lasts so that none begins more than half a part late or early, however many there are.
    pub fn delay(self, frame: u64, parts_per_second: u32) -> u64 {
        self.start(frame + 1, parts_per_second) - self.start(frame, parts_per_second)
    }
}

impl fmt::Display for Rate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.denominator {
            1 => write!(f, "{}", self.numerator),
            _ => write!(f, "{}/{}", self.numerator, self.denominator),
        }
    }
}

fn greatest_common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

/// The first convergent of a number's continued fraction that is the number, or the last with a bearable denominator.
fn fraction(number: f64) -> Option<(u64, u64)> {
    let (mut before, mut now) = ((0u64, 1u64), (1u64, 0u64));
    let mut rest = number;
    loop {
        let whole = rest.floor();
        if whole > 4e9 {
            break;
        }
        let next = |a: u64, b: u64| (whole as u64).checked_mul(a)?.checked_add(b);
        let (Some(above), Some(below)) = (next(now.0, before.0), next(now.1, before.1)) else { break };
        if below > FINEST || above > u64::from(u32::MAX) {
            break;
        }
        (before, now) = (now, (above, below));
        if above as f64 / below as f64 == number || rest == whole {
            break;
        }
        rest = 1.0 / (rest - whole);
    }
    (now.0 > 0 && now.1 > 0).then_some(now)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(text: &str) -> Option<(u32, u32)> {
        Rate::parse(text).map(|rate| (rate.numerator, rate.denominator))
    }

    #[test]
    fn rates_are_read_as_the_fractions_they_stand_for() {
        assert_eq!(read("24"), Some((24, 1)));
        assert_eq!(read(" 24000 / 1001 "), Some((24000, 1001)));
        assert_eq!(read("48/2"), Some((24, 1)));
        for (text, whole) in
            [("23.976", 24), ("23.98", 24), ("29.97", 30), ("47.952", 48), ("59.94", 60), ("119.88", 120)]
        {
            assert_eq!(read(text), Some((whole * 1000, 1001)), "{text}");
        }
        assert_eq!(read("12.5"), Some((25, 2)));
        assert_eq!(read("0.1"), Some((1, 10)));
        assert_eq!(read("1000000"), Some((1_000_000, 1)));
        for text in ["", "0", "-24", "24/0", "0/24", "nan", "inf", "x", "1/2/3", "1e300", "1e-300", "1.5/2"] {
            assert_eq!(read(text), None, "{text}");
        }
        assert_eq!(Rate::from_number(24000.0 / 1001.0), Rate::new(24000, 1001));
        assert_eq!(Rate::new(24000, 1001).unwrap().to_string(), "24000/1001");
        assert_eq!(Rate::new(24, 1).unwrap().slower(4), Rate::new(6, 1));
        assert_eq!(Rate::new(25, 1).unwrap().slower(4), Rate::new(25, 4));
    }

    #[test]
    fn delays_are_spread_and_never_drift() {
        let hundredths = |rate: Rate| (0..12).map(|frame| rate.delay(frame, 100)).collect::<Vec<_>>();
        assert_eq!(hundredths(Rate::new(24, 1).unwrap()), [4, 4, 5, 4, 4, 4, 4, 4, 5, 4, 4, 4]);
        assert_eq!(hundredths(Rate::new(25, 1).unwrap()), [4; 12]);
        let rate = Rate::new(24000, 1001).unwrap();
        let total: u64 = (0..24_000).map(|frame| rate.delay(frame, 1000)).sum();
        assert_eq!(total, 1_001_000);
    }

    proptest! {
        #[test]
        fn a_fraction_comes_back_from_its_quotient(above in 1u32..200_000, below in 1u32..1002) {
            let rate = Rate::new(above, below).unwrap();
            let is_slowed = SLOWED.iter().any(|n| (rate.per_second() - f64::from(*n) / 1.001).abs() < NEAR_SLOWED);
            prop_assume!(!is_slowed);
            prop_assert_eq!(Rate::from_number(rate.per_second()), Some(rate));
            prop_assert_eq!(Rate::parse(&rate.to_string()), Some(rate));
        }

        #[test]
        fn any_number_is_a_near_fraction_or_none(number in 1e-3f64..1e6) {
            let rate = Rate::from_number(number).unwrap();
            prop_assert!((rate.per_second() - number).abs() <= NEAR_SLOWED.max(1e-6 * number));
        }
    }
}
