"""Draw concealed cases of a family, diagnose each by `reconcile diagnose`, and score it by its sealed truth.

    python -m tests.campaigns.blind.families.trial --family belt_drive --seed 0 --cases 9 --json out/belt.json

The hash of a truth is printed before its diagnosis. Seeds from 10000 on are proof: a run writes them into
`used_seeds.json`, which is committed, and they are refused ever after. Seeds below are for training.
"""

import argparse
import importlib
import itertools
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.campaigns.blind.families.evidence import kept_of_truth, kept_of_verdict
from tests.campaigns.blind.families.files import SEALED, record
from tests.campaigns.blind.families.interface import SHARES, Case
from tests.campaigns.blind.families.score import Row, scores_of, summary
from tests.campaigns.blind.families.seeds import (
    FAMILIES,
    FIRST_SCORED,
    KEPT_OUT,
    claim,
    first_fresh,
    fresh_words,
)

RECONCILE = Path(sys.executable).with_name("reconcile")
LONGEST_S = 900.0
"""Of a diagnosis; what takes longer counts as failed."""
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Threads of a linear algebra of small matrices wait for each other: a third of the processor time."""


def drawn_case(family: str, seed: int, kind: str | None = None) -> Case:
    """Return the case of a seed of a family."""
    case: Case = importlib.import_module(f"tests.campaigns.blind.families.{family}").draw(seed, kind)
    return case


def one(family: str, seed: int, kind: str | None, directory: Path) -> Row:
    """Draw, diagnose and score a case in `directory`; a failed diagnosis is a row with `error`."""
    case = drawn_case(family, seed, kind)
    paths, seal = record(case, directory)
    print(f"{family} {seed}: sealed {seal}", flush=True)
    asked = [
        RECONCILE,
        "diagnose",
        *paths,
        "--model",
        directory / "model.toml",
        "--out",
        directory / "verdict",
    ]
    base = {"family": family, "seed": seed, "kind": case.kind, "sha256": seal}
    try:
        done = subprocess.run(
            [*map(str, asked), "--no-report", "--no-proof", "--no-next"],
            capture_output=True,
            text=True,
            timeout=LONGEST_S,
            env={**os.environ, **ONE_THREAD},
            check=False,
        )
    except subprocess.TimeoutExpired:
        return base | {"error": f"no verdict within {LONGEST_S:.0f} s"}
    if done.returncode != 0:
        said = done.stderr.strip().replace(f"{directory}/", "").splitlines()
        return base | {"error": said[-8:]}
    truth = json.loads((directory / SEALED / "truth.json").read_text(encoding="utf-8"))
    verdict = json.loads((directory / "verdict" / "verdict.json").read_text(encoding="utf-8"))
    return base | {"truth": kept_of_truth(truth), "evidence": kept_of_verdict(verdict)}


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0], epilog=f"Fresh seeds: {fresh_words()}."
    )
    parser.add_argument("--family", choices=[*FAMILIES, *KEPT_OUT, "all"], required=True)
    parser.add_argument(
        "--seed", type=int, help="first seed; the first fresh one where absent; below 10000: training"
    )
    parser.add_argument("--cases", type=int, default=10, help="how many seeds, one a case")
    parser.add_argument("--kind", choices=[*SHARES], help="cases of this kind only, training seeds alone")
    parser.add_argument(
        "--json", type=Path, default=Path("out/families.json"), help="where scores and truths go"
    )
    parser.add_argument("--keep", type=Path, help="keep recordings, truths and verdicts there")
    asked = parser.parse_args()
    if asked.cases < 1 or (asked.seed is not None and asked.seed < 0):
        parser.error("--cases is 1 or more, --seed 0 or more")
    families = FAMILIES if asked.family == "all" else (asked.family,)
    firsts = {family: first_fresh(family) if asked.seed is None else asked.seed for family in families}
    if asked.kind and max(firsts.values()) + asked.cases > FIRST_SCORED:
        parser.error("--kind chooses cases: give training seeds, below 10000")
    is_proof = True
    try:
        for family, first in firsts.items():
            is_proof &= claim(family, first, asked.cases)
    except ValueError as error:
        parser.error(str(error))
    rows: list[Row] = []
    asked.json.parent.mkdir(parents=True, exist_ok=True)
    for number, family in itertools.product(range(asked.cases), families):
        seed = firsts[family] + number
        with tempfile.TemporaryDirectory() as temporary:
            folder = asked.keep / f"{family}_{seed}" if asked.keep else Path(temporary)
            row = one(family, seed, asked.kind, folder)
        rows.append(row)
        [score] = scores_of([row])
        said = row.get("error") or [found["effect"] for found in score["findings"]]
        print(f"{family} {seed}: {row['kind']}; planted {score.get('planted')}; said {said}", flush=True)
        content = {"scored": is_proof, "rows": rows}
        asked.json.write_text(json.dumps(content) + "\n", encoding="utf-8")
    print(json.dumps(summary(scores_of(rows)), indent=1))


if __name__ == "__main__":
    main()
