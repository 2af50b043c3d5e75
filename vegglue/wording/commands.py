"""Help of the options, and how commands end, from commands.toml: read at once, as help waits for nothing heavy."""

import tomllib
from pathlib import Path

_TEXTS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
HELP: dict[str, str] = _TEXTS["help"]
DEMO: dict[str, str] = _TEXTS["demo"]
LAST_WORDS: dict[str, str] = _TEXTS["endings"]
