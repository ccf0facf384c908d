"""Ask the rivals of `reconcile` about the families' cases.

    OMP_NUM_THREADS=1 python -m tests.campaigns.bench.families_rivals --cases docs/blind_families.json \
        --json out/rivals.json

The same recordings, drawn again from the seeds of the rows, go to three tools. PySINDy answers under every
complexity of a list, for `make pages` to choose by the rule that chooses ours; what could be gained at most
stands beside. Gradient boosting over the
coordinates competes for the fit of what a rigid model leaves in the last quarter of each recording, with its
Shapley values by coordinate. Rollouts fitted by Gauss-Newton compete for the parameters.
"""

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

from reconcile.catalogue.registry import ENTRIES
from reconcile.examples.real.judged import judged
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import load_recordings
from reconcile.sensing.checks import examine
from tests.campaigns.bench import sindy_peer
from tests.campaigns.bench.boosting_rival import boosted
from tests.campaigns.bench.families_achievable import achievable
from tests.campaigns.bench.rollout_rival import fitted_rollouts
from tests.campaigns.blind.families.evidence import rounded
from tests.campaigns.blind.families.files import record
from tests.campaigns.blind.families.trial import drawn_case

Row = dict[str, Any]
COMPLEXITIES = (0.001, 0.0025, 0.005, 0.01, 0.02, 0.04, 0.08)


def pysindy(paths: list[Path], model_file: Path) -> list[Row]:
    """Return what PySINDy says under each complexity; equal answers once, with all their complexities."""
    model = load_model(model_file)
    [(name, axis)] = model.axes.items()
    recordings = examine(load_recordings(paths, model.axes), model.axes).recordings
    proposals = sindy_peer.proposals([one for one in recordings if one.axis == name], axis, sindy_peer.RULES)
    answers: list[Row] = []
    for complexity in COMPLEXITIES:
        peer = sindy_peer.chosen(proposals, sindy_peer.RULES._replace(complexity=complexity, least_share=0.0))
        named = [[effect, share, [*ENTRIES[effect].equivalent]] for effect, share in peer.named]
        held = {channel: [of.refitted, of.after] for channel, of in peer.held_out.items()}
        if answers and answers[-1]["named"] == named and answers[-1]["held_out"] == held:
            answers[-1]["complexities"].append(complexity)
        else:
            answers.append({"complexities": [complexity], "named": named, "held_out": held})
    return answers


def answers_to(family: str, seed: int, folder: Path) -> Row:
    """Return the rivals' answers to a case, which is drawn again in `folder`."""
    case = drawn_case(family, seed)
    paths, seal = record(case, folder)
    model_file = folder / "model.toml"
    [by_file] = judged(paths, model_file).values()
    recordings = [one for of in by_file for one in of]
    sound = {"inertia": case.sound.inertia, "viscous": case.sound.viscous, "coulomb": case.sound.coulomb}
    row: Row = rounded(
        {
            "boosting": boosted(recordings),
            "rollouts": fitted_rollouts(recordings),
            "sound": sound,
            "pysindy": pysindy(paths, model_file),
        }
    )
    if case.effects and not case.has_foreign:
        row |= {"achievable": rounded(achievable(case, paths, model_file))}
    return {"family": family, "seed": seed, "sha256": seal} | row


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=Path, required=True, help="JSON of the trial: which cases")
    parser.add_argument("--most", type=int, default=1000, help="cases of a family, the first ones")
    parser.add_argument("--json", type=Path, required=True, help="where the answers go")
    given = parser.parse_args()
    cases: dict[str, list[Row]] = {}
    for row in json.loads(given.cases.read_text(encoding="utf-8"))["rows"]:
        if "error" not in row:
            cases.setdefault(row["family"], []).append(row)
    longest = min(max(map(len, cases.values())), given.most)
    turns = [of[number] for number in range(longest) for of in cases.values() if number < len(of)]
    rows: list[Row] = []
    given.json.parent.mkdir(parents=True, exist_ok=True)
    for one in turns:
        with tempfile.TemporaryDirectory() as folder:
            rows.append(answers_to(one["family"], one["seed"], Path(folder)))
        assert rows[-1]["sha256"] == one["sha256"], "the seed draws another case than the trial's"
        print(one["family"], one["seed"], flush=True)
        given.json.write_text(json.dumps({"rows": rows}) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
