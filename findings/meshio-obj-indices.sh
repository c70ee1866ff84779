#!/bin/sh
# meshio 5.3.5 reads OBJ faces of three valid kinds otherwise than they are meant.
# Expected: negative numbers count back from the last vertex before the face; of `f 1/3 2/2 3/1` the middle numbers choose
# texture coordinates; a file of two normals for three vertices, chosen by `//`, is as good as any.
# What happens: -1 becomes the last but one of the whole file (1 is taken off every number, whatever its sign), so that faces
# join other vertices, or ones before the first; texture coordinates go to vertices in the order of the file, without a
# warning; the third file is refused with an error about lengths.
# Whoever compares an OBJ reader with meshio sees differences that are not the reader's.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install meshio==5.3.5 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import sys
import meshio

def read(text):
    with open("mesh.obj", "w") as file:
        file.write(text)
    return meshio.read("mesh.obj")

CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
found = {}
mesh = read(CORNERS + "f -3 -2 -1\n" + "v 0 0 1\nv 1 0 1\nv 0 1 1\n" + "f -3 -2 -1\n")
found["relative: vertices 0 1 2, then 3 4 5"] = mesh.cells_dict["triangle"].tolist()
mesh = read(CORNERS + "vt 0 0\nvt 1 0\nvt 0 1\n" + "f 1/3 2/2 3/1\n")
found["texture coordinate of vertex 0, the third of (0, 0) (1, 0) (0, 1)"] = mesh.point_data["obj:vt"][0].tolist()
try:
    read(CORNERS + "vn 0 0 1\nvn 0 1 0\n" + "f 1//1 2//1 3//2\n")
    found["two normals for three vertices"] = "read"
except ValueError as error:
    found["two normals for three vertices"] = f"refused: {error}"
for what, value in found.items():
    print(f"{what}: {value}")
relative, texture, normals = found.values()
is_as_seen = relative == [[-4, -3, -2]] * 2 and texture == [0.0, 0.0] and normals.startswith("refused")
sys.exit(0 if is_as_seen else 1)
PYTHON
