"""The disk cache of the kernels: the present version stays, old ones do not pile up."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from hil_sim.physics.jit import forget_old_caches

if TYPE_CHECKING:
    from pathlib import Path


def folder(parent: Path, name: str, age_s: int) -> Path:
    made = parent / name
    made.mkdir()
    (made / "kernel.nbc").write_bytes(b"code")
    os.utime(made, (1_000_000 - age_s, 1_000_000 - age_s))
    return made


def test_the_present_and_the_last_used_stay(tmp_path: Path) -> None:
    present = folder(tmp_path, "plant-kernels-now", 500)
    for age_s in (100, 200, 300, 400):
        folder(tmp_path, f"plant-kernels-{age_s}", age_s)
    folder(tmp_path, "kernels-of-someone-else", 900)
    forget_old_caches(present, kept=2)
    assert sorted(item.name for item in tmp_path.iterdir()) == [
        "kernels-of-someone-else",
        "plant-kernels-100",
        "plant-kernels-200",
        "plant-kernels-now",
    ]
    assert present.stat().st_mtime > 1_000_000


def test_a_folder_that_is_not_there_yet_is_no_matter(tmp_path: Path) -> None:
    forget_old_caches(tmp_path / "none" / "plant-kernels-now", kept=2)
    assert list(tmp_path.iterdir()) == []
