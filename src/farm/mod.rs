//! A sequence on many machines: what is handed to schedulers, and what workers tell each other.
//!
//! There is no scheduler here. Jobs are written for those that people have, and everything that a job needs is a command
//! of this program: frames are pure, so that a lost task is only started again. This room may ask what time it is: no
//! picture depends on it.
//!
//! - [`archive`]: everything that a shot needs, in one file or folder, by content
//! - [`job`]: the frames of a shot in tasks, with what each needs
//! - [`slurm`], [`openjd`], [`make`]: how it is written down; [`quote`]: so that it is read as it is meant
//! - [`share`]: a worker that claims frames in a folder that several work on
//! - [`tiles`]: one picture in parts
//! - [`status`]: what a folder of frames has and lacks, from manifests and claims alone

pub mod archive;
pub mod job;
pub mod make;
pub mod openjd;
pub mod quote;
pub mod share;
pub mod slurm;
pub mod status;
pub mod tiles;

use std::time::{SystemTime, UNIX_EPOCH};

/// Seconds since 1970 by the clock of this machine, for people to read: nothing is decided by it.
pub fn now() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |passed| passed.as_secs_f64())
}

/// Frame numbers as `--frames` takes them: `1-10,20,30-60x5`, in their order.
pub fn frame_list(numbers: &[u32]) -> String {
    let mut parts: Vec<String> = Vec::new();
    let mut at = 0;
    while at < numbers.len() {
        let step = numbers.get(at + 1).map_or(0, |next| next.saturating_sub(numbers[at]));
        let is_next = |pair: &&[u32]| step > 0 && pair[1].checked_sub(pair[0]) == Some(step);
        let more = numbers[at..].windows(2).take_while(is_next).count();
        let (first, last) = (numbers[at], numbers[at + more]);
        match (more, step) {
            (0, _) => parts.push(first.to_string()),
            (_, 1) => parts.push(format!("{first}-{last}")),
            // Two numbers are shorter as they are.
            (1, _) => parts.push(first.to_string()),
            (_, step) => parts.push(format!("{first}-{last}x{step}")),
        }
        at += if more == 1 && step > 1 { 1 } else { more + 1 };
    }
    parts.join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_listed_as_they_are_asked_for() {
        for (numbers, list) in [
            (vec![], ""),
            (vec![7], "7"),
            (vec![1, 2, 3, 9], "1-3,9"),
            (vec![1, 3, 5, 7, 8, 9], "1-7x2,8-9"),
            (vec![5, 9, 4, 3], "5,9,4,3"),
            (vec![2, 2], "2,2"),
        ] {
            assert_eq!(frame_list(&numbers), list);
        }
    }
}
