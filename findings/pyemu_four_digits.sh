#!/bin/sh
# pyEMU writes four digits of a parameter into a model's input unless the marker is wider than 15 letters.
#
# Guess:      a value gets all digits that fit its field, as the manual of PEST describes, and never more letters than
#             the field has.
# Seen:       fields of up to 15 letters get four digits, wider ones seven. A narrow field is overrun: "~n~" becomes
#             nine letters and moves the columns after it.
# Matters:    increments of 0.01 % for finite differences are mostly lost in the input, so slopes come out as zero;
#             with 1 % the slope of a roughness of 0.03456 is off by up to 3 %. Fixed-width inputs read wrong columns.
# Documented: not in the documentation of write_to_template; no public thread found.
# Versions:   pyemu 1.7.0, numpy 2.3.1, pandas 2.3.3.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-python3}" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install -qq --no-compile --disable-pip-version-check \
    pyemu==1.7.0 numpy==2.3.1 pandas==2.3.3
cd "$work"
timeout 100 "$work/venv/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import pyemu


def written(field, value):
    """The line of the model's input for one parameter in a field."""
    with open("bed.tpl", "w") as file:
        file.write(f"ptf ~\nn{field}|\n")
    pyemu.pst_utils.write_to_template({"n": value}, "bed.tpl", "bed.in")
    with open("bed.in") as file:
        return file.read().rstrip("\n")


base, moved = 0.0345678, 0.0345678 * 1.0001
field = "~     n      ~"  # 14 letters: room for eight digits
lines = written(field, base), written(field, moved)
narrow, wide = written("~n~", base), written("~         n         ~", base)
print(f"pyemu {version('pyemu')}: parameter {base} and the same with an increment of 0.01 %, a field of 14 letters")
print("expected: two different numbers; a number of three letters in a field of three letters")
print(f"seen: {lines}; in three letters {narrow!r}; in 21 letters {wide!r}")
assert float(wide[1:-1]) == 3.456780e-2
assert lines[0] == lines[1] and float(lines[0][1:-1]) == 3.457e-2, "the behaviour has changed"
assert len(narrow) > len("n~n~|"), "the behaviour has changed"
PYTHON
