"""Programs of next experiments, as servo_ctrl reads and checks them."""

from pathlib import Path

import numpy as np
import pytest
from concealed_machine import PERIOD_S, motion, write_machine

from reconcile.design.candidate_motions import candidate_motions
from reconcile.design.limits import limits_from_machine
from reconcile.design.program import program_steps, write_program
from reconcile.nominal_model.model_file import load_model
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program import check_program, program_segments


@pytest.fixture
def machine_dir(tmp_path: Path) -> Path:
    return write_machine(tmp_path / "machine", {"x": ""}, motion()[:, None])


def test_every_motion_of_the_pool_is_a_program_that_servo_ctrl_accepts(machine_dir: Path) -> None:
    """Its set points are the evaluated samples, up to the jerk that the machine has in reserve."""
    machine = load_machine(machine_dir)
    limits = limits_from_machine(machine, "x", load_model(machine_dir).axes["x"])
    motions = candidate_motions(limits, PERIOD_S, 1e-5, 1e-7)
    assert len(motions) > 20
    for one in motions:
        file = write_program(program_steps("x", one.motion.steps), one.motion.words, machine_dir)
        assert file is not None
        program = load_program(file, machine)
        steps = check_program(program, machine)
        parts = list(program_segments(steps, machine, np.zeros(1)))
        position_m = np.concatenate([part.position_m[:, 0] for part in parts])
        assert position_m[-1] == pytest.approx(limits.home_m, abs=1e-8)
        assert np.ptp(position_m) == pytest.approx(np.ptp(one.position_m), rel=1e-3, abs=1e-8)
        assert len(position_m) == pytest.approx(len(one.position_m), rel=0.05)


def test_limits_leave_a_margin_and_as_much_force_as_there_is(machine_dir: Path) -> None:
    machine = load_machine(machine_dir)
    model = load_model(machine_dir).axes["x"]
    limits = limits_from_machine(machine, "x", model)
    assert (limits.min_position_m, limits.max_position_m) == pytest.approx((-0.045, 0.045))
    assert limits.velocity_m_s == pytest.approx(0.18)
    assert limits.acceleration_m_s2 == pytest.approx(1.8)
    heavy = limits_from_machine(machine, "x", model._replace(mass_kg=1000.0))
    force_n = 1000.0 * heavy.acceleration_m_s2 + model.coulomb_n + model.viscous_n_s_m * heavy.velocity_m_s
    assert force_n == pytest.approx(0.7 * 600.0)
