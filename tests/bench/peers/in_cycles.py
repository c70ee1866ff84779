"""Cycles, Blender's path tracer (bpy, PyPI): this file is run in a process of its own, which imports it."""
import json
import math
import os
import sys

import studio
from common import best, film_with, render_with
from scenes import HEIGHT, WIDTH, area, center, cross, scaled, sub, unit

DIFFUSE, MIRROR, GLASS = "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfAnisotropic", "ShaderNodeBsdfGlass"


def run(args, name):
    return render_with("in_cycles.py", args, name)


def settings(bpy, size, samples, threads, bounces, diffuse):
    """An empty scene; as many bounces after the first surface as said, none from matt ones unless `diffuse`."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    wanted = {
        scene.render: dict(
            threads_mode="FIXED", threads=threads, resolution_x=size[0], resolution_y=size[1],
            resolution_percentage=100, use_persistent_data=True, use_compositing=False, use_sequencer=False,
            dither_intensity=0),
        scene.render.image_settings: dict(file_format="PNG", color_mode="RGB", color_depth="8"),
        scene.view_settings: dict(view_transform="Standard"),
        # Neither clamped nor blurred nor cut short by chance, as the others.
        scene.cycles: dict(
            device="CPU", samples=samples, use_adaptive_sampling=False, use_denoising=False, pixel_filter_type="BOX",
            sample_clamp_indirect=0, blur_glossy=0, light_sampling_threshold=0, min_light_bounces=bounces,
            caustics_reflective=True, caustics_refractive=True, max_bounces=bounces,
            diffuse_bounces=bounces if diffuse else 0, glossy_bounces=bounces, transmission_bounces=bounces),
    }
    for owner, fields in wanted.items():
        for field, value in fields.items():
            setattr(owner, field, value)
    return scene


def link(bpy, name, data, place=(0, 0, 0)):
    found = bpy.data.objects.new(name, data)
    found.location = place
    bpy.context.scene.collection.objects.link(found)
    return found


def turn(found, forward, up):
    """Cameras and lamps look along -z, with y up."""
    from mathutils import Matrix

    right = unit(cross(forward, up))
    found.rotation_euler = Matrix((right, cross(right, forward), scaled(forward, -1))).transposed().to_euler()


def material(bpy, node, color, mirror=0.0, **inputs):
    """A surface, and as much of a white mirror as said."""
    made = bpy.data.materials.new(node)
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()

    def add(node, color, **inputs):
        found = nodes.new(node)
        for name, value in dict(inputs, Color=(*color, 1)).items():
            found.inputs[name].default_value = value
        return found.outputs[0]

    skin = add(node, color, **inputs)
    if mirror > 0:
        mixed = nodes.new("ShaderNodeMixShader")
        mixed.inputs[0].default_value = mirror
        links.new(skin, mixed.inputs[1])
        links.new(add(MIRROR, (1, 1, 1), Roughness=0), mixed.inputs[2])
        skin = mixed.outputs[0]
    links.new(skin, nodes.new("ShaderNodeOutputMaterial").inputs[0])
    return made


def material_of(bpy, kind, color):
    if kind == "glass":
        return material(bpy, GLASS, color, Roughness=0, IOR=1.5)
    if kind == "mirror":
        return material(bpy, MIRROR, color, Roughness=0)
    return material(bpy, DIFFUSE, color, mirror=0.5 if kind == "half" else 0)


def add_spheres(bpy, name, spheres, skin):
    """Spheres as points, which Cycles intersects as such: geometry nodes make them of a mesh without faces."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(spheres))
    mesh.vertices.foreach_set("co", [x for middle, _ in spheres for x in middle])
    mesh.attributes.new("size", "FLOAT", "POINT").data.foreach_set("value", [radius for _, radius in spheres])
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, size, points, skinned, end = (group.nodes.new(node) for node in (
        "NodeGroupInput", "GeometryNodeInputNamedAttribute", "GeometryNodeMeshToPoints", "GeometryNodeSetMaterial",
        "NodeGroupOutput"))
    size.data_type = "FLOAT"
    size.inputs["Name"].default_value = "size"
    skinned.inputs["Material"].default_value = skin
    for output, input in ((start.outputs[0], points.inputs["Mesh"]), (size.outputs[0], points.inputs["Radius"]),
                          (points.outputs[0], skinned.inputs[0]), (skinned.outputs[0], end.inputs[0])):
        group.links.new(output, input)
    link(bpy, name, mesh).modifiers.new("points", "NODES").node_group = group


def add_shape(bpy, skin, make, *args, **fields):
    """The mesh that an operator of Blender makes."""
    make(*args, **fields)
    bpy.context.object.data.materials.append(skin)


def add_ply(bpy, skin, file):
    add_shape(bpy, skin, bpy.ops.wm.ply_import, filepath=file, forward_axis="Y", up_axis="Z")


def set_radiance(lamp, radiance):
    """Lamps have a power, and a colour of 0 to 1."""
    peak = max(radiance)
    lamp.energy, lamp.color = math.pi * lamp.size * lamp.size_y * peak, scaled(radiance, 1 / peak)


def add_lamp(bpy, place, size):
    lamp = bpy.data.lights.new("lamp", "AREA")
    lamp.shape, (lamp.size, lamp.size_y) = "RECTANGLE", size
    return link(bpy, "lamp", lamp, place)


