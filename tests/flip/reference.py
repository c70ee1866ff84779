#!/usr/bin/env python3
"""What the reference implementation of FLIP says of the picture pairs of src/compare/flip/tests.rs.

    python3 -m venv venv && venv/bin/pip install flip-evaluator==1.7 numpy && venv/bin/python reference.py

prints the table that the test holds: the mean of the map in f64, its largest value, and four of its pixels. The pairs are
made of whole numbers alone, so that both programs see the same bits.
"""

import math

import flip_evaluator
import numpy

WIDTH, HEIGHT = 48, 40
DEFAULT = 3840 * math.pi / 180


def scramble(x, y, seed):
    n = (x * 374761393 + y * 668265263 + seed * 2246822519) & 0xFFFFFFFF
    n = ((n ^ (n >> 13)) * 1274126177) & 0xFFFFFFFF
    return n ^ (n >> 16)


def disc(x, y, radius):
    return (x - 24) ** 2 + (y - 20) ** 2 < radius * radius


def gradient(x, y):
    return (x * 5 % 256, y * 6 % 256, (x + y) * 2 % 256)


def checker(x, y):
    return (230, 225, 220) if (x // 6 + y // 6) % 2 else (20, 30, 40)


def noise(x, y, seed):
    n = scramble(x, y, seed)
    return (n & 255, n >> 8 & 255, n >> 16 & 255)


def bright(x, y, seed):
    n = scramble(x, y, seed)
    return tuple((n >> shift & 255) << (n >> 24 & 7) for shift in (0, 8, 16))


def lamp(x, y, radius, light):
    return (light, light - 100, light // 2) if disc(x, y, radius) else tuple(c // 8 for c in gradient(x, y))


# Name, reference, test; levels that make 1.0; whether the pair is linear; pixels per degree; exposures (start, stop, count).
PAIRS = [
    ("a gradient one pixel on", lambda x, y: gradient(x, y), lambda x, y: gradient(x + 1, y), 255, False, DEFAULT, None),
    ("a checkerboard one pixel on", lambda x, y: checker(x, y), lambda x, y: checker(x + 1, y), 255, False, DEFAULT, None),
    ("two noises", lambda x, y: noise(x, y, 1), lambda x, y: noise(x, y, 2), 255, False, DEFAULT, None),
    ("two noises from nearby", lambda x, y: noise(x, y, 1), lambda x, y: noise(x, y, 2), 255, False, 20.0, None),
    ("black and white", lambda x, y: (0, 0, 0), lambda x, y: (255, 255, 255), 255, False, DEFAULT, None),
    ("red on blue, a larger disc", lambda x, y: (230, 20, 10) if disc(x, y, 10) else (10, 20, 200),
     lambda x, y: (230, 20, 10) if disc(x, y, 11) else (10, 20, 200), 255, False, DEFAULT, None),
    ("a gradient in steps", lambda x, y: gradient(x, y), lambda x, y: tuple(c & 0xE0 for c in gradient(x, y)), 255, False, DEFAULT, None),
    ("bright noises", lambda x, y: bright(x, y, 3), lambda x, y: bright(x, y, 4), 256, True, DEFAULT, None),
    ("a lamp that grows brighter", lambda x, y: lamp(x, y, 6, 9000), lambda x, y: lamp(x, y, 6, 11000), 256, True, DEFAULT, None),
    ("a lamp that grows, at given exposures", lambda x, y: lamp(x, y, 6, 9000), lambda x, y: lamp(x, y, 7, 9000), 256, True, 40.0, (-6.0, 2.0, 5)),
]


def picture(of, levels):
    rows = [[of(x, y) for x in range(WIDTH)] for y in range(HEIGHT)]
    return (numpy.array(rows, dtype=numpy.float32) / numpy.float32(levels)).astype(numpy.float32)


for name, reference, test, levels, linear, ppd, exposures in PAIRS:
    a, b = picture(reference, levels), picture(test, levels)
    parameters = {"ppd": ppd}
    if exposures:
        parameters |= {"startExposure": exposures[0], "stopExposure": exposures[1], "numExposures": exposures[2]}
    errors, _, used = flip_evaluator.evaluate(a, b, "HDR" if linear else "LDR", applyMagma=False, parameters=parameters)
    errors = errors[:, :, 0].astype(numpy.float64)
    pixels = [errors[y, x] for x, y in ((0, 0), (24, 20), (30, 12), (47, 39))]
    print(f"    // {name}" + (f": {used['startExposure']:.5f} to {used['stopExposure']:.5f} in {used['numExposures']}" if linear else ""))
    print("    ([" + ", ".join(f"{v:.6f}" for v in [errors.mean(), errors.max(), *pixels]) + "]),")
