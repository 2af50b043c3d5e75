"""Steady flows of the second solver: Newton's steps, smoothed by explicit ones, until explicit steps change nothing.

Which steps lead there does not matter: a flow is steady when explicit steps, of which `second_solver` is made, say so.
"""

from collections.abc import Sequence

import numpy as np
from second_newton import imbalance, newton_of
from second_solver import Ends, Flow, Reach, march

# Steady: velocities and depths change by less [m/s2]. What is left fades by e in some 40 s, so that it is 2e-4 m/s.
STEADY, LONGEST = 4e-6, 2000.0
LOOK_EVERY = 200
# Where water is shallower [m] it is not judged: nobody measures there.
JUDGED = 0.15
# Newton's steps with the same slopes, explicit steps after each of them, and rounds with slopes anew: found by trying,
# on two sites with four flows. With fewer explicit steps the waterline rings.
STEPS, SMOOTHING, ROUNDS = 4, 20, 5
# Where cells at the waterline fall dry and wet without end, the flow beside them flickers by some 1e-3 m/s. What
# instruments show is its mean, here that of so many looks (40 s or more), once two such means are this close [m/s].
WINDOW, SAME = 8, 1e-4


def steady(reach: Reach, ends: Ends, start: Flow, change: float = STEADY) -> Flow:
    """The steady flow, or the mean of one that flickers; RuntimeError if neither is reached."""
    flow, passed, seen = start, 0.0, list[Flow]()
    while passed < LONGEST:
        flow = leapt(reach, ends, flow) if len(seen) < ROUNDS else flow
        after, seconds = march(reach, ends, flow, LOOK_EVERY)
        passed += seconds
        moved = _change(flow, after) / seconds
        flow, seen = after, [*seen[-ROUNDS - 2 * WINDOW :], after]
        if not np.isfinite(moved):
            break
        if moved < change:
            return flow
        if len(seen) > ROUNDS + 2 * WINDOW:
            before, last = _mean(seen[-2 * WINDOW : -WINDOW]), _mean(seen[-WINDOW:])
            if _change(before, last) < SAME:
                return last
    raise RuntimeError(f"no steady flow after {passed:.0f} s, it changed by {moved:.1e} m/s2")


def _mean(flows: Sequence[Flow]) -> Flow:
    """Depths and velocities on average."""
    return Flow(*(np.mean([getattr(one, name) for one in flows], axis=0) for name in ("h", "u", "v")))


def leapt(reach: Reach, ends: Ends, flow: Flow) -> Flow:
    """A flow nearer to the steady one; the same where Newton's steps lead away from it."""
    try:
        step = newton_of(reach, ends, flow)
    except RuntimeError:  # singular
        return flow
    near = flow
    for _ in range(STEPS):
        near, _ = march(reach, ends, step(near), SMOOTHING)
    return near if _unrest(reach, ends, near) < _unrest(reach, ends, flow) else flow


def _change(before: Flow, after: Flow) -> float:
    """Largest change of a velocity or a depth where water is deep enough [m/s, m]; no number where one is none."""
    deep = ~(after.h <= JUDGED)
    moved = [np.abs(new - old)[deep].max(initial=0.0) for old, new in ((before.u, after.u), (before.h, after.h))]
    return float(np.max(moved)) if deep.any() else np.inf


def _unrest(reach: Reach, ends: Ends, flow: Flow) -> float:
    """Root mean square of rates; infinite where they are no numbers."""
    mean = float(np.sqrt(np.mean(imbalance(reach, ends, flow) ** 2)))
    return mean if np.isfinite(mean) else np.inf
