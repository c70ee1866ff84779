#!/bin/sh
# trimesh 4.9.0 reads three kinds of valid glTF 2.0 as other geometry, without an error or a warning.
# Expected: values of a sparse accessor stand over the plain ones; positions of normalised bytes (KHR_mesh_quantization)
# run from 0 to 1; EXT_mesh_gpu_instancing, which the file lists as required, shows a triangle three times, or the file
# is refused, as the specification wants it of a required extension that a reader does not know.
# What happens: the sparse values are dropped, a byte of 255 is 255 and not 1, and one triangle of three is there.
# Whoever checks a glTF reader against trimesh sees differences that are not the reader's.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install trimesh==4.9.0 numpy==2.3.4
"$folder/venv/bin/python" - <<'PYTHON'
import base64, io, json, struct, sys
import trimesh

def floats(*values):
    return struct.pack(f"<{len(values)}f", *values)

TRIANGLE = floats(0, 0, 0, 1, 0, 0, 0, 1, 0)

def bounds(parts, accessors, node={}, required=[], stride=None):
    data, views = b"", []
    for part in parts:
        data += b"\0" * (-len(data) % 4)
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(part)})
        data += part
    if stride:
        views[0]["byteStride"] = stride
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    file = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, **node}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": len(data), "uri": uri}], "bufferViews": views, "accessors": accessors,
    }
    if required:
        file |= {"extensionsUsed": required, "extensionsRequired": required}
    scene = trimesh.load(io.BytesIO(json.dumps(file).encode()), file_type="gltf", process=False)
    return [float(x) for x in scene.bounds[1]]

def points(view, **more):
    return {"bufferView": view, "componentType": 5126, "count": 3, "type": "VEC3", **more}

sparse = {"count": 1, "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 2}}
found = {
    "sparse: vertex 1 is moved to x = 5": bounds(
        [TRIANGLE, struct.pack("<H", 1), floats(5, 0, 0)], [points(0, sparse=sparse)]),
    "normalised bytes 0 and 255": bounds(
        [bytes([0, 0, 0, 0, 255, 0, 0, 0, 0, 255, 0, 0])], [points(0) | {"componentType": 5121, "normalized": True}],
        required=["KHR_mesh_quantization"], stride=4),
    "instances at x = 0, 2 and 4": bounds(
        [TRIANGLE, floats(0, 0, 0, 2, 0, 0, 4, 0, 0)], [points(0), points(1)], required=["EXT_mesh_gpu_instancing"],
        node={"extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}}),
}
for what, upper in found.items():
    print(f"{what}: upper corner of the bounds {upper}")
sys.exit(0 if [upper[0] for upper in found.values()] == [1.0, 255.0, 1.0] else 1)
PYTHON