def add_light(bpy, mode, kind, *light):
    if kind == "area":
        # It shines down, as new ones do.
        corner, u, v, radiance = light
        lamp = add_lamp(bpy, center(corner, u, v), (math.hypot(*u), math.hypot(*v))).data
        lamp.cycles.use_multiple_importance_sampling = mode != "direct"
        return set_radiance(lamp, radiance)
    place, intensity = light
    point, peak = bpy.data.lights.new(kind, "POINT"), max(intensity)
    point.shadow_soft_size, point.energy, point.color = 0, 4 * math.pi * peak, scaled(intensity, 1 / peak)
    link(bpy, kind, point, place)


def add_camera(bpy, eye, target, up, fov, aperture=0.0, focus=1.0):
    """`fov` is across, in degrees."""
    data = bpy.data.cameras.new("camera")
    data.sensor_fit, data.angle = "HORIZONTAL", math.radians(fov)
    if aperture > 0:
        data.dof.use_dof, data.dof.focus_distance = True, focus
        data.dof.aperture_fstop = data.lens * 1e-3 / (2 * aperture)
    bpy.context.scene.camera = link(bpy, "camera", data, eye)
    turn(bpy.context.scene.camera, unit(sub(target, eye)), up)


def build(bpy, scene, samples, threads):
    made = settings(bpy, (WIDTH, HEIGHT), samples, threads, scene["depth"] - 1, scene["mode"] == "path")
    eye, target, fov = scene["camera"]
    add_camera(bpy, eye, target, (0, 0, 1), fov, *scene["lens"])
    for light in scene["lights"]:
        add_light(bpy, scene["mode"], *light)
    for file, m in scene["meshes"]:
        add_ply(bpy, material_of(bpy, *m), file)
    for i, (spheres, m) in enumerate(scene["spheres"]):
        skin = material_of(bpy, *m)
        if m[0] != "glass":
            add_spheres(bpy, "spheres%d" % i, spheres, skin)
            continue
        # Points have no inside: fine smooth meshes.
        for middle, radius in spheres:
            add_shape(bpy, skin, bpy.ops.mesh.primitive_ico_sphere_add, subdivisions=7, radius=radius, location=middle)
            bpy.ops.object.shade_smooth()
    return made


def still(bpy, name, samples, threads, times):
    with open(name + ".json") as f:
        scene = build(bpy, json.load(f), samples, threads)

    def render(seed):
        scene.cycles.seed = seed
        bpy.ops.render.render()

    seconds = best(render, times)
    bpy.data.images["Render Result"].save_render(os.path.abspath(name + ".cycles.png"))
    print(seconds)


# The lighting study: it is built once, and its lamps are set for each frame


def run_study(args, frames):
    return film_with("in_cycles.py", args, frames)


def keep_bright(lamp):
    """Lets a lamp not weaken with distance, as ours."""
    lamp.use_nodes = True
    nodes, links = lamp.node_tree.nodes, lamp.node_tree.links
    nodes.clear()
    constant, emission, end = map(nodes.new, ("ShaderNodeLightFalloff", "ShaderNodeEmission", "ShaderNodeOutputLight"))
    constant.inputs["Strength"].default_value = 1
    links.new(constant.outputs["Constant"], emission.inputs["Strength"])
    links.new(emission.outputs[0], end.inputs[0])


def build_studio(bpy, samples, threads):
    made = settings(bpy, (studio.WIDTH, studio.HEIGHT), samples, threads, 3, False)
    across = math.tan(math.radians(studio.FOV_UP / 2)) * studio.WIDTH / studio.HEIGHT
    add_camera(bpy, studio.EYE, studio.TARGET, (0, 1, 0), 2 * math.degrees(math.atan(across)))
    plaster, gloss, stage = (
        material(bpy, DIFFUSE, albedo, mirror) for albedo, _, _, mirror in studio.MATERIALS.values())
    new = bpy.ops.mesh
    down = math.radians(90)
    add_shape(bpy, stage, new.primitive_plane_add, size=200, rotation=(down, 0, 0))
    add_shape(bpy, plaster, new.primitive_plane_add, size=200, location=(0, 0, -3.5))
    add_spheres(bpy, "ball", [((-1.25, 0.7, 0.5), 0.7)], gloss)
    add_shape(bpy, plaster, new.primitive_cube_add, size=1, location=(0.35, 0.5, -0.4),
              rotation=(0, math.radians(28), 0))
    add_shape(bpy, gloss, new.primitive_cylinder_add, vertices=512, radius=0.4, depth=1.3, location=(1.75, 0.65, 0.35),
              rotation=(down, 0, 0))
    add_ply(bpy, plaster, "cone.ply")
    add_ply(bpy, gloss, "pebble.ply")
    bpy.ops.object.shade_smooth()
    lamps = []
    for i, (place, faced, (width, depth), _) in enumerate(studio.LAMPS):
        lamp = add_lamp(bpy, place, (2 * width, 2 * depth))
        turn(lamp, unit(sub(faced, place)), studio.axes(i)[1])
        keep_bright(lamp.data)
        lamps.append(lamp.data)
    return made, lamps


def film(bpy, samples, threads, frames):
    scene, lamps = build_studio(bpy, samples, threads)
    for frame in range(1, frames + 1):
        for i, lamp in enumerate(lamps):
            set_radiance(lamp, studio.radiance(i, frame, 1.0))
        scene.render.filepath = os.path.abspath("cycles/mixing.%04d.png" % frame)
        bpy.ops.render.render(write_still=True)


def main(name, *numbers):
    import bpy

    if name == "study":
        film(bpy, *map(int, numbers))
    else:
        still(bpy, name, *map(int, numbers))


if __name__ == "__main__":
    main(*sys.argv[1:])
