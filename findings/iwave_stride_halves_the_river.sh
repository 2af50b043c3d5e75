#!/bin/sh
# A video that IWaVE reads with stride=2 has half of its velocities.
#
# Guess:      read_video(stride=2), "lower the sampling rate by this factor", keeps every second frame, or every second
#             pixel; the library adapts its frame rate or resolution, and the velocity stays.
# Seen:       every second pixel is kept of every frame, and the resolution that was given stays: a surface at 0.50 m/s
#             moves at 0.25 m/s. With twice the resolution, given by hand, it is 0.50. No warning.
# Matters:    a long 4K video that is thinned to fit the memory gives half of the discharge, and waves half as long, from
#             which the depth is found.
# Documented: the docstring has the words above and no more, in the method and in the function that reads.
# Versions:   iwave 0.4.0, opencv-python-headless 4.12.0.88, numba 0.61.2, numexpr 2.11.0, rocket-fft 0.2.5, numpy 2.2.6,
#             scipy 1.16.0, matplotlib 3.10.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    opencv-python-headless==4.12.0.88 numba==0.61.2 numexpr==2.11.0 rocket-fft==0.2.5 numpy==2.2.6 scipy==1.16.0 \
    matplotlib==3.10.3 tqdm==4.67.1
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps iwave==0.4.0
cd "$work"
cat > river.py <<'PYTHON'
import contextlib
import io
from importlib.metadata import version

import cv2
import numpy as np
from iwave import Iwave
from scipy.ndimage import gaussian_filter

PIXEL, RATE, FRAMES, SIZE = 0.02, 25.0, 32, 64  # m, 1/s
SPEED = PIXEL * RATE  # m/s, one pixel in each frame


def film():
    grains = gaussian_filter(np.random.default_rng(1).standard_normal((SIZE, SIZE)), 2.5, mode="wrap")
    grains = ((grains - grains.min()) / np.ptp(grains) * 255).astype(np.uint8)
    video = cv2.VideoWriter("river.avi", cv2.VideoWriter_fourcc(*"MJPG"), RATE, (SIZE, SIZE))
    for frame in range(FRAMES):
        video.write(cv2.cvtColor(np.roll(grains, frame, axis=1), cv2.COLOR_GRAY2BGR))
    video.release()


def surface(stride, resolution=PIXEL):
    """Velocity of the surface in m/s in one window over the whole image, without waves."""
    camera = Iwave(resolution, window_size=(SIZE // stride, SIZE // stride), time_size=FRAMES, smax=1.0)
    with contextlib.redirect_stdout(io.StringIO()):
        camera.read_video("river.avi", end_frame=FRAMES, stride=stride)
        camera.velocimetry(gravity_waves_switch=False, seed=1, workers=1, popsize=8, maxiter=60)
    return round(float(camera.vx[0, 0]), 2)


if __name__ == "__main__":
    film()
    whole, thinned, twice_pixel = surface(1), surface(2), surface(2, resolution=2 * PIXEL)
    print(f"iwave {version('iwave')}: velocity of a surface that moves at {SPEED} m/s")
    print(f"expected: {whole} with stride=2, too")
    print(f"seen: {thinned}; {twice_pixel} with twice the resolution")
    assert abs(whole - SPEED) < 0.02 and abs(twice_pixel - SPEED) < 0.04
    assert abs(thinned - SPEED / 2) < 0.02, "the behaviour has changed"
PYTHON
OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1 timeout 600 "$work/venv/bin/python" \
    -W ignore river.py 2> log || { cat log; exit 1; }
