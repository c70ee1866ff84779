//! Findings, cut down to what still is one.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use crate::mutate;
use crate::readers::Reader;
use crate::worker::{self, Finding};

/// Time that cutting down may take.
const PATIENCE: Duration = Duration::from_secs(60);

/// Whether a reader ends badly on an input, which is then told.
pub fn fails(reader: &Reader, input: &[u8]) -> bool {
    let how = worker::outcome_of(reader, input);
    println!("{}", how.as_deref().unwrap_or("it is read, or refused"));
    how.is_some()
}

/// Tells of a finding and writes its input down.
pub fn report(reader: &Reader, seed: u64, finding: &Finding) {
    let input = mutate::input(&(reader.seeds)(), reader.words, seed, finding.number);
    let small = minimized(reader, &input);
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("target/fuzz");
    let file = folder.join(format!("{}-{seed}-{}", reader.name, finding.number));
    std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&file, &small)).expect("room for a finding");
    println!("{}: input {} of seed {seed}: {}", reader.name, finding.number, finding.how);
    println!("{} bytes, {} of them needed: {}", input.len(), small.len(), file.display());
}

/// The input without the parts that it fails without as well.
fn minimized(reader: &Reader, input: &[u8]) -> Vec<u8> {
    let (start, mut small) = (Instant::now(), input.to_vec());
    if worker::outcome_of(reader, &small).is_none() {
        // Something in its surroundings is at fault too.
        return small;
    }
    let mut part = small.len().div_ceil(2);
    while part > 0 && start.elapsed() < PATIENCE {
        let mut at = 0;
        while at < small.len() && start.elapsed() < PATIENCE {
            let end = (at + part).min(small.len());
            let without = [&small[..at], &small[end..]].concat();
            match worker::outcome_of(reader, &without) {
                Some(_) => small = without,
                None => at = end,
            }
        }
        part = if part == 1 { 0 } else { part.div_ceil(2) };
    }
    small
}
