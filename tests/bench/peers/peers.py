#!/usr/bin/env python3
"""The same pictures here and in other renderers, in turns: see README.md beside this file."""
import argparse
import json
import math
import os
import shutil
import statistics
import struct
import subprocess
import sys
import time

from scenes import cross, dot, scenes, sub, unit

WIDTH, HEIGHT = 640, 480


def text(v, brackets="()"):
    return brackets[0] + ", ".join("%.9g" % x for x in v) + brackets[1]


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


def area(light):
    n = cross(light[2], light[3])
    return math.sqrt(dot(n, n))


def half_angle(scene):
    """Tangents of half the field of view, across and up."""
    across = math.tan(math.radians(scene["camera"][2]) / 2)
    return across, across * HEIGHT / WIDTH


# Ours


RON = {
    "matt": "color: %s, diffuse: 1, specular: 0",
    "half": "color: %s, diffuse: 0.5, specular: 0, reflection: 0.5, specular_color: (1, 1, 1)",
    "mirror": "color: (0, 0, 0), diffuse: 0, specular: 0, reflection: 1, specular_color: %s",
    "glass": "color: (0, 0, 0), diffuse: 0, specular: 0, transmission: 1, ior: 1.5, specular_color: %s",
}


def write_ron(folder, name, scene, samples):
    eye, target, _ = scene["camera"]
    integrator = "Distribution" if scene["mode"] == "whitted" else "Path"
    materials, entities = [], []

    def material(m):
        if m not in materials:
            materials.append(m)
        return "m%d" % materials.index(m)

    for kind, *light in scene["lights"]:
        if kind == "point":
            entities.append("point_light: (position: %s, color: %s, falloff: InverseSquare)" % (
                text(light[0]), text(x / math.pi for x in light[1])))
        else:
            corner, u, v, radiance = light
            center = [c + (a + b) / 2 for c, a, b in zip(corner, u, v)]
            size = area(("area", corner, u, v))
            entities.append("area_light: (position: %s, edges: (%s, %s), color: %s, falloff: InverseSquare)" % (
                text(center), text(u), text(v), text(x * size / math.pi for x in radiance)))
    for i, (mesh, m) in enumerate(scene["meshes"]):
        entities.append('mesh: (file: "%s%d.ply"), material: "%s"' % (name, i, material(m)))
    for spheres, m in scene["spheres"]:
        for center, radius in spheres:
            entities.append('sphere: (center: %s, radius: %.9g), material: "%s"' % (text(center), radius, material(m)))
    with open("%s/%s.ron" % (folder, name), "w") as f:
        f.write("(camera: (from: %s, at: %s, up: (0, 0, 1), fov: %.9g, aperture: %.9g, focus_distance: %.9g),\n" % (
            text(eye), text(target), 2 * math.degrees(math.atan(half_angle(scene)[1])), *scene["lens"]))
        f.write("render: (size: (%d, %d), samples: %d, integrator: %s, max_depth: %d),\nmaterials: {\n" % (
            WIDTH, HEIGHT, samples, integrator, scene["depth"]))
        for i, (kind, color) in enumerate(materials):
            f.write('    "m%d": (%s, two_sided: true),\n' % (i, RON[kind] % text(color)))
        f.write("},\nentities: [\n" + "".join("    (%s),\n" % e for e in entities) + "])\n")


def run_anim(args, name):
    command = [args.anim, "render", name + ".ron", "-o", name + ".anim.png", "--force", "--threads", str(args.threads)]
    out = subprocess.run(command + ["--stats", "json"], cwd=args.folder, check=True, capture_output=True, text=True)
    return json.loads(out.stdout.splitlines()[-1])["render_seconds"]


# Mitsuba 3 (PyPI): in a process of its own, which imports it


def run_mitsuba(args, name):
    command = [sys.executable, os.path.abspath(__file__), "--as-mitsuba", name, "--samples", str(args.samples)]
    environment = dict(os.environ, DRJIT_NUM_THREADS=str(args.threads))
    out = subprocess.run(command, cwd=args.folder, check=True, capture_output=True, text=True, env=environment)
    return float(out.stdout.split()[-1])


