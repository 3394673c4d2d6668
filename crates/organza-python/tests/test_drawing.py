"""Pictures from arrays and from files: the same bits, whichever way data came in."""

import json
import pickle
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import organza as og

ASSETS = Path(__file__).resolve().parents[3] / "assets"
SMALL = (48, 36)


def ball(side: int = 17) -> np.ndarray:
    """Values that fall from 1 in the middle of a cube to 0."""
    places = np.linspace(-1.0, 1.0, side)
    z, y, x = np.meshgrid(places, places, places, indexing="ij")
    return np.clip(1.0 - np.sqrt(x**2 + y**2 + z**2), 0.0, 1.0)


def tetrahedron() -> tuple[np.ndarray, np.ndarray]:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    return vertices, faces


def volume_scene(values: np.ndarray, **more: object) -> og.Scene:
    scene = og.Scene()
    scene.add_volume(values, transfer=og.transfer("magma", clim=(0, 1), opacity=[0, 0.3, 0.9]), **more)
    return scene


def test_a_picture_has_its_layers_as_arrays(tmp_path):
    scene = volume_scene(ball())
    scene.set("render.layers", ["depth", "effects"])
    picture = og.render(scene, size=SMALL)
    assert picture.size == SMALL
    assert picture.rgb.shape == (36, 48, 3) and picture.rgb.dtype == np.float32
    assert picture.alpha.max() > 0.3 and picture.alpha.min() == 0.0
    assert np.isfinite(picture["depth.median"]).any()
    assert picture["direct.R"].shape == (36, 48)
    with pytest.raises(KeyError, match="depth.median"):
        picture["nothing"]
    assert picture.to_srgb8().dtype == np.uint8
    for ending in ("png", "exr"):
        place = tmp_path / f"a.{ending}"
        picture.save(place)
        assert place.stat().st_size > 100
    with pytest.raises(FileExistsError, match="a.png"):
        picture.save(tmp_path / "a.png", force=False)
    assert picture._repr_png_().startswith(b"\x89PNG")
    assert {"effects", "passes"} <= set(picture.plan) and picture.cost


def test_a_transparent_picture_keeps_what_it_needs(tmp_path):
    scene = volume_scene(ball())
    scene.set("background.color", [0.2, 0.2, 0.2])
    picture = og.render(scene, size=SMALL, transparent=True)
    assert picture.to_srgb8(transparent=True).shape == (36, 48, 4)
    picture.save(tmp_path / "a.png", transparent=True)
    with pytest.raises(og.InputError, match="transparent=True"):
        og.render(scene, size=SMALL).save(tmp_path / "b.png", transparent=True)


@pytest.mark.parametrize("kind", [np.float64, np.float16, np.int16, np.uint8, np.int64, ">f4"])
def test_any_kind_of_numbers_is_the_same_volume(kind):
    values = np.round(ball() * 100)
    transfer = og.transfer(clim=(0, 100))
    scenes = [og.Scene(), og.Scene()]
    scenes[0].add_volume(values.astype(np.float32), transfer=transfer)
    scenes[1].add_volume(values.astype(kind), transfer=transfer)
    first, second = (og.render(scene, size=SMALL) for scene in scenes)
    assert np.array_equal(first.rgb, second.rgb)


def test_any_layout_is_the_same_volume():
    values = np.random.default_rng(1).random((5, 6, 7)).astype(np.float32)
    layouts = [
        values,
        np.asfortranarray(values),
        np.ascontiguousarray(values[::-1, ::-1, ::-1])[::-1, ::-1, ::-1],
        np.repeat(values, 2, axis=2)[:, :, ::2],
    ]
    readonly = values.copy()
    readonly.setflags(write=False)
    pictures = [og.render(volume_scene(layout), size=SMALL).rgb for layout in layouts + [readonly]]
    assert all(np.array_equal(pictures[0], other) for other in pictures[1:])


def test_axes_are_z_y_x():
    values = np.zeros((3, 4, 5))
    values[0, 0, 4] = 1.0
    scene = volume_scene(values, spacing=(2.0, 1.0, 1.0), origin=(10.0, 0.0, 0.0))
    scene.camera(position=(14, 1.5, 30), target=(14, 1.5, 0), fov_y=30)
    alpha = og.render(scene, size=(64, 64)).alpha
    row, column = np.unravel_index(alpha.argmax(), alpha.shape)
    # To the right, below the middle.
    assert column > 40 and row > 34


