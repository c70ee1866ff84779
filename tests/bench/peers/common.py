"""What peers.py and study.py share: their flags, processes that are timed, renderers in turns."""
import os
import resource
import shutil
import statistics
import struct
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.abspath(os.path.join(HERE, "../../.."))
# What shows that a peer can run here: a program on the path, or lines of Python that must work.
PROGRAMS = {"povray": "povray"}
PROBES = {
    "mitsuba": "import mitsuba as mi; mi.set_variant('llvm_ad_rgb'); mi.Float([1, 2]) + 1",
    "cycles": "import bpy; bpy.context.scene.render.engine = 'CYCLES'",
}


def text(v, brackets="()"):
    return brackets[0] + ", ".join("%.9g" % x for x in v) + brackets[1]


def add_flags(parser):
    parser.add_argument("--folder", default="peers-out", help="where scenes and pictures are written")
    parser.add_argument("--anim", default=os.path.join(ROOT, "target/release/anim"), help="the program to measure")
    parser.add_argument("--samples", type=int, default=16, help="samples of a pixel")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--runs", type=int, default=3, help="turns; medians are printed")


def parsed(parser):
    """The flags, checked, with a folder that is there."""
    args = parser.parse_args()
    for name in ("samples", "threads", "runs"):
        if getattr(args, name) < 1:
            parser.error("--%s must be at least 1" % name)
    args.folder, args.anim = os.path.abspath(args.folder), os.path.abspath(args.anim)
    if not os.access(args.anim, os.X_OK):
        parser.error("there is no %s: run `cargo build --release`, or name one with --anim" % args.anim)
    os.makedirs(args.folder, exist_ok=True)
    return args


def installed(peers):
    """Those of the peers that work here; says why the others are left out."""
    found = {}
    for name, run in peers.items():
        if name in PROGRAMS:
            reason = None if shutil.which(PROGRAMS[name]) else "there is no program `%s`" % PROGRAMS[name]
        else:
            probe = subprocess.run([sys.executable, "-c", PROBES[name]], capture_output=True, text=True)
            reason = probe.returncode and (probe.stderr.strip().splitlines() or ["it crashed"])[-1]
        if reason:
            print("%s is left out: %s" % (name, reason), file=sys.stderr)
        else:
            found[name] = run
    return found


def timed(command, folder, **environment):
    """Runs a process to its end: what it printed, and the seconds of the clock and of all processors."""
    processors = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    start, used = time.perf_counter(), processors()
    done = subprocess.run(command, cwd=folder, env=dict(os.environ, **environment), capture_output=True, text=True)
    seconds = time.perf_counter() - start, processors() - used
    if done.returncode != 0:
        tail = "\n".join((done.stderr + done.stdout).splitlines()[-20:])
        sys.exit("this failed with %d in %s:\n%s\n%s" % (done.returncode, folder, " ".join(command), tail))
    return done, *seconds


def in_turns(runners, runs):
    """The medians of what each runner returns, a tuple of seconds, over `runs` turns."""
    times = {who: [] for who in runners}
    for _ in range(runs):
        for who, run in runners.items():
            times[who].append(run())
    return {who: [statistics.median(column) for column in zip(*turns)] for who, turns in times.items()}


def write_ply(path, mesh):
    points, faces = mesh
    with open(path, "wb") as f:
        f.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
                 "property float z\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n"
                 % (len(points), len(faces))).encode())
        for p in points:
            f.write(struct.pack("<3f", *p))
        for face in faces:
            f.write(struct.pack("<B3i", 3, *face))


# Peers that are Python modules: a process of its own imports each


WARM = 3


def module_command(script, args, name, times):
    return [sys.executable, os.path.join(HERE, script), name, str(args.samples), str(args.threads), str(times)]


def render_with(script, args, name, **environment):
    """Seconds of rendering, the best of `WARM` times in one process; of clock and processors, of a process for once."""
    _, wall, processors = timed(module_command(script, args, name, 1), args.folder, **environment)
    done, *_ = timed(module_command(script, args, name, WARM), args.folder, **environment)
    return float(done.stdout.split()[-1]), wall, processors


def film_with(script, args, frames, **environment):
    """Seconds of clock and processors of a process that renders the first frames of the lighting study."""
    return timed(module_command(script, args, "study", frames), args.folder, **environment)[1:]


def best(render, times):
    """The shortest of some calls: the first ones may build and compile."""
    seconds = []
    for i in range(times):
        start = time.perf_counter()
        render(i)
        seconds.append(time.perf_counter() - start)
    return min(seconds)
