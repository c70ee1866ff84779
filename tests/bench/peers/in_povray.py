"""POV-Ray 3.7 (Debian)."""
import math
import os

import studio
from common import text, timed
from scenes import HEIGHT, WIDTH, center, cross, half_angle, scaled, sub, unit


def write(folder, name, scene):
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
        "glass": "pigment { rgbt 1 } finish { ambient 0 diffuse 0 reflection { 0 1 fresnel } }"
                 " interior { ior 1.5 } //%s",
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
                f.write("light_source { %s rgb 1 area_light %s, %s, 2, 2 jitter }\n" % (
                    angle(center(corner, u, v)), angle(u), angle(v)))
        for (points, faces), (kind, color) in scene["meshes"]:
            f.write("mesh2 { vertex_vectors { %d, %s } face_indices { %d, %s } %s\n}\n" % (
                len(points), ",".join(map(angle, points)), len(faces), ",".join(map(angle, faces)),
                finish[kind] % angle(color)))
        for spheres, (kind, color) in scene["spheres"]:
            f.write("union {\n" + "".join("sphere { %s, %.9g }\n" % (angle(c), r) for c, r in spheres))
            f.write("%s\n}\n" % (finish[kind] % angle(color)))


def command(args, scene, picture, size):
    return ["povray", "+I" + scene, "+O" + picture, "+W%d" % size[0], "+H%d" % size[1], "+WT%d" % args.threads,
            "-D", "-V", "-J", "+A0.0", "+AM1", "+R%d" % max(1, math.isqrt(args.samples))]


def run(args, name):
    done, wall, processors = timed(command(args, name + ".pov", name + ".povray.png", (WIDTH, HEIGHT)), args.folder)
    # "Trace Time: 0 hours 0 minutes 2 seconds (2.290 seconds)", by the clock.
    line = next(line for line in done.stderr.splitlines() if "Trace Time" in line)
    return float(line.split("(")[-1].split()[0]), wall, processors


# The lighting study: one animation


def write_study(folder):
    v = lambda p: text(p, "<>")
    forward = unit(sub(studio.TARGET, studio.EYE))
    right = unit(cross(forward, (0.0, 1.0, 0.0)))
    up = math.tan(math.radians(studio.FOV_UP / 2))
    across = up * studio.WIDTH / studio.HEIGHT
    finish = {
        name: "pigment { rgb %s } finish { ambient 0 diffuse 1 specular %g roughness %g reflection %g }" % (
            v(albedo), highlight, 1 / exponent, mirror)
        for name, (albedo, highlight, exponent, mirror) in studio.MATERIALS.items()
    }
    lines = [
        "#version 3.7;",
        "global_settings { assumed_gamma 1 max_trace_level 4 }",
        "camera { location %s direction %s right %s up %s }" % (
            v(studio.EYE), v(forward), v(scaled(right, 2 * across)), v(scaled(cross(right, forward), 2 * up))),
        "plane { y, 0 %s }" % finish["stage"],
        "plane { z, -3.5 %s }" % finish["plaster"],
        "sphere { <-1.25, 0.7, 0.5>, 0.7 %s }" % finish["gloss"],
        "box { -0.5, 0.5 rotate 28*y translate <0.35, 0.5, -0.4> %s }" % finish["plaster"],
        "cone { <0.35, 1, -0.4>, 0.42, <0.35, 2, -0.4>, 0 %s }" % finish["plaster"],
        "cylinder { <1.75, 0, 0.35>, <1.75, 1.3, 0.35>, 0.4 %s }" % finish["gloss"],
        "sphere { 0, 1 scale <0.34, 0.18, 0.24> translate <0.45, 0.18, 1.35> %s }" % finish["gloss"],
    ]
    for i, (place, *_) in enumerate(studio.LAMPS):
        colors = ", ".join("rgb " + v(studio.color(i, frame)) for frame in range(1, studio.FRAMES + 1))
        lines.append("#declare Colors%d = array[%d] { %s }" % (i, studio.FRAMES, colors))
        a, b = (v(scaled(axis, 2)) for axis in studio.axes(i))
        lines.append("light_source { %s Colors%d[frame_number - 1] area_light %s, %s, 2, 2 jitter }" % (
            v(place), i, a, b))
    with open(os.path.join(folder, "mixing.pov"), "w") as f:
        f.write("\n".join(lines) + "\n")


def run_study(args, frames):
    chosen = command(args, "mixing.pov", "povray/mixing.png", (studio.WIDTH, studio.HEIGHT))
    return timed(chosen + ["+KFI1", "+KFF%d" % studio.FRAMES, "+SF1", "+EF%d" % frames], args.folder)[1:]
