//! Readers under random input: none may panic, overflow, hang or fill memory, whatever a file holds.
//!
//! ```text
//! cargo test --test fuzz -- --minutes 1                 all readers, a minute together
//! cargo test --test fuzz -- --minutes 10 --reader ron   one of them; --seed N for other inputs
//! cargo test --test fuzz -- --reader ron --input FILE   one input, to look into a finding
//! ```
//!
//! Each reader works in a process of its own, on inputs that follow from the seed and a number, so that whatever ends the
//! process can be made again. The input is then cut down to what still does it and written below `target/fuzz`; mended, it
//! belongs into the tests of its reader. `cargo test` alone leaves this out; without arguments it takes a few seconds.

mod minimize;
mod mutate;
mod readers;
mod worker;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use cap::Cap;
use readers::{READERS, Reader};

/// Counts, so that an input that makes a reader ask for more than its share is found.
#[global_allocator]
static ALLOCATOR: Cap<std::alloc::System> = Cap::new(std::alloc::System, usize::MAX);

/// Minutes of a run that nobody has given any.
const USUAL_MINUTES: f64 = 0.05;

/// What the command line asks for.
struct Wanted {
    minutes: f64,
    seed: u64,
    readers: Vec<&'static Reader>,
    input: Option<PathBuf>,
    worker: Option<worker::Job>,
}

fn main() -> ExitCode {
    let wanted = arguments();
    if let Some(job) = &wanted.worker {
        return worker::work(wanted.readers[0], wanted.seed, job, &ALLOCATOR);
    }
    if let Some(file) = &wanted.input {
        let input = std::fs::read(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        return if minimize::fails(wanted.readers[0], &input) { ExitCode::FAILURE } else { ExitCode::SUCCESS };
    }
    let share = Duration::from_secs_f64(60.0 * wanted.minutes / wanted.readers.len() as f64);
    let (start, mut findings) = (Instant::now(), 0);
    for reader in &wanted.readers {
        let outcome = worker::watch(reader, wanted.seed, share);
        println!("{:>9}: {} inputs", reader.name, outcome.inputs);
        if let Some(finding) = outcome.finding {
            findings += 1;
            minimize::report(reader, wanted.seed, &finding);
        }
    }
    println!("{findings} findings in {:.1} min, seed {}", start.elapsed().as_secs_f64() / 60.0, wanted.seed);
    if findings > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

fn arguments() -> Wanted {
    let mut wanted =
        Wanted { minutes: USUAL_MINUTES, seed: 1, readers: READERS.iter().collect(), input: None, worker: None };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().unwrap_or_else(|| panic!("{word} needs a value"));
        match word.as_str() {
            "--minutes" => wanted.minutes = value().parse().expect("minutes"),
            "--seed" => wanted.seed = value().parse().expect("a seed"),
            "--input" => wanted.input = Some(value().into()),
            "--worker" => wanted.worker = Some(worker::Job::parse(&value())),
            "--reader" => {
                let name = value();
                let known = || READERS.iter().map(|reader| reader.name).collect::<Vec<_>>().join(", ");
                let found = READERS.iter().find(|reader| reader.name == name);
                wanted.readers = vec![found.unwrap_or_else(|| panic!("no reader `{name}`: {}", known()))];
            }
            other => panic!("`{other}` is none of --minutes, --seed, --reader and --input"),
        }
    }
    wanted
}
