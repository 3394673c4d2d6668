"""The examples draw."""

import runpy
from pathlib import Path

import numpy as np
import pytest

EXAMPLES = sorted((Path(__file__).resolve().parents[1] / "examples").glob("*.py"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
@pytest.mark.filterwarnings("ignore")
def test_an_example_draws(example, tmp_path):
    place = tmp_path / "a.png"
    runpy.run_path(str(example))["main"](str(place), (96, 54))
    written = np.frombuffer(place.read_bytes(), dtype=np.uint8)
    # A picture of one colour takes hardly any bytes.
    assert len(written) > 2000
