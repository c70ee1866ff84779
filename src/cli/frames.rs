//! The grammar of `--frames`: `1-10,20,30-60x5`.

use rustc_hash::FxHashSet;

use crate::base::limits;

/// Frame numbers in the order given, each once. `last` is the number of frames of the sequence.
///
/// # Errors
/// What part of the text is wrong, and why.
pub fn parse(text: &str, last: u32) -> Result<Vec<u32>, String> {
    let mut seen = FxHashSet::default();
    let mut frames = Vec::new();
    for part in text.split(',') {
        let part = part.trim();
        let (range, step) = match part.split_once('x') {
            Some((range, step)) => (range, number(step, part)?),
            None => (part, 1),
        };
        let (from, to) = match range.split_once('-') {
            Some((from, to)) => (number(from, part)?, number(to, part)?),
            None => (number(range, part)?, number(range, part)?),
        };
        let wrong = |why: String| Err(format!("--frames `{part}`: {why}"));
        if from == 0 || to == 0 {
            return wrong("frames are numbered from 1".into());
        }
        if step == 0 {
            return wrong("the step must be at least 1".into());
        }
        if to < from {
            return wrong(format!("the range runs backwards; write {to}-{from}"));
        }
        if to > last.min(limits::FRAMES) {
            return wrong(format!("the sequence has {last} frames"));
        }
        frames.extend((from..=to).step_by(step as usize).filter(|frame| seen.insert(*frame)));
    }
    Ok(frames)
}

fn number(text: &str, part: &str) -> Result<u32, String> {
    let plain = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let parsed = if plain { text.parse().ok() } else { None };
    parsed.ok_or_else(|| format!("--frames `{part}`: expected numbers as in 1-10,20,30-60x5, found `{text}`"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn ranges_steps_and_order() {
        assert_eq!(parse("1-3,20,30-60x15", 60).unwrap(), [1, 2, 3, 20, 30, 45, 60]);
        assert_eq!(parse("4,2, 2-5", 9).unwrap(), [4, 2, 3, 5]);
        for (text, word) in
            [("0", "from 1"), ("3-1", "1-3"), ("1-99", "has 9 frames"), ("", "expected"), ("1-2x0", "step")]
        {
            assert!(parse(text, 9).unwrap_err().contains(word), "{text}");
        }
        assert!(parse("99999999999", 9).is_err() && parse("-1", 9).is_err() && parse("+1", 9).is_err());
    }

    proptest! {
        #[test]
        fn whatever_is_accepted_lies_in_the_sequence(text in "[0-9,x -]{0,12}", last in 1u32..50) {
            if let Ok(frames) = parse(&text, last) {
                prop_assert!(frames.iter().all(|f| (1..=last).contains(f)));
            }
        }
    }
}
