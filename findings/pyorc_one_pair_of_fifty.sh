#!/bin/sh
# One good pair of images of fifty is enough for an ensemble velocity of pyorc: the share that is required of the pairs
# is one of the chunks.
#
# Guess:      with ensemble_corr=True and count_min=0.2, the default, a window has a velocity if a fifth of its pairs
#             pass the thresholds of correlation and signal, ten of fifty here.
# Seen:       the number of accepted pairs is compared with 0.2 times the number of chunks in which the film is
#             processed, mostly one. Particles that move in the first pair alone, 48 pairs of noise behind it, have 0.29
#             and 0.20 m/s instead of NaN, and count_min=0.9 lets them pass as well. With less free memory there are
#             more chunks, and the threshold grows.
# Matters:    windows over banks, plants or glare, where a pair in fifty correlates by chance, have a velocity, and
#             enter the discharge as if it were measured.
# Documented: otherwise, "minimum amount of frame pairs ... If less frame pairs are available, the velocity is filtered
#             out".
# Versions:   pyopenrivercam 0.9.10 (its module of velocimetry), ffpiv 0.2.1, numpy 2.2.6, xarray 2025.7.1, pandas
#             2.3.3, numba 0.61.2, pyFFTW 0.15.0.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps \
    pyopenrivercam==0.9.10 ffpiv==0.2.1 numpy==2.2.6 xarray==2025.7.1 pandas==2.3.3 numba==0.61.2 llvmlite==0.44.0 \
    pyFFTW==0.15.0 tqdm==4.67.1 platformdirs==4.3.8 psutil==7.0.0 packaging==25.0 python-dateutil==2.9.0.post0 \
    pytz==2025.2 six==1.17.0
cd "$work"
timeout 600 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import importlib.util
from importlib.metadata import files, version

import numpy as np
import xarray as xr

# The package as a whole imports maps and cameras; its module of velocimetry does without.
place = next(file for file in files("pyopenrivercam") if str(file) == "pyorc/velocimetry/ffpiv.py").locate()
spec = importlib.util.spec_from_file_location("velocimetry", place)
velocimetry = importlib.util.module_from_spec(spec)
spec.loader.exec_module(velocimetry)
draw = np.random.default_rng(1)


def particles():
    """A field of smooth random particles."""
    noise = draw.integers(0, 255, (300, 300)).astype(float)
    near = (-2, -1, 0, 1, 2)
    return sum(np.roll(noise, (i, j), (0, 1)) / (1 + i * i + j * j) for i in near for j in near)


def velocity(moving, **options):
    """Median of both velocities in m/s and the share of NaN: so many of 50 pairs move by 3 and 2 pixels of 1 cm in 0.1 s."""
    field = particles()
    images = [field[140 - 2 * i:268 - 2 * i, 160 - 3 * i:288 - 3 * i] if i <= moving else particles()[:128, :128]
              for i in range(51)]
    frames = xr.DataArray(np.array(images), dims=("time", "y", "x"), coords={"time": np.arange(51) * 0.1})
    steps = xr.DataArray(np.full(50, 0.1), dims="time", coords={"time": frames.time[1:]})
    found = velocimetry.get_ffpiv(frames, np.arange(4), np.arange(4), steps, (32, 32), (0, 0), (32, 32), 0.01, 0.01,
                                  engine="numpy", ensemble_corr=True, **options)
    return [round(float(found[name].median()), 2) for name in ("v_x", "v_y")] + [round(float(np.isnan(found["v_x"]).mean()), 2)]


all_pairs, one, strict = velocity(50), velocity(1), velocity(1, count_min=0.9)
print(f"\npyopenrivercam {version('pyopenrivercam')}: median velocities in m/s and share of windows without one")
print("expected: 0.3 and 0.2 m/s if all 50 pairs move, no velocity if one does")
print(f"seen: {all_pairs}; one pair {one}, with count_min=0.9 {strict}")
assert abs(all_pairs[0] - 0.3) < 0.03 and abs(all_pairs[1] - 0.2) < 0.03
assert one[2] < 0.2 and one[0] > 0.2, "the behaviour has changed"
assert strict[2] < 0.2, "the behaviour has changed"
PYTHON
