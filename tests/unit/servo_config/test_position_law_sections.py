"""Position laws and corrections in controller.toml: refused values, and their values in SI."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from law_records import axis_records
from machine_files import XY_TABLE, replaced, text_of, without_sections, write_controller
from pydantic import ValidationError

from servo_ctrl.config.kernel_params import axis_params, with_fuzzy, with_sampled_dual_loop, with_screw
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import AxisConfig, MachineConfig
from servo_ctrl.control.axis_record import tick_axis
from servo_ctrl.control.compensation.screw_error import ScrewCompensationSettings
from servo_ctrl.errors import ConfigError

TABLE = XY_TABLE / "controller.toml"
FUZZY = """[axis.x.fuzzy_pd]
fine_um = 10.0
coarse_um = 50.0
weight_1_mm = 40.0
error_gain_1_mm = 25.0
change_gain_s_mm = 0.02
output_mm_s = 4.0
ki_1_s2 = 30.0
"""
SCREW = "[axis.x.screw_compensation]\n"
SAMPLED = "[axis.x.sampled_dual_loop]\n"
CSP = {
    'mode = "cst"': 'mode = "csp"',
    '"target_torque", "torque_offset"': '"target_position"',
    "acceleration_feedforward_kg = ": "acceleration_feedforward_kg = 0.0 # ",
    "\nvelocity_feedforward = ": "\nvelocity_feedforward = 0.0 # ",
}
ON_MOTOR = {"kp_1_s = ": 'feedback = "motor"\nkp_1_s = '}


@pytest.fixture
def made(tmp_path: Path) -> Callable[..., Path]:
    """The X-Y table with these sections, without its compensations, and texts of its file replaced."""

    def make(sections: str = "", changes: dict[str, str] | None = None) -> Path:
        text = without_sections(text_of(TABLE), "friction_compensation", "disturbance_observer", "fuzzy_pd")
        text = replaced(re.sub(r"\nfeedback = .*", "", text), changes or {})
        return write_controller(tmp_path, f"{text}\n{sections}")

    return make


@pytest.fixture(scope="module")
def whole_table() -> MachineConfig:
    return load_machine(TABLE.parent)


def test_position_laws_are_converted_to_si(made: Callable[..., Path]) -> None:
    gains = "ki_1_s2 = 120.0\nkd = 0.03\nderivative_filter_ms = 2.0\nkv_n_s_m = "
    path = made(FUZZY, {"\nkv_n_s_m = ": f"\n{gains}"})
    p = axis_params(load_machine(path), "x")
    assert (p.position_loop.ki_1_s2, p.position_loop.kd) == (120.0, 0.03)
    assert p.position_loop.derivative_blend == pytest.approx(1.0 - math.exp(-0.5))
    assert p.fuzzy.enabled
    assert p.fuzzy[1:8] == pytest.approx((10e-6, 50e-6, 4e4, 25e3, 20.0, 4e-3, 30.0))
    assert p.fuzzy.surface.flags.c_contiguous
    assert not with_fuzzy(p, enabled=False).fuzzy.enabled
    assert not axis_params(load_machine(path), "y").fuzzy.enabled


@pytest.mark.parametrize("where", [CSP, ON_MOTOR], ids=["csp", "on the motor"])
def test_motor_corrections_are_converted_to_si_and_need_a_learned_table(
    made: Callable[..., Path], where: dict[str, str]
) -> None:
    keys = 'tolerance_um = 0.4\nsettle_ms = 80.0\nprofile = "trapezoidal"\nacceleration_mm_s2 = 20.0\n'
    keys += "gain = 0.25\n"
    machine = load_machine(made(SCREW + SAMPLED + keys, where))
    p, limits = axis_params(machine, "x"), machine.axes["x"].limits
    assert p.sampled[:6] == pytest.approx((True, 0.08, 0.4e-6, 3, 100e-6, False))
    assert p.sampled[6:] == pytest.approx((0.02, limits.jerk_mm_s3 * 1e-3, 0.25))
    assert not with_sampled_dual_loop(p, enabled=False).sampled.enabled
    assert (p.screw.enabled, p.take_up.enabled) == (False, False)
    led = with_screw(p, np.asfortranarray([[0.0, 1.0], [1e-6, 2e-6]]), 7e-6)
    assert (led.screw.enabled, led.take_up.enabled, led.take_up.lost_motion_m) == (True, True, 7e-6)
    assert led.screw.table.flags.c_contiguous
    assert led.take_up[2:] == pytest.approx((0.5, 50.0))
    none = with_screw(led, None)
    assert (none.screw.enabled, none.take_up.enabled) == (False, False)


@pytest.mark.parametrize(
    ("sections", "replaced", "reason"),
    [
        (FUZZY, CSP, "axis.x.fuzzy_pd: mode csp has no velocity set point of the controller"),
        (SCREW, {}, 'axis.x.screw_compensation: needs mode csp, or control.feedback "motor"'),
        (SAMPLED, {}, 'axis.x.sampled_dual_loop: needs mode csp, or control.feedback "motor"'),
        (f"{SAMPLED}tolerance_um = 0.04", CSP, "tolerance_um: 0.04 is less than half a count of the scale"),
        (f"{SAMPLED}limit_um = 0.4", CSP, "limit_um: 0.4 is less than tolerance_um 0.5"),
        (f"{SAMPLED}corrections = 0", CSP, "axis.x.sampled_dual_loop.corrections: "),
        (f'{SAMPLED}profile = "sine"', CSP, "axis.x.sampled_dual_loop.profile: "),
        (f"{SAMPLED}jerk_mm_s3 = 0.0", CSP, "axis.x.sampled_dual_loop.jerk_mm_s3: "),
        (FUZZY.replace("coarse_um = 50", "coarse_um = 10"), {}, "coarse_um: must be above fine_um 10"),
        (FUZZY.replace("weight_1_mm = 40.0", "weight_1_mm = 0.0"), {}, "axis.x.fuzzy_pd.weight_1_mm: "),
        (FUZZY.replace("fine_um = 10.0\n", ""), {}, "axis.x.fuzzy_pd.fine_um: "),
        (FUZZY + "surface = 3\n", {}, "axis.x.fuzzy_pd.surface: "),
        ("", {"\nkp_1_s = ": "\nkd = -0.1\nkp_1_s = "}, "axis.x.control.kd: "),
        ("", {"\nkp_1_s = ": "\nki_1_s2 = inf\nkp_1_s = "}, "axis.x.control.ki_1_s2: "),
    ],
)
def test_inconsistent_values_are_refused(
    made: Callable[..., Path], sections: str, replaced: dict[str, str], reason: str
) -> None:
    with pytest.raises(ConfigError, match=re.escape(reason)) as caught:
        load_machine(made(sections, replaced))
    assert "controller.toml: axis.x." in str(caught.value)


def test_a_law_that_reads_the_scale_needs_one(made: Callable[..., Path]) -> None:
    path = made(SAMPLED, ON_MOTOR)
    text = re.sub(r"\[axis\.x\.scale\]\n(?:[^\[\n].*\n)*", "", path.read_text(encoding="utf-8"))
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"axis\.x\.sampled_dual_loop: there is no scale section to read"):
        load_machine(path)


WIDE = st.floats(1e-9, 1e9)
GAIN = st.just(0.0) | WIDE
SIZE_UM = st.floats(1e-3, 1e6)
LAWS = st.fixed_dictionaries(
    {
        "mode": st.sampled_from(["cst", "csv", "csp"]),
        "control": st.fixed_dictionaries(
            {
                "feedback": st.sampled_from(["scale", "motor"]),
                **dict.fromkeys(
                    ("kp_1_s", "kv_n_s_m", "kd", "ki_1_s2", "ki_n_m", "derivative_filter_ms"), GAIN
                ),
                **dict.fromkeys(("velocity_feedforward", "acceleration_feedforward_kg"), GAIN),
            }
        ),
        "fuzzy_pd": st.none()
        | st.fixed_dictionaries(
            {"fine_um": SIZE_UM, "coarse_um": SIZE_UM, "weight_1_mm": st.floats(1e-6, 1e9)}
            | dict.fromkeys(("error_gain_1_mm", "change_gain_s_mm", "output_mm_s", "ki_1_s2"), WIDE)
        ),
        "screw_compensation": st.none()
        | st.fixed_dictionaries({"take_up_acceleration_mm_s2": WIDE, "take_up_jerk_mm_s3": WIDE}),
        "sampled_dual_loop": st.none()
        | st.fixed_dictionaries(
            {
                "settle_ms": st.floats(1e-3, 5.0),
                "corrections": st.integers(1, 100),
                "profile": st.sampled_from(["s_curve", "trapezoidal"]),
                **dict.fromkeys(("tolerance_um", "limit_um"), SIZE_UM),
                **dict.fromkeys(("acceleration_mm_s2", "jerk_mm_s3"), WIDE),
            }
        ),
    }
)
POSITION = st.floats(-10.0, 10.0)
SAMPLES = st.tuples(
    POSITION,
    *[st.floats(-1e3, 1e3)] * 3,
    POSITION,
    POSITION | st.just(math.nan),
    st.just(math.nan),
    st.floats(-1.0, 1.0),
)


@settings(deadline=None, max_examples=60)
@given(LAWS, st.lists(SAMPLES, min_size=1, max_size=12), st.floats(0.0, 2e-4))
def test_any_valid_file_gives_finite_set_points_within_the_limits_for_finite_inputs(
    whole_table: MachineConfig, law: dict[str, Any], samples: list[tuple[float, ...]], lost_motion_m: float
) -> None:
    mapped = ["controlword", "target_torque", "target_velocity", "target_position"]
    axis = whole_table.axes["x"].model_dump(exclude={"friction_compensation", "disturbance_observer"})
    axis["drive"]["rpdo1"] = mapped
    try:
        config = AxisConfig.model_validate(axis | law)
    except ValidationError:
        assume(False)
    p = axis_params(whole_table.model_copy(update={"axes": {"x": config}}), "x")
    if config.section(ScrewCompensationSettings) is not None:
        p = with_screw(p, np.array([[-1.0, 0.0, 2.0], [-2e-4, 0.0, 2e-4]]), lost_motion_m)
    axes, tables = axis_records([p], [samples[0][0]])
    for sample in samples:
        axes["sample"] = sample
        tick_axis(axes[0], tables)
        command = axes["command"][0]
        for name in ("position_m", "velocity_m_s", "force_n", "force_offset_n", "correction_m"):
            assert math.isfinite(command[name])
        assert abs(command["velocity_m_s"]) <= p.limits.velocity_m_s
        assert abs(command["force_n"]) <= p.limits.force_n
        assert (
            abs(command["correction_m"])
            <= 4e-4 + lost_motion_m + p.sampled.limit_m * p.sampled.enabled + 1e-12
        )
