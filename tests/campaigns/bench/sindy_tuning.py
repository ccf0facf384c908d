"""How the rules of PySINDy were set: on training seeds, by what they cost and bring there, on nothing else.

Run as `python -m tests.campaigns.bench.sindy_tuning [--first-seed 104] [--cases 14]`; prints every pair of
rules with its right answers (one effect: first name or its class; several: all found) less its cases with a
false name.
"""

import itertools
import json
import tempfile
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from reconcile.catalogue.registry import ENTRIES
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import load_recordings
from reconcile.sensing.checks import examine
from tests.campaigns.bench.reconcile_score import LINES, ToolAnswer, finding, judge
from tests.campaigns.bench.sindy_peer import RULES, chosen, proposals
from tests.campaigns.blind import draw, record
from tests.campaigns.blind.recorded import SEALED

RIGHT = [LINES["first name right or of its class"], LINES["all found, several effects"]]
TRAINING_BELOW = 10_000
COMPLEXITIES = (0.001, 0.0025, 0.005, 0.01, 0.02, 0.04, 0.08)
SHARES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2)


def main(
    first_seed: Annotated[int, typer.Option(max=TRAINING_BELOW - 1)] = 104,
    cases: Annotated[int, typer.Option()] = 14,
) -> None:
    """Propose once a case, choose by every pair of rules."""
    console = Console()
    right = dict.fromkeys(itertools.product(COMPLEXITIES, SHARES), 0)
    false = dict.fromkeys(right, 0)
    for seed in range(first_seed, min(first_seed + cases, TRAINING_BELOW)):
        with tempfile.TemporaryDirectory() as name:
            paths = record(draw(seed), Path(name))
            model = load_model(Path(name) / "model.toml")
            truth = json.loads((Path(name) / SEALED / "truth.json").read_text(encoding="utf-8"))
            recordings = examine(load_recordings(paths, model.axes), model.axes).recordings
        found = proposals([r for r in recordings if r.axis == "x"], model.axes["x"], RULES)
        for complexity, share in right:
            peer = chosen(found, RULES._replace(complexity=complexity, least_share=share))
            named = [finding("x", name, ENTRIES[name].equivalent, gain) for name, gain in peer.named]
            row = judge(truth, ToolAnswer("effects", named, {}, {}, 0.0))
            right[complexity, share] += sum(asked(row) and counted(row) for asked, counted in RIGHT)
            false[complexity, share] += bool(row["false"])
        console.print(f"{seed} {truth['kind']}", highlight=False)
    table = Table("complexity", "least share", "right", "false", "right less false")
    for rules in sorted(right, key=lambda r: right[r] - false[r], reverse=True):
        table.add_row(*map(str, (*rules, right[rules], false[rules], right[rules] - false[rules])))
    console.print(table)


if __name__ == "__main__":
    typer.run(main)
