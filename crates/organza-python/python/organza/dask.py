"""Pictures as tasks of Dask: the frames of a turn, and sets of particles, spread over any scheduler.

>>> import dask, organza as og
>>> pictures = dask.compute(*og.dask.frames("head.nii.gz", 36))       # doctest: +SKIP
>>> picture = og.dask.sets("head.nii.gz", 64).compute()               # doctest: +SKIP
>>> picture["std_error"]                                              # doctest: +SKIP

A task is the same picture wherever it is drawn, and however often: a worker that dies changes no bit. Files that a scene names are read by the workers, from
the same path. Arrays travel with the scene, once.
"""

from __future__ import annotations

import json
import os
import uuid
from dataclasses import dataclass, field
from typing import Any

import numpy as np

try:
    from dask.delayed import delayed
except ImportError:
    raise ImportError("organza.dask: expected the package dask, found none; pip install 'dask[distributed]'") from None

from organza import _organza
from organza._organza import InputError
from organza.checking import named
from organza.drawing import _frame, _how, _wished
from organza.picture import Picture
from organza.scene import Scene, scene_of
from organza.values import whole

# Layers whose mean over sets is the layer of all sets.
_AVERAGED = ("beauty", "alpha", "background", "ambient", "emission", "direct", "scatter1", "scatterN", "reflection", "refraction")
# Luminance of linear Rec.709.
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# Sets that one task can draw at least.
_FEWEST = 2
# Partial means that one task merges: few enough for a worker's memory.
_MERGED = 8


@named
def frames(
    what: Any,
    count: int = 36,
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
    threads: int | None = 1,
    max_memory: int | None = None,
    drop_invalid: bool = False,
    strict: bool = False,
) -> list[Any]:
    """Draws a scene from all around: a task for each picture of a turn, as :func:`organza.turntable` draws them.

    Parameters
    ----------
    what
        A :class:`organza.Scene`, a file or a data set.
    count
        Pictures of the whole circle.
    size, preset, color_by, …
        As for :func:`organza.render`.
    threads
        Threads of one task; as many as the worker's machine has if it is None.

    Returns
    -------
    list of dask.delayed.Delayed
        Each computes a :class:`organza.Picture`.
    """
    total = whole("count", count) or 1
    wished = _wished(size, preset, color_by, up, ground, azimuth, elevation, fit) | {"turntable": total}
    how = _how(threads, max_memory, None, drop_invalid, strict)
    held = _held(scene_of((_placed(what),), wished, how))
    draw = delayed(_frame, name="organza-frame", pure=False)
    return [draw(held, frame, total, size, effects, transparent, how) for frame in range(total)]


