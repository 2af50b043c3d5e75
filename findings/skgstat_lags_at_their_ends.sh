#!/bin/sh
# scikit-gstat plots and fits the semivariance of a lag at its far end, half a lag too far.
#
# Guess:      the semivariance of all pairs 0 to 10 m apart stands at their mean distance or in the middle, 5 m.
# Seen:       it stands at 10 m, in the plot and in the fit. On a plane bed of slope 1, where it is h^2/2 exactly, 10 m
#             has 16 m2 instead of 50 m2. For six fields with a spherical range of 40 m and lags of 20 m the mean of the
#             fitted ranges is 53 m; the same semivariances at the mean distances of their pairs give 37 m.
# Matters:    a kriged bed that is smoother than the survey, the more so the fewer and wider the lags.
# Documented: "bins" are upper edges, and get_empirical(bin_center=True) gives the middles. No option to fit to them,
#             or to mean distances, was found.
# Versions:   scikit-gstat 1.0.26, gstools 1.7.0, numpy 2.3.1, scipy 1.16.0, pandas 2.3.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    scikit-gstat==1.0.26 gstools==1.7.0 numpy==2.3.1 scipy==1.16.0 pandas==2.3.3
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import gstools
import numpy as np
from scipy.optimize import curve_fit
from skgstat import Variogram
from skgstat.models import spherical

places = np.arange(200.0)
plane = Variogram(places, places, maxlag=40.0, n_lags=4)
pair = np.round(float(plane.bins[0]), 1), np.round(float(plane.experimental[0]), 1)

x, y = np.random.default_rng(1).uniform(0.0, 400.0, (2, 800))
ranges = []
for seed in range(6):
    bed = gstools.SRF(gstools.Spherical(dim=2, var=1.0, len_scale=40.0), seed=seed)((x, y))
    survey = Variogram(np.c_[x, y], bed, model="spherical", maxlag=120.0, n_lags=6)
    means = [survey.distance[survey.lag_groups() == lag].mean() for lag in range(6)]
    again = curve_fit(spherical, means, survey.experimental, p0=survey.parameters[:2])[0]
    ranges.append((float(survey.parameters[0]), float(again[0])))
own, at_means = np.mean(ranges, axis=0)
print(f"scikit-gstat {version('scikit-gstat')}: plane bed of slope 1, lags of 10 m; field of range 40 m, lags of 20 m")
print("expected: semivariance 16 m2 at 5 m or so (50 m2 at 10 m); one fitted range")
print(f"seen: semivariance {pair[1]} m2 at {pair[0]} m")
print(f"seen: fitted range {own:.1f} m; from the same semivariances at the mean distances {at_means:.1f} m")
assert pair == (10.0, 15.7), "the behaviour has changed"
assert own > 50.0 and 35.0 < at_means < 45.0, "the behaviour has changed"
PYTHON
