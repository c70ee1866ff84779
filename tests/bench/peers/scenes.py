"""Five scenes as plain data: a sphereflake, a mesh, a mesh in a stadium, a Cornell box, spheres through a lens.

z is up. A material is (kind, colour): matt, mirror, glass, or half (half matt, half mirror). Light is radiometric: a
point's intensity, an area's radiance.
"""
import math

WIDTH, HEIGHT = 640, 480


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def scaled(a, k):
    return tuple(x * k for x in a)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    return scaled(a, 1 / math.sqrt(dot(a, a)))


def center(corner, u, v):
    return tuple(c + (a + b) / 2 for c, a, b in zip(corner, u, v))


def area(u, v):
    n = cross(u, v)
    return math.sqrt(dot(n, n))


def half_angle(scene):
    """Tangents of half the field of view, across and up."""
    across = math.tan(math.radians(scene["camera"][2]) / 2)
    return across, across * HEIGHT / WIDTH


def quad(a, b, c, d):
    return [a, b, c, d], [(0, 1, 2), (0, 2, 3)]


def flake(levels):
    """Spheres with nine smaller ones on each: six around the waist, three above (Haines, SPD)."""
    found, edge = [((0.0, 0.0, 0.0), 0.5)], [((0.0, 0.0, 0.0), 0.5, (0.0, 0.0, 1.0))]
    for _ in range(levels):
        following = []
        for center, radius, up in edge:
            side = unit(cross(up, (1.0, 0.0, 0.0) if abs(up[0]) < 0.9 else (0.0, 1.0, 0.0)))
            third = cross(up, side)
            places = [(math.radians(90), math.radians(60 * k)) for k in range(6)]
            places += [(math.radians(35), math.radians(30 + 120 * k)) for k in range(3)]
            for tilt, turn in places:
                flat = add(scaled(side, math.cos(turn)), scaled(third, math.sin(turn)))
                out = add(scaled(up, math.cos(tilt)), scaled(flat, math.sin(tilt)))
                following.append((add(center, scaled(out, radius * 4 / 3)), radius / 3, out))
        edge = following
        found += [(center, radius) for center, radius, _ in edge]
    return found


def blob(side):
    """A bumpy ball of 2 side^2 triangles, two units high, standing on the ground."""
    points, faces = [], []
    for i in range(side + 1):
        for j in range(side + 1):
            a, b = math.pi * (i / side - 0.5), 2 * math.pi * (j % side) / side
            r = 1 + 0.06 * math.sin(7 * a) * math.cos(6 * b) + 0.02 * math.sin(31 * a) * math.sin(29 * b)
            r += 0.004 * math.sin(113 * a) * math.cos(97 * b)
            points.append((r * math.cos(a) * math.cos(b), r * math.cos(a) * math.sin(b), 1 + r * math.sin(a)))
    for i in range(side):
        for j in range(side):
            a = i * (side + 1) + j
            b, c, d = a + 1, a + side + 1, a + side + 2
            faces += [(a, b, d), (a, d, c)]
    return points, faces


def stadium(radius=500.0, segments=64, steps=12):
    rings = [(0.2 * radius, 0.0)]
    for k in range(steps):
        height = 0.03 * radius * (k + 1)
        rings += [(radius * (0.2 + 0.8 * k / steps), height), (radius * (0.2 + 0.8 * (k + 1) / steps), height)]
    points = [(0.0, 0.0, 0.0)]
    for r, z in rings:
        points += [(r * math.cos(2 * math.pi * i / segments), r * math.sin(2 * math.pi * i / segments), z)
                   for i in range(segments)]
    faces = [(0, 1 + i, 1 + (i + 1) % segments) for i in range(segments)]
    for k in range(len(rings) - 1):
        for i in range(segments):
            a, b = 1 + k * segments + i, 1 + k * segments + (i + 1) % segments
            faces += [(a, a + segments, b), (b, a + segments, b + segments)]
    return points, faces


def scenes():
    ground = ("matt", (0.6, 0.6, 0.6))
    clay = ("matt", (0.8, 0.5, 0.3))
    lamp = ("area", (1.0, -3.0, 5.0), (1.5, 0.0, 0.0), (0.0, 1.5, 0.0), (25.0, 25.0, 25.0))
    portrait = ((1.6, -4.2, 2.4), (0.0, 0.0, 0.9), 45.0)
    floor = lambda s, z: quad((-s, -s, z), (s, -s, z), (s, s, z), (-s, s, z))
    white, black, red, green = (("matt", c) for c in ((0.73,) * 3, (0.0,) * 3, (0.63, 0.06, 0.05), (0.14, 0.45, 0.09)))
    rows = [((1.1 * i, 1.1 * j, 0.5), 0.5) for j in range(20) for i in range(-4, 5)]
    return {
        "flake": dict(
            camera=((2.1, 1.3, 1.7), (0.0, 0.0, 0.0), 45.0), lens=(0.0, 1.0), mode="whitted", depth=6,
            lights=[("point", p, (k,) * 3) for p, k in (((4, 3, 2), 17.0), ((1, -4, 4), 19.0), ((-3, 1, 5), 20.0))],
            spheres=[(flake(4), ("half", (1.0, 0.9, 0.7)))],
            meshes=[(floor(12.0, -0.5), ("matt", (0.8, 0.6, 0.264)))]),
        "mesh": dict(
            camera=portrait, lens=(0.0, 1.0), mode="direct", depth=1, lights=[lamp], spheres=[],
            meshes=[(blob(190), clay), (floor(10.0, 0.0), ground)]),
        "stadium": dict(
            camera=((3.2, -6.4, 2.6), (0.0, 0.0, 1.6), 55.0), lens=(0.0, 1.0), mode="direct", depth=1,
            lights=[("point", (150.0, -200.0, 400.0), (7e5,) * 3)], spheres=[],
            meshes=[(blob(190), clay), (stadium(), ground)]),
        "cornell": dict(
            camera=((0.0, -4.3, 1.0), (0.0, 0.0, 1.0), 42.0), lens=(0.0, 1.0), mode="path", depth=7,
            lights=[("area", (-0.3, -0.3, 1.98), (0.6, 0.0, 0.0), (0.0, 0.6, 0.0), (15.0,) * 3)],
            spheres=[([((0.42, -0.32, 0.38), 0.38)], ("glass", (1.0,) * 3)),
                     ([((-0.42, 0.32, 0.42), 0.42)], ("mirror", (0.95,) * 3))],
            meshes=[(quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)), white),
                    # A lid on the lamp, which shines to both sides here.
                    (floor(0.31, 1.981), black),
                    (quad((-1, -1, 2), (-1, 1, 2), (1, 1, 2), (1, -1, 2)), white),
                    (quad((-1, 1, 0), (1, 1, 0), (1, 1, 2), (-1, 1, 2)), white),
                    (quad((-1, -1, 0), (-1, 1, 0), (-1, 1, 2), (-1, -1, 2)), red),
                    (quad((1, -1, 0), (1, -1, 2), (1, 1, 2), (1, 1, 0)), green)]),
        "lens": dict(
            camera=((0.0, -6.0, 2.2), (0.0, 4.0, 0.4), 40.0), lens=(0.08, 9.0), mode="direct", depth=1,
            lights=[("area", (-4.0, -4.0, 9.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), (30.0,) * 3)],
            spheres=[(rows, clay)], meshes=[(floor(60.0, 0.0), ground)]),
    }
