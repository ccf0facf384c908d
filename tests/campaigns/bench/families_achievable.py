"""What could be gained at most: the same machine without what it conceals, by the same regression.

The case runs once more with the same noise and nothing concealed. What a rigid model, refitted, leaves there
on the blocks that `reconcile` holds out is the floor; what it leaves of the recordings as they are is where
the gain begins. Small effects that a family always has are in both.
"""

import math
from collections.abc import Sequence
from pathlib import Path

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.held_out_blocks import training_and_held_out
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import load_recordings
from reconcile.regression.model_presliding import regressed_terms
from reconcile.regression.regression_data import regression_data
from reconcile.regression.regression_problem import regression_problem
from reconcile.sensing.checks import examine
from tests.campaigns.blind.families.files import write_recordings
from tests.campaigns.blind.families.interface import Case


def achievable(case: Case, paths: Sequence[Path], model_file: Path) -> dict[str, tuple[float, float]]:
    """Return by channel the held-out RMS of a refitted rigid model, and the floor; SI."""
    folder = model_file.parent / "without"
    folder.mkdir()
    bare = write_recordings(case, case.simulate(frozenset(), True, None), folder)
    before, floor = (rms_left(files, model_file) for files in (paths, bare))
    return {channel: (before[channel], floor[channel]) for channel in before if channel in floor}


def rms_left(paths: Sequence[Path], model_file: Path) -> dict[str, float]:
    """Return by channel what a refitted rigid model leaves on the blocks held out, RMS in SI."""
    model = load_model(model_file)
    [axis] = model.axes.values()
    recordings = examine(load_recordings(paths, model.axes), model.axes).recordings
    datasets = [regression_data(one, axis) for one in recordings]
    found = {}
    for channel in ResidualChannel:
        if channel is not ResidualChannel.FORCE and any(one.scale_m is None for one in datasets):
            continue
        terms = regressed_terms(axis, datasets, channel)
        problem = regression_problem(datasets, channel, only=True, model_terms=terms)
        equations, (train, held) = problem.equations, training_and_held_out(problem)
        slots = equations.slots([])
        theta = equations.solve(slots, equations.totals(train))
        squares = float(equations.squares(slots, theta, held).sum())
        found[channel.value] = math.sqrt(squares / max(int(equations.samples[held].sum()), 1))
    return found