def as_mitsuba(name, samples):
    import mitsuba as mi
    import numpy as np

    mi.set_variant("llvm_ad_rgb")
    scene = scenes()[name]
    transform, rgb = mi.ScalarTransform4f, lambda v: {"type": "rgb", "value": list(v)}
    eye, target, fov = scene["camera"]
    aperture, focus = scene["lens"]
    sensor = {
        "type": "thinlens" if aperture > 0 else "perspective", "fov": fov, "fov_axis": "x",
        "to_world": transform().look_at(origin=list(eye), target=list(target), up=[0, 0, 1]),
        "film": {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "rfilter": {"type": "box"}},
        "sampler": {"type": "independent", "sample_count": samples},
    }
    if aperture > 0:
        sensor.update(aperture_radius=aperture, focus_distance=focus)

    def bsdf(kind, color):
        matt = {"type": "diffuse", "reflectance": rgb(color)}
        if kind == "glass":
            return {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0}
        if kind == "mirror":
            matt = {"type": "conductor", "material": "none", "specular_reflectance": rgb(color)}
        if kind == "half":
            matt = {"type": "blendbsdf", "weight": 0.5, "a": matt, "b": {"type": "conductor", "material": "none"}}
        return {"type": "twosided", "inner": matt}

    integrator = {"type": "path", "max_depth": scene["depth"] + 1, "rr_depth": 1000}
    if scene["mode"] == "direct":
        integrator = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
    world = {"type": "scene", "integrator": integrator, "sensor": sensor}
    for i, (kind, *light) in enumerate(scene["lights"]):
        if kind == "point":
            world["light%d" % i] = {"type": "point", "position": list(light[0]), "intensity": rgb(light[1])}
            continue
        corner, u, v, radiance = light
        down = (0.0, 0.0, -1.0)
        columns = [[x / 2 for x in u], [-x / 2 for x in v], down, [c + (a + b) / 2 for c, a, b in zip(corner, u, v)]]
        matrix = np.eye(4)
        matrix[:3, :] = np.array(columns).T
        world["light%d" % i] = {"type": "rectangle", "to_world": transform(matrix),
                                "emitter": {"type": "area", "radiance": rgb(radiance)}}
    for i, (_, m) in enumerate(scene["meshes"]):
        world["mesh%d" % i] = {"type": "ply", "filename": "%s%d.ply" % (name, i), "face_normals": True,
                               "bsdf": bsdf(*m)}
    for i, (spheres, m) in enumerate(scene["spheres"]):
        world["skin%d" % i] = dict(bsdf(*m), id="skin%d" % i)
        for j, (center, radius) in enumerate(spheres):
            world["sphere%d_%d" % (i, j)] = {"type": "sphere", "center": list(center), "radius": radius,
                                             "bsdf": {"type": "ref", "id": "skin%d" % i}}
    loaded, best = mi.load_dict(world), math.inf
    for seed in range(3):
        # The first pictures compile; the best counts.
        start = time.time()
        image = np.array(mi.render(loaded, spp=samples, seed=seed))
        best = min(best, time.time() - start)
    mi.util.write_bitmap(name + ".mitsuba.png", image, write_async=False)
    print(best)


# POV-Ray 3.7 (Debian)


