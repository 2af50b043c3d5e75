#!/bin/sh
# A Vector record at 8 Hz or more cannot be read; at 1 to 4 Hz it comes back longer than it was measured.
#
# Guess:      a whole binary record of a Nortek Vector gives as many samples as it holds, at any rate.
# Seen:       the number of samples is estimated from the size of the wrong block, 28 bytes for 24. From 8 Hz on the
#             arrays are too short (IndexError). Below, they are too long: 60 samples at 1 Hz become 112, with
#             times that go on, velocities of NaN and correlations of 0. nens= reads a fast record, and pads too.
# Matters:    turbulence is measured at 16 to 64 Hz. With a large nens as the way out, the length of the record, the
#             share of rejected samples and the integral time scales are wrong.
# Documented: the docstring of nens promises to read so many samples; dolfyn issue 123 is a Vector file that raises
#             while the example with an inertial sensor is read.
# Versions:   mhkit 1.1.2 (its module dolfyn, without the rest of its dependencies), numpy 2.3.1, xarray 2025.7.1.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    numpy==2.3.1 scipy==1.16.0 pandas==2.3.3 xarray==2025.7.1 matplotlib==3.10.3
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check --no-deps mhkit==1.1.2
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
import logging
import struct
from importlib.metadata import version

import numpy as np

logging.disable(logging.CRITICAL)
import mhkit.dolfyn as dolfyn


def summed(block):
    """The block with its check sum."""
    words = struct.unpack(f"<{len(block) // 2}H", block)
    return block + struct.pack("<H", (0xB58C + sum(words)) & 0xFFFF)


def named(name, body, size):
    """A block with its name and its size in words."""
    return summed(struct.pack("<BBH", 0xA5, name, size // 2) + body.ljust(size - 6, b"\0"))


def record(seconds, rate):
    """A continuous record in XYZ axes: three blocks of settings, a header, each second a state and samples."""
    user = bytearray(506)
    struct.pack_into("<H", user, 12, 512 // rate)  # time between samples in 1/512 s
    struct.pack_into("<2H", user, 28, 1, 1)  # XYZ, one cell
    day = bytes([0x03, 0x10, 0x20, 0x06])  # 3 June 2020, 10 h, in binary coded decimals
    blocks = [named(0x05, b"VEC 1234" + bytes(28) + b"3.35", 48), named(0x04, b"", 224), named(0x00, bytes(user), 512),
              named(0x12, bytes(2) + day, 42)]
    for second in range(seconds):
        state = bytes([0, 16 * (second // 10) + second % 10]) + day
        blocks.append(named(0x11, state + struct.pack("<2H3hhBBH", 120, 14800, 0, 0, 0, 1450, 0, 0, 0), 28))
        sample = struct.pack("<4B2H3h6B", 0, 0, 0, 0, 0, 0, 300, 20, 0, 90, 90, 90, 95, 95, 95)
        blocks += [summed(bytes([0xA5, 0x10]) + sample)] * rate
    return b"".join(blocks)


def samples(rate, nens=None):
    """Samples that come back from 60 s, and how many of them have a velocity."""
    with open("probe.vec", "wb") as file:
        file.write(record(60, rate))
    try:
        data = dolfyn.read("probe.vec", nens=nens)
    except IndexError:
        return "IndexError"
    return data.sizes["time"], int(np.isfinite(data.vel.values[0]).sum())


seen = {f"{rate} Hz": samples(rate) for rate in (1, 4, 8, 32)}
helped = samples(32, 1920), samples(32, 2500)
print(f"mhkit {version('mhkit')}: 60 s at 1, 4, 8 and 32 Hz; samples, and samples with a velocity")
print("expected: 60, 240, 480 and 1920")
print(f"seen: {seen}; 32 Hz with nens=1920 {helped[0]}, with nens=2500 {helped[1]}")
assert helped[0] == (1920, 1920)
assert seen["8 Hz"] == seen["32 Hz"] == "IndexError", "the behaviour has changed"
assert seen["1 Hz"] == (112, 60) and helped[1] == (2500, 1920), "the behaviour has changed"
PYTHON
