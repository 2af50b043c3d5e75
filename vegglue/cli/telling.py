"""What a command says in the end: its result in words, or as one JSON object."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from vegglue.cli.output import print_object

if TYPE_CHECKING:
    from vegglue.case.schema import Case


def tell(case: "Case", runs: Path, result: Any, as_object: bool) -> None:
    """Print a result of a verb, kept in runs/<name>/, as an object or in words."""
    if as_object:
        from vegglue.cli.objects import object_of

        print_object(object_of(case, runs, result))
    else:
        from vegglue.cli.words import show

        show(case, runs, result)
