"""A child config: what it extends, which effects it adds, with a prior for the amplitude of each."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from vegglue.calibration.candidates import (
    Candidate,
    acting_in,
    at_work,
    candidates_of,
    effect_entry,
    patch_candidate,
    place_candidate,
    where_it_may_act,
    with_effect,
)
from vegglue.calibration.fingerprints import digits_of_place
from vegglue.case.case_effects import effect_named
from vegglue.case.messages import nearest_effect
from vegglue.case.resolved_config import Tree
from vegglue.case.schema import Case
from vegglue.case.text_files import LONGEST_NAME, case_name
from vegglue.effects.identity import EffectIdentity
from vegglue.effects.library import library
from vegglue.errors import InputError, path_from
from vegglue.results.causes import LocalAnomaly
from vegglue.wording.sentences import phrase


def candidate_named(case: Case, station: pd.DataFrame, name: str) -> Candidate:
    """The candidate that `discharge_error[high]` or `streamlining` names: an effect, and where it acts.

    A candidate of the search comes first: its section may be called as an experiment is, or have a comma in its name.

    Parameters
    ----------
    station : DataFrame
        All stations.

    Raises
    ------
    InputError
        If the effect is unknown or at work already, or cannot act there.
    """
    searched = {one.name: one for one in candidates_of(case, station)}
    if name in searched:
        return searched[name]
    identity, known = EffectIdentity.parse(name), library(case.effect_file)
    if identity.name not in known or identity.text != name:
        raise InputError(f"--add: `{name}` is not an effect of the library: {nearest_effect(identity.name, known)}")
    effect, where = effect_named(case, identity.name), tuple(part.strip() for part in identity.target)
    if where and "search" in effect.tags:
        place = EffectIdentity(effect.name, where).place
        if place is None:
            raise InputError(f"--add: `{name}`: expected a place such as [x47.3,y-0.5]; correct it.")
        shapes = {shape.name: shape.default for shape in effect.shapes}
        return place_candidate(effect, shapes | {"x": place[0], "y": place[1]})
    candidate = Candidate(effect)
    if where:
        # On a patch act effects that have its number among their shapes: any other would act everywhere.
        places = where_it_may_act(case, station)
        kinds = ["experiment", *(["section", "device"] if effect.stage == "sensor" else [])]
        kinds += ["patch"] if effect.each == "patch" else []
        kind = next((one for one in kinds if set(where) <= set(places[one])), None)
        if kind is None:
            known_places = " or ".join(f"{one}s ({', '.join(places[one]) or 'none'})" for one in kinds)
            raise InputError(
                f"--add: `{name}` acts nowhere: expected names of {known_places}, got {', '.join(where)}; correct them."
            )
        if kind == "patch" and len(where) > 1:
            raise InputError(f"--add: `{name}`: expected one patch, got {len(where)}; add them one after the other.")
        names = [patch.name for patch in case.plants.patches] if kind == "patch" else []
        candidate = patch_candidate(effect, names.index(where[0]), case) if names else acting_in(effect, kind, where)
    if at_work(case, candidate):
        raise InputError(f"--add: `{name}` is at work in {case.name} already; add another one.")
    return candidate


def spread_over_its_error(anomaly: LocalAnomaly) -> LocalAnomaly:
    """Something at a place, spread over where it may lie: to first order it does the mean of what it may do.

        l' = (l^2 + 2 e_x^2)^(1/2),   w' = (w^2 + 2 e_y^2)^(1/2),   a' = a l w / (l' w')

    A spot exp(-(x / l)^2) whose middle errs by a normal e_x has this as its mean. What enters stays as much as it is,
    and so does the head that a barrier takes.

    Parameters
    ----------
    anomaly : LocalAnomaly
        l, w, e_x and e_y [m], a [unit of its effect].

    Returns
    -------
    LocalAnomaly
        Its interval and plausible size changed with a.
    """
    length, width = (
        round(float(np.hypot(half, 2.0**0.5 * error)), digits_of_place(min(anomaly.length, anomaly.width)))
        for half, error in ((anomaly.length, anomaly.x_spread), (anomaly.width, anomaly.y_spread))
    )
    share = 1.0 if anomaly.term in ("inflow", "barrier") else anomaly.length * anomaly.width / (length * width)
    low, high = anomaly.interval95
    return replace(
        anomaly,
        length=length,
        width=width,
        amplitude=share * anomaly.amplitude,
        interval95=(share * low, share * high),
        plausible=share * anomaly.plausible,
    )


def candidate_at(case: Case, anomaly: LocalAnomaly) -> Candidate:
    """The effect that stands for a local anomaly, at its place.

    Returns
    -------
    Candidate
        With the size that the diagnosis held to be plausible there.
    """
    return place_candidate(effect_named(case, anomaly.effect), anomaly.shapes, anomaly.plausible)


def with_additions(parent: Case, added: Sequence[tuple[Candidate, Mapping[str, float]]]) -> Case:
    """The case that a child config would be read as, but for its title; no file is written.

    Parameters
    ----------
    added : sequence of (Candidate, mapping of float)
        Effects with values of their shapes [unit of each].
    """
    child = parent
    for candidate, shapes in added:
        child = with_effect(child, candidate, shapes)
    return child.model_copy(update={"name": child_name(parent.name, [candidate for candidate, _ in added])})


def child_tree(parent: Case, target: Path, added: Sequence[tuple[Candidate, Mapping[str, float]]]) -> Tree:
    """Keys and values of the child that `target` is to hold: effects, and the priors of their amplitudes.

    Parameters
    ----------
    added : sequence of (Candidate, mapping of float)
        Effects with values of their shapes [unit of each].

    Raises
    ------
    InputError
        If an effect has no such shape.
    """
    tree: Tree = {
        "extends": path_from(target.resolve().parent, parent.source),
        "name": child_name(parent.name, [candidate for candidate, _ in added]),
        "title": f"{parent.title or parent.name}, with {' and '.join(candidate.name for candidate, _ in added)}",
        "effects": {},
        "parameters": {},
    }
    for candidate, shapes in added:
        unknown = set(shapes) - {shape.name for shape in candidate.effect.shapes}
        if unknown:
            names = [shape.name for shape in candidate.effect.shapes]
            raise InputError(f"--shape: `{min(unknown)}` is not a shape of {candidate.name}: it has {names or 'none'}.")
        working = effect_entry(candidate, candidate.parameter, shapes)
        tree["effects"][candidate.key] = working.model_dump(mode="json", exclude_defaults=True)
        for name, prior in candidate.priors.items():
            tree["parameters"][name] = prior.model_dump(exclude_none=True, exclude={"symbol"})
    return tree


def relevelled_tree(parent: Case, relevelled: Case, target: Path) -> Tree:
    """Keys and values of the child config that holds the bed of a case without levels of surveyed lines.

    Parameters
    ----------
    relevelled : Case
        With that bed.
    target : Path
        File of the child; paths are relative to its folder.
    """
    here, layers = target.resolve().parent, list[Tree]()
    for layer in relevelled.bed:
        tree = layer.model_dump(mode="json", exclude_unset=True)
        files = ((tree, "raster", layer.raster), (tree, "points", layer.points))
        files += () if layer.survey is None else ((tree["survey"], "file", layer.survey.file),)
        for part, key, path in files:
            if path is not None:
                part[key] = path_from(here, path)
        layers.append(tree)
    name = case_name(f"{parent.name}-survey")
    title = phrase("title_of_case", "relevelled", parent.title or parent.name)
    return {"extends": path_from(here, parent.source), "name": name, "title": title, "bed": layers}


def child_name(parent: str, added: Sequence[Candidate]) -> str:
    """A name for the child's folder of results."""
    words = "-".join([parent, *(candidate.key for candidate in added)])
    name = case_name(words)
    if len(name) < LONGEST_NAME and words.isascii():
        return name
    # Cut, or without its other letters, it could be that of its parent or of another child.
    return f"{name[: LONGEST_NAME - 9]}-{hashlib.sha256(words.encode()).hexdigest()[:8]}"
