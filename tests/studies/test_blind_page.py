"""The page of the study: what counts as what, on records made by hand."""

from pathlib import Path
from typing import Any

import blind_definitions as what
import pytest
from blind import KEPT, records_in
from blind_lines import (
    DISTANCE,
    LINES,
    Line,
    Told,
    chances_told,
    counts,
    distance,
    distance_by_chance,
    interval,
    is_met,
    made,
    targets_met,
)
from blind_page import percent, wanted_of, write_page
from scipy import stats

DOCS = Path(__file__).parents[2] / "docs"
# Lines whose shares README.md states.
IN_README = {
    "Nothing hidden, exact site: something named", "Nothing hidden, imperfect site: something named",
    "Listed effect, 3 s.e.: in the credible set", "Listed effect, 6 s.e.: in the credible set",
    "Unlisted object, not inspected: none of these", "Unlisted object, not inspected: a local anomaly within 1.5 m",
    "Held-out error lower with what `extend --auto` kept",
}  # fmt: skip


def listed(name: str = "eddies") -> dict[str, Any]:
    return {"name": name, "kind": "listed", "x": None, "y": None, "term": None, "stations": []}


def step(*rivals: str) -> dict[str, Any]:
    """Each rival is a group of its own; the first is accepted."""
    chances = [0.65, 0.2, 0.1, 0.05][: len(rivals)]
    groups = [[name] for name in rivals]
    return {"accepted": rivals[0], "rivals": list(rivals), "chances": chances, "groups": groups, "others": {}}


