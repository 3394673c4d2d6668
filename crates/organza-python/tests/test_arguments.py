"""What arguments may be: names with dots, times to keep to."""

import warnings

import numpy as np
import organza as og
import pytest

SMALL = (32, 24)
PLACES = np.random.default_rng(0).normal(size=(40, 3))


def points(**shown) -> og.Scene:
    scene = og.Scene()
    scene.add_points(PLACES, name="cloud", **shown)
    return scene


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
