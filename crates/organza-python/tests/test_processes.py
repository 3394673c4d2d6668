"""Calls among others: forked and other processes, progress, memory, and the command's own files."""

import hashlib
import multiprocessing
import pickle
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import organza as og
import pytest
from conftest import ASSETS

SMALL = (48, 36)
# A child that waits for threads which are gone would wait for ever.
PATIENCE = 300


def fog():
    scene = og.Scene()
    values = np.zeros((9, 9, 9))
    values[2:7, 2:7, 2:7] = 1.0
    scene.add_volume(values, transfer=og.transfer("magma", clim=(0, 1), opacity=[0, 0.5]), name="fog")
    return scene


def everything(folder: str, name: str) -> None:
    """Data, a picture by each technique, and both kinds of files."""
    for technique in ("points", "particles", "sheets", "surfels"):
        scene = og.Scene() if technique == "surfels" else fog()
        scene.add_points(np.random.default_rng(0).normal(size=(200, 3)) + 12, name="cloud")
        scene.set("render.technique", technique)
        picture = og.render(scene, size=SMALL)
        for ending in ("png", "exr"):
            picture.save(Path(folder) / f"{name}-{technique}.{ending}")


def turned(scene: og.Scene, azimuth: float) -> og.Picture:
    scene.camera(azimuth=azimuth)
    return og.render(scene, size=SMALL)


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="this system does not fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_child_draws_what_its_parent_draws(tmp_path):
    everything(str(tmp_path), "parent")
    child = multiprocessing.get_context("fork").Process(target=everything, args=(str(tmp_path), "child"))
    child.start()
    child.join(PATIENCE)
    is_stuck = child.is_alive()
    child.kill()
    assert not is_stuck and child.exitcode == 0
    files = sorted(tmp_path.glob("parent-*"))
    assert len(files) == 8
    for file in files:
        assert file.read_bytes() == (tmp_path / file.name.replace("parent", "child")).read_bytes(), file


def test_pictures_come_back_from_other_processes():
    here = [turned(fog(), azimuth) for azimuth in (0.0, 90.0)]
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        there = list(pool.map(turned, [fog()] * 2, (0.0, 90.0)))
    for one, other in zip(here, there, strict=True):
        assert np.array_equal(one.rgb, other.rgb) and np.array_equal(one.to_srgb8(), other.to_srgb8())
        assert one.camera == other.camera and one.layers == other.layers


def test_a_pickled_picture_is_the_same(tmp_path):
    scene = og.Scene()
    scene.add_points(np.random.default_rng(0).normal(size=(200, 3)), values=np.arange(200.0), radius=0.3)
    scene.set("render.layers", ["depth", "object", "effects"])
    scene.set("background.color", [0.1, 0.2, 0.3])
    picture = og.render(scene, size=(320, 240), transparent=True)
    again = pickle.loads(pickle.dumps(picture))
    assert all(np.array_equal(picture[name], again[name], equal_nan=True) for name in picture.layers)
    assert (again.plan, again.cost, again.notes) == (picture.plan, picture.cost, picture.notes)
    for name, options in [("a.png", {}), ("b.png", {"transparent": True}), ("c.exr", {})]:
        picture.save(tmp_path / f"one-{name}", **options)
        again.save(tmp_path / f"two-{name}", **options)
        assert (tmp_path / f"one-{name}").read_bytes() == (tmp_path / f"two-{name}").read_bytes()


def legend_scenes():
    """A scene for each kind of colours that a legend tells of."""
    places = np.random.default_rng(0).normal(size=(200, 3))
    columns = {"class": np.arange(200) % 3, "heat": np.linspace(-3.0, 7.0, 200), "depth": np.geomspace(1e-3, 10.0, 200)}
    shown = {
        "map": {"color_by": "heat", "clim": (None, 1.0 / 3.0)},
        "logarithm": {"color_by": "depth", "log_scale": True},
        "classes": {"color_by": {"column": "class", "map": "classes"}},
        "distinct": {"color_by": {"column": "class", "map": "distinct"}},
        "transfer": {"color_by": "heat", "colormap": ["#ff0000", "#00ff00", "#0000ff"]},
    }
    for name, look in shown.items():
        scene = og.Scene()
        scene.add_points(places, columns=columns, radius=0.3, name=name, **look)
        yield name, scene
    regions = np.zeros((6, 6, 6), int)
    regions[1:5, 1:5, 1:3], regions[1:5, 1:5, 3:5] = 1, 2
    labels = og.Scene()
    labels.add_labels(regions, labels={1: "liver", 2: {"name": "spleen", "color": "#ff8000", "opacity": 0.5}}, name="organs")
    yield "labels", labels
    yield "volume", fog()


