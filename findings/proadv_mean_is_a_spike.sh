#!/bin/sh
# ProADV takes the mean velocity for turbulence: of a record without spikes nearly all samples are spikes.
#
# Guess:      phase-space thresholding takes a record as measured and subtracts its mean, as velocity_correlation of the
#             same package does and as the method of Goring and Nikora begins.
# Seen:       it does not subtract it. Of 3,000 samples of clean turbulence of 5 cm/s three are spikes around 0 cm/s,
#             1,600 around 20 cm/s and nearly all around 30 cm/s. The "premodification", which is to replace
#             spikes first, replaces none of ten of 80 cm/s: it looks for samples above one limit and below its negative.
# Matters:    with its functions of replacement a record is interpolated from the few samples near 0. Its variance falls,
#             and the mean with it, and nothing says that the record was sound.
# Documented: the docstring asks for the "velocity component"; the examples in the repository subtract the mean.
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
from proadv.filtration.detection.correlation import velocity_correlation
from proadv.filtration.detection.phasespace import phasespace_thresholding, phasespace_thresholding_premodification

SAMPLES = 3000
random = np.random.default_rng(1)


def turbulence():
    """Correlated fluctuations of 5 cm/s around 0, as of a probe at some 25 Hz."""
    eddies = np.zeros(SAMPLES)
    for sample, push in enumerate(random.normal(size=SAMPLES - 1), start=1):
        eddies[sample] = 0.9 * eddies[sample - 1] + push
    return 5.0 * eddies / eddies.std()


u, v, w = turbulence(), turbulence(), turbulence()
found = {mean: int(phasespace_thresholding(mean + u).size) for mean in (0, 20, 30)}
correlated = {mean: int(velocity_correlation(mean + u, v, w).size) for mean in (0, 20, 30)}
spiked = u.copy()
spiked[np.arange(1, 11) * SAMPLES // 11] += 80.0 * (-1.0) ** np.arange(10)
replaced = int((phasespace_thresholding_premodification(spiked.copy())[0] != spiked).sum())
print(f"proadv {version('proadv')}: spikes found in {SAMPLES} clean samples, by mean velocity in cm/s")
print(f"expected: one number for all means, as of velocity_correlation {correlated}; 10 of 10 spikes replaced")
print(f"seen: {found}; {replaced} of 10 spikes replaced")
assert len(set(correlated.values())) == 1
assert found[0] < 10 and found[20] > SAMPLES // 3 and found[30] > 0.9 * SAMPLES, "the behaviour has changed"
assert replaced == 0, "the behaviour has changed"
PYTHON
