"""Mitsuba 3 (PyPI): this file is run in a process of its own, which imports it."""
import json
import math
import sys

import studio
from common import best, film_with, render_with
from scenes import HEIGHT, WIDTH, center


def run(args, name):
    return render_with("in_mitsuba.py", args, name, DRJIT_NUM_THREADS=str(args.threads))


def rgb(v):
    return {"type": "rgb", "value": list(v)}


def bsdf(kind, color):
    matt = {"type": "diffuse", "reflectance": rgb(color)}
    if kind == "glass":
        return {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0}
    if kind == "mirror":
        matt = {"type": "conductor", "material": "none", "specular_reflectance": rgb(color)}
    if kind == "half":
        matt = {"type": "blendbsdf", "weight": 0.5, "a": matt, "b": {"type": "conductor", "material": "none"}}
    return {"type": "twosided", "inner": matt}


def sensor(mi, scene, samples):
    eye, target, fov = scene["camera"]
    aperture, focus = scene["lens"]
    lens = {"type": "thinlens", "aperture_radius": aperture, "focus_distance": focus}
    return {
        **(lens if aperture > 0 else {"type": "perspective"}), "fov": fov, "fov_axis": "x",
        "to_world": mi.ScalarTransform4f().look_at(origin=eye, target=target, up=[0, 0, 1]),
        "film": {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "rfilter": {"type": "box"}},
        "sampler": {"type": "independent", "sample_count": samples},
    }


def world(mi, np, name, scene, samples):
    integrator = {"type": "path", "max_depth": scene["depth"] + 1, "rr_depth": 1000}
    if scene["mode"] == "direct":
        integrator = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
    world = {"type": "scene", "integrator": integrator, "sensor": sensor(mi, scene, samples)}
    for i, (kind, *light) in enumerate(scene["lights"]):
        if kind == "point":
            world["light%d" % i] = {"type": "point", "position": light[0], "intensity": rgb(light[1])}
            continue
        corner, u, v, radiance = light
        # Lamps shine down.
        matrix = np.eye(4)
        matrix[:3, :] = np.transpose([[x / 2 for x in u], [-x / 2 for x in v], [0, 0, -1], center(corner, u, v)])
        world["light%d" % i] = {"type": "rectangle", "to_world": mi.ScalarTransform4f(matrix),
                                "emitter": {"type": "area", "radiance": rgb(radiance)}}
    for i, (file, m) in enumerate(scene["meshes"]):
        world["mesh%d" % i] = {"type": "ply", "filename": file, "face_normals": True, "bsdf": bsdf(*m)}
    for i, (spheres, m) in enumerate(scene["spheres"]):
        world["skin%d" % i] = dict(bsdf(*m), id="skin%d" % i)
        for j, (middle, radius) in enumerate(spheres):
            world["sphere%d_%d" % (i, j)] = {"type": "sphere", "center": middle, "radius": radius,
                                             "bsdf": {"type": "ref", "id": "skin%d" % i}}
    return world


# The lighting study: it is loaded once, and its lamps are set for each frame


def run_study(args, frames):
    return film_with("in_mitsuba.py", args, frames, DRJIT_NUM_THREADS=str(args.threads))


def studio_scene(mi, samples):
    at = mi.ScalarTransform4f
    world = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 5, "rr_depth": 1000},
        "sensor": {
            "type": "perspective", "fov": studio.FOV_UP, "fov_axis": "y",
            "to_world": at().look_at(origin=studio.EYE, target=studio.TARGET, up=[0, 1, 0]),
            "film": {"type": "hdrfilm", "width": studio.WIDTH, "height": studio.HEIGHT, "rfilter": {"type": "box"}},
            "sampler": {"type": "independent", "sample_count": samples},
        },
    }
    for name, (albedo, _, _, mirror) in studio.MATERIALS.items():
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
    add("cone", "plaster", "ply", filename="cone.ply", face_normals=True)
    add("pebble", "gloss", "ply", filename="pebble.ply")
    for i, (place, faced, half, _) in enumerate(studio.LAMPS):
        to_world = at().look_at(origin=place, target=faced, up=studio.axes(i)[1]).scale([*half, 1])
        world["lamp%d" % i] = {"type": "rectangle", "to_world": to_world,
                               "emitter": {"type": "area", "radiance": rgb((1, 1, 1))}}
    return mi.load_dict(world)


def film(mi, samples, frames):
    scene = studio_scene(mi, samples)
    params = mi.traverse(scene)
    for frame in range(1, frames + 1):
        for i, (place, faced, *_) in enumerate(studio.LAMPS):
            # These weaken with distance: as bright as ours on the middle of the stage.
            radiance = studio.radiance(i, frame, math.dist(place, faced))
            params["lamp%d.emitter.radiance.value" % i] = mi.Color3f(list(radiance))
        params.update()
        image = mi.render(scene, spp=samples, seed=1)
        mi.util.write_bitmap("mitsuba/mixing.%04d.png" % frame, image, write_async=False)


def still(mi, name, samples, times):
    import numpy as np

    with open(name + ".json") as f:
        scene = mi.load_dict(world(mi, np, name, json.load(f), samples))
    images = []
    # Mitsuba renders when pixels are asked for.
    seconds = best(lambda seed: images.append(np.array(mi.render(scene, spp=samples, seed=seed))), times)
    mi.util.write_bitmap(name + ".mitsuba.png", images[-1], write_async=False)
    print(seconds)


def main(name, samples, _, times):
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    if name == "study":
        film(mi, int(samples), int(times))
    else:
        still(mi, name, int(samples), int(times))


if __name__ == "__main__":
    main(*sys.argv[1:])
