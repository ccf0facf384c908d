"""Draw a linear motor's axis and its recordings at 2 kHz, with the command or the current as the force."""

from collections.abc import Sequence

import numpy as np
from scipy.signal import butter, sosfilt

from tests.campaigns.blind.families.interface import Array, Case, Channels, Nominal, plan, sheet
from tests.campaigns.blind.families.linear_motor import paths
from tests.campaigns.blind.families.linear_motor.hidden import COMMAND_ONLY, EXCLUSIVE, NAMES, effect, sizes
from tests.campaigns.blind.families.linear_motor.slide import Servo, Slide, run

RATE_HZ = 2000.0
MOVES = 90
"""More than fill the longest recording."""


def draw(seed: int, kind: str | None = None, names: Sequence[str] | None = None) -> Case:
    """Draw the case of a seed; `kind` and `names` in place of what the seed would conceal."""
    rng = np.random.default_rng([3301, seed])
    kind, drawn = plan(rng, NAMES, EXCLUSIVE, kind)
    names = drawn if names is None else names
    mass, coulomb, viscous = rng.uniform(3.0, 40.0), rng.uniform(2.0, 14.0), rng.uniform(4.0, 60.0)
    travel, fastest, acceleration = rng.uniform(0.15, 0.6), rng.uniform(0.3, 1.2), rng.uniform(3.0, 12.0)
    base = Slide(
        mass_kg=mass, viscous=viscous, coulomb_n=coulomb, pair_m=float(rng.choice([0.024, 0.032, 0.06])),
        phase=rng.uniform(0.0, 6.0),
    )  # fmt: skip
    fields = sizes(base, rng, travel, fastest, mass * acceleration + coulomb)
    omega = 2.0 * np.pi * rng.uniform(9.0, 16.0)
    servo = Servo(
        mass * omega**2 * 1.5, mass * omega**3 * 0.4, 2.0 * mass * omega, 6e-4, 0.95 * mass, viscous
    )
    takes_command = any(name in COMMAND_ONLY for name in names) or rng.random() < 0.4
    shape = [paths.scans, paths.fields, paths.steps]
    chosen = [paths.scans, *(shape[int(k)] for k in rng.permutation(3)[: int(rng.integers(1, 3))])]
    seconds = rng.uniform(10.0, 14.0, len(chosen))
    # four errors of the fringes, and the pitch of the grating (Heydemann 1981)
    quadrature = np.array(
        [float(rng.choice([2e-5, 4e-5])), *(rng.normal(size=4) * [0.004, 0.004, 0.006, 0.005])]
    )

    def simulate(acting: frozenset[str], noisy: bool, foreign: Sequence[Array] | None) -> list[Channels]:
        slide = base
        for name in names:
            if name in acting:
                slide = slide._replace(**fields[name])
        made: list[Channels] = []
        for k, path in enumerate(chosen):
            mine = np.random.default_rng([3302, seed, k])
            ends, speeds, rests = path(mine, travel, fastest, MOVES)
            n = int(seconds[k] * RATE_HZ)
            wanted = paths.limited(ends, speeds, rests, acceleration, 12.0 * acceleration, 1.0 / RATE_HZ)[:n]
            rattle = _noise(mine, len(wanted), coulomb)
            outer = rattle[:, 2] * noisy + (0.0 if foreign is None else foreign[k])
            rows = run(
                slide, servo, np.ascontiguousarray(wanted), 1.0 / RATE_HZ, rattle, outer, quadrature, noisy
            )
            time = np.arange(len(wanted)) / RATE_HZ
            made.append(
                {
                    "time": time,
                    "motor": rows[:, 0],
                    "force": rows[:, 1 if takes_command else 2],
                    "command": np.array(wanted[:, 0]),
                }
            )
        return made

    true = Nominal(mass, viscous, coulomb, float(quadrature[0]) / 4096.0, lead_m=base.pair_m)
    hidden = tuple(effect(name, fields[name], 1.0 / RATE_HZ) for name in names)
    return Case("linear_motor", seed, kind, sheet(rng, true), true, hidden, simulate, ("scale_cyclic_error",))


def _noise(mine: np.random.Generator, n: int, coulomb: float) -> Array:
    """Return noise (n, 3): jitter of the encoder, a band of the converter's, the floor's shaking."""
    band = sosfilt(butter(2, [170.0, 230.0], btype="bandpass", fs=RATE_HZ, output="sos"), mine.normal(size=n))
    slow = sosfilt(butter(1, 4.0, fs=RATE_HZ, output="sos"), mine.normal(size=n))
    force = 0.15 * coulomb * band + 0.25 * coulomb * slow + 0.01 * coulomb * mine.standard_t(4.0, n)
    shaking = (
        0.6
        * coulomb
        * sosfilt(butter(1, [0.5, 12.0], btype="bandpass", fs=RATE_HZ, output="sos"), mine.normal(size=n))
    )
    return np.stack((mine.normal(size=n) * 2e-9, force, shaking), axis=1)
