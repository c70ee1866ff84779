#!/usr/bin/env python3
"""Writes a benchmark scene (NAME.json and the files that it names) as a RON scene: to_ron.py FOLDER NAME > NAME.ron

Radiometric light becomes the colour that arrives at distance 1: a point's intensity, or radiance times area, over pi.
"""
import json
import math
import struct
import sys


def vector(v):
    return "(%s)" % ", ".join("%.9g" % x for x in v)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def length(v):
    return math.sqrt(sum(x * x for x in v))


def material(m):
    kind = m["type"]
    if kind == "glass":
        return "color: (0, 0, 0), diffuse: 0, specular: 0, transmission: 1, ior: %.9g, specular_color: (1, 1, 1)" % m["ior"]
    if kind == "mirror":
        return "color: (0, 0, 0), diffuse: 0, specular: 0, reflection: 1, specular_color: %s" % vector(m["color"])
    if kind == "diffuse":
        return "color: %s, diffuse: 1, specular: 0" % vector(m["color"])
    # Half diffuse, half mirror.
    return "color: %s, diffuse: %g, specular: 0, reflection: %g, specular_color: (1, 1, 1)" % (
        vector(m["color"]), m["kd"], m["kr"])


def light(l):
    if l["type"] == "point":
        return "point_light: (position: %s, color: %s, falloff: InverseSquare)" % (
            vector(l["pos"]), vector(x / math.pi for x in l["intensity"]))
    u, v = l["u"], l["v"]
    center = [c + (a + b) / 2 for c, a, b in zip(l["corner"], u, v)]
    scale = length(cross(u, v)) / math.pi
    return "area_light: (position: %s, edges: (%s, %s), color: %s, falloff: InverseSquare)" % (
        vector(center), vector(u), vector(v), vector(x * scale for x in l["radiance"]))


def spheres(path):
    with open(path, "rb") as f:
        count = struct.unpack("<I", f.read(4))[0]
        for x, y, z, r in struct.iter_unpack("<4f", f.read(16 * count)):
            yield (x, y, z), r


def main():
    folder, name = sys.argv[1], sys.argv[2]
    scene = json.load(open("%s/%s.json" % (folder, name)))
    camera, mode = scene["camera"], scene["mode"]
    width, height = 640, 480
    half = math.tan(math.radians(camera["hfov_deg"]) / 2) * height / width
    # Ours counts rays, theirs bounces; a path of eight edges ends with light at its seventh vertex.
    depth = {"whitted": scene["depth"] + 1, "direct": 1, "path": 7}[mode]
    integrator = "Path" if mode in ("path", "direct") else "Distribution"
    print("(camera: (from: %s, at: %s, up: %s, fov: %.9g, aperture: %.9g, focus_distance: %.9g)," % (
        vector(camera["eye"]), vector(camera["target"]), vector(camera["up"]),
        2 * math.degrees(math.atan(half)), camera["aperture_radius"], camera["focus_distance"]))
    print("render: (size: (%d, %d), samples: 16, integrator: %s, max_depth: %d, background: %s)," % (
        width, height, integrator, depth, vector(scene["background"])))
    print("materials: {")
    for key, m in scene["materials"].items():
        print('    "%s": (%s, two_sided: true),' % (key, material(m)))
    print("},\nentities: [")
    for l in scene["lights"]:
        print("    (%s)," % light(l))
    for g in scene["geometry"]:
        if g["type"] == "mesh":
            print('    (mesh: (file: "%s.ply"), material: "%s"),' % (g["file"], g["material"]))
            continue
        for center, radius in spheres("%s/%s.sph" % (folder, g["file"])):
            print('    (sphere: (center: %s, radius: %.9g), material: "%s"),' % (vector(center), radius, g["material"]))
    print("])")


main()
