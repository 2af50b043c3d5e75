"""A discovered law as a file: it says what the law does, keeps the contract, and the child config runs it."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from vegglue.case.config import load_case
from vegglue.case.schema import Experiment
from vegglue.diagnosis.comparison import MEASUREMENT
from vegglue.diagnosis.law_search import Discovery, LawFound, ProductFound, effect_name, effect_text
from vegglue.effects.grammar import LAWS, PRODUCTS, Law
from vegglue.engine.interface import Model
from vegglue.errors import InputError
from vegglue.measurements.observations import read_observations
from vegglue.workflow import discover as verb
from vegglue.workflow.case_run import CaseRun
from vegglue.workflow.check import check_effects, critical_warnings
from vegglue.workflow.discover import DiscoveredCase, discover

CONFIG = Path(__file__).parents[2] / "configs" / "twin.yaml"


def found_law(law: Law, **fields: object) -> LawFound:
    """A law as a search finds it; fields: to be changed."""
    usual = LawFound(
        law=law, same_as="", reference=0.3 if law.form.quantiles else None, scale=0.5, strength=-0.8,
        interval95=(-1.0, -0.6), chance=0.9, log_evidence=20.0, seen=(0.1, 0.6), alike=("bank_vegetation",),
    )  # fmt: skip
    return replace(usual, **fields)


LAW = found_law(LAWS["law_bank_speed_step"])


def water() -> SimpleNamespace:
    """Cells with every quantity that laws see, drawn at random; a tenth of them far from any patch."""
    random = np.random.default_rng(3)
    names = ("depth", "speed", "rate", "viscosity")
    values = {name: random.uniform(0.05, 1.5, (7, 5, 2)) for name in names}
    values |= {name: random.normal(size=(7, 5, 2)) for name in ("u_y", "u", "v")}
    there = {name: random.integers(0, 2, (7, 5, 1)).astype(float) for name in ("bank", "planted")}
    away = random.uniform(-2.0, 2.0, (7, 5, 1))
    there |= {"share_along": np.linspace(-0.5, 0.5, 7)[:, None, None], "offset": away, "edge": away}
    there["relative_stems"] = random.uniform(0.5, 2.0, (7, 5, 1))
    there["depth_scale"] = 1.0
    there["front"] = np.where(away > 1.6, np.inf, np.abs(away))
    return SimpleNamespace(**values, geometry=SimpleNamespace(**there))


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_the_file_does_what_the_law_does(law: Law) -> None:
    for reference in (0.3, -0.2) if law.quantity.name == "along" else (0.3,):
        found = found_law(law, reference=reference if law.form.quantiles else None)
        names: dict[str, object] = {}
        exec(effect_text([found], None), names)
        (effect,) = names["EFFECTS"]
        strength = np.array([-0.8, 1.3])
        written = effect.act(water(), strength=strength)
        wanted = law.effect.act(water(), strength=strength, **({"reference": reference} if found.reference else {}))
        assert written.keys() == wanted.keys()
        for name, values in written.items():
            np.testing.assert_allclose(values, wanted[name], rtol=1e-12, atol=1e-15)


PRODUCT = found_law(
    next(one for one in PRODUCTS["law_bank_speed_step"] if one.quantity.name == "depth"), reference=0.5, first=0.3
)


@pytest.mark.parametrize("name", ["law_viscosity_along_part", "law_floor_depth_hump", "law_plants_front_fading"])
def test_the_file_of_a_product_does_what_it_and_its_law_do(name: str) -> None:
    law = found_law(LAWS[name], reference=-0.2 if "along" in name else 0.3)
    for product in PRODUCTS[name]:
        shapes = {"reference": 0.4} if product.form.quantiles else {}
        found = found_law(product, reference=shapes.get("reference"), first=law.reference)
        names: dict[str, object] = {}
        exec(effect_text([law, found], None), names)
        first, second = names["EFFECTS"]
        assert first.name == effect_name(law)
        assert second.name == f"{first.name}_by_{product.quantity.name}"
        strength = np.array([-0.8, 1.3])
        wanted = product.effect.act(water(), strength=strength, first=law.reference, **shapes)
        for key, values in second.act(water(), strength=strength).items():
            np.testing.assert_allclose(values, wanted[key], rtol=1e-12, atol=1e-15)


def product_found(product: LawFound) -> ProductFound:
    """A product as a search finds it, but for its refit, which no file asks for."""
    return ProductFound(product, SimpleNamespace(), strength_of_law=-0.7)


def test_a_product_is_written_and_told_beside_its_law(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    found = Discovery(0.001, 44, (LAW,), {}, product=product_found(PRODUCT))
    monkeypatch.setattr(verb, "discover_laws", lambda *_: found)
    result = discover(load_case(CONFIG), to=tmp_path / "child.yaml")
    assert result.child is not None
    assert result.effect_file is not None
    assert list(result.child.effects) == ["bank_speed_step", "bank_speed_step_by_depth"]
    assert check_effects(result.effect_file, trust=True) == {"bank_speed_step": [], "bank_speed_step_by_depth": []}
    assert found.written == (LAW, PRODUCT)
    assert len(found.product.lines) == len(LAW.lines)
    assert found.lines[-len(found.product.lines) :] == found.product.lines


def test_no_product_is_written_where_no_law_is(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    found = Discovery(0.001, 44, (replace(LAW, same_as="bank_trend"),), {}, product=product_found(PRODUCT))
    assert found.written == ()


def discovered(monkeypatch: pytest.MonkeyPatch, config: Path, target: Path, law: LawFound) -> DiscoveredCase:
    """What the verb makes of a law that a search would find."""
    monkeypatch.setattr(verb, "discover_laws", lambda *_: Discovery(0.001, 44, (law,), {}))
    return discover(load_case(config, trust=True), to=target)


def test_the_law_becomes_a_file_and_a_child(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    result = discovered(monkeypatch, CONFIG, tmp_path / "child.yaml", LAW)
    assert result.effect_file == tmp_path / "child.py"
    assert len(result.effect_file.read_text(encoding="utf-8").splitlines()) <= 20
    assert check_effects(result.effect_file, trust=True) == {"bank_speed_step": []}
    assert result.child is not None
    assert list(result.child.effects) == ["bank_speed_step"]
    assert "bank_speed_step_strength" in result.child.parameters


@pytest.mark.parametrize(
    ("seen", "doubted"), [((0.1, 0.9), []), ((0.1, 0.35), ["mid", "high"]), ((0.5, 0.9), ["low", "mid", "high"])]
)
def test_a_law_beyond_its_range_is_doubted(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, seen: tuple[float, float], doubted: list[str]
) -> None:
    """In the experiments whose measured cells lie outside, by the numbers that its file holds."""
    child = discovered(monkeypatch, CONFIG, tmp_path / "child.yaml", replace(LAW, seen=seen)).child
    assert child is not None
    said = critical_warnings(CaseRun(child))
    assert [name for name in child.experiments if any(f"`{name}`" in one for one in said)] == doubted
    assert all("`bank_speed_step`" in one and f"{seen[0]:g} to {seen[1]:g} m/s" in one for one in said)


def test_a_law_is_doubted_where_nothing_is_measured_too(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    child = discovered(monkeypatch, CONFIG, tmp_path / "child.yaml", replace(LAW, seen=(0.5, 0.9))).child
    assert child is not None
    dry = Experiment(discharge={"upstream": 0.3}, level=0.4)
    case = child.model_copy(update={"experiments": {**child.experiments, "dry summer": dry}})
    said = critical_warnings(CaseRun(case))
    assert any("`dry summer`" in one for one in said)


def test_a_law_is_not_doubted_where_it_does_not_act(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """It was called a guess in experiments that the config keeps it out of."""
    child = discovered(monkeypatch, CONFIG, tmp_path / "child.yaml", replace(LAW, seen=(0.5, 0.9))).child
    assert child is not None
    in_mid = {name: entry.model_copy(update={"experiments": ("mid",)}) for name, entry in child.effects.items()}
    (said,) = critical_warnings(CaseRun(child.model_copy(update={"effects": in_mid})))
    assert "in experiment `mid`" in said


def test_a_file_of_the_case_is_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    first = discovered(monkeypatch, CONFIG, tmp_path / "first.yaml", LAW)
    other = found_law(LAWS["law_floor_depth_ramp"])
    second = discovered(monkeypatch, tmp_path / "first.yaml", tmp_path / "second.yaml", other)
    assert second.child is not None
    assert second.effect_file is not None
    assert set(second.child.effects) == {"bank_speed_step", "floor_depth_ramp"}
    assert set(check_effects(second.effect_file, trust=True)) == {"bank_speed_step", "floor_depth_ramp"}
    with pytest.raises(InputError, match="exists already"):
        discovered(monkeypatch, tmp_path / "first.yaml", tmp_path / "third.yaml", LAW)
    assert first.effect_file is not None


def test_a_config_does_not_extend_itself(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Not even one that vegglue wrote, and would replace."""
    discovered(monkeypatch, CONFIG, tmp_path / "child.yaml", LAW)
    before = (tmp_path / "child.yaml").read_bytes()
    with pytest.raises(InputError, match="is the config that it extends"):
        discovered(
            monkeypatch, tmp_path / "child.yaml", tmp_path / "child.yaml", found_law(LAWS["law_bank_depth_ramp"])
        )
    assert (tmp_path / "child.yaml").read_bytes() == before


