//! States of simulations beside the frames, so that a run in the middle of a sequence need not begin at its start.
//!
//! A checkpoint is a state of the simulation by its step, under a name that covers the program, the script's path and
//! parameters and the scene that the simulation started from; inside stands what the script has read, its own text and
//! its modules included, and all of it must be as it was. States are data, exact to the bit, so that frames have the same
//! bytes with them and without. They may be removed at any time.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::Input;
use super::fingerprint::PICTURES;
use crate::base::codec::{Decoder, Encoder, SharedTable};
use crate::base::digest::{Digest, Hasher};
use crate::base::project::{FileRole, ReadFile};
use crate::base::{files, limits};
use crate::components::{Scene, Value};
use crate::output::write_atomic;
use crate::script::{MadeStates, Program};

/// The folder of checkpoints in a folder of frames.
pub const FOLDER: &str = ".anim-checkpoints";
/// Frames from one checkpoint to the next.
const EVERY: u64 = 64;
/// Simulations of fewer steps are made anew in no time.
const FEW: u64 = 16;
/// The last bytes of a file: the digest of those before.
const SEAL: usize = size_of::<u128>();

/// A simulation that can be gone on with.
struct Simulated<'a> {
    program: &'a Program,
    scene: &'a Arc<Scene>,
    folder: PathBuf,
    key: Digest,
    per_frame: u64,
}

impl<'a> Simulated<'a> {
    fn of(input: &'a Input, folder: &Path) -> Option<Self> {
        let (program, scene) = input.program.as_ref()?;
        let of_script = program.simulation_key(scene)?;
        let mut hasher = Hasher::default();
        hasher.word(PICTURES.into());
        hasher.digest(of_script);
        let per_frame = u64::from(program.header().steps_per_frame);
        Some(Simulated { program, scene, folder: folder.join(FOLDER), key: hasher.finish(), per_frame })
    }

    fn file(&self, step: u64) -> PathBuf {
        self.folder.join(format!("{:032x}-{step}.state", self.key.0))
    }

    /// The step that a frame needs first, while the shutter may open before its time.
    fn first_step(&self, frame: u32) -> u64 {
        u64::from(frame.saturating_sub(2)) * self.per_frame
    }

    /// Steps of this simulation that there are checkpoints of.
    fn steps(&self) -> Vec<u64> {
        let start = format!("{:032x}-", self.key.0);
        let Ok(entries) = std::fs::read_dir(&self.folder) else { return Vec::new() };
        let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
        let step = |name: String| name.strip_prefix(&start)?.strip_suffix(".state")?.parse().ok();
        let mut steps: Vec<u64> = names.filter_map(step).collect();
        steps.sort_unstable();
        steps
    }

    /// A state as it was written, if that is whole and what the script has read is as it was.
    fn read(&self, step: u64, known: &mut BTreeMap<(PathBuf, u128), bool>) -> Option<Value> {
        let bytes = files::read_bytes(&self.file(step), limits::CHECKPOINT_BYTES).ok()?;
        let (content, seal) = bytes.split_at_checked(bytes.len().checked_sub(SEAL)?)?;
        if Digest::of(content).0.to_le_bytes() != *seal {
            return None;
        }
        let mut decoder = Decoder::new(content, SharedTable::default(), false);
        let same = decoder.get::<u64>().ok()? == step;
        let read: Vec<(PathBuf, ReadFile)> = decoder.get().ok()?;
        let mut is_as_it_was = |(path, file): &(PathBuf, ReadFile)| {
            let key = (path.clone(), file.content.0);
            *known.entry(key).or_insert_with(|| content_of(path, file.role) == file.content)
        };
        let same = same && !read.is_empty() && read.iter().all(&mut is_as_it_was);
        same.then(|| decoder.get().ok())?
    }

    fn write(&self, step: u64, state: &Value, read: &[(PathBuf, ReadFile)]) -> Option<u64> {
        let mut encoder = Encoder::default();
        encoder.put(&step);
        encoder.put(&read.to_vec());
        encoder.put(state);
        let seal = Digest::of(&encoder.bytes).0.to_le_bytes();
        encoder.bytes.extend(seal);
        let size = encoder.bytes.len() as u64;
        let fits = size <= limits::CHECKPOINT_BYTES;
        // A folder that cannot be written to costs time in the next run, and nothing else.
        (fits && write_atomic(&self.file(step), &encoder.bytes).is_ok()).then_some(size)
    }
}

