"""Tasks of Dask: the same bits on any scheduler, and after a worker has died."""

import os
import signal

import numpy as np
import organza as og
import pytest

dask = pytest.importorskip("dask")
distributed = pytest.importorskip("distributed")

SMALL = (32, 24)
# Large enough for a legend.
WITH_LEGEND = (320, 240)
FRAMES = 4
SETS = 8


def cloud():
    scene = og.Scene()
    values = np.zeros((9, 9, 9))
    values[2:7, 2:7, 2:7] = 1.0
    scene.add_volume(values, transfer=og.transfer("magma", clim=(0, 1), opacity=[0, 0.5]), name="fog")
    scene.light(direction=(-1, -2, -1), irradiance=(3, 3, 3))
    return scene


def die_once(picture, mark):
    """Ends its worker the first time, with all that the worker holds."""
    try:
        os.close(os.open(mark, os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        return picture
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.fixture(scope="module")
def cluster():
    made = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    with made, distributed.Client(made) as client:
        yield client


def test_frames_are_those_of_a_turntable(cluster):
    tasks = og.dask.frames(cloud(), FRAMES, size=SMALL)
    here = list(og.turntable(cloud(), FRAMES, size=SMALL))
    for pictures in (dask.compute(*tasks, scheduler="synchronous"), dask.compute(*tasks)):
        assert all(np.array_equal(one.rgb, other.rgb) for one, other in zip(pictures, here, strict=True))
    assert not np.array_equal(here[0].rgb, here[1].rgb)


def test_a_killed_worker_changes_no_bit(cluster, tmp_path):
    here = list(og.turntable(cloud(), FRAMES, size=SMALL))
    pictures = og.dask.frames(cloud(), FRAMES, size=SMALL)
    tasks = [dask.delayed(die_once)(picture, str(tmp_path / "mark")) for picture in pictures]
    drawn = dask.compute(*tasks)
    assert (tmp_path / "mark").exists()
    assert all(np.array_equal(one.rgb, other.rgb) for one, other in zip(drawn, here, strict=True))


def test_sets_have_the_same_mean_on_any_scheduler(cluster, tmp_path):
    task = og.dask.sets(cloud(), SETS, each=2, size=SMALL)
    one = task.compute(scheduler="synchronous")
    other = task.compute()
    assert one.layers == ["alpha", "beauty", "std_error"]
    assert all(np.array_equal(one[name], other[name]) for name in one.layers)
    killed = dask.delayed(die_once)(task, str(tmp_path / "mark")).compute()
    assert np.array_equal(one.rgb, killed.rgb)
    other.save(tmp_path / "a.exr")
    assert (tmp_path / "a.exr").stat().st_size > 1000


def test_a_mean_of_sets_has_the_legends_of_its_scene(tmp_path):
    picture = og.dask.sets(cloud(), 4, each=2, size=WITH_LEGEND).compute(scheduler="processes")
    for name, legend in (("with", True), ("without", False)):
        picture.save(tmp_path / f"{name}.png", legend=legend)
    assert (tmp_path / "with.png").read_bytes() != (tmp_path / "without.png").read_bytes()


def test_the_standard_error_of_sets_is_that_of_their_mean():
    """Means of many sets differ by about their standard error, and it is that of one picture of as many sets."""
    means = [og.dask.sets(cloud(), 16, each=2, seed=100 * rank, size=SMALL).compute(scheduler="synchronous") for rank in range(8)]
    luminances = np.array([mean.rgb @ np.float32([0.2126, 0.7152, 0.0722]) for mean in means])
    told = np.sqrt(np.mean([mean["std_error"] ** 2 for mean in means]))
    found = np.sqrt(np.mean(luminances.var(axis=0, ddof=1)))
    assert 0.8 < told / found < 1.25
    scene = cloud()
    for key, value in {"technique": "particles", "particles.repeat_level": 16, "layers": ["std_error"]}.items():
        scene.set(f"render.{key}", value)
    one = og.render(scene, size=SMALL)
    assert 0.8 < told / np.sqrt(np.mean(one["std_error"] ** 2)) < 1.25
    luminance = one.rgb @ np.float32([0.2126, 0.7152, 0.0722])
    assert abs(luminance.mean() - luminances.mean()) < 0.03 * luminances.mean()


def test_layers_without_a_mean_are_named():
    scene = cloud()
    scene.set("render.layers", ["depth.median", "direct"])
    picture = og.dask.sets(scene, 5, size=SMALL).compute(scheduler="synchronous")
    assert picture.layers == ["alpha", "beauty", "direct", "std_error"]
    assert any("depth.median" in note for note in picture.notes)
    # Five sets are two tasks, of 2 and of 3.
    assert '"sets": 5' in picture._drawn.metadata or '"sets":5' in picture._drawn.metadata


@pytest.mark.parametrize(("wrong", "said"), [({"count": 3}, "4 sets or more"), ({"each": 1}, "2 sets or more"), ({"seed": -1}, "seed")])
def test_wrong_sets_are_refused(wrong, said):
    with pytest.raises(og.InputError, match=said):
        og.dask.sets(cloud(), **wrong)
