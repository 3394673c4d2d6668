"""Data sets of other libraries are drawn as what they are."""

import numpy as np
import pytest

import organza as og

SMALL = (48, 36)


def test_pyvista_surfaces_points_and_images():
    pv = pytest.importorskip("pyvista")
    assert og.render(pv.Sphere(), size=SMALL).alpha.max() > 0.9
    cloud = pv.PolyData(np.random.default_rng(0).random((300, 3)))
    cloud["heat"] = np.arange(300.0)
    scene = og.Scene()
    scene.add(cloud, radius=0.05)
    assert og.render(scene, size=SMALL).alpha.max() > 0.9
    image = pv.ImageData(dimensions=(5, 6, 7), spacing=(1, 2, 3), origin=(9, 8, 7))
    image["heat"] = np.arange(210.0)
    image.direction_matrix = np.eye(3)[[1, 0, 2]]
    scene = og.Scene()
    scene.add(image, transfer=og.transfer(clim=(0, 210)))
    assert og.render(scene, size=SMALL).alpha.max() > 0.05


def test_trimesh_with_colours():
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box()
    box.visual.vertex_colors = [[200, 30, 30, 255]] * len(box.vertices)
    red, green, _ = np.moveaxis(og.render(box, size=SMALL).rgb, -1, 0)
    assert red.max() > 2 * green.max()


def test_xarray_by_the_names_of_its_dimensions():
    xr = pytest.importorskip("xarray")
    places = {"x": np.arange(5.0), "y": np.arange(6.0) * 2, "z": np.arange(7.0) * 3}
    values = np.arange(210.0).reshape(5, 6, 7)
    named = xr.DataArray(values, dims=("x", "y", "z"), coords=places, name="heat")
    turned = og.Scene()
    turned.add(named, transfer=og.transfer(clim=(0, 210)))
    plain = og.Scene()
    plain.add_volume(values.transpose(), spacing=(1, 2, 3), transfer=og.transfer(clim=(0, 210)))
    assert np.array_equal(og.render(turned, size=SMALL).rgb, og.render(plain, size=SMALL).rgb)
    with pytest.raises(og.InputError, match="three dimensions"):
        og.Scene().add(xr.DataArray(np.zeros((2, 2)), dims=("x", "y")))
    uneven = named.assign_coords(x=[0.0, 1.0, 4.0, 5.0, 9.0])
    with pytest.raises(og.InputError, match="coordinate x: expected even steps"):
        og.Scene().add(uneven)


def test_xarray_dimensions_of_the_earth_and_those_that_are_no_axes():
    xr = pytest.importorskip("xarray")
    values = np.arange(210.0).reshape(5, 6, 7)
    look = {"transfer": og.transfer(clim=(0, 210))}
    drawn = {}
    for dims, turned in [(("lon", "lat", "depth"), values), (("Depth", "latitude", "longitude"), values.transpose()), (("a", "b", "c"), values.transpose())]:
        scene = og.Scene()
        scene.add(xr.DataArray(turned, dims=dims), **look)
        drawn[dims] = og.render(scene, size=SMALL).rgb
    first, *others = drawn.values()
    assert all(np.array_equal(first, other) for other in others)
    with pytest.raises(og.InputError, match=r"found \('x', 'y', 'time'\); `rename`"):
        og.Scene().add_volume(xr.DataArray(values, dims=("x", "y", "time")), **look)
    with pytest.raises(og.InputError, match=r"such as dataset\[NAME\], found those of \['heat'\]"):
        og.Scene().add(xr.Dataset({"heat": (("z", "y", "x"), values)}))


def test_nibabel_images_stand_up():
    nib = pytest.importorskip("nibabel")
    values = np.random.default_rng(0).random((6, 7, 8)).astype(np.float32)
    image = nib.Nifti1Image(values, np.diag([2.0, 2.0, 3.0, 1.0]))
    scene = og.Scene()
    scene.add(image, transfer=og.transfer())
    assert og.render(scene, size=SMALL).alpha.max() > 0.1


def world(side: int = 9) -> tuple[np.ndarray, np.ndarray]:
    """Values along i, j, k with an off-centre block, and an affine with steps of their own."""
    values = np.zeros((side, side + 1, side + 2), dtype=np.float32)
    values[1:5, 2:8, 3:9] = np.random.default_rng(0).random((4, 6, 6)) + 1
    affine = np.diag([2.0, 2.0, 3.0, 1.0])
    affine[:3, 3] = (5.0, -7.0, 11.0)
    return values, affine


def test_an_image_of_nibabel_is_drawn_as_its_file(tmp_path):
    nib = pytest.importorskip("nibabel")
    values, affine = world()
    image = nib.Nifti1Image(values, affine)
    nib.save(image, tmp_path / "image.nii")
    assert np.array_equal(og.render(image, size=SMALL).rgb, og.render(tmp_path / "image.nii", size=SMALL).rgb)


