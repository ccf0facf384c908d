"""A mass carried elastically on the table, against scipy, closed forms, momentum and energy."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from in_process_nodes import EDS, IDEAL_AXIS, SCALE, InProcessNodes, SdoDrive, counts
from scipy.integrate import solve_ivp

from hil_sim.physics.friction import coulomb_friction, viscous_friction
from hil_sim.physics.load import structural_mode
from hil_sim.physics.sensor import scale
from hil_sim.physics.transmission import drive_compliance
from hil_sim.plant import amplifier
from hil_sim.plant.measured_point import measured_point_m

DT_S = 50e-6
MOTOR_KG, TABLE_KG = 20.0, 50.0
ARM = structural_mode.Params(mass_kg=8.0, frequency_hz=40.0, damping_ratio=0.01)
OMEGA = 2.0 * math.pi * ARM.frequency_hz
SCREW = drive_compliance.Params(stiffness_n_m=40e6, damping_n_s_m=2e3)
VISCOUS = viscous_friction.Params(400.0)


def push(t: float) -> float:
    return 100.0 * math.sin(2.0 * math.pi * 8.0 * t) + 60.0 * math.sin(2.0 * math.pi * 37.0 * t)


def test_motor_table_and_carried_mass_agree_with_scipy(bench: Any) -> None:
    def motion(t: float, y: Any) -> list[float]:
        spring = SCREW.stiffness_n_m * (y[0] - y[2]) + SCREW.damping_n_s_m * (y[1] - y[3])
        k, c = ARM.mass_kg * OMEGA**2, 2.0 * ARM.damping_ratio * ARM.mass_kg * OMEGA
        arm = k * (y[4] - y[2]) + c * (y[5] - y[3])
        return [
            y[1],
            (push(t) - spring) / MOTOR_KG,
            y[3],
            (spring + arm - VISCOUS.viscous_n_s_m * y[3]) / TABLE_KG,
            y[5],
            -arm / ARM.mass_kg,
        ]

    axis = bench(MOTOR_KG, TABLE_KG, drive_compliance=SCREW, viscous_friction=VISCOUS, structural_mode=ARM)
    ours = axis.record(push, 0.3, "motor_position_m", "table_position_m", "carried_position_m")
    times = (np.arange(6000) + 1) * DT_S
    truth = solve_ivp(motion, (0.0, 0.3), [0.0] * 6, t_eval=times, rtol=1e-9, atol=1e-14, max_step=1e-3)
    size = np.abs(truth.y[4]).max()
    for row, name in enumerate(ours):
        assert np.abs(ours[name] - truth.y[2 * row]).max() < 4e-3 * size


@pytest.mark.parametrize("elastic", [False, True], ids=["rigid", "elastic"])
def test_force_of_the_motor_is_the_momentum_of_all_masses(bench: Any, elastic: bool) -> None:
    effects: dict[str, Any] = {"drive_compliance": SCREW} if elastic else {}
    axis = bench(MOTOR_KG, TABLE_KG, structural_mode=ARM, **effects)
    axis.record(lambda _: 30.0, 0.1, "time_s")
    s = axis.state
    momentum = (
        MOTOR_KG * s["motor_velocity_m_s"]
        + TABLE_KG * s["table_velocity_m_s"]
        + ARM.mass_kg * s["carried_velocity_m_s"]
    )
    assert momentum == pytest.approx(30.0 * 0.1, rel=1e-9)


def swung(bench: Any, table_kg: float, seconds: float) -> Any:
    """Deflection (m) after the force of a constant acceleration of 0.25 m/s^2 has ended at once."""
    axis = bench(0.0, table_kg, structural_mode=ARM)
    settle_s, total_kg = 3.0, table_kg + ARM.mass_kg  # the swinging of the start has died away
    run = axis.record(
        lambda t: 0.25 * total_kg if t < settle_s else 0.0,
        settle_s + seconds,
        "carried_position_m",
        "table_position_m",
    )
    return (run["carried_position_m"] - run["table_position_m"])[round(settle_s / DT_S) :]


def test_end_of_an_acceleration_leaves_a_swing_of_a_by_w_squared_that_decays(bench: Any) -> None:
    """On a table a thousand times as heavy: d(t) = -a / w^2 exp(-zeta w t) (cos + zeta / sqrt .. sin)."""
    table_kg = 1000.0 * ARM.mass_kg
    free = swung(bench, table_kg, 0.5)
    omega = OMEGA * math.sqrt(1.0 + 1e-3)
    zeta = ARM.damping_ratio * math.sqrt(1.0 + 1e-3)
    damped = omega * math.sqrt(1.0 - zeta**2)
    t = (np.arange(len(free)) + 1) * DT_S
    wave = np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t)
    expected = -0.25 / OMEGA**2 * np.exp(-zeta * omega * t) * wave
    assert np.abs(free - expected).max() < 0.01 * np.abs(expected).max()


def test_light_table_swings_against_it_faster(bench: Any) -> None:
    free = swung(bench, 2.0 * ARM.mass_kg, 0.5)
    crossings = np.nonzero((free[:-1] < 0.0) & (free[1:] >= 0.0))[0]
    period_s = (crossings[-1] - crossings[0]) / (len(crossings) - 1) * DT_S
    assert 2.0 * math.pi / period_s == pytest.approx(OMEGA * math.sqrt(1.5), rel=2e-3)


@pytest.mark.parametrize("elastic", [False, True], ids=["rigid", "elastic"])
def test_undamped_it_neither_makes_nor_loses_energy(bench: Any, elastic: bool) -> None:
    effects: dict[str, Any] = {"drive_compliance": SCREW._replace(damping_n_s_m=0.0)} if elastic else {}
    axis = bench(MOTOR_KG, TABLE_KG, structural_mode=ARM._replace(damping_ratio=0.0), **effects)
    run = axis.record(
        lambda t: 300.0 if t < 10e-3 else 0.0, 6.0, "carried_position_m", "table_position_m", "transmitted_n"
    )
    swing_m = run["carried_position_m"] - run["table_position_m"]
    early, late = np.abs(swing_m[400:20_400]).max(), np.abs(swing_m[-20_000:]).max()
    assert early > 1e-6
    assert late == pytest.approx(early, rel=5e-3)


def test_damped_it_only_loses_energy(bench: Any) -> None:
    axis = bench(0.0, TABLE_KG, structural_mode=ARM._replace(frequency_hz=900.0, damping_ratio=0.02))
    run = axis.record(
        lambda t: 300.0 if t < 1e-3 else 0.0,
        0.2,
        "carried_position_m",
        "table_position_m",
        "carried_velocity_m_s",
        "table_velocity_m_s",
    )
    k = ARM.mass_kg * (2.0 * math.pi * 900.0) ** 2
    carried, table = run["carried_velocity_m_s"], run["table_velocity_m_s"]
    joule = (
        0.5 * k * (run["carried_position_m"] - run["table_position_m"]) ** 2
        + 0.5 * ARM.mass_kg * carried**2
        + 0.5 * TABLE_KG * table**2
    )
    peaks = [part.max() for part in np.array_split(joule[20:], 40)]
    assert np.isfinite(joule).all()
    assert all(after <= before * (1.0 + 1e-9) for before, after in pairwise(peaks))


def test_stiffly_carried_it_is_mass_of_the_table(bench: Any) -> None:
    stiff = bench(MOTOR_KG, TABLE_KG, structural_mode=structural_mode.Params(8.0, 1000.0, 0.5))
    rigid = bench(MOTOR_KG, TABLE_KG + 8.0)
    paths = [axis.record(push, 0.3, "motor_position_m")["motor_position_m"] for axis in (stiff, rigid)]
    assert np.abs(paths[0] - paths[1]).max() < 2e-3 * np.abs(paths[1]).max()


def test_scale_and_truth_are_where_the_carried_mass_is(bench: Any) -> None:
    fine = scale.Params(resolution_m=1e-9, reference_mark_m=0.0)
    carrying, bare = bench(structural_mode=ARM, scale=fine), bench(scale=fine)
    for axis in (carrying, bare):
        axis.record(push, 0.0413, "time_s")
    apart_m = carrying.state["carried_position_m"] - carrying.state["table_position_m"]
    assert abs(apart_m) > 1e-6
    for axis, name in ((carrying, "carried_position_m"), (bare, "table_position_m")):
        point_m = measured_point_m(axis.plant.params[0], axis.state)
        assert point_m == axis.state[name]
        assert axis.state["scale_counts"] * 1e-9 == pytest.approx(point_m, abs=0.51e-9)


def test_drive_and_scale_report_the_speed_of_what_the_scale_reads(tmp_path: Path) -> None:
    section = "[axis.x.structural_mode]\nmass_kg = 8.0\nfrequency_hz = 40.0\ndamping_ratio = 0.01\n"
    file = tmp_path / "plant.toml"
    file.write_text(IDEAL_AXIS.read_text().replace("../../eds", str(EDS)) + section)
    nodes = InProcessNodes(file)
    scale_node, drive = nodes.remote(SCALE), SdoDrive(nodes)
    drive.set(0x60FF, counts(25.0))
    drive.enable(3)
    state = nodes.bench.plant.state[0]
    apart_mm_s = []
    for _ in range(30):
        nodes.sync()
        carried_mm_s = float(state["carried_velocity_m_s"]) * 1e3
        apart_mm_s.append(carried_mm_s - float(state["table_velocity_m_s"]) * 1e3)
        assert scale_node.sdo[0x6030][1].raw * 0.01 == pytest.approx(carried_mm_s, abs=0.006)
        assert drive.get(0x60E5, 1) == pytest.approx(carried_mm_s * 1e4, abs=1)  # counts/s of 0.1 um
    assert np.ptp(apart_mm_s) > 5.0


def test_axis_at_rest_stays_at_rest_to_the_bit(bench: Any) -> None:
    axis = bench(structural_mode=ARM, drive_compliance=SCREW, coulomb_friction=coulomb_friction.Params(10.0))
    axis.advance(20_000)
    for name in ("carried_position_m", "carried_velocity_m_s", "table_position_m", "motor_position_m"):
        assert axis.state[name] == 0.0


def test_swing_that_friction_holds_does_not_move_the_table(bench: Any) -> None:
    axis = bench(structural_mode=ARM, coulomb_friction=coulomb_friction.Params(60.0))
    axis.state["carried_position_m"] = 50.0 / (ARM.mass_kg * OMEGA**2)
    axis.plant.setpoint["loop"] = amplifier.OFF
    axis.advance(4000)
    assert axis.state["table_position_m"] == 0.0
    assert axis.state["carried_position_m"] != 0.0