@pytest.mark.parametrize("law", [None, replace(LAW, same_as="bank_trend")])
def test_nothing_is_written_where_no_law_is_new(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, law: LawFound | None
) -> None:
    found = Discovery(0.4, 44, () if law is None else (law,), {})
    monkeypatch.setattr(verb, "discover_laws", lambda *_: found)
    result = discover(load_case(CONFIG), to=tmp_path / "child.yaml")
    assert (result.effect_file, result.child) == (None, None)
    assert not list(tmp_path.iterdir())
    assert found.written == ()
    assert found.sentence


def test_what_a_diagnosis_set_aside_has_no_say(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """As in every other verb that compares models."""
    case, make_verdict = load_case(CONFIG), list[pd.DataFrame]()
    first = read_observations(case).table.iloc[[0]]
    monkeypatch.setattr(verb, "excluded_in", lambda *_: first[MEASUREMENT])

    def discover_laws(model: Model, *_: object) -> Discovery:
        make_verdict.append(model.station)
        return Discovery(0.4, 44, (), {})

    monkeypatch.setattr(verb, "discover_laws", discover_laws)
    found = discover(case, runs=tmp_path)
    assert (~make_verdict[0]["used"]).to_numpy().nonzero()[0].tolist() == [0]
    assert found.aside.startswith("1 station is left out of every model")


def test_an_unknown_effect_cannot_be_left_out() -> None:
    with pytest.raises(InputError, match=r"--without: `bank_trent`.*bank_trend"):
        discover(load_case(CONFIG), without=["bank_trent"])


def test_a_law_is_told_with_its_range() -> None:
    assert len(LAW.lines) == 4
    assert len(replace(LAW, alike=()).lines) == 3
    assert "|U| from 0.1 to 0.6 m/s" in LAW.lines[2]


def test_a_listed_effect_that_is_likelier_is_told_instead() -> None:
    found = Discovery(0.001, 44, (replace(LAW, chance=0.3),), {"streamlining": 0.65})
    assert found.best is None
    assert effect_name(LAW) == "bank_speed_step"
    assert found.likeliest_other == ("streamlining", 0.65)
    assert "streamlining" in found.sentence
