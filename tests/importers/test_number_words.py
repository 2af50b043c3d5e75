"""Numbers as people write them: one meaning, or none."""

import pytest

from vegglue.importers.table_parser import has_decimal_comma, is_number, number_in


@pytest.mark.parametrize(
    ("text", "decimal_comma", "value"),
    [
        ("0,5", True, 0.5), ("-1,5e-3", True, -0.0015), ("3", True, 3.0), ("0.5", False, 0.5), (".5", False, 0.5),
        ("1.236,00", True, 1236.0), ("1,236.50", False, 1236.5), ("1'236.5", False, 1236.5),
        ("12 001 236,5", True, 12001236.5),
        ("1d3", False, 1000.0), ("n/a", True, None), ("", False, None), ("k.A.", True, None), ("n.d.", False, None),
        ("#DIV/0!", False, None), ("#N/A", True, None), ("#WERT!", True, None), ("#NAME?", False, None),
        ("+inf", False, None),
        ("\u22120,5", True, -0.5), ("\u20131", False, -1.0), ("\u2014", True, None), ("1e\u22123", False, 0.001),
    ],
)  # fmt: skip
def test_a_number_is_read_as_written(text: str, decimal_comma: bool, value: float | None) -> None:
    assert number_in(text, decimal_comma) == value


@pytest.mark.parametrize(
    ("text", "decimal_comma", "advice"),
    [
        ("0.5", True, "write it with a decimal comma, as most numbers here"),
        ("1.236", True, "write it with a decimal comma"),
        ("0,5", False, "write it with a decimal point"),
        ("1,236.00", True, "write it with a decimal comma"),
        ("much", False, "mend or remove the row"),
        ("1.2.3", False, "mend or remove the row"),
    ],
)
def test_what_has_another_sign_than_most_is_not_guessed(text: str, decimal_comma: bool, advice: str) -> None:
    with pytest.raises(ValueError, match=advice):
        number_in(text, decimal_comma)


def test_most_numbers_say_which_sign_is_decimal() -> None:
    assert has_decimal_comma(["0,5", "1.236,00", "2.0", "low", "12.05.2024"])
    assert not has_decimal_comma(["0.5", "2,0"])
    assert not has_decimal_comma(["3", "low"])
    assert is_number("1.236,00")
    assert not is_number("12.05.2024")
