"""What is said of where an effect comes from."""

from vegglue.effects.library import SHIPPED
from vegglue.pages.effect_page import effect_source

LISTED = {one.name: one for one in SHIPPED}


def test_a_formula_is_said_to_be_read_where_it_was() -> None:
    assert effect_source(LISTED["viscosity"]) == "definition"
    assert effect_source(LISTED["mixing_length"]).endswith("(formula not compared with it)")
    assert effect_source(LISTED["smagorinsky"]).endswith(
        "(formula read in the code of TELEMAC-2D (smagor.f), not in the source)"
    )
