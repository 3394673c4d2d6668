"""Cameras around data, suns, and the ground below."""

import json
import pickle

import numpy as np
import organza as og
import pytest
from conftest import ASSETS

SMALL = (64, 48)
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (2, 3) for z in (0, 1)], dtype=float)
SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def cube(**keys: object) -> og.Scene:
    scene = og.Scene()
    scene.add_mesh(CUBE, SIDES, name="cube", color=(0.8, 0.3, 0.2), **keys)
    return scene


def placed(scene: og.Scene) -> dict:
    """The ground of a scene where it is drawn."""
    document = json.loads(scene._given(og.scene._how(), None, None)["text"])
    return next(thing for thing in document["object"] if thing["name"] == "ground")["rectangle"]


def test_an_orbit_sees_all_from_an_angle():
    orbit, keys = cube(), cube()
    orbit.camera.orbit(azimuth=30, elevation=20, fit=1)
    keys.camera(azimuth=30, elevation=20, fit=1)
    picture = og.render(orbit, size=SMALL)
    assert np.array_equal(picture.rgb, og.render(keys, size=SMALL).rgb)
    rows = np.flatnonzero((picture.alpha > 0).any(axis=1))
    # The picture's height is filled.
    assert rows[0] <= 1 and rows[-1] >= 46
    front, side = cube(), cube()
    front.camera.orbit(azimuth=0, elevation=0)
    side.camera.orbit(azimuth=90, elevation=0)
    [from_front, from_side] = [np.array(og.render(scene, size=SMALL).camera["position"]) for scene in (front, side)]
    middle = np.array([0.5, 2.5, 0.5])
    assert np.allclose((from_front - middle)[:2], 0, atol=1e-6) and (from_front - middle)[2] > 1
    assert np.allclose((from_side - middle)[1:], 0, atol=1e-6) and (from_side - middle)[0] > 1


def test_a_ground_lies_below_what_stands_on_it():
    bare, grounded = cube(), cube()
    grounded.ground()
    assert grounded.objects == ["cube", "ground"]
    assert placed(grounded)["center"][1] == pytest.approx(2.0, abs=1e-3)
    for scene in (bare, grounded):
        scene.camera.orbit(azimuth=30, elevation=20)
    above, below = og.render(bare, size=SMALL), og.render(grounded, size=SMALL)
    assert above.camera["position"] == pytest.approx(below.camera["position"], abs=1e-3)
    assert below.alpha[-1].min() == 1.0 and above.alpha[-1].min() == 0.0
    # What comes later stands on it, too.
    grounded.add_points([[0.5, -3.0, 0.5]], radius=0.1, name="below")
    assert placed(grounded)["center"][1] <= -2.9


def test_a_ground_has_its_size_height_and_look():
    scene = cube()
    scene.ground(size=6, height=1.5, color=(0.1, 0.5, 0.1))
    rectangle = placed(scene)
    assert rectangle["center"][1] == 1.5
    assert np.linalg.norm(rectangle["u"]) == pytest.approx(3.0) and np.linalg.norm(rectangle["v"]) == pytest.approx(3.0)
    scene.set("object.ground.color", [0.5, 0.1, 0.1])
    scene.camera.orbit(azimuth=30, elevation=40)
    red, green, _ = og.render(scene, size=SMALL).rgb[-4, 32]
    assert red > 2 * green
    shown = cube()
    shown.material("floor", color=[0.1, 0.1, 0.6])
    shown.ground(material="floor")
    shown.camera.orbit(azimuth=30, elevation=40)
    red, _, blue = og.render(shown, size=SMALL).rgb[-1, 32]
    assert blue > 2 * red


def test_a_ground_stays_where_the_camera_is_placed():
    scene = cube()
    scene.camera(position=(3, 4, 6), target=(0.5, 2.5, 0.5))
    scene.ground()
    picture = og.render(scene, size=SMALL)
    assert picture.camera["position"] == pytest.approx([3, 4, 6])
    assert picture.alpha[-1].min() == 1.0
    text = scene.to_toml()
    assert "rectangle" in text and "position" in text
    again = pickle.loads(pickle.dumps(scene))
    assert np.array_equal(og.render(again, size=SMALL).rgb, picture.rgb)


def test_a_ground_lies_below_files_and_labels_and_turns():
    scene = og.Scene.from_files(ASSETS / "meshes" / "dart.off", size=SMALL)
    scene.ground()
    pictures = list(og.turntable(scene, 2, size=SMALL))
    assert all(picture.alpha[-1].min() == 1.0 for picture in pictures)
    assert not np.array_equal(pictures[0].rgb, pictures[1].rgb)


def test_a_turn_lights_its_back():
    """As `--turntable` of the command does, a turn of arrays without lights has one more from behind."""
    one = json.loads(cube()._given(og.scene._how(), None, SMALL)["text"])
    turned = json.loads(cube()._given(og.scene._how(), None, SMALL, turntable=4)["text"])
    assert len(one["light"]) == 2 and len(turned["light"]) == 3


