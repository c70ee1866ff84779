//! Pages about many machines: what all of them have in common, then one for each engine.

use super::{Block, CodeKind};

fn text(text: &str) -> Block {
    Block::Paragraph(text.into())
}

fn heading(text: &str) -> Block {
    Block::Heading(text.into())
}

fn command(text: &str) -> Block {
    Block::Code(CodeKind::Command, text.into())
}

fn answer(text: &str) -> Block {
    Block::Code(CodeKind::Answer, text.into())
}

/// What holds for every engine.
pub fn farm() -> Vec<Block> {
    vec![
        text(
            "A frame is a pure function of scene, script, settings and number: it may be made on any machine, in any order, with \
             the same bytes. Shards are parts of about the same cost, which may run side by side on one folder; a second run \
             makes what is missing. There is no server to set up, and no database: a folder of frames knows what is in it.",
        ),
        command(
            "anim show.rhai --shard 1/3      # on one machine\nanim show.rhai --shard 2/3      # on another\nanim plan show.rhai --tasks 3   # what is in which, and what splitting costs",
        ),
        heading("Which page"),
        Block::Pair("a cluster with Slurm".into(), "anim guide slurm".into()),
        Block::Pair("AWS Deadline Cloud and others with Open Job Description".into(), "anim guide openjd".into()),
        Block::Pair("one machine, or a few with ssh".into(), "anim guide make".into()),
        Block::Pair("GitHub Actions".into(), "anim guide actions".into()),
        Block::Pair("Deadline, OpenCue, Tractor, anything else".into(), "anim guide queues".into()),
        heading("Workers that share a folder"),
        text(
            "With --claims a worker claims frames before it renders them, so that several with overlapping frames render each \
             once; when its own part is done it takes what nobody has claimed of the others. A claim is a file in .anim-claims. A \
             worker that was killed is found to be gone at once on its own machine, and after a minute without a sign of life \
             from another; its frames are then taken over. Claims save work and decide nothing else: without them the bytes are \
             the same.",
        ),
        command("anim show.rhai --shard 2/3 --claims\nanim status frames/show\nanim status frames/show --watch"),
        answer(
            "frames/show: show.rhai, 31 of 48 frames done, 3 running, 14 missing; about 2:10 min left\n  missing: 35-48\n  node7-4711-k3Fq2x                working: 12 frames, 5.1 a minute, has 34",
        ),
        heading("Sending a shot elsewhere"),
        text(
            "Where machines do not see the input under its path, pack it: the archive holds all files of the shot and the values \
             of -D, and renders to the same bytes anywhere. It is checked before `anim pack` ends. Files are known by their \
             digests, which find damage and mix-ups; they are no signature.",
        ),
        command("anim pack show.rhai\nanim render show.anim.zip --shard 2/8 -o out/"),
        heading("One picture on many machines"),
        text(
            "A still is cut into tiles, which are EXR files that know their place; `anim merge` joins them to the bytes of the \
             whole picture. What looks at neighbours, as the denoiser does, is done by `anim merge`.",
        ),
        command(
            "anim render still.ron --tiles 1/4 -o part.1.exr      # and 2/4, 3/4, 4/4 elsewhere\nanim merge part.1.exr part.2.exr part.3.exr part.4.exr -o still.exr",
        ),
        heading("Questions"),
        Block::Pair(
            "different processors?".into(),
            "nothing to do: bytes are the same with AVX2, SSE2 or neither".into(),
        ),
        Block::Pair(
            "different versions of anim?".into(),
            "refused: jobs name their plan by its hash (--expect), and another version or an edit has another plan"
                .into(),
        ),
        Block::Pair(
            "clocks that differ?".into(),
            "nothing to do: nothing is decided by comparing times of two machines".into(),
        ),
        Block::Pair(
            "frames that share work?".into(),
            "they stay together where a cut costs more than it saves; anim plan --tasks N says what is done twice"
                .into(),
        ),
        Block::Pair("a node that dies?".into(), "whole frames stay; start the same command again for the rest".into()),
    ]
}

