//! A job: the frames of a shot in tasks, with what each needs, as data for whoever writes it down.

use std::path::Path;

use super::frame_list;
use crate::base::limits;
use crate::output::FileState;
use crate::shot::plan::Plan;

/// Bytes of the sums of a pixel in each film, about.
const PIXEL_BYTES: u64 = 64;
/// What a program needs that has loaded nothing: its code, threads, and the process of its script.
const PROGRAM_BYTES: u64 = 160 << 20;
/// Memory is asked for in such steps.
const MEMORY_STEP: u64 = 256 << 20;
/// Side of the squares that threads of a frame work on.
const TILE: u32 = 16;
/// Tiles for each core below which cores wait for each other.
const TILES_OF_A_CORE: u32 = 32;
/// Cores of a task at most, unless the user asks for more: beyond them frames side by side use a machine better.
const MOST_CORES: u32 = 16;

/// One task: a row of frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Task {
    /// Its number, from 1.
    pub number: u32,
    /// Ascending.
    pub frames: Vec<u32>,
    /// How many of them are not there yet.
    pub left: usize,
    /// In the unit of the plan: millions of steps of rays.
    pub cost: f64,
}

impl Task {
    /// The frames as `--frames` takes them.
    pub fn list(&self) -> String {
        frame_list(&self.frames)
    }
}

/// All tasks of a shot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TaskPlan {
    /// In the order of their numbers.
    pub tasks: Vec<Task>,
    /// Digest of the plan.
    pub plan: String,
    /// What all frames cost in one task.
    pub whole: f64,
    /// What is done again because frames that share work are in different tasks.
    pub price: f64,
    /// What the dearest task costs.
    pub longest: f64,
    /// Cores that a task can use well.
    pub cores: u32,
    /// Memory of a task, as far as a plan can tell.
    pub memory_bytes: u64,
}

impl TaskPlan {
    /// Splits the frames of a plan, which may have looked at what is there already.
    pub fn new(plan: &Plan, count: u32) -> TaskPlan {
        let chunks = plan.chunks(count);
        let task = |(number, (range, cost)): (usize, (&std::ops::Range<usize>, &f64))| {
            let frames = &plan.frames[range.clone()];
            Task {
                number: number as u32 + 1,
                frames: frames.iter().map(|planned| planned.frame).collect(),
                left: frames.iter().filter(|planned| planned.state != FileState::Done).count(),
                cost: *cost,
            }
        };
        TaskPlan {
            tasks: chunks.ranges.iter().zip(&chunks.costs).enumerate().map(task).collect(),
            plan: plan.digest().to_string(),
            whole: chunks.whole,
            price: chunks.price(),
            longest: chunks.longest(),
            cores: cores(plan),
            memory_bytes: memory(plan),
        }
    }
}

/// Cores that the largest frame keeps busy.
fn cores(plan: &Plan) -> u32 {
    let sizes = plan.frames.iter().filter_map(|planned| Some(planned.fingerprint.as_ref().ok()?.size));
    let tiles = sizes.map(|[width, height]| width.div_ceil(TILE) * height.div_ceil(TILE)).max().unwrap_or(1);
    (tiles / TILES_OF_A_CORE).clamp(1, MOST_CORES)
}

/// What this process needed to evaluate all frames, twice for accelerators, and films on top.
fn memory(plan: &Plan) -> u64 {
    let films = |planned: &crate::shot::plan::PlannedFrame| {
        let [width, height] = planned.fingerprint.as_ref().ok()?.size.map(u64::from);
        let groups = planned.light_mix.as_ref().map_or(1, |mix| mix.light_groups.count() as u64);
        Some(width * height * PIXEL_BYTES * (groups + 2))
    };
    let films = plan.frames.iter().filter_map(films).max().unwrap_or(0);
    let shares = plan.costs().iter().any(|cost| cost.with.is_some());
    let kept = if shares { (limits::REUSE_MEMORY << 20).min(films.saturating_mul(8)) } else { 0 };
    let scene = peak_bytes().unwrap_or(PROGRAM_BYTES);
    (PROGRAM_BYTES + 2 * scene + films + kept).next_multiple_of(MEMORY_STEP)
}

/// The most memory that this process has held, where the system says so.
pub fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}

/// What is written down for a scheduler.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FarmJob {
    /// Name of the shot.
    pub name: String,
    /// The program on the machines that render.
    pub anim: String,
    /// The script, scene or archive, as an absolute path.
    pub input: String,
    /// All that decides the plan but frames and output: `-D`, `--size` and so on.
    pub settings: Vec<String>,
    /// The frames, as `--frames` takes them.
    pub frames: String,
    /// Whether they are not simply all frames.
    pub is_part: bool,
    /// Where frames go, for `-o`: absolute.
    pub out: String,
    /// The folder that holds them.
    pub folder: String,
    /// Name of the file of every frame, with `#` for its number.
    pub pattern: String,
    /// The file of each frame in the folder, in the order of the tasks.
    pub files: Vec<Vec<String>>,
    /// Files that the shot is made of.
    pub sources: Vec<String>,
    /// What is done by whom.
    pub tasks: TaskPlan,
    /// Processor seconds of one unit of cost, if they were measured.
    pub seconds_per_cost: Option<f64>,
    /// A film or sheet that is made at the end, as an absolute path.
    pub film: Option<String>,
    /// A contact sheet that is made at the end, as an absolute path.
    pub sheet: Option<String>,
}

impl FarmJob {
    /// Words that name the plan: the input, its settings and frames, and where they go.
    pub fn plan_words(&self) -> Vec<String> {
        let mut words = vec![self.input.clone()];
        words.extend(self.settings.iter().cloned());
        if self.is_part {
            words.extend(["--frames".into(), self.frames.clone()]);
        }
        words
    }

    /// Lines that say which frames are in which task.
    pub fn task_lines(&self, lead: &str) -> String {
        let whole = self.tasks.whole.max(f64::MIN_POSITIVE);
        let line = |task: &Task| {
            let share = 100.0 * task.cost / whole;
            let frames = if task.frames.is_empty() { "none".to_string() } else { task.list() };
            format!("{lead}{:>5}  {share:>5.1} %  {frames}\n", task.number)
        };
        let shown = self.tasks.tasks.iter().take(MOST_LINES).map(line).collect::<String>();
        let more = self.tasks.tasks.len().saturating_sub(MOST_LINES);
        if more > 0 { format!("{shown}{lead}... and {more} more\n") } else { shown }
    }

    /// Minutes that the dearest task takes on its cores, if that was measured.
    pub fn minutes(&self, cores: u32) -> Option<f64> {
        self.seconds_per_cost.map(|seconds| seconds * self.tasks.longest / f64::from(cores.max(1)) / 60.0)
    }

    /// A line about what splitting does again, if it does.
    pub fn price_line(&self) -> Option<String> {
        let share = 100.0 * self.tasks.price / self.tasks.whole.max(f64::MIN_POSITIVE);
        (share >= 0.5)
            .then(|| format!("frames that share work are in different tasks: {share:.0} % of it is done again"))
    }
}

/// Tasks that are listed in a job.
const MOST_LINES: usize = 200;

/// A path that holds in every folder. What a trailing slash says is kept.
pub fn absolute(path: &str) -> String {
    let full =
        std::path::absolute(Path::new(path)).map_or_else(|_| path.to_string(), |p| p.to_string_lossy().into_owned());
    let ends = path.ends_with(['/', '\\']) && !full.ends_with(['/', '\\']);
    if ends { format!("{full}/") } else { full }
}
