"""Decide which concealed effects are observable: by the sensors, their size, and the motions.

The rule, whatever any tool finds:

1. The sensors are there: what shows between motor and scale only needs a scale; what happens between
   command and current needs the command as the recorded force.
2. It is large enough. Let c be what the effect contributes to the difference (force, or scale less motor)
   behind a low pass of 40 Hz, as far as mass, viscous friction, Coulomb friction and timing cannot explain
   it, and f the RMS of the residual with all effects known. Then either the RMS of c is 0.5 f or more,
   or that of its strongest twentieth is 3 f or more; and c holds at least 2 % of the square of all that a
   fitted nominal model leaves, the other concealed effects known.
3. The motion separates it from its look-alike: `NEEDS`.

A lag that a delay of the command would imitate to within half the noise, or the other way round, is of one
class with it.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, sosfiltfilt

from tests.campaigns.blind.arrays import Array
from tests.campaigns.blind.axis.record import AT
from tests.campaigns.blind.case import Case, Planted, SimulatedRecording
from tests.campaigns.blind.contributions import deviation_m, force_n, known_force_n
from tests.campaigns.blind.effects import COMMAND_ONLY
from tests.campaigns.blind.nominal import CORNER_HZ, EDGE_S, smooth

LEAST_RMS, LEAST_PEAK, LEAST_SHARE = 0.5, 3.0, 0.02
"""Bound from below the RMS of an effect and of its strongest part over the residual's, and its share of
the squares; chosen."""
STRONGEST = 0.05
"""Share of the samples in the strongest part; chosen."""
LOOK_ALIKE = {"current_loop_lag": "transport_delay", "transport_delay": "current_loop_lag"}
"""Effects of one class where the other imitates them within the noise."""
CLUTTER = {"presliding_hysteresis": ("presliding",), "cogging": ("clutter",)}
"""Effects that every axis has, by name: their causes."""


def judged(case: Case, recordings: Sequence[SimulatedRecording]) -> dict[str, dict[str, object]]:
    """Return for each concealed effect: observable, why not, its RMS and the noise's (N or m), its share."""
    return {effect.name: _judge(case, effect, recordings) for effect in case.planted}


def clutter(case: Case, recordings: Sequence[SimulatedRecording]) -> dict[str, float]:
    """Return the RMS (N) of the effects that every axis has, measured as the concealed ones, by name."""
    return {
        name: _rms(_sizes(case, Planted(name, {}, causes), recordings)[0]) for name, causes in CLUTTER.items()
    }


def _judge(case: Case, effect: Planted, recordings: Sequence[SimulatedRecording]) -> dict[str, object]:
    if effect.deviation and not case.sensing.has_scale:
        return _statement(why="no scale")
    inner = effect.name in COMMAND_ONLY or "delay" in effect.causes
    if inner and not case.sensing.is_command:
        return _statement(why="the recorded force is the current")
    own, floor, share = _sizes(case, effect, recordings)
    strongest = np.sort(np.abs(own))[-max(round(STRONGEST * len(own)), 1) :]
    rms, peak = _rms(own), _rms(strongest)
    why = ""
    if rms < LEAST_RMS * floor and peak < LEAST_PEAK * floor:
        why = "smaller than the noise"
    elif share < LEAST_SHARE:
        why = "a small share of what is unexplained"
    elif effect.name in NEEDS:
        why = NEEDS[effect.name](case, recordings)
    statement = _statement(why=why, rms=rms, floor=floor, share=share)
    if effect.name in LOOK_ALIKE and _imitated(effect, recordings, floor):
        statement["alike"] = [LOOK_ALIKE[effect.name]]
    return statement


def _imitated(effect: Planted, recordings: Sequence[SimulatedRecording], floor: float) -> bool:
    """Whether the best lag imitates a delay to within the noise, or the best delay a lag."""
    best = math.inf
    for time_s in np.geomspace(0.4, 2.5, 15) * effect.parameters["time_s"]:
        pairs = [_against(effect, one, float(time_s)) for one in recordings]
        y, base = (np.concatenate(same) for same in zip(*pairs, strict=True))
        best = min(best, _rms(_residual(y, base)))
    return best < LEAST_RMS * floor


def _against(effect: Planted, recording: SimulatedRecording, time_s: float) -> tuple[Array, Array]:
    """Return the effect's force, and the model's columns with its look-alike of this time constant."""
    x, v, a, _ = _smooth(recording)
    command = recording.inside[:, AT["command_n"]]
    own = {name.removeprefix("x."): values for name, values in recording.columns.items()}
    period_s = float(own["time_s"][1] - own["time_s"][0])
    stamps = own["time_s"]
    if effect.name == "current_loop_lag":
        other = command - np.interp(stamps - time_s, stamps, command)
    else:
        keep = math.exp(-period_s / time_s)
        other = command - lfilter([1.0 - keep], [1.0, -keep], command)
    low_pass = butter(2, CORNER_HZ * 2.0 * period_s, output="sos")
    mine = sum(recording.inside[:, AT[cause]] for cause in effect.causes) + np.zeros(len(x))
    direction = np.sign(recording.inside[:, AT["velocity_m_s"]])
    mine, other, direction = sosfiltfilt(low_pass, np.stack((mine, other, direction)))
    use = np.abs(v) > 0.002 * np.abs(v).max()
    edge = round(EDGE_S / period_s)
    use[:edge] = use[-edge:] = False
    return mine[use], np.stack((a, v, direction, other), axis=1)[use]


