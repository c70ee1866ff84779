//! A job script for Slurm: an array of tasks, and a last job that checks what they did.

use std::fmt::Write;

use super::job::FarmJob;
use super::quote::{shell, shell_words};

/// What is asked of Slurm.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SlurmOptions {
    /// The partition that the job is sent to; the cluster's default where it is not given.
    pub partition: Option<String>,
    /// The account that the job is counted to.
    pub account: Option<String>,
    /// Memory of a task as Slurm writes it, over the plan's estimate.
    pub memory: Option<String>,
    /// Time limit of a task as Slurm writes it.
    pub time: Option<String>,
    /// Cores of a task; the plan's estimate where it is not given.
    pub cores: Option<u32>,
    /// Tasks that run at once.
    pub throttle: Option<u32>,
    /// How often what is missing of a task is tried.
    pub attempts: u32,
    /// How often a task that was preempted is put back into the queue.
    pub requeues: u32,
    /// Folder of each node that frames are made in.
    pub scratch: Option<String>,
    /// More options of sbatch, as they are.
    pub more: Vec<String>,
}

/// The script.
pub fn script(job: &FarmJob, options: &SlurmOptions) -> String {
    let mut text = head(job, options);
    text += &settings(job, options);
    text += COMMON;
    text += if options.scratch.is_some() { ON_SCRATCH } else { ON_SHARED };
    text += TASK;
    text += &check(job);
    text += MAIN;
    text
}

fn head(job: &FarmJob, options: &SlurmOptions) -> String {
    let count = job.tasks.tasks.len();
    let total: usize = job.tasks.tasks.iter().map(|task| task.frames.len()).sum();
    let mut text = String::from("#!/bin/bash\n");
    let _ = write!(
        text,
        "# {name} on a Slurm cluster: {total} frames in {count} tasks, and a last job that checks them.\n\
         # Written by anim {version}.\n#\n\
         #   bash THIS         submits the array, and behind it the check\n\
         #   sbatch THIS       submits the array alone\n\
         #   bash THIS check   says what is missing, now and here\n\
         #   anim status {folder}    who is at work\n#\n\
         # Frames that are there are kept: submit it again for what is missing. Task, share of the cost, frames:\n{tasks}",
        name = comment(&job.name),
        version = env!("CARGO_PKG_VERSION"),
        folder = comment(&shell(&job.folder)),
        tasks = job.task_lines("# "),
    );
    if let Some(line) = job.price_line() {
        let _ = writeln!(text, "# {line}.");
    }
    let name: String =
        job.name.chars().map(|c| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '-' }).collect();
    let throttle = options.throttle.map_or(String::new(), |most| format!("%{most}"));
    let cores = options.cores.unwrap_or(job.tasks.cores);
    let memory = options.memory.clone().unwrap_or_else(|| format!("{}M", job.tasks.memory_bytes >> 20));
    let mut lines = vec![
        format!("--job-name=anim-{name}"),
        format!("--array=1-{count}{throttle}"),
        "--ntasks=1".into(),
        format!("--cpus-per-task={cores}"),
        format!("--mem={memory}"),
    ];
    let time = options.time.clone().or_else(|| job.minutes(cores).map(time_limit));
    lines.extend(time.map(|time| format!("--time={time}")));
    lines.extend(options.partition.as_ref().map(|partition| format!("--partition={partition}")));
    lines.extend(options.account.as_ref().map(|account| format!("--account={account}")));
    // The script is told a minute before its time is over, and then tells anim to stop at a whole frame.
    lines.extend(["--signal=B:TERM@60".into(), "--requeue".into(), "--open-mode=append".into()]);
    lines.push("--output=anim-%A_%a.log".into());
    lines.extend(options.more.iter().cloned());
    for line in lines {
        let _ = writeln!(text, "#SBATCH {line}");
    }
    text
}

/// A text on one line.
fn comment(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}

/// Three times what was reckoned, and ten minutes: an estimate is no promise.
fn time_limit(minutes: f64) -> String {
    let whole = (3.0 * minutes + 10.0).ceil() as u64;
    format!("{}:{:02}:00", whole / 60, whole % 60)
}

fn settings(job: &FarmJob, options: &SlurmOptions) -> String {
    let mut text = String::from("\nset -u\n\n");
    let mut line = |name: &str, value: &str, why: &str| {
        let _ = writeln!(text, "{name}={value}{why}");
    };
    line("anim", &shell(&job.anim), "");
    line("folder", &shell(&job.folder), "");
    line("out", &shell(&job.out), "");
    line("tasks", &job.tasks.tasks.len().to_string(), "");
    line("plan", &job.tasks.plan, "   # of these frames: tasks refuse another input or version");
    line("attempts", &options.attempts.to_string(), "   # how often what is missing of a task is tried");
    line("requeues", &options.requeues.to_string(), "   # how often a preempted task is put back into the queue");
    line("shot", &format!("({})", shell_words(&job.plan_words())), "");
    if let Some(scratch) = &options.scratch {
        // Left to the node's shell: `$TMPDIR` is meant to be what it is there.
        line("scratch", &format!("\"{}\"", scratch.replace('\\', "\\\\").replace('"', "\\\"").replace('`', "\\`")), "");
        line("pattern", &shell(&job.pattern), "");
    }
    text
}

