"""The journal of a learning run: appended strokes are replayed, whatever happens to the file in between."""

import os
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from journal_examples import BASIS, SETTINGS, filled, journal_in, same
from learned_examples import stroke_of

from servo_ctrl.learned.store import StoreError
from servo_ctrl.learned.stroke_journal import PREVIOUS_FILE, StrokeJournal
from servo_ctrl.learning.stroke_result import ERROR_RESOLUTION_M, stroke_result
from servo_ctrl.learning.types import NO_PULSE, Pulse, Stroke, StrokeResult


def test_replay_gives_back_what_was_appended(tmp_path: Path) -> None:
    _, entries = filled(tmp_path, 5)
    journal = journal_in(tmp_path)
    assert same(journal.replay(), entries)
    assert journal.problem == ""
    journal.append(*stroke_of(5))
    assert same(journal_in(tmp_path).replay(), [*entries, stroke_of(5)])


def test_journal_that_is_not_there_is_empty_and_makes_nothing(tmp_path: Path) -> None:
    journal = journal_in(tmp_path / "none")
    assert journal.replay() == []
    assert journal.problem == ""
    assert not (tmp_path / "none").exists()


def test_append_goes_on_without_a_replay(tmp_path: Path) -> None:
    _, entries = filled(tmp_path, 2)
    journal_in(tmp_path).append(*stroke_of(2))
    assert same(journal_in(tmp_path).replay(), [*entries, stroke_of(2)])


times = st.floats(0.0, 60.0)
speeds = st.floats(-1e-2, 1e-2)


@given(
    st.builds(
        Stroke,
        st.text(max_size=20),
        st.floats(1e-6, 1e2),
        st.builds(Pulse, times, speeds, times, times, speeds),
        times,
    ),
    st.lists(st.tuples(st.integers(-(10**9), 10**9), st.integers(-(10**9), 10**9)), min_size=1, max_size=5),
    st.floats(1e-5, 1.0),
)
@settings(max_examples=60)
def test_any_number_survives_the_journal(
    stroke: Stroke, nanometres: list[tuple[int, int]], period_s: float
) -> None:
    result = StrokeResult(np.array(nanometres, dtype=np.float64).T * ERROR_RESOLUTION_M, period_s)
    with tempfile.TemporaryDirectory() as directory:
        journal_in(Path(directory)).append(stroke, result)
        assert same(journal_in(Path(directory)).replay(), [(stroke, result)])


def test_result_of_a_measured_stroke_survives(tmp_path: Path) -> None:
    time_s = np.arange(0.0, 2.0 * np.pi, 1e-3)
    command_m = SETTINGS.radius_m * np.sin(time_s)  # reverse acceleration: the radius times (1 rad/s)^2
    position_m = np.round((command_m - 3e-6 * np.sign(np.cos(time_s))) / 1e-7) * 1e-7
    stroke = Stroke("interval", SETTINGS.radius_m, NO_PULSE)
    result = stroke_result(command_m, position_m, stroke, SETTINGS, 1e-3)
    journal_in(tmp_path).append(stroke, result)
    assert same(journal_in(tmp_path).replay(), [(stroke, result)])


def test_stroke_is_on_the_disk_when_append_returns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    journal, _ = filled(tmp_path, 1)
    synced: list[int] = []
    monkeypatch.setattr(os, "fsync", lambda descriptor: synced.append(os.fstat(descriptor).st_size))
    journal.append(*stroke_of(1))
    assert synced == [journal.path.stat().st_size]


CHANGES = {
    "learner": ({"learner": "paper"}, "learner was fast then, it is paper now"),
    "steps": ({"steps": (4, 4, 5)}, "steps was"),
    "A_max": ({"amplitude_max_m_s": 1e-3}, "amplitude_max_m_s was 0.002 then, it is 0.001 now"),
}


@pytest.mark.parametrize("case", CHANGES)
def test_journal_of_other_settings_is_not_resumed(tmp_path: Path, case: str) -> None:
    changes, reason = CHANGES[case]
    journal, _ = filled(tmp_path, 2)
    old = journal.path.read_bytes()
    other = journal_in(tmp_path, **changes)
    assert other.replay() == []
    assert f"journal.jsonl: was made with other settings: {reason}" in other.problem
    assert journal.path.read_bytes() == old
    other.append(*stroke_of(7))
    assert same(journal_in(tmp_path, **changes).replay(), [stroke_of(7)])
    assert journal.path.with_name(PREVIOUS_FILE).read_bytes() == old


def test_journal_of_other_gains_or_another_axis_is_not_resumed(tmp_path: Path) -> None:
    journal, _ = filled(tmp_path, 2)
    gains = StrokeJournal(tmp_path, "x", SETTINGS, basis=BASIS | {"control.kp_1_s": 40.0})
    assert gains.replay() == []
    assert "control.kp_1_s was 38.7 then, it is 40.0 now" in gains.problem
    (tmp_path / "y").mkdir()
    journal.path.replace(tmp_path / "y" / journal.path.name)
    other = StrokeJournal(tmp_path, "y", SETTINGS, basis=BASIS)
    assert other.replay() == []
    assert "axis was x then, it is y now" in other.problem


def test_full_disk_is_reported_and_appending_resumes_when_there_is_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal, entries = filled(tmp_path, 2)
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(StoreError, match=r"journal\.jsonl: cannot be written: No space left on device"):
            journal.append(*stroke_of(2))
    with journal.path.open("r+b") as file:
        file.truncate(journal.path.stat().st_size - 50)  # only a part of it had come to the disk
    journal.append(*stroke_of(3))
    assert same(journal_in(tmp_path).replay(), [*entries, stroke_of(3)])


def full(_: int) -> None:
    raise OSError(28, "No space left on device")


def test_second_writer_is_noticed(tmp_path: Path) -> None:
    journal, _ = filled(tmp_path, 2)
    journal_in(tmp_path).append(*stroke_of(2))
    with pytest.raises(StoreError, match="another process has changed it"):
        journal.append(*stroke_of(3))


@pytest.mark.parametrize("error_m", [1.5e-9, np.nan, np.inf, 1.1])
def test_error_that_could_not_be_replayed_is_refused(tmp_path: Path, error_m: float) -> None:
    journal, entries = filled(tmp_path, 1)
    stroke, result = stroke_of(1)
    bad = result.error_m.copy()
    bad[1, 3] = error_m
    with pytest.raises(ValueError, match=r"whole nanometres|error_nm"):
        journal.append(stroke, result._replace(error_m=bad))
    assert same(journal_in(tmp_path).replay(), entries)


def test_journal_that_cannot_be_read_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "x" / "journal.jsonl").mkdir(parents=True)
    with pytest.raises(StoreError, match=r"journal\.jsonl: cannot be read: Is a directory"):
        journal_in(tmp_path).replay()


def test_removed_journal_begins_empty(tmp_path: Path) -> None:
    journal, _ = filled(tmp_path, 2)
    journal.remove()
    assert not journal.path.exists()
    assert journal.replay() == []
    journal.append(*stroke_of(5))
    assert same(journal_in(tmp_path).replay(), [stroke_of(5)])
    journal.remove()
    journal.remove()
