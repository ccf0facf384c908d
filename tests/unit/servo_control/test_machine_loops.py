"""The machines' loops: EMPS against its published law, and daemon and twin bit for bit."""

import math
from pathlib import Path

import numba
import numpy as np

from kernels.arrays import Array
from kernels.jit import signatures
from servo_ctrl.config.kernel_params import axis_params, with_observer, with_pulse
from servo_ctrl.config.load import load_machine
from servo_ctrl.control.tick import AxisParams, AxisState, axis_tick, initial_state
from servo_ctrl.control.types import AxisSample

T = 1e-3


@numba.njit
def batch(p: AxisParams, state: AxisState, samples: Array, force: Array, velocity: Array) -> AxisState:
    # the twin's driver: the same kernel inside another
    for k in range(len(samples)):
        s = samples[k]
        state, command = axis_tick(p, state, AxisSample(s[0], s[1], s[2], s[3], s[4], s[5], s[6], 0.0))
        force[k] = command.force_n
        velocity[k] = command.motor_velocity_m_s
    return state


def test_emps_law_equals_its_published_form(machines: Path) -> None:
    # u = kp kv (qg - q) - kv dq, dq the difference of the two-tap average, +-10 V; in numpy, at once
    rng = np.random.default_rng(2)
    n = 2000
    qg = np.cumsum(rng.normal(0.0, 5e-5, n))
    q = qg + rng.normal(0.0, 2e-4, n)
    q[:2] = q[0]
    averaged = np.convolve(np.concatenate(([q[0]], q)), [0.5, 0.5], "valid")
    dq = np.diff(averaged, prepend=averaged[0]) / T
    volts = np.clip(160.18 * 243.45 * (qg - q) - 243.45 * dq, -10.0, 10.0)

    p = axis_params(load_machine(machines / "emps"), "x")
    state, force = initial_state(q[0]), []
    for k in range(n):
        state, command = axis_tick(
            p, state, AxisSample(float(qg[k]), 0.0, 0.0, 0.0, float(q[k]), math.nan, math.nan)
        )
        force.append(command.force_n)
    assert np.ptp(volts) == 20.0
    np.testing.assert_allclose(force, 35.1507 * volts, rtol=1e-8, atol=1e-8)


def test_python_and_batch_give_the_same_bits_from_one_compiled_signature(machines: Path) -> None:
    learned = np.array([[1e-3], [0.02], [1e-3], [0.01], [0.02], [-5e-4]])
    p = with_observer(
        with_pulse(axis_params(load_machine(machines / "xy_table"), "x"), learned), enabled=True
    )
    rng = np.random.default_rng(3)
    samples = np.cumsum(rng.normal(0.0, 1e-5, (500, 7)), axis=0)
    samples[100:103, 4] = np.nan
    force, velocity = np.empty(500), np.empty(500)
    last = batch(p, initial_state(samples[0, 4]), samples, force, velocity)

    state = initial_state(samples[0, 4])
    for k, row in enumerate(samples):
        state, command = axis_tick(p, state, AxisSample(*row.tolist()))
        assert command.force_n == force[k]
        assert command.motor_velocity_m_s == velocity[k]
    assert state == AxisState(*last)
    assert signatures(axis_tick) == 1
