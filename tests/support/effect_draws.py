"""Random parameters of effects within their bounds, and the effects of a kind."""

import math
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st

from hil_sim.physics.kinds import Kind
from hil_sim.physics.registry import EFFECTS
from hil_sim.plant.layout import AXIS_STATE, state_record
from kernels.quantities import fields_of, section_of

POSITION_M = st.floats(-2.0, 2.0)
DT_S = 50e-6
FEW = settings(max_examples=60, deadline=None)


def of_kind(*kinds: Kind) -> Any:
    found = [effect for effect in EFFECTS if effect.KIND in kinds]
    assert found
    return pytest.mark.parametrize("effect", found, ids=section_of)


@st.composite
def parameters(draw: st.DrawFn, effect: ModuleType) -> Any:
    values = {}
    for field in fields_of(effect.Params):
        q = field.quantity
        number = st.floats(q.lower, q.upper)
        values[field.name] = tuple(draw(number) for _ in range(q.length)) if q.length else draw(number)
    if "share" in values:  # shares of one whole
        total = math.fsum(values["share"]) or 1.0
        values["share"] = tuple(share / total for share in values["share"])
    return effect.Params(**values)


def at_rest() -> Any:
    return np.zeros(1, AXIS_STATE)[0]


def own_state(effect: ModuleType) -> tuple[Any, ...]:
    """Return the argument `s` of an effect's functions; none for an effect without `State`."""
    return (state_record(effect),) if hasattr(effect, "State") else ()
