//! Sweeps of a parameter: `aperture=0..0.4/9`, or `lens=Disk,Square`.

/// A parameter of a script and the values that it takes, as they are given to the script.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sweep {
    pub name: String,
    pub values: Vec<String>,
}

/// Pictures on a sheet: more cannot be told apart on one, and each is a rendering.
pub const MOST_TILES: usize = 1_024;

impl Sweep {
    /// Reads `NAME=FROM..TO/COUNT`, both ends included, or `NAME=VALUE,VALUE`.
    ///
    /// # Errors
    /// What was expected.
    pub fn parse(text: &str) -> Result<Sweep, String> {
        let expected = || "expected NAME=FROM..TO/COUNT or NAME=VALUE,VALUE, as in aperture=0..0.4/9".to_string();
        let (name, values) = text.split_once('=').filter(|(name, _)| !name.is_empty()).ok_or_else(expected)?;
        let values = match values.split_once("..") {
            Some((from, rest)) => {
                let (to, count) = rest.split_once('/').ok_or_else(expected)?;
                let number = |text: &str| text.trim().parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(expected);
                let count: usize = count.trim().parse().map_err(|_| expected())?;
                if !(2..=MOST_TILES).contains(&count) {
                    return Err(format!("a sweep has from 2 to {MOST_TILES} values"));
                }
                spread(number(from)?, number(to)?, count)
            }
            None => values.split(',').map(|value| value.trim().to_string()).collect(),
        };
        if values.iter().any(String::is_empty) || values.len() > MOST_TILES {
            return Err(expected());
        }
        Ok(Sweep { name: name.trim().to_string(), values })
    }
}

/// Numbers at equal steps, without the digits that are only rounding.
fn spread(from: f64, to: f64, count: usize) -> Vec<String> {
    let at = |i: usize| from + (to - from) * i as f64 / (count - 1) as f64;
    let size = from.abs().max(to.abs());
    let rounded = |x: f64| {
        let shown = format!("{x:.12e}").parse().unwrap_or(x);
        if shown.abs() < size * 1e-12 { 0.0 } else { shown }
    };
    (0..count).map(|i| rounded(at(i)).to_string()).collect()
}

/// Every combination of the values, the first sweep running fastest.
pub fn combinations(sweeps: &[Sweep]) -> Vec<Vec<(String, String)>> {
    let start = vec![Vec::new()];
    sweeps.iter().rev().fold(start, |before, sweep| {
        let with = |rest: &Vec<(String, String)>| {
            let one = |value: &String| [vec![(sweep.name.clone(), value.clone())], rest.clone()].concat();
            sweep.values.iter().map(one).collect::<Vec<_>>()
        };
        before.iter().flat_map(with).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_and_lists_become_values() {
        assert_eq!(Sweep::parse("a=0..0.4/5").unwrap().values, ["0", "0.1", "0.2", "0.3", "0.4"]);
        assert_eq!(Sweep::parse("a=-1..1/3").unwrap().values, ["-1", "0", "1"]);
        assert_eq!(Sweep::parse("a=1..0/2").unwrap().values, ["1", "0"]);
        assert_eq!(Sweep::parse("a=0..1/4").unwrap().values[1], "0.3333333333333");
        assert_eq!(Sweep::parse("lens=Disk, Square").unwrap().values, ["Disk", "Square"]);
        for wrong in ["a", "=1", "a=", "a=1,,2", "a=1..2", "a=1..2/1", "a=1..2/x", "a=x..2/3", "a=1..2/99999"] {
            assert!(Sweep::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn two_sweeps_make_rows_of_the_first() {
        let sweeps = ["a=1,2,3", "b=x,y"].map(|text| Sweep::parse(text).unwrap());
        let all: Vec<String> =
            combinations(&sweeps).iter().map(|set| set.iter().map(|(_, v)| v.as_str()).collect()).collect();
        assert_eq!(all, ["1x", "2x", "3x", "1y", "2y", "3y"]);
        assert_eq!(combinations(&[]), [vec![]]);
    }
}
