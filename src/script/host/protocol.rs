//! What the program and a script's process say to each other: messages with their length before them.

use std::io::{self, Read, Write};
use std::path::PathBuf;

use crate::base::codec::{Codec, Decoder, Encoder, Malformed};
use crate::base::diagnostics::{Diagnostics, Place, ScenePart};
use crate::base::digest::Digest;
use crate::base::limits;
use crate::base::project::{FileRole, ReadFile};
use crate::base::rate::Rate;
use crate::components::Kind;
use crate::script::Moment;
use crate::script::said::Remarks;
use crate::script::simulation::NumberedStates;
use crate::script::time::{Header, TimeMode};

/// What the program asks for.
pub enum Request {
    /// Open a script; answered with [`Opened`].
    Open(Opening),
    /// The scene that calls start from until there is another one; not answered. It is in the message behind this one.
    Scene,
    /// Call `setup`, or `frame` at a time; answered with edits.
    Call(Option<Moment>),
    /// States of its simulation that were made before, by their numbers; not answered.
    Resume(NumberedStates),
    /// States of these numbers, as far as they were made; answered with [`MadeStates`].
    States(Vec<u64>),
    /// How what follows is to be run.
    Probe(Probing),
    /// Where a call writes to a part of the scene; answered with a place, if there is one.
    PlaceOf(Option<Moment>, ScenePart, Option<&'static str>),
}

/// How far and how closely watched a run is to be made, to find out where it ends its process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Probing {
    /// Steps are told: every n-th, from one of them on.
    Tell { from: u64, every: u64 },
    /// The run ends at this step, with an error in its place.
    StopAt(u64),
}

/// Everything that decides what a script is.
#[derive(Clone)]
pub struct Opening {
    /// The version of the program that asks.
    pub version: String,
    pub path: PathBuf,
    pub defines: Vec<(String, String)>,
    pub root: PathBuf,
    pub allowed: Vec<PathBuf>,
}

/// A script that is open.
pub struct Opened {
    /// What the script says of itself.
    pub header: Header,
    /// Whether it has a function `setup`.
    pub has_setup: bool,
    /// Where the script names its scene.
    pub place_of_scene: Place,
    /// Whether it has a simulation.
    pub simulates: bool,
}

/// States of a simulation, and what the script has read so far.
#[derive(Default)]
pub struct MadeStates {
    /// By the numbers of their steps.
    pub states: NumberedStates,
    /// Files with what was in them.
    pub read: Vec<(PathBuf, ReadFile)>,
}

/// What comes back.
pub enum Reply<T> {
    /// The run was made; with the files that it has looked for since the last reply, and what it said on its way.
    Done { outcome: Result<T, Diagnostics>, files: Vec<(PathBuf, FileRole)>, remarks: Remarks },
    /// It is at this step.
    Step(u64),
    /// It is at this step and takes too long; the process ends.
    Overdue(u64),
}

/// Writes one message.
pub fn send(to: &mut impl Write, bytes: &[u8]) -> io::Result<()> {
    let length = u32::try_from(bytes.len()).map_err(|_| io::Error::from(io::ErrorKind::FileTooLarge))?;
    to.write_all(&length.to_le_bytes())?;
    to.write_all(bytes)?;
    to.flush()
}

