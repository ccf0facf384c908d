from hypothesis import given
from hypothesis import strategies as st

from servo_ctrl.hmi.access.control_right import GRACE_S, ControlRight


def opened(*browsers: str) -> ControlRight:
    right = ControlRight()
    for browser in browsers:
        right.page_opened(browser, f"{browser}-page")
    return right


def test_the_right_is_free_until_it_is_taken() -> None:
    right = opened("a")
    assert right.holder(0.0) is None
    right.take("a", "anna", "10.0.0.1", 0.0)
    assert right.held_by("a", 0.0)
    assert not right.held_by("b", 0.0)


def test_a_handover_names_both_holders() -> None:
    right = opened("a", "b")
    right.take("a", "anna", "10.0.0.1", 0.0)
    right.take("b", "bob", "10.0.0.2", 5.0)
    assert right.last.before is not None
    assert right.last.after is not None
    assert (right.last.before.user, right.last.after.user) == ("anna", "bob")
    assert not right.held_by("a", 5.0)


def test_only_the_holder_can_release_it() -> None:
    right = opened("a", "b")
    right.take("a", "anna", "", 0.0)
    right.release("b", 1.0)
    assert right.held_by("a", 1.0)
    right.release("a", 2.0)
    assert right.holder(2.0) is None


def test_it_survives_a_reload_and_ends_with_the_browser() -> None:
    right = opened("a")
    right.take("a", "anna", "", 0.0)
    right.page_closed("a", "a-page", 10.0)
    assert right.held_by("a", 10.0 + GRACE_S)
    right.page_opened("a", "another page")
    assert right.held_by("a", 10.0 + 9.0 * GRACE_S)
    right.page_closed("a", "another page", 1000.0)
    assert right.holder(1000.0 + 1.01 * GRACE_S) is None


def test_a_browser_without_a_page_cannot_take_it() -> None:
    right = opened()
    right.take("a", "anna", "", 0.0)
    assert right.holder(0.0) is None


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["take", "release", "came", "went", "wait"]),
            st.sampled_from("abc"),
            st.integers(0, 2),
        ),
        max_size=40,
    )
)
def test_at_most_one_browser_has_control_and_only_with_a_page_or_within_the_grace_period(
    steps: list[tuple[str, str, int]],
) -> None:
    right, now_s = ControlRight(), 0.0
    pages: dict[str, set[int]] = {browser: set() for browser in "abc"}
    left_s = dict.fromkeys("abc", -1e9)
    for do, browser, page in steps:
        match do:
            case "take":
                right.take(browser, browser, "", now_s)
            case "release":
                right.release(browser, now_s)
            case "came":
                right.page_opened(browser, str(page))
                pages[browser].add(page)
            case "went":
                right.page_closed(browser, str(page), now_s)
                if pages[browser] == {page}:
                    left_s[browser] = now_s
                pages[browser].discard(page)
            case "wait":
                now_s += 0.6 * GRACE_S
        holders = [one for one in "abc" if right.held_by(one, now_s)]
        assert len(holders) <= 1
        for one in holders:
            assert pages[one] or now_s - left_s[one] <= GRACE_S
