"""Shared by the tests: the repository's data, and the command that pictures and documents are compared with."""

import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[3]
ASSETS = REPOSITORY / "assets"


@pytest.fixture(scope="session")
def command() -> str:
    """The command `organza` of this repository, which `cargo xtask python` builds."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target"))
    # The command once more, as the tests of the workspace are built; else the one that a user builds.
    places = [target / path for path in ("debug/organza-under-test", "debug/organza", "release/organza")]
    found = next((place for place in places if place.is_file()), None)
    if found is None:
        pytest.skip("the command is not built: cargo build -p organza-cli")
    return str(found)
