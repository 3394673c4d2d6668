"""Meshes from arrays: textures, numbers, opacities."""

import pickle

import numpy as np
import organza as og
import pytest

image_module = pytest.importorskip("PIL.Image")

SMALL = (64, 48)
# A roof of two squares, each with the whole image on it: a vertex on the edge has two places in it.
VERTICES = np.array([[0, 0, 0], [1, 0, 0.5], [1, 1, 0.5], [0, 1, 0], [2, 0, 0], [2, 1, 0]], dtype=float)
QUADS = np.array([[0, 1, 2, 3], [1, 4, 5, 2]])
SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
LIGHT = {"direction": (-1, -2, -1), "irradiance": (3, 3, 3)}
SCENE = """
version = 1
[camera]
auto = true
size = [64, 48]
[[light]]
kind = "directional"
direction = [-1, -2, -1]
irradiance = [3, 3, 3]
[[object]]
name = "roof"
mesh = "roof.obj"
"""


def pixels(channels: int = 3) -> np.ndarray:
    """Four fields of colour; with a fourth channel the last one is half translucent."""
    image = np.zeros((8, 8, channels), dtype=np.uint8)
    image[:4, :4, 0] = 255
    image[:4, 4:, 1] = 255
    image[4:, :, 2] = 200
    if channels == 4:
        image[..., 3] = 255
        image[4:, 4:, 3] = 128
    return image


def roof(texture: object, uv: object = None, **more: object) -> og.Scene:
    scene = og.Scene()
    scene.add_mesh(VERTICES, QUADS, uv=np.stack([SQUARE, SQUARE]) if uv is None else uv, texture=texture, name="roof", **more)
    scene.light(**LIGHT)
    return scene


@pytest.fixture(params=[3, 4])
def files(request, tmp_path):
    """The roof as OBJ with its texture, and the pixels of that."""
    of_texture = pixels(request.param)
    image_module.fromarray(of_texture).save(tmp_path / "roof.png")
    (tmp_path / "roof.mtl").write_text("newmtl a\nmap_Kd roof.png\n")
    lines = ["mtllib roof.mtl", "usemtl a"]
    lines += ["v " + " ".join(map(repr, map(float, vertex))) for vertex in VERTICES]
    lines += ["vt " + " ".join(map(repr, map(float, place))) for place in SQUARE]
    for a, b, c, d in (QUADS + 1).tolist():
        lines.append(f"f {a}/1 {b}/2 {c}/3 {d}/4")
    (tmp_path / "roof.obj").write_text("\n".join(lines) + "\n")
    (tmp_path / "roof.toml").write_text(SCENE)
    return tmp_path, of_texture


def test_a_texture_has_the_bits_of_its_file(files):
    folder, of_texture = files
    of_file = og.render(folder / "roof.toml").rgb
    assert of_file.std(axis=(0, 1)).min() > 0.01
    textures = [of_texture, folder / "roof.png", str(folder / "roof.png"), image_module.open(folder / "roof.png")]
    for texture in textures:
        scene = roof(texture)
        assert not any("textures became colours of vertices" in note for note in scene.notes)
        assert np.array_equal(og.render(scene, size=SMALL).rgb, of_file)
    # Corners with vertices of their own, as many libraries have them.
    split = og.Scene()
    split.add_mesh(VERTICES[QUADS.ravel()], np.arange(8).reshape(2, 4), uv=np.tile(SQUARE, (2, 1)), texture=of_texture)
    split.light(**LIGHT)
    assert np.abs(og.render(split, size=SMALL).rgb - of_file).max() < 1e-5


def test_a_textured_mesh_of_trimesh_looks_like_its_file(files):
    """Its faces and their corners come in another order than those of the file, so that the last bits of normals differ."""
    trimesh = pytest.importorskip("trimesh")
    folder, _ = files
    scene = og.Scene()
    scene.add(trimesh.load(folder / "roof.obj"), name="roof")
    scene.light(**LIGHT)
    difference = np.abs(og.render(scene, size=SMALL).rgb - og.render(folder / "roof.toml").rgb)
    assert difference.max() < 1e-5


