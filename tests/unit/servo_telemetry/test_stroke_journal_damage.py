"""Truncated, damaged or reordered journals: valid strokes are used, wrong ones never."""

import tempfile
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from journal_examples import filled, journal_in, same
from learned_examples import stroke_of

from servo_ctrl.learned.stroke_journal import PREVIOUS_FILE


def test_incomplete_last_line_is_dropped_silently(tmp_path: Path) -> None:
    journal, entries = filled(tmp_path, 2)
    two = journal.path.read_bytes()
    journal.append(*stroke_of(2))
    three = journal.path.read_bytes()
    for end in [*range(len(two), len(three), 7), len(three) - 1]:
        journal.path.write_bytes(three[:end])
        resumed = journal_in(tmp_path)
        assert same(resumed.replay(), entries)
        assert resumed.problem == ""
        resumed.append(*stroke_of(2))
        assert journal.path.read_bytes() == three


def test_last_line_of_zero_bytes_is_dropped(tmp_path: Path) -> None:
    journal, entries = filled(tmp_path, 3)
    data = journal.path.read_bytes()
    start = data[:-1].rindex(b"\n") + 1
    journal.path.write_bytes(data[:start] + bytes(len(data) - start))
    resumed = journal_in(tmp_path)
    assert same(resumed.replay(), entries[:2])
    assert resumed.problem == ""


def test_empty_file_is_as_good_as_no_journal(tmp_path: Path) -> None:
    journal, entries = filled(tmp_path, 1)
    whole = journal.path.read_bytes()
    journal.path.write_bytes(b"")
    resumed = journal_in(tmp_path)
    assert resumed.replay() == []
    assert resumed.problem == ""
    resumed.append(*entries[0])
    assert journal.path.read_bytes() == whole


def test_replay_uses_bounded_memory(tmp_path: Path) -> None:
    """With locked memory 200 MB at one go would stop the cycle for tenths of a second."""
    filled(tmp_path, 3)
    tracemalloc.start()
    try:
        journal_in(tmp_path).replay()
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("kept", [1, 20])
def test_damaged_header_is_reported_and_learning_starts_again(tmp_path: Path, kept: int) -> None:
    journal, entries = filled(tmp_path, 1)
    whole = journal.path.read_bytes()
    journal.path.write_bytes(whole[:kept])
    resumed = journal_in(tmp_path)
    assert resumed.replay() == []
    assert "its header is damaged" in resumed.problem
    resumed.append(*entries[0])
    assert journal.path.read_bytes() == whole


@given(st.data())
@settings(max_examples=100, deadline=None)
def test_any_damage_keeps_the_strokes_before_it_and_yields_no_wrong_ones(data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as name:
        journal, entries = filled(Path(name), 4)
        whole = journal.path.read_bytes()
        place = data.draw(st.integers(0, len(whole) - 1))
        length = data.draw(st.integers(0, 3000))
        journal.path.write_bytes(whole[:place] + data.draw(st.binary(max_size=3)) + whole[place + length :])
        damaged = journal_in(Path(name))
        found = damaged.replay()
        assert same(found, entries[: len(found)])
        before_damage = whole[:place].count(b"\n") - 1
        assert len(found) >= before_damage
        assert damaged.problem or len(found) >= 3 or place + length >= len(whole)
        damaged.append(*stroke_of(9))
        assert same(journal_in(Path(name)).replay(), [*found, stroke_of(9)])


def test_damage_in_the_middle_is_reported_and_the_file_kept(tmp_path: Path) -> None:
    journal, entries = filled(tmp_path, 4)
    lines = journal.path.read_bytes().splitlines(keepends=True)
    damaged = b"".join([*lines[:3], lines[3].replace(b"1", b"2", 1), lines[4]])
    journal.path.write_bytes(damaged)
    resumed = journal_in(tmp_path)
    assert same(resumed.replay(), entries[:2])
    assert resumed.problem == (
        f"{journal.path}: line 4 is damaged: its checksum does not fit; the 2 strokes before it are used"
    )
    resumed.append(*stroke_of(9))
    assert resumed.problem == ""
    assert same(journal_in(tmp_path).replay(), [*entries[:2], stroke_of(9)])
    assert journal.path.with_name(PREVIOUS_FILE).read_bytes() == damaged


@pytest.mark.parametrize(
    "order", [(0, 1, 3, 4), (0, 1, 3, 2, 4), (0, 1, 2, 2, 3, 4)], ids=["lost", "swapped", "twice"]
)
def test_line_out_of_order_is_damage(tmp_path: Path, order: tuple[int, ...]) -> None:
    journal, entries = filled(tmp_path, 4)
    lines = journal.path.read_bytes().splitlines(keepends=True)
    journal.path.write_bytes(b"".join(lines[place] for place in order))
    damaged = journal_in(tmp_path)
    found = damaged.replay()
    assert same(found, entries[: len(found)])
    assert "is damaged" in damaged.problem
