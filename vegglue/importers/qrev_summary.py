"""Discharges as QRev writes them beside its measurements, *_QRev.xml.

Format: the summary of QRev of the U.S. Geological Survey: ChannelSummary with Discharge/Total and its unit, and
Uncertainty/Total, that of 95 % in percent.
"""

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from vegglue.errors import InputError, shown_path
from vegglue.importers.file_words import FileWords
from vegglue.importers.loose_table import readable_text
from vegglue.importers.measured_rows import MeasuredRows
from vegglue.importers.unit_words import si_factor

STANDARD_ERRORS = 2.0  # in an uncertainty of 95 %, as QRev has it
DECLARED = re.compile(r"^\s*<\?xml[^>]*\?>")  # the bytes are decoded already
ENTITIES = re.compile(r"<!(DOCTYPE|ENTITY)")  # QRev writes none, and some unpack to more than the memory


def is_qrev_summary(text: str) -> bool:
    """Whether a text is such a summary."""
    return "<Channel QRev" in text[:500]


def read_qrev_summary(path: Path, words: FileWords) -> MeasuredRows:
    """The discharge of all transects and its standard error, at `start`. Errors: InputError naming the file."""
    if words.start is None:
        raise InputError(
            f"{shown_path(path)}: expected where the boat started, `start: [x, y]`, which no summary says; add it to "
            "this file in `files`."
        )
    discharge, error, unit = _total(path)
    x, y = words.start
    numbers = {"x": x, "y": y, "discharge": discharge, "discharge_se": error}
    said = (f"QRev summary, standard error {error:.2g} m3/s",)
    columns, units = {"discharge": "ChannelSummary/Discharge/Total"}, {"discharge": unit}
    return MeasuredRows({role: np.array([one]) for role, one in numbers.items()}, {}, columns, units, said)


def _total(path: Path) -> tuple[float, float, str]:
    """Discharge and its standard error [m3/s], and the unit of the file."""
    text = readable_text(path)
    try:
        if ENTITIES.search(text):
            raise ValueError("definitions of entities")
        summary = ElementTree.fromstring(DECLARED.sub("", text))
        total = summary.find("ChannelSummary/Discharge/Total")
        if total is None:
            raise ValueError("none")
        unit = total.get("unitsCode", "cms")
        discharge = float(total.text or "")
        share = float(summary.findtext("ChannelSummary/Uncertainty/Total") or "nan") / 100.0
    except (ElementTree.ParseError, ValueError) as error:
        raise InputError(
            f"{shown_path(path)}: expected ChannelSummary/Discharge/Total of a summary by QRev, got {error}; save it "
            "anew in QRev."
        ) from None
    discharge *= si_factor(unit, "discharge", shown_path(path))
    return discharge, abs(discharge) * share / STANDARD_ERRORS, unit
