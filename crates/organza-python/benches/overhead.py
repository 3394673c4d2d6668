"""Times the way in and out of a million points, beside the picture: python crates/organza-python/benches/overhead.py."""

import time
import warnings

import numpy as np
import organza as og

COUNT = 1_000_000
REPEATS = 3


def main() -> None:
    warnings.simplefilter("ignore")
    places = np.random.default_rng(0).normal(size=(COUNT, 3)).astype(np.float32)
    values = places[:, 1].copy()
    for _ in range(REPEATS):
        start = time.perf_counter()
        scene = og.Scene()
        scene.add_points(places, values=values, name="cloud")
        inside = time.perf_counter()
        picture = og.render(scene)
        drawn = time.perf_counter()
        layers = [picture.rgb, picture.alpha]
        end = time.perf_counter()
        ways = inside - start + end - drawn
        passes = sum(part["seconds"] for part in picture.cost)
        print(f"in {inside - start:.3f} s, picture {drawn - inside:.3f} s (its passes {passes:.3f} s), out {end - drawn:.3f} s of {sum(map(np.size, layers))} numbers: {100 * ways / (drawn - inside):.1f} %")


if __name__ == "__main__":
    main()
