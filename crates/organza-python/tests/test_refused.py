"""What is wrong is refused by name, and never ends the interpreter."""

import inspect
import re
from collections.abc import Iterator

import numpy as np
import pytest
from conftest import ASSETS, REPOSITORY

import organza as og

SMALL = (24, 18)
PLACES = np.zeros((4, 3))
CUBE = np.zeros((2, 2, 2))


def scene() -> og.Scene:
    return og.Scene()


REFUSED = {
    "shape of points": (lambda: scene().add_points(np.zeros((4, 2))), r"positions: expected the shape \(n, 3\)"),
    "text for points": (lambda: scene().add_points(np.array([["a", "b", "c"]])), "positions: expected an array of numbers"),
    "points that are not finite": (lambda: scene().add_points(np.full((2, 3), np.nan)), "row 0"),
    "infinite points": (lambda: scene().add_points([[0, 0, 0], [np.inf, 0, 0]]), "row 1"),
    "colours of another count": (lambda: scene().add_points(PLACES, colors=np.zeros((3, 3))), r"colors: expected the shape \(4, 3\)"),
    "values of another count": (lambda: scene().add_points(PLACES, values=np.zeros(5)), r"values: expected the shape \(4,\)"),
    "a map without a column": (lambda: scene().add_points(PLACES, colormap="magma"), "colormap"),
    "opacities beyond 1": (lambda: scene().add_points(PLACES, opacities=np.full(4, 2.0)), "opacity"),
    "an index beyond": (lambda: scene().add_mesh(PLACES, [[0, 1, 4]]), "faces: expected indices of 4 vertices, from 0, found 4 in face 0"),
    "a negative index": (lambda: scene().add_mesh(PLACES, [[0, 1, -1]]), "found -1 in face 0"),
    "an index with a part": (lambda: scene().add_mesh(PLACES, [[0, 1, 1.5]]), "found 1.5 in face 0"),
    "five sides": (lambda: scene().add_mesh(PLACES, np.zeros((1, 5), int)), r"faces: expected the shape \(n, 3\)"),
    "a flat volume": (lambda: scene().add_volume(np.zeros((2, 2))), r"values: expected the shape \(nz, ny, nx\)"),
    "no steps": (lambda: scene().add_volume(CUBE, spacing=0, transfer=og.transfer()), "spacing: expected finite steps above 0, found 0"),
    "an infinite voxel": (lambda: scene().add_volume(CUBE + np.inf, transfer=og.transfer()), "voxel"),
    "two looks": (lambda: scene().add_volume(CUBE, transfer=og.transfer(), preset="mri"), "transfer, preset"),
    "an unknown look": (lambda: scene().add_volume(CUBE, preset="x-ray"), "there is no such preset"),
    "an unknown map": (lambda: og.transfer("rainbow"), "colormap: expected one of"),
    "a range that falls": (lambda: og.transfer(clim=(1, 0)), "clim"),
    "an opacity of 2": (lambda: og.transfer(opacity=[0, 2]), "opacity"),
    "a thing of no kind": (lambda: scene().add(object()), "expected a file, a scene, an array"),
    "nothing": (lambda: og.render(), "what: expected"),
    "an empty scene's light": (lambda: scene().set("light.sun.intensity", 1), "expected one of none, found 'sun'"),
    "an object alone": (lambda: scene().set("object", 1), "its name alone"),
    "no threads": (lambda: og.render(PLACES + np.arange(4)[:, None], size=SMALL, threads=0), "threads: expected a whole number from 1 on, found 0"),
    "threads beyond number": (lambda: og.render(PLACES, size=SMALL, threads=10**30), "threads: expected at most"),
    "a size beyond number": (lambda: og.render(PLACES, size=(10**30, 72)), "size: expected at most"),
    "an azimuth beyond number": (lambda: og.render(PLACES, azimuth=10**400), "azimuth: expected a finite number"),
    "a direction in words": (lambda: og.render(PLACES, azimuth="left"), "azimuth: expected a finite number, found the text 'left'"),
    "faces behind their counts": (lambda: scene().add_mesh(PLACES, [[3, 0, 1, 2]] * 5), "faces: expected the corners of each face, found 3 before"),
    "bytes with a point": (lambda: scene().add_points(PLACES, colors=np.full((4, 3), 200.0)), "colors: expected linear numbers, 1 for white, found float64 up to 200"),
    "a mask of points": (lambda: scene().add_points(np.ma.masked_greater(np.eye(3), 0.5)), "row 0"),
    "colours beyond a byte": (lambda: scene().add_points(PLACES, colors=np.full((4, 3), 300)), "bytes of sRGB from 0 to 255, or uint16 of sRGB, found int64 from 300"),
    "colours below 0": (lambda: scene().add_points(PLACES, colors=np.full((4, 3), -1)), "colors: expected linear numbers"),
    "a key with a letter missing": (lambda: scene().add_points(PLACES, opacty=0.5), "add_points, 'points': expected an argument or a key of an object, found `opacty`; did you mean `opacity`"),
    "the word of matplotlib": (lambda: scene().add_points(PLACES, name="scan", cmap="jet"), "'scan'.*`cmap`; did you mean `colormap`"),
    "British colours": (lambda: scene().add_mesh(PLACES, [[0, 1, 2]], colour=(1, 0, 0)), "`colour`; did you mean `color`"),
    "the alpha of others": (lambda: scene().add_isosurface(CUBE, 0, alpha=0.5), "`alpha`; did you mean `opacity`"),
    "a source as a key": (lambda: scene().add_points(PLACES, mesh="a.ply"), "found `mesh`"),
    "a map that there is not": (lambda: scene().add_points(PLACES, values=np.zeros(4), colormap="jet"), "object 'points', colormap: expected one of viridis"),
    "an opacity beyond 1": (lambda: scene().add_points(PLACES, name="scan", opacity=2), "object 'scan', opacity: expected a number from 0 to 1"),
    "a key of a file": (lambda: scene().add(ASSETS / "points" / "hedge.csv", cmap="turbo"), "add, 'hedge.csv'.*`cmap`; did you mean"),
    "a key of labels": (lambda: scene().add_labels(np.ones((3, 3, 3), int), labels={1: {"colour": "red"}}), "object 'mesh', labels.1.colour: unknown key `colour`"),
    "a key of a light": (lambda: scene().light("point", position=(0, 0, 0), intensty=1, name="lamp"), "light 'lamp', intensty: unknown key"),
    "a kind of light": (lambda: scene().light("candle"), "candle"),
    "a key of a material": (lambda: scene().material("skin", roughnes=1), "material 'skin', roughnes: unknown key"),
    "a key of the scene": (lambda: scene().set("render.techniqe", "points"), "render.techniqe: unknown key `techniqe`"),
    "a technique": (lambda: scene().set("render.technique", "raster"), "render.technique: expected \"auto\""),
    "a key below a number": (lambda: scene().set("version.minor", 1), "expected a key below a table"),
    "a name twice": (lambda: [each.add_points(PLACES, name="scan") for each in [scene()] for _ in range(2)], "name: expected one that no object of the scene has, found 'scan'"),
    "a path for points": (lambda: scene().add_points("scan.ply"), "positions: expected an array, found a path; scene.add\\('scan.ply'\\) adds a file"),
    "a path for a mesh": (lambda: scene().add_mesh("a.obj", []), "scene.add\\('a.obj'\\)"),
    "points for a volume": (lambda: scene().add_volume(ASSETS / "points" / "hedge.csv"), "values: expected a volume, found points"),
    "steps of a file": (lambda: scene().add_volume(ASSETS / "dose" / "dose.nrrd", spacing=2), "spacing: expected none beside a file.*`voxel_size`"),
    "a look of points": (lambda: scene().add(PLACES, preset="mri"), "found `preset`"),
    "a look of a file of points": (lambda: scene().add(ASSETS / "points" / "hedge.csv", preset="ct-bone"), "`preset`"),
    "an array as a column": (lambda: scene().add_points(PLACES, color_by=np.zeros(4)), "color_by: expected the name of a column, found ndarray"),
    "an array as a key": (lambda: scene().add_points(PLACES, unlit=object()), "unlit: expected numbers, texts, lists or tables, found builtins.object"),
    "an effect that there is not": (lambda: og.render(PLACES + np.eye(4, 3), size=SMALL, effects={"shadow.moon": "off"}), "effects, 'shadow.moon': there is no effect"),
    "a state of an effect": (lambda: og.render(PLACES, effects={"shadow.sun": "no"}), "effects, 'shadow.sun': expected 'on', 'off' or 'auto', found 'no'"),
    "a picture filled twice": (lambda: og.render(PLACES + np.eye(4, 3), size=SMALL, fit=2), "^fit: expected"),
    "a size that is too large": (lambda: og.render(PLACES + np.eye(4, 3), size=(10**6, 4)), "^size: expected 1 to"),
    "rows of other lengths": (lambda: scene().add_points([[1, 2, 3], [1, 2]]), "rows of other lengths"),
    "a name that is none": (lambda: scene().add_points(PLACES, name=5), "name: expected a text"),
    "two steps": (lambda: scene().add_volume(CUBE, spacing=(1, 2)), "spacing: expected one number or three"),
    "a transfer by name": (lambda: scene().add_volume(CUBE, transfer="viridis"), "transfer: expected what organza.transfer makes"),
    "one number for a size": (lambda: og.render(PLACES, size=64), "size: expected a width and a height"),
    "a size with a part": (lambda: og.render(PLACES, size=(10.5, 10)), "size: expected a whole number from 1 on, found 10.5"),
    "negative threads": (lambda: og.render(PLACES, threads=-1), "threads: expected a whole number"),
    "memory in words": (lambda: og.render(PLACES, max_memory="1GB"), "max_memory: expected a whole number"),
    "no frames": (lambda: list(og.turntable(PLACES, 0)), "frames: expected a whole number"),
    "a range that is none": (lambda: scene().add_points(PLACES, values=np.zeros(4), clim=(np.nan, 1)), "expected finite numbers, found nan"),
    "two ways to place a camera": (lambda: scene().camera(position=(0, 0, 1), azimuth=5), "found both"),
    "no key": (lambda: scene().set("", 1), "expected a key and a value"),
    "no value": (lambda: scene().set("render.seed", None), "expected a key and a value"),
    "data as a scene": (lambda: og.Scene.load("bunny.ply"), "Scene.from_files takes data files"),
    "a radius below 0": (lambda: scene().add_points(PLACES, radius=-1, name="scan"), "object 'scan', radius: expected numbers above 0 .*, one or 4, found -1"),
    "a radius of nothing": (lambda: scene().add_points(PLACES, radius=[1, 2, 0, 3]), "radius: expected numbers above 0 .* found 0.0 in row 2"),
    "a radius with a unit": (lambda: scene().add_points(PLACES, radius="2mm"), "radius: .* found '2mm'"),
    "radii of another count": (lambda: scene().add_points(PLACES, radius=[1, 2]), r"radius: .* found the shape \(2,\)"),
    "a look of a material": (lambda: scene().material("w", preset="waxx"), "material 'w', preset: expected one of glass"),
    "a layer": (lambda: scene().set("render.layers", ["depht"]), "there is no layer `depht`(.|\n)*`depth`"),
    "a turn beyond the pole": (lambda: scene().camera.orbit(elevation=200), "camera.elevation: expected a number from -90 to 90, found 200"),
    "a picture filled by nothing": (lambda: scene().camera.orbit(fit=-1), "camera.fit: expected a number above 0"),
    "an angle of view": (lambda: scene().camera(fov_y=200), "camera.fov_y: expected degrees between 0 and 180"),
    "an eye at what it looks at": (lambda: scene().camera(position=(0, 0, 1), target=(0, 0, 1)), "target: expected another place than the position"),
    "an eye of two numbers": (lambda: scene().camera(position=(0, 1)), "position: expected three numbers"),
    "steps backwards": (lambda: scene().add_volume(CUBE, spacing=(-1, 1, 1)), "spacing: expected steps above 0, found .*`direction`"),
    "steps of no number": (lambda: scene().add_volume(CUBE, spacing=np.nan), "spacing: expected finite steps above 0, found nan"),
    "steps in words": (lambda: scene().add_volume(CUBE, spacing="1mm"), "spacing: expected one number or three, found '1mm'"),
    "directions in a plane": (lambda: scene().add_volume(CUBE, direction=np.zeros((3, 3))), "direction: expected three columns that span space"),
    "a volume without voxels": (lambda: scene().add_volume(np.zeros((0, 4, 4))), r"values: expected a volume with voxels, found the shape \(0, 4, 4\)"),
    "a level beyond": (lambda: scene().add_isosurface(CUBE + [0, 1], 50, name="bone"), "object 'bone', level: expected a value of the volume, which are 0 to 1, found 50"),
    "a level of gaps": (lambda: scene().add_isosurface(CUBE + np.nan, 0), "values: expected a voxel with a value, found none"),
    "a plane beyond": (lambda: scene().add_slice(CUBE + [0, 1], center=(0, 0, 9)), r"center: expected a plane through the volume, which lies from \[0.0, 0.0, 0.0\] to"),
    "no points": (lambda: scene().add_points(np.zeros((0, 3))), "positions: expected one row or more, found none"),
    "no faces": (lambda: scene().add_mesh(PLACES, np.zeros((0, 3), int), name="net"), "object 'net', faces: expected one row or more, found none"),
    "a field of half the depth": (lambda: scene().add_isosurface(CUBE + [0, 1], 0.5, field=CUBE[:1]), r"field: expected the shape \(2, 2, 2\) of `values`, found \(1, 2, 2\)"),
    "labels of nothing": (lambda: scene().add_labels(np.zeros((3, 3, 3), int)), "values: expected a label other than 0"),
    "a colour by name": (lambda: scene().add_points(PLACES, color="red"), "color: expected \"#rrggbb\" or three linear numbers from 0 to 1, found 'red'"),
    "a colour of bytes": (lambda: scene().ground(color=(255, 0, 10)), 'found the bytes .*; "#ff000a" is the same colour'),
    "a map of a volume": (lambda: scene().add_volume(CUBE, colormap="turbo"), r"found `colormap`; `transfer=og.transfer\('turbo'\)` takes a map"),
    "the ends of a volume's map": (lambda: scene().add_volume(CUBE, clim=(0, 1)), r"found `clim`; `transfer=og.transfer\(clim=\(0, 1\)\)`"),
    "an angle of a sun": (lambda: scene().light.sun(azimut=3), "light 'sun': expected one of azimuth, elevation, .*`azimut`; did you mean `azimuth`"),
    "a key of no sun": (lambda: scene().light.sun(shape=3, name="noon"), "light 'noon': expected one of azimuth, elevation, .*found `shape`$"),
    "a number for a size of points": (lambda: scene().add_points(PLACES, point_size=3), "found `point_size`; `radius` takes a number"),
    "a column for values": (lambda: scene().add_points(PLACES, values="temperature"), "values: .* found the text 'temperature'; `color_by='temperature'`"),
    "values of no number": (lambda: scene().add_points(PLACES, values=[0, 1, np.nan, 2], name="scan"), r"object 'scan', values: expected finite numbers, found nan in row 2; leave such rows out"),
    "values of a mesh of no number": (lambda: scene().add_mesh(np.eye(3), [[0, 1, 2]], values=[0, np.inf, 1], name="m"), r"object 'm', values: expected finite numbers, found inf in row 1"),
    "a shape of two sides": (lambda: scene().add_volume(np.zeros((3, 2))), r"values: expected the shape \(nz, ny, nx\), found \(3, 2\)"),
    "a shape of one side": (lambda: scene().add_points(PLACES, values=[1, 2]), r"values: expected the shape \(4,\), found \(2,\)"),
    "points of no number": (lambda: scene().add_points([[0, 0, 0], [np.nan, 0, 0]], name="scan"), r"object 'scan', positions: .*\[nan, 0.0, 0.0\] in row 1; leave such rows out"),
    "faces of VTK": (lambda: scene().add_mesh(PLACES, [3, 0, 1, 2, 3, 1, 2, 3], name="net"), r"object 'net', faces: .*`faces.reshape\(-1, 4\)\[:, 1:\]`"),
    "four sides of VTK": (lambda: scene().add_mesh(PLACES, [4, 0, 1, 2, 3]), r"faces: expected the shape \(m, 4\).*`faces.reshape\(-1, 5\)"),
    "the shape of an object's array": (lambda: scene().add_volume(np.zeros((2, 2)), name="ct"), "object 'ct', values: expected the shape"),
    "a name with a line": (lambda: scene().add_points(PLACES, name="a\nb"), "control characters"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_wrong_arguments_are_named(case):
    call, said = REFUSED[case]
    with pytest.raises(og.InputError, match=said):
        call()


def test_a_missing_file_is_told():
    with pytest.raises(FileNotFoundError, match="nothing.ply"):
        og.render("nothing.ply")


def test_a_wrong_scene_has_file_and_line(tmp_path):
    (tmp_path / "a.toml").write_text("version = 1\n[camera]\npositon = [0, 0, 1]\n")
    with pytest.raises(og.InputError, match=r"a\.toml:3"):
        og.render(tmp_path / "a.toml")


def test_too_much_memory_is_refused_before_anything_is_drawn():
    scene = og.Scene()
    scene.add_volume(np.zeros((64, 64, 64)), transfer=og.transfer())
    with pytest.raises(og.LimitError, match="^the scene needs [0-9]+ bytes"):
        og.render(scene, size=SMALL, max_memory=1000)
    assert issubclass(og.LimitError, MemoryError) and issubclass(og.InputError, ValueError)


def test_what_is_refused_changes_nothing():
    scene = og.Scene()
    scene.add_points(PLACES, name="scan")
    scene.camera.orbit(azimuth=20)
    before = scene.to_toml()
    for call in (
        lambda: scene.add_slice(CUBE, center=(0, 0, 9)),
        lambda: scene.add_volume(CUBE, transfer=og.transfer(), opacity=7),
        lambda: scene.camera.orbit(elevation=200),
        lambda: scene.camera(position=(0, 0, 1), target=(0, 0, 1)),
        lambda: scene.material("w", preset="waxx"),
        lambda: scene.set("render.layers", ["depht"]),
        lambda: scene.add_points(PLACES, opacity=7), lambda: scene.set("object.scan.opacity", 7), lambda: scene.set("camera.fovy", 7),
    ):
        with pytest.raises(og.InputError):
            call()
    assert scene.to_toml() == before


def test_a_material_may_be_stated_after_the_object_that_has_it():
    scene = og.Scene()
    scene.add_points(np.random.default_rng(0).normal(size=(100, 3)), material="clay")
    with pytest.raises(og.InputError, match=r"object 'points', material: .* \(none\), found 'clay'; scene.material\('clay', …\)"):
        og.render(scene, size=SMALL)
    scene.material("clay", shading="phong")
    assert og.render(scene, size=SMALL).alpha.max() > 0.5


@pytest.mark.parametrize("call", [og.render, og.turntable, og.explain, og.info, og.accuracy, og.orders, og.view])
def test_arguments_that_calls_do_not_have_are_named(call):
    near = "strict" if call is og.info else "effects"
    with pytest.raises(TypeError, match=f"{call.__name__}: expected one of its arguments, found `{near}s`; did you mean `{near}`"):
        call(PLACES, **{f"{near}s": None})
    with pytest.raises(TypeError, match="`cmap`; did you mean `colormap`"):
        og.transfer(cmap="turbo")


def test_arguments_that_cameras_do_not_have_are_named():
    with pytest.raises(TypeError, match="camera: expected one of its arguments, found `pos`; did you mean `position`"):
        scene().camera(pos=(0, 0, 1))
    with pytest.raises(TypeError, match="orbit: .*`azimut`; did you mean `azimuth`"):
        scene().camera.orbit(azimut=3)
    with pytest.raises(TypeError, match=r"render: .*`width`; `size=\(width, height\)`"):
        og.render(PLACES, width=64)


def test_a_size_may_be_an_array():
    points = np.random.default_rng(0).normal(size=(50, 3))
    assert og.render(points, size=np.array([24, 18])).size == (24, 18)


def test_calls_that_draw_take_the_same_arguments():
    names = {call: set(inspect.signature(call).parameters) for call in (og.render, og.turntable, og.explain, og.view, og.dask.frames, og.dask.sets)}
    own = {og.turntable: {"frames"}, og.explain: {"measure"}, og.view: {"height"}, og.dask.frames: {"count"}, og.dask.sets: {"count", "each", "seed"}}
    # What a page and an explanation have no use for, and what tasks on other machines cannot tell.
    less = {og.view: {"threads", "transparent"}, og.explain: {"transparent"}, og.dask.frames: {"progress"}, og.dask.sets: {"progress"}}
    # Pictures that belong together have the same settings, whatever time each takes.
    goal = {"budget_ms", "max_rmse", "max_flip"}
    for call, found in names.items():
        assert found == (names[og.render] | own.get(call, set())) - less.get(call, set()) - (set() if call is og.render else goal), call


def messages(*without: str) -> Iterator[str]:
    """The texts in the code of the renderer, without those of the command and its tests, and without those of some files by their names."""
    for path in sorted(REPOSITORY.glob("crates/*/src/**/*.rs")):
        part = path.parts[len(REPOSITORY.parts) + 1]
        if part in ("organza-cli", "organza-python", "organza-view") or path.stem in ("tests", *without):
            continue
        code = path.read_text(encoding="utf-8").split("#[cfg(test)]")[0]
        code = "\n".join(line for line in code.splitlines() if not line.strip().startswith("//"))
        for text in re.findall(r'"((?:[^"\\]|\\.)*)"', code, re.DOTALL):
            # A text goes on after the blanks of the next line.
            yield re.sub(r"\\\n\s*", "", text).replace('\\"', '"')


def test_no_message_has_the_words_of_the_command_line():
    """Every option that a message of the renderer names has a word of Python."""
    option = re.compile(r"--[a-z][a-z-]+")
    # Options of other programs, and variables of a style sheet.
    foreign = ("--raw", "--compress", "--accent", "--ink", "--soft", "--grid", "--faint", "--ground")
    # Messages of the command alone: what its options are called, and what Python cannot ask for.
    command = ("--allow-path", "--packed", "--labels", "--set ", "--effect ", "--frames {", "--turntable {", "--backend {")
    found = [text for text in messages() if option.search(text) and not any(known in text for known in foreign + command)]
    left = [said for said in map(og._organza.in_words, found) if option.search(said)]
    assert len(found) > 30 and not left, left
    assert og._organza.in_words("memory:scan: no memory: none") == "scan: no memory: none"


def test_no_message_has_the_words_of_a_scene_file():
    """Tables and keys that a message of the renderer names are calls and arguments of Python."""
    toml = re.compile(r"\[\[[a-z]+\]\]|\[(?:ambient|background|camera|render)[a-z_.]*\]|\b[a-z_]+ = (?:\"|\[|\{|[0-9]|true|false)|`[a-z_]+ = `")
    # First scenes are TOML themselves.
    texts = messages("first_scene", "lamps", "look", "point_colors", "html", "plot", "changes", "json", "write")
    filled = (re.sub(r"\{[^{}= ]*\}", "1", text.replace("{{", "⟨").replace("}}", "⟩")).replace("⟨", "{").replace("⟩", "}") for text in texts)
    found = [text for text in filled if toml.search(text)]
    left = [said for said in map(og._organza.in_words, found) if toml.search(said)]
    assert len(found) > 60 and not left, left


SAID = {
    'say which one counts: `transform = { up = "z" }`, or `auto = true`': 'say which one counts: `transform={"up": "z"}`, or `auto=True`',
    "move either, or set visible = false": "move either, or set visible=False",
    "it takes long. Set render.points.exact = true.": 'it takes long. Set scene.set("render.points.exact", True).',
    'use render.sheets.slicing = "view", or another': 'call scene.set("render.sheets.slicing", "view"), or another',
    "nodata = -3.5 in the [[object]] draws nothing there": "nodata=-3.5 as a key of the object draws nothing there",
    "shadow_cells = 9 of that [[light]], the most that fit, leave 3 %": "shadow_cells=9 of that light, or render.shadow.cells of all, the most that fit, leave 3 %",
    "shadow_cells = 9 of that [[light]] leaves a part": "shadow_cells=9 of that light, or render.shadow.cells of all, leaves a part",
    "a sentence in which a = b, and 1 = 1": "a sentence in which a = b, and 1 = 1",
    "a text that ends in a = ": "a text that ends in a = ",
    'an open one: a = "x': 'an open one: a = "x',
    "no letters: ö = [1, 2": "no letters: ö = [1, 2",
}


@pytest.mark.parametrize("said", SAID)
def test_assignments_are_those_of_python(said):
    assert og._organza.in_words(said) == SAID[said]


def test_malformed_calls_never_end_the_interpreter():
    rng = np.random.default_rng(3)
    wrong = [None, 0, -1, 1.5, np.nan, "x", b"x", [], [[]], {}, object(), np.zeros(0), np.zeros((0, 3)), np.array("x"), np.zeros((2, 2, 2, 2)), CUBE, True]
    wrong += [np.datetime64("2020"), np.zeros(3, complex), np.zeros(2, dtype=[("a", "f4")]), np.array([None]), 2**70, "\udc80", np.full((3, 3), 1e300)]
    calls = [
        lambda a, b: scene().add_points(a, values=b),
        lambda a, b: scene().add_points(PLACES, radius=a, colormap=b, values=b),
        lambda a, b: scene().add_points(PLACES, columns={"a": a}, color_by=b),
        lambda a, b: scene().add_points(PLACES, columns=a, clim=b),
        lambda a, b: scene().add_points(PLACES, opacity=a, name=b),
        lambda a, b: scene().add_mesh(a, b),
        lambda a, b: scene().add_mesh(PLACES, [[0, 1, 2]], normals=a, colors=b),
        lambda a, b: scene().add_volume(a, spacing=b),
        lambda a, b: scene().add_volume(CUBE, origin=a, direction=b),
        lambda a, b: scene().add_volume(CUBE, preset=a, transfer=b),
        lambda a, b: scene().add(a, name=b),
        lambda a, b: scene().camera(position=a, target=b),
        lambda a, b: scene().light(a, direction=b),
        lambda a, b: scene().material(a, color=b),
        lambda a, b: og.render(a, size=b),
        lambda a, b: og.render(PLACES, size=SMALL, effects=a, up=b),
        lambda a, b: og.render(PLACES, size=SMALL, fit=a, azimuth=b),
        lambda a, b: og.render(PLACES, size=SMALL, progress=a, max_memory=b),
        lambda a, b: og.explain(a, effects=b),
        lambda a, b: og.info(a, max_memory=b),
        lambda a, b: og.accuracy(a, finer=b),
        lambda a, b: og.orders(a, size=b),
        lambda a, b: list(og.turntable(a, b)),
        lambda a, b: og.transfer(clim=a, opacity=b),
        lambda a, b: og.transfer(a, unit_length=b),
        lambda a, b: og.Scene.load(a),
        lambda a, b: og.Scene.from_files(a, b),
        lambda a, b: scene().set(a, b),
        lambda a, b: scene().add_mesh(PLACES, [[0, 1, 2]], uv=a, texture=b),
        lambda a, b: scene().add_mesh(PLACES, [[0, 1, 2]], uv=np.zeros((4, 2)), texture=a, values=b),
        lambda a, b: scene().add_mesh(PLACES, [[0, 1, 2]], columns=a, opacities=b),
        lambda a, b: scene().add_isosurface(a, b),
        lambda a, b: scene().add_isosurface(CUBE, 0.5, spacing=a, origin=b),
        lambda a, b: scene().add_isosurface(CUBE, 0.5, field=a, clim=b),
        lambda a, b: scene().add_points(PLACES, field=CUBE, transfer=a, colormap=b),
        lambda a, b: scene().add_labels(CUBE, field=a, labels=b),
        lambda a, b: scene().add_volume(a, preset=b),
        lambda a, b: scene().add(a, color_by=b),
        lambda a, b: scene().add_slice(a, normal=b),
        lambda a, b: scene().add_slice(CUBE, center=a, clim=b),
        lambda a, b: scene().add_labels(a, labels=b),
        lambda a, b: scene().ground(size=a, height=b),
        lambda a, b: scene().ground(color=a, material=b),
        lambda a, b: scene().camera.orbit(a, b),
        lambda a, b: scene().light.sun(a, b),
        lambda a, b: scene().light.sun(irradiance=a, sky=b),
    ]
    is_known = (ValueError, TypeError, MemoryError, OSError, KeyError, AttributeError, IndexError, OverflowError)
    for rank in range(10 * len(calls)):
        one, other = (wrong[rng.integers(len(wrong))] for _ in range(2))
        try:
            calls[rank % len(calls)](one, other)
        except is_known:
            pass
        except BaseException as error:
            raise AssertionError(f"call {rank % len(calls)} of {one!r} and {other!r}: {error!r}") from error


def test_sides_beyond_what_indices_count_are_refused():
    many = np.broadcast_to(np.float32(0), (2**31, 3))
    with pytest.raises(og.LimitError, match="positions: expected at most 2147483647 rows, found 2147483648"):
        og.render(many, size=SMALL)


def test_a_color_is_that_of_its_bytes():
    stated = og.Scene()
    stated.add_points(PLACES, color="#ff8000", name="a")
    stated.add_points(PLACES, name="b")
    stated.set("object.b.color", "#ff8000")
    stated.material("clay", color="#ff8000")
    document = stated._document
    colors = [document["object"][0]["color"], document["object"][1]["color"], document["material"]["clay"]["color"]]
    assert colors[0] == colors[1] == colors[2] and np.allclose(colors[0], [1.0, 0.21586, 0.0], atol=1e-5)


def test_what_is_odd_is_noted():
    odd = og.Scene()
    odd.light.sun(elevation=-5)
    odd.add_labels(np.ones((3, 3, 3), int), labels={1: "bone", 99: "skin"}, name="regions")
    assert odd.notes == ["sun: it stands 5° below the horizon, and lights from below", "regions: `labels` names 99, which no voxel has"]
