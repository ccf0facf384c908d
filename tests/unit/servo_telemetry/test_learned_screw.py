"""Learned screws on the disk: beside the pulse's versions, whole, and refused when they do not fit."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from learned_examples import LEARNED, table_in
from screw_stand import stage_file

from servo_ctrl.config.load import load_machine
from servo_ctrl.learned.file_model import LearnedFile
from servo_ctrl.learned.screw_model import ScrewTable
from servo_ctrl.learned.store import LearnedStore, ScrewStore, StoreError
from servo_ctrl.learning.screw import ScrewLearned

SCREW = ScrewLearned(
    points=((-0.006, -1e-6 / 3.0, 6.1e-6), (0.0, 0.0, 6e-6), (0.00601, 2.5e-6, 5.9e-6)),
    lost_motion_m=6e-6,
    spread_m=3e-8,
    before_m=5e-6,
    after_m=1e-7,
    strokes=4,
    machine_time_s=101.5,
)


@pytest.fixture
def store(tmp_path: Path) -> ScrewStore:
    return ScrewStore(tmp_path / "learned", load_machine(stage_file(tmp_path / "stage")))


def resealed(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    document = json.loads(path.read_text(encoding="utf-8"))
    change(document)
    path.write_text(LearnedFile[ScrewTable].sealed(document).to_text(), encoding="utf-8")


def test_what_was_stored_is_read_to_the_last_bit(store: ScrewStore) -> None:
    added = store.add("x", SCREW, {"feed_m_s": 0.02})
    assert added.learned == SCREW
    assert store.active("x") == added
    document = json.loads((store.directory / "x/screw/v0001.json").read_text(encoding="utf-8"))
    assert document["learned"]["points"][0] == {
        "position_m": -0.006,
        "error_m": -1e-6 / 3.0,
        "lost_motion_m": 6.1e-6,
    }
    assert sorted(document["basis"]) == [
        "drive.counts_per_rev",
        "homing_method",
        "scale.resolution_um",
        "transmission.lead_mm",
    ]


def test_versions_are_rolled_back_and_never_deleted(store: ScrewStore) -> None:
    store.add("x", SCREW, {})
    store.add("x", SCREW._replace(lost_motion_m=5e-6), {})
    earlier = store.roll_back("x")
    assert earlier is not None
    assert (earlier.version, earlier.learned) == (1, SCREW)
    assert store.roll_back("x") is None
    assert store.active("x") is None
    assert [entry.version for entry in store.versions("x")] == [1, 2]


def test_pulse_and_screw_of_one_axis_have_versions_of_their_own(tmp_path: Path) -> None:
    machine = table_in(tmp_path / "table")
    pulses, screws = LearnedStore(tmp_path / "learned", machine), ScrewStore(tmp_path / "learned", machine)
    pulses.add("x", LEARNED, {})
    pulses.add("x", LEARNED, {})
    screws.add("x", SCREW, {})
    assert [entry.version for entry in pulses.versions("x")] == [1, 2]
    assert [entry.version for entry in screws.versions("x")] == [1]
    screws.roll_back("x")
    assert pulses.active("x") is not None
    # one in the place of the other is no such file
    path = tmp_path / "learned/x/screw/v0001.json"
    path.write_text((tmp_path / "learned/x/v0001.json").read_text(encoding="utf-8"), encoding="utf-8")
    [entry] = screws.versions("x")
    assert entry.problem.startswith("learned.lost_motion_m")


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("homing_method = 37", "homing_method = 17", "homing_method was 37 then, it is 17 now"),
        ("counts_per_rev = 1048576", "counts_per_rev = 131072", "drive.counts_per_rev was 1048576 then"),
        ("resolution_um = 0.5", "resolution_um = 0.1", "scale.resolution_um was 0.5 then, it is 0.1 now"),
        ("limit_um = 100.0", "limit_um = 5.0", "correction of 5.5 um at 6.01 mm, beyond limit_um 5 um"),
        ('name = "precision_stage"', 'name = "other"', 'was learned on machine "precision_stage"'),
    ],
)
def test_result_that_does_not_fit_the_machine_is_refused(
    store: ScrewStore, tmp_path: Path, old: str, new: str, reason: str
) -> None:
    store.add("x", SCREW, {})
    changed = ScrewStore(store.directory, load_machine(stage_file(tmp_path / "stage", (old, new))))
    with pytest.raises(StoreError) as caught:
        changed.active("x")
    assert reason in str(caught.value)
    assert str(caught.value).endswith('"servo-ctrl learned rollback --axis x --kind screw"')


def test_gains_may_change(store: ScrewStore, tmp_path: Path) -> None:
    store.add("x", SCREW, {})
    changed = load_machine(stage_file(tmp_path / "stage", ("velocity_mm_s = 100.0", "velocity_mm_s = 90.0")))
    assert ScrewStore(store.directory, changed).active("x") is not None


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"points": ((0.0, 0.0, 0.0), (0.0, 1e-6, 0.0))}, "the positions must rise"),
        ({"points": ((0.0, 0.0, 0.0),)}, "learned.points"),
        ({"lost_motion_m": -1e-6}, "learned.lost_motion_m"),
        ({"lost_motion_m": math.nan}, "learned.lost_motion_m"),
        ({"lost_motion_m": 2e-4}, "beyond limit_um 100 um"),
        ({"points": ((0.0, 0.0, 0.0), (0.001, 6e-5, 0.0))}, "changes by 0.06 of the travel at 0 mm"),
        ({"points": ((0.0, 0.0, 0.0), (0.001, math.inf, 0.0))}, "learned.points"),
    ],
)
def test_invalid_values_are_not_stored(store: ScrewStore, changes: dict[str, Any], reason: str) -> None:
    with pytest.raises(StoreError, match="what was learned is not stored") as caught:
        store.add("x", SCREW._replace(**changes), {})
    assert reason in str(caught.value)
    assert store.active("x") is None


def test_damage_is_reported(store: ScrewStore) -> None:
    store.add("x", SCREW, {})
    path = store.directory / "x/screw/v0001.json"
    path.write_text(path.read_text(encoding="utf-8").replace("101.5", "101.6"), encoding="utf-8")
    with pytest.raises(StoreError, match=r"checksum \(sha256\) does not fit; learn axis x again"):
        store.active("x")
    resealed(path, lambda document: document["learned"].update(strokes=5))
    with pytest.raises(StoreError, match=r"is not the version 1 that active\.json names"):
        store.active("x")


def test_old_pulse_results_lack_gains_added_later(tmp_path: Path) -> None:
    """A result from before the position loop had an integral is as good as it was."""
    pulses = LearnedStore(tmp_path / "learned", table_in(tmp_path / "table"))
    basis = pulses.add("x", LEARNED, {}) and pulses.versions("x")[0].result
    assert basis is not None
    assert not {"control.ki_1_s2", "control.kd", "control.derivative_filter_ms"} & set(basis.basis)
    changed = table_in(tmp_path / "table", ("kp_1_s = 38.7", "kp_1_s = 38.7\nki_1_s2 = 5.0"))
    with pytest.raises(StoreError, match=r"control\.ki_1_s2 was not set then, it is 5\.0 now"):
        LearnedStore(tmp_path / "learned", changed).active("x")