/// Reads one message; `None` if the other end has hung up between two.
pub fn receive(from: &mut impl Read) -> io::Result<Option<Vec<u8>>> {
    let mut length = [0; 4];
    if from.read(&mut length[..1])? == 0 {
        return Ok(None);
    }
    from.read_exact(&mut length[1..])?;
    let length = u64::from(u32::from_le_bytes(length));
    if length > limits::SCRIPT_MESSAGE {
        return Err(io::ErrorKind::InvalidData.into());
    }
    let mut bytes = Vec::new();
    from.take(length).read_to_end(&mut bytes)?;
    if bytes.len() as u64 == length { Ok(Some(bytes)) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
}

/// Paths go as text: both ends run on one machine, and names that are no text are told as the program shows them.
impl Codec for PathBuf {
    fn encode(&self, to: &mut Encoder) {
        to.put(&self.to_string_lossy().into_owned());
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        from.get::<String>().map(PathBuf::from)
    }
}

impl Codec for FileRole {
    fn encode(&self, to: &mut Encoder) {
        to.put(&(*self as u8));
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        FileRole::ALL.get(usize::from(from.get::<u8>()?)).copied().ok_or(Malformed)
    }
}

impl Codec for ScenePart {
    fn encode(&self, to: &mut Encoder) {
        let (tag, index) = match self {
            ScenePart::Camera => (0u8, 0),
            ScenePart::Render => (1, 0),
            ScenePart::Material(index) => (2, *index),
            ScenePart::Entity(index) => (3, *index),
        };
        to.put(&tag);
        to.put(&index);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        let (tag, index) = (from.get::<u8>()?, from.get()?);
        match tag {
            0 => Ok(ScenePart::Camera),
            1 => Ok(ScenePart::Render),
            2 => Ok(ScenePart::Material(index)),
            3 => Ok(ScenePart::Entity(index)),
            _ => Err(Malformed),
        }
    }
}

impl Codec for Probing {
    fn encode(&self, to: &mut Encoder) {
        let (is_stop, a, b) = match self {
            Probing::Tell { from, every } => (false, *from, *every),
            Probing::StopAt(step) => (true, *step, 0),
        };
        to.put(&is_stop);
        to.put(&a);
        to.put(&b);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        let (is_stop, a, b) = (from.get()?, from.get()?, from.get::<u64>()?);
        Ok(if is_stop { Probing::StopAt(a) } else { Probing::Tell { from: a, every: b.max(1) } })
    }
}

impl Codec for Opening {
    fn encode(&self, to: &mut Encoder) {
        let Opening { version, path, defines, root, allowed } = self;
        to.put(version);
        to.put(path);
        to.put(defines);
        to.put(root);
        to.put(allowed);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(Opening {
            version: from.get()?,
            path: from.get()?,
            defines: from.get()?,
            root: from.get()?,
            allowed: from.get()?,
        })
    }
}

impl Codec for Request {
    fn encode(&self, to: &mut Encoder) {
        match self {
            Request::Open(opening) => {
                to.put(&0u8);
                to.put(opening);
            }
            Request::Scene => to.put(&1u8),
            Request::Call(time) => {
                to.put(&2u8);
                to.put(time);
            }
            Request::Probe(probing) => {
                to.put(&3u8);
                to.put(probing);
            }
            Request::Resume(states) => {
                to.put(&5u8);
                to.put(states);
            }
            Request::States(steps) => {
                to.put(&6u8);
                to.put(steps);
            }
            Request::PlaceOf(time, part, component) => {
                to.put(&4u8);
                to.put(time);
                to.put(part);
                to.put(&component.map(str::to_string));
            }
        }
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        match from.get::<u8>()? {
            0 => from.get().map(Request::Open),
            1 => Ok(Request::Scene),
            2 => from.get().map(Request::Call),
            3 => from.get().map(Request::Probe),
            4 => {
                let (time, part, component) = (from.get()?, from.get()?, from.get::<Option<String>>()?);
                let component = component.and_then(|name| Kind::parse(&name)).map(Kind::name);
                Ok(Request::PlaceOf(time, part, component))
            }
            5 => from.get().map(Request::Resume),
            6 => from.get().map(Request::States),
            _ => Err(Malformed),
        }
    }
}

impl Codec for ReadFile {
    fn encode(&self, to: &mut Encoder) {
        to.put(&self.role);
        to.put(&(self.content.0 as u64));
        to.put(&((self.content.0 >> 64) as u64));
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        let (role, low, high) = (from.get()?, from.get::<u64>()?, from.get::<u64>()?);
        Ok(ReadFile { role, content: Digest(u128::from(low) | u128::from(high) << 64) })
    }
}

impl Codec for MadeStates {
    fn encode(&self, to: &mut Encoder) {
        to.put(&self.states);
        to.put(&self.read);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(MadeStates { states: from.get()?, read: from.get()? })
    }
}

impl Codec for Header {
    fn encode(&self, to: &mut Encoder) {
        let Header { scene, rate, frames, mode, seed, steps_per_frame, limits } = self;
        to.put(scene);
        to.put(&rate.numerator());
        to.put(&rate.denominator());
        to.put(frames);
        to.put(&(*mode == TimeMode::Loop));
        to.put(seed);
        to.put(steps_per_frame);
        to.put(limits);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(Header {
            scene: from.get()?,
            rate: Rate::new(from.get()?, from.get()?).ok_or(Malformed)?,
            frames: from.get()?,
            mode: if from.get()? { TimeMode::Loop } else { TimeMode::Clip },
            seed: from.get()?,
            steps_per_frame: from.get()?,
            limits: from.get()?,
        })
    }
}

impl Codec for Opened {
    fn encode(&self, to: &mut Encoder) {
        let Opened { header, has_setup, place_of_scene, simulates } = self;
        to.put(header);
        to.put(has_setup);
        to.put(place_of_scene);
        to.put(simulates);
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        let (header, has_setup) = (from.get()?, from.get()?);
        Ok(Opened { header, has_setup, place_of_scene: from.get()?, simulates: from.get()? })
    }
}

impl<T: Codec> Codec for Reply<T> {
    fn encode(&self, to: &mut Encoder) {
        match self {
            Reply::Done { outcome: Ok(value), files, remarks } => {
                to.put(&0u8);
                to.put(value);
                to.put(files);
                to.put(remarks);
            }
            Reply::Done { outcome: Err(problems), files, remarks } => {
                to.put(&1u8);
                to.put(problems);
                to.put(files);
                to.put(remarks);
            }
            Reply::Step(step) => {
                to.put(&2u8);
                to.put(step);
            }
            Reply::Overdue(step) => {
                to.put(&3u8);
                to.put(step);
            }
        }
    }
    fn decode(from: &mut Decoder) -> Result<Self, Malformed> {
        Ok(match from.get::<u8>()? {
            0 => Reply::Done { outcome: Ok(from.get()?), files: from.get()?, remarks: from.get()? },
            1 => Reply::Done { outcome: Err(from.get()?), files: from.get()?, remarks: from.get()? },
            2 => Reply::Step(from.get()?),
            3 => Reply::Overdue(from.get()?),
            _ => return Err(Malformed),
        })
    }
}
