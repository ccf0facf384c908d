"""Which blocks are held out: every fourth stretch, of several short recordings counted together."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from nominal_model_text import WITHOUT_SCALE

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.errors import ReconcileError
from reconcile.identification.held_out_blocks import training_and_held_out
from reconcile.identification.term_search import TermSearch
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import load_recordings
from reconcile.selection.selection_rules import SelectionRules


def divided(*blocks_of_recordings: int, empty: tuple[int, ...] = ()) -> tuple[list[int], list[int]]:
    of = np.repeat(np.arange(len(blocks_of_recordings)), blocks_of_recordings)
    samples = np.where(np.isin(np.arange(len(of)), empty), 0, 250)
    equations = SimpleNamespace(recordings=len(blocks_of_recordings), recording_of_block=of, samples=samples)
    problem: Any = SimpleNamespace(equations=equations)
    train, held_out = training_and_held_out(problem)
    return train.tolist(), held_out.tolist()


def test_of_a_long_recording_every_fourth_stretch_is_held_out() -> None:
    train, held_out = divided(33)
    assert held_out == [*range(12, 16), *range(28, 32)]
    assert sorted(train + held_out) == list(range(33))


def test_a_short_recording_alone_is_fitted_whole() -> None:
    assert divided(12) == (list(range(12)), [])


def test_short_recordings_count_their_stretches_together() -> None:
    """Of 3, 2 and 3 stretches the fourth and the eighth are held out, and none spans two recordings."""
    _, held_out = divided(10, 8, 11)
    assert held_out == [*range(10, 14), *range(26, 29)]


def test_a_short_recording_beside_a_long_one_is_fitted_whole() -> None:
    _, held_out = divided(16, 9)
    assert held_out == list(range(12, 16))


@pytest.mark.parametrize("rest", [(5,), (0, 1, 2)])
def test_blocks_without_a_sample_are_in_neither(rest: tuple[int, ...]) -> None:
    train, held_out = divided(20, empty=rest)
    assert not {*rest} & {*train, *held_out}
    assert len(train) + len(held_out) == 20 - len(rest)


def test_recordings_without_a_motion_above_their_noise_are_refused(tmp_path: Path) -> None:
    (tmp_path / "nominal.toml").write_text(WITHOUT_SCALE, encoding="utf-8")
    t = np.arange(3000) * 2e-3
    trembling_m = np.resize([1e-3, -1e-3], len(t)) * np.random.default_rng(1).uniform(0.5, 1.5, len(t))
    columns = np.stack((t, trembling_m, np.random.default_rng(2).normal(size=len(t))), axis=1)
    file = tmp_path / "trembling.csv"
    np.savetxt(file, columns, delimiter=",", comments="", header="time_s,motor_position_m,motor_force_n")
    model = load_model(tmp_path / "nominal.toml")
    recordings = load_recordings([file], model.axes)
    with pytest.raises(ReconcileError, match=r"trembling.csv: axis x: in no half second .* softer gains"):
        TermSearch(recordings, model.axes["x"], ResidualChannel.FORCE, SelectionRules())
