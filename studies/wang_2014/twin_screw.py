"""Learns the screw table in the batch twin, by the learning travels of the daemon."""

import numpy as np

from servo_ctrl.config.kernel_params import with_sampled_dual_loop, with_screw
from servo_ctrl.config.learning import screw_settings, screw_steps
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import program_segments
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.learning.screw import ScrewLearned, ScrewRun
from servo_ctrl.learning.screw_travel import deviations_m, passes_of
from studies.twin_axis import set_points
from twin.axis_rollout import AxisRollout


def learn_screw(machine: MachineConfig, name: str, axis: AxisRollout, params: AxisParams) -> ScrewLearned:
    """Run all learning travels of one axis from home. Raises ValueError where they cannot be used."""
    settings = screw_settings(machine, name)
    run, column = ScrewRun(settings), list(machine.axes).index(name)
    start_m = [0.0] * len(machine.axes)
    while (travel := run.stroke) is not None:
        with_table = with_screw(params, travel.table, travel.lost_motion_m)
        axis.change_params(with_sampled_dual_loop(with_table, enabled=False))
        rows = []
        for segment in program_segments(screw_steps(machine, name, start_m), machine, start_m):
            rows.append(axis.rows(set_points(segment, column)))
            start_m = segment.position_m[-1].tolist()
        recorded = np.concatenate(rows)
        up, down = passes_of(
            recorded["position_command_m"],
            recorded["correction_m"],
            recorded["motor_position_m"],
            recorded["scale_position_m"],
            settings,
        )
        run.take(deviations_m(up, down, settings))
    if run.learned is None:
        raise RuntimeError("learning ended without a result")
    return run.learned
