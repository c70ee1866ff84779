"""This program."""
import json
import math
import os

from common import ROOT, text, timed
from scenes import HEIGHT, WIDTH, area, center, half_angle

MATERIALS = {
    "matt": "color: %s, diffuse: 1, specular: 0",
    "half": "color: %s, diffuse: 0.5, specular: 0, reflection: 0.5, specular_color: (1, 1, 1)",
    "mirror": "color: (0, 0, 0), diffuse: 0, specular: 0, reflection: 1, specular_color: %s",
    "glass": "color: (0, 0, 0), diffuse: 0, specular: 0, transmission: 1, ior: 1.5, specular_color: %s",
}


def light_entity(kind, *light):
    # Colours here are pi times less than radiometric ones.
    if kind == "point":
        return "point_light: (position: %s, color: %s, falloff: InverseSquare)" % (
            text(light[0]), text(x / math.pi for x in light[1]))
    corner, u, v, radiance = light
    color = text(x * area(u, v) / math.pi for x in radiance)
    return "area_light: (position: %s, edges: (%s, %s), color: %s, falloff: InverseSquare, visible: true)" % (
        text(center(corner, u, v)), text(u), text(v), color)


def write(folder, name, scene, samples):
    eye, target, _ = scene["camera"]
    integrator = "Distribution" if scene["mode"] == "whitted" else "Path"
    materials, entities = [], [light_entity(*light) for light in scene["lights"]]

    def material(m):
        if m not in materials:
            materials.append(m)
        return "m%d" % materials.index(m)

    for i, (_, m) in enumerate(scene["meshes"]):
        entities.append('mesh: (file: "%s%d.ply"), material: "%s"' % (name, i, material(m)))
    for spheres, m in scene["spheres"]:
        for middle, radius in spheres:
            entities.append('sphere: (center: %s, radius: %.9g), material: "%s"' % (text(middle), radius, material(m)))
    with open("%s/%s.ron" % (folder, name), "w") as f:
        f.write("(camera: (from: %s, at: %s, up: (0, 0, 1), fov: %.9g, aperture: %.9g, focus_distance: %.9g),\n" % (
            text(eye), text(target), 2 * math.degrees(math.atan(half_angle(scene)[1])), *scene["lens"]))
        f.write("render: (size: (%d, %d), samples: %d, integrator: %s, max_depth: %d),\nmaterials: {\n" % (
            WIDTH, HEIGHT, samples, integrator, scene["depth"]))
        for i, (kind, color) in enumerate(materials):
            f.write('    "m%d": (%s, two_sided: true),\n' % (i, MATERIALS[kind] % text(color)))
        f.write("},\nentities: [\n" + "".join("    (%s),\n" % e for e in entities) + "])\n")


def run(args, name):
    command = [args.anim, "render", name + ".ron", "-o", name + ".anim.png", "--force", "--threads", str(args.threads)]
    done, wall, processors = timed(command + ["--stats", "json"], args.folder)
    return json.loads(done.stdout.splitlines()[-1])["render_seconds"], wall, processors


def run_study(args):
    """All frames: those of one film help one another."""
    command = [args.anim, os.path.join(ROOT, "scripts/mixing.rhai"), "-o", "anim", "--force"]
    command += ["--spp", str(args.samples), "--threads", str(args.threads)]
    return timed(command, args.folder)[1:]
