"""The answer first: verdict, error ladder, sections before and after, and what to do next, as a piece of its own.

`answer_of` has its values, the macro `answer` of answer.html.j2 its looks; a page of several cases may show it again.
"""

from dataclasses import dataclass

from vegglue.pages.answer_words import headline_lines, of_which_model, where_it_fails, why_not_to_rely
from vegglue.pages.cause_words import accepted_causes
from vegglue.pages.error_rows import draw_error_rows
from vegglue.pages.ladder_words import causes_of, ladder_in_words, ladder_rows
from vegglue.pages.next_words import next_steps
from vegglue.pages.run import Run, command_about, published_svg
from vegglue.pages.sections import SectionPanels, section_panels
from vegglue.pages.style import Picture

STAND_IN = "These parameters are of the model as it is: they may stand in for what is missing."


@dataclass(frozen=True)
class CaseAnswer:
    """What the top of a page says of one case (HTML).

    lines: of the headline, the verdict first; subject: which model the page is about, '' where it is the one diagnosed;
    warning: what forbids using it; in_full: the whole verdict (text), '' without a diagnosis; falls: whether models are
    compared; ladder: None where nobody did, and ladder_words then name the command; where: it fails most (text);
    stand_in: what to think of the parameters of this model (text).
    """

    name: str
    lines: list[str]
    subject: str
    warning: str
    in_full: str
    falls: bool
    ladder: Picture | None
    ladder_words: str
    next_steps: list[str]
    where: str
    sections: SectionPanels
    stand_in: str

    @property
    def headline(self) -> str:
        """All of its lines in one."""
        return " ".join(self.lines)


def answer_of(run: Run) -> CaseAnswer:
    """The answer of a run; its pictures are written to run.folder/figures. run.flow is not asked for."""
    ladder = run.loop.ladder
    missing = f"{command_about(run, 'run')} would show here how far the error falls with what is missing."
    return CaseAnswer(
        name=run.case.name,
        lines=headline_lines(run),
        subject=of_which_model(run),
        warning=why_not_to_rely(run),
        in_full=run.behind.verdict.sentence if run.behind else "",
        falls=ladder is not None and len(ladder.steps) > 1,
        ladder=_ladder_picture(run),
        ladder_words=missing if ladder is None else ladder_in_words(ladder, causes_of(run)),
        next_steps=next_steps(run),
        where=where_it_fails(run.behind),
        sections=section_panels(run),
        stand_in=STAND_IN if run.diagnosis and accepted_causes(run.diagnosis) else "",
    )


def _ladder_picture(run: Run) -> Picture | None:
    ladder = run.loop.ladder
    rows = {} if ladder is None else ladder_rows(ladder)
    if ladder is None or not rows:
        return None
    told = "; ".join(
        f"at {words} {' to '.join(f'{value:.3g}' for value in values)} m/s" for words, values in rows.items()
    )
    svg = draw_error_rows(rows, ladder.steps[-1].noise_floor, "m/s", "Errors of velocity before and after")
    models = " to ".join(step.name for step in (ladder.steps[0], ladder.steps[-1])[: len(ladder.steps)])
    return published_svg(run, svg, "ladder", "", f"Errors of velocity, root mean square, from {models}: {told}.")