def _statement(
    *, why: str, rms: float | None = None, floor: float | None = None, share: float | None = None
) -> dict[str, object]:
    return {"observable": not why, "why_not": why, "rms": rms, "floor": floor, "share": share}


def _sizes(
    case: Case, effect: Planted, recordings: Sequence[SimulatedRecording]
) -> tuple[Array, float, float]:
    """Return the effect's independent part (n,), the RMS residual with all effects known, and its share."""
    side = _deviation if effect.deviation else _force
    parts = [side(case, effect, one) for one in recordings]
    y, own, others, known, base = (np.concatenate(same) for same in zip(*parts, strict=True))
    floor = _residual(y - known, base)
    # an effect on the timing is not explained by the timing column
    free = base[:, :-1] if effect.name in COMMAND_ONLY or "delay" in effect.causes else base
    before, mine = _residual(y - others, free), _residual(own, free)
    return mine, _rms(floor), float(np.sum(mine**2) / np.sum(before**2))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _residual(y: Array, base: Array) -> Array:
    theta, *_ = np.linalg.lstsq(base, y, rcond=None)
    residual: Array = y - base @ theta
    return residual


def _force(case: Case, effect: Planted, recording: SimulatedRecording) -> tuple[Array, ...]:
    x, v, a, force = _smooth(recording)
    own = _low_pass(case, force_n(case, effect, recording.inside))
    beside = [force_n(case, one, recording.inside) for one in case.planted if one.name != effect.name]
    others = _low_pass(case, sum(beside) + np.zeros(len(x)))
    known = _low_pass(case, known_force_n(case, recording.inside))
    direction = _low_pass(case, np.sign(recording.inside[:, AT["velocity_m_s"]]))
    use = _inner(case, x) & (np.abs(v) > 0.002 * np.abs(v).max())
    base = np.stack((a, v, direction, np.gradient(force)), axis=1)
    return force[use], own[use], others[use], known[use], base[use]


def _deviation(case: Case, effect: Planted, recording: SimulatedRecording) -> tuple[Array, ...]:
    own = {name.removeprefix("x."): values for name, values in recording.columns.items()}
    y = _low_pass(case, own["scale_position_m"] - own["motor_position_m"])
    x, v, _, _ = _smooth(recording)
    known = _low_pass(case, sum(deviation_m(case, one, recording) for one in case.planted) + np.zeros(len(x)))
    mine = _low_pass(case, deviation_m(case, effect, recording))
    use = _inner(case, x)
    # the origin is free in each recording
    level = [(values - values[use].mean())[use] for values in (y, mine, known - mine, known)]
    return *level, np.stack((v, np.gradient(v)), axis=1)[use]


def _smooth(recording: SimulatedRecording) -> tuple[Array, Array, Array, Array]:
    own = {name.removeprefix("x."): values for name, values in recording.columns.items()}
    return smooth(own["time_s"], own["motor_position_m"], own["motor_force_n"])


def _low_pass(case: Case, values: Array) -> Array:
    filtered: Array = sosfiltfilt(butter(2, CORNER_HZ * 2.0 * case.sensing.period_s, output="sos"), values)
    return filtered


def _inner(case: Case, x: Array) -> NDArray[np.bool_]:
    use = np.ones(len(x), dtype=np.bool_)
    edge = round(EDGE_S / case.sensing.period_s)
    use[:edge] = use[-edge:] = False
    return use


def _speeds(recordings: Sequence[SimulatedRecording]) -> Array:
    return np.concatenate([np.abs(one.inside[:, AT["velocity_m_s"]]) for one in recordings])


def _stribeck(case: Case, recordings: Sequence[SimulatedRecording]) -> str:
    v, speed = _speeds(recordings), case.plant.stribeck_m_s
    moving = v > 0.05 * speed
    slow = np.mean(v[moving] < speed)
    steady = sum(one.motion == "current_loop" for one in case.runs)
    return "" if slow > 0.02 and steady else "no slow constant speeds"


def _dwell(case: Case, recordings: Sequence[SimulatedRecording]) -> str:
    rests: list[float] = []
    for one in recordings:
        still = np.abs(one.inside[:, AT["velocity_m_s"]]) < 2e-5
        edges = np.flatnonzero(np.diff(still.astype(np.int8), prepend=0, append=0))
        rests += [float(b - a) * case.sensing.period_s for a, b in zip(edges[::2], edges[1::2], strict=True)]
    long = [rest for rest in rests if rest > 0.05]
    return "" if len(long) >= 6 and max(long) > 4.0 * min(long) else "no rests of different lengths"


def _ripple(case: Case, recordings: Sequence[SimulatedRecording]) -> str:
    force = np.abs(np.concatenate([one.inside[:, AT["current_n"]] for one in recordings]))
    return "" if force.std() > 0.3 * force.mean() else "the force hardly changes"


NEEDS: dict[str, Callable[[Case, Sequence[SimulatedRecording]], str]] = {
    "stribeck_friction": _stribeck,
    "dwell_dependent_breakaway": _dwell,
    "torque_ripple": _ripple,
}
"""Why the motions cannot separate an effect from its look-alike; empty where they can."""
