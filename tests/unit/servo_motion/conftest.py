from pathlib import Path

import pytest


@pytest.fixture
def machines() -> Path:
    return Path(__file__).parents[3] / "machines"
