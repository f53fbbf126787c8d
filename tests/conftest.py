"""Fixtures for all tests."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of public recordings and maps: beside the checkout or at $BRICKTWIN_DATA."""
    folder = Path(os.environ.get("BRICKTWIN_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no public recordings at {folder}; set BRICKTWIN_DATA")
    return folder
