"""Scenes and files described, explained and judged: the documents of the command, as dicts."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from organza import _organza
from organza._organza import InputError
from organza.checking import named
from organza.drawing import _how, _wished, unused_goal, warn
from organza.progressing import Progress, heard
from organza.scene import Scene, _is_scene, scene_of
from organza.values import flag

# Doublings of the ends of knobs that a report can take.
_MOST_FINER = 4


@named
def info(
    what: Any,
    *,
    strict: bool = False,
    threads: int | None = None,
    max_memory: int | None = None,
) -> dict[str, Any]:
    """Describes a data file, a scene file or a scene: what ``organza info --json`` prints.

    Parameters
    ----------
    what
        The path of a file, or a :class:`Scene`.
    strict
        Refuse a data file with a fault that could be mended.
    threads, max_memory
        As for :func:`organza.render`.

    Returns
    -------
    dict
        Of a data file ``kind``, ``format``, ``counts``, ``bounds``, ``range``, ``histogram``, ``columns``, ``faults``, ``not_used``, ``warnings`` …; of a
        scene ``kind``, ``size``, ``objects``, ``lights``, ``materials``.

    Raises
    ------
    InputError
        A file that is wrong.
    FileNotFoundError, OSError
        A file that cannot be read.
    """
    how = _how(threads, max_memory, None, False, strict)
    if isinstance(what, Scene) or _is_scene(what):
        scene = what if isinstance(what, Scene) else Scene.load(what)
        return _dict(_organza.info_of_scene(scene._given(how, None, None), how))
    if not isinstance(what, (str, os.PathLike)):
        raise InputError(f"what: expected the path of a file, or a scene, found {type(what).__name__}")
    return _dict(_organza.info_of_file(os.fspath(what), how))


@named
def explain(
    *what: Any,
    measure: bool = False,
    size: tuple[int, int] | None = None,
    preset: str | None = None,
    color_by: str | None = None,
    up: str | None = None,
    ground: bool = False,
    azimuth: float | None = None,
    elevation: float | None = None,
    fit: float | None = None,
    effects: dict[str, str] | None = None,
    threads: int | None = None,
    max_memory: int | None = None,
    drop_invalid: bool = False,
    strict: bool = False,
    progress: Any = None,
) -> dict[str, Any]:
    """Explains what drawing a scene would do: effects with reasons and bounds, passes, predicted time and memory.

    Parameters
    ----------
    measure
        Draw the scene too, once as planned and once for each effect, and measure what each effect changes.
    *what, size, preset, …
        As for :func:`organza.render`.

    Returns
    -------
    dict
        The document of ``organza explain --json``: ``plan``, ``predicted``, ``cost``, ``measured``, ``memory_bytes``, ``splats``, ``warnings``, ``notes``,
        ``camera``, ``up``, ``scene``.

        ``plan`` has ``effects``, ``estimates`` of what techniques err by, ``compared``: what ``technique = "auto"`` weighed for each ``object``, or for all of
        them together (None), ``drawn_by``, with ``displayed_error`` (None where it is not known), ``seconds`` of one core, ``taken`` and ``reason``; and
        ``settings`` and ``passes``.

        ``predicted`` has ``seconds`` on the ``threads`` of this machine and ``seconds_of_one_core``, the source of its rates (``by``), ``passes`` with their
        ``counts``, the sentence that a long drawing begins with (``announcement``, or None), and ``effects``: for each that runs passes of its own ``name``,
        ``seconds``, ``bytes`` and ``passes``.

        ``measured`` is None unless ``measure``: ``seconds`` of the picture, ``splats`` (``lit`` and ``in_view``, or None), ``effects`` with ``name``,
        ``largest_change``, ``share_beyond_tolerance``, ``seconds_with`` and ``seconds_without``, ``not_switched`` (``name`` and ``reason``), and
        ``left_out_together``.
    """
    with heard(progress) as told:
        how = _how(threads, max_memory, told, drop_invalid, strict)
        scene = scene_of(what, _wished(size, preset, color_by, up, ground, azimuth, elevation, fit), how)
        given = scene._given(how, effects, size)
        document = _dict(_organza.explain(given, flag("measure", measure), how))
    unused = unused_goal(given, how, "organza.explain, which tells of the scene's own settings")
    document["warnings"] += unused
    warn(unused)
    paths = [os.fspath(thing) for thing in what if isinstance(thing, (str, os.PathLike))]
    document["scene"] = paths[0] if paths else None
    return document


@named
def accuracy(
    *what: Any,
    folder: str | os.PathLike[str] | None = None,
    quick: bool = False,
    finer: int = 0,
    force: bool = False,
    size: tuple[int, int] | None = None,
    preset: str | None = None,
    color_by: str | None = None,
    up: str | None = None,
    ground: bool = False,
    azimuth: float | None = None,
    elevation: float | None = None,
    fit: float | None = None,
    effects: dict[str, str] | None = None,
    threads: int | None = None,
    max_memory: int | None = None,
    drop_invalid: bool = False,
    strict: bool = False,
    progress: Any = None,
) -> dict[str, Any]:
    """Draws a scene by every technique with each of its settings turned, and judges errors and times: ``organza accuracy --json``.

    A few thousand opaque points take seconds of a core. A volume of 24 x 24 x 24 voxels takes 85 s with ``quick`` and 80 x 60 pixels, and 200 s with the
    192 x 108 pixels of ``quick`` alone: two thirds of that are the few pictures of 32 x 32 samples a pixel that all others are judged by, so that time goes with
    the pixels, and ``size`` sets it. Without ``quick``, and with ``finer``, it takes longer. ``progress=True`` shows how far it is.
    ``docs/accuracy.md`` explains the report.

    Parameters
    ----------
    folder
        Where ``accuracy.json``, ``accuracy.csv`` and ``accuracy.html`` are written; nowhere if it is None. An interrupted report is written with the
        techniques that it has.
    quick
        A small picture, few steps and repeats.
    finer
        Doublings of the end of every setting, 0 to 4, for a better reference.
    force
        Whether files that exist are replaced.
    *what, size, …
        As for :func:`organza.render`. Without a size the picture is made small: 320 pixels, or 192 if it is quick.

    Returns
    -------
    dict
        ``report``, the document of ``accuracy.json``, and ``outputs``, the paths that were written. Techniques that draw the scene stand in the report's
        ``techniques``, the others in ``absent`` with the reason.
    """
    if isinstance(finer, bool) or not isinstance(finer, int) or not 0 <= finer <= _MOST_FINER:
        raise InputError(f"finer: expected a whole number from 0 to {_MOST_FINER}, found {finer!r}")
    with heard(progress) as told, _folder(folder) as made:
        how = _how(threads, max_memory, told, drop_invalid, strict)
        scene = scene_of(what, _wished(size, preset, color_by, up, ground, azimuth, elevation, fit), how)
        effort = {"quick": flag("quick", quick), "finer": finer, "folder": made, "force": flag("force", force)}
        given = scene._given(how, effects, size)
        report = _dict(_organza.judge_accuracy(given, effort, how))
    warn(unused_goal(given, how, "organza.accuracy, which measures the scene's own settings"))
    return report


@named
def orders(
    *what: Any,
    folder: str | os.PathLike[str] | None = None,
    quick: bool = False,
    force: bool = False,
    size: tuple[int, int] | None = None,
    preset: str | None = None,
    color_by: str | None = None,
    up: str | None = None,
    ground: bool = False,
    azimuth: float | None = None,
    elevation: float | None = None,
    fit: float | None = None,
    effects: dict[str, str] | None = None,
    threads: int | None = None,
    max_memory: int | None = None,
    drop_invalid: bool = False,
    strict: bool = False,
    progress: Any = None,
) -> dict[str, Any]:
    """Draws a scene with its splats in every order, and compares each with the exact order of every pixel: ``organza orders --json``.

    Parameters
    ----------
    folder
        Where ``orders.json``, ``orders.csv``, ``orders.html`` and ``orders.png`` are written; nowhere if it is None.
    quick, force, *what, size, …
        As for :func:`accuracy`.

    Returns
    -------
    dict
        ``report``, the document of ``orders.json``, and ``outputs``, the paths that were written.
    """
    with heard(progress) as told, _folder(folder) as made:
        how = _how(threads, max_memory, told, drop_invalid, strict)
        scene = scene_of(what, _wished(size, preset, color_by, up, ground, azimuth, elevation, fit), how)
        effort = {"quick": flag("quick", quick), "finer": 0, "folder": made, "force": flag("force", force)}
        given = scene._given(how, effects, size)
        report = _dict(_organza.judge_orders(given, effort, how))
    warn(unused_goal(given, how, "organza.orders, which measures the scene's own settings"))
    return report


def _dict(document: str) -> dict[str, Any]:
    read: dict[str, Any] = json.loads(document)
    return read


@contextmanager
def _folder(folder: str | os.PathLike[str] | None) -> Iterator[str | None]:
    """A folder for files, made if it is not there; an empty one that was made is gone again if the work fails."""
    if folder is None:
        yield None
        return
    place = Path(folder)
    is_made = not place.exists()
    place.mkdir(parents=True, exist_ok=True)
    try:
        yield os.fspath(place)
    except BaseException:
        if is_made and not any(place.iterdir()):
            place.rmdir()
        raise


__all__ = ["Progress", "accuracy", "explain", "info", "orders"]
