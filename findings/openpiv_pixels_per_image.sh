#!/bin/sh
# With the time step and the scale in its settings OpenPIV's simple_multipass returns pixels per image all the same.
#
# Guess:      PIVSettings(dt=0.02, scaling_factor=100) make the velocities m/s, as they do in windef.piv. A function that
#             returns transformed coordinates leaves those that it was given as they were.
# Seen:       particles that move 3 pixels to the right and 2 down have (3.0, -2.0), with these settings and without them,
#             in the place of (1.5, -1.0) m/s. transform_coordinates returns a turned y and turns the sign of the v that
#             it was given: the caller's y still counts downwards, its v upwards, and a second call restores the
#             direction of the image.
# Matters:    3.0 is a plausible velocity in m/s of a river. Run twice in a notebook, a plume that sinks behind plants rises.
# Documented: the settings are; that this function does not use them is not said. The docstring of transform_coordinates
#             gives both systems and no word on its arguments.
# Versions:   openpiv 0.26.1, numpy 2.3.1, scipy 1.16.0, scikit-image 0.25.2, imageio 2.37.0, matplotlib 3.10.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    openpiv==0.26.1 numpy==2.3.1 scipy==1.16.0 scikit-image==0.25.2 imageio==2.37.0 matplotlib==3.10.3
cd "$work"
MPLBACKEND=Agg MPLCONFIGDIR="$work" timeout 300 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import contextlib
import io
from importlib.metadata import version

import numpy as np
from openpiv import pyprocess, tools, windef

RIGHT, DOWN, SIDE = 3.0, 2.0, 128  # pixels
random = np.random.default_rng(1)
rows, columns = np.mgrid[:SIDE, :SIDE]
particles = random.uniform(0.0, SIDE, (400, 2))


def image(places):
    """Particles of about 2.5 pixels; row 0 is the top."""
    light = sum(np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / 3.0) for x, y in places)
    return np.clip(200.0 * light, 0, 255).astype(np.int32)


before, after = image(particles), image(particles + [RIGHT, DOWN])


def velocity(**settings):
    given = windef.PIVSettings(windowsizes=(32, 32), overlap=(16, 16), num_iterations=2, **settings)
    with contextlib.redirect_stdout(io.StringIO()):
        _, _, u, v, _ = windef.simple_multipass(before, after, given)
    return round(float(np.median(u)), 1) + 0.0, round(float(np.median(v)), 1) + 0.0


plain, scaled = velocity(), velocity(dt=0.02, scaling_factor=100.0)
u, v, _ = pyprocess.extended_search_area_piv(before, after, window_size=32, overlap=16, search_area_size=48)
x, y = pyprocess.get_coordinates(before.shape, 48, 16)
top, fall = float(y[0, 0]), float(np.median(v))
tools.transform_coordinates(x, y, u, v)
kept, turned = float(y[0, 0]), float(np.median(v))
_, _, _, again = tools.transform_coordinates(x, y, u, v)
print(f"openpiv {version('openpiv')}: {RIGHT:g} pixels to the right and {DOWN:g} down in 0.02 s, 100 pixels are 1 m")
print("expected: (1.5, -1.0) m/s; the given y and v unchanged by transform_coordinates")
print(f"seen: {scaled} with dt and scale, {plain} without")
print(f"seen: first y {top:g} and {kept:g}; v {fall:.1f}, then {turned:.1f}, and {np.median(again):.1f} by a second call")
assert plain == scaled == (3.0, -2.0), "the behaviour has changed"
assert abs(fall - DOWN) < 0.1 and kept == top, "the behaviour has changed"
assert abs(turned + DOWN) < 0.1 and abs(float(np.median(again)) - DOWN) < 0.1, "the behaviour has changed"
PYTHON
