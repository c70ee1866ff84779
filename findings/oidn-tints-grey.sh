#!/bin/sh
# Open Image Denoise 2.5.1 (PyPI pyoidn 2.5.1.0), HDR mode, colour alone.
# One would expect: a picture whose three channels are equal stays grey, a constant picture stays constant, black stays
#   black, and a mirrored picture gives the mirrored result.
# What happens: noise in grey comes out tinted, a channel up to a tenth of the mean brightness from grey; a constant 0.18
#   comes out between 0.173 and 0.185; mirroring changes single pixels by a third of the mean.
# So a denoised matte, depth or light-mix channel must be filtered as what it is, not packed into one of three channels,
#   and a comparison of denoised pictures needs a tolerance for where they lie, not only for noise.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet pyoidn==2.5.1.0 numpy==2.4.6
"$folder/env/bin/python" - <<'PYTHON'
import sys
import numpy, pyoidn

noise = numpy.random.Generator(numpy.random.PCG64(0)).random((96, 128, 1), dtype=numpy.float32)
ramp = numpy.linspace(0.2, 0.8, 128, dtype=numpy.float32)[None, :, None]
grey = numpy.repeat(ramp * (0.6 + 0.8 * noise), 3, axis=2)
run = lambda picture: pyoidn.denoise(numpy.ascontiguousarray(picture), hdr=True)
out = run(grey)
tint = abs(out - out.mean(axis=2, keepdims=True)).max() / out.mean()
flat = run(numpy.full((96, 128, 3), 0.18, numpy.float32))
turned = abs(run(grey[:, ::-1])[:, ::-1] - out).max() / out.mean()
print(f"grey in: a channel is off grey by up to {tint:.3f} of the mean")
print(f"constant 0.18 in: {flat.min():.4f} to {flat.max():.4f} out")
print(f"mirrored in: up to {turned:.3f} of the mean from the mirrored result")
sys.exit(0 if tint > 0.02 and flat.max() - flat.min() > 0.005 and turned > 0.05 else 1)
PYTHON
