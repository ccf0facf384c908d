"""Tunes position laws in the batch twin, all by the same procedure.

    python -m studies.xia_fuzzy_pd.position_tuning --machine machines/fuzzy_table --law pid --json pid.json

Differential evolution over the unit cube of `tuning_laws` minimises the cost of `tuning_cost`. Every law
gets the same number of evaluations from the same seeds. The best of the seeds is the result; the spread of
the others shows how certain it is. It prints the values as keys of a machine file and writes none.
"""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.progress import Progress
from scipy.optimize import Bounds, differential_evolution
from scipy.stats import qmc

from servo_ctrl.config.load import load_machine
from servo_ctrl.files.whole_file import write_text_whole
from studies.xia_fuzzy_pd.tuning_cost import Training
from studies.xia_fuzzy_pd.tuning_laws import LAWS, in_the_file, values_at
from twin.plant_file import load_plant

POPULATION = 40
"""Individuals of the differential evolution; chosen."""
GENERATIONS = 60
"""Generations of the differential evolution; chosen."""
SEEDS = (1, 2)
"""Seeds of the searches; the best result is taken."""


class TunedLaw(NamedTuple):
    """The result of one search."""

    seed: int
    cost: float
    values: dict[str, float]
    evaluations: int
    history: list[float]
    """Best cost after each generation."""


def tuned(
    training: Training, law: str, seed: int, generations: int, on_generation: Callable[[float], None]
) -> TunedLaw:
    """Run one search; `on_generation` receives the best cost after each generation."""
    free = len(LAWS[law])
    history: list[float] = []

    def cost(point: np.ndarray[Any, np.dtype[np.float64]]) -> float:
        return training.cost(law, values_at(law, point.tolist()))

    def generation_done(intermediate_result: Any) -> None:
        history.append(float(intermediate_result.fun))
        on_generation(history[-1])

    found = differential_evolution(
        cost,
        Bounds(np.zeros(free), np.ones(free)),
        init=qmc.LatinHypercube(free, rng=np.random.default_rng(seed)).random(POPULATION),
        maxiter=generations,
        mutation=(0.4, 0.9),
        recombination=0.8,
        tol=0.0,  # every law spends its whole budget
        polish=False,
        rng=np.random.default_rng(seed),
        callback=generation_done,
    )
    values = values_at(law, found.x.tolist())
    return TunedLaw(seed, float(found.fun), values, int(found.nfev), history)


def main() -> None:
    """Tune one law and print it."""
    parser = argparse.ArgumentParser(description="Position laws tuned in the batch twin.")
    parser.add_argument("--machine", type=Path, required=True, help="directory of the machine")
    parser.add_argument("--axis", help="default: the first of the machine")
    parser.add_argument("--law", choices=sorted(LAWS), required=True)
    parser.add_argument("--generations", type=int, default=GENERATIONS)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(SEEDS))
    parser.add_argument("--json", type=Path, help="write the results to this file")
    options = parser.parse_args()
    machine, plant = load_machine(options.machine), load_plant(options.machine)
    axis = options.axis or next(iter(machine.axes))
    console = Console()
    training = Training(machine, plant, axis)
    results: list[TunedLaw] = []
    with Progress(console=Console(stderr=True)) as progress:
        for seed in options.seeds:
            task = progress.add_task(f"{options.law}, seed {seed}", total=options.generations)

            def advance(cost: float, task: Any = task, seed: int = seed) -> None:
                progress.update(task, advance=1, description=f"{options.law}, seed {seed}: {cost:.4f}")

            results.append(tuned(training, options.law, seed, options.generations, advance))
    best = min(results, key=lambda entry: entry.cost)
    for entry in results:
        console.print(
            f"seed {entry.seed}: cost {entry.cost:.4f}, {entry.evaluations} evaluations", highlight=False
        )
    for section, keys in in_the_file(options.law, best.values).items():
        console.print(f"\\[axis.{axis}.{section}]", highlight=False)
        for key, value in keys.items():
            console.print(f"{key} = {value:g}", highlight=False)
    if options.json:
        figures = {
            "law": options.law,
            "best": in_the_file(options.law, best.values),
            "measures": [
                {
                    "steps": [
                        {"itae_m_s2": step.itae_m_s2, "swing": step.overshoot, "unrest": step.settling_error}
                        for step in entry.steps
                    ],
                    "sines": [sine._asdict() for sine in entry.sines],
                    "unrest": entry.settling_error,
                }
                for entry in training.measured(options.law, best.values)
            ],
            "searches": [entry._asdict() for entry in results],
        }
        text = json.dumps(figures, indent=1) + "\n"
        options.json.parent.mkdir(parents=True, exist_ok=True)
        write_text_whole(options.json, text)


if __name__ == "__main__":
    main()
