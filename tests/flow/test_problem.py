"""What a problem is given, and what it may not make up."""

import re
from dataclasses import MISSING, fields

from house import FILES

from vegglue.case.schema import Numerics
from vegglue.flow.problem import BedFriction, Problem


def test_choices_of_the_solver_have_their_defaults_in_the_schema() -> None:
    default = {item.name: item.default for kind in (Problem, BedFriction) for item in fields(kind)}
    assert default["film"] is default["bank_argument_minimum"] is MISSING
    assert (Numerics().film_depth, Numerics().bank_argument_minimum) == (0.01, 1.3)


def test_what_stays_on_dry_land_is_written_once() -> None:
    again = re.compile(r"(0\.1|1e-1) \* (\w+\.)?film|film(_depth)? / 10")
    assert [str(path) for path in FILES if again.search(path.read_text(encoding="utf-8"))] == []
