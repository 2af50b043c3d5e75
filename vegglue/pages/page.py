"""One run as one page: a self-contained HTML file that needs no network, and the figures beside it as files."""

from collections.abc import Callable
from pathlib import Path

from vegglue.case.resolved_config import resolved_yaml
from vegglue.inference.statements import measurement_error
from vegglue.inference.weighted_statistics import TRUSTED_K_HAT
from vegglue.pages.answer import answer_of
from vegglue.pages.diagnosis_figures import diagnosis_pictures
from vegglue.pages.diagnosis_tables import diagnosis_section
from vegglue.pages.findings import findings
from vegglue.pages.parameters import fit_rows, key_parameters, parameter_rows, posterior_verdict
from vegglue.pages.posterior_figures import pictures
from vegglue.pages.run import Run, is_synthetic
from vegglue.pages.style import palette_css
from vegglue.pages.tables import provenance, run_health, station_rows
from vegglue.whole_files import write_file
from vegglue.wording.remedies import MAKE_ROOM
from vegglue.wording.sentences import page_document


def write_report(run: Run) -> Path:
    """Write run.folder/report.html and figures/*.svg beside it; returns the page. What `run` lacks is left out of it.

    Errors: StorageError when a file cannot be written.
    """
    return write_page(run.folder / "report.html", lambda: render(run))


def write_page(path: Path, page: Callable[[], str]) -> Path:
    """Write what `page` makes, which may write pictures on its way; an earlier page stays until the new one is whole.

    Errors: StorageError when a file cannot be written.
    """
    write_file(path, page().encode(), MAKE_ROOM)
    return path


def render(run: Run) -> str:
    """The whole page as text; writes the figures as files on the way."""
    stations, found, fit = station_rows(run), findings(run), fit_rows(run)
    notes = run.diagnosis.verdict.notes if run.diagnosis else ()
    light, dark = palette_css()
    return page_document(
        "report.html.j2",
        light=light,
        dark=dark,
        top=answer_of(run),
        caveats=len(notes) + sum(limits for _, limits in found),
        case=run.case,
        synthetic=is_synthetic(run.case),
        verdict=posterior_verdict(run.case, run.posterior),
        parameters=key_parameters(run),
        error=measurement_error(run.posterior, next(iter(run.posterior.fit.sigma))),
        rows=parameter_rows(run),
        fit=fit,
        findings=found,
        diagnosis=None if run.diagnosis is None else diagnosis_section(run.diagnosis),
        diagnosis_pictures={} if run.diagnosis is None else diagnosis_pictures(run, run.diagnosis),
        pictures=pictures(run),
        stations=stations,
        flagged=[row for row in stations if row.reason],
        health=run_health(run),
        trusted_k=TRUSTED_K_HAT,
        made=provenance(run),
        config=resolved_yaml(run.case),
    )