def record(group: str, verdict: str, *steps: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """The hidden effect is `eddies`, where nothing else is said."""
    return {
        "key": f"second/twin/{group}/0", "truth": "second", "case": "twin", "group": group, "number": 0,
        "noise": "white", "imperfect": False, "signal": 6.0, "hidden": [listed()], "also_true": {},
        "verdict": verdict, "set": [name for one in steps for name in one["rivals"]], "not_excluded": [],
        "steps": list(steps), "places": [], "instruments": [], "flagged": 0, "amplitudes": [], "held_out": None,
        "seconds": 3.0,
    } | changes  # fmt: skip


PIER = {"name": "unlisted:pier", "kind": "unlisted", "x": 10.0, "y": 0.5, "term": "drag", "stations": []}
PROBE = {"name": "position", "kind": "instrument", "x": None, "y": None, "term": None, "stations": [4, 7]}
HERE = {"x": 11.0, "y": 1.0, "term": "drag"}
AWAY = {"x": 11.2, "y": 1.5, "term": "drag"}
READ, MISREAD = {"kind": "position", "stations": [7]}, {"kind": "gauge", "stations": [8]}

NAMED = record("listed6", "identified", step("eddies"))
WRONG = record("listed6", "identified", step("wind"))
MANY = record("listed6", "cannot-tell", step("wind", "eddies", "sun", "moon"))
SILENT = record("listed6", "nothing-missing", not_excluded=[["sun"], ["eddies", "moon"]])
BESIDE = record("listed6", "identified", step("eddies"), step("wind"))


def nothing(verdict: str, *steps: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return record("null-site", verdict, *steps, **({"hidden": []} | changes))


def pier(verdict: str, *places: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return record("unlisted", verdict, hidden=[PIER], places=list(places), **changes)


def off(*found: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return record("instrument", "instrument", hidden=[PROBE], instruments=list(found), **changes)


def test_imperfections_of_the_site_are_true() -> None:
    found = nothing("identified", step("viscosity"), also_true={"viscosity": 0.8})
    assert what.truths(NAMED | {"also_true": {"elder": 0.8}}) == {"eddies", "elder"}
    assert what.false_named(found | {"sizes": {"viscosity": -0.003}}), "more of it was found, but there is less"
    assert not what.false_named(found | {"sizes": {"viscosity": 0.003}})
    assert what.named(found)
    assert not what.false_named(found)
    assert what.false_named(nothing("identified", step("viscosity")))


def test_what_is_named() -> None:
    assert [what.named(one) for one in (NAMED, SILENT, MANY)] == [True, False, False]
    assert not what.named(nothing("cannot-tell", places=[HERE])), "what cannot be told is no name"
    assert what.named(nothing("instrument"))
    assert what.named(nothing("none-of-these"))
    assert not what.named(nothing("nothing-missing", flagged=1)), "a reading set aside is no name"


def test_what_is_named_falsely() -> None:
    assert [what.false_named(one) for one in (NAMED, WRONG, MANY, SILENT, BESIDE)] == [False, True, False, False, True]
    assert what.false_named(nothing("none-of-these")), "no place, but nothing is hidden"
    assert not what.false_named(pier("none-of-these")), "something is hidden"
    assert [what.false_named(pier("none-of-these", place)) for place in (HERE, AWAY)] == [False, True]
    assert [what.false_named(off(found)) for found in (READ, MISREAD)] == [False, True]
    assert what.false_named(NAMED | {"instruments": [MISREAD]})
    assert [what.only_false(one) for one in (NAMED, WRONG, BESIDE)] == [False, True, False]


def test_a_place_that_is_told_first_counts_as_told() -> None:
    """Where it is likelier than every group; it makes a step true, and no verdict of none of these."""
    near, far = "unlisted_bed[x10.5,y-0.25]", "unlisted_bed[x20,y0]"

    def found(name: str, chance: float) -> dict[str, Any]:
        return pier("one-of", steps=[step("wind") | {"others": {name: chance, "gauge": 0.9}}])

    told = [found(near, 0.7), found(far, 0.7), found(near, 0.6)]
    assert [what.only_false(one) for one in told] == [False, True, True]
    assert [what.told_near(one) for one in told] == [True, False, False]
    assert [what.known_first(one) for one in told] == [False, False, True]
    assert not any(what.place_near(one) or what.none_of_these(one) for one in told)
    assert what.told_near(pier("none-of-these", HERE))
    assert not what.known_first(pier("none-of-these", AWAY))
    assert what.known_first(pier("instrument", instruments=[MISREAD]))
    assert not what.known_first(pier("cannot-tell", steps=[step("wind")]))


def test_a_place_is_where_it_is_told_to_be() -> None:
    """Within two of its errors along and across, which are half a spot at least."""
    places = [
        {"x": 14.9, "y": 0.5, "x_error": 2.5, "y_error": 0.1}, {"x": 15.1, "y": 0.5, "x_error": 2.5, "y_error": 0.1},
        {"x": 10.9, "y": 0.9, "x_error": 0.1, "y_error": 0.1}, {"x": 10.0, "y": 1.1, "x_error": 9.0, "y_error": 0.1},
    ]  # fmt: skip
    assert [what.place_as_told(pier("none-of-these", place)) for place in places] == [True, False, True, False]
    assert what.place_as_told(pier("none-of-these")) is None
    assert what.place_as_told(pier("cannot-tell", places[0])) is None


def test_a_field_stands_for_all_that_was_found() -> None:
    """It is true of viscosity that is off, or near a hidden object; steps beside it were said to be something else."""
    mixed = {"field": {"term": "viscosity", "x": 3.0, "y": 0.0}}
    assert what.false_named(nothing("none-of-these", **mixed))
    assert not what.false_named(nothing("none-of-these", step("wind"), also_true={"viscosity": 0.8}, **mixed))
    assert [what.false_named(pier("none-of-these", field=HERE | {"x": x})) for x in (10.5, 20.0)] == [False, True]


def test_a_hidden_effect_in_the_set() -> None:
    everything = (NAMED, WRONG, MANY, SILENT)
    assert [what.in_steps(one) for one in everything] == [True, False, True, False]
    assert [what.in_set(one) for one in everything] == [True, False, True, True]
    assert what.in_set(SILENT | {"not_excluded": [["sun"]]}) is False
    assert what.in_set(SILENT | {"verdict": "none-of-these"}) is False, "something else stands out"
    assert what.in_set(WRONG | {"not_excluded": [["eddies"]]}) is False, "what is named excludes it"
    assert what.in_set(nothing("nothing-missing")) is None
    beside = record("listed3", "identified", step("viscosity"), not_excluded=[["eddies"]])
    assert what.in_set(beside | {"also_true": {"viscosity": 0.8}}), "what is named is true, and does not exclude it"
    assert what.few_groups(beside | {"also_true": {"viscosity": 0.8}})
    assert not what.in_set(beside)
    two = {"hidden": [listed(), listed("wind")]}
    assert [what.in_set(one | two) for one in (NAMED, BESIDE)] == [False, True]


def test_at_most_three_groups() -> None:
    assert [what.few_groups(one) for one in (NAMED, WRONG, MANY, SILENT)] == [True, True, False, True]
    assert [what.few_and_true(one) for one in (NAMED, WRONG, MANY, SILENT)] == [True, False, False, True]
    later = record("listed6", "one-of", step("a", "b", "c", "d"), step("eddies", "e"))
    assert what.few_groups(later), "the step with the hidden effect counts"
    assert not what.few_groups(SILENT | {"not_excluded": [["a"], ["b"], ["c"], ["d"]]})
    assert not what.few_groups(SILENT | {"not_excluded": []})
    assert not what.few_groups(SILENT | {"verdict": "none-of-these", "places": [HERE]}), "a place was named instead"


def test_false_names_beside_true_ones_and_alone() -> None:
    assert [what.false_beside_true(one) for one in (NAMED, WRONG, BESIDE)] == [False, False, True]
    assert what.false_beside_true(NAMED | {"places": [HERE]})
    assert [what.false_beside_true(pier("none-of-these", *places)) for places in ([HERE], [HERE, AWAY], [AWAY])] == [
        False, True, False,
    ]  # fmt: skip
    assert what.false_beside_true(off(READ, MISREAD))
    elder = record("listed6", "identified", step("elder"), step("wind"), also_true={"elder": 0.8})
    assert not what.false_beside_true(elder), "what was hidden was not found"
    assert not what.wrong_alone(elder)
    assert [what.wrong_alone(one) for one in (NAMED, WRONG, MANY, BESIDE)] == [False, True, False, False]
    assert not what.wrong_alone(WRONG | {"verdict": "one-of"})


def test_an_object_in_no_list() -> None:
    assert [what.none_of_these(one) for one in (pier("none-of-these"), pier("identified", AWAY))] == [True, False]
    assert not what.none_of_these(pier("nothing-missing"))
    assert [what.place_near(pier("none-of-these", place)) for place in (HERE, AWAY)] == [True, False]
    assert what.right_term(pier("none-of-these", HERE))
    assert not what.right_term(pier("none-of-these", HERE | {"term": "bed"}, AWAY)), "the right one is too far off"
    assert what.right_term_if_near(pier("none-of-these", HERE | {"term": "bed"})) is False
    assert what.right_term_if_near(pier("none-of-these", AWAY)) is None
    assert [what.wrong_for_object(pier(verdict)) for verdict in ("identified", "instrument", "one-of")] == [
        True, True, False,
    ]  # fmt: skip
    assert not what.wrong_for_object(pier("identified", HERE))


def test_an_instrument_that_is_off() -> None:
    assert [what.instrument_found(off(*found)) for found in ([READ], [MISREAD], [])] == [True, False, False]
    assert what.instrument_found(NAMED) is None
    gain = off(set=["probe_gain[C]"])
    assert what.instrument_found(gain) is False
    assert [what.sensor_in_set(one) for one in (gain, off(READ), off(set=["wind"]))] == [True, True, False]
    assert [what.reading_set_aside(off(flagged=flagged)) for flagged in (0, 1)] == [False, True]


def test_amplitudes_and_held_out_errors() -> None:
    sizes = [{"name": "a", "low": 1.0, "high": 2.0, "true": 1.5}, {"name": "b", "low": 1.0, "high": 2.0, "true": 2.5}]
    line = Line("", ("listed6",), what.amplitudes_held)
    assert counts([NAMED | {"amplitudes": sizes}, NAMED], line) == (1, 2)
    errors = {"before": 0.02, "after": 0.0125, "oracle": 0.012, "noise": 0.012}
    looked = NAMED | {"held_out": errors}
    assert what.error_fell(looked) is True
    assert what.near_oracle(looked) is True
    worse = NAMED | {"held_out": errors | {"after": 0.021}}
    assert what.error_fell(worse) is False
    assert what.near_oracle(worse) is False
    unknown = SILENT | {"held_out": errors | {"after": None, "oracle": None}}
    assert [what.error_fell(one) for one in (NAMED, unknown)] == [None, None]
    assert [what.near_oracle(one) for one in (NAMED, unknown)] == [None, None]
    assert what.error_fell_where_said(looked) is True
    assert what.error_fell_where_said(looked | {"verdict": "cannot-tell"}) is None
    assert what.error_fell_as_kept(looked) is None, "nothing was kept"
    kept = NAMED | {"held_out": errors | {"parent": 0.02, "kept": 0.013}}
    assert what.error_fell_as_kept(kept) is True
    assert what.near_oracle_as_kept(kept) is True
    assert [what.error_falls_with_truth(one) for one in (looked, kept)] == [None, True]
    assert what.error_falls_with_truth(NAMED | {"held_out": errors | {"parent": 0.011}}) is False
    left = NAMED | {"held_out": errors | {"parent": 0.02, "kept": None}}
    assert what.near_oracle_as_kept(left) is False, "the model was left as it was"
    assert what.silent_beside_error(unknown) is True
    assert what.silent_beside_error(SILENT | {"held_out": errors | {"before": 0.015}}) is False
    assert what.silent_beside_error(looked) is None, "it did not say that nothing is missing"


def test_lines_count_their_groups_and_errors() -> None:
    white, understated = nothing("identified", step("wind")), nothing("nothing-missing", noise="understated:1.5")
    line = Line("", ("null-site",), what.named, 0.07, most=True)
    assert counts([white, understated, NAMED], line) == (1, 2)
    assert counts([white, understated], Line("", (), what.named, noise="white")) == (1, 1)
    assert len({line.label for line in LINES}) == len(LINES)


def test_a_line_is_met_by_its_share_and_not_by_its_interval() -> None:
    most, least = Line("", (), what.named, 0.07, most=True), Line("", (), what.named, 0.9)
    never = Line("", (), what.named, 0.0, most=True)
    assert [is_met(most, good, 200) for good in (14, 15)] == [True, False]
    assert [is_met(least, good, 200) for good in (180, 179)] == [True, False]
    assert [is_met(never, good, 200) for good in (0, 1)] == [True, False]
    assert is_met(Line("", (), what.named), 1, 2) is None
    assert is_met(least, 0, 0) is None
    assert [wanted_of(line) for line in (most, least, never)] == ["at most 7 %", "at least 90 %", "never"]


def test_targets_are_met_in_enough_sets_only() -> None:
    found = [pier("none-of-these", HERE)] * 19
    lines, met = targets_met(found)
    assert (lines, met) == (4, 0)
    assert targets_met([*found, found[0]]) == (4, 4)
    assert targets_met([*found, *[pier("none-of-these", AWAY)] * 9]) == (4, 2), "a place, and its term: 19 of 28"


def test_few_hypotheses_are_away_from_probabilities_that_are_right() -> None:
    """4 hypotheses at 50 %: |1/2 - k/4| is 3/16 in the mean; right probabilities are found right in the long run."""
    assert distance_by_chance([Told(0.5, 0.5, 4, 2)]) == pytest.approx(3.0 / 16.0, abs=0.003)
    assert distance_by_chance([Told(0.5, 0.5, 10**8, 10**7)]) < 1e-3


def test_stated_probabilities_against_what_is_true() -> None:
    told = chances_told([NAMED, WRONG, MANY, SILENT, nothing("identified", step("wind")), pier("none-of-these")])
    assert [(one.low, one.count, one.true) for one in told] == [(0.0, 1, 0), (0.1, 1, 0), (0.2, 1, 1), (0.6, 3, 1)]
    away = [0.05, 0.1, 0.8, 0.65 - 1.0 / 3.0]
    assert distance(told) == pytest.approx((sum(away[:3]) + 3.0 * away[3]) / 6.0)


def test_an_interval_of_a_share() -> None:
    low, high = interval(14, 200)
    assert stats.binom.sf(13, 200, low) == pytest.approx(0.025, rel=1e-6)
    assert stats.binom.cdf(14, 200, high) == pytest.approx(0.025, rel=1e-6)
    assert interval(0, 20)[0] == 0.0
    assert interval(20, 20)[1] == 1.0


def test_the_page_has_the_numbers_of_its_records(tmp_path: Path) -> None:
    out = {"key": "second/twin/listed6/9", "truth": "second", "case": "twin", "group": "listed6"}
    reason = "--hide sun: at no plausible size would it be as visible as --snr 6 in these data; ask for less."
    errors = {"noise": 1.0, "before": 1.0, "after": 1.0, "parent": 1.0}
    records = [
        *(one | {"held_out": errors | {"kept": kept}} for one, kept in ((NAMED, 0.5), (WRONG, 0.8), (MANY, 1.1))),
        SILENT, NAMED | {"truth": "own"}, NAMED | {"case": "campaign"}, out | {"left_out": reason},
        out | {"left_out": "no steady flow"}, pier("none-of-these") | {"key": "pier0"},
    ]  # fmt: skip
    write_page(records, tmp_path, {"pier0": 5.0}, {"pier0": 0.9, "pier1": 0.7}, {})
    page = (tmp_path / "blind.md").read_text(encoding="utf-8")
    row = "Listed effect, 6 s.e.: in the credible set | at least 90 %, **missed** | 5 | 80 % (28 to 99)"
    assert f"| {row} |" in page, "one data set of the campaign makes no share"
    assert "3 s.e.: in the credible set" not in page, "lines without data are left out"
    assert "`sun`" not in page
    flat = " ".join(page.split())
    for number in ("1 effects that are not visible there", "no steady flow (1)", "-20 % (median of 3 data sets)",
                   "rise: by 10 % (median)", "80 % of draws of the errors (2 objects", "5.0 to 5.0 s.e."):  # fmt: skip
        assert number in flat, number
    for name in ("chances", "held-out"):
        assert f"blind-{name}.svg" in page
        assert (tmp_path / f"blind-{name}.svg").stat().st_size > 1000


def test_limits_of_the_data_are_means_over_what_is_hidden(tmp_path: Path) -> None:
    objects = {
        f"second/twin/unlisted/{j}": {"told": told, "evenly": 0.9, "near": 0.4, "guessed": 0.6}
        for j, told in enumerate((0.5, 0.7))
    }
    effects = {f"second/twin/listed{ratio}/0": {"told": 0.01, "evenly": 0.1 / ratio} for ratio in (3, 6)}
    write_page([], tmp_path, {}, {}, objects | effects)
    flat = " ".join((tmp_path / "blind.md").read_text(encoding="utf-8").split())
    assert "for 60 % of 2 objects and a local anomaly within 1.5 m for 40 %" in flat
    assert "2 % of listed effects of 6 s.e. and 3 % of 3 s.e." in flat


def test_the_shipped_page_is_made_of_the_shipped_records() -> None:
    """`blind.py --page` writes it."""
    records = list(records_in(KEPT))
    page = (DOCS / "blind.md").read_text(encoding="utf-8")
    lines, met = targets_met(made(records, "second"))
    told = chances_told(made(records, "second"))
    assert f"of {lines + 1} targets {met + (distance(told) <= DISTANCE)} are met." in page
    assert len(page.splitlines()) <= 120
    readme = " ".join((DOCS.parent / "README.md").read_text(encoding="utf-8").split())
    for line in LINES:
        if line.label in IN_README:
            good, size = counts(made(records, "second"), line)
            low, high = interval(good, size)
            assert f"{percent(good / size)} ({100 * low:.0f} to {100 * high:.0f}" in readme, line.label
            assert f" {size}" in readme, line.label
