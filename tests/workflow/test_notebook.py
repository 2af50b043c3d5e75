"""A notebook is run from beginning to end by nbclient, where that and a kernel are installed."""

import re
from pathlib import Path

import pytest
from reach import COARSE, write_reach

pytestmark = pytest.mark.slow
CELLS = (
    "import vegglue\ncase = vegglue.load_case('brook.yaml')\ncase",
    "ensemble = vegglue.simulate(case, jobs=2, watch=vegglue.progress_lines())\nensemble",
    "posterior = vegglue.infer(case, ensemble, method='glue', watch=vegglue.progress_lines())\nposterior",
    "vegglue.load('runs/brook')",
)
MISTAKE = "vegglue.load_case('missing.yaml')"


def test_results_and_progress_show_in_a_notebook(tmp_path: Path) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    write_reach(tmp_path, COARSE, ("members: 1024", "members: 16"))
    cells = [nbformat.v4.new_code_cell(cell) for cell in (*CELLS, MISTAKE)]
    cells[-1].metadata["tags"] = ["raises-exception"]
    notebook = nbformat.v4.new_notebook(cells=cells)
    notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
    nbclient.NotebookClient(notebook, timeout=240, resources={"metadata": {"path": str(tmp_path)}}).execute()
    *outputs, mistake = [cell["outputs"] for cell in notebook.cells]
    assert [one["ename"] for one in mistake] == ["InputError"]
    assert len(mistake[0]["traceback"]) == 1
    printed = "".join(one["text"] for cell in outputs for one in cell if one["output_type"] == "stream")
    assert printed.startswith("... ")
    assert not re.search(r"[\x00-\x09\x0b-\x1f]", printed), "a notebook shows control characters as they are"
    for cell in outputs[1:]:
        shown = next(one["data"] for one in cell if one["output_type"] == "execute_result")
        assert shown["text/html"].startswith("<div>")
        assert shown["text/plain"]
