"""The demonstration: the loop on measurements that come with the package, and one page about it."""

import shutil
from collections.abc import Callable
from pathlib import Path

from vegglue.case.config import load_case
from vegglue.progress import Watch, silent
from vegglue.whole_files import failed_writes_told
from vegglue.wording.remedies import MAKE_ROOM
from vegglue.workflow.case_run import CaseRun
from vegglue.workflow.import_folder import import_folder
from vegglue.workflow.infer import infer
from vegglue.workflow.report import overview, report
from vegglue.workflow.run import Show, run
from vegglue.workflow.simulate import simulate

DEMO_FILES = Path(__file__).with_name("demo_files")
# Configs of the second part, in the order in which they are computed: the second one draws around members of the first.
CONFIGS = ("d3a", "d3a_refined")


def demo(
    folder: Path | str = "runs/demo",
    *,
    short: bool = False,
    jobs: int = -1,
    watch: Watch = silent,
    show: Show = silent,
    part: Callable[[int], None] = silent,
) -> Path:
    """Import measurements that come with the package, run the loop, and make one page; then a published study.

    Parameters
    ----------
    folder : Path
        Where measurements, configs and results go; what an earlier demonstration left there is used again.
    short : bool
        Whether to leave out the published study, which takes most of the time.
    jobs : int
        Processes, -1 for all cores.
    watch, show : callable
        As those of `run`.
    part : callable
        Is called with the number of each part (1, 2, 3) as it begins.

    Returns
    -------
    Path
        The overview: a page that needs no network.

    Raises
    ------
    InputError
        If a config there was edited by hand.
    StorageError
        If a file cannot be written.
    """
    folder = Path(folder)
    with failed_writes_told(folder, MAKE_ROOM):
        for path in (path for path in DEMO_FILES.rglob("*") if path.is_file() and "__pycache__" not in path.parts):
            there = folder / path.relative_to(DEMO_FILES)
            there.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, there)
    part(1)
    measured = sorted(path.name for path in (DEMO_FILES / "measured").iterdir())
    found = [import_folder(folder / "measured" / name, folder / f"{name}.yaml") for name in measured]
    for case in found:
        run(case, runs=folder, jobs=jobs, watch=watch, show=show)
    if not short:
        part(2)
        for name in CONFIGS:
            of_study = CaseRun(load_case(folder / "configs" / f"{name}.yaml"), folder, jobs, watch)
            show(of_study.case, ensemble := simulate(of_study))
            show(of_study.case, infer(of_study, ensemble))
            show(of_study.case, report(of_study))
            found.insert(len(measured), of_study.case)  # the best comes first
    part(3)
    return overview(found, runs=folder, watch=watch)
