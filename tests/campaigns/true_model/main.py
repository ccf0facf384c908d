"""Every machine and random ones, each recorded over the bus and held against its own plant.

Run as `make true-model`. Nothing was left out of these models, so every
verdict must be consistent. Random plants have the masses and friction that `studies.random_plants` bounds.
"""

import json
import re
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from studies.random_plants import FRICTION_SHARE, MASS_SHARE
from tests.support.machine_files import REPOSITORY, text_of
from tests.support.own_plant import diagnosed, recorded

MACHINES = REPOSITORY / "machines"
SHARES = {
    "mass_kg": MASS_SHARE,
    "coulomb_n": FRICTION_SHARE,
    "viscous_n_s_m": FRICTION_SHARE,
    "stribeck_n": FRICTION_SHARE,
    "stribeck_mm_s": FRICTION_SHARE,
}
"""Keys of a plant file that are drawn, and the bound of their relative deviation."""
NEEDS_A_FILE = "emps"
"""Its program plays a published recording."""


class Case(NamedTuple):
    """A program of a machine; seed 0 is the machine as it is, any other a random plant."""

    machine: str
    program: str
    seed: int


def cases(seed: int, count: int) -> Iterator[Case]:
    """Yield every program of every machine as it is, and on `count` random plants."""
    for folder in sorted(MACHINES.iterdir()):
        if folder.name == NEEDS_A_FILE or not (folder / "programs").is_dir():
            continue
        for program in sorted((folder / "programs").iterdir()):
            for number in (0, *range(seed, seed + count)):
                yield Case(folder.name, program.name, number)


def drawn(text: str, seed: int) -> str:
    """Return the text of a plant file with random masses and friction."""
    rng = np.random.default_rng(seed)

    def changed(entry: re.Match[str]) -> str:
        key, value = entry[1], float(entry[2])
        return f"{key} = {value * (1.0 + rng.uniform(-SHARES[key], SHARES[key])):.6g}"

    return re.sub(rf"^({'|'.join(SHARES)}) = ([\d.]+)", changed, text, flags=re.MULTILINE)


def verdict_of(case: Case, out: Path) -> dict[str, Any]:
    """Record the case and diagnose it with its own plant."""
    folder = MACHINES / case.machine
    out.mkdir(parents=True)
    plant = out / "plant.toml"
    text = text_of(folder / "plant.toml")
    plant.write_text(drawn(text, case.seed) if case.seed else text, encoding="utf-8")
    verdict = diagnosed(recorded(folder, case.program, out / "recording", plant=plant), plant)
    found = [{key: one[key] for key in ("axis", "effect", "confidence")} for one in verdict["findings"]]
    return {**case._asdict(), "verdict": verdict["verdict"], "findings": found}


def table_of(rows: list[dict[str, Any]]) -> Table:
    """Return a row a case; what is not consistent is red."""
    table = Table("machine", "program", "plant", "verdict")
    for row in rows:
        right = row["verdict"] == "consistent"
        names = ", ".join(f"{one['axis']} {one['effect']} {one['confidence']:.2f}" for one in row["findings"])
        words = " ".join((row["verdict"], names)).strip()
        plant = f"random, {row['seed']}" if row["seed"] else "as it is"
        table.add_row(row["machine"], row["program"], plant, words if right else f"[red]{words}[/]")
    return table


def main(
    json_file: Annotated[Path, typer.Option("--json", help="Where the verdicts go.")],
    seed: Annotated[int, typer.Option(min=1, help="Of the first random plant.")] = 1,
    count: Annotated[int, typer.Option(min=0, help="Random plants of each machine.")] = 4,
) -> None:
    """Diagnose every case; write JSON after each; exit with 1 if any is not consistent."""
    rows: list[dict[str, Any]] = []
    console = Console()
    with tempfile.TemporaryDirectory(prefix="true-model-") as name:
        for case in track(list(cases(seed, count)), "recording and diagnosing", console=console):
            out = Path(name) / "_".join(map(str, case))
            rows.append(verdict_of(case, out))
            json_file.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
            shutil.rmtree(out)
    console.print(table_of(rows))
    wrong = sum(row["verdict"] != "consistent" for row in rows)
    console.print(f"{len(rows) - wrong} of {len(rows)} are consistent; written to {json_file}")
    raise typer.Exit(1 if wrong else 0)


if __name__ == "__main__":
    typer.run(main)
