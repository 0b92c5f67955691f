"""The notebooks run from top to bottom, and are kept without what they printed."""

from pathlib import Path

import nbclient
import nbformat
import pytest

ROOT = Path(__file__).parents[2]
SLOW = ("01_objects", "03_grasp")  # minutes of compilation
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(
            path, marks=pytest.mark.slow if path.stem in SLOW else pytest.mark.long, id=path.stem
        )
        for path in NOTEBOOKS
    ],
)
def test_a_notebook_runs(path):
    """In a process of its own, like a reader's; compiled programs come from the same cache."""
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    client = nbclient.NotebookClient(
        notebook,
        timeout=600,
        kernel_name="python3",
        resources={"metadata": {"path": str(ROOT)}},
    )
    client.execute()  # a cell that fails raises with its traceback
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert any("image/svg" in str(out) for cell in code for out in cell.outputs)
    warned = [out.text for cell in code for out in cell.outputs if out.get("name") == "stderr"]
    assert not warned


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_without_outputs(path):
    notebook = nbformat.read(path, as_version=4)
    assert NOTEBOOKS
    for cell in notebook.cells:
        if cell.cell_type == "code":
            assert cell.outputs == [] and cell.execution_count is None