def test_a_sun_shines_from_its_angles():
    scene = cube()
    scene.light.sun(azimuth=90, elevation=30, irradiance=2, name="evening")
    document = scene._document
    sun = document["light"][0]
    assert sun["direction"] == pytest.approx([-np.cos(np.radians(30)), -0.5, 0.0], abs=1e-12)
    assert sun["irradiance"] == [2.0, 2.0, 2.0] and document["ambient"]["color"] == [0.15] * 3
    scene.ground()
    scene.camera.orbit(azimuth=30, elevation=20)
    assert "shadow.evening" in [effect["name"] for effect in og.render(scene, size=SMALL).plan["effects"]]
    scene = cube()
    scene.set("ambient.color", [1, 1, 1])
    scene.light.sun()
    assert scene._document["ambient"]["color"] == [1, 1, 1]
    scene = cube()
    scene.light.sun(sky=None, irradiance=(3, 2, 1), shadow=False)
    assert "ambient" not in scene._document and scene._document["light"][0]["shadow"] is False


REFUSED = {
    "a ground of nothing": (lambda: og.render(grounded(og.Scene()), size=SMALL), "expected data that stands on it"),
    "two grounds": (lambda: grounded(grounded(cube())), "expected one ground"),
    "a flat ground": (lambda: cube().ground(size=0), "size: expected a number above 0"),
    "a ground in words": (lambda: cube().ground(size="large"), "size: expected a finite number"),
    "a height beyond": (lambda: cube().ground(height=np.inf), "height: expected a finite number"),
    "a ground of another name": (lambda: cube().ground(name=5), "name: expected a text"),
    "a sun below": (lambda: cube().light.sun(elevation=100), "elevation: expected degrees from -90 to 90"),
    "a sun of two channels": (lambda: cube().light.sun(irradiance=(1, 2)), "irradiance: expected one number or three"),
    "a sky in words": (lambda: cube().light.sun(sky="blue"), "sky: expected a finite number"),
    "a sun nowhere": (lambda: cube().light.sun(azimuth="north"), "azimuth: expected a finite number"),
}


def grounded(scene: og.Scene) -> og.Scene:
    scene.ground()
    return scene


@pytest.mark.parametrize("case", REFUSED)
def test_wrong_places_are_refused_by_name(case):
    call, said = REFUSED[case]
    with pytest.raises(og.InputError, match=said):
        call()


def test_an_object_is_removed_with_its_data_and_another_takes_its_name():
    scene = og.Scene()
    scene.add_points(np.eye(3), name="scan")
    steps = np.indices((3, 3, 3))[0] / 2
    scene.add_isosurface(steps, 0.4, field=steps, name="skin")
    scene.ground()
    before = scene.to_toml()
    with pytest.raises(og.InputError, match="one of scan, skin, ground, found 'scann'; did you mean `scan`"):
        scene.remove("scann")
    with pytest.raises(og.InputError, match="found None"):
        scene.remove(None)
    assert scene.to_toml() == before
    scene.remove("skin")
    scene.remove("ground")
    assert scene.objects == ["scan"] and list(scene._data) == ["scan"]
    scene.ground()
    scene.add_points(2 * np.eye(3), name="skin")
    scene.remove("scan")
    assert og.render(scene, size=(24, 18)).alpha.max() > 0.0
    scene.remove("skin")
    scene.remove("ground")
    assert scene.to_toml() == og.Scene().to_toml()
    with pytest.raises(og.InputError, match="one of none, found 'skin'"):
        scene.remove("skin")


def test_an_object_of_a_first_scene_is_removed():
    scene = og.Scene.from_files(ASSETS / "points" / "hedge.csv")
    scene.remove(scene.objects[0])
    scene.add_points(np.eye(3), name="new")
    assert og.render(scene, size=(24, 18)).size == (24, 18)


def test_arrays_beside_data_that_stands_otherwise_are_named():
    scene = og.Scene()
    scene.add_points(np.eye(3), name="scan")
    assert scene.notes == []
    scene.add(ASSETS / "mni152" / "mni152_t1.nii.gz", name="head")
    said = 'scan: its y points up, where z does in head; transform={"up": "z"} turns it alike'
    assert said in scene.notes
    scene.add_points(np.eye(3), name="alike", transform={"up": "z"})
    scene.add_points(np.eye(3), name="stated", transform={"up": "y"})
    scene.add_points(np.eye(3), name="moved", transform={"translate": [1, 0, 0]})
    scene.ground()
    assert [note.split(":")[0] for note in scene.notes if "points up, where" in note] == ["scan", "moved"]
    scene.set("object.scan.transform", {"up": "z"})
    scene.remove("moved")
    assert said not in scene.notes


def test_an_isosurface_is_framed_without_the_empty_voxels_around_it():
    z, y, x = np.indices((40, 40, 40))
    distance = np.sqrt((x - 9.2) ** 2 + (y - 20.0) ** 2 + (z - 30.5) ** 2)
    scene = og.Scene()
    scene.add_isosurface(distance, 4.0, inside="below", name="ball")
    shown = (og.render(scene, size=(64, 48)).alpha > 0.5).any(axis=1).sum()
    # The ball fills nine tenths of the height, of which the volume's box would leave it a fifth.
    assert abs(shown / 48 - 0.9) < 0.05, shown
    scene.camera.orbit(fit=0.5)
    assert abs((og.render(scene, size=(64, 48)).alpha > 0.5).any(axis=1).sum() / 48 - 0.5) < 0.05


def test_a_turn_at_any_elevation_leaves_a_border():
    scene = og.Scene()
    scene.add_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    scene.camera.orbit(elevation=30)
    for picture in og.turntable(scene, 4, size=(64, 48)):
        border = np.concatenate([picture.alpha[[0, -1]].ravel(), picture.alpha[:, [0, -1]].ravel()])
        assert picture.alpha.max() > 0.9 and border.max() == 0.0
