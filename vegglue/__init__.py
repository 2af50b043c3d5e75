"""vegglue: calibrate models of flow through plants, and learn which effect they miss.

    case = vegglue.load_case("brook.yaml")
    ensemble = vegglue.simulate(case)
    posterior = vegglue.infer(case, ensemble)

The verbs stand in `workflow`, one file each, and keep what they make in runs/<name>/, as the commands of the shell do.
Nothing of them is imported before it is used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from vegglue import version

if TYPE_CHECKING:
    from vegglue.case.config import load_case
    from vegglue.cluster import on_cluster
    from vegglue.errors import InputError, StorageError
    from vegglue.progress import progress_lines
    from vegglue.workflow.check import check
    from vegglue.workflow.compare import compare
    from vegglue.workflow.demo import demo
    from vegglue.workflow.diagnose import diagnose
    from vegglue.workflow.discover import discover
    from vegglue.workflow.export import export
    from vegglue.workflow.extend import extend, extend_stepwise
    from vegglue.workflow.import_folder import import_folder
    from vegglue.workflow.infer import infer
    from vegglue.workflow.load import load
    from vegglue.workflow.new import new
    from vegglue.workflow.next_measurement import next_measurement
    from vegglue.workflow.plan import plan
    from vegglue.workflow.report import overview, report
    from vegglue.workflow.run import run
    from vegglue.workflow.simulate import simulate
    from vegglue.workflow.twin import make_twin, reveal

__all__ = [
    "InputError", "StorageError", "__version__", "check", "compare", "demo", "diagnose", "discover", "export", "extend",
    "extend_stepwise", "import_folder", "infer", "load", "load_case", "make_twin", "new", "next_measurement",
    "on_cluster", "overview", "plan", "progress_lines", "report", "reveal", "run", "simulate",
]  # fmt: skip

__version__ = version.VERSION
# Where a name stands, if it is not in the file of its own name in `workflow`.
_ELSEWHERE = {
    "InputError": "errors",
    "StorageError": "errors",
    "load_case": "case.config",
    "on_cluster": "cluster",
    "extend_stepwise": "workflow.extend",
    "make_twin": "workflow.twin",
    "overview": "workflow.report",
    "progress_lines": "progress",
    "reveal": "workflow.twin",
}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'vegglue' has no attribute {name!r}")
    return getattr(import_module(f"vegglue.{_ELSEWHERE.get(name, f'workflow.{name}')}"), name)


def __dir__() -> list[str]:
    return __all__