def test_an_image_of_simpleitk_is_drawn_as_its_file(tmp_path):
    sitk = pytest.importorskip("SimpleITK")
    values, _ = world()
    image = sitk.GetImageFromArray(values.transpose())
    image.SetSpacing((2.0, 2.0, 3.0))
    image.SetOrigin((5.0, -7.0, 11.0))
    image.SetDirection((0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    for ending in ("nrrd", "mha"):
        sitk.WriteImage(image, str(tmp_path / f"image.{ending}"))
        assert np.array_equal(og.render(image, size=SMALL).rgb, og.render(tmp_path / f"image.{ending}", size=SMALL).rgb)


def test_a_trimesh_with_a_texture_keeps_its_colours():
    trimesh = pytest.importorskip("trimesh")
    image_module = pytest.importorskip("PIL.Image")
    box = trimesh.creation.box()
    texture = image_module.new("RGB", (4, 4), (20, 200, 20))
    box.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(box.vertices), 2)), image=texture)
    red, green, _ = np.moveaxis(og.render(box, size=SMALL).rgb, -1, 0)
    assert green.max() > 2 * red.max()


def test_a_scene_and_points_of_trimesh():
    trimesh = pytest.importorskip("trimesh")
    both = trimesh.Scene([trimesh.creation.box(), trimesh.creation.icosphere().apply_translation([3, 0, 0])])
    assert og.render(both, size=SMALL).alpha.max() > 0.9
    assert og.render(trimesh.PointCloud(np.random.default_rng(0).random((200, 3))), size=SMALL).alpha.max() > 0.5


def test_pyvista_grids_lines_and_cells():
    pv = pytest.importorskip("pyvista")
    cells = pv.ImageData(dimensions=(5, 6, 7))
    cells.cell_data["heat"] = np.arange(4.0 * 5 * 6)
    scene = og.Scene()
    scene.add(cells, transfer=og.transfer(clim=(0, 120)))
    assert og.render(scene, size=SMALL).alpha.max() > 0.05
    assert og.render(pv.examples.cells.Hexahedron(), size=SMALL).alpha.max() > 0.9
    assert og.render(pv.StructuredGrid(*np.meshgrid(*[np.arange(4.0)] * 3, indexing="ij")), size=SMALL).alpha.max() > 0.9
    with pytest.raises(og.InputError, match="line"):
        og.render(pv.Line())
    with pytest.raises(og.InputError):
        og.render(pv.PolyData())


def test_labels_are_surfaces():
    labels = np.zeros((12, 12, 12), dtype=np.int16)
    for rank, corner in enumerate(np.ndindex(2, 2, 2)):
        labels[tuple(slice(1 + 5 * place, 6 + 5 * place) for place in corner)] = rank + 1
    scene = og.Scene()
    scene.add(labels)
    picture = og.render(labels, size=SMALL)
    assert any("label" in note for note in picture.notes) and picture.alpha.max() > 0.9


def test_data_of_open3d_by_its_names():
    """Open3D itself is large: a class of its name stands for it."""
    cloud_of = type("PointCloud", (), {"__module__": "open3d.geometry"})
    cloud = cloud_of()
    cloud.points = np.random.default_rng(0).random((200, 3))
    cloud.colors = np.tile([1.0, 0.0, 0.0], (200, 1))
    red, green, _ = np.moveaxis(og.render(cloud, size=SMALL).rgb, -1, 0)
    assert red.max() > 2 * green.max()
    mesh_of = type("TriangleMesh", (), {"__module__": "open3d.geometry"})
    mesh = mesh_of()
    mesh.vertices = np.eye(3)
    mesh.triangles = [[0, 1, 2]]
    mesh.triangle_uvs = np.zeros((3, 2))
    mesh.textures = [np.zeros((2, 2, 3))]
    scene = og.Scene()
    scene.add(mesh)
    assert scene.notes == ["mesh: not used: textures, triangle_uvs"]


def test_what_is_no_volume_is_named():
    sitk = pytest.importorskip("SimpleITK")
    for image, said in [(sitk.Image(4, 4, sitk.sitkFloat32), "2 axes and 1 numbers"), (sitk.Image([4, 4, 4], sitk.sitkVectorFloat32, 3), "3 axes and 3 numbers")]:
        with pytest.raises(og.InputError, match=f"the image: expected three axes and one number a voxel, found {said}"):
            og.Scene().add(image)
    xr = pytest.importorskip("xarray")
    times = np.arange(4).astype("datetime64[D]")
    with pytest.raises(og.InputError, match=r"the coordinate time: expected numbers, .*datetime64\[.*\]; `drop_vars\('time'\)`"):
        og.Scene().add(xr.DataArray(np.zeros((4, 3, 3)), dims=("time", "a", "b"), coords={"time": times}))
    with pytest.raises(og.InputError, match="the array: expected one, found a list of 2"):
        og.render([np.eye(3), np.eye(3)])


def test_lines_of_trimesh_are_named():
    trimesh = pytest.importorskip("trimesh")
    with pytest.raises(og.InputError, match="found trimesh.Path3D: lines are not drawn; its `vertices` are points"):
        og.Scene().add(trimesh.load_path(np.eye(3)))