def write_pov(folder, name, scene):
    eye, target, _ = scene["camera"]
    forward = unit(sub(target, eye))
    right = unit(cross(forward, (0.0, 0.0, 1.0)))
    up = cross(right, forward)
    across, upward = half_angle(scene)
    angle = lambda v: text(v, "<>")
    finish = {
        "matt": "pigment { rgb %s } finish { ambient 0 diffuse 1 }",
        "half": "pigment { rgb %s } finish { ambient 0 diffuse 0.5 reflection 0.5 }",
        "mirror": "pigment { rgb 0 } finish { ambient 0 diffuse 0 reflection rgb %s }",
        "glass": "pigment { rgbt 1 } finish { ambient 0 diffuse 0 reflection { 0 1 fresnel } } interior { ior 1.5 } //%s",
    }
    with open("%s/%s.pov" % (folder, name), "w") as f:
        f.write("#version 3.7;\nglobal_settings { assumed_gamma 1 max_trace_level %d }\n" % scene["depth"])
        f.write("camera { location %s direction %s right %s up %s %s }\n" % (
            angle(eye), angle(forward), angle(x * 2 * across for x in right), angle(x * 2 * upward for x in up),
            "aperture %g focal_point %s blur_samples 16 variance 0" % (
                2 * scene["lens"][0], angle(e + d * scene["lens"][1] for e, d in zip(eye, forward)))
            if scene["lens"][0] > 0 else ""))
        for kind, *light in scene["lights"]:
            if kind == "point":
                f.write("light_source { %s rgb 0.58 }\n" % angle(light[0]))
            else:
                corner, u, v, _ = light
                center = [c + (a + b) / 2 for c, a, b in zip(corner, u, v)]
                f.write("light_source { %s rgb 1 area_light %s, %s, 2, 2 jitter }\n" % (
                    angle(center), angle(u), angle(v)))
        for (points, faces), (kind, color) in scene["meshes"]:
            f.write("mesh2 { vertex_vectors { %d, %s } face_indices { %d, %s } %s\n}\n" % (
                len(points), ",".join(map(angle, points)), len(faces), ",".join(map(angle, faces)),
                finish[kind] % angle(color)))
        for spheres, (kind, color) in scene["spheres"]:
            f.write("union {\n" + "".join("sphere { %s, %.9g }\n" % (angle(c), r) for c, r in spheres))
            f.write("%s\n}\n" % (finish[kind] % angle(color)))


def run_povray(args, name):
    command = ["povray", "+I%s.pov" % name, "+O%s.povray.png" % name, "+W%d" % WIDTH, "+H%d" % HEIGHT, "-D", "-V",
               "+WT%d" % args.threads, "+A0.0", "+AM1", "+R%d" % max(1, math.isqrt(args.samples)), "-J"]
    out = subprocess.run(command, cwd=args.folder, check=True, capture_output=True, text=True).stderr
    line = next(line for line in out.splitlines() if "Trace Time" in line)
    return float(line.split("(")[-1].split()[0])


PEERS = {"mitsuba": run_mitsuba, "povray": run_povray}


def available(peer):
    if peer == "povray":
        return shutil.which("povray") is not None
    return subprocess.run([sys.executable, "-c", "import mitsuba"], capture_output=True).returncode == 0


def main():
    root = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../..")
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", nargs="*", help="flake mesh stadium cornell lens; all if none is named")
    parser.add_argument("--folder", default="peers-out", help="where scenes and pictures are written")
    parser.add_argument("--anim", default=os.path.join(root, "target/release/anim"))
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--as-mitsuba", metavar="SCENE", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.as_mitsuba:
        return as_mitsuba(args.as_mitsuba, args.samples)
    args.folder, args.anim = os.path.abspath(args.folder), os.path.abspath(args.anim)
    os.makedirs(args.folder, exist_ok=True)
    peers = {name: run for name, run in PEERS.items() if available(name)}
    known = scenes()
    print("%-8s %-8s %9s %9s %7s %7s" % ("scene", "", "render s", "wall s", "ratio", "wall"))
    for name in args.scene or known:
        scene = known[name]
        for i, (mesh, _) in enumerate(scene["meshes"]):
            write_ply("%s/%s%d.ply" % (args.folder, name, i), mesh)
        write_ron(args.folder, name, scene, args.samples)
        write_pov(args.folder, name, scene)
        # POV-Ray has no path tracer to set against ours.
        runners = dict(anim=run_anim, **{k: v for k, v in peers.items() if (k, name) != ("povray", "cornell")})
        times = {who: [] for who in runners}
        for _ in range(args.runs):
            for who, run in runners.items():
                start = time.time()
                seconds = run(args, name)
                times[who].append((seconds, time.time() - start))
        ours = [statistics.median(t[k] for t in times["anim"]) for k in (0, 1)]
        for who in runners:
            render, wall = (statistics.median(t[k] for t in times[who]) for k in (0, 1))
            # Ours over theirs: below 1 is faster.
            print("%-8s %-8s %9.3f %9.3f %7.2f %7.2f" % (name, who, render, wall, ours[0] / render, ours[1] / wall),
                  flush=True)


main()
