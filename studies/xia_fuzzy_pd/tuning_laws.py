"""The tuned position laws as boxes of free values: their bounds, and the parameters of a point.

A point lies in the unit cube. Most values are scaled by decades, so that the search treats 1 and 10 as far
apart as 10 and 100. Values that both laws have in common have the same bounds.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from servo_ctrl.control.compensation import fuzzy_pd
from servo_ctrl.control.compensation.fuzzy_inference import SURFACE_POINTS, surface
from servo_ctrl.control.section import filter_blend
from servo_ctrl.control.tick import AxisParams

SIGNIFICANT = 3
"""Significant digits of the values in a machine file; chosen."""


class Span(NamedTuple):
    """One free value, in the unit of the machine file."""

    lowest: float
    highest: float
    decades: bool

    def at(self, share: float) -> float:
        """Return the value at a share of the span, rounded as in the file."""
        if self.decades:
            value = self.lowest * (self.highest / self.lowest) ** share
        else:
            value = self.lowest + share * (self.highest - self.lowest)
        return _rounded(value)


_LINEAR = {
    "kp_1_s": Span(5.0, 500.0, decades=True),
    "kd": Span(0.0, 2.0, decades=False),
    "derivative_filter_ms": Span(0.0, 20.0, decades=False),
}
_INTEGRAL = {"ki_1_s2": Span(0.1, 20_000.0, decades=True)}
"""The lowest value is practically none: an error of a millimetre commands 0.1 mm/s after a second."""
_FUZZY = {
    "fine_um": Span(5.0, 5000.0, decades=True),
    "coarse_share": Span(1.2, 20.0, decades=True),
    "weight_share": Span(0.1, 10.0, decades=True),
    "output_mm_s": Span(0.5, 500.0, decades=True),
    "fuzzy_kp_1_s": Span(5.0, 500.0, decades=True),
    "fuzzy_kd": Span(0.0, 2.0, decades=False),
}
LAWS: Mapping[str, dict[str, Span]] = {
    "pid": {**_LINEAR, **_INTEGRAL},
    "fuzzy_pd": {**_LINEAR, **_INTEGRAL, **_FUZZY},
}
"""coarse_share: e2 / e1. weight_share: k_e (e2 - e1). fuzzy_kp_1_s, fuzzy_kd: Ku Ke and Ku Kec, the gains of
the surface from its middle to the next centres; their bounds are those of the linear law's gains."""


def values_at(law: str, point: Sequence[float]) -> dict[str, float]:
    """Return the free values at a point of the unit cube."""
    return {name: span.at(float(share)) for (name, span), share in zip(LAWS[law].items(), point, strict=True)}


def in_the_file(law: str, values: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """Return the values as keys of `[axis.NAME.control]` and `[axis.NAME.fuzzy_pd]`."""
    control = {key: values[key] for key in _LINEAR}
    if law == "pid":
        return {"control": {**control, "ki_1_s2": values["ki_1_s2"]}}
    coarse_um = values["fine_um"] * values["coarse_share"]
    fuzzy = {
        "fine_um": values["fine_um"],
        "coarse_um": coarse_um,
        "weight_1_mm": values["weight_share"] / (coarse_um - values["fine_um"]) * 1e3,
        "error_gain_1_mm": values["fuzzy_kp_1_s"] / values["output_mm_s"],
        "change_gain_s_mm": values["fuzzy_kd"] / values["output_mm_s"],
        "output_mm_s": values["output_mm_s"],
        "ki_1_s2": values["ki_1_s2"],
    }
    return {"control": control, "fuzzy_pd": {key: _rounded(value) for key, value in fuzzy.items()}}


def _rounded(value: float) -> float:
    return float(f"{value:.{SIGNIFICANT}g}")


_SURFACE = surface(SURFACE_POINTS)


def with_law(params: AxisParams, law: str, values: Mapping[str, float], gain: float = 1.0) -> AxisParams:
    """Return the parameters of an axis with a law and its values; `gain` scales the output of the law."""
    keys = in_the_file(law, values)
    control, fuzzy = keys["control"], keys.get("fuzzy_pd")
    loop = params.position_loop._replace(
        kp_1_s=gain * control["kp_1_s"],
        ki_1_s2=gain * control.get("ki_1_s2", 0.0),
        kd=gain * control["kd"],
        derivative_blend=filter_blend(control["derivative_filter_ms"] * 1e-3, params.period_s),
    )
    if fuzzy is None:
        return params._replace(position_loop=loop, fuzzy=params.fuzzy._replace(enabled=False))
    law_fuzzy = fuzzy_pd.Params(
        enabled=True,
        fine_m=fuzzy["fine_um"] * 1e-6,
        coarse_m=fuzzy["coarse_um"] * 1e-6,
        weight_1_m=fuzzy["weight_1_mm"] * 1e3,
        error_1_m=fuzzy["error_gain_1_mm"] * 1e3,
        change_s_m=fuzzy["change_gain_s_mm"] * 1e3,
        output_m_s=gain * fuzzy["output_mm_s"] * 1e-3,
        ki_1_s2=gain * fuzzy["ki_1_s2"],
        surface=_SURFACE,
    )
    return params._replace(position_loop=loop, fuzzy=law_fuzzy)
