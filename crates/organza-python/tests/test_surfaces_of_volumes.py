"""Isosurfaces, slices and labels of volumes: arrays, data sets of other libraries, files."""

import numpy as np
import organza as og
import pytest

SMALL = (64, 48)
LIGHT = {"direction": (-1, -2, -1), "irradiance": (3, 3, 3)}
TABLE = og.transfer("viridis", clim=(0, 2))


def ball() -> np.ndarray:
    """Distance from the middle of a lattice of unlike sides, z, y, x."""
    z, y, x = np.meshgrid(*[np.linspace(-1.0, 1.0, side) for side in (9, 11, 13)], indexing="ij")
    return np.sqrt(x**2 + y**2 + z**2).astype(np.float32)


def lit(scene: og.Scene) -> np.ndarray:
    scene.light(**LIGHT)
    return og.render(scene, size=SMALL).rgb


@pytest.fixture
def scan(tmp_path):
    """An image of nibabel, and its file."""
    nib = pytest.importorskip("nibabel")
    affine = np.diag([2.0, 1.0, 3.0, 1.0])
    affine[:3, 3] = (5.0, -7.0, 11.0)
    image = nib.Nifti1Image(ball().transpose(), affine)
    nib.save(image, tmp_path / "scan.nii")
    return image, tmp_path / "scan.nii"


def test_surfaces_of_a_data_set_are_those_of_its_file(scan):
    image, path = scan
    pictures = []
    for values in (image, path):
        scene = og.Scene()
        scene.add_isosurface(values, 0.8, inside="below", color=(0.8, 0.6, 0.4), name="shell")
        scene.add_slice(values, normal="x", center=(17.0, 0.0, 0.0), transfer=TABLE, name="plane")
        assert scene.objects == ["shell", "plane"]
        pictures.append(lit(scene))
    assert np.array_equal(*pictures) and pictures[0].std() > 0.01


def test_surfaces_of_an_array_of_xarray():
    xr = pytest.importorskip("xarray")
    places = {"z": np.arange(9.0) * 3, "y": np.arange(11.0), "x": np.arange(13.0) * 2}
    named = xr.DataArray(ball(), dims=("z", "y", "x"), coords=places).transpose("x", "y", "z")
    pictures = []
    for values, more in [(named, {}), (ball(), {"spacing": (2, 1, 3)})]:
        scene = og.Scene()
        scene.add_isosurface(values, 0.8, inside="below", name="shell", **more)
        scene.add_slice(values, normal="y", colormap="turbo", name="plane", **more)
        pictures.append(lit(scene))
    assert np.array_equal(*pictures)


def test_a_slice_shows_values_as_they_are():
    values = np.broadcast_to(np.linspace(0.0, 1.0, 17)[None, None, :], (3, 17, 17))
    scene = og.Scene()
    scene.add_slice(values, clim=(0, 1), colormap="grey")
    scene.camera(position=(8, 8, 40), target=(8, 8, 1), fov_y=20)
    picture = og.render(scene, size=SMALL)
    row = picture.rgb[24, 25:40, 0]
    assert picture.alpha[24, 32] == 1.0 and (np.diff(row) > 0).all()
    # The middle of the map in the middle of the picture, without light.
    assert row[7] == pytest.approx(og.transfer("grey").points[16]["color"][0], rel=0.1)


def test_labels_have_surfaces_names_and_colours(tmp_path):
    labels = np.zeros((12, 12, 12), dtype=np.int16)
    labels[2:10, 2:10, 2:6] = 1
    labels[2:10, 2:10, 6:10] = 2
    scene = og.Scene()
    scene.add_labels(labels, labels={1: {"name": "bone", "color": [0.9, 0.1, 0.1]}, 2: {"name": "skin", "color": "#00ff00"}})
    scene.camera.orbit(azimuth=0, elevation=0)
    picture = og.render(scene, size=(320, 240))
    left, right = picture.rgb[120, 110], picture.rgb[120, 210]
    assert left[0] > 3 * left[1] and right[1] > 3 * right[0]
    plain, drawn = tmp_path / "plain.png", tmp_path / "legend.png"
    picture.save(plain)
    picture.save(drawn, legend=True)
    assert drawn.read_bytes() != plain.read_bytes()
    turned = og.Scene()
    turned.add_labels(labels.astype(float), spacing=(1, 1, 2))
    assert og.render(turned, size=SMALL).alpha.max() == 1.0
    with pytest.raises(og.InputError, match="whole numbers"):
        og.Scene().add_labels(ball())


def test_a_volume_that_looks_like_labels_is_their_surfaces():
    labels = np.zeros((12, 12, 12), dtype=np.int16)
    for rank, corner in enumerate(np.ndindex(2, 2, 2)):
        labels[tuple(slice(1 + 5 * place, 6 + 5 * place) for place in corner)] = rank + 1
    scene = og.Scene()
    scene.add(labels)
    assert any("labels" in note for note in scene.notes), scene.notes
    assert og.render(scene, size=SMALL).alpha.max() == 1.0


REFUSED = {
    "a level in words": (lambda: og.Scene().add_isosurface(ball(), "high"), "level: expected a finite number"),
    "a flat volume": (lambda: og.Scene().add_isosurface(np.zeros((3, 3)), 0), r"values: expected the shape \(nz, ny, nx\)"),
    "another inside": (lambda: og.Scene().add_isosurface(ball(), 0.5, inside="left"), "inside: expected 'above' or 'below'"),
    "a normal in words": (lambda: og.Scene().add_slice(ball(), normal="up"), "normal: expected 'x', 'y', 'z' or three numbers"),
    "no normal": (lambda: og.Scene().add_slice(ball(), normal=(1, 2)), "normal: expected three numbers"),
    "a center of two": (lambda: og.Scene().add_slice(ball(), center=(1, 2)), "center: expected three numbers"),
    "a slice of a file without colours": (lambda: og.Scene().add_slice("a.nii", center=(0, 0, 0)), "expected both for the slice of a file"),
    "a map by name": (lambda: og.Scene().add_slice(ball(), transfer="grey"), "transfer: expected what organza.transfer makes"),
    "gaps alone": (lambda: og.Scene().add_slice(ball() * np.nan), "expected a voxel with a value"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_wrong_surfaces_are_refused_by_name(case):
    call, said = REFUSED[case]
    with pytest.raises(og.InputError, match=said):
        call()
