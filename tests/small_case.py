"""A small case as text, written as it is or changed into the folder that a test stands in."""

from pathlib import Path

SMALL = """
name: small
grid: {x: [0, 40], y: [-4, 4], cell: [1.0, 0.5]}
bed:
  - trapezoid: {axis: 0.0, bottom_width: 3.0, bank_slope: 0.6667, bed_slope: 0.001, level: 0.0}
friction:
  classes:
    bed: {law: manning, n: n_b}
    bank: {law: keulegan, k_s: 1.0}
  default: bed
  zones:
    - {class: bank, steeper_than: 0.2}
plants:
  stands:
    reed: {phi: phi, canopy_height: 0.8, stems: 22}
  patches:
    - {name: p1, stand: reed, x: [10, 14], y: [0, 1.5], stems: 22}
inflows:
  upstream: {side: west}
experiments:
  low: {discharge: 2.66, level: 0.9}
parameters:
  n_b: {distribution: uniform, low: 0.01, high: 0.15, unit: s m^(-1/3)}
  phi: {distribution: loguniform, low: 0.01, high: 100, unit: "-"}
"""


def write(text: str, name: str = "small.yaml") -> Path:
    path = Path(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def changed(old: str, new: str) -> Path:
    assert old in SMALL
    return write(SMALL.replace(old, new, 1))
