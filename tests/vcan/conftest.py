"""These tests need vcan0; where it is not they skip and say how to run them."""

from __future__ import annotations

from pathlib import Path

import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    if Path("/sys/class/net/vcan0").exists():
        return
    skip = pytest.mark.skip(reason="no interface vcan0 here; `make test-vcan` runs this in user-mode Linux")
    for item in items:
        if item.get_closest_marker("vcan"):
            item.add_marker(skip)
