"""A machine file whose learning takes few and short strokes."""

from __future__ import annotations

from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[3]


@pytest.fixture
def machine_file(tmp_path: Path) -> Path:
    text = (REPOSITORY / "machines" / "xy_table" / "controller.toml").read_text(encoding="utf-8")
    text = text.replace("../../eds", str(REPOSITORY / "eds"))
    text = text.replace("radius_mm = 50.0", "radius_mm = 2.0")
    text = text.replace("[2.0, 8.0, 30.0, 120.0]", "[400.0, 500.0, 600.0, 700.0]")
    text = text.replace("jerk_mm_s3 = 50000.0", "jerk_mm_s3 = 500000.0")
    path = tmp_path / "controller.toml"
    path.write_text(text, encoding="utf-8")
    return path
