"""docs/reconcile_real.md from the figures of `make bench-real`.

Run as `python -m tests.campaigns.bench.real_page docs/reconcile_real.json > docs/reconcile_real.md`.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from reconcile.examples.real.study import MACHINES
from tests.campaigns.bench.real_main import AT_MOST_OF_BOOSTING, MODELS

HEAD = """# reconcile on axes that others have measured

Written by `python -m tests.campaigns.bench.real_page docs/reconcile_real.json > docs/reconcile_real.md`; the
figures are those of `make bench-real`{quick}.

All rows are of one engine. It was developed with these sets in view: the ridge on textbook friction and
weight (`COLLINEAR_RIDGE`) was chosen on kinova, kuka and bam, and what counts as a coupling of joints, with
its low pass (`MOST_LEFT`, `COUPLED_SHARE`, `COUPLED_CORNER_HZ`), on dfki. They are no proof of these.

Each recording is left out in turn. `reconcile diagnose` reads the others and a nominal model from data
sheets; the `model.toml` that it writes is loaded again, and its force is held against the recording that was
left out: nothing is fitted to that one. The rivals are fitted to the same others: a rigid model (mass,
viscous and Coulomb friction), least squares with Stribeck and asymmetric friction and a constant force beside
that, gradient boosting on position, velocity, acceleration and direction (scikit-learn's
HistGradientBoostingRegressor), and PySINDy with the catalogue's columns{pysindy}. The error is the RMS of
what is left of the torque behind the 60 Hz state filter, in the samples in motion, pooled over all of them;
where the acceleration is noisier than that (jitter of stamps, vibration), behind the low pass that the
recording allows, the same for all models.

The bars: no worse than the rigid refit, least squares and PySINDy, and at most {factor} times boosting. Where
the tool refuses recordings it gives no model, and has lost; the rivals' errors then stand alone.

`reconcile example fditools`, `kuka`, `dfki`, `kinova` or `bam` shows one set with a picture; the data are not
part of this project, and the message says who publishes them.
"""


def page(result: Mapping[str, Any]) -> str:
    """The page, as Markdown."""
    quick = ", --quick: with the first two recordings of each machine left out" if result["quick"] else ""
    shown = any("pysindy" in line["errors_nm"] for line in result["summary"])
    whole = all("pysindy" in line["errors_nm"] for line in result["summary"])
    pysindy = "" if whole else " (where it was run)" if shown else " (not in these figures)"
    head = HEAD.format(factor=AT_MOST_OF_BOOSTING, quick=quick, pysindy=pysindy)
    return "\n".join([head, *_errors(result), "", *_answers(result)]) + "\n"


def _errors(result: Mapping[str, Any]) -> Iterator[str]:
    lines = result["summary"]
    won = sum(not line["lost_to"] for line in lines)
    without_pysindy = sum(not {*line["lost_to"]} - {"pysindy"} for line in lines)
    met = f"{won} of {len(lines)} axes, {without_pysindy} without PySINDy's"
    models = [name for name in MODELS if any(name in line["errors_nm"] for line in lines)]
    yield f"## Error on what was left out, N m\n\nThe tool meets the bars on {met}.\n"
    yield "| machine, axis | " + " | ".join(models) + " | without a model | loses to |"
    yield "| --- |" + " ---: |" * len(models) + " --- | --- |"
    for line in lines:
        errors = [f"{line['errors_nm'][name]:.3g}" if name in line["errors_nm"] else "-" for name in models]
        lost = ", ".join(line["lost_to"]) or "nobody"
        without = f"{line['no_model']} of {line['left_out']}"
        yield f"| {line['machine']} {line['axis']} | {' | '.join(errors)} | {without} | {lost} |"
    run = {line["machine"] for line in lines}
    if missing := [name for name in MACHINES if name not in run]:
        yield f"\nNot run for these figures: {', '.join(missing)}."
    yield "\nThe fditools bench publishes no torque constant: its torque is given in amperes."


def _answers(result: Mapping[str, Any]) -> Iterator[str]:
    yield "## What was said\n"
    yield "| machine, axis | left out | verdict of the others | named |"
    yield "| --- | --- | --- | --- |"
    for row in result["rows"]:
        named = ", ".join(row["named"]) or _reason(row["failure"]) or "nothing"
        yield f"| {row['machine']} {row['axis']} | {row['left_out']} | {row['verdict']} | {named} |"


def _reason(failure: str) -> str:
    """A refusal without the directory that the file was in."""
    return failure.rpartition("/")[2].replace("|", "/")


def main(figures: Annotated[Path, typer.Argument(help="What `make bench-real` wrote.")]) -> None:
    """Print the page."""
    print(page(json.loads(figures.read_text(encoding="utf-8"))), end="")


if __name__ == "__main__":
    typer.run(main)