def test_a_textured_mesh_of_trimesh_has_the_bits_of_its_glb(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    material = trimesh.visual.material.PBRMaterial(
        baseColorTexture=image_module.fromarray(pixels()), baseColorFactor=[255, 128, 255, 255]
    )
    corners = VERTICES[QUADS.ravel()]
    visual = trimesh.visual.TextureVisuals(uv=np.tile(SQUARE, (2, 1)), material=material)
    normals = np.tile([0.0, 0.0, 1.0], (8, 1))
    faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    mesh = trimesh.Trimesh(corners, faces, vertex_normals=normals, visual=visual, process=False)
    (tmp_path / "roof.glb").write_bytes(mesh.export(file_type="glb", include_normals=True))
    (tmp_path / "roof.toml").write_text(SCENE.replace("roof.obj", "roof.glb"))
    scene = og.Scene()
    scene.add(mesh, name="roof", normals=normals)
    scene.light(**LIGHT)
    assert np.array_equal(og.render(scene, size=SMALL).rgb, og.render(tmp_path / "roof.toml").rgb)


def test_linear_texels_are_those_of_bytes():
    of_texture = pixels()
    fields = (of_texture > 0).astype(np.float32)
    of_texture[of_texture > 0] = 255
    assert np.array_equal(og.render(roof(of_texture), size=SMALL).rgb, og.render(roof(fields), size=SMALL).rgb)
    tinted = og.render(roof(fields, colors=np.tile([1.0, 0.0, 0.0], (6, 1))), size=SMALL).rgb
    assert tinted[..., 0].max() > 0.1 and tinted[..., 1].max() < 0.01


def test_numbers_of_vertices_and_faces_are_colours():
    heat = np.arange(6.0)
    shown = {"colormap": "turbo", "clim": (0, 5), "name": "roof"}
    of_values, of_column = og.Scene(), og.Scene()
    of_values.add_mesh(VERTICES, QUADS, values=heat, **shown)
    of_column.add_mesh(VERTICES, QUADS, columns={"heat": heat, "other": heat}, color_by="heat", **shown)
    first = og.render(of_values, size=SMALL)
    second = og.render(of_column, size=SMALL)
    assert np.array_equal(first.rgb, second.rgb) and first.rgb.std() > 0.01
    assert any("not used: other" in note for note in second.notes), second.notes
    of_faces = og.Scene()
    of_faces.material("flat", shading="unlit")
    of_faces.add_mesh(VERTICES, QUADS, values=[0, 5], material="flat", **shown)
    picture = og.render(of_faces, size=SMALL)
    colors, counts = np.unique(picture.to_srgb8()[picture.alpha == 1.0], axis=0, return_counts=True)
    # Both ends of the map, and what lies between them where both faces meet.
    assert np.sort(counts)[-2:].sum() > 0.8 * counts.sum()
    by_height = og.Scene()
    by_height.add_mesh(VERTICES, QUADS, color_by="height")
    assert og.render(by_height, size=SMALL).rgb.std() > 0.01
    with pytest.raises(og.InputError, match="warmth"):
        wrong = og.Scene()
        wrong.add_mesh(VERTICES, QUADS, values=heat, color_by="warmth")
        og.render(wrong, size=SMALL)


def test_opacities_of_vertices_show_what_lies_behind():
    scene = og.Scene()
    scene.add_mesh(VERTICES, QUADS, opacities=[1, 0, 0, 1, 1, 1])
    alpha = og.render(scene, size=SMALL).alpha
    assert ((alpha > 0.1) & (alpha < 0.9)).sum() > 50


def test_normals_are_pickled_as_they_are():
    scene = og.Scene()
    normals = np.random.default_rng(0).normal(size=(6, 3))
    scene.add_mesh(VERTICES, QUADS, normals=normals)
    scene.add_points(VERTICES + 3, normals=normals, radius=0.3)
    again = pickle.loads(pickle.dumps(scene))
    assert np.array_equal(og.render(scene, size=SMALL).rgb, og.render(again, size=SMALL).rgb)


def noise(channels: int, kind: type) -> np.ndarray:
    """Texels that are finer than the triangles of the roof: colours of vertices would lose them."""
    values = np.random.default_rng(0).random((64, 64, channels))
    return (values * 255).astype(np.uint8) if kind is np.uint8 else values.astype(kind)


@pytest.mark.parametrize("texture", [pixels(4), noise(3, np.uint8), noise(3, np.float32), noise(4, np.uint8)], ids=["fields", "bytes", "linear", "alpha"])
def test_a_painted_mesh_is_pickled_with_its_texture(texture):
    scene = roof(texture, columns={"heat": np.arange(6.0)}, color_by=None, colors=np.tile([1.0, 0.5, 0.25], (6, 1)))
    scene.add_mesh(VERTICES + 3, QUADS, values=[1, 2], name="faces")
    again = pickle.loads(pickle.dumps(scene))
    assert again.notes == scene.notes
    assert np.array_equal(og.render(scene, size=SMALL).rgb, og.render(again, size=SMALL).rgb)
    # Once more: what was made again is whole.
    assert pickle.dumps(pickle.loads(pickle.dumps(again))) == pickle.dumps(again)


def test_surfaces_of_pyvista_show_their_numbers_and_textures():
    pv = pytest.importorskip("pyvista")
    plane = pv.Plane(i_resolution=4, j_resolution=4)
    plane.clear_data()
    plane["heat"] = np.arange(25.0)
    plane["flow"] = np.ones((25, 3))
    scene = og.Scene()
    scene.add(plane, name="plane", colormap="turbo")
    picture = og.render(scene, size=SMALL)
    assert picture.rgb.std(axis=(0, 1)).min() > 0.01
    assert any("plane: not used: flow" in note for note in scene.notes), scene.notes
    assert np.ptp(og.render(plane, size=SMALL).rgb[20:28, 28:36], axis=2).max() > 0.05
    scene = og.Scene()
    scene.add(plane, color=(0.9, 0.1, 0.1))
    red, green, _ = np.moveaxis(og.render(scene, size=SMALL).rgb, -1, 0)
    assert red.max() > 4 * green.max()
    cells = pv.Plane(i_resolution=2, j_resolution=1)
    cells.cell_data["side"] = [0.0, 1.0]
    scene = og.Scene()
    scene.add(cells, name="cells", color_by="side")
    assert any("texture coordinates, as there is no `texture`" in note for note in scene.notes), scene.notes
    og.render(scene, size=SMALL)
    scene = og.Scene()
    scene.add(pv.Plane(), texture=pixels(), name="plane")
    assert og.render(scene, size=SMALL).rgb.std(axis=(0, 1)).min() > 0.01


REFUSED = {
    "no texture": ({"uv": np.zeros((6, 2))}, "texture: expected an image beside `uv`"),
    "no places": ({"texture": pixels()}, "uv: expected texture coordinates beside `texture`"),
    "places of another count": ({"uv": np.zeros((5, 2)), "texture": pixels()}, r"uv: expected the shape \(6, 2\)"),
    "places that are not finite": ({"uv": np.full((6, 2), np.nan), "texture": pixels()}, "texture coordinates that are finite"),
    "a grey image": ({"uv": np.zeros((6, 2)), "texture": np.zeros((4, 4))}, "three channels or four"),
    "an image beyond bytes": ({"uv": np.zeros((6, 2)), "texture": np.full((4, 4, 3), 256)}, "texture: expected .* bytes of sRGB from 0 to 255"),
    "two channels": ({"uv": np.zeros((6, 2)), "texture": np.zeros((4, 4, 2))}, r"\(height, width, 3\)"),
    "an image of nothing": ({"uv": np.zeros((6, 2)), "texture": np.zeros((0, 4, 3))}, "pixels a side"),
    "a dark image": ({"uv": np.zeros((6, 2)), "texture": np.full((1, 1, 3), -1.0)}, "finite colours from 0 on"),
    "values of another count": ({"values": np.zeros(5)}, r"values: expected the shape \(6,\) of vertices or \(2,\) of faces, found \(5,\)"),
    "opacities beyond 1": ({"opacities": np.full(6, 2.0)}, "opacity"),
    "a map alone": ({"colormap": "turbo"}, "expected a column to colour by"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_wrong_meshes_are_refused_by_name(case):
    more, said = REFUSED[case]
    with pytest.raises(og.InputError, match=said):
        og.Scene().add_mesh(VERTICES, QUADS, **more)


def test_a_texture_that_is_not_there_or_no_image_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match="nothing.png"):
        roof(tmp_path / "nothing.png")
    (tmp_path / "text.png").write_text("no image")
    with pytest.raises(og.InputError, match="text.png: expected a whole PNG or JPEG image"):
        roof(tmp_path / "text.png")
