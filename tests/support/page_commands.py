"""The commands that the pages of docs show, and a directory with the files that they use."""

import re
import shlex
import shutil
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from golden_formats import FORMATS

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
LINE = re.compile(r"^(?: {4})?((?:servo-ctrl|hil-sim|reconcile) .*)$", re.MULTILINE)
GROUPS = ROOT / "tests" / "docs" / "commands_of_pages.toml"
AXIS = """[axis.x]
transmission.lead_mm = 5.0
motor.torque_constant_nm_a = 0.4
table.mass_kg = 50.0
"""


class Shown(NamedTuple):
    """A command on a page."""

    page: Path
    line: str
    words: list[str]

    @property
    def command(self) -> str:
        """The command without the comment after it."""
        return self.line.partition(" #")[0].strip()


class Group(NamedTuple):
    """Commands that are run one after the other in one directory."""

    name: str
    when: str
    run: list[str]
    beside: list[tuple[str, str]]
    """Commands that keep running, and what each prints when it is ready."""
    needs: str
    why: str


def shown() -> list[Shown]:
    """Return every command that a page shows in full."""
    found = []
    for page in PAGES:
        for line in LINE.findall(page.read_text(encoding="utf-8")):
            words = shlex.split(line, comments=True)
            if "..." not in words:
                found.append(Shown(page, line, words))
    return found


def groups() -> list[Group]:
    """Return the groups of commands_of_pages.toml."""
    found: list[dict[str, Any]] = tomllib.loads(GROUPS.read_text(encoding="utf-8"))["group"]
    return [
        Group(
            name=entry["name"],
            when=entry["when"],
            run=entry["run"],
            beside=[(command, ready) for command, ready in entry.get("beside", [])],
            needs=entry.get("needs", ""),
            why=entry.get("why", ""),
        )
        for entry in found
    ]


def world(place: Path) -> Path:
    """Fill an empty directory with the files that the pages assume; return it."""
    release = FORMATS / "1.0"
    for name in ("machines", "eds"):
        shutil.copytree(ROOT / name, place / name, ignore=shutil.ignore_patterns("learned", "templates"))
    xy_table = place / "machines" / "xy_table"
    shutil.copytree(release / "learned", xy_table / "learned")
    shutil.copy(place / "eds" / "servo_drive.eds", place / "drive.eds")
    shutil.copytree(release / "recording", place / "out" / "demo" / "recording")
    shutil.copytree(release / "diagnosis", place / "out" / "diagnosis")
    (place / "out" / "axis").mkdir()
    shutil.copy(xy_table / "programs" / "first_move.toml", place / "out" / "axis" / "next_experiment.toml")
    for name, copy in (("plant.toml", "nominal.toml"), ("plant_lubrication_loss.toml", "worn.toml")):
        text = (xy_table / name).read_text(encoding="utf-8")
        (place / copy).write_text(text.replace("../../eds/", "eds/"), encoding="utf-8")
    (place / "axis.toml").write_text(AXIS, encoding="utf-8")
    (place / "models").mkdir()
    (place / "models" / "default.toml").write_text(AXIS, encoding="utf-8")
    _recordings(place)
    return place


def _recordings(place: Path) -> None:
    """Write two recordings of an axis with friction and cogging: as CSV, as a fleet, and as runs to watch."""
    t = np.arange(8_000) * 1e-3
    for number in (1, 2):
        x = 0.02 * np.sin(2 * np.pi * 0.31 * number * t) + 0.008 * np.sin(2 * np.pi * 1.13 * t + 1)
        v = np.gradient(x, t)
        force = 50 * np.gradient(v, t) + 100 * v + 12 * np.sign(v) + 3 * np.sin(2 * np.pi * x / 5e-3)
        force += np.random.default_rng(number).normal(0, 0.3, t.size)
        current = force * 5e-3 / (2 * np.pi) / 0.4
        rows = np.column_stack([t, x, current])
        np.savetxt(place / f"run{number}.csv", rows, delimiter=",", header="t,q,i", comments="")
        table = pa.table({"time_s": t, "motor_position_m": x, "motor_force_n": force})
        files = [place / "runs" / f"2026-11-2{number}.parquet"]
        files += [
            place / name / f"machine=mill-{number}/axis=x/run.parquet" for name in ("dataset", "recordings")
        ]
        for file in files:
            file.parent.mkdir(parents=True, exist_ok=True)
            pq.write_table(table, file)
