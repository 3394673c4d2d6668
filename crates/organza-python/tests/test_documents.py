"""Documents: the same JSON as the command prints."""

import json
import subprocess

import numpy as np
import organza as og
import pytest
from conftest import ASSETS

SMALL = (48, 36)
SCENE = """
version = 1
[camera]
position = [0, 0, 4]
target = [0, 0, 0]
size = [24, 18]
[[object]]
name = "glow"
medium_ball = { center = [0, 0, 0], radius = 1, extinction = 0.5, spacing = 0.2 }
material = "glow"
[material.glow]
shading = "unlit"
color = [1, 0.5, 0.2]
[render]
technique = "points"
"""


def printed(command, *words):
    said = subprocess.run([command, *map(str, words), "--json"], capture_output=True, text=True, check=True)
    return json.loads(said.stdout)


def timeless(document):
    """A document without the numbers of a clock, and without paths, which the command has relative to its folder."""
    if isinstance(document, dict):
        return {key: timeless(value) for key, value in document.items() if "seconds" not in key and key != "stage"}
    return [timeless(part) for part in document] if isinstance(document, list) else document


def worded(document):
    """A document of the command in the words of Python."""
    if isinstance(document, dict):
        return {key: worded(value) for key, value in document.items()}
    if isinstance(document, list):
        return [worded(part) for part in document]
    return og._organza.in_words(document) if isinstance(document, str) else document


def glow():
    scene = og.Scene()
    values = np.zeros((9, 9, 9))
    values[2:7, 2:7, 2:7] = 1.0
    scene.add_volume(values, transfer=og.transfer("magma", clim=(0, 1), opacity=[0, 0.5]), name="fog")
    scene.set("render.technique", "points")
    return scene


@pytest.mark.parametrize("name", ["meshes/dart.off", "dose/dose.nrrd", "points/hedge.csv", "environment/sky.hdr"])
def test_info_is_that_of_the_command(command, name):
    assert og.info(ASSETS / name) == printed(command, "info", ASSETS / name)


def test_info_of_a_scene(command, tmp_path):
    place = tmp_path / "glow.toml"
    place.write_text(SCENE)
    document = og.info(place)
    assert document == printed(command, "info", place) and document["objects"][0]["name"] == "glow"
    assert og.info(og.Scene.load(place)) == document
    assert [thing["source"] for thing in og.info(glow())["objects"]] == ["volume"]
    with pytest.raises(FileNotFoundError, match="nothing.ply"):
        og.info("nothing.ply")
    with pytest.raises(og.InputError, match="expected the path of a file, or a scene"):
        og.info(np.zeros((3, 3)))


def test_explain_is_that_of_the_command(command, tmp_path):
    place = tmp_path / "glow.toml"
    place.write_text(SCENE)
    for measure in (False, True):
        words = ["--measure"] if measure else []
        assert timeless(og.explain(place, measure=measure)) == timeless(worded(printed(command, "explain", place, *words)))
    file = ASSETS / "meshes" / "dart.off"
    assert timeless(og.explain(file, size=SMALL)) == timeless(worded(printed(command, "explain", file, "--size", "48x36")))


def test_explain_names_the_effects_of_arrays():
    document = og.explain(glow(), size=SMALL)
    names = [effect["name"] for effect in document["plan"]["effects"]]
    assert "light.0" in names and document["memory_bytes"] > 0 and document["predicted"]["seconds"] >= 0
    assert document["scene"] is None and document["measured"] is None
    off = og.render(glow(), size=SMALL, effects={"shadow.0": "off"})
    assert next(effect for effect in off.plan["effects"] if effect["name"] == "shadow.0")["called_for"] is False


def test_accuracy_is_a_report(command, tmp_path):
    place = tmp_path / "glow.toml"
    place.write_text(SCENE)
    by_command = printed(command, "accuracy", place, "--quick", "--size", "16x12", "-o", tmp_path / "command")
    document = og.accuracy(place, quick=True, size=(16, 12), folder=tmp_path / "package")
    assert document.keys() == by_command.keys() and document["report"].keys() == by_command["report"].keys()
    names = ["accuracy.csv", "accuracy.html", "accuracy.json"]
    assert sorted(path.name for path in (tmp_path / "package").iterdir()) == names and len(document["outputs"]) == 3
    report = json.loads((tmp_path / "package" / "accuracy.json").read_text())
    assert report == document["report"]
    with pytest.raises(og.InputError, match="finer"):
        og.accuracy(place, finer=9)
    # Files that exist stay, and nothing is drawn.
    with pytest.raises((og.InputError, OSError), match="accuracy.json"):
        og.accuracy(place, quick=True, folder=tmp_path / "package")


def test_orders_is_a_report(command, tmp_path):
    place = tmp_path / "glow.toml"
    place.write_text(SCENE)
    by_command = printed(command, "orders", place, "--quick", "--size", "16x12", "-o", tmp_path)
    document = og.orders(place, quick=True, size=(16, 12))
    assert document["outputs"] == []

    def errors(report):
        return [{key: row[key] for key in row if key in ("name", "rmse", "flip")} for row in report["orderings"]]

    assert errors(document["report"]) == errors(by_command["report"])
    empty = og.Scene()
    empty.add_mesh(np.eye(3), [[0, 1, 2]])
    with pytest.raises(og.InputError, match="nothing to order"):
        og.orders(empty, quick=True, size=(16, 12), folder=tmp_path / "none")
    assert not (tmp_path / "none").exists()