/// Slurm.
pub fn slurm() -> Vec<Block> {
    vec![
        text(
            "`anim farm slurm` writes a job script that you can read and change. It submits an array whose tasks cost about the \
             same, and behind it a job that checks every frame by its hash, says what is missing, and makes the film or the sheet.",
        ),
        command(
            "anim farm slurm show.rhai --tasks 100 --throttle 20 -o /shared/show/ --film /shared/show.mp4\nbash show.slurm.sh\nanim status /shared/show --watch",
        ),
        text(
            "Cores and memory are what the plan estimates; --cpus and --mem say otherwise. --minutes-per-task chooses the number \
             of tasks: three small frames are rendered to tell how fast this machine is, and the time limit is thrice that.",
        ),
        heading("What may happen"),
        Block::Pair(
            "preempted, or out of time".into(),
            "the task stops at a whole frame and goes back into the queue, --requeues times at most; Slurm lets it wait for two minutes".into(),
        ),
        Block::Pair("cancelled (scancel)".into(), "it stops at a whole frame and stays cancelled; others take over its frames".into()),
        Block::Pair("a frame fails".into(), "what is missing of the task is tried again, --attempts times; a wrong input is not".into()),
        Block::Pair("a node is lost".into(), "Slurm starts the task again; others take its frames over meanwhile".into()),
        Block::Pair("frames are missing in the end".into(), "the check says which; submit the same script again".into()),
        heading("Folders"),
        text(
            "Frames go to a shared folder, each under a temporary name until it is whole. With --scratch they are made on the \
             node's own disk and copied back in the same way; the path is read by the node's shell, so that '$TMPDIR' does.",
        ),
        command("anim farm slurm show.rhai --tasks 40 --scratch '$TMPDIR' -o /shared/show/ --sbatch=--exclusive"),
    ]
}

/// Open Job Description.
pub fn openjd() -> Vec<Block> {
    vec![
        text(
            "`anim farm openjd` writes a job template (jobtemplate-2023-09), which AWS Deadline Cloud runs and the program `openjd` \
             on your own machine. Its parameters are Input, Output, Frames, Tasks, Width, Height, Samples and Anim; its steps \
             Render and, behind it, Check, which fails if a frame is missing.",
        ),
        command(
            "anim farm openjd show.rhai --tasks 20 -o out/\nopenjd check show.openjd.yaml\nopenjd run show.openjd.yaml --step Render -p Samples=4 -p Frames=1-10",
        ),
        text(
            "Tasks are numbers from 1 to Tasks, each a part of about the same cost of whatever Frames says. Where the scheduler \
             makes chunks itself (the extension TASK_CHUNKING), --chunk-seconds lets it aim at a time. --for windows writes \
             PowerShell instead of bash.",
        ),
        heading("Paths"),
        text(
            "Input and Output are parameters of the type PATH, so that the scheduler maps them to where they are on a worker. They \
             have defaults where they lie below the template's folder, as a default must; otherwise they are given at submission. A shot of many files is best sent as an archive: `anim pack show.rhai`, then `anim farm \
             openjd show.anim.zip`.",
        ),
        heading("What the scheduler hears"),
        answer(
            "openjd_progress: 40.00\nopenjd_status: frame 12 is written\nopenjd_fail: show.rhai:3:5: unknown field `fow`",
        ),
        text(
            "A failure is told by the exit code, and by openjd_fail for people: the line alone counts as success. A wrong input \
             ends with 3 and would do so again: let the scheduler retry what ends with 4 or 5.",
        ),
    ]
}

/// GNU make and ninja.
pub fn make() -> Vec<Block> {
    vec![
        text(
            "`anim farm make` writes one rule for each task, for GNU make, or for ninja if --to ends in .ninja. It is the way to \
             run frames side by side on one machine with many cores, and to make them a part of a build.",
        ),
        command(
            "anim farm make show.rhai --tasks 8 -o out/\nmake -f show.mk -j4 THREADS=2\nmake -f show.mk check\nanim farm make show.rhai --tasks 8 -o out/ --to build.ninja\nninja -j4",
        ),
        text(
            "For make, tasks are phony: anim knows by hashes what is to be done, and time stamps do not. For ninja frames are \
             outputs and the files of the shot inputs, and what an edit does not change keeps its time stamp (restat).",
        ),
        command("make -f show.mk -j2 ANIM='ssh node7 anim'      # with the same paths there"),
    ]
}

