"""The answer of a twin: everything that is true of it, sealed as text that nobody reads at a glance."""

import base64
import json
import re
import zlib
from dataclasses import asdict, dataclass
from pathlib import Path

from vegglue.case.text_files import LARGEST_JSON, read_text
from vegglue.errors import InputError

UNLISTED, BAD_PROBE, NOTHING_HIDDEN, ANY = "unlisted:", "bad_probe", "nothing", "?"


@dataclass(frozen=True)
class Hidden:
    """One thing that is hidden, in the unit of its amplitude (a bad probe in standard errors).

    signal: its visibility on the model's grid [standard errors]; station: row of a bad probe, else -1.
    """

    name: str
    amplitude: float
    shapes: dict[str, float]
    signal: float
    station: int = -1

    @property
    def listed(self) -> bool:
        """Whether it is an effect of the library: neither something unlisted nor a bad probe."""
        return not self.name.startswith(UNLISTED) and self.name != BAD_PROBE


@dataclass(frozen=True)
class Answer:
    """What is true: everything hidden, the parameters, and the errors.

    correlation: of neighbours along a section [-]; scale: true over stated errors [-].
    """

    hidden: tuple[Hidden, ...]
    parameters: dict[str, float]
    correlation: float
    scale: float
    seed: int


def sealed_answer(answer: Answer) -> str:
    """The answer as text that nobody reads at a glance."""
    packed = base64.b64encode(zlib.compress(json.dumps(asdict(answer)).encode())).decode()
    return "\n".join(["# Sealed by `vegglue twin`; `vegglue reveal` opens it.", *re.findall(r".{1,76}", packed), ""])


def opened_answer(path: Path) -> Answer:
    """The answer in a file. Errors: InputError when there is no seal, or it is broken."""
    lines = read_text(path, LARGEST_JSON, "`vegglue twin` writes it").splitlines()
    try:
        # What is packed may claim to be of any size.
        unpacked = zlib.decompressobj().decompress(base64.b64decode("".join(lines[1:])), LARGEST_JSON)
        told = json.loads(unpacked)
        return Answer(**told | {"hidden": tuple(Hidden(**one) for one in told["hidden"])})
    except (ValueError, KeyError, TypeError, RecursionError, zlib.error):
        raise InputError(f"{path}: the seal is broken, make it again by `vegglue twin`.") from None
