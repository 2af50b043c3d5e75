#!/bin/sh
# In interrogation windows that are higher than wide FF-PIV finds the right velocity along x and a wrong one along y.
#
# Guess:      a window of 64 by 32 pixels finds the displacement that one of 32 by 32 finds; if a shape is not
#             supported, an error.
# Seen:       the row of the peak is counted with the height of the window in the place of its width. Particles that
#             move 3 pixels to the right and 2 down have (2.9, 1.9) in square windows, (3.0, -15.0) in windows 64 high
#             and 32 wide and (3.0, 11.0) in 48 by 64; only 32 by 64 raises an IndexError. The windows of 64 by 32 agree
#             with each other to half a pixel, and none is NaN.
# Matters:    windows that are long along the river and narrow across it are the natural choice for a shear layer behind
#             plants. The velocity across is that of the shape, steady in time, and passes each filter by deviation.
# Documented: "interrogation window size in y (first) and x (second) dimension"; no remark that both have to be equal.
# Versions:   ffpiv 0.2.1 (without the optional rocket-fft), numpy 2.2.6, numba 0.61.2, pyFFTW 0.15.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps \
    ffpiv==0.2.1 numpy==2.2.6 numba==0.61.2 llvmlite==0.44.0 pyFFTW==0.15.0 platformdirs==4.3.8 psutil==7.0.0
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import ffpiv
import numpy as np

noise = np.random.default_rng(1).integers(0, 255, (300, 300)).astype(float)
particles = sum(np.roll(noise, (i, j), (0, 1)) / (1 + i * i + j * j) for i in (-2, -1, 0, 1, 2) for j in (-2, -1, 0, 1, 2))
first, second = particles[20:276, 20:276], particles[18:274, 17:273]  # 3 pixels to the right, 2 down


def displacement(height, width):
    """Medians of both displacements, and the scatter of the one along y, in pixels."""
    u, v = ffpiv.piv(first, second, window_size=(height, width), overlap=(0, 0), engine="numpy")
    assert not np.isnan(v).any()
    return round(float(np.median(u)), 1), round(float(np.median(v)), 1), round(float(v.std()), 1)


square, tall, wide = displacement(32, 32), displacement(64, 32), displacement(48, 64)
print(f"ffpiv {version('ffpiv')}: displacement along x and y and the scatter along y, in pixels")
print("expected: 3 and 2 in each shape, or an error")
print(f"seen: {square} in windows 32 x 32, {tall} in 64 x 32, {wide} in 48 x 64 (height x width)")
assert abs(square[0] - 3.0) < 0.2 and abs(square[1] - 2.0) < 0.2
assert tall[0] == 3.0 and tall[1] == -15.0 and tall[2] < 1.0, "the behaviour has changed"
assert wide[1] == 11.0, "the behaviour has changed"
PYTHON