/// A matrix of GitHub Actions.
pub fn actions() -> Vec<Block> {
    vec![
        text(
            "Each job of a matrix renders a shard and hands its frames on; a last one puts them together and checks every one by \
             its hash. The frames are the same on all runners.",
        ),
        answer(
            "jobs:\n  render:\n    strategy:\n      matrix: { shard: [1, 2, 3, 4] }\n    runs-on: ubuntu-latest\n    steps:\n      - uses: actions/checkout@v4\n      - run: cargo install --path tools/anim --locked\n      - run: anim render show.rhai --shard ${{ matrix.shard }}/4 -o out/ --progress none\n      - uses: actions/upload-artifact@v4\n        with: { name: \"frames-${{ matrix.shard }}\", path: out/*.png }\n  film:\n    needs: render\n    runs-on: ubuntu-latest\n    steps:\n      - uses: actions/checkout@v4\n      - run: cargo install --path tools/anim --locked\n      - uses: actions/download-artifact@v4\n        with: { pattern: \"frames-*\", path: out, merge-multiple: true }\n      - run: anim plan show.rhai -o out/ --exit-code\n      - run: anim film show.rhai --frames-in out/ -o show.webp",
        ),
        text(
            "Frames speak for themselves: the manifest need not travel with them. To render only what an edit changed, keep \
             out/ in the cache of the workflow.",
        ),
    ]
}

/// A plan as data, and the command of a task with something else for its number: what all queues begin with.
const PLAN_IN_PYTHON: &str = "import json, subprocess

plan = [\"anim\", \"plan\", \"/shared/show.rhai\", \"-o\", \"/shared/show/\", \"--json\", \"--tasks\", \"20\"]
head, *tasks = map(json.loads, subprocess.check_output(plan, text=True).splitlines())
left = \",\".join(str(task[\"task\"]) for task in tasks if task[\"left\"])
if not left:
    raise SystemExit(\"every frame is there\")

def numbered(sign):
    part = \"/%d\" % head[\"tasks\"]
    return [sign + part if word == \"1\" + part else word for word in tasks[0][\"arguments\"]]";

/// Any other queue.
pub fn queues() -> Vec<Block> {
    vec![
        text(
            "`anim plan --json --tasks N` gives tasks as data: a first line about all of them (plan, cost, price, cores, \
             memory_bytes), then one for each with its frames and the arguments of the command that renders it. \
             `--exit-code` ends with 1 as long as a frame is missing.",
        ),
        command("anim plan show.rhai -o /shared/show/ --json --tasks 20"),
        answer(
            "{\"plan\":\"5e0c...\",\"tasks\":20,\"frames\":48,\"left\":48,\"cost\":171.2,\"price\":0.0,\"longest\":8.9,\"cores\":8,\"memory_bytes\":536870912,...}\n{\"task\":1,\"frames\":\"1-3\",\"first\":1,\"last\":3,\"count\":3,\"left\":3,\"cost\":8.7,\"arguments\":[\"render\",\"show.rhai\",\"--shard\",\"1/20\",...]}",
        ),
        text(
            "What follows is Python that reads these lines and hands the tasks on. It begins with the same words for each queue; \
             `left` is what was missing when the plan was made, so that a second submission renders the rest alone.",
        ),
        answer(PLAN_IN_PYTHON),
        heading("Deadline (the command-line plugin)"),
        answer(
            "with open(\"job.txt\", \"w\") as job:\n    job.write(\"Plugin=CommandLine\\nName=show\\nFrames=%s\\nChunkSize=1\\n\" % left)\nwith open(\"plugin.txt\", \"w\") as plugin:\n    words = subprocess.list2cmdline(numbered(\"<STARTFRAME>\"))\n    plugin.write(\"Executable=/opt/anim\\nArguments=%s\\nSingleFramesOnly=True\\n\" % words)\nsubprocess.run([\"deadlinecommand\", \"job.txt\", \"plugin.txt\"], check=True)",
        ),
        heading("OpenCue"),
        answer(
            "import shlex\nfrom outline import Outline, cuerun\nfrom outline.modules.shell import Shell\n\noutline = Outline(\"show\")\noutline.add_layer(Shell(\n    \"render\", range=left, command=[\"anim\", *map(shlex.quote, numbered(\"#IFRAME#\"))],\n    cores=head[\"cores\"], memory=\"%dm\" % (head[\"memory_bytes\"] >> 20)))\ncuerun.launch(outline, use_pycuerun=False)",
        ),
        heading("Tractor"),
        answer(
            "import tractor.api.author as author\n\njob = author.Job(title=\"show\", service=\"PixarRender\")\nfor task in tasks:\n    if task[\"left\"]:\n        job.newTask(title=task[\"frames\"], argv=[\"anim\", *task[\"arguments\"]])\njob.spool()",
        ),
        text(
            "OpenCue hands its command to a shell, so that words are quoted; Deadline and Tractor do not. These queues number \
             tasks, and so does --shard: the ranges that belong to the numbers stand in the plan. Exit codes \
             say whether to try again: 0 done, 3 the input is wrong (it would be again), 4 some frames failed, 5 reading or \
             writing failed, 130 stopped at a whole frame.",
        ),
    ]
}
