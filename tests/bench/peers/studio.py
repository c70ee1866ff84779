"""The lighting study as data: scenes/studio.ron and scripts/mixing.rhai. y is up."""
import math

from scenes import cross, scaled, sub, unit

WIDTH, HEIGHT, FRAMES = 640, 360, 48
EYE, TARGET, FOV_UP = (0.0, 1.9, 6.2), (0.0, 0.85, 0.0), 32.0
# Colour, weight of the highlight, its exponent, weight of the mirror image.
MATERIALS = {
    "plaster": ((0.76, 0.75, 0.73), 0.0, 20.0, 0.0),
    "gloss": ((0.74, 0.73, 0.71), 0.35, 70.0, 0.12),
    "stage": ((0.4, 0.4, 0.4), 0.1, 20.0, 0.06),
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


def radiance(lamp, frame, distance):
    """What the colour is for lamps that are reckoned radiometrically, as seen from a distance."""
    _, _, (width, depth), _ = LAMPS[lamp]
    return scaled(color(lamp, frame), math.pi * distance**2 / (4 * width * depth))


def axes(lamp):
    """Half edges of a lamp."""
    place, faced, (width, depth), _ = LAMPS[lamp]
    forward = unit(sub(faced, place))
    right = unit(cross(forward, (0.0, 0.0, 1.0) if abs(forward[1]) > 0.9 else (0.0, 1.0, 0.0)))
    return scaled(right, width), scaled(cross(right, forward), depth)


# Meshes for those who have neither cones nor ellipsoids


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
