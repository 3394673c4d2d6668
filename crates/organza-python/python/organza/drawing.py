"""Drawing files, data and scenes."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from typing import Any

from organza import _organza
from organza.checking import named
from organza.picture import Picture
from organza.progressing import Progress, check_progress, heard
from organza.scene import Scene, scene_of
from organza.values import flag, number, sides_of, text, whole


@named
def render(
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
    transparent: bool = False,
    budget_ms: int | None = None,
    max_rmse: float | None = None,
    max_flip: float | None = None,
    threads: int | None = None,
    max_memory: int | None = None,
    drop_invalid: bool = False,
    strict: bool = False,
    progress: Any = None,
) -> Picture:
    """Draws a scene, or a first scene of files and data: what ``organza render`` draws of them.

    Parameters
    ----------
    *what
        A :class:`Scene`, the path of a scene file, or any number of data files and data sets (see :meth:`Scene.add`).
    size
        Width and height, pixels; 960 x 540 where nothing says another.
    preset, color_by, up, ground, azimuth, elevation, fit
        Of a first scene, as the options of ``organza render FILE``: how volumes look, the column that points have their colours from, the axis that points
        up (``"y"``, ``"z"``, ``"-y"``), a ground below, where the camera stands (degrees), and the share of the picture that is filled.
    effects
        Effects that are switched, such as ``{"shadow.sun": "off"}``.
    transparent
        Keep what ``Picture.save(…, transparent=True)`` needs.
    budget_ms
        Milliseconds from files read to picture finished, 1 to 86,400,000: settings give way as far as the time requires, see :attr:`Picture.goal`. The key
        ``render.budget_ms`` of a scene where it is None, as for the next two.
    max_rmse, max_flip
        Errors of the displayed picture against the scene's own settings, above 0 and at most 1: the root mean square, and the mean FLIP. The settings that cost
        least within them are taken, or those that err least within ``budget_ms``.
    threads
        Threads that draw; as many as the machine has where it is None. Pictures are the same for any number.
    max_memory
        Bytes that data and buffers may take together; 8 GiB where it is None.
    drop_invalid
        Leave out points of files that are not finite, instead of refusing the file.
    strict
        Refuse files with a fault that could be mended.
    progress
        True for a bar of tqdm, or lines where that is not installed; a bar of tqdm; or a function, called with the name of the stage and the share that is
        done, from 0 to 1.

    Returns
    -------
    Picture

    Raises
    ------
    InputError
        Data or a scene that is wrong; the message names it, what was expected and found.
    LimitError
        What would take more than ``max_memory``, or longer than ``budget_ms`` with every setting; nothing is drawn.
    FileNotFoundError, OSError
        Files that cannot be read.
    """
    wished = _wished(size, preset, color_by, up, ground, azimuth, elevation, fit)
    with heard(progress) as told:
        how = _how(threads, max_memory, told, drop_invalid, strict)
        scene = scene_of(what, wished, how)
        given = scene._given(how, effects, size, transparent)
        given["changes"] = _goal({"budget_ms": budget_ms, "max_rmse": max_rmse, "max_flip": max_flip})
        picture = Picture(_organza.render(given, how, True), scene.notes)
    warn(picture.warnings)
    return picture


@named
def turntable(
    what: Any,
    frames: int = 36,
    *,
    size: tuple[int, int] | None = None,
    preset: str | None = None,
    color_by: str | None = None,
    up: str | None = None,
    ground: bool = False,
    azimuth: float | None = None,
    elevation: float | None = None,
    fit: float | None = None,
    effects: dict[str, str] | None = None,
    transparent: bool = False,
    threads: int | None = None,
    max_memory: int | None = None,
    drop_invalid: bool = False,
    strict: bool = False,
    progress: Any = None,
) -> Iterator[Picture]:
    """Draws a scene from all around, one picture after the other, as ``organza render --turntable`` does.

    Parameters
    ----------
    what
        A :class:`Scene`, a file or a data set.
    frames
        Pictures of the whole circle.
    size, preset, color_by, …
        As for :func:`render`. The camera turns about the vertical from where it stands: ``azimuth`` and ``elevation`` of data, and what
        ``scene.camera.orbit(azimuth=…, elevation=…)`` says of a scene.
    """
    frames = whole("frames", frames) or 1
    check_progress(progress)
    how = _how(threads, max_memory, None, drop_invalid, strict)
    wished = _wished(size, preset, color_by, up, ground, azimuth, elevation, fit) | {"turntable": frames}
    # Files and names are refused by the call, not by the first picture.
    return _turned(scene_of((what,), wished, how), frames, size, effects, transparent, how, progress)


def _turned(
    scene: Scene,
    frames: int,
    size: tuple[int, int] | None,
    effects: dict[str, str] | None,
    transparent: bool,
    how: dict[str, Any],
    progress: Any,
) -> Iterator[Picture]:
    """The pictures of a turn. A sentence of warning that several have is given once."""
    told: set[str] = set()
    for frame in range(frames):
        picture = _frame(scene, frame, frames, size, effects, transparent, how, progress)
        for sentence in picture.warnings:
            if sentence not in told:
                told.add(sentence)
                warnings.warn(sentence, stacklevel=2)
        yield picture


def _frame(
    scene: Scene,
    frame: int,
    frames: int,
    size: tuple[int, int] | None,
    effects: dict[str, str] | None,
    transparent: bool,
    how: dict[str, Any],
    progress: Any = None,
) -> Picture:
    """A frame of a turn around a scene."""
    with heard(progress) as told:
        how = how | {"progress": told}
        given = scene._given(how, effects, size, transparent, turntable=frames) | {"frame": frame}
        return Picture(_organza.render(given, how), scene.notes)


def unused_goal(given: dict[str, Any], how: dict[str, Any], place: str) -> list[str]:
    """Sentences about the keys of a time or an error to keep to, in a place that keeps to none."""
    keys = _organza.goal_keys(given, how | {"progress": None})
    return [f"{key} has no part in {place}: one picture of organza.render keeps to it" for key in keys]


def warn(sentences: list[str]) -> None:
    """Warns the caller of a function of the package."""
    for sentence in sentences:
        # Beyond the check of names.
        warnings.warn(sentence, stacklevel=4)


def _goal(stated: Mapping[str, Any]) -> list[str]:
    """Changes of a scene's keys that state a time or an error to keep to."""
    return [f"render.{key}={number(key, value):.17g}" for key, value in stated.items() if value is not None]


def _how(
    threads: int | None, max_memory: int | None, progress: Progress | None, drop_invalid: bool, strict: bool
) -> dict[str, Any]:
    return {
        "threads": whole("threads", threads),
        "max_memory": whole("max_memory", max_memory, "bytes"),
        "progress": progress,
        "drop_invalid": flag("drop_invalid", drop_invalid),
        "strict": flag("strict", strict),
    }


def _wished(
    size: tuple[int, int] | None,
    preset: str | None,
    color_by: str | None,
    up: str | None,
    ground: bool,
    azimuth: float | None,
    elevation: float | None,
    fit: float | None,
) -> dict[str, Any]:
    return {
        "size": sides_of(size),
        "preset": text("preset", preset, "the name of a look"),
        "color_by": text("color_by", color_by, "the name of a column"),
        "up": text("up", up, "'y', 'z' or '-y'"),
        "ground": flag("ground", ground),
        "azimuth": None if azimuth is None else number("azimuth", azimuth),
        "elevation": None if elevation is None else number("elevation", elevation),
        "fit": None if fit is None else number("fit", fit),
        "turntable": None,
    }