const COMMON: &str = r#"
child=
stopped=

# Slurm asks the task to end: before its time is over, when it is preempted, when it is cancelled.
stop() {
    stopped=1
    [ -z "$child" ] || kill -TERM "$child" 2>/dev/null
}

# anim in the background, so that this script hears signals meanwhile.
run() {
    "$anim" "$@" &
    child=$!
    wait "$child"
    code=$?
    while kill -0 "$child" 2>/dev/null; do
        wait "$child"
        code=$?
    done
    child=
    return "$code"
}
"#;

const ON_SHARED: &str = r#"
# Frames go to the shared folder, each under a temporary name until it is whole. Tasks claim frames, so that one that is
# done early helps the others.
render() {
    run render "${shot[@]}" -o "$out" --shard "$1/$tasks" --claims --expect "$plan" \
        --threads "${SLURM_CPUS_PER_TASK:-1}" --progress none
}
"#;

const ON_SCRATCH: &str = r#"
# Frames are made on the node's own disk and copied back, each under a temporary name until it is whole.
render() {
    local work left code file name
    left=$("$anim" plan "${shot[@]}" -o "$out" --shard "$1/$tasks" --expect "$plan" --left)
    code=$?
    [ "$code" -le 1 ] || return "$code"
    [ -n "$left" ] || return 0
    work=$scratch/anim-$SLURM_JOB_ID
    mkdir -p "$work" "$folder" || return 5
    run render "${shot[@]}" --frames "$left" -o "$work/$pattern" --threads "${SLURM_CPUS_PER_TASK:-1}" --progress none
    code=$?
    for file in "$work"/*; do
        [ -f "$file" ] || continue
        name=${file##*/}
        cp -- "$file" "$folder/.copy-$SLURM_JOB_ID-$name" && mv -f -- "$folder/.copy-$SLURM_JOB_ID-$name" "$folder/$name" || code=5
    done
    rm -rf -- "$work"
    return "$code"
}
"#;

const TASK: &str = r#"
# One task of the array.
task() {
    trap stop TERM
    local attempt code=0
    for attempt in $(seq "$attempts"); do
        render "$SLURM_ARRAY_TASK_ID"
        code=$?
        [ -z "$stopped" ] || requeue "$code"
        case $code in
            0) exit 0 ;;
            2 | 3) exit "$code" ;; # The input is wrong: it would be again.
        esac
        echo "attempt $attempt of task $SLURM_ARRAY_TASK_ID ended with $code; what is missing is tried again" >&2
    done
    exit "$code"
}

# A task that had to stop goes back into the queue, but not for ever. Slurm calls a task COMPLETING that its user has
# cancelled, or that it puts back itself: to ask for it then would bring a cancelled task back to life.
requeue() {
    local id=${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID} state
    state=$(scontrol --oneliner show job "$id" 2>/dev/null | grep -o 'JobState=[A-Z_]*')
    if [ "$state" = JobState=RUNNING ] && [ "${SLURM_RESTART_COUNT:-0}" -lt "$requeues" ]; then
        echo "task $SLURM_ARRAY_TASK_ID stops at a whole frame and goes back into the queue" >&2
        scontrol requeue "$id"
    fi
    exit "$1"
}
"#;

fn check(job: &FarmJob) -> String {
    let mut text = String::from(
        r#"
# After the last task, whatever became of it: every frame by its hash.
check() {
    local left code
    left=$("$anim" plan "${shot[@]}" -o "$out" --expect "$plan" --left)
    code=$?
    if [ "$code" -ne 0 ]; then
        [ "$code" -ne 1 ] || echo "missing: $left (submit this script again)"
        "$anim" status "$folder"
        exit "$code"
    fi
    echo "every frame is there"
"#,
    );
    if let Some(film) = &job.film {
        let _ = writeln!(text, "    \"$anim\" film \"${{shot[@]}}\" --frames-in \"$out\" -o {} || exit", shell(film));
    }
    if let Some(sheet) = &job.sheet {
        let _ = writeln!(text, "    \"$anim\" sheet \"$folder\" -o {} || exit", shell(sheet));
    }
    text + "}\n"
}

const MAIN: &str = r#"
self=$(realpath "$0")
if [ "${1:-}" = check ]; then
    check
elif [ -n "${SLURM_ARRAY_TASK_ID:-}" ]; then
    task
else
    array=$(sbatch --parsable "$self") || exit
    array=${array%%;*}
    last=$(sbatch --parsable --dependency="afterany:$array" --job-name="$(basename "$self")-check" \
        --output=anim-%j-check.log --wrap "bash $(printf %q "$self") check") || exit
    echo "array $array, check ${last%%;*}"
fi
"#;
