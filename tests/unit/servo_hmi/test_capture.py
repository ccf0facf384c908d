"""Which rows the scope shows, by hand and however often the capture is advanced."""

from hypothesis import given
from hypothesis import strategies as st

from servo_ctrl.hmi.scope.capture import CaptureSettings, CaptureState, CaptureWindow, TriggerMode, advance

TRIGGERED = CaptureSettings(span=100, before=20, mode="normal", free=False)


def test_free_running_shows_the_newest_rows() -> None:
    shown = advance(CaptureSettings(span=100), CaptureState(0), [], 250).window
    assert shown == CaptureWindow(150, 250, 250, triggered=False)


def test_a_window_begins_before_its_trigger() -> None:
    capture = advance(TRIGGERED, CaptureState(0), [50], 60)
    assert capture.window == CaptureWindow(30, 130, 50, triggered=True)
    assert capture.filling
    assert not advance(TRIGGERED, capture, [], 130).filling


def test_mode_normal_keeps_its_window_until_the_next_trigger_after_it() -> None:
    capture = advance(TRIGGERED, CaptureState(0), [50, 120], 131)  # 120 lies within the picture
    assert advance(TRIGGERED, capture, [], 9_000).window == CaptureWindow(30, 130, 50, triggered=True)
    assert advance(TRIGGERED, capture, [9_100], 9_101).window == CaptureWindow(
        9_080, 9_180, 9_100, triggered=True
    )


def test_mode_single_takes_one_window() -> None:
    single = TRIGGERED._replace(mode="single")
    capture = advance(single, CaptureState(0), [50], 130)
    assert capture.done
    assert advance(single, capture, [500], 900) == capture


def test_mode_auto_runs_free_without_a_trigger_and_triggers_again() -> None:
    auto = TRIGGERED._replace(mode="auto", auto_wait=300)
    capture = advance(auto, CaptureState(0), [50], 130)
    assert advance(auto, capture, [], 430).window == CaptureWindow(30, 130, 50, triggered=True)
    capture = advance(auto, capture, [], 431)
    assert capture.window == CaptureWindow(331, 431, 431, triggered=False)
    assert advance(auto, capture, [440], 445).window == CaptureWindow(420, 520, 440, triggered=True)


def test_of_several_windows_completed_at_once_the_last_is_shown() -> None:
    assert advance(TRIGGERED, CaptureState(0), [50, 200, 400], 481).window == CaptureWindow(
        380, 480, 400, triggered=True
    )


@given(
    st.lists(st.integers(0, 2000), max_size=12, unique=True).map(sorted),
    st.lists(st.integers(0, 2200), max_size=6).map(sorted),
    st.sampled_from(["normal", "single"]),
)
def test_the_window_does_not_depend_on_how_often_it_is_advanced(
    triggers: list[int], looks: list[int], mode: TriggerMode
) -> None:
    chosen = TRIGGERED._replace(mode=mode)
    capture, before = CaptureState(0), 0
    for newest in [*looks, 2300]:
        capture = advance(chosen, capture, [t for t in triggers if before <= t < newest], newest)
        before = newest
    assert capture == advance(chosen, CaptureState(0), triggers, 2300)


def test_mode_auto_does_not_wait_for_a_whole_first_window() -> None:
    auto = CaptureSettings(span=60_000, before=20, mode="auto", free=False, auto_wait=300)
    assert advance(auto, CaptureState(1000), [], 1300).window is None
    assert advance(auto, CaptureState(1000), [], 1301).window == CaptureWindow(
        -58_699, 1301, 1301, triggered=False
    )
