#!/usr/bin/env python3
"""The lighting study of scripts/mixing.rhai here and in other renderers, in turns: see README.md beside this file."""
import argparse
import math
import os
import resource
import shutil
import statistics
import subprocess
import sys
import time

from scenes import cross, scaled, sub, unit

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../.."))
WIDTH, HEIGHT, FRAMES = 640, 360, 48

# The study as data: scenes/studio.ron and scripts/mixing.rhai.

EYE, TARGET, FOV_UP = (0.0, 1.9, 6.2), (0.0, 0.85, 0.0), 32.0
# Colour, weight of the highlight, its exponent, weight of the mirror image.
MATERIALS = {
    "plaster": ((0.82, 0.81, 0.79), 0.0, 20.0, 0.0),
    "gloss": ((0.78, 0.77, 0.75), 0.35, 70.0, 0.12),
    "stage": ((0.6, 0.6, 0.6), 0.1, 20.0, 0.06),
}
# Place, what it faces, half its width and depth, its brightest colour.
LAMPS = [
    ((-2.8, 3.0, 2.0), (0.0, 0.6, 0.0), (0.4, 0.4), (0.7, 0.34, 0.2)),
    ((0.4, 3.6, 2.8), (0.0, 0.6, 0.0), (0.4, 0.4), (0.55, 0.52, 0.47)),
    ((2.9, 2.6, 1.6), (0.0, 0.6, 0.0), (0.4, 0.4), (0.2, 0.34, 0.7)),
    ((0.2, 3.4, -2.6), (0.2, 0.0, -2.6), (0.8, 0.2), (0.4, 0.34, 0.55)),
]


def color(lamp, frame):
    """The colour of a lamp in a frame, counted from 1."""
    level = 0.5 - 0.5 * math.cos(2 * math.pi * ((frame - 1) / FRAMES + lamp / 4))
    return tuple(0.02 + (tint - 0.02) * level for tint in LAMPS[lamp][3])


def axes(lamp):
    """Half edges of a lamp."""
    place, faced, (width, depth), _ = LAMPS[lamp]
    forward = unit(sub(faced, place))
    right = unit(cross(forward, (0.0, 0.0, 1.0) if abs(forward[1]) > 0.9 else (0.0, 1.0, 0.0)))
    return scaled(right, width), scaled(cross(right, forward), depth)


# Ours


def run_anim(args, _):
    command = [args.anim, os.path.join(ROOT, "scripts/mixing.rhai"), "-o", "anim", "--force"]
    command += ["--spp", str(args.samples), "--threads", str(args.threads)]
    subprocess.run(command, cwd=args.folder, check=True, capture_output=True)


# Mitsuba 3 (PyPI): the scene is loaded once, and its lamps are set for each frame


def run_mitsuba(args, frames):
    command = [sys.executable, os.path.abspath(__file__), "--as-mitsuba", "--samples", str(args.samples)]
    command += ["--peer-frames", str(frames)]
    environment = dict(os.environ, DRJIT_NUM_THREADS=str(args.threads))
    subprocess.run(command, cwd=args.folder, check=True, capture_output=True, env=environment)


def cone(n):
    turns = [2 * math.pi * i / n for i in range(n)]
    rim = [(0.35 + 0.42 * math.cos(a), 1.0, -0.4 + 0.42 * math.sin(a)) for a in turns]
    return rim + [(0.35, 2.0, -0.4)], [(i, n, (i + 1) % n) for i in range(n)]


def pebble(n):
    points, faces = [], []
    for i in range(n + 1):
        for j in range(2 * n):
            down, around = math.pi * i / n, math.pi * j / n
            x, y, z = math.sin(down) * math.cos(around), math.cos(down), math.sin(down) * math.sin(around)
            points.append((0.45 + 0.34 * x, 0.18 + 0.18 * y, 1.35 + 0.24 * z))
    for i in range(n):
        for j in range(2 * n):
            a, b = i * 2 * n + j, i * 2 * n + (j + 1) % (2 * n)
            faces += [(a, b, a + 2 * n), (b, b + 2 * n, a + 2 * n)]
    return points, faces


