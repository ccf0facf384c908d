"""Importing this makes every target known."""

from __future__ import annotations

from tests.hostile import (
    targets_bus,
    targets_eds,
    targets_files,
    targets_localcan,
    targets_network,
    targets_page,
    targets_recordings,
    targets_simulator,
)

MODULES = (
    targets_bus,
    targets_eds,
    targets_files,
    targets_localcan,
    targets_network,
    targets_page,
    targets_recordings,
    targets_simulator,
)
