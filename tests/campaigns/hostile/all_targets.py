"""Imports the modules of all fuzz targets, which register their targets."""

from importlib import import_module
from pathlib import Path

MODULES = [
    import_module(f"{__package__}.{file.stem}") for file in sorted(Path(__file__).parent.glob("targets_*.py"))
]
