"""Surfaces that show a second volume, and cameras that do not see what is added."""

import numpy as np
import organza as og
import pytest
from conftest import ASSETS

SMALL = (64, 48)


def lattice(sides: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places from -1 to 1, z, y, x."""
    return np.meshgrid(*[np.linspace(-1.0, 1.0, side) for side in sides], indexing="ij")


def ball() -> np.ndarray:
    """One less the distance from the middle."""
    z, y, x = lattice((21, 21, 21))
    return 1.0 - np.sqrt(x**2 + y**2 + z**2)


def left_to_right(sides: tuple[int, int, int] = (21, 21, 21)) -> np.ndarray:
    return lattice(sides)[2]


def drawn(scene: og.Scene) -> og.Picture:
    scene.camera.orbit(azimuth=0, elevation=0)
    return og.render(scene, size=SMALL)


def test_an_isosurface_shows_a_second_volume(tmp_path):
    scene = og.Scene()
    scene.add_isosurface(ball(), 0.4, field=left_to_right(), colormap="coolwarm", clim=(-0.6, 0.6), name="iso")
    picture = drawn(scene)
    left, right = picture.rgb[24, 24], picture.rgb[24, 40]
    assert left[2] > 1.5 * left[0] and right[0] > 1.5 * right[2]
    picture = og.render(scene, size=(320, 240))
    picture.save(tmp_path / "plain.png")
    picture.save(tmp_path / "legend.png", legend=True)
    assert (tmp_path / "plain.png").read_bytes() != (tmp_path / "legend.png").read_bytes()
    assert scene.objects == ["iso"]
    # Beside the picture a legend covers nothing of it.
    image_module = pytest.importorskip("PIL.Image")
    for ending in ("png", "webp"):
        picture.save(tmp_path / f"beside.{ending}", legend="beside")
        beside = np.asarray(image_module.open(tmp_path / f"beside.{ending}"))
        assert beside.shape[0] == 240 and 340 < beside.shape[1] < 480
        assert np.array_equal(beside[:, :320], picture.to_srgb8()) and beside[:, 320:].max() > 200
    picture.save(tmp_path / "over.png", legend="over")
    assert (tmp_path / "over.png").read_bytes() == (tmp_path / "legend.png").read_bytes()
    for wrong in ("below", 2):
        with pytest.raises(og.InputError, match=r"legend: expected True, False, 'over' or 'beside', found"):
            picture.save(tmp_path / "wrong.png", legend=wrong)


def test_a_legend_has_the_name_of_the_object_where_values_have_none(tmp_path):
    image_module = pytest.importorskip("PIL.Image")

    def strip(name: str, **shown: object) -> bytes:
        scene = og.Scene()
        scene.add_points(np.eye(3), radius=0.2, clim=(0, 2), name=name, **shown)
        picture = og.render(scene, size=(160, 120))
        picture.save(tmp_path / "a.png", legend="beside")
        return np.asarray(image_module.open(tmp_path / "a.png"))[:, 160:].tobytes()

    assert strip("heat", values=np.arange(3.0)) != strip("flow", values=np.arange(3.0))
    named = {"columns": {"heat": np.arange(3.0)}, "color_by": "heat"}
    assert strip("one", **named) == strip("two", **named) == strip("heat", values=np.arange(3.0))


def test_a_field_has_a_lattice_of_its_own():
    pictures = []
    # A line of two steps holds the same numbers as twenty.
    for field in (left_to_right(), {"values": left_to_right((2, 2, 2)), "spacing": 20.0}, {"values": left_to_right(), "interpolation": "trilinear"}):
        scene = og.Scene()
        scene.add_isosurface(ball(), 0.4, field=field, colormap="turbo", clim=(-1, 1), name="iso")
        pictures.append(drawn(scene).rgb)
    assert np.allclose(pictures[0], pictures[1], atol=1e-4) and np.array_equal(pictures[0], pictures[2])
    scene = og.Scene()
    scene.add_isosurface(ball(), 0.4, field={"values": left_to_right(), "spacing": 0.5}, clim=(-1, 1), name="iso")
    with pytest.warns(UserWarning, match="iso"):
        drawn(scene)


def test_a_field_of_another_library_lies_where_it_says():
    xr = pytest.importorskip("xarray")
    places = {axis: np.linspace(-3.0, 3.0, 21) for axis in "xyz"}
    values, field = (xr.DataArray(array, dims=("z", "y", "x"), coords=places) for array in (ball(), left_to_right()))
    pictures = []
    for second in (field, {"values": left_to_right(), "spacing": 0.3, "origin": (-3, -3, -3)}, field.values):
        scene = og.Scene()
        scene.add_isosurface(values, 0.4, field=second, colormap="turbo", name="iso")
        pictures.append(drawn(scene).rgb)
    assert np.array_equal(pictures[0], pictures[1]) and np.array_equal(pictures[0], pictures[2])


def test_points_meshes_and_labels_show_a_volume():
    corners = np.array([(0, 0, 10), (20, 0, 10), (20, 20, 10), (0, 20, 10)], dtype=float)
    regions = np.zeros((21, 21, 21), int)
    regions[2:18, 2:18, 2:18] = 1
    adders = [
        lambda scene: scene.add_mesh(corners, [(0, 1, 2, 3)], field=left_to_right(), transfer=og.transfer("coolwarm", clim=(-1, 1)), spacing=0.5),
        lambda scene: scene.add_points(np.stack(np.meshgrid(np.arange(20.0), np.arange(20.0), [10.0]), -1).reshape(-1, 3), field=left_to_right(), colormap="coolwarm"),
        lambda scene: scene.add_labels(regions, field=left_to_right(), colormap="coolwarm", clim=(-1, 1)),
    ]
    for add in adders:
        scene = og.Scene()
        add(scene)
        rgb = drawn(scene).rgb
        left, right = rgb[24, 20], rgb[24, 44]
        assert left[2] > 1.2 * left[0] and right[0] > 1.2 * right[2], (left, right)


def test_a_column_takes_a_transfer():
    places = np.random.default_rng(0).normal(size=(500, 3))
    pictures = []
    for look in ({"colormap": "turbo", "clim": (-1, 1)}, {"transfer": og.transfer("turbo", clim=(-1, 1))}):
        scene = og.Scene()
        scene.add_points(places, values=places[:, 0], **look)
        pictures.append(drawn(scene).rgb)
    assert np.allclose(*pictures, atol=0.02)


REFUSED = {
    "a second volume as a column": (lambda: og.Scene().add_isosurface(ball(), 0.4, color_by=ball()), "color_by: an isosurface has no columns, found ndarray; `field`"),
    "a field of a slice": (lambda: og.Scene().add_slice(ball(), field=ball()), "field: a slice shows the values of its own volume"),
    "a map without a field": (lambda: og.Scene().add_isosurface(ball(), 0.4, colormap="turbo"), "expected a `field` to colour by"),
    "a colour beside a field": (lambda: og.Scene().add_isosurface(ball(), 0.4, field=ball(), color=(1, 0, 0)), "`field` and `color` exclude each other"),
    "a field and a column": (lambda: og.Scene().add_points(np.zeros((4, 3)), field=ball(), color_by="x"), "field, color_by: expected one of them"),
    "a field of a file without ends": (lambda: og.Scene().add_isosurface(ball(), 0.4, field="dose.nrrd"), "clim: expected the values at the ends"),
    "a flat field": (lambda: og.Scene().add_isosurface(ball(), 0.4, field=np.zeros((3, 3)), clim=(0, 1)), "values: expected the shape"),
    "a key of a field": (lambda: og.Scene().add_isosurface(ball(), 0.4, field={"values": ball(), "steps": 1}), "field: expected the keys values, spacing.*`steps`"),
    "labels and a field": (lambda: og.Scene().add_labels(np.ones((3, 3, 3), int), labels={1: "a"}, field=ball()), "labels, field: expected one of them"),
    "a look by name": (lambda: og.Scene().add_isosurface(ball(), 0.4, field=ball(), transfer="turbo"), "transfer: expected what organza.transfer makes"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_wrong_fields_are_refused_by_name(case):
    call, said = REFUSED[case]
    with pytest.raises(og.InputError, match=said):
        call()


def test_paths_and_data_sets_are_volumes():
    from conftest import ASSETS

    dose = ASSETS / "dose" / "dose.nrrd"
    pictures = []
    for call in (lambda scene: scene.add(dose, preset="ct-bone"), lambda scene: scene.add_volume(dose, preset="ct-bone")):
        scene = og.Scene()
        call(scene)
        pictures.append(drawn(scene).rgb)
    assert np.array_equal(*pictures)
    scene = og.Scene()
    scene.add_volume(dose, transfer=og.transfer("magma", clim=(0, 5000)), name="dose")
    scene.add(dose, transfer=og.transfer("magma", clim=(0, 5000)), name="again", visible=False)
    assert scene.objects == ["dose", "again"] and drawn(scene).alpha.max() > 0.05


def test_what_a_first_camera_does_not_see_is_told(tmp_path):
    table = "x,y,z\n" + "\n".join(f"{x},{y},{x * y % 3}" for x in range(10) for y in range(10)) + "\n"
    (tmp_path / "grid.csv").write_text(table)
    scene = og.Scene.from_files(tmp_path / "grid.csv")
    inside = np.array([(4.0, 4.0, 1.0), (5.0, 5.0, 1.0)])
    scene.add_points(inside, name="inside", radius=1)
    scene.add_points(inside + [(0, 0, 0), (1000, 0, 0)], name="half", radius=1)
    said = [note for note in scene.notes if "lies outside the view" in note]
    assert said == ["half: 50 % of it lies outside the view, as the camera stays where the first scene has it: scene.camera.orbit() sees everything"]
    scene.camera.orbit()
    assert not any("outside the view" in note for note in scene.notes)


def test_a_turn_takes_what_a_picture_takes():
    points = np.random.default_rng(0).normal(size=(50, 3))
    pictures = list(og.turntable(points, 2, size=SMALL, transparent=True, elevation=60))
    assert all(picture.to_srgb8(transparent=True).shape == (48, 64, 4) for picture in pictures)
    level = next(iter(og.turntable(points, 2, size=SMALL, elevation=0)))
    assert level.camera["forward"][1] == pytest.approx(0.0, abs=1e-6) and pictures[0].camera["forward"][1] < -0.5
    with pytest.raises(FileNotFoundError):
        og.turntable("nothing.ply")


def test_textures_may_be_of_whole_numbers():
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    checks = np.indices((8, 8)).sum(0)[..., None] % 2 * np.array([230, 200, 40])
    pictures = []
    for texture in (checks.astype(np.uint8), checks, (checks * 257).astype(np.uint16)):
        scene = og.Scene()
        scene.add_mesh(corners, [(0, 1, 2, 3)], uv=[(0, 0), (1, 0), (1, 1), (0, 1)], texture=texture)
        pictures.append(drawn(scene).rgb)
    assert np.array_equal(pictures[0], pictures[1]) and np.allclose(pictures[0], pictures[2], atol=1e-5)


def test_whole_numbers_are_colours_of_a_display():
    colors = np.array([[255, 0, 0], [0, 128, 0], [0, 0, 7]])
    places = np.random.default_rng(0).normal(size=(3, 3))
    pictures = []
    for given in (colors.astype(np.uint8), colors, (colors * 257).astype(np.uint16)):
        scene = og.Scene()
        scene.add_points(places, colors=given, radius=0.5)
        pictures.append(drawn(scene).rgb)
    assert np.array_equal(pictures[0], pictures[1]) and np.allclose(pictures[0], pictures[2], atol=1e-5)
    scene = og.Scene()
    scene.add_points(places, colors=[[1, 0, 0]] * 3, radius=0.5)
    red = drawn(scene).rgb
    assert red[..., 0].max() > 0.3 and np.allclose(red[..., 1], red[..., 2])


def test_a_sparse_cloud_has_the_discs_of_its_file(tmp_path):
    places = np.random.default_rng(1).normal(size=(200, 3)).round(3)
    np.savetxt(tmp_path / "cloud.csv", places, delimiter=",", header="x,y,z", comments="")
    alphas = []
    for thing in (places, tmp_path / "cloud.csv"):
        scene = og.Scene()
        scene.add(thing, name="cloud", color=(0.8, 0.4, 0.2))
        alphas.append(drawn(scene).alpha)
    assert np.array_equal(*alphas) and alphas[0].mean() > 0.1


def test_the_seam_of_a_turned_surface_has_no_edge():
    u, v = np.meshgrid(np.linspace(0, 1, 33), np.linspace(0, 1, 17))
    around, up = 2 * np.pi * u, np.pi * (v - 0.5)
    places = np.stack([np.cos(up) * np.sin(around), np.sin(up), np.cos(up) * np.cos(around)], -1).reshape(-1, 3)
    corner = np.arange(16 * 33).reshape(16, 33)[:, :-1].ravel()
    faces = np.stack([corner, corner + 1, corner + 34, corner + 33], 1)
    for look in ({}, {"values": places[:, 1]}, {"uv": np.stack([u, v], -1).reshape(-1, 2), "texture": np.full((2, 2, 3), 128, np.uint8)}):
        scene = og.Scene()
        scene.add_mesh(places, faces, name="ball", **look)
        arrays = scene._data["ball"].arrays()
        normals, vertices = arrays["unit_normals"], arrays["vertices"]
        radial = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
        assert (normals * radial).sum(1).min() > 0.99


@pytest.mark.filterwarnings("ignore:.*legends")
def test_colors_without_light_are_those_of_the_map():
    ramp = np.indices((4, 4, 4))[0].astype(float)
    flat = np.full((2, 2, 2), 0.25)
    places = np.array([[x, y, 0.0] for x in range(3) for y in range(3)])
    square = [[0, 3, 4, 1], [1, 4, 5, 2], [3, 6, 7, 4], [4, 7, 8, 5]]
    expected = og._organza.map_colors("turbo", [0.25])[0]
    looks = {"colormap": "turbo", "clim": (0, 1), "unlit": True}
    calls = {
        "points": lambda scene: scene.add_points(places, values=np.full(9, 0.25), radius=1, **looks),
        "mesh": lambda scene: scene.add_mesh(places, square, values=np.full(9, 0.25), **looks),
        "isosurface": lambda scene: scene.add_isosurface(ramp, 1.5, field={"values": flat, "spacing": 3.0}, **looks),
        "labels": lambda scene: scene.add_labels(np.ones((4, 4, 4), int), field={"values": flat, "spacing": 3.0}, **looks),
    }
    for kind, add in calls.items():
        scene = og.Scene()
        add(scene)
        picture = og.render(scene, size=(24, 18))
        middle = picture.alpha > 0.99
        assert middle.any(), kind
        assert np.allclose(picture.rgb[middle], expected, atol=0.02), kind


def test_a_surface_is_unlit_or_has_a_material():
    scene = og.Scene()
    before = scene.to_toml()
    with pytest.raises(og.InputError, match="object 'mesh', unlit, material: expected one of them"):
        scene.add_mesh(np.eye(3), [[0, 1, 2]], unlit=True, material="clay")
    with pytest.raises(og.InputError, match="center"):
        scene.add_slice(np.zeros((2, 2, 2)), center=(np.nan, 0, 0))
    assert scene.to_toml() == before
    scene.add_mesh(np.eye(3), [[0, 1, 2]], unlit=False, name="lit")
    assert "material" not in scene.to_toml()
    scene.add(ASSETS / "stanford-bunny" / "bunny.ply.gz", unlit=True, name="bunny")
    assert 'shading = "unlit"' in scene.to_toml()
