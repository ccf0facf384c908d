"""The curve of `reconcile/identification/confidence.py` from trials.

Run as `python -m tests.campaigns.bench.confidence_fit trial.json ...`.
Only for training seeds: a file of scored ones is refused.
"""

import json
from pathlib import Path  # typer reads it
from typing import Annotated

import numpy as np
import typer
from scipy.optimize import minimize
from scipy.special import expit, logit

from reconcile.identification.confidence import GAIN_MARGIN, true_share
from reconcile.trials.seeds import FIRST_SCORED_SEED

WEAK = 0.05
"""Prior on the slope."""


def main(files: Annotated[list[Path], typer.Argument(help="JSON of `reconcile trial`.")]) -> None:
    """Maximum likelihood of level and slope."""
    names: list[tuple[float, float, bool]] = []
    for file in files:
        for row in json.loads(file.read_text(encoding="utf-8"))["rows"]:
            if row["seed"] >= FIRST_SCORED_SEED:
                raise typer.BadParameter(f"{file}: seed {row['seed']} is scored, and no training seed")
            named = [f for f in row["findings"] if f["effect"] != "unknown"]
            for finding, stated in zip(named, row["stated"], strict=True):
                gain = finding["heldout_gain"]
                names.append((gain, finding["confidence"] / true_share(gain), stated["right"]))
    gain, alone, right = np.array(names, dtype=np.float64).T
    odds = logit(np.clip(gain, GAIN_MARGIN, 1.0 - GAIN_MARGIN))

    def cost(curve: np.ndarray) -> float:
        p = np.clip(np.minimum(alone, 1.0) * expit(curve[0] + curve[1] * odds), 1e-6, 1.0 - 1e-6)
        return float(-(right * np.log(p) + (1.0 - right) * np.log1p(-p)).sum() + WEAK * curve[1] ** 2)

    level, slope = minimize(cost, [3.0, 0.5], method="Nelder-Mead").x
    print(f"{len(names)} names, {int((1 - right).sum())} false: LEVEL {level:.2f}, SLOPE {slope:.2f}")


if __name__ == "__main__":
    typer.run(main)
