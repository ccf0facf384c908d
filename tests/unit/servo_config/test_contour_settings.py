"""`[contour_control]`: off by default, in SI, refused without a margin."""

from pathlib import Path

import pytest
from machine_files import XY_TABLE, text_of

from servo_ctrl.config.contour import contour_note, couplings, sensitivity_peak_of
from servo_ctrl.config.contour_model import ContourControl
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.contour_control import Params
from servo_ctrl.cyclic.contour_coupling import Coupling
from servo_ctrl.errors import ConfigError


def table(directory: Path, section: str, *changes: tuple[str, str]) -> MachineConfig:
    text = text_of(XY_TABLE / "controller.toml")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (directory / "controller.toml").write_text(f"{text}\n[contour_control]\n{section}\n", encoding="utf-8")
    return load_machine(directory)


def test_it_is_off_without_the_section_and_where_it_is_not_enabled(tmp_path: Path) -> None:
    assert couplings(load_machine(XY_TABLE)) == ()
    assert couplings(table(tmp_path, 'enabled = false\naxes = ["x", "z"]\nkp_1_s = 1e6')) == ()


def test_settings_are_those_of_the_file_in_si_with_the_axes_by_number(tmp_path: Path) -> None:
    machine = table(tmp_path, 'axes = ["y", "x"]\nkp_1_s = 50.0\nlimit_mm_s = 3.0')
    law = Params(kp_1_s=50.0, ki_1_s2=0.0, limit_m_s=0.003, full_speed_m_s=0.001, period_s=0.001)
    assert couplings(machine) == (Coupling(1, 0, law),)


def test_the_largest_gain_that_is_accepted_has_ms_2(tmp_path: Path) -> None:
    machine = load_machine(XY_TABLE)
    below, above = (ContourControl(axes=["x", "y"], kp_1_s=gain) for gain in (55.0, 57.0))
    assert sensitivity_peak_of(machine, below) < 2.0 < sensitivity_peak_of(machine, above)
    table(tmp_path, 'axes = ["x", "y"]\nkp_1_s = 55.0')
    with pytest.raises(ConfigError, match=r"Ms of the two axes is 2\.0\d, above 2, on their masses"):
        table(tmp_path, 'axes = ["x", "y"]\nkp_1_s = 57.0')


def test_an_observer_that_may_be_switched_on_counts_and_one_that_the_file_lacks_does_not(
    tmp_path: Path,
) -> None:
    section = 'axes = ["x", "y"]\nkp_1_s = 70.0'
    with pytest.raises(ConfigError, match="Ms of the two axes is 2"):
        table(tmp_path, section)
    without = [
        (f"[axis.{name}.disturbance_observer]\nenabled = false\nbandwidth_hz = 7.5\nmass_kg = {mass_kg}", "")
        for name, mass_kg in (("x", 70.0), ("y", 89.6))
    ]
    assert len(couplings(table(tmp_path, section, *without))) == 1


@pytest.mark.parametrize(
    ("section", "changes", "reason"),
    [
        ('axes = ["x", "y"]\nkp_1_s = 900.0', [], r"control\.kp_1_s: .* the two axes are unstable"),
        ('axes = ["x", "z"]\nkp_1_s = 9.0', [], r"control\.axes: expected two of x, y, not x and z"),
        ('axes = ["x", "x"]\nkp_1_s = 9.0', [], "expected two of x, y, not x and x"),
        ('axes = ["x"]\nkp_1_s = 9.0', [], r"contour_control\.axes: "),
        ('axes = ["x", "y"]\nkp_1_s = -9.0', [], r"contour_control\.kp_1_s: "),
        (
            'axes = ["x", "y"]\nkp_1_s = 9.0',
            [("acceleration_feedforward_kg = 89.6", "")],
            r"axis y needs its mass, control\.acceleration_feedforward_kg",
        ),
        (
            'axes = ["x", "y"]\nkp_1_s = 9.0',
            [("enabled = false                  # instead", "enabled = true  # instead")],
            "axis x has fuzzy_pd, whose gain is not one number",
        ),
        (
            'axes = ["x", "y"]\nkp_1_s = 9.0',
            [
                ('mode = "cst"', 'mode = "csv"'),
                ('"target_torque", "torque_offset"', '"target_velocity"'),
                ("[axis.x.disturbance_observer]\nenabled = false\nbandwidth_hz = 7.5\nmass_kg = 70.0", ""),
                ("[axis.y.disturbance_observer]\nenabled = false\nbandwidth_hz = 7.5\nmass_kg = 89.6", ""),
                ("[axis.x.learned_waveform]\nlimit_n = 170.0", ""),
                ("[axis.y.learned_waveform]\nlimit_n = 230.0", ""),
            ],
            "axis x is in csv, only in cst both of its loops are closed here",
        ),
    ],
)
def test_what_has_no_margin_is_refused_with_its_reason(
    tmp_path: Path, section: str, changes: list[tuple[str, str]], reason: str
) -> None:
    with pytest.raises(ConfigError, match=reason):
        table(tmp_path, section, *changes)


