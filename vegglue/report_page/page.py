"""One run as one page: a self-contained HTML file that needs no network, and the figures beside it as files."""

import os
from pathlib import Path

import jinja2

from vegglue.case.resolved_config import resolved_yaml
from vegglue.case.schema import Case
from vegglue.errors import StorageError
from vegglue.figures.style import palette_css
from vegglue.flow.sensor import FlowFields
from vegglue.measurements.observations import Observations
from vegglue.measurements.plant_survey import RigidCylinder
from vegglue.report_page.answer import answer_of
from vegglue.report_page.diagnosis_pictures import diagnosis_pictures
from vegglue.report_page.diagnosis_words import diagnosis_section
from vegglue.report_page.findings import findings
from vegglue.report_page.key_numbers import key_numbers, verdict_of
from vegglue.report_page.pictures import pictures
from vegglue.report_page.run import LoopResults, Run, is_synthetic
from vegglue.report_page.tables import (
    failure_reasons,
    fit_rows,
    health_facts,
    health_in_words,
    member_counts,
    parameter_rows,
    provenance,
    station_rows,
)
from vegglue.results.diagnosis import Diagnosis
from vegglue.results.ensemble import Ensemble
from vegglue.results.posterior import Posterior
from vegglue.site.gridded_site import build_site

# What is inlined in every page, from the files beside this one.
STYLE, SCRIPT = "page.css", "sections.js"
NOTHING_ELSE = LoopResults()


def write_report(
    run: Path,
    case: Case,
    observations: Observations,
    ensemble: Ensemble,
    posterior: Posterior,
    flow: dict[str, FlowFields],
    survey: RigidCylinder | None,
    diagnosis: Diagnosis | None,
    loop: LoopResults = NOTHING_ELSE,
) -> Path:
    """Write run/report.html and run/figures/*.svg; returns the page.

    flow: the member of the median parameters, by experiment; what is not given is left out of the page.
    survey: the rigid-cylinder estimate of plant drag, where there is one; diagnosis: of this very case, if any; loop:
    what else is known of what it lacks.
    Errors: StorageError when a file cannot be written.
    """
    everything = Run(run, case, build_site(case), observations, ensemble, posterior, flow, survey, diagnosis, loop)
    path = run / "report.html"
    try:
        page = render(everything)
        path.with_name("report.html.new").write_text(page, encoding="utf-8")
        os.replace(path.with_name("report.html.new"), path)
    except OSError as error:
        raise StorageError(f"{path}: the report cannot be written ({error}); make room and run it again.") from error
    return path


def render(run: Run) -> str:
    """The whole page as text; writes the figures as files on the way."""
    light, dark = palette_css()
    stations, found = station_rows(run), findings(run)
    remarks = run.diagnosis.verdict.remarks if run.diagnosis else ()
    return (
        _environment()
        .get_template("report.html.j2")
        .render(
            light=light,
            dark=dark,
            style=beside(STYLE),
            script=beside(SCRIPT),
            top=answer_of(run),
            caveats=len(remarks) + sum(one.doubt for one in found),
            case=run.case,
            synthetic=is_synthetic(run.case),
            verdict=verdict_of(run.case, run.posterior),
            numbers=key_numbers(run.case, run.posterior),
            findings=found,
            diagnosis=None if run.diagnosis is None else diagnosis_section(run.diagnosis),
            diagnosis_pictures={} if run.diagnosis is None else diagnosis_pictures(run, run.diagnosis),
            parameters=parameter_rows(run),
            fit_rows=fit_rows(run),
            pictures=pictures(run),
            stations=stations,
            flagged=[row for row in stations if row.reason],
            member_counts=member_counts(run.ensemble),
            failure_reasons=failure_reasons(run.ensemble),
            health_facts=list(health_facts(run)),
            health_words=health_in_words(run.ensemble),
            provenance=list(provenance(run)),
            config=resolved_yaml(run.case),
        )
    )


def beside(name: str) -> str:
    """The text of a file that every page holds: its style or its script."""
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


def _environment() -> jinja2.Environment:
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