def mitsuba_scene(mi, samples):
    import numpy as np

    at, rgb = mi.ScalarTransform4f, lambda v: {"type": "rgb", "value": list(v)}
    world = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 5, "rr_depth": 1000},
        "sensor": {
            "type": "perspective", "fov": FOV_UP, "fov_axis": "y",
            "to_world": at().look_at(origin=list(EYE), target=list(TARGET), up=[0, 1, 0]),
            "film": {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "rfilter": {"type": "box"}},
            "sampler": {"type": "independent", "sample_count": samples},
        },
    }
    for name, (albedo, _, _, mirror) in MATERIALS.items():
        inner = {"type": "diffuse", "reflectance": rgb(albedo)}
        if mirror > 0:
            inner = {"type": "blendbsdf", "weight": mirror, "a": inner, "b": {"type": "conductor", "material": "none"}}
        world[name] = {"type": "twosided", "id": name, "inner": inner}

    def add(name, material, shape, to_world=None, **fields):
        world[name] = {"type": shape, "bsdf": {"type": "ref", "id": material}, **fields}
        if to_world is not None:
            world[name]["to_world"] = to_world

    add("floor", "stage", "rectangle", at().rotate([1, 0, 0], -90).scale(100))
    add("wall", "plaster", "rectangle", at().translate([0, 0, -3.5]).scale(100))
    add("ball", "gloss", "sphere", center=[-1.25, 0.7, 0.5], radius=0.7)
    add("block", "plaster", "cube", at().translate([0.35, 0.5, -0.4]).rotate([0, 1, 0], 28).scale(0.5))
    add("cylinder", "gloss", "cylinder", p0=[1.75, 0.0, 0.35], p1=[1.75, 1.3, 0.35], radius=0.4)
    add("lid", "gloss", "disk", at().translate([1.75, 1.3, 0.35]).rotate([1, 0, 0], -90).scale(0.4))
    # There are neither cones nor ellipsoids: fine meshes.
    for name, (points, faces) in {"cone": cone(256), "pebble": pebble(128)}.items():
        mesh = mi.Mesh(name, len(points), len(faces))
        params = mi.traverse(mesh)
        params["vertex_positions"] = np.array(points, dtype=np.float32).ravel()
        params["faces"] = np.array(faces, dtype=np.uint32).ravel()
        params.update()
        mesh.write_ply(name + ".ply")
    add("cone", "plaster", "ply", filename="cone.ply", face_normals=True)
    add("pebble", "gloss", "ply", filename="pebble.ply")
    for i, (place, faced, half, _) in enumerate(LAMPS):
        up = [0, 0, 1] if abs(unit(sub(faced, place))[1]) > 0.9 else [0, 1, 0]
        to_world = at().look_at(origin=list(place), target=list(faced), up=up).scale([*half, 1])
        world["lamp%d" % i] = {"type": "rectangle", "to_world": to_world,
                               "emitter": {"type": "area", "radiance": rgb((1, 1, 1))}}
    return mi.load_dict(world)


def as_mitsuba(samples, frames):
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    scene = mitsuba_scene(mi, samples)
    params = mi.traverse(scene)
    # Ours do not weaken with distance: as bright as these at the middle of the stage.
    gains = [math.pi * math.dist(place, faced) ** 2 / (4 * half[0] * half[1]) for place, faced, half, _ in LAMPS]
    for frame in range(1, frames + 1):
        for i, gain in enumerate(gains):
            params["lamp%d.emitter.radiance.value" % i] = mi.Color3f(list(scaled(color(i, frame), gain)))
        params.update()
        image = mi.render(scene, spp=samples, seed=1)
        mi.util.write_bitmap("mitsuba/mixing.%04d.png" % frame, image, write_async=False)


# POV-Ray 3.7 (Debian): one animation