ARM = """
[axis.x.measured_plant]
mass_kg = 70.0
scale_mass_kg = 70.0
delay_ms = 0.1
mode_hz = [40.4]
mode_damping_ratio = [0.006]
mode_motor_1_kg = [0.0003]
mode_scale_1_kg = [-0.0130]
"""


def test_a_measured_resonance_is_in_the_margin(tmp_path: Path) -> None:
    """An arm on the scale, as on the precision stage: 55 1/s would be accepted on the masses."""
    section = 'axes = ["x", "y"]\nkp_1_s = 55.0'
    with pytest.raises(ConfigError, match=r"unstable on the measured plant of x and the mass of y$"):
        table(tmp_path, section + ARM)
    rigid = ARM.replace("[40.4]", "[]").replace("[0.006]", "[]")
    rigid = rigid.replace("[0.0003]", "[]").replace("[-0.0130]", "[]")
    own = rigid.replace("delay_ms = 0.1", "delay_ms = 0.0")
    machine = table(tmp_path, section + own)
    assert machine.contour_control is not None
    found = sensitivity_peak_of(machine, machine.contour_control)
    plain = sensitivity_peak_of(table(tmp_path, section), machine.contour_control)
    assert found == pytest.approx(plain, rel=1e-3)
    later = own.replace("delay_ms = 0.0", "delay_ms = 0.5").replace("axis.x", "axis.y")
    with pytest.raises(ConfigError, match=r"above 2, on their measured plants$"):
        table(tmp_path, section + own + later)


def test_a_structure_that_the_file_names_and_nobody_measured_is_named(tmp_path: Path) -> None:
    shaper = "\n[axis.y.input_shaper]\nfrequency_hz = 38.0\n"
    reason = (
        r"on their masses, without the structure at 38 Hz of axis y \(input_shaper\), which is not measured$"
    )
    with pytest.raises(ConfigError, match=reason):
        table(tmp_path, 'axes = ["x", "y"]\nkp_1_s = 57.0' + shaper)


SECTION = 'axes = ["x", "y"]\nkp_1_s = 20.0\n'
MEASURED = """
[axis.{axis}.measured_plant]
mass_kg = 80.0
scale_mass_kg = 80.0
"""


@pytest.mark.parametrize(
    ("sections", "plants", "rigid"),
    [
        ("", "their masses", "x, y"),
        (MEASURED.format(axis="y"), "the measured plant of y and the mass of x", "x"),
        (
            "[axis.y.input_shaper]\nfrequency_hz = 38.0\n",
            "their masses, without the structure at 38 Hz of axis y (input_shaper), which is not measured",
            "x, y",
        ),
    ],
)
def test_a_gain_that_was_accepted_on_masses_is_noted_with_what_to_do(
    tmp_path: Path, sections: str, plants: str, rigid: str
) -> None:
    assert contour_note(table(tmp_path, SECTION + sections)) == (
        f"contour_control: kp_1_s was accepted on {plants}; "
        f"the margin lacks resonances and delay of {rigid}: "
        "servo-ctrl tune --axis NAME --apply measures them"
    )


def test_no_note_where_nothing_is_coupled_or_all_is_measured(tmp_path: Path) -> None:
    assert contour_note(load_machine(XY_TABLE)) == ""
    assert contour_note(table(tmp_path, f"enabled = false\n{SECTION}")) == ""
    assert (
        contour_note(table(tmp_path, SECTION + MEASURED.format(axis="x") + MEASURED.format(axis="y"))) == ""
    )


def test_an_axis_that_is_unstable_alone_is_refused_with_any_coupling(tmp_path: Path) -> None:
    """Far too much gain: |1 / (1 + L)| is small everywhere, and only the turns round 0 tell."""
    section = 'axes = ["x", "y"]\nkp_1_s = 1.0'
    with pytest.raises(ConfigError, match="the two axes are unstable on their masses"):
        table(tmp_path, section, ("kv_n_s_m = 14700.0", "kv_n_s_m = 1.0e6"))


def test_a_measured_plant_has_one_value_for_each_mode(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="mode_scale_1_kg: 0 values for 1 modes in mode_hz"):
        table(tmp_path, 'axes = ["x", "y"]\nkp_1_s = 9.0' + ARM.replace("[-0.0130]", "[]"))
