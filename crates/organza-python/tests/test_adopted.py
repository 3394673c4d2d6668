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


def test_nibabel_images_stand_up():
    nib = pytest.importorskip("nibabel")
    values = np.random.default_rng(0).random((6, 7, 8)).astype(np.float32)
    image = nib.Nifti1Image(values, np.diag([2.0, 2.0, 3.0, 1.0]))
    scene = og.Scene()
    scene.add(image, transfer=og.transfer())
    assert og.render(scene, size=SMALL).alpha.max() > 0.1