/// What a file holds now, as scripts read it.
fn content_of(path: &Path, role: FileRole) -> Digest {
    let bytes = match role {
        FileRole::Script | FileRole::Module => {
            files::read_text(path, limits::SCRIPT_FILE_BYTES).map(String::into_bytes)
        }
        FileRole::Scene | FileRole::Mesh | FileRole::Image | FileRole::Data => {
            files::read_bytes(path, limits::DATA_FILE_BYTES)
        }
    };
    Digest::of(&bytes.unwrap_or_default())
}

/// Lets the simulation of an input go on from what is there beside its frames, as far as these frames can use it.
pub(super) fn load(input: &Input, folder: &Path, wanted: &[u32]) {
    let Some((first, last)) = wanted.iter().min().zip(wanted.iter().max()) else { return };
    let Some(simulated) = Simulated::of(input, folder) else { return };
    let (from, to) = (simulated.first_step(*first), u64::from(*last) * simulated.per_frame);
    let steps: Vec<u64> = simulated.steps().into_iter().filter(|step| *step <= to).collect();
    let begin = steps.partition_point(|step| *step <= from).saturating_sub(1);
    let (mut known, mut bytes) = (BTreeMap::new(), 0);
    let mut states = Vec::new();
    for step in &steps[begin..] {
        let size = std::fs::metadata(simulated.file(*step)).map_or(0, |file| file.len());
        bytes += size;
        if bytes > limits::CHECKPOINT_BYTES {
            break;
        }
        states.extend(simulated.read(*step, &mut known).map(|state| (*step, state)));
    }
    if !states.is_empty() {
        simulated.program.resume(simulated.scene, states);
    }
}

/// Keeps states that were made for these frames beside them.
pub(super) fn save(input: &Input, folder: &Path, wanted: impl Iterator<Item = u32>) {
    let Some(last) = wanted.max() else { return };
    let Some(simulated) = Simulated::of(input, folder) else { return };
    let end = simulated.first_step(last);
    if end < FEW {
        return;
    }
    let there = simulated.steps();
    let regular = (1..).map(|i| i * EVERY * simulated.per_frame).take_while(|step| *step < end);
    let steps: Vec<u64> = regular.chain([end]).filter(|step| there.binary_search(step).is_err()).collect();
    if steps.is_empty() {
        return;
    }
    let MadeStates { mut states, mut read } = simulated.program.states(simulated.scene, &steps);
    // Later ones first: they spare the most.
    states.sort_by_key(|(step, _)| std::cmp::Reverse(*step));
    states.dedup_by_key(|(step, _)| *step);
    read.sort_by(|a, b| a.0.cmp(&b.0));
    read.dedup();
    let is_one = read.windows(2).all(|pair| pair[0].0 != pair[1].0);
    if states.is_empty() || !is_one {
        // Files that changed while they were read belong to no one state.
        return;
    }
    let mut size = 0;
    for (step, state) in &states {
        match simulated.write(*step, state, &read) {
            Some(bytes) if size + bytes <= limits::CHECKPOINT_BYTES => size += bytes,
            _ => break,
        }
    }
    tidy(&simulated);
}

/// Removes checkpoints of other scripts, scenes and versions until the rest takes no more than it may, then the earliest
/// ones.
fn tidy(simulated: &Simulated) {
    let Ok(entries) = std::fs::read_dir(&simulated.folder) else { return };
    let own = format!("{:032x}-", simulated.key.0);
    let size = |entry: &std::fs::DirEntry| entry.metadata().map_or(0, |file| file.len());
    let mut all: Vec<(bool, u64, PathBuf, u64)> = entries
        .flatten()
        .map(|entry| {
            let name = entry.file_name().to_string_lossy().into_owned();
            let step = name.rsplit_once('-').and_then(|(_, rest)| rest.strip_suffix(".state")?.parse().ok());
            (name.starts_with(&own), step.unwrap_or(0), entry.path(), size(&entry))
        })
        .collect();
    all.sort();
    let mut total: u64 = all.iter().map(|(_, _, _, size)| size).sum();
    for (_, _, path, size) in all {
        if total <= limits::CHECKPOINT_BYTES {
            return;
        }
        // What another process removes meanwhile is gone as well.
        let _ = std::fs::remove_file(path);
        total -= size;
    }
}
