"""Learned functions on disk: stored, read back, versions counted up, rolled back."""

import math
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from learned_examples import LEARNED, content_of, table_in

from servo_ctrl.files import directory as learned_directory
from servo_ctrl.files.directory import locked
from servo_ctrl.learned.file_model import LearnedFile
from servo_ctrl.learned.pulse_model import LearnedFunctions
from servo_ctrl.learned.store import LearnedStore, StoreError, default_directory

NOW = datetime(2026, 11, 21, 10, 30, tzinfo=UTC)


@pytest.fixture
def store(tmp_path: Path) -> LearnedStore:
    machine = table_in(tmp_path / "table")
    return LearnedStore(default_directory(machine), machine, now=lambda: NOW)


def test_stored_results_are_read_back_bit_for_bit(store: LearnedStore) -> None:
    added = store.add("x", LEARNED, {"temperature_c": 21.5, "operator": "E"})
    active = LearnedStore(store.directory, table_in(store.directory.parent)).active("x")
    assert active == added
    assert active is not None
    assert active.learned == LEARNED
    assert (active.version, active.axis, active.learned_at) == (1, "x", "2026-11-21T10:30:00Z")
    assert active.conditions == {"temperature_c": 21.5, "operator": "E"}
    assert store.active("y") is None


finite = st.floats(0.0, 1e3, allow_nan=False)
rising = st.lists(st.floats(1e-6, 1e3), min_size=1, max_size=6, unique=True).map(sorted)


@given(rising, st.floats(1e-12, 2e-3), st.floats(0.0, 60.0, exclude_min=True), finite, finite)
@settings(max_examples=50)
def test_any_number_survives_the_file(
    accelerations: list[float], amplitude: float, duration: float, spread: float, mean: float
) -> None:
    learned = LEARNED._replace(
        durations=tuple((a, duration) for a in accelerations),
        amplitudes=tuple((a, amplitude) for a in accelerations),
        trailing=(),
        spread_m_s2=spread,
        after_m=mean,
    )
    assert (
        LearnedFile[LearnedFunctions]
        .from_text(LearnedFile[LearnedFunctions].sealed(content_of(learned)).to_text())
        .learned.learned()
        == learned
    )


def test_numpy_numbers_are_stored_as_numbers(store: LearnedStore) -> None:
    learned = LEARNED._replace(
        strokes=np.int64(61),
        before_m=np.float64(LEARNED.before_m),
        amplitudes=tuple((np.float64(a), np.float64(v)) for a, v in LEARNED.amplitudes),
    )
    assert store.add("x", learned, {}).learned == LEARNED
    active = store.active("x")
    assert active is not None
    assert active.learned == LEARNED


def test_conditions_that_json_does_not_know_become_text(store: LearnedStore) -> None:
    conditions = {
        "temperature_c": None,
        "load_kg": math.nan,
        "notes": "n" * 5000,
        "axes": ["x"],
        "spare": True,
    }
    kept = store.add("x", LEARNED, conditions).conditions
    assert kept == {
        "temperature_c": "None",
        "load_kg": "nan",
        "notes": "n" * 1000,
        "axes": "['x']",
        "spare": True,
    }


def test_versions_count_up_and_rolling_back_goes_down_to_none(store: LearnedStore) -> None:
    for strokes in (10, 20, 30):
        store.add("x", LEARNED._replace(strokes=strokes), {})
    before = [path.read_bytes() for path in sorted((store.directory / "x").glob("v*.json"))]
    rolled = [store.roll_back("x") for _ in range(4)]
    assert [None if result is None else result.learned.strokes for result in rolled] == [20, 10, None, None]
    assert store.active("x") is None
    assert store.add("x", LEARNED, {}).version == 4
    after = [path.read_bytes() for path in sorted((store.directory / "x").glob("v*.json"))]
    assert after[:3] == before


def test_rolling_back_without_versions_creates_nothing(store: LearnedStore) -> None:
    assert store.roll_back("x") is None
    assert not store.directory.exists()


def test_rolling_back_skips_damaged_versions(store: LearnedStore) -> None:
    for _ in range(3):
        store.add("x", LEARNED, {})
    (store.directory / "x" / "v0002.json").write_text("{}", encoding="utf-8")
    result = store.roll_back("x")
    assert result is not None
    assert result.version == 1
    entries = store.versions("x")
    assert [(entry.version, entry.in_use, bool(entry.problem)) for entry in entries] == [
        (1, True, False),
        (2, False, True),
        (3, False, False),
    ]


def test_rolling_back_repairs_a_damaged_active_file(store: LearnedStore) -> None:
    store.add("x", LEARNED, {})
    (store.directory / "x" / "active.json").write_text("{", encoding="utf-8")
    with pytest.raises(
        StoreError, match=r"active\.json: is damaged: it names no version; learn axis x again"
    ):
        store.active("x")
    assert not store.versions("x")[0].in_use
    result = store.roll_back("x")
    assert result is not None
    assert result == store.active("x")


@pytest.mark.parametrize("axis", ["z", "", "../x"])
def test_unknown_axis_is_refused(store: LearnedStore, axis: str) -> None:
    for ask in (store.active, store.versions, store.roll_back):
        with pytest.raises(StoreError, match=r"machine xy_table has no axis .*, only x, y"):
            ask(axis)


def test_lock_that_is_not_released_ends_in_an_error(
    store: LearnedStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    store.add("x", LEARNED, {})
    monkeypatch.setattr(learned_directory, "LOCK_WAIT_S", 0.02)
    with locked(store.directory / "x"), pytest.raises(StoreError, match="another process has been writing"):
        store.add("x", LEARNED, {})
    assert store.add("x", LEARNED, {}).version == 2


ADD_MANY = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from learned_examples import LEARNED
from servo_ctrl.config.load import load_machine
from servo_ctrl.learned.store import LearnedStore
store = LearnedStore(Path(sys.argv[1]), load_machine(sys.argv[3]))
print("ready", flush=True)
sys.stdin.readline()
for _ in range(20):
    print(store.add("x", LEARNED, {"of": sys.argv[4]}).version)
"""


def test_two_processes_at_once_lose_no_version(store: LearnedStore) -> None:
    support = str(next(path for path in sys.path if path.endswith("tests/support")))
    machine = str(store.directory.parent)
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", ADD_MANY, str(store.directory), support, machine, name],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for name in ("first", "second")
    ]
    for process in processes:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
    for process in processes:
        assert process.stdin is not None
        process.stdin.write("go\n")
        process.stdin.flush()
    given_out = [int(line) for process in processes for line in process.communicate(timeout=60.0)[0].split()]
    assert sorted(given_out) == list(range(1, 41))
    assert [(entry.version, entry.problem) for entry in store.versions("x")] == [
        (n, "") for n in range(1, 41)
    ]
    active = store.active("x")
    assert active is not None
    assert active.version == 40
