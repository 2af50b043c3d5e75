"""How a command prints: lines, tables, or one JSON object; colour on a terminal only, none where NO_COLOR is set."""

import json
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vegglue.cli.options import RUNS
from vegglue.errors import shell_line
from vegglue.plain_json import plain

if TYPE_CHECKING:
    from rich.console import Console


# Letters of a line in a file or a pipe, where nothing has to be left out.
WIDEST = 1000
# Spaces between two columns of a table.
COLUMN_GAP = 2


def command_line(verb: str, *arguments: object, runs: Path = RUNS, trust: bool = False) -> str:
    """A command that can be copied, with the options that the one before was given."""
    options = [*(["--runs", str(runs)] if runs != RUNS else []), *(["--trust"] if trust else [])]
    return shell_line(["vegglue", verb, *map(str, arguments), *options])


@cache
def console(errors: bool = False) -> "Console":
    """Standard output or error, for tables and what moves; into a file or a pipe, lines as long as they need to be."""
    from rich.console import Console

    width = None if (sys.stderr if errors else sys.stdout).isatty() else WIDEST
    # Names such as `discharge_error[high]` are no markup.
    return Console(stderr=errors, highlight=False, soft_wrap=True, markup=False, width=width)


def print_table(headings: Sequence[str], rows: Sequence[Sequence[str]], kept: Sequence[str]) -> None:
    """Print a table, its first column to the left; where the window is narrow without the columns that matter least.

    kept: the headings beside the first that matter most, which go last. A name is never cut off.
    """
    from rich.table import Table

    left_out, screen = left_out_of(headings, rows, kept, console().width), console()
    table = Table(box=None, pad_edge=False, header_style="bold")
    shown = [place for place, heading in enumerate(headings) if heading not in left_out]
    for place in shown:
        table.add_column(headings[place], justify="right" if place else "left", no_wrap=True)
    for row in rows:
        table.add_row(*(row[place] for place in shown))
    screen.print(table)
    if left_out:
        screen.print(f"No room in this window for: {', '.join(left_out)}.")


def left_out_of(headings: Sequence[str], rows: Sequence[Sequence[str]], kept: Sequence[str], width: int) -> list[str]:
    """The headings that have no room in so many letters, in their order: the last of those not in `kept` goes first."""
    wide = {
        heading: max(map(len, [heading, *column])) + COLUMN_GAP
        for heading, column in zip(headings, zip(*rows, strict=True), strict=True)
    } if rows else {}  # fmt: skip
    others = [heading for heading in reversed(headings[1:]) if heading not in kept]
    going = [*others, *reversed(kept)]
    gone: list[str] = []
    while going and sum(wide.values()) - sum(wide[one] for one in gone) - COLUMN_GAP > width:
        gone.append(going.pop(0))
    return [heading for heading in headings if heading in gone]


def print_object(tree: Mapping[str, Any] | list[Any]) -> None:
    """Print keys and values as one JSON object on one line; numbers that are none as null."""
    spelt_out = "utf" not in (sys.stdout.encoding or "").lower()
    print(json.dumps(plain(tree), ensure_ascii=spelt_out, allow_nan=False))
