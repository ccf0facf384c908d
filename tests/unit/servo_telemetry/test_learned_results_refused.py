"""Learned results that must not be used or stored: refused with file, reason and advice."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from learned_examples import LEARNED, content_of, copy_of, table_in

from servo_ctrl.learned.file_model import LearnedFile
from servo_ctrl.learned.pulse_model import LearnedFunctions
from servo_ctrl.learned.store import LearnedStore, StoreError, default_directory


@pytest.fixture
def store(tmp_path: Path) -> LearnedStore:
    machine = table_in(tmp_path / "table")
    return LearnedStore(default_directory(machine), machine)


def resealed(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Change a file and give it the checksum that fits: what somebody would do on purpose."""
    document = json.loads(path.read_text(encoding="utf-8"))
    del document["sha256"]
    change(document)
    path.write_text(LearnedFile[LearnedFunctions].sealed(document).to_text(), encoding="utf-8")


DAMAGE: dict[str, tuple[Callable[[str], str], str]] = {
    "torn off": (lambda text: text[: len(text) // 2], "is damaged, no JSON"),
    "empty": (lambda _: "", "is damaged, no JSON"),
    "a list": (lambda _: "[]", "is damaged: no JSON object"),
    "nested without end": (lambda _: "[" * 100_000, "is damaged, no JSON"),
    "another digit": (lambda text: text.replace("0.31", "0.32"), r"checksum \(sha256\) does not fit"),
    "no checksum": (lambda text: text.replace("sha256", "sha255"), r"checksum \(sha256\) does not fit"),
    "an infinity": (lambda text: text.replace("0.31", "Infinity"), "Infinity is not a number"),
    "a float without end": (lambda text: text.replace("0.31", "1e999"), "checksum"),
    "of a later software": (
        lambda text: text.replace('"format": 1', '"format": 2'),
        "has format 2, this software reads up to 1: update",
    ),
    "of no format": (lambda _: "{}", "has no format"),
    "without end": (lambda text: text + " " * 1_000_000, "more than 1000000 characters"),
}


@pytest.mark.parametrize("case", DAMAGE)
def test_damaged_file_is_refused_with_its_name_and_what_to_do(store: LearnedStore, case: str) -> None:
    change, reason = DAMAGE[case]
    store.add("x", LEARNED, {})
    path = store.directory / "x" / "v0001.json"
    path.write_text(change(path.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(
        StoreError, match=rf"v0001\.json: .*{reason}.*; learn axis x again, or take an earlier"
    ):
        store.active("x")
    assert store.roll_back("x") is None
    assert store.active("x") is None


@given(st.data())
@settings(max_examples=150)
def test_a_changed_byte_is_refused_or_without_effect(data: st.DataObject) -> None:
    text = LearnedFile[LearnedFunctions].sealed(content_of(LEARNED)).to_text().encode()
    place = data.draw(st.integers(0, len(text) - 1))
    byte = data.draw(st.integers(0, 127))
    changed = text[:place] + bytes([byte]) + text[place + 1 :]
    try:
        result = LearnedFile[LearnedFunctions].from_text(changed.decode())
    except ValueError:
        return
    assert result == LearnedFile[LearnedFunctions].from_text(text.decode())


def test_file_that_is_not_there_or_not_readable_is_refused(store: LearnedStore) -> None:
    store.add("x", LEARNED, {})
    path = store.directory / "x" / "v0001.json"
    path.unlink()
    with pytest.raises(StoreError, match=r"v0001\.json: is missing, and active\.json names it"):
        store.active("x")
    path.mkdir()
    with pytest.raises(StoreError, match=r"v0001\.json: cannot be read: Is a directory"):
        store.active("x")
    path.rmdir()
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(StoreError, match=r"v0001\.json: 'utf-8'"):
        store.active("x")


def test_file_of_another_axis_or_version_is_refused(store: LearnedStore) -> None:
    store.add("x", LEARNED, {})
    store.add("y", LEARNED, {"other": 1})
    mine, other = store.directory / "x", store.directory / "y"
    copy_of(1, other, mine)
    with pytest.raises(StoreError, match=r'x/v0001\.json: was learned on axis "y", not "x"'):
        store.active("x")
    store.add("x", LEARNED, {})
    (mine / "v0002.json").replace(mine / "v0001.json")
    (mine / "v0001.json").replace(mine / "v0003.json")
    entries = store.versions("x")
    assert [entry.problem for entry in entries] == ["holds version 2: it was renamed or copied"]


def test_another_version_under_the_name_in_use_is_refused(store: LearnedStore) -> None:
    store.add("x", LEARNED, {})
    resealed(store.directory / "x" / "v0001.json", lambda document: document["learned"].update(strokes=1))
    with pytest.raises(StoreError, match=r"is not the version 1 that active\.json names"):
        store.active("x")


def test_file_of_another_machine_is_refused(store: LearnedStore, tmp_path: Path) -> None:
    store.add("x", LEARNED, {})
    other = table_in(tmp_path / "other", ('name = "xy_table"', 'name = "second table"'))
    with pytest.raises(StoreError, match='was learned on machine "xy_table", this one is "second table"'):
        LearnedStore(store.directory, other).active("x")


STALE = {
    "gain": ("kp_1_s = 38.7", "kp_1_s = 40.0", "control.kp_1_s was 38.7 then, it is 40.0 now"),
    "feedback": ('feedback = "scale"', 'feedback = "motor"', "control.feedback was scale then, it is motor"),
    "mass": ("feedforward_kg = 70.0", "feedforward_kg = 71.0", "acceleration_feedforward_kg was 70.0 then"),
    "rise": ("rise_ms = 10.0", "rise_ms = 9.0", "rise_ms was 10.0 then, it is 9.0 now"),
    "A_max": ("allowed_mm_s2 = 200.0", "allowed_mm_s2 = 150.0", "acceleration_allowed_mm_s2 was 200.0 then"),
    "period": (
        "sync_period_us = 1000",
        "sync_period_us = 500",
        "sync_period_us was 1000 then, it is 500 now",
    ),
    "lead": ("lead_mm = 10.0", "lead_mm = 5.0", "transmission.lead_mm was 10.0 then, it is 5.0 now"),
}


@pytest.mark.parametrize("case", STALE)
def test_stale_file_is_refused_and_the_value_is_named(store: LearnedStore, tmp_path: Path, case: str) -> None:
    old, new, reason = STALE[case]
    store.add("x", LEARNED, {})
    changed = table_in(tmp_path / "changed", (old, new))
    with pytest.raises(StoreError, match=rf"does not fit .*controller\.toml any more: .*{reason}"):
        LearnedStore(store.directory, changed).active("x")


def test_settings_without_influence_on_the_pulse_do_not_make_it_stale(
    store: LearnedStore, tmp_path: Path
) -> None:
    store.add("x", LEARNED, {})
    changed = table_in(
        tmp_path / "changed",
        ("required_um = 4.0", "required_um = 2.0"),
        ("radius_mm = 50.0", "radius_mm = 40.0"),
        ("following_error_mm = 1.0", "following_error_mm = 0.5"),
    )
    assert LearnedStore(store.directory, changed).active("x") == store.active("x")


def test_amplitude_beyond_a_max_is_refused_even_with_a_checksum_that_fits(store: LearnedStore) -> None:
    store.add("x", LEARNED, {})
    resealed(
        store.directory / "x" / "v0001.json",
        lambda document: document["learned"]["trailing"][1].update(amplitude_m_s=-0.0021),
    )
    with pytest.raises(
        StoreError, match=r"has an amplitude of -2\.1 mm/s at 120 mm/s\^2, beyond A_max 2 mm/s"
    ):
        store.active("x")


REFUSED = {
    "J that is none": ({"after_m": math.nan}, "learned.after_m: must be a finite number"),
    "negative J": ({"before_m": -1e-6}, "learned.before_m"),
    "falling accelerations": (
        {"durations": LEARNED.durations[::-1]},
        "durations: the accelerations must rise",
    ),
    "acceleration twice": ({"amplitudes": ((0.1, 1e-3),) * 2}, "amplitudes: the accelerations must rise"),
    "no duration": ({"durations": ((0.1, 0.0),)}, r"durations\[1\]\.duration_s"),
    "no points": ({"amplitudes": ()}, "amplitudes"),
    "pulse backwards": ({"amplitudes": ((0.1, -1e-3),)}, r"amplitudes\[1\]\.amplitude_m_s"),
    "endless pulse": ({"durations": ((0.1, 61.0),)}, r"durations\[1\]\.duration_s"),
    "too much": ({"amplitudes": ((0.1, 0.00201),)}, "amplitude of 2.01 mm/s at 100 mm/s.2, beyond A_max"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_result_that_could_not_be_read_back_is_not_stored(store: LearnedStore, case: str) -> None:
    change, reason = REFUSED[case]
    store.add("x", LEARNED, {})
    with pytest.raises(StoreError, match=f"axis x: what was learned is not stored: .*{reason}"):
        store.add("x", LEARNED._replace(**change), {})
    assert [entry.version for entry in store.versions("x")] == [1]
    active = store.active("x")
    assert active is not None
    assert active.version == 1


def test_amplitude_at_a_max_is_stored(store: LearnedStore) -> None:
    assert store.add("x", LEARNED._replace(amplitudes=((0.1, 2e-3),)), {}).version == 1
