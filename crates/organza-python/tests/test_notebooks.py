"""The notebooks of docs/python: they run, they end in a picture, and the repository has them without outputs."""

import base64

import pytest
from conftest import REPOSITORY

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")

NOTEBOOKS = sorted((REPOSITORY / "docs" / "python").glob("*.ipynb"))
# Seconds that a cell may take on a busy machine, before it counts as stuck.
PATIENCE = 600


def test_there_is_a_notebook_for_each_kind_of_data():
    assert [path.stem for path in NOTEBOOKS] == ["labels", "mesh", "points", "pyvista", "volume"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_has_no_outputs(path):
    for cell in nbformat.read(path, as_version=4).cells:
        assert cell.cell_type != "code" or (not cell.outputs and cell.execution_count is None)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_ends_in_a_picture(path, monkeypatch):
    for library in ("pyvista",) if path.stem == "pyvista" else ("nibabel",) if path.stem == "labels" else ():
        pytest.importorskip(library)
    monkeypatch.setenv("PYTHONWARNINGS", "ignore")
    notebook = nbformat.read(path, as_version=4)
    client = nbclient.NotebookClient(notebook, timeout=PATIENCE, resources={"metadata": {"path": str(path.parent)}})
    client.execute()
    shown = [output.data for output in notebook.cells[-1].outputs if "data" in output]
    png = base64.b64decode(shown[-1]["image/png"])
    # A picture of one colour takes hardly any bytes.
    assert png.startswith(b"\x89PNG") and len(png) > 4000
