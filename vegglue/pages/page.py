"""One run as one page: a self-contained HTML file that needs no network, and the figures beside it as files."""

from pathlib import Path

from vegglue.case.resolved_config import resolved_yaml
from vegglue.pages.answer import answer_of
from vegglue.pages.diagnosis_figures import diagnosis_pictures
from vegglue.pages.diagnosis_words import diagnosis_section
from vegglue.pages.findings import findings
from vegglue.pages.key_numbers import key_numbers, verdict_of
from vegglue.pages.page_file import rendered, write_page
from vegglue.pages.posterior_figures import pictures
from vegglue.pages.run import Run, command_about, is_synthetic
from vegglue.pages.tables import (
    failure_reasons,
    fit_rows,
    health_facts,
    health_in_words,
    member_counts,
    parameter_rows,
    provenance,
    station_rows,
)


def write_report(run: Run) -> Path:
    """Write run.folder/report.html and figures/*.svg beside it; returns the page. What `run` lacks is left out of it.

    Errors: StorageError when a file cannot be written.
    """
    return write_page(run.folder / "report.html", lambda: render(run))


def render(run: Run) -> str:
    """The whole page as text; writes the figures as files on the way."""
    stations, found = station_rows(run), findings(run)
    remarks = run.diagnosis.verdict.remarks if run.diagnosis else ()
    return rendered(
        "report.html.j2",
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
        member_counts=[] if run.ensemble is None else member_counts(run.ensemble),
        failure_reasons=[] if run.ensemble is None else failure_reasons(run.ensemble),
        health_facts=list(health_facts(run)),
        health_words=health_in_words(run),
        provenance=list(provenance(run)),
        config=resolved_yaml(run.case),
        to_diagnose=command_about(run, "diagnose"),
    )