@named
def sets(
    what: Any,
    count: int = 64,
    *,
    each: int = 4,
    seed: int = 0,
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
    threads: int | None = 1,
    max_memory: int | None = None,
    drop_invalid: bool = False,
    strict: bool = False,
) -> Any:
    """Draws a scene by the technique ``particles``: tasks draw independent sets, and their mean is one picture with its standard error.

    Parameters
    ----------
    what
        A :class:`organza.Scene`, a file or a data set. Objects that state another technique keep it.
    count
        Sets of particles altogether, 4 or more.
    each
        Sets of one task, 2 or more. A task loads the scene: many small tasks take longer altogether, few large ones longer at least.
    seed
        Seed of the first task; the task of rank k has ``seed + k``.
    size, preset, color_by, …
        As for :func:`organza.render`.
    threads
        Threads of one task; as many as the worker's machine has if it is None.

    Returns
    -------
    dask.delayed.Delayed
        It computes a :class:`organza.Picture` with the layer ``std_error``, the standard error of the luminance of ``beauty``, found from the differences
        between tasks. Depths, normals and objects are not averaged, and are left out with a note. The mean is taken in the order of the ranks, so the bits
        depend on ``count``, ``each`` and ``seed`` alone.
    """
    total = whole("count", count) or 1
    if total < 2 * _FEWEST:
        raise InputError(f"count: expected {2 * _FEWEST} sets or more, whose differences are the error, found {count!r}")
    part = whole("each", each) or 1
    if part < _FEWEST:
        raise InputError(f"each: expected {_FEWEST} sets or more, found {each!r}")
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise InputError(f"seed: expected a whole number from 0 on, found {seed!r}")
    # One task alone has no error.
    tasks = max(total // part, 2)
    wished = _wished(size, preset, color_by, up, ground, azimuth, elevation, fit)
    how = _how(threads, max_memory, None, drop_invalid, strict)
    held = _held(scene_of((_placed(what),), wished, how))
    draw = delayed(_set, name="organza-sets", pure=False)
    merge = delayed(_merge, name="organza-mean", pure=False)
    means = []
    for rank in range(tasks):
        drawn = total * (rank + 1) // tasks - total * rank // tasks
        means.append(draw(held, drawn, seed + rank, size, effects, transparent, how))
    while len(means) > 1:
        means = [merge(means[first : first + _MERGED]) for first in range(0, len(means), _MERGED)]
    return delayed(_finish, name="organza-picture", pure=False)(means[0])


def _placed(what: Any) -> Any:
    """A path that holds in the working folder of a worker too."""
    return os.path.abspath(what) if isinstance(what, (str, os.PathLike)) else what


def _held(scene: Scene) -> Any:
    """The scene as one node of the graph, so that its data travels once."""
    return delayed(scene, name=f"organza-scene-{uuid.uuid4().hex}", traverse=False)


@dataclass
class _Mean:
    """The mean of the sets of some tasks, in the order of their ranks."""

    # Sets, and tasks that drew them.
    sets: int
    tasks: int
    layers: dict[str, Any]
    # Squared differences of the luminance, each weighed by the sets of its task.
    squares: Any
    facts: dict[str, Any]
    metadata: dict[str, Any]
    # What colours stand for, which is the same in all sets.
    legends: list[dict[str, Any]]
    remarks: list[str]
    left_out: list[str] = field(default_factory=list)


def _set(
    scene: Scene,
    drawn: int,
    seed: int,
    size: tuple[int, int] | None,
    effects: dict[str, str] | None,
    transparent: bool,
    how: dict[str, Any],
) -> _Mean:
    """Sets of one seed."""
    changes = ['render.technique="particles"', f"render.particles.repeat_level={drawn}", f"render.seed={seed}"]
    given = scene._given(how, effects, size, transparent) | {"changes": changes}
    picture = _organza.render(given, how)
    metadata = json.loads(picture.metadata)
    layers = {name: picture.layer(name).astype(np.float64) for name in picture.layers if name in _AVERAGED}
    left_out = [name for name in picture.layers if name not in (*_AVERAGED, "std_error")]
    # A scene may state an error to reach, by which a task draws another number of sets.
    sets_drawn = metadata["sets"] or drawn
    squares = np.zeros(layers["alpha"].shape)
    return _Mean(sets_drawn, 1, layers, squares, json.loads(picture.facts), metadata, picture.legends, scene.notes, left_out)


def _merge(means: list[_Mean]) -> _Mean:
    """The mean of means, one after the other."""
    merged = means[0]
    for other in means[1:]:
        merged = _merged(merged, other)
    return merged


def _merged(first: _Mean, second: _Mean) -> _Mean:
    total = first.sets + second.sets
    share = second.sets / total
    layers = {name: first.layers[name] + (second.layers[name] - first.layers[name]) * share for name in first.layers}
    apart = (second.layers["beauty"] - first.layers["beauty"]) @ _LUMINANCE
    squares = first.squares + second.squares + apart * apart * (first.sets * share)
    warnings = [sentence for sentence in second.facts["warnings"] if sentence not in first.facts["warnings"]]
    stages = zip(first.facts["cost"], second.facts["cost"])
    cost = [one | {"seconds": one["seconds"] + other["seconds"]} for one, other in stages]
    facts = first.facts | {"warnings": first.facts["warnings"] + warnings, "cost": cost}
    tasks = first.tasks + second.tasks
    return _Mean(total, tasks, layers, squares, facts, first.metadata, first.legends, first.remarks, first.left_out)


def _finish(mean: _Mean) -> Picture:
    """The picture of a mean."""
    layers = {name: layer.astype(np.float32) for name, layer in mean.layers.items()}
    variance = mean.squares / (mean.tasks - 1)
    layers["std_error"] = np.sqrt(variance / mean.sets).astype(np.float32)
    notes = list(mean.facts["notes"])
    if mean.left_out:
        notes.append(f"layers that have no mean over sets are left out: {', '.join(mean.left_out)}")
    facts = json.dumps(mean.facts | {"notes": notes})
    drawn = _organza.Picture.of_parts(layers, facts, json.dumps(mean.metadata | {"sets": mean.sets}), mean.legends)
    return Picture(drawn, mean.remarks)


__all__ = ["frames", "sets"]
