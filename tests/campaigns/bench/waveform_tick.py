"""What a learned waveform costs a tick: `python -m tests.campaigns.bench.waveform_tick`.

The compiled tick of one axis alone, in blocks of the same set points in turn: nothing learned, a learned
waveform on a motion that remembers one reversal, and on one that remembers five. Then a waveform without and
with rests, on motions that are all within the way over which a rest acts. Processor time.
"""

import time
from pathlib import Path
from statistics import median

import numpy as np

from kernels.arrays import Array
from kernels.jit import uncached_kernel
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.control.tick import AxisParams, AxisState, axis_tick, initial_state
from servo_ctrl.control.types import AxisSample
from servo_ctrl.learning.rest_force import NODES
from servo_ctrl.learning.reversal_waveform import RestForce
from studies.feng_2015.waveform_learning import learn_waveforms, with_learned
from twin.plant_file import load_plant

MACHINE = Path(__file__).parents[3] / "machines" / "xy_table"
ROUNDS, REPEATS = 60, 20
"""Blocks of each kind, and how often a block runs its motion; chosen: 0.1 s a block."""
PERIOD_S = 1e-3
LONG_M = (5e-3, -5e-3)
SHORT_M = (5e-3, -160e-6, 130e-6, -100e-6, 75e-6, -50e-6, 25e-6, -20e-6 - 4.9e-3)
WITHIN_M = (0.8e-3, -0.8e-3)
"""Ways from reversal to reversal: far apart, and loops one within the other; within
a rest's way; each ends where it began."""


@uncached_kernel
def ticks(params: AxisParams, state: AxisState, commands: Array) -> AxisState:
    """Run the tick along set points (n, 3): position m, velocity m/s, acceleration m/s^2."""
    for row in range(commands.shape[0]):
        position_m, velocity_m_s, acceleration_m_s2 = commands[row, 0], commands[row, 1], commands[row, 2]
        sample = AxisSample(
            position_m, velocity_m_s, acceleration_m_s2, 0.0, position_m, position_m, 0.0, 0.0
        )
        state = axis_tick(params, state, sample)[0]
    return state


def there_and_back(ways_m: tuple[float, ...]) -> Array:
    """Return set points (n, 3) of motions of half a cosine, 0.2 s each."""
    angle = np.pi * np.arange(1, 201) / 200.0
    rate = np.pi / (200.0 * PERIOD_S)
    parts, begin_m = [], 0.0
    for way_m in ways_m:
        half_m = 0.5 * way_m
        shape = (1.0 - np.cos(angle), rate * np.sin(angle), rate**2 * np.cos(angle))
        part = half_m * np.column_stack(shape)
        part[:, 0] += begin_m
        parts.append(part)
        begin_m += way_m
    return np.concatenate(parts)


def behind_rests(commands: Array) -> Array:
    """Return set points (n, 3) with a rest before each motion of `there_and_back`."""
    motions = commands.reshape(-1, 200, 3)
    rests = np.zeros((len(motions), 50, 3))
    rests[:, :, 0] = np.roll(motions[:, -1:, 0], 1, axis=0)
    return np.concatenate([rests, motions], axis=1).reshape(-1, 3)


def block_ns(params: AxisParams, commands: Array) -> float:
    """Return nanoseconds a tick of one block."""
    state = initial_state(0.0)
    begun_ns = time.process_time_ns()
    for _ in range(REPEATS):
        state = ticks(params, state, commands)
    return (time.process_time_ns() - begun_ns) / (REPEATS * len(commands))


def compare(name: str, one: AxisParams, other: AxisParams, commands: Array) -> None:
    """Measure blocks of both in turn; print medians and the ratio of neighbours."""
    for params in (one, other):
        block_ns(params, commands)  # compiled
    blocks = [(block_ns(one, commands), block_ns(other, commands)) for _ in range(ROUNDS)]
    one_ns, other_ns = (median(values) for values in zip(*blocks, strict=True))
    ratio = median(second_ns / first_ns for first_ns, second_ns in blocks)
    print(f"{name}: {one_ns:.0f} and {other_ns:.0f} ns a tick, ratio {ratio:.2f}")


def main() -> None:
    """Measure, and print medians and ratios of neighbouring blocks."""
    machine = load_machine(MACHINE)
    plain = axis_params(machine, "x")
    learned = learn_waveforms(machine, load_plant(MACHINE), "x").learned
    acting = with_learned(plain, learned)
    for name, ways_m in (("one reversal", LONG_M), ("five reversals", SHORT_M)):
        commands = np.tile(there_and_back(ways_m), (8 // len(ways_m), 1))
        compare(f"{name}, nothing and LWC", plain, acting, commands)
    force_n = tuple(np.linspace(1.0, 0.0, NODES).tolist())
    rests = tuple(RestForce(rest_s, force_n, force_n) for rest_s in (0.02, 0.1, 1.0))
    commands = np.tile(behind_rests(there_and_back(WITHIN_M)), (4, 1))
    compare(
        "behind rests, LWC without and with them",
        acting,
        with_learned(plain, learned._replace(rests=rests)),
        commands,
    )


if __name__ == "__main__":
    main()
