"""What one report is about: everything known of a run, and where in its channel things stand."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from zlib import crc32

import numpy as np
from matplotlib.figure import Figure

from vegglue.case.channel_geometry import patches_present
from vegglue.case.gridded_site import Site, cells_at
from vegglue.case.schema import Case
from vegglue.flow.problem import VegetatedCells
from vegglue.flow.problem_setup import build_problem
from vegglue.flow.sensor import FlowFields
from vegglue.measurements.kinds import point_rows
from vegglue.measurements.observations import Observations
from vegglue.measurements.plant_survey import RigidCylinder
from vegglue.pages.style import Picture, publish, publish_text
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.ensemble import Ensemble
from vegglue.results.loop_results import ModelComparison, Question
from vegglue.results.posterior import Posterior
from vegglue.whole_files import folder_within
from vegglue.wording.sentences import page_phrase, phrase

SYNTHETIC = "synthetic record"  # stamped on every figure of one
LONGEST_FILE_NAME = 120  # letters: encrypted disks take 143, with the ending


@dataclass(frozen=True)
class LoopResults:
    """What the loop from misfit to missing effect left beside a case; None for what was not made.

    behind: the diagnosis that names what is missing, of the case itself or of the model it extends; ladder: the error
    ladder with the case in it; questions: what that diagnosis leaves open; pages: where the reports of models of the
    ladder lie, seen from the page that is made, by their names.
    """

    behind: Diagnosis | None = None
    ladder: ModelComparison | None = None
    questions: tuple[Question, ...] | None = None
    pages: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Run:
    """Everything a report may show. ensemble: None where the posterior needed none; flow: the flow of the median
    parameters, by experiment; cylinder: if surveyed; diagnosis: if there is one of this case; loop: what else is known
    of what it lacks; excluded_since: readings of the posterior that the diagnosis excludes since it was made.
    """

    folder: Path
    case: Case
    site: Site
    observations: Observations
    ensemble: Ensemble | None
    posterior: Posterior
    flow: dict[str, FlowFields]
    cylinder: RigidCylinder | None
    diagnosis: Diagnosis | None
    loop: LoopResults = LoopResults()
    excluded_since: int = 0

    @property
    def behind(self) -> Diagnosis | None:
        """The diagnosis whose two models are drawn: of the case; of the model it extends where the case has none, or
        has found nothing more that could be drawn.
        """
        own, first = self.diagnosis, self.loop.behind
        if own is None or first is None:
            return own or first
        calibrated = bool(own.steps or own.places or own.instruments or own.field)
        return first if names_something(first) and not calibrated else own

    @property
    def before(self) -> Diagnosis | None:
        """The diagnosis of the model that the case extends, where that named something; None for a case of its own."""
        own, first = self.diagnosis, self.loop.behind
        other = first is not None and (own is None or own.name != first.name)
        return first if first is not None and other and names_something(first) else None


def names_something(found: Diagnosis) -> bool:
    """Whether it named a cause: one that was calibrated, or a law, which is only suspected to first order."""
    return bool(found.steps or found.places or found.instruments or found.field or found.laws)


def accepted_causes(found: Diagnosis) -> str:
    """What was taken into the model, places and effects, in words; '' for nothing."""
    return phrase("accepted_causes", found.places, [step.accepted for step in found.steps])


def is_synthetic(case: Case) -> bool:
    """Whether a record was computed: an observation states it, or the case knows what it was made with."""
    made_with = case.reference is not None and bool(case.reference.made_with)
    return made_with or any(observation.synthetic for observation in case.observations)


def published_picture(run: Run, figure: Figure | str, name: str, caption: str, *values: object) -> Picture:
    """A figure, or SVG text, as a file of the run and as a part of its page; caption: macro of its words."""
    folder, text = folder_within(run.folder, "figures"), (page_phrase(caption, *values), phrase(caption, *values))
    if isinstance(figure, str):
        return publish_text(figure, folder, file_name(name), *text)
    return publish(figure, folder, file_name(name), *text, SYNTHETIC if is_synthetic(run.case) else "")


def file_name(text: str) -> str:
    """A text as the name of a file, of a length that every disk takes: a user names experiments and sections. With a
    checksum where letters are lost that may be all by which it differs from another.
    """
    plain = re.sub(r"[^A-Za-z0-9_.-]+", "-", text)
    if text.isascii() and len(plain) <= LONGEST_FILE_NAME:
        return plain
    return f"{plain[: LONGEST_FILE_NAME - 9]}-{crc32(text.encode(errors='replace')):08x}"


def median_plants(run: Run, experiment: str) -> VegetatedCells:
    """The plants present in an experiment, at the medians of the parameters."""
    medians = {name: np.array([value]) for name, value in run.posterior.marginals.median.items()}
    return build_problem(run.case, run.site, experiment, medians).plants


def planted_cells(run: Run, experiment: str) -> np.ndarray:
    """Whether each cell (nx, ny) bears plants in an experiment."""
    return np.isin(run.site.main_patch, patches_present(run.case, experiment))


def station_zones(run: Run) -> list[str]:
    """Where each station stands: 'plants' in a patch that is present, else its friction class; 'section' where a whole
    cross-section is measured.
    """
    table = run.observations.table
    column, row = cells_at(run.site, table["x"].to_numpy(float), table["y"].to_numpy(float))
    names = np.array(run.site.class_names)[run.site.friction_class[column, row]]
    cells = {experiment: planted_cells(run, experiment) for experiment in table["experiment"].unique()}
    among = [cells[experiment][i, j] for experiment, i, j in zip(table["experiment"], column, row, strict=True)]
    return [str(name) for name in np.where(point_rows(table), np.where(among, "plants", names), "section")]