def test_arrays_draw_what_their_files_draw(tmp_path):
    vertices, faces = tetrahedron()
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    lines += ["property double x", "property double y", "property double z", f"element face {len(faces)}"]
    lines += ["property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(map(repr, map(float, vertex))) for vertex in vertices]
    lines += [" ".join(map(str, [3, *face])) for face in faces.tolist()]
    (tmp_path / "solid.ply").write_text("\n".join(lines) + "\n")
    text = "version = 1\n[camera]\nauto = true\nsize = [48, 36]\n[[light]]\nkind = 'directional'\n"
    text += "direction = [-1, -2, -1]\nirradiance = [3, 3, 3]\n[[object]]\nname = 'solid'\nmesh = 'solid.ply'\nopacity = 0.5\n"
    (tmp_path / "s.toml").write_text(text)
    scene = og.Scene()
    scene.add_mesh(vertices, faces, name="solid", opacity=0.5)
    scene.light(direction=(-1, -2, -1), irradiance=(3, 3, 3))
    of_file = og.render(tmp_path / "s.toml")
    assert np.array_equal(of_file.rgb, og.render(scene, size=SMALL).rgb)
    scene = og.Scene()
    scene.add(vertices)
    assert og.render(scene, size=SMALL).alpha.max() > 0.5


def test_a_file_alone_is_drawn_as_by_the_command():
    picture = og.render(ASSETS / "meshes" / "dart.off", size=SMALL)
    assert picture.alpha.max() > 0.9
    scene = og.Scene.from_files(ASSETS / "meshes" / "dart.off", size=SMALL)
    assert scene.objects == ["dart"]
    assert np.array_equal(og.render(scene, size=SMALL).rgb, picture.rgb)
    assert "[camera]" in scene.to_toml()


def test_points_have_their_columns_and_colours():
    rng = np.random.default_rng(2)
    places = rng.normal(size=(400, 3)) + 1e6
    # As single precision has them: `values` are drawn so.
    heat = rng.random(400).astype(np.float32)
    scene = og.Scene()
    scene.add_points(places, values=heat, clim=(0, 1), colormap="magma", name="hot", radius=0.2)
    picture = og.render(scene, size=SMALL)
    assert picture.alpha.max() > 0.9
    scene = og.Scene()
    scene.add_points(places, columns={"heat": heat}, color_by="heat", colormap="magma", clim=(0, 1), radius=0.2)
    assert np.array_equal(og.render(scene, size=SMALL).rgb, picture.rgb)
    scene = og.Scene()
    scene.add_points(places, colors=np.full((400, 3), 128, dtype=np.uint8))
    assert og.render(scene, size=SMALL).alpha.max() > 0.5
    with pytest.raises(og.InputError, match="warmth"):
        scene = og.Scene()
        scene.add_points(places, columns={"heat": heat}, color_by="warmth")
        og.render(scene, size=SMALL)


def test_points_that_lie_on_no_surface_are_balls():
    places = np.random.default_rng(5).random((2000, 3))

    def drawn(places, **keys):
        scene = og.Scene()
        scene.add_points(places, name="gas", **keys)
        scene.camera(position=(0.5, 0.5, 4), target=(0.5, 0.5, 0.5))
        scene.light(direction=(-1, -2, -1), irradiance=(3, 3, 3))
        return og.render(scene, size=SMALL)

    picture = drawn(places)
    assert any("lie on no surface" in note and '`discs="round"`' in note for note in picture.notes), picture.notes
    assert np.array_equal(picture.rgb, drawn(places, discs="balls").rgb)
    assert not np.array_equal(picture.rgb, drawn(places, discs="round").rgb)
    # Balls have the radius that is said.
    assert drawn(places, radius=0.005).alpha.mean() < 0.7 * drawn(places, radius=0.02).alpha.mean()
    flat = drawn(places * (1, 1, 0))
    assert not any("surface" in note for note in flat.notes), flat.notes


def test_a_scene_is_pickled_with_its_data():
    vertices, faces = tetrahedron()
    scene = volume_scene(ball(9), name="fog", spacing=(1, 1, 2), direction=np.eye(3)[[1, 0, 2]])
    scene.add_mesh(vertices, faces, name="solid", colors=np.eye(4, 3))
    scene.add_points(vertices + 3, normals=np.tile([0.0, 1.0, 0.0], (4, 1)), columns={"a": np.arange(4.0)}, radius=0.3)
    again = pickle.loads(pickle.dumps(scene))
    assert again.objects == ["fog", "solid", "points"]
    assert np.array_equal(og.render(scene, size=SMALL).rgb, og.render(again, size=SMALL).rgb)


def test_threads_change_nothing():
    scene = volume_scene(ball())
    one, many = (og.render(scene, size=SMALL, threads=threads).rgb for threads in (1, 3))
    assert np.array_equal(one, many)


def test_a_camera_that_was_placed_may_be_placed_anew():
    scene = og.Scene.from_files(ASSETS / "meshes" / "dart.off", size=SMALL)
    scene.camera(azimuth=120)
    assert og.render(scene).alpha.max() > 0.9
    scene.camera(position=(0, 0, 9), target=(0, 0, 0))
    scene.camera(elevation=40)
    assert og.render(scene).alpha.max() > 0.9


def test_options_of_another_format_are_refused(tmp_path):
    picture = og.render(volume_scene(ball()), size=SMALL)
    for name, options in [("a.png", {"half": True}), ("a.exr", {"deep": True}), ("a.exr", {"legend": True})]:
        with pytest.raises(og.InputError, match="expected a file that can have it"):
            picture.save(tmp_path / name, **options)
    with pytest.warns(UserWarning, match="there is no legend"):
        og.render(ASSETS / "meshes" / "dart.off", size=SMALL).save(tmp_path / "b.png", legend=True)


def test_a_scene_is_drawn_in_another_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(ASSETS)
    scene = og.Scene.from_files("meshes/dart.off", size=SMALL)
    here = og.render(scene).rgb
    monkeypatch.chdir(tmp_path)
    assert np.array_equal(og.render(scene).rgb, here)


def test_a_mask_is_a_gap():
    values = ball()
    masked = np.ma.masked_less(values, 0.3)
    gaps = np.where(values < 0.3, np.nan, values)
    first, second = (og.render(volume_scene(data), size=SMALL).rgb for data in (masked, gaps))
    assert np.array_equal(first, second)


def test_numbers_that_fit_no_memory_are_refused():
    program = (
        "import resource, numpy as np, organza as og\n"
        "resource.setrlimit(resource.RLIMIT_AS, (4_000_000_000, 4_000_000_000))\n"
        "try:\n"
        "    og.Scene().add_points(np.broadcast_to(np.float32(1), (400_000_000, 3)))\n"
        "except og.LimitError as error:\n"
        "    print(error)\n"
    )
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert "positions: there is no memory of 9600000000 bytes" in said


def test_a_turntable_goes_around():
    vertices, faces = tetrahedron()
    scene = og.Scene()
    scene.add_mesh(vertices, faces)
    pictures = list(og.turntable(scene, 4, size=SMALL))
    assert len(pictures) == 4
    assert not np.array_equal(pictures[0].rgb, pictures[1].rgb)


def test_others_run_while_a_picture_is_drawn():
    scene = volume_scene(ball(65))
    scene.set("render.technique", "points")
    counted = [0]
    is_done = threading.Event()

    def count() -> None:
        while not is_done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    other = threading.Thread(target=count)
    other.start()
    heard: list[tuple[str, float]] = []
    og.render(scene, size=(256, 192), progress=lambda stage, share: heard.append((stage, share)))
    is_done.set()
    other.join()
    assert counted[0] > 3
    assert all(0.0 <= share <= 1.0 for _, share in heard)


def test_an_interrupt_ends_a_picture():
    program = (
        "import signal, sys, numpy as np, organza as og\n"
        # Shells start what they leave in the background without interrupts, which children inherit.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "scene = og.Scene()\n"
        "scene.add_volume(np.random.default_rng(0).random((150, 150, 150)), transfer=og.transfer())\n"
        "scene.set('render.technique', 'particles')\n"
        "scene.set('render.particles.repeat_level', 4000)\n"
        "print('drawing', flush=True)\n"
        "og.render(scene, size=(640, 480))\n"
    )
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert child.stdout is not None and child.stdout.readline() == "drawing\n"
    time.sleep(2.0)
    assert child.poll() is None, child.communicate()
    child.send_signal(2)
    _, said = child.communicate(timeout=60)
    assert child.returncode != 0 and "KeyboardInterrupt" in said, said


def test_a_caller_that_raises_ends_a_picture():
    def stop(stage: str, share: float) -> None:
        raise RuntimeError("enough")

    scene = volume_scene(ball(65))
    with pytest.raises(RuntimeError, match="enough"):
        og.render(scene, size=(512, 384), progress=stop)


def test_a_long_drawing_is_announced_before_it_begins(capsys):
    class Enough(Exception):
        pass

    scene = og.Scene()
    scene.add_points(np.random.default_rng(0).normal(size=(500, 3)), opacity=0.5, radius=1)
    scene.set("render.technique", "particles")
    scene.set("render.particles.repeat_level", 1024)
    said = ""

    def stop(stage: str, share: float) -> None:
        nonlocal said
        said += capsys.readouterr().err
        if "drawing takes about" in said:
            raise Enough

    with pytest.raises(Enough):
        og.render(scene, size=(1024, 768), progress=stop)
    assert said.startswith("drawing takes about ") and said.endswith("\n")


def test_a_file_without_16_bits_is_refused(tmp_path):
    picture = og.render(np.random.default_rng(0).normal(size=(50, 3)), size=(24, 18))
    for name in ("a.jpg", "a.webp", "a.exr"):
        with pytest.raises(og.InputError, match="deep: expected a file that can have it"):
            picture.save(tmp_path / name, deep=True)
    for name in ("a.jpeg", "a.webp", "a.png"):
        picture.save(tmp_path / name)
    assert len(list(tmp_path.iterdir())) == 3


def test_an_effect_has_its_predicted_seconds():
    scene = og.Scene()
    scene.add_points(np.random.default_rng(0).normal(size=(50, 3)), name="scan")
    predicted = og.explain(scene, size=(24, 18))["predicted"]
    effect = next(effect for effect in predicted["effects"] if effect["name"] == "object.scan")
    assert effect["seconds"] > 0.0 and set(effect) == {"name", "seconds", "bytes", "passes"}
    assert set(predicted) == {"seconds", "threads", "seconds_of_one_core", "by", "passes", "announcement", "effects"}


def test_a_picture_keeps_to_an_error_or_a_time(tmp_path):
    scene = volume_scene(ball(), name="ball")
    scene.set("render.technique", "particles")
    scene.set("render.particles.repeat_level", 64)
    plain = og.render(scene, size=SMALL)
    assert plain.goal is None
    picture = og.render(scene, size=SMALL, max_rmse=0.2)
    assert picture.goal["max_rmse"] == 0.2 and picture.goal["budget_ms"] is None
    assert any(setting["key"] == "render.particles.repeat_level" for setting in picture.goal["given_up"]), picture.goal
    assert picture.goal["expected_rmse"] <= 0.2 and len(picture.goal["ladder"]) > 1
    # The settings that were taken draw the same picture, and its file tells them.
    again = volume_scene(ball(), name="ball")
    again.set("render.technique", "particles")
    for setting in picture.goal["given_up"]:
        again.set(setting["key"], json.loads(setting["taken"]))
    assert np.array_equal(og.render(again, size=SMALL).rgb, picture.rgb)
    picture.save(tmp_path / "a.png")
    image = pytest.importorskip("PIL.Image").open(tmp_path / "a.png")
    told = json.loads(image.text["organza:scene"])["render"]
    assert "max_rmse" not in told and told["particles"]["repeat_level"] == again._document["render"]["particles"]["repeat_level"]
    # A key of the scene is the same as an argument.
    scene.set("render.max_rmse", 0.2)
    assert og.render(scene, size=SMALL).goal["given_up"] == picture.goal["given_up"]
    assert og.render(scene, size=SMALL, budget_ms=600_000).goal["budget_ms"] == 600_000
    # Pictures of a turn have the same settings each.
    with pytest.warns(UserWarning, match="a time or an error to keep to"):
        frames = list(og.turntable(scene, 2, size=SMALL))
    assert all(frame.goal is None for frame in frames)
    for wrong, said in [({"budget_ms": 0}, "budget_ms: expected .*1 to 86400000"), ({"max_flip": 2}, "max_flip.*at most 1"), ({"max_rmse": "a"}, "max_rmse: expected a finite number")]:
        with pytest.raises(og.InputError, match=said):
            og.render(scene, size=SMALL, **wrong)
    with pytest.raises(og.LimitError, match="use budget_ms=[0-9]+, or a smaller `size`"):
        og.render(scene, size=(200, 150), budget_ms=1)
