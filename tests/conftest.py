"""Fixtures for all tests."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# kernels compile on their first call, and a failure must come back on the next run
settings.register_profile("repeatable", deadline=None, derandomize=True, max_examples=60)
settings.load_profile("repeatable")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of public recordings and maps: beside the checkout or at $BRICKTWIN_DATA."""
    folder = Path(os.environ.get("BRICKTWIN_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no public recordings at {folder}; set BRICKTWIN_DATA")
    return folder
