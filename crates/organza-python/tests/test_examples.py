"""The examples draw."""

import re
import runpy
from pathlib import Path

import numpy as np
import pytest
from conftest import ASSETS, REPOSITORY

EXAMPLES = sorted((Path(__file__).resolve().parents[1] / "examples").glob("*.py"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
@pytest.mark.filterwarnings("ignore")
def test_an_example_draws(example, tmp_path):
    place = tmp_path / "a.png"
    runpy.run_path(str(example))["main"](str(place), (96, 54))
    written = np.frombuffer(place.read_bytes(), dtype=np.uint8)
    # A picture of one colour takes hardly any bytes.
    assert len(written) > 2000


@pytest.mark.filterwarnings("ignore")
def test_the_tasks_of_the_page_do_what_they_say(tmp_path, monkeypatch, capsys):
    pytest.importorskip("nibabel")
    pytest.importorskip("pyvista")
    image = pytest.importorskip("PIL.Image")
    page = (REPOSITORY / "docs" / "python.md").read_text(encoding="utf-8")
    tasks = re.findall(r"```python\n(.*?)```", page.split("\n## Tasks\n")[1].split("\n## ")[0], re.DOTALL)
    assert len(tasks) == 9 and all(len(task.splitlines()) <= 10 for task in tasks)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "head.nii.gz").write_bytes((ASSETS / "mni152" / "mni152_t1.nii.gz").read_bytes())
    (tmp_path / "scan.laz").write_bytes((ASSETS / "autzen" / "autzen_trim.laz").read_bytes())
    names: dict[str, object] = {}
    for task in tasks:
        exec(task, names)
    written = {path.name for path in tmp_path.iterdir()} - {"head.nii.gz", "scan.laz"}
    assert written == {"both.png", "depth.npy", "scan.png", "ground.png", "regions.png", "series.gif", "cut.png", *(f"turn-{number:03}.png" for number in range(4))}
    assert image.open("series.gif").n_frames == 4
    assert np.isfinite(np.load("depth.npy")).any()
    assert len(capsys.readouterr().out.splitlines()) == 2
