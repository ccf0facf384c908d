"""Robust loops published for feed drives, expressed as gains of the control law of the tick.

Adaptive sliding mode (Altintas, Erkorkmaz, Zhu 2000), with S = de/dt + lambda e and its adaptation for the
disturbance:

    u = M (a* + lambda de/dt) + K S + d,    dd/dt = rho S

It is linear: a proportional-integral-derivative law of e. It equals our law with D = kv, P = kv kp + ki and
I = ki kp, wherever these have a real kp.

Linear active disturbance rejection (Gao 2003) with a reduced-order extended state observer, because the
velocity is measured: u = M (a* + 2 w_c de/dt + w_c^2 e) - d, d of first order with w_o. It equals our law
with kv = 2 w_c M, kp = w_c / 2, ki = 0 and our disturbance observer at w_o.
"""

import math
from collections.abc import Callable, Iterator

import numpy as np

from servo_ctrl.control.section import filter_blend
from servo_ctrl.control.tick import AxisParams
from studies.feng_2015.rival_tuning import Setting, Tuner

LAMBDAS_1_S = (45.0, 65.0, 90.0, 130.0, 190.0)
"""Tried values of lambda; chosen."""
ADAPTATIONS = (0.1, 0.2, 0.3, 0.45)
"""Tried values of rho, as a share of K lambda; chosen."""
OBSERVER_RATIOS = (0.5, 1.0, 2.0, 3.0, 5.0)
"""Tried values of w_o over w_c; chosen."""
FASTEST_1_S, SPEEDS = (40.0, 600.0), 60
"""Values of K / M, or of w_c, that are tried; the largest allowed one counts. All of these chosen."""


def with_bandwidth(params: AxisParams, bandwidth_hz: float) -> AxisParams:
    """Return the parameters with the disturbance observer at this bandwidth."""
    blend = filter_blend(1.0 / (2.0 * math.pi * bandwidth_hz), params.period_s)
    return params._replace(observer=params.observer._replace(enabled=True, filter_blend=blend))


def sliding_mode(tuner: Tuner) -> list[Setting]:
    """Return a setting for each lambda and share of adaptation, with the largest allowed K."""
    found = []
    for lambda_1_s in LAMBDAS_1_S:
        for share in ADAPTATIONS:

            def law(rate_1_s: float, slope: float = lambda_1_s, part: float = share) -> AxisParams | None:
                return sliding_mode_params(tuner.params, slope, rate_1_s, part * rate_1_s * slope)

            for rate_1_s, params in _fastest(tuner, law):
                described = {"lambda_1_s": lambda_1_s, "K_1_s": rate_1_s, "adaptation_share": share}
                found.append(Setting(described, params))
    return found


def sliding_mode_params(
    params: AxisParams, lambda_1_s: float, rate_1_s: float, adaptation_1_s2: float
) -> AxisParams | None:
    """Return the law with K = `rate_1_s` M and rho = `adaptation_1_s2` M; None where no real gains exist."""
    mass_kg = params.feedforward.acceleration_kg
    d = mass_kg * (lambda_1_s + rate_1_s)
    p = mass_kg * (rate_1_s * lambda_1_s + adaptation_1_s2)
    i = mass_kg * adaptation_1_s2 * lambda_1_s
    square = p * p - 4.0 * d * i
    if square < 0.0:
        return None
    kp_1_s = (p + math.sqrt(square)) / (2.0 * d)
    return _with_gains(params, kp_1_s, d, p - d * kp_1_s)


def disturbance_rejection(tuner: Tuner) -> list[Setting]:
    """Return a setting for each ratio of bandwidths, with the fastest allowed loop."""
    found = []
    for ratio in OBSERVER_RATIOS:

        def law(rate_1_s: float, times: float = ratio) -> AxisParams | None:
            return disturbance_rejection_params(tuner.params, rate_1_s, times * rate_1_s)

        for rate_1_s, params in _fastest(tuner, law):
            found.append(Setting({"w_c_1_s": rate_1_s, "w_o_1_s": ratio * rate_1_s}, params))
    return found


def disturbance_rejection_params(params: AxisParams, w_c_1_s: float, w_o_1_s: float) -> AxisParams:
    """Return the law with these bandwidths, rad/s."""
    mass_kg = params.feedforward.acceleration_kg
    loop = _with_gains(params, 0.5 * w_c_1_s, 2.0 * w_c_1_s * mass_kg, 0.0)
    return with_bandwidth(loop, w_o_1_s / (2.0 * math.pi))


def _with_gains(params: AxisParams, kp_1_s: float, kv_n_s_m: float, ki_n_m: float) -> AxisParams:
    return params._replace(
        position_loop=params.position_loop._replace(kp_1_s=kp_1_s),
        velocity_loop=params.velocity_loop._replace(kv_n_s_m=kv_n_s_m, ki_n_m=ki_n_m),
    )


def _fastest(tuner: Tuner, law: Callable[[float], AxisParams | None]) -> Iterator[tuple[float, AxisParams]]:
    """Yield the largest rate whose loop is allowed, if there is one.

    It searches from slow to fast, because Ms of a loop that is far too fast can be as small as that of a
    good one.
    """
    best = None
    for rate_1_s in np.geomspace(*FASTEST_1_S, SPEEDS).tolist():
        params = law(rate_1_s)
        allowed = params is not None and tuner.allows(params)
        if params is not None and allowed:
            best = rate_1_s, params
        elif best is not None:
            break
    if best is not None:
        yield best
