"""The table of aims: what counts as met, on figures that are known."""

from typing import Any

import pytest

from studies.feng_2015.aims import at_rest, behind_rests, recovered, within_aim


def course(adapted_um: list[float]) -> dict[str, Any]:
    count = len(adapted_um)
    named = {"axis": "x", "feed_mm_min": 500, "level_factor": 1.8}
    return {**named, "adapted_J_um": adapted_um, "stale_J_um": [2.0] * count, "without_J_um": [5.0] * count}


@pytest.mark.parametrize(
    ("behind_um", "figure", "met"),
    [
        ([2.0, 0.4, 0.4], "1", True),
        ([2.0, 0.4, 0.6, 0.4], "3", True),
        ([0.4, 0.4], "0", True),
        ([2.0, 2.0], "not on x F 500", False),
        ([2.0] * 21 + [0.4], "21", False),
    ],
)
def test_an_axis_has_recovered_when_its_error_stays_below_a_tenth(
    behind_um: list[float], figure: str, met: bool
) -> None:
    aim = recovered([course([0.1, 0.1, *behind_um])], 2, "friction +80 %")
    assert (aim.figure, aim.met) == (figure, met)


def test_an_aim_of_all_machines_is_missed_by_one() -> None:
    stages = [{"screw_table_trimmed": {"largest_um": 0.4}, "screw_table_shaped": {"largest_um": 0.3}}] * 2
    stages = [
        *stages,
        {"screw_table_trimmed": {"largest_um": 0.6}, "screw_table_shaped": {"largest_um": 0.5}},
    ]
    positioning = {"stages": stages, "aim_um": 0.5}
    fuzzy_pd = {"tables": [{"fuzzy_pd": {"rest_um": 0.1}}], "aim_um": 0.5}
    found = [within_aim(entry) for entry in at_rest(positioning, fuzzy_pd)]
    assert [aim.figure for aim in found] == [
        "2 of 3, worst 0.60 um",
        "3 of 3, worst 0.50 um",
        "1 of 1, worst 0.10 um",
    ]
    assert [aim.met for aim in found] == [False, True, True]


def test_starts_behind_rests_are_held_against_their_aims() -> None:
    """Two starts that go on, 95 and 85 % less, and one that turns, 92 % less by its worst indicator."""

    def axis(learned_um: list[float]) -> dict[str, Any]:
        plain = {key: [2.0, 2.0, 2.0] for key in ("mean_um", "peak_um", "rms_um")}
        return {
            "rest_s": [0.1, 5.0, 40.0],
            "turned": [False, False, True],
            "without": {key: [10.0, 10.0, 10.0] for key in plain},
            "LWC": plain,
            "rests": {**plain, "mean_um": [0.5, 0.5, 0.1], "peak_um": learned_um, "rms_um": [0.5, 0.5, 0.5]},
        }

    rests = {"variants": ["without", "LWC", "rests"], "growing": [axis([0.5, 1.5, 0.8])]}
    on, against, worse = behind_rests({**rests, "constant": [axis([2.05, 0.5, 2.3])]})
    assert (on.figure, on.met) == ("1 of 2, median 90.0 %, worst 85.0 %", False)
    assert (against.figure, against.met) == ("1 of 1, median 92.0 %, worst 92.0 %", True)
    assert (worse.figure, worse.met) == ("1 of 3 by more than 0.1 um, worst 0.30 um", False)