@pytest.mark.parametrize(("name", "scene"), legend_scenes(), ids=lambda part: part if isinstance(part, str) else "")
def test_a_pickled_picture_has_its_legends(name, scene, tmp_path):
    picture = og.render(scene, size=(320, 240))
    again = pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(picture))))
    for place in ("over", "beside"):
        for number, each in enumerate((picture, again)):
            each.save(tmp_path / f"{number}.png", legend=place)
        assert (tmp_path / "0.png").read_bytes() == (tmp_path / "1.png").read_bytes()
    picture.save(tmp_path / "without.png")
    picture.save(tmp_path / "over.png", legend=True)
    assert (tmp_path / "without.png").read_bytes() != (tmp_path / "over.png").read_bytes()


def test_progress_is_a_function_a_bar_or_lines(capsys, monkeypatch):
    tqdm = pytest.importorskip("tqdm")
    with tqdm.tqdm(total=100) as bar:
        og.render(fog(), size=SMALL, progress=bar)
        assert bar.n <= 100
    og.render(fog(), size=(256, 192), progress=True)
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    capsys.readouterr()
    og.render(fog(), size=(256, 192), progress=True)
    assert "%" in capsys.readouterr().err
    with pytest.raises(og.InputError, match="progress: expected a function"):
        og.render(fog(), progress=5)


@pytest.mark.parametrize("name", ["meshes/dart.off", "dose/dose.nrrd", "points/hedge.csv"])
@pytest.mark.filterwarnings("ignore")
def test_a_file_has_the_picture_of_the_command(command, name, tmp_path):
    place = tmp_path / "command.png"
    said = subprocess.run([command, "render", ASSETS / name, "--size", "64x48", "-o", place], capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    og.render(ASSETS / name, size=(64, 48)).save(tmp_path / "package.png")
    one, other = (hashlib.sha256((tmp_path / f"{kind}.png").read_bytes()).hexdigest() for kind in ("command", "package"))
    assert one == other


@pytest.mark.skipif(not Path("/proc/self/status").is_file(), reason="this system does not count a process's memory")
def test_memory_stays_flat_over_a_hundred_pictures():
    program = (
        "import re, numpy as np, organza as og\n"
        "from pathlib import Path\n"
        "def resident():\n"
        "    return int(re.search(r'VmRSS:\\s+(\\d+)', Path('/proc/self/status').read_text())[1]) * 1024\n"
        "def draw():\n"
        "    scene = og.Scene()\n"
        "    values = np.zeros((64, 64, 64))\n"
        "    values[30:34, 30:34, 30:34] = 1\n"
        "    scene.add_volume(values, transfer=og.transfer(), material='glow')\n"
        "    scene.material('glow', shading='unlit')\n"
        "    picture = og.render(scene, size=(32, 24))\n"
        "    picture.rgb, picture.to_srgb8(), picture._repr_png_()\n"
        "for _ in range(10): draw()\n"
        "before = resident()\n"
        "for _ in range(100): draw()\n"
        "print(before, resident())\n"
    )
    said = subprocess.run([sys.executable, "-W", "ignore", "-c", program], capture_output=True, text=True, check=True)
    before, after = map(int, said.stdout.split())
    # The volume of one picture is 1 MB: a hundred that stay would be 100 MB.
    assert after - before < 20e6, (before, after)


@pytest.mark.skipif(not Path("/proc/self/status").is_file(), reason="this system does not count a process's memory")
def test_a_million_points_are_copied_once():
    """Bytes that the way in takes at its peak: what is drawn (12 a point), and positions of double precision (24) until then."""
    program = (
        "import re, numpy as np, organza as og\n"
        "from pathlib import Path\n"
        "def peak():\n"
        "    return int(re.search(r'VmHWM:\\s+(\\d+)', Path('/proc/self/status').read_text())[1]) * 1024\n"
        "places = np.random.default_rng(0).random((4_000_000, 3), dtype=np.float32) + 1\n"
        "scene = og.Scene()\n"
        "scene.add_points(places[:10], name='few')\n"
        "before = peak()\n"
        "scene.add_points(places, name='many')\n"
        "print(peak() - before)\n"
    )
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    taken = int(said.stdout)
    assert taken < 1.05 * (12 + 24) * 4_000_000, taken
