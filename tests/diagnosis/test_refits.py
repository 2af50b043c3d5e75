"""Which of the refits are kept as rivals, and in which groups."""

from types import SimpleNamespace

import numpy as np
import pytest

from vegglue.diagnosis.refits import rivals_among

Kept = tuple[dict[str, float], tuple[tuple[str, ...], ...]]


def kept(fall: list[float], alike: dict[tuple[int, int], float]) -> Kept:
    """Of refits a, b, c, ... that lower the objective by `fall`; alike: cosines of traces, else 0."""
    cosine = np.eye(len(fall))
    for (i, j), value in alike.items():
        cosine[i, j] = cosine[j, i] = value
    tried = [SimpleNamespace(column=j, candidate=SimpleNamespace(name="abcdef"[j])) for j in range(len(fall))]
    return rivals_among(tried, np.array(fall), cosine)


def test_what_is_clearly_best_stands_alone() -> None:
    assert kept([40.0, 15.0, 5.0], {})[1] == (("a",),)
    assert kept([12.0], {}) == ({"a": 1.0}, (("a",),))


def test_what_leaves_the_same_trace_is_one_group() -> None:
    chance, groups = kept([30.0, 29.0, 26.0], {(0, 1): 0.95})
    assert groups == (("a", "b"), ("c",))
    assert list(chance) == ["a", "b", "c"]
    assert sum(chance.values()) == pytest.approx(1.0)


def test_what_fits_far_worse_is_no_company_for_its_trace() -> None:
    assert kept([60.0, 20.0], {(0, 1): 0.98})[1] == (("a",),)


def test_many_unlikely_ones_are_kept_until_the_set_holds_its_share() -> None:
    chance, groups = kept([12.0] + 5 * [4.8], {})
    assert chance["a"] < 0.95
    assert sum(chance.values()) >= 0.95
    assert len(groups) == 5
