"""case -> discovery: the law that the model lacks, as an effect file and a child config that uses it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from vegglue.calibration.candidates import Candidate
from vegglue.case.config import load_case
from vegglue.case.messages import nearest_effect
from vegglue.case.resolved_config import as_yaml, refuse_parent, write_made
from vegglue.case.schema import Case
from vegglue.diagnosis.child_config import child_tree
from vegglue.diagnosis.comparison import excluding, exclusion_in_words
from vegglue.diagnosis.law_search import Discovery, LawFound, discover_laws, effect_name, effect_text
from vegglue.effects.library import library
from vegglue.errors import InputError
from vegglue.parallel import at_most, one_thread
from vegglue.progress import Watch, silent
from vegglue.wording.numbers import in_short
from vegglue.wording.remedies import ANOTHER_FILE
from vegglue.wording.sentences import phrase
from vegglue.workflow.case_run import CaseRun, case_run, excluded_in
from vegglue.workflow.command_model import refuse_command


@dataclass(frozen=True)
class DiscoveredCase:
    """What a search for laws found, and where it is written.

    Attributes
    ----------
    effect_file : Path or None
        File of the law; None if none is written.
    child : Case or None
        The config that has the law.
    aside : str
        Which readings the diagnosis excludes, as a sentence; empty for none.
    """

    found: Discovery
    effect_file: Path | None
    child: Case | None
    aside: str = ""

    def __repr__(self) -> str:
        written = [f"written to {self.effect_file}"] if self.effect_file else []
        left_out = [self.aside] if self.aside else []
        return in_short(f"Discovery: {self.found.sentence}", [*self.found.lines, *left_out, *written])


@one_thread()
def discover(
    case: Case | CaseRun,
    *,
    without: Sequence[str] = (),
    runs: Path | str = "runs",
    to: Path | str | None = None,
    jobs: int = -1,
    watch: Watch = silent,
    force: bool = False,
) -> DiscoveredCase:
    """Search for a law, in no list, that explains what the calibrated model misses.

        term -> term exp(a g(q, r))

    The best law becomes an effect file and a child config; none is written if no law is found, or if it restates a
    listed effect. Readings that the diagnosis excludes are excluded.

    Parameters
    ----------
    case : Case or CaseRun
    without : sequence of str
        Listed effects that do not compete.
    runs : Path or str
        Folder that holds the folders of runs.
    to : Path or str, optional
        The config to write, with the effect file beside it; beside the parent if not given.
    jobs : int
        Processes, -1 for one on each core. Results do not depend on it.
    watch : callable
        Gets a `Progress` at each step.
    force : bool
        Whether to replace files that were edited by hand or not written by vegglue.

    Returns
    -------
    DiscoveredCase

    Raises
    ------
    InputError
        For an unknown effect, if the model finds no flow, if a station has no standard error, or if a file would be
        replaced.
    """
    run = case_run(case, runs, jobs, watch, force)
    case = run.case
    refuse_command(case, "discover")
    known = library(case.effect_file)
    for name in without:
        if name not in known:
            raise InputError(f"--without: `{name}` is not an effect of the library: {nearest_effect(name, known)}")
    out = excluded_in(run)
    aside = exclusion_in_words(out)
    with at_most(run.jobs):
        found = discover_laws(excluding(run.model, out), without, run.watch)
    laws = found.written
    if not laws:
        return DiscoveredCase(found, None, None, aside)
    name = effect_name(laws[-1])  # of a product, which begins with that of its law
    target = Path(to) if to is not None else case.source.with_name(f"{case.source.stem}+{name}{case.source.suffix}")
    file = target.with_name(f"{target.stem}.py")
    return DiscoveredCase(found, file, written(case, laws, target, file, run.force), aside)


def written(parent: Case, laws: Sequence[LawFound], target: Path, file: Path, force: bool) -> Case:
    """The child config of a law and the effect file that it names, read back as any other.

    Parameters
    ----------
    laws : sequence of LawFound
        A law, and its product if it has one.
    target, file : Path
        The config, and the effect file.
    force : bool
        Whether what vegglue did not write is replaced, too.

    Raises
    ------
    InputError
        If such a file is there and not to be replaced.
    StorageError
        If one cannot be written.
    """
    refuse_parent(target, parent.source)
    text, names = effect_text(laws, parent.effect_file), " and ".join(map(effect_name, laws))
    added: list[tuple[Candidate, dict[str, float]]] = []
    for one in laws:  # each as its effect file has it: under that name, with its references in it
        amplitude = replace(one.law.effect.amplitude, scale=one.scale)
        added.append((Candidate(replace(one.law.effect, name=effect_name(one), shapes=(), amplitude=amplitude)), {}))
    tree = child_tree(parent, target, added)
    tree = {"extends": tree.pop("extends"), "effect_file": file.name, **tree}
    equations = "".join(f"# {one.equation}.\n" for one in laws)
    head = phrase("made_by", "discover", {"parent": parent.name, "names": names})
    write_made({file: text, target: f"{head}\n{equations}{as_yaml(tree)}"}, ANOTHER_FILE, force)
    return load_case(target, trust=True)  # the file was written here
