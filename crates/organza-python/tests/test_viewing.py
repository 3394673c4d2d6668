"""Views: a page that is served, and what a notebook shows of it."""

import urllib.error
import urllib.request

import numpy as np
import organza as og
import pytest


def cloud():
    scene = og.Scene()
    scene.add_points(np.random.default_rng(0).normal(size=(500, 3)), name="cloud")
    return scene


def test_a_view_is_served_until_it_is_closed():
    with og.view(cloud(), size=(64, 48)) as view:
        assert view.is_open and view.url.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(view.url, timeout=10) as answer:
            assert b"<title>Organza</title>" in answer.read()
            # A notebook of this machine may show it, no other page.
            assert "frame-ancestors http://localhost:*" in answer.headers["content-security-policy"]
        assert f'<iframe src="{view.url}"' in view._repr_html_()
        assert '"cloud"' in view.scene_text()
    assert not view.is_open and "closed" in view._repr_html_()
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(view.url, timeout=10)


def test_what_cannot_be_viewed_is_refused():
    with pytest.raises(og.InputError):
        og.view(cloud(), effects={"shadow.moon": "off"})
