//! A process that feeds a reader, and the one that watches over it.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use cap::Cap;

use crate::mutate;
use crate::readers::Reader;

/// What a worker does.
pub enum Job {
    /// Inputs from a number on, for so many milliseconds.
    Run { from: u64, milliseconds: u64 },
    /// So many inputs from a number on, each told before it is read.
    Step { from: u64, count: u64 },
    /// One input, from standard input.
    One,
}

/// An input that ended a worker: its number, and how.
pub struct Finding {
    pub number: u64,
    pub how: String,
}

pub struct Outcome {
    pub inputs: u64,
    pub finding: Option<Finding>,
}

/// Inputs after which a worker says how far it is.
const STRIDE: u64 = 32;
/// Seconds that one input may take: in a debug build, on a busy machine.
const PATIENCE: u64 = 20;
/// Bytes that a reader may hold at once: inputs are small, and what they declare is not to be believed.
const MEMORY: usize = 1 << 30;

impl Job {
    pub fn parse(text: &str) -> Job {
        let numbers: Vec<u64> = text.split(',').skip(1).map(|word| word.parse().expect("a number")).collect();
        match (text.split(',').next(), &numbers[..]) {
            (Some("run"), [from, milliseconds]) => Job::Run { from: *from, milliseconds: *milliseconds },
            (Some("step"), [from, count]) => Job::Step { from: *from, count: *count },
            _ => Job::One,
        }
    }

    fn text(&self) -> String {
        match self {
            Job::Run { from, milliseconds } => format!("run,{from},{milliseconds}"),
            Job::Step { from, count } => format!("step,{from},{count}"),
            Job::One => "one".into(),
        }
    }
}

/// The number that is being read, and when it was begun.
static CURRENT: AtomicU64 = AtomicU64::new(0);

/// Works on a job in this process.
pub fn work(reader: &'static Reader, seed: u64, job: &Job, allocator: &'static Cap<std::alloc::System>) -> ExitCode {
    let folder = tempfile::tempdir().expect("a folder");
    std::thread::spawn(give_up_when_stuck);
    let read = |bytes: &[u8]| {
        let _ = allocator.set_limit(allocator.allocated() + MEMORY);
        (reader.read)(folder.path(), bytes);
        let _ = allocator.set_limit(usize::MAX);
        CURRENT.fetch_add(1, Ordering::Relaxed);
    };
    let seeds = (reader.seeds)();
    let tell = |number: u64| {
        let mut out = std::io::stdout().lock();
        let _ = writeln!(out, "{number}").and_then(|()| out.flush());
    };
    let of = |number| mutate::input(&seeds, reader.words, seed, number);
    match *job {
        Job::Run { from, milliseconds } => {
            let start = Instant::now();
            for number in from.. {
                if number % STRIDE == 0 {
                    tell(number);
                }
                // The seeds of the corpus are read in any case.
                if start.elapsed() >= Duration::from_millis(milliseconds) && number >= seeds.len() as u64 {
                    tell(number);
                    break;
                }
                read(&of(number));
            }
        }
        Job::Step { from, count } => {
            for number in from..from + count {
                tell(number);
                read(&of(number));
            }
        }
        Job::One => {
            let mut input = Vec::new();
            std::io::Read::read_to_end(&mut std::io::stdin().lock(), &mut input).expect("an input");
            read(&input);
        }
    }
    ExitCode::SUCCESS
}

fn give_up_when_stuck() {
    let (mut seen, mut since) = (u64::MAX, Instant::now());
    loop {
        std::thread::sleep(Duration::from_millis(200));
        let current = CURRENT.load(Ordering::Relaxed);
        if current != seen {
            (seen, since) = (current, Instant::now());
        } else if since.elapsed() > Duration::from_secs(PATIENCE) {
            eprintln!("an input takes longer than {PATIENCE} s");
            std::process::exit(3);
        }
    }
}

fn start(reader: &Reader, seed: u64, job: &Job, input: Stdio) -> Child {
    Command::new(std::env::current_exe().expect("this program"))
        .args(["--reader", reader.name, "--seed", &seed.to_string(), "--worker", &job.text()])
        .stdin(input)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("a worker")
}

/// Waits for a worker: the last number that it told, and how it ended if that was not well.
fn last_of(mut child: Child) -> (u64, Option<String>) {
    let lines = BufReader::new(child.stdout.take().expect("a pipe")).lines();
    let last = lines.map_while(Result::ok).filter_map(|line| line.parse().ok()).last().unwrap_or(0);
    let output = child.wait_with_output().expect("an end");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let how = (!output.status.success()).then(|| format!("{}\n{}", output.status, said.trim()));
    (last, how)
}

/// Feeds a reader for a time, in a process of its own; finds the input that ended it, if one did.
pub fn watch(reader: &Reader, seed: u64, time: Duration) -> Outcome {
    let job = Job::Run { from: 0, milliseconds: time.as_millis() as u64 };
    let (last, how) = last_of(start(reader, seed, &job, Stdio::null()));
    let Some(how) = how else { return Outcome { inputs: last, finding: None } };
    let (number, again) = last_of(start(reader, seed, &Job::Step { from: last, count: STRIDE }, Stdio::null()));
    let finding = again.map_or(Finding { number: last, how }, |how| Finding { number, how });
    Outcome { inputs: last, finding: Some(finding) }
}

/// How a reader ends on one input, if that is not well.
pub fn outcome_of(reader: &Reader, input: &[u8]) -> Option<String> {
    let mut child = start(reader, 0, &Job::One, Stdio::piped());
    // A worker that ends before it has read all of it says so by its status.
    let _ = child.stdin.take().expect("a pipe").write_all(input);
    last_of(child).1
}
