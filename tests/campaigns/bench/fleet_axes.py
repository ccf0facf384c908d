"""A fleet to measure on: axes that sweep, with none to four effects left out of their model."""

from pathlib import Path

from tests.campaigns.bench.reconcile_time import MODEL, MOST_EFFECTS, record


def write_fleet(root: Path, axes: int) -> tuple[Path, Path]:
    """The dataset and the directory of models: one recording of 25 s at 1 kHz an axis."""
    for number in range(axes):
        place = root / "data" / f"machine=mill-{number // 3}" / f"axis={'xyz'[number % 3]}"
        place.mkdir(parents=True)
        record(place / "run.parquet", number, number % (MOST_EFFECTS + 1))
    models = root / "models"
    models.mkdir()
    (models / "default.toml").write_text(MODEL, encoding="utf-8")
    return root / "data", models


def nothing(number: int) -> int:
    """A task that is nothing but a task."""
    return number
