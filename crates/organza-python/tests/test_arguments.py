"""What arguments may be: arrays of any kind of numbers, maps of other libraries, ends that the data has, names with dots, and what is wrong in words."""

import inspect
import warnings

import numpy as np
import organza as og
import pytest
from conftest import ASSETS

SMALL = (32, 24)
PLACES = np.random.default_rng(0).normal(size=(40, 3))
VALUES = np.linspace(0.0, 255.0, 40)
CUBE = np.indices((6, 6, 6)).sum(0) * 17.0
TRIANGLE = (np.eye(3), [[0, 1, 2]])


def points(**shown) -> og.Scene:
    scene = og.Scene()
    scene.add_points(PLACES, name="cloud", **shown)
    return scene


def shown_by(scene: og.Scene) -> dict:
    return scene._document["object"][0]


def mesh_of_vtk():
    return pytest.importorskip("pyvista").Sphere(theta_resolution=8, phi_resolution=8)


LABELS = np.where(np.indices((6, 6, 6)).sum(0) > 8, 2**24 + 1, 0)

REFUSED = {
    "a volume of nearly one number": (lambda: og.Scene().add_volume(1e9 + CUBE), r"values: expected values that single precision tells apart, .*`values - 1e\+09`"),
    "an isosurface of such": (lambda: og.Scene().add_isosurface(1e6 + 0.001 * CUBE, 1e6), "values: .*single precision"),
    "a column twice": (lambda: points(values=VALUES, columns={"value": VALUES}), "values, columns: expected the column `value` once"),
    "labels that are too large": (lambda: og.Scene().add_labels(LABELS), "values: expected labels of at most 16777216, found 16777217; .*return_inverse"),
    "an empty path": (lambda: og.Scene().add(""), "thing: expected the path of a file, found an empty text"),
    "an empty path to draw": (lambda: og.render(""), "what: expected the path of a file, found an empty text"),
    "a picture wider than any": (lambda: og.render(PLACES, size=(10**10, 10)), "size: expected 1 to 65536 pixels a side"),
    "an infinite voxel": (lambda: og.Scene().add_volume(np.where(CUBE == 17.0, np.inf, CUBE)), r"values: expected voxels of finite numbers, or NaN for a gap, found inf at \[0, 0, 1\]"),
    "another name": (lambda: points().set("object.cloud.name", "other"), r"object.cloud.name: .*`remove` takes an object away"),
    "numbers beyond any": (lambda: points(values=[10**400] * 40), "values: .*larger than any of double precision"),
    "masked places": (lambda: og.Scene().add_points(np.ma.masked_equal(np.eye(3), 1.0)), "positions: .*in row 0, which is masked"),
    "no length": (lambda: og.transfer(unit_length=0), "unit_length: expected a length above 0, found 0"),
    "a ragged list": (lambda: og.Scene().add_points([[1, 2, 3], [4, 5, 6], [7, 8]]), r"positions: expected an array of numbers, found rows of other lengths: 3 numbers in row 0, 2 numbers in row 2"),
    "a ragged volume": (lambda: og.Scene().add_volume([[[1, 2], [3]]]), r"values: .*2 numbers in row 0, 1 number in row 1"),
    "ragged faces": (lambda: og.Scene().add_mesh(np.eye(3), [[0, 1, 2], [0, 1, 2, 0]]), "faces: .*3 numbers in row 0, 4 numbers in row 1"),
    "a ragged array to add": (lambda: og.Scene().add([[1, 2, 3], [1]]), "the array: .*in row 1"),
    "ragged radii": (lambda: points(radius=[[1], [1, 2]]), "radius: .*in row 1"),
    "a ragged place": (lambda: og.Scene().camera(position=[[0, 1], [2]], target=(0, 0, 0)), "position: expected three numbers"),
    "texts for coordinates": (lambda: og.Scene().add_points(np.array([["1", "2", "3"]])), r"positions: .*found texts, of which the first is '1'; `array.astype\(float\)`"),
    "complex numbers": (lambda: points(values=VALUES + 1j), r"object 'cloud', values: .*complex ones \(complex128\); give `abs\(array\)`"),
    "a complex volume": (lambda: og.Scene().add_volume(CUBE + 1j), "values: .*complex"),
    "times": (lambda: points(values=np.arange(40).astype("datetime64[s]")), r"values: .*times \(datetime64\[s\]\); `\(times - times.min\(\)\)"),
    "spans of time": (lambda: points(columns={"age": np.arange(40).astype("timedelta64[s]")}), "columns, 'age': .*spans of time"),
    "objects": (lambda: points(values=np.array([*range(39), "x"], dtype=object)), r"values: .*objects of Python, of which that at \[39\] is 'x'"),
    "records": (lambda: og.Scene().add_points(np.zeros(4, dtype=[("x", "f4"), ("y", "f4")])), r"positions: .*one of the fields x, y; `array\['x'\]`"),
    "a set": (lambda: og.Scene().add_points({1, 2}), "positions: .*found set"),
    "an array for columns": (lambda: points(columns=np.zeros(40)), r"columns: expected arrays by name, such as \{\"temperature\": array\}, found an array of the shape \(40,\); `values`"),
    "a number for columns": (lambda: points(columns=5), "columns: expected arrays by name.*found 5$"),
    "a column of another count": (lambda: points(columns={"heat": [1, 2]}), r"columns, 'heat': expected the shape \(40,\), found \(2,\)"),
    "a column of a mesh of another count": (lambda: og.Scene().add_mesh(*TRIANGLE, columns={"heat": [1, 2]}), r"columns, 'heat': expected the shape \(3,\) of vertices or \(1,\) of faces, found \(2,\)"),
    "values of a mesh of another count": (lambda: og.Scene().add_mesh(*TRIANGLE, values=[1, 2]), r"values: expected the shape \(3,\) of vertices or \(1,\) of faces, found \(2,\)"),
    "an array for a map": (lambda: points(values=VALUES, colormap=np.zeros((9, 3))), r"colormap: expected the name of a map, .*found an array of the shape \(9, 3\); colours of a display are bytes"),
    "a number for a map": (lambda: og.transfer(3), "colormap: expected the name of a map, .*found 3"),
    "a function that is no map": (lambda: og.transfer(abs), "colormap: .*function whose colours have the shape"),
    "a map without a column": (lambda: points(colormap=["#000000", "#ffffff"]), "colormap: expected a column to colour by, found none"),
    "a map of colours by logarithm": (lambda: points(values=VALUES, colormap=["#000000", "#ffffff"], log_scale=True), "colormap: .*`log_scale`, which takes a map by its name"),
    "a map beside a table": (lambda: points(columns={"a": VALUES}, color_by={"column": "a"}, colormap="turbo"), "expected the keys `map`, `range` and `scale`"),
    "an open end of a column of drawing": (lambda: points(color_by="height", clim=(0, None)), "clim: expected two numbers for the column 'height'"),
    "an open end of a file": (lambda: og.Scene().add(ASSETS / "points" / "hedge.csv", color_by="x", clim=(0, None)), "clim: expected two numbers for a file"),
    "an end beyond the data": (lambda: points(values=VALUES, clim=(300, None)), r"clim: expected two growing numbers, found \(300.0, None\), and .* in the data"),
    "ends in words": (lambda: points(values=VALUES, clim=("a", "b")), "clim: expected two growing numbers"),
    "one end": (lambda: points(values=VALUES, clim=5), "clim: expected two growing numbers.*found 5"),
    "a path of no text": (lambda: points().set(3, 1), "key: expected a text, such as 'render.technique', found 3"),
    "a mesh of VTK for points": (lambda: og.Scene().add_points(mesh_of_vtk()), r"positions: expected an array, found pyvista.PolyData; scene.add\(x\) takes it"),
    "a mesh of VTK for a mesh": (lambda: og.Scene().add_mesh(mesh_of_vtk()), r"vertices: expected an array, found pyvista.PolyData; scene.add\(x\) takes it"),
    "a mesh of VTK for a volume": (lambda: og.Scene().add_volume(mesh_of_vtk()), r"values: expected a volume, found pyvista.PolyData, which is a mesh; scene.add\(x\) takes it"),
    "a mesh of VTK for a field": (lambda: points(field=mesh_of_vtk()), "field: expected a volume, found pyvista.PolyData"),
    "no faces": (lambda: og.Scene().add_mesh(np.eye(3)), "faces: expected indices of vertices, .* found none"),
    "a mapping for coordinates": (lambda: og.Scene().add_points({"x": [0], "y": [1]}), r"positions: expected an array, found a mapping of x, y; `np.column_stack"),
    "a mapping to add": (lambda: og.Scene().add({"x": [0]}), "found builtins.dict; Scene.add_points takes positions"),
    "coordinates in columns": (lambda: og.Scene().add_points(PLACES.T), r"positions: expected the shape \(n, 3\), found \(3, 40\); `positions.T` has rows of three"),
    "coordinates of a plane": (lambda: og.Scene().add_points(PLACES[:, :2]), r"positions: expected the shape \(n, 3\), found \(40, 2\); `np.column_stack\(\[positions, np.zeros"),
    "a series of volumes": (lambda: og.Scene().add_volume(np.zeros((2, 3, 3, 3))), r"values: .* found \(2, 3, 3, 3\); take one volume of a series"),
    "a window of a tomogram": (lambda: og.Scene().add_volume(CUBE, window=400), r"found `window`; `transfer=og.transfer\(clim="),
    "an end of a volume's map": (lambda: og.Scene().add_volume(CUBE, vmin=4), r"`transfer=og.transfer\(clim=\(4, None\)\)`"),
    "the map of a scene file": (lambda: points(values=VALUES, map="turbo"), "found `map`; did you mean `colormap`"),
    "a map of matplotlib by name": (lambda: points(values=VALUES, colormap="jet"), r"colormap: expected one of viridis(.|\n)*a colormap of matplotlib"),
    "a list for labels": (lambda: og.Scene().add_labels(np.ones((3, 3, 3), int), labels=["bone"]), r'labels: expected whole numbers with their names, such as \{1: "bone"\}.*found \[.bone.\]'),
    "labels by their names": (lambda: og.Scene().add_labels(np.ones((3, 3, 3), int), labels={"bone": 1}), "labels: .*found 'bone' in the place of a number"),
    "a colour of a label in bytes": (lambda: og.Scene().add_labels(np.ones((3, 3, 3), int), labels={1: {"color": (255, 0, 0)}}), 'labels, 1, color: .*"#ff0000" is the same colour'),
    "labels for points": (lambda: points(labels={1: "bone"}), "labels.*belongs to a `mesh` of a volume of labels(.|\n)*`scene.add_labels` takes a volume of labels"),
    "steps in a ragged list": (lambda: og.Scene().add_volume(CUBE, spacing=[1, [2]]), "spacing: expected an array of numbers, found rows of other lengths"),
    "a flat field": (lambda: points(field=np.zeros((3, 3))), r"field, values: expected the shape \(nz, ny, nx\), found \(3, 3\)"),
    "a flag of files": (lambda: og.render(PLACES, size=SMALL).save("a.png", deep=1), "^deep: expected True or False, found 1"),
    "labels that are none": (lambda: og.Scene().add_labels(np.full((3, 3, 3), -1)), "values: expected a label other than 0 and -1, which are nothing"),
    "labels below none": (lambda: og.Scene().add_labels(np.full((3, 3, 3), -5)), "values: expected whole numbers from 0 that name regions, or -1 for none, found -5"),
    "labels with a part": (lambda: og.Scene().add_labels(np.full((3, 3, 3), 1.5)), "values: expected whole numbers .* found 1.5"),
    "an angle in words": (lambda: points().camera.orbit(azimuth="left"), "^azimuth: expected a finite number, found the text 'left'"),
    "a size of a camera": (lambda: points().camera(size=(64.5, 3)), "^size: expected a whole number from 1 on, found 64.5"),
    "a look of no text": (lambda: og.render(PLACES, preset=5), "^preset: expected the name of a look, found 5"),
    "a column of no text": (lambda: og.render(PLACES, color_by=VALUES), r"^color_by: expected the name of a column, found an array of the shape \(40,\)"),
    "a ground of no flag": (lambda: og.render(PLACES, ground="yes"), "^ground: expected True or False, found 'yes'"),
    "a wish of a scene": (lambda: og.render(points(), azimuth=0), "azimuth: expected data, found a scene"),
    "transparency of no flag": (lambda: og.render(points(), transparent=1), "^transparent: expected True or False, found 1"),
    "a measure of no flag": (lambda: og.explain(points(), measure="yes"), "^measure: expected True or False"),
    "a height of a page": (lambda: og.view(points(), height=-1), "^height: expected a whole number of pixels from 1 on, found -1"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_wrong_arguments_are_named_with_what_to_do(case):
    call, said = REFUSED[case]
    with pytest.raises(og.InputError, match=said):
        call()


CALLS = [og.render, og.turntable, og.explain, og.info, og.accuracy, og.orders, og.view, og.dask.frames, og.dask.sets]


@pytest.mark.parametrize("call", CALLS)
def test_threads_memory_and_progress_are_checked_by_every_call(call):
    """Each call refuses by its own name, before anything is drawn."""
    what = str(ASSETS / "points" / "hedge.csv")
    parameters = inspect.signature(call).parameters
    wrong = {
        "threads": ([-1, 0, 1.5, "2", True, np.nan, [1]], "threads: expected a whole number from 1 on, found"),
        "max_memory": ([-1, 0, 1.5, "2", True, np.inf], "max_memory: expected (a whole number of bytes from 1 on|at most .* bytes), found"),
        "progress": ([-1, 0, 1.5, "2", [1]], "progress: expected a function of a stage and a share, a bar of tqdm, or True, found"),
        "strict": ([1, "yes", None], "strict: expected True or False, found"),
        "drop_invalid": ([1, "yes", None], "drop_invalid: expected True or False, found"),
    }
    for name in wrong.keys() & parameters.keys():
        values, said = wrong[name]
        for value in values:
            with pytest.raises(og.InputError, match=f"^{said}"):
                call(what, **{name: value})


def test_a_class_of_bars_makes_a_bar():
    tqdm = pytest.importorskip("tqdm")
    assert og.render(points(), size=SMALL, progress=tqdm.tqdm, threads=np.int64(1), max_memory=2.0**30).size == SMALL
    assert og.render(points(), size=SMALL, progress=np.bool_(False)).size == SMALL


@pytest.mark.parametrize("kind", ["float16", "longdouble", ">f4", "int16", "uint8", "bool", "object", "masked"])
def test_numbers_of_any_kind_are_taken(kind):
    places = np.array([[0, 0, 0], [1, 0, 1], [0, 1, 1]])
    other = np.ma.masked_array(places, mask=False) if kind == "masked" else places.astype(kind)
    scene = og.Scene()
    scene.add_points(other, columns={"weight": other[:, 0]}, name="other")
    arrays = scene._data["other"].arrays()
    assert np.array_equal(arrays["positions"], places) and np.array_equal(arrays["columns"]["weight"], places[:, 0])


def test_none_among_objects_is_a_gap():
    scene = og.Scene()
    scene.add_points(np.eye(3), columns={"a": np.array([1, None, 2.5], dtype=object)})
    assert np.array_equal(scene._data["points"].arrays()["columns"]["a"], [1.0, np.nan, 2.5], equal_nan=True)


def test_columns_may_be_a_data_frame():
    class Frame:
        """What a data frame of pandas has of a mapping."""

        columns = ("heat",)

        def items(self):
            return [("heat", VALUES)]

    assert "heat" in points(columns=Frame())._data["cloud"].arrays()["columns"]


def test_an_open_end_is_that_of_the_data():
    low, high = np.percentile(VALUES, [1, 99])
    for clim, ends in [((None, 7), [low, 7]), ((5, None), [5, high])]:
        assert shown_by(points(values=VALUES, clim=clim))["color_by"]["range"] == pytest.approx(ends)
    assert "range" not in shown_by(points(values=VALUES, clim=(None, None)))["color_by"]
    by_place = shown_by(points(color_by="z", clim=(None, 9)))["color_by"]["range"]
    assert by_place == pytest.approx([np.percentile(PLACES[:, 2], 1), 9])
    scene = og.Scene()
    scene.add_slice(CUBE, clim=(None, 100))
    ends = [shown_by(scene)["transfer"][rank]["value"] for rank in (0, -1)]
    assert ends == pytest.approx([np.percentile(CUBE, 1), 100])


def test_a_transfer_function_without_ends_has_those_of_the_data():
    volume = og.Scene()
    volume.add_volume(CUBE, transfer=og.transfer("magma"), name="fog")
    values = [point["value"] for point in shown_by(volume)["transfer"]]
    assert [values[0], values[-1]] == pytest.approx(np.percentile(CUBE, [1, 99]))
    half = og.Scene()
    half.add_volume(CUBE, transfer=og.transfer("magma", clim=(50, None)))
    assert shown_by(half)["transfer"][0]["value"] == 50
    cloud = points(values=VALUES, transfer=og.transfer("magma"))
    assert shown_by(cloud)["transfer"][-1]["value"] == pytest.approx(np.percentile(VALUES, 99))
    # One value alone is not saturated.
    flat = og.Scene()
    flat.add_volume(np.zeros((3, 3, 3)), transfer=og.transfer("magma"))
    assert [shown_by(flat)["transfer"][rank]["value"] for rank in (0, -1)] == [0.0, 1.0]


def test_a_map_that_diverges_has_zero_in_its_middle():
    signed = CUBE - 100
    farther = max(-np.percentile(signed, 1), np.percentile(signed, 99))
    slices = og.Scene()
    slices.add_slice(signed, colormap="coolwarm")
    slices.add_volume(signed, transfer=og.transfer("coolwarm"))
    for thing in slices._document["object"]:
        assert [thing["transfer"][rank]["value"] for rank in (0, -1)] == pytest.approx([-farther, farther])
    stated = og.Scene()
    stated.add_slice(signed, colormap="coolwarm", clim=(None, 50))
    assert shown_by(stated)["transfer"][0]["value"] == pytest.approx(np.percentile(signed, 1))


def test_a_transfer_function_without_ends_has_those_of_a_file():
    dose = str(ASSETS / "dose" / "dose.nrrd")
    shares = dict(map(tuple, og.info(dose)["quantiles"]))
    scene = og.Scene()
    scene.add_volume(dose, transfer=og.transfer("magma"))
    assert [shown_by(scene)["transfer"][rank]["value"] for rank in (0, -1)] == pytest.approx([shares[0.01], shares[0.99]])


def test_a_map_may_be_one_of_matplotlib_or_a_list_of_colours():
    grey = lambda places: np.stack([places, places, places, np.ones_like(places)], -1)  # noqa: E731
    of_function = og.transfer(grey, clim=(0, 1)).points
    assert len(of_function) >= 256
    colors = {round(point["value"], 6): point["color"] for point in of_function}
    # Half of a display's brightness (IEC 61966-2-1).
    assert colors[1.0] == pytest.approx([1.0] * 3) and colors[0.0] == [0.0] * 3
    middle = min(of_function, key=lambda point: abs(point["value"] - 0.5))
    assert middle["color"][0] == pytest.approx(0.2140, abs=0.003)
    of_list = og.transfer(["#000000", "#ffffff"], clim=(0, 1)).points
    assert of_list[16]["color"] == pytest.approx([0.21404] * 3, abs=1e-4)
    of_bytes = og.transfer(np.array([[0, 0, 0], [255, 255, 255]], np.uint8), clim=(0, 1)).points
    assert [point["color"] for point in of_bytes] == [point["color"] for point in of_list]
    looks = [{"colormap": look, "clim": (0, 255)} for look in (grey, ["#000000", "#ffffff"])]
    one, other = (og.render(points(values=VALUES, radius=0.3, unlit=True, **look), size=SMALL).rgb for look in looks)
    assert np.allclose(one, other, atol=0.01) and one.max() > 0.1


def test_a_colormap_of_matplotlib_is_sampled():
    viridis = pytest.importorskip("matplotlib").colormaps["viridis"]
    one, other = (og.render(points(values=VALUES, radius=0.3, unlit=True, colormap=look, clim=(0, 255)), size=SMALL).rgb for look in (viridis, "viridis"))
    # The map of that name goes through ten of its colours.
    assert np.abs(one - other).max() < 0.04


def test_a_name_with_dots_is_reached():
    scene = points()
    scene.add_points(PLACES, name="scan.v2.ply")
    scene.light("point", position=(0, 5, 0), intensity=(3, 3, 3), name="lamp.left")
    scene.material("wax.red", shading="phong")
    objects = [('"scan.v2.ply"', 1), ("scan.v2.ply", 1), ("'scan.v2.ply'", 1), ('"cloud"', 0), ("cloud", 0), ("1", 1)]
    for name, rank in objects:
        scene.set(f"object.{name}.opacity", 0.25)
        assert scene._document["object"][rank].pop("opacity") == 0.25
    scene.set('"light"."lamp.left".shadow', False)
    scene.set("light.lamp.left.intensity", (4, 4, 4))
    assert scene._document["light"][0]["shadow"] is False and scene._document["light"][0]["intensity"] == [4, 4, 4]
    scene.set("material.wax.red.shininess", 9)
    scene.set('material."wax.blue".shading', "phong")
    assert set(scene._document["material"]) == {"wax.red", "wax.blue"}
    scene.set('render.effects."shadow.lamp.left"', "off")
    assert scene._document["render"]["effects"] == {"shadow.lamp.left": "off"}


def test_names_of_which_one_begins_another_are_told_apart_by_quotes():
    scene = og.Scene()
    for name in ("a", "a.b"):
        scene.add_points(PLACES, name=name)
    with pytest.raises(og.InputError, match=r"object.a.b.opacity: expected one name, found the beginnings 'a', 'a.b'; .*object.\"a\".b.opacity or object.\"a.b\".opacity"):
        scene.set("object.a.b.opacity", 0.5)
    scene.set('object."a.b".opacity', 0.5)
    scene.set("object.a.opacity", 0.25)
    assert [thing["opacity"] for thing in scene._document["object"]] == [0.25, 0.5]
    for path, said in [('object."a.opacity', "a key in quotes"), ('object."a"b.opacity', "a key in quotes"), ('object."a.b"', "its name alone"), ('object."c".opacity', "expected one of a, a.b, found 'c'")]:
        with pytest.raises(og.InputError, match=said):
            scene.set(path, 0.5)


def test_a_time_to_keep_to_is_told_where_it_has_no_part():
    scene = points()
    scene.set("render.budget_ms", 5000)
    scene.set("render.max_rmse", 0.5)
    with pytest.warns(UserWarning, match=r"render.budget_ms has no part in organza.explain"):
        document = og.explain(scene, size=SMALL)
    assert [said.split(" ")[0] for said in document["warnings"] if "has no part" in said] == ["render.budget_ms", "render.max_rmse"]
    with pytest.warns(UserWarning, match=r"render.budget_ms has no part in organza.view"):
        og.view(scene, size=SMALL).close()
    for call in (og.explain, og.view, og.turntable, og.accuracy, og.orders):
        with pytest.raises(TypeError, match="found `budget_ms`; one picture of organza.render keeps to it"):
            call(PLACES, budget_ms=100)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        og.explain(points(), size=SMALL)


def test_a_limit_of_memory_is_said_with_its_unit_and_its_argument():
    with pytest.raises(og.LimitError, match=r"needs [0-9]+ bytes, the limit is 1 bytes\nhint: .*`max_memory`"):
        og.render(points(), size=SMALL, max_memory=1)
    with pytest.raises(og.LimitError, match=r"at most 1 bytes of memory(.|\n)*`max_memory`"):
        og.render(ASSETS / "dose" / "dose.nrrd", size=SMALL, max_memory=1)


def test_a_folder_of_vtk_js_is_named_once(tmp_path):
    folder = tmp_path / "ct.vti"
    (folder / "data").mkdir(parents=True)
    (folder / "index.json").write_text('{"origin": [0, 0, 0], "vtkClass": "vtkImageData", "extent": [0, 1, 0, 1, 0, 1]}')
    for call in (og.render, og.info, og.Scene().add, og.Scene().add_volume):
        for path in (folder, folder / "index.json"):
            with pytest.raises(og.InputError, match=r"found a data set of vtk.js, which is not read(.|\n)*copy the one of an image"):
                call(path)


def test_legends_of_labels_have_the_names_of_their_user():
    regions = np.zeros((6, 6, 6), np.uint8)
    regions[1:5, 1:5, 1:3], regions[1:5, 1:5, 3:5] = 1, 2
    names = {1: "liver", 2: "spleen"}
    scenes = [og.Scene() for _ in range(3)]
    scenes[0].add_labels(regions, labels=names, name="organs")
    scenes[1].add_labels(regions, name="organs")
    scenes[2].add_volume(regions, labels=names, name="organs")
    legends = [og.render(scene, size=SMALL)._drawn.legends[0] for scene in scenes]
    assert [(legend["object"], legend["column"]) for legend in legends] == [("organs", None)] * 3
    assert [row[:2] for row in legends[0]["labels"]] == [row[:2] for row in legends[2]["labels"]] == list(names.items())
    mesh = og.Scene()
    mesh.add_mesh(np.eye(3), [[0, 1, 2]], columns={"label": [1]}, labels=names, name="organ")
    assert og.render(mesh, size=SMALL)._drawn.legends[0]["labels"][0][1] == "liver"


ODD = [-1, "x", b"x", 1.5, True, [], [[]], [1, [2]], {}, object(), np.zeros(3), np.zeros((2, 2)), np.array("x"), 10**30, np.nan, print, {1, 2}, 1 + 2j]
ADDING = {
    "add_points": {"positions": PLACES, "values": VALUES},
    "add_mesh": {"vertices": np.eye(3), "faces": [[0, 1, 2]]},
    "add_volume": {"values": CUBE},
    "add_isosurface": {"values": CUBE, "level": 20},
    "add_slice": {"values": CUBE},
    "add_labels": {"values": np.ones((3, 3, 3), int)},
}


@pytest.mark.parametrize("call", ADDING)
@pytest.mark.filterwarnings("ignore")
def test_every_argument_is_refused_by_its_name(call):
    """What is odd is taken, or refused by the name of its argument: never in the words of numpy or of the extension."""
    for name in inspect.signature(getattr(og.Scene, call)).parameters.keys() - {"self", "keys"}:
        for odd in ODD:
            # A text may be the path of a file.
            if isinstance(odd, str) and name in ("values", "labels"):
                continue
            try:
                getattr(og.Scene(), call)(**(ADDING[call] | {name: odd}))
            except og.InputError as error:
                assert name in str(error), f"{name}={odd!r}: {error}"
            except FileNotFoundError:
                assert isinstance(odd, str)


def test_values_beside_a_large_number_keep_their_differences():
    """Times of Unix differ by less than single precision tells apart."""
    offsets = np.arange(40.0)
    near = points(values=offsets, unlit=True, discs="round")
    far = points(values=1.7e9 + offsets, unlit=True, discs="round")
    assert np.abs(og.render(near, size=SMALL).rgb - og.render(far, size=SMALL).rgb).max() < 1e-3


def test_an_array_of_xarray_that_runs_from_north_to_south_is_that_which_runs_north():
    xarray = pytest.importorskip("xarray")
    places = {"z": np.arange(6.0), "lat": np.linspace(60.0, 50.0, 6), "lon": np.arange(6.0)}
    southwards = xarray.DataArray(CUBE, dims=("z", "lat", "lon"), coords=places)
    pictures = []
    for array in (southwards, southwards.sortby("lat")):
        scene = og.Scene()
        scene.add(array, transform={"up": "z"})
        pictures.append(og.render(scene, size=SMALL).rgb)
    assert np.array_equal(*pictures)


def test_a_layer_is_asked_for_by_its_name():
    with pytest.raises(KeyError, match="expected the name of a layer"):
        og.render(PLACES, size=SMALL)[0]


def test_a_wish_that_there_is_not_is_named_with_the_one_that_may_be_meant():
    with pytest.raises(TypeError, match=r"from_files: .*found `colour_by`; did you mean `color_by`\?"):
        og.Scene.from_files(ASSETS / "meshes" / "dart.off", colour_by="x")
