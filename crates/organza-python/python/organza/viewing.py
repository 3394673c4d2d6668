"""Scenes on a page of the browser."""

from __future__ import annotations

import html
import os
from pathlib import Path
from typing import Any

from organza import _organza
from organza.checking import named
from organza.drawing import _how, _wished, unused_goal, warn
from organza.progressing import heard
from organza.scene import scene_of
from organza.values import whole


class View:
    """A scene on a page of this machine: turned, changed, and drawn again. A notebook shows the page.

    It is served until :meth:`close`, until the view is forgotten, or a while after its last page was closed.

    >>> import organza as og
    >>> with og.view("head.nii.gz") as view:             # doctest: +SKIP
    ...     print(view.url)
    """

    def __init__(self, served: _organza.View, height: int):
        self._served = served
        self._height = height

    @property
    def url(self) -> str:
        """The address of the page. Whoever has it on this machine sees the scene, and changes it."""
        return self._served.url

    @property
    def is_open(self) -> bool:
        """Whether the page is still served."""
        return self._served.is_open

    def scene_text(self) -> str:
        """The scene as it is seen, with the changes that were made on the page, as the text of a scene file."""
        return self._served.scene_text()

    def close(self) -> None:
        """Ends the view."""
        self._served.close()

    def __enter__(self) -> View:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<organza.View {self.url}>" if self.is_open else "<organza.View, closed>"

    def _repr_html_(self) -> str:
        if not self.is_open:
            return "<p>This view is closed.</p>"
        url = html.escape(self.url)
        frame = f'<iframe src="{url}" title="Organza" width="100%" height="{self._height}" style="border: 0"></iframe>'
        return f'{frame}<p><a href="{url}" target="_blank" rel="noopener">Open in a page of its own</a></p>'


@named
def view(
    *what: Any,
    size: tuple[int, int] | None = None,
    preset: str | None = None,
    color_by: str | None = None,
    up: str | None = None,
    ground: bool = False,
    azimuth: float | None = None,
    elevation: float | None = None,
    fit: float | None = None,
    effects: dict[str, str] | None = None,
    height: int = 640,
    max_memory: int | None = None,
    drop_invalid: bool = False,
    strict: bool = False,
    progress: Any = None,
) -> View:
    """Shows a scene, or a first scene of files and data, on a page: what ``organza view`` shows of them.

    Parameters but ``height`` are those of :func:`organza.render`. The page is served on this machine alone; a notebook on another one needs a tunnel to
    the port of :attr:`View.url`.

    Parameters
    ----------
    height
        Height of the page inside of a notebook, pixels.

    Returns
    -------
    View
    """
    side = whole("height", height, "pixels") or 1
    wished = _wished(size, preset, color_by, up, ground, azimuth, elevation, fit)
    paths = [Path(os.fspath(thing)).name for thing in what if isinstance(thing, (str, os.PathLike))]
    title = ", ".join(paths) or "scene"
    with heard(progress) as told:
        how = _how(None, max_memory, told, drop_invalid, strict)
        given = scene_of(what, wished, how)._given(how, effects, size)
        warn(unused_goal(given, how, "organza.view"))
        return View(_organza.view(given, title, how), side)