def write_pov(folder):
    v = lambda p: "<%s>" % ", ".join("%.9g" % x for x in p)
    forward = unit(sub(TARGET, EYE))
    right = unit(cross(forward, (0.0, 1.0, 0.0)))
    up = math.tan(math.radians(FOV_UP / 2))
    across = up * WIDTH / HEIGHT
    finish = {
        name: "pigment { rgb %s } finish { ambient 0 diffuse 1 specular %g roughness %g reflection %g }" % (
            v(albedo), highlight, 1 / exponent, mirror)
        for name, (albedo, highlight, exponent, mirror) in MATERIALS.items()
    }
    lines = [
        "#version 3.7;",
        "global_settings { assumed_gamma 1 max_trace_level 4 }",
        "camera { location %s direction %s right %s up %s }" % (
            v(EYE), v(forward), v(scaled(right, 2 * across)), v(scaled(cross(right, forward), 2 * up))),
        "plane { y, 0 %s }" % finish["stage"],
        "plane { z, -3.5 %s }" % finish["plaster"],
        "sphere { <-1.25, 0.7, 0.5>, 0.7 %s }" % finish["gloss"],
        "box { -0.5, 0.5 rotate 28*y translate <0.35, 0.5, -0.4> %s }" % finish["plaster"],
        "cone { <0.35, 1, -0.4>, 0.42, <0.35, 2, -0.4>, 0 %s }" % finish["plaster"],
        "cylinder { <1.75, 0, 0.35>, <1.75, 1.3, 0.35>, 0.4 %s }" % finish["gloss"],
        "sphere { 0, 1 scale <0.34, 0.18, 0.24> translate <0.45, 0.18, 1.35> %s }" % finish["gloss"],
    ]
    for i, (place, *_) in enumerate(LAMPS):
        colors = ", ".join("rgb " + v(color(i, frame)) for frame in range(1, FRAMES + 1))
        lines.append("#declare Colors%d = array[%d] { %s }" % (i, FRAMES, colors))
        a, b = (v(scaled(axis, 2)) for axis in axes(i))
        lines.append("light_source { %s Colors%d[frame_number - 1] area_light %s, %s, 2, 2 jitter }" % (v(place), i, a, b))
    with open(os.path.join(folder, "mixing.pov"), "w") as f:
        f.write("\n".join(lines) + "\n")


def run_povray(args, frames):
    command = ["povray", "+Imixing.pov", "+Opovray/mixing.png", "+W%d" % WIDTH, "+H%d" % HEIGHT, "-D", "-V", "-J"]
    command += ["+A0.0", "+AM1", "+R%d" % max(1, math.isqrt(args.samples)), "+WT%d" % args.threads]
    command += ["+KFI1", "+KFF%d" % FRAMES, "+SF1", "+EF%d" % frames]
    subprocess.run(command, cwd=args.folder, check=True, capture_output=True)


PEERS = {"mitsuba": run_mitsuba, "povray": run_povray}


def available(peer):
    if peer == "povray":
        return shutil.which("povray") is not None
    return subprocess.run([sys.executable, "-c", "import mitsuba"], capture_output=True).returncode == 0


def timed(run, args, frames):
    """Seconds of the clock and of all processors for a whole process."""
    processors = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    start, used = time.time(), processors()
    run(args, frames)
    return time.time() - start, processors() - used


def reckoned(run, args):
    """As `timed`, for all frames: from the first one and what some more cost."""
    some = min(args.peer_frames, FRAMES)
    if run is run_anim or some == FRAMES:
        return timed(run, args, FRAMES)
    first, all_of_them = timed(run, args, 1), timed(run, args, some)
    return tuple(a + (b - a) * (FRAMES - 1) / (some - 1) for a, b in zip(first, all_of_them))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("peer", nargs="*", help="mitsuba povray; all that are installed if none is named")
    parser.add_argument("--folder", default="peers-out", help="where scenes and pictures are written")
    parser.add_argument("--anim", default=os.path.join(ROOT, "target/release/anim"))
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--peer-frames", type=int, default=FRAMES,
                        help="frames that peers render, 2 at least; the rest is reckoned")
    parser.add_argument("--as-mitsuba", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.as_mitsuba:
        return as_mitsuba(args.samples, args.peer_frames)
    args.folder, args.anim = os.path.abspath(args.folder), os.path.abspath(args.anim)
    peers = {peer: PEERS[peer] for peer in args.peer or PEERS if available(peer)}
    for name in ("anim", *peers):
        os.makedirs(os.path.join(args.folder, name), exist_ok=True)
    write_pov(args.folder)
    runners = dict(anim=run_anim, **peers)
    times = {who: [] for who in runners}
    for _ in range(args.runs):
        for who, run in runners.items():
            times[who].append(reckoned(run, args))
    median = lambda who: [statistics.median(t[k] for t in times[who]) for k in (0, 1)]
    print("%-8s %9s %9s %7s %7s" % ("", "wall s", "cpu s", "wall", "cpu"))
    for who in runners:
        # Theirs over ours.
        wall, cpu = (theirs / ours for theirs, ours in zip(median(who), median("anim")))
        print("%-8s %9.2f %9.2f %7.1f %7.1f" % (who, *median(who), wall, cpu))


if __name__ == "__main__":
    main()
