#!/bin/sh
# The elementary effects of SALib are per range by Morris and per unit by the radial design: mu* changes with the unit.
#
# Guess:      mu* of the two designs is one measure, so that both rank the parameters alike and m3/s or l/s make no
#             difference, as the steps are shares of the range (Morris; Campolongo et al.).
# Seen:       the depth of a channel for a roughness of 0.030 to 0.034 and a discharge of 2 to 4 m3/s: by Morris mu* of
#             the discharge is 5 times as large, by radial_ee that of the roughness 90 times. With the discharge in l/s
#             Morris gives the same and radial_ee 90,000 times.
# Matters:    a screening that keeps the roughness and drops the discharge because the roughness is a small number.
# Documented: the docstring of radial_ee names elementary effects without their unit; no page compares the two.
# Versions:   SALib 1.6.0, numpy 2.3.1, scipy 1.16.0, pandas 2.3.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    SALib==1.6.0 numpy==2.3.1 scipy==1.16.0 pandas==2.3.3
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from SALib.analyze import morris, radial_ee
from SALib.sample import morris as trajectories
from SALib.sample import radial

SETS = 256


def effects(litres):
    """mu* of roughness and discharge for the normal depth of a channel 5 m wide, by Morris and by the radial design."""
    scale = 1000.0 if litres else 1.0
    problem = {"num_vars": 2, "names": ["n", "Q"], "bounds": [[0.030, 0.034], [2.0 * scale, 4.0 * scale]]}

    def depth(values):
        return (values[:, 0] * values[:, 1] / scale / (5.0 * np.sqrt(0.001))) ** 0.6

    steps, star = trajectories.sample(problem, SETS, seed=1), radial.sample(problem, SETS, seed=1)
    by_morris = morris.analyze(problem, steps, depth(steps), seed=1)["mu_star"]
    by_radial = radial_ee.analyze(problem, star, depth(star), SETS, seed=1)["mu_star"]
    return [np.asarray(one, float) for one in (by_morris, by_radial)], np.diff(problem["bounds"]).ravel()


def slope(parameter):
    """Mean change of the depth over the range of a parameter, the other at its middle."""
    middle, ends = [0.032, 3.0], ([0.030, 0.034], [2.0, 4.0])[parameter]
    low, high = ([end if i == parameter else middle[i] for i in (0, 1)] for end in ends)
    return float(abs(np.subtract(*((np.prod(one) / (5.0 * np.sqrt(0.001))) ** 0.6 for one in (high, low)))))


expected = np.array([slope(0), slope(1)])
print(f"SALib {version('SALib')}: depth for a roughness of 0.030 to 0.034 and a discharge of 2 to 4 m3/s")
print(f"expected: change of the depth over each range {np.round(expected, 3)} m")
for litres in (False, True):
    (by_morris, by_radial), width = effects(litres)
    print(f"seen, discharge in {'l/s' if litres else 'm3/s'}: mu* by Morris {np.round(by_morris, 3)},"
          f" by radial_ee {np.array2string(by_radial, precision=2)}")
    assert np.allclose(by_morris, expected, rtol=0.05)
    assert np.allclose(by_radial * width, expected, rtol=0.05), "the behaviour has changed"
    assert by_morris[1] > 4.0 * by_morris[0] and by_radial[0] > 50.0 * by_radial[1], "the behaviour has changed"
PYTHON
