"""Our test for a change beside ruptures and statsmodels, on sequences of recordings with a known answer.

Run as `python -m tests.campaigns.bench.change_points_main --json FILE`; decision 0027 has its figures. Each
method looks at every new recording, as `reconcile watch` does, and may give one false alarm in 100. Ours and
statsmodels' state that level; the penalty of ruptures has none, and is fitted to it on normal noise of other
seeds. The libraries are in an environment beside ours (OUT/environment).
"""

import argparse
import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from kernels.arrays import Array
from reconcile.watch.change_detection import MIN_AFTER, MIN_BEFORE, IndicatorSeries, newest_alarm
from tests.campaigns.bench.main import write_whole
from tests.campaigns.environments import environment

PACKAGES = ("ruptures==1.1.10", "statsmodels==0.15.0")
RUN_LENGTH = 100.0
LENGTH, BEFORE = 40, 20
"""Recordings of a sequence, and those before its change."""
CASES = {
    "nothing changes": (0.0, "normal"),
    "nothing changes, Student's t with 5 degrees": (0.0, "tails"),
    "nothing changes, errors stated half as large": (0.0, "wide"),
    "nothing changes, three programs in turns by chance": (0.0, "programs"),
    "a step of 3 standard errors": (3.0, "normal"),
    "a step of 5 standard errors": (5.0, "normal"),
    "a step of 5 standard errors, three programs": (5.0, "programs"),
}
THEIRS = """
import json, sys, warnings
import numpy as np, ruptures
from statsmodels.stats.diagnostic import breaks_cusumolsresid
warnings.simplefilter("ignore")
asked = json.load(sys.stdin)
before, after, level = asked["before"], asked["after"], 1.0 / asked["run_length"]

def peaks(values, penalty):
    # KernelCPD with a linear kernel is PELT on the squared error, compiled
    found = ruptures.KernelCPD(kernel="linear", min_size=after).fit(values[:, None]).predict(pen=penalty)[:-1]
    return any(place >= before for place in found)

def cusum(values, _penalty):
    return breaks_cusumolsresid(values - values.mean(), ddof=1)[1] < level

def first(values, rule, penalty):
    for n in range(before + after, len(values) + 1):
        if rule(values[:n], penalty):
            return n - 1
    return None

def alarms(sequences, penalty):
    found = [first(np.array(one), peaks, penalty) for one in sequences]
    seen = sum(len(one) if at is None else at + 1 for one, at in zip(sequences, found))
    return sum(at is not None for at in found) / seen

low, high = 1.0, 80.0
for _ in range(12):
    middle = 0.5 * (low + high)
    low, high = (middle, high) if alarms(asked["fitted_on"], middle) > level else (low, middle)
answer = {"penalty": high, "cases": {}}
for name, sequences in asked["cases"].items():
    arrays = [np.array(one) for one in sequences]
    answer["cases"][name] = {
        "ruptures": [first(one, peaks, high) for one in arrays],
        "statsmodels": [first(one, cusum, high) for one in arrays],
    }
print(json.dumps(answer))
"""


def drawn(step: float, noise: str, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return values (n,) in standard errors, and the program of each recording (n,)."""
    values = rng.normal(size=LENGTH)
    programs = np.zeros(LENGTH)
    if noise == "tails":
        values = rng.standard_t(5, size=LENGTH) / np.sqrt(5.0 / 3.0)
    elif noise == "wide":
        values *= 2.0
    elif noise == "programs":
        programs = rng.integers(0, 3, size=LENGTH).astype(float)
        values += rng.normal(0.0, 4.0, size=3)[programs.astype(int)]
    values[BEFORE:] += step
    return values, programs


def ours(values: Array, programs: Array) -> int | None:
    """Return the recording at which our test raises its alarm."""
    spread = 4.0 if np.ptp(programs) else 0.0
    for n in range(MIN_BEFORE + MIN_AFTER, LENGTH + 1):
        nothing = np.full(n, np.nan)
        sequence = IndicatorSeries(values[:n], np.ones(n), programs[:n, None], nothing, spread, 0.0)
        alarm = newest_alarm(sequence, 1, RUN_LENGTH)
        if alarm is not None and alarm.raised:
            return n - 1
    return None


def judged(found: list[int | None], step: float) -> dict[str, Any]:
    """Return false alarms a thousand recordings, and of a change how many were seen and how soon."""
    last = BEFORE if step else LENGTH
    false = sum(at is not None and at < last for at in found)
    looked_at = sum(min(last, LENGTH if at is None else at + 1) for at in found)
    row: dict[str, Any] = {"false alarms in 1000": round(1000.0 * false / looked_at, 1)}
    if step:
        delays = [at - BEFORE + 1 for at in found if at is not None and at >= BEFORE]
        row["seen"] = f"{len(delays)} of {len(found) - false}"
        row["recordings until the alarm, median"] = float(np.median(delays)) if delays else None
    return row


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, required=True)
    parser.add_argument("--sequences", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path("out/change-points"))
    asked = parser.parse_args()
    rng = np.random.default_rng(25)
    fitted_on = [drawn(0.0, "normal", rng)[0].tolist() for _ in range(asked.sequences)]
    cases = {
        name: [drawn(step, noise, rng) for _ in range(asked.sequences)]
        for name, (step, noise) in CASES.items()
    }
    question = {
        "before": MIN_BEFORE,
        "after": MIN_AFTER,
        "run_length": RUN_LENGTH,
        "fitted_on": fitted_on,
        "cases": {name: [values.tolist() for values, _ in drawn_of] for name, drawn_of in cases.items()},
    }
    python = environment(asked.out.resolve() / "environment", PACKAGES) / "python"
    ended = subprocess.run(
        [str(python), "-c", THEIRS], input=json.dumps(question), text=True, check=True, stdout=subprocess.PIPE
    )
    answer = json.loads(ended.stdout)
    rows = {
        name: {
            "ours": judged([ours(*one) for one in drawn_of], CASES[name][0]),
            **{method: judged(found, CASES[name][0]) for method, found in answer["cases"][name].items()},
        }
        for name, drawn_of in cases.items()
    }
    figures = {"sequences": asked.sequences, "penalty of ruptures": answer["penalty"], "cases": rows}
    print(json.dumps(figures, indent=1))
    write_whole(asked.json, json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()
