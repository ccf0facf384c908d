"""Fuzzy-PD position law: PD for large errors, a fuzzy controller for small ones (Xia et al., section III).

    v = v_PD                        |e| >= e2
    v = a v_PD + (1 - a) v_FZ       e1 < |e| < e2        (10), a of (11)
    v = v_FZ + ki int e dt          |e| <= e1            (12), (16)
    v_FZ = Ku mu(Ke e, Kec de/dt)                        (14), (15), Table I

mu is interpolated bilinearly on the surface of `fuzzy_inference`.
"""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from kernels.jit import kernel
from kernels.quantities import Quantity
from kernels.record_layout import Table
from servo_ctrl.control.compensation.fuzzy_inference import SURFACE_POINTS, surface
from servo_ctrl.control.section import AxisFacts, Key, LawSection, Need
from servo_ctrl.units import MM, UM


@dataclass(frozen=True, kw_only=True)
class FuzzyPdSettings:
    """Fuzzy-PD in place of the position loop's PID law (Xia et al.); kp_1_s and kd are its PD part."""

    enabled: Annotated[bool, Key("Whether it acts; else the PID law does.")] = True
    fine_um: Annotated[
        float,
        Key("e1: up to this error the fuzzy controller is alone, with its integral, micrometres.", above=0.0),
    ]
    coarse_um: Annotated[float, Key("e2: from this error on the PD law is alone, micrometres.", above=0.0)]
    weight_1_mm: Annotated[
        float, Key("k_e of the exponential weighting between e1 and e2, 1/mm; small = linear.", at_least=1e-6)
    ] = 1.0
    error_gain_1_mm: Annotated[float, Key("Ke: an error of 1 / Ke is positive big, 1/mm.", above=0.0)]
    change_gain_s_mm: Annotated[
        float, Key("Kec: a change of the error of 1 / Kec is positive big, s/mm.", at_least=0.0)
    ]
    output_mm_s: Annotated[float, Key("Ku: velocity set point of the largest output, mm/s.", above=0.0)]
    ki_1_s2: Annotated[float, Key("k_i: integral gain within e1, 1/s^2.", at_least=0.0)] = 0.0


class Params(NamedTuple):
    """Regions of the error, and the gains of the inputs and the output of the rules."""

    enabled: bool
    fine_m: Annotated[float, Quantity("m", 0.0, math.inf, "e1 > 0: the fuzzy controller is alone up to it")]
    coarse_m: Annotated[float, Quantity("m", 0.0, math.inf, "e2 > e1: the PD law is alone from it on")]
    weight_1_m: Annotated[float, Quantity("1/m", 0.0, math.inf, "k_e > 0 of the weighting between them")]
    error_1_m: Annotated[float, Quantity("1/m", 0.0, math.inf, "Ke: 1 / Ke is positive big")]
    change_s_m: Annotated[float, Quantity("s/m", 0.0, math.inf, "Kec, for the change of the error")]
    output_m_s: Annotated[float, Quantity("m/s", 0.0, math.inf, "Ku: velocity of the surface's 1")]
    ki_1_s2: Annotated[float, Quantity("1/s2", 0.0, math.inf, "integral gain within e1")]
    surface: Table
    """(n, n), n >= 2: output over error (rows) and change, both on [-1, 1]."""


NEUTRAL = Params(
    enabled=False,
    fine_m=1.0,
    coarse_m=2.0,
    weight_1_m=1.0,
    error_1_m=0.0,
    change_s_m=0.0,
    output_m_s=0.0,
    ki_1_s2=0.0,
    surface=np.zeros((2, 2)),
)


def params_of(settings: FuzzyPdSettings, _axis: AxisFacts) -> Params:
    """The parameters of the tick."""
    return Params(
        enabled=settings.enabled,
        fine_m=float(settings.fine_um) * UM,
        coarse_m=float(settings.coarse_um) * UM,
        weight_1_m=float(settings.weight_1_mm) / MM,
        error_1_m=float(settings.error_gain_1_mm) / MM,
        change_s_m=float(settings.change_gain_s_mm) / MM,
        output_m_s=float(settings.output_mm_s) * MM,
        ki_1_s2=float(settings.ki_1_s2),
        surface=surface(SURFACE_POINTS) if settings.enabled else NEUTRAL.surface,
    )


def objection(settings: FuzzyPdSettings, _resolution_um: float) -> str:
    """Say why the regions of the error contradict each other, or return ""."""
    if settings.fine_um >= settings.coarse_um:
        return f"coarse_um: must be above fine_um {settings.fine_um:g}"
    return ""


SECTION = LawSection(
    name="fuzzy_pd",
    meaning="Fuzzy-PD position law.",
    settings=FuzzyPdSettings,
    params=params_of,
    neutral=NEUTRAL,
    needs=(Need.VELOCITY_SET_POINT,),
    objection=objection,
)


@kernel
def interpolated(values: Table, first: float, second: float) -> float:
    """Interpolate the surface `values` (n, n), n >= 2, over [-1, 1] x [-1, 1]; inputs are clipped to that."""
    steps = values.shape[0] - 1
    x = 0.5 * (min(max(first, -1.0), 1.0) + 1.0) * steps
    y = 0.5 * (min(max(second, -1.0), 1.0) + 1.0) * steps
    i, j = max(min(int(x), steps - 1), 0), max(min(int(y), steps - 1), 0)  # at least 0, for NaN too
    x, y = x - i, y - j
    low = values[i, j] + y * (values[i, j + 1] - values[i, j])
    high = values[i + 1, j] + y * (values[i + 1, j + 1] - values[i + 1, j])
    return float(low + x * (high - low))


@kernel
def pd_share(p: Params, error_m: float) -> float:
    """Weight a of the PD law (11): 0 up to e1, 1 from e2 on."""
    size_m = abs(error_m)
    if size_m <= p.fine_m:
        return 0.0
    if size_m >= p.coarse_m:
        return 1.0
    # (11) with negative exponents: the same quotient, and no exponential overflows
    part, whole = p.weight_1_m * (size_m - p.fine_m), p.weight_1_m * (p.coarse_m - p.fine_m)
    return math.exp(part - whole) * math.expm1(-part) / math.expm1(-whole)


@kernel
def fuzzy_setpoint(p: Params, error_m: float, change_m_s: float, pd_m_s: float) -> float:
    """Velocity set point (m/s) without the integral; `change_m_s` is de/dt, `pd_m_s` the PD law's."""
    share = pd_share(p, error_m)
    if share >= 1.0:
        return pd_m_s
    fuzzy_m_s = p.output_m_s * interpolated(p.surface, p.error_1_m * error_m, p.change_s_m * change_m_s)
    return share * pd_m_s + (1.0 - share) * fuzzy_m_s
