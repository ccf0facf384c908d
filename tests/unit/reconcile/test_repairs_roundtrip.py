"""One axis at a time in the batch twin: concealed physics recorded, diagnosed, written, recorded again.

The same as over the bus (tests/hil/test_reconcile_own_bus.py), in seconds, to work on the engine by.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import pytest
from reconcile_axis import (
    CONCEALED,
    DISAGREES,
    MISNAMED,
    REPEATS_MM,
    cases,
    channels,
    columns_of,
    difference,
    disagreements,
    noise_floor,
    twin_recording,
)
from reconcile_machine import motion, written

from reconcile.diagnose import diagnose

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from reconcile_axis import Channels, Difference


class Circle(NamedTuple):
    """What was said, and how far recordings are from that of the concealed plant."""

    verdict: dict[str, Any]
    floor: Difference
    """That plant once more, fractions of an encoder count beside."""
    nominal: Difference
    repaired: Difference


@pytest.fixture(scope="module")
def circle(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Circle]:
    """By effect; each is gone round once."""
    folder, gone = tmp_path_factory.mktemp("circle"), {}
    positions_m = motion()[:, None]
    nominal = written(folder / "nominal", {"x": ""}, positions_m)
    nominal_file = twin_recording(nominal, nominal, folder / "nominal.parquet")

    def go_round(effect: str) -> Circle:
        own = {"x": CONCEALED[effect].sections}
        machine = written(folder / effect, own, positions_m)
        file = twin_recording(machine, machine, folder / f"{effect}.parquet")
        concealed = channels(columns_of(file), "x")

        def recorded(plant: Path) -> Channels:
            return channels(columns_of(twin_recording(machine, plant, folder / "other.parquet")), "x")

        repeats = [recorded(written(folder / "again", own, positions_m, start_mm)) for start_mm in REPEATS_MM]
        found = diagnose([file], nominal / "plant.toml", folder / f"{effect}_diagnosis")
        return Circle(
            found.verdict,
            noise_floor(concealed, repeats),
            difference(concealed, channels(columns_of(nominal_file), "x")),
            difference(concealed, recorded(found.model_file)),
        )

    def circle_of(effect: str) -> Circle:
        if effect not in gone:
            gone[effect] = go_round(effect)
        return gone[effect]

    return circle_of


@pytest.mark.parametrize("effect", cases(MISNAMED))
def test_concealed_effect_is_named_alone_and_sized(circle: Callable[[str], Circle], effect: str) -> None:
    found = {f["effect"]: f for f in circle(effect).verdict["findings"]}
    assert set(found) - CONCEALED[effect].besides == {effect}
    for name, (truth, tolerance) in CONCEALED[effect].parameters.items():
        assert found[effect]["parameters"][name]["value"] == pytest.approx(truth, rel=tolerance), name


@pytest.mark.parametrize("effect", cases(DISAGREES))
def test_written_model_records_what_the_concealed_plant_did(
    circle: Callable[[str], Circle], effect: str
) -> None:
    gone = circle(effect)
    assert disagreements(gone.floor, gone.nominal, gone.repaired) == []
