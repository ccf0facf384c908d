"""Which rows the scope shows, by hand and over every way of being told late."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from servo_ctrl.hmi.capture import Mode, Picture, Settings, advance, begin

TRIGGERED = Settings(span=100, before=20, mode="normal", free=False)


def test_free_running_shows_the_newest_rows() -> None:
    shown = advance(Settings(span=100), begin(0), [], 250).shown
    assert shown == Picture(150, 250, 250, triggered=False)


def test_a_trigger_begins_a_picture_with_what_came_before_it() -> None:
    capture = advance(TRIGGERED, begin(0), [50], 60)
    assert capture.shown == Picture(30, 130, 50, triggered=True)
    assert capture.filling
    assert not advance(TRIGGERED, capture, [], 130).filling


def test_normal_keeps_its_picture_until_the_next_trigger_behind_it() -> None:
    capture = advance(TRIGGERED, begin(0), [50, 120], 131)  # 120 lies within the picture
    assert advance(TRIGGERED, capture, [], 9_000).shown == Picture(30, 130, 50, triggered=True)
    assert advance(TRIGGERED, capture, [9_100], 9_101).shown == Picture(9_080, 9_180, 9_100, triggered=True)


def test_single_takes_one_picture() -> None:
    single = TRIGGERED._replace(mode="single")
    capture = advance(single, begin(0), [50], 130)
    assert capture.done
    assert advance(single, capture, [500], 900) == capture


def test_auto_runs_free_after_a_while_without_a_trigger_and_comes_back() -> None:
    auto = TRIGGERED._replace(mode="auto", patience=300)
    capture = advance(auto, begin(0), [50], 130)
    assert advance(auto, capture, [], 430).shown == Picture(30, 130, 50, triggered=True)
    capture = advance(auto, capture, [], 431)
    assert capture.shown == Picture(331, 431, 431, triggered=False)
    assert advance(auto, capture, [440], 445).shown == Picture(420, 520, 440, triggered=True)


def test_of_several_pictures_completed_at_once_the_last_is_shown() -> None:
    assert advance(TRIGGERED, begin(0), [50, 200, 400], 481).shown == Picture(380, 480, 400, triggered=True)


@given(
    st.lists(st.integers(0, 2000), max_size=12, unique=True).map(sorted),
    st.lists(st.integers(0, 2200), max_size=6).map(sorted),
    st.sampled_from(["normal", "single"]),
)
def test_being_told_late_leads_to_the_same_picture_in_the_end(
    triggers: list[int], looks: list[int], mode: Mode
) -> None:
    chosen = TRIGGERED._replace(mode=mode)
    capture, before = begin(0), 0
    for newest in [*looks, 2300]:
        capture = advance(chosen, capture, [t for t in triggers if before <= t < newest], newest)
        before = newest
    assert capture == advance(chosen, begin(0), triggers, 2300)


def test_auto_does_not_wait_for_a_whole_picture_where_there_is_none_yet() -> None:
    auto = Settings(span=60_000, before=20, mode="auto", free=False, patience=300)
    assert advance(auto, begin(1000), [], 1300).shown is None
    assert advance(auto, begin(1000), [], 1301).shown == Picture(-58_699, 1301, 1301, triggered=False)
