#!/bin/sh
# ProADV finds no spike in a record in m/s, and fills three spikes in a row with a spike.
#
# Guess:      the threshold of acceleration, given as gravity in "m/s^2", fits velocities in m/s; a spike is
#             replaced from samples that are no spikes.
# Seen:       the default of gravity is 980. All ten spikes of 80 cm/s are found in cm/s, none in m/s. The cubic of twelve
#             points takes the samples before a spike from the record as measured: of three spikes of 1000 cm/s in
#             a row on a ramp through 100, 101 and 102 cm/s the third becomes 773 cm/s. A single one becomes 99.5 cm/s, as the
#             sample just before it is left out and the others move up. Linear interpolation gives 100 to 102 cm/s.
# Matters:    makers of probes export m/s. The filter reports a clean record, whose variance and stress keep the spikes.
# Documented: otherwise, by the unit of the default. The notes on the cubic speak of neighbouring data points.
# Versions:   proadv 2.1.8, numpy 2.3.1, scipy 1.16.0, scikit-learn 1.7.0, fastkde 2.1.5.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    proadv==2.1.8 numpy==2.3.1 scipy==1.16.0 scikit-learn==1.7.0 fastkde==2.1.5
cd "$work"
timeout 200 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from proadv.filtration.detection.acceleration import acceleration_thresholding
from proadv.filtration.replacement.replacements import cubic_12points_polynomial, linear_interpolation

SAMPLES, RATE = 3000, 25.0  # -, Hz
UP, DOWN = 1, 2  # the tags of the library
random = np.random.default_rng(1)
record = 30.0 + random.normal(0.0, 5.0, SAMPLES)  # cm/s
places = np.arange(1, 11) * SAMPLES // 11
record[places] += 80.0 * (-1.0) ** np.arange(10)


def found(velocities):
    flagged = np.concatenate([acceleration_thresholding(velocities, RATE, tag) for tag in (UP, DOWN)])
    return int(np.isin(places, flagged).sum())


def filled(replace, *spikes):
    """A ramp of 1 cm/s per sample, with spikes of 1000 cm/s that are replaced."""
    ramp = np.arange(200.0)
    ramp[list(spikes)] = 1000.0
    return replace(ramp, np.array(spikes))[list(spikes)].round(1).tolist()


seen = {"cm/s": found(record), "m/s": found(record / 100.0)}
single, three = filled(cubic_12points_polynomial, 100), filled(cubic_12points_polynomial, 100, 101, 102)
print(f"proadv {version('proadv')}: ten spikes of 80 cm/s; spikes on a ramp through 100, 101 and 102 cm/s")
print(f"expected: 10 found in either unit; {filled(linear_interpolation, 100, 101, 102)}")
print(f"seen: {seen} found; {single} for one spike, {three} for three in a row")
assert filled(linear_interpolation, 100, 101, 102) == [100.0, 101.0, 102.0]
assert seen == {"cm/s": 10, "m/s": 0}, "the behaviour has changed"
assert single == [99.5] and three[2] > 500.0, "the behaviour has changed"
PYTHON
