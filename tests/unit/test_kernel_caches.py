"""The disk caches of the kernels, on either side: the present version stays, old ones do not pile up."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import pytest

from hil_sim.physics import jit as simulator_side
from servo_ctrl.control import jit as controller_side

if TYPE_CHECKING:
    from pathlib import Path

SIDES = pytest.mark.parametrize(
    ("side", "prefix"), [(simulator_side, "plant-kernels-"), (controller_side, "control-kernels-")]
)


def folder(parent: Path, name: str, age_s: int) -> Path:
    made = parent / name
    made.mkdir()
    (made / "kernel.nbc").write_bytes(b"code")
    os.utime(made, (1_000_000 - age_s, 1_000_000 - age_s))
    return made


@SIDES
def test_the_present_and_the_last_used_stay(tmp_path: Path, side: Any, prefix: str) -> None:
    present = folder(tmp_path, f"{prefix}now", 500)
    for age_s in (100, 200, 300, 400):
        folder(tmp_path, f"{prefix}{age_s}", age_s)
    folder(tmp_path, "kernels-of-someone-else", 900)
    side.forget_old_caches(present, kept=2)
    left = {item.name for item in tmp_path.iterdir()}
    assert left == {"kernels-of-someone-else", f"{prefix}100", f"{prefix}200", f"{prefix}now"}
    assert present.stat().st_mtime > 1_000_000


@SIDES
def test_a_folder_that_is_not_there_yet_is_no_matter(tmp_path: Path, side: Any, prefix: str) -> None:
    side.forget_old_caches(tmp_path / "none" / f"{prefix}now", kept=2)
    assert list(tmp_path.iterdir()) == []
