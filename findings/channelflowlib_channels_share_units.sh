#!/bin/sh
# Two channels of channelflowlib share their unit and their unknown: a second one in feet turns the first one to feet.
#
# Guess:      Rectangular(unknown="discharge", unit="metric") keeps what it was given, as every object does.
# Seen:       unit and unknown are kept in one dictionary of the class. After a channel in feet has been made, the
#             flume in metres reports 36.6 instead of 1.04 m3/s and a width of 16.4 instead of 5 m, and its next depth
#             is taken for feet. The unknown changes as well: the first channel is solved for what the second one asks.
#             No error.
# Matters:    a flume and its prototype, or two reaches of a river, in one script: the later one decides the units of
#             both.
# Documented: the examples make one channel each.
# Versions:   channelflowlib 0.9.2.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check channelflowlib==0.9.2
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

from channelflowlib.openchannellib import Rectangular


def reach():
    """5 m wide, 0.4 m deep, slope 0.001, n = 0.03; its discharge is unknown."""
    channel = Rectangular(unknown="discharge", unit="metric")
    channel.set_channel_base(5.0)
    channel.set_water_depth(0.4)
    channel.set_channel_slope(0.001)
    channel.set_roughness(0.03)
    return channel


expected = 5.0 * 0.4 * (2.0 / 5.8) ** (2.0 / 3.0) * 0.001**0.5 / 0.03
channel = reach()
channel.analyze()
seen = {"alone": (channel.get_discharge(), channel.get_channel_base())}
Rectangular(unknown="water_depth", unit="english")
seen["beside one in feet"] = (channel.get_discharge(), channel.get_channel_base())
channel.set_discharge(2.0)
channel.analyze()
seen["solved again"] = (channel.discharge, round(channel.water_depth, 2))
print(f"channelflowlib {version('channelflowlib')}: discharge in m3/s and width in m of one channel")
print(f"expected: {expected:.3f} and 5.0, whatever other channels there are; solved again for its discharge")
print(f"seen: {seen}")
assert abs(seen["alone"][0] - expected) < 0.001
assert seen["beside one in feet"] == (36.582, 16.4), "the behaviour has changed"
assert seen["solved again"][0] < 0.06, "the behaviour has changed"
PYTHON
