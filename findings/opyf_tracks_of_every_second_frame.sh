#!/bin/sh
# Tracks that opyf follows over every second frame are twice too fast.
#
# Guess:      set_trackingFeatures(step=2) compares frames that are two apart, as set_vecTime(step=2) does, and after
#             scaleData with frames per second both give the velocity of the water.
# Seen:       tracks are divided by the step of set_vecTime, which is 1 unless it was called: water at 0.50 m/s has tracks
#             at 1.00 m/s with a step of 2 and 2.00 with 4. Pairs of images are right. No warning.
# Matters:    slow streams are tracked over every second or fourth frame because grains hardly move in one. Surface
#             velocities of the tracks are then two or four times those of the pairs.
# Documented: no docstring; the printed plan says that tracks compare frames separated by the step.
# Versions:   opyf 1.7, opencv-python-headless 4.12.0.88, vtk 9.5.0, h5py 3.14.0, numpy 2.2.6, scipy 1.16.0,
#             matplotlib 3.10.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    opencv-python-headless==4.12.0.88 vtk==9.5.0 h5py==3.14.0 numpy==2.2.6 scipy==1.16.0 matplotlib==3.10.3 \
    tqdm==4.67.1
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps opyf==1.7
cd "$work"
MPLBACKEND=Agg MPLCONFIGDIR="$work" timeout 200 "$work/venv/bin/python" -W ignore - 2> log <<'PYTHON' || { cat log; exit 1; }
import contextlib
import io
from importlib.metadata import version

import cv2
import numpy as np
import opyf
from scipy.ndimage import gaussian_filter

PIXEL, RATE, FRAMES, SIZE = 0.02, 25.0, 13, 256  # m, 1/s
SPEED = PIXEL * RATE  # m/s, one pixel in each frame
grains = gaussian_filter(np.random.default_rng(1).standard_normal((SIZE, SIZE)), 2.0, mode="wrap")
grains = ((grains - grains.min()) / np.ptp(grains) * 255).astype(np.uint8)
video = cv2.VideoWriter("river.avi", cv2.VideoWriter_fourcc(*"MJPG"), RATE, (SIZE, SIZE))
for frame in range(FRAMES):
    video.write(cv2.cvtColor(np.roll(grains, frame, axis=1), cv2.COLOR_GRAY2BGR))
video.release()


def along(step, tracks):
    """Median velocity along the river in m/s, of tracks or of pairs of images."""
    with contextlib.redirect_stdout(io.StringIO()):
        river = opyf.videoAnalyzer("river.avi", mute=True, display=False)
        if tracks:
            river.set_trackingFeatures(step=step, Ntot=3, track_length=3, detection_interval=3)
        else:
            river.set_vecTime(step=step, Ntot=3)
        river.scaleData(framesPerSecond=RATE, metersPerPx=PIXEL)
        (river.extractTracks if tracks else river.extractGoodFeaturesAndDisplacements)(display=False)
    return round(float(np.median(river.Vdata[-1][:, 0])), 2)


pairs, tracks = ({step: along(step, kind) for step in (1, 2, 4)} for kind in (False, True))
print(f"opyf {version('opyf')}: velocity in m/s of water at {SPEED} m/s, by the step between frames")
print(f"expected: {pairs}, as pairs of images give it")
print(f"seen: {tracks} for tracks")
assert all(abs(one - SPEED) < 0.01 for one in pairs.values())
assert all(abs(one - SPEED * step) < 0.02 for step, one in tracks.items()), "the behaviour has changed"
PYTHON
