"""The daemon's tick over arrays is the tick, bit for bit, whatever it is given."""

from __future__ import annotations

import math

import numpy as np
from compensation_off import NO_FUZZY, NO_LEADING, p_loop
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from servo_ctrl.control.flat_tick import (
    OBSERVER_VELOCITY,
    POSITION_ERROR,
    FlatAxis,
    flat,
    flat_axis,
    flat_tick,
    params_of,
    state_of,
)
from servo_ctrl.control.jit import signatures
from servo_ctrl.control.params import (
    AxisLimits,
    AxisParams,
    BacklashTakeUp,
    DisturbanceObserver,
    Feedforward,
    FrictionPulse,
    FuzzyPd,
    PositionLoop,
    SampledDualLoop,
    ScrewError,
    VelocityLoop,
)
from servo_ctrl.control.tick import axis_tick
from servo_ctrl.control.types import (
    AxisSample,
    AxisState,
    ObserverState,
    OffsetMotion,
    PositionState,
    PulseShape,
    PulseState,
    SampledState,
    initial_state,
)

POSITIVE = st.floats(1e-6, 1e6)
SIGNED = st.floats(-1e3, 1e3)
SHARE = st.floats(1e-3, 1.0)
SWITCH = st.booleans()
MEASURED = SIGNED | st.sampled_from([math.nan, math.inf, -math.inf])


def table(columns: int) -> st.SearchStrategy[np.ndarray]:
    rows = arrays.arrays(np.float64, (5, columns), elements=st.floats(-10.0, 10.0))
    return rows.map(lambda values: np.vstack((np.geomspace(1e-3, 1.0, columns), values)))


SURFACES = st.integers(2, 4).flatmap(
    lambda n: arrays.arrays(np.float64, (n, n), elements=st.floats(-1.0, 1.0))
)
SCREWS = st.integers(1, 4).flatmap(
    lambda n: arrays.arrays(np.float64, n, elements=st.floats(-1.0, 1.0)).map(
        lambda errors: np.vstack((np.linspace(-1.0, 1.0, n), errors))
    )
)
PARAMS = st.builds(
    AxisParams,
    st.floats(1e-4, 0.1),
    st.integers(0, 2),
    st.builds(PositionLoop, POSITIVE, POSITIVE, POSITIVE, SHARE, SWITCH),
    st.builds(FuzzyPd, SWITCH, POSITIVE, POSITIVE, POSITIVE, *[POSITIVE] * 4, SURFACES),
    st.builds(VelocityLoop, POSITIVE, POSITIVE, st.integers(1, 2), SHARE),
    st.builds(Feedforward, SIGNED, SIGNED),
    st.builds(FrictionPulse, SWITCH, SHARE, POSITIVE, st.integers(1, 4).flatmap(table)),
    st.builds(DisturbanceObserver, SWITCH, POSITIVE, POSITIVE, SHARE),
    st.builds(ScrewError, SWITCH, SCREWS),
    st.builds(BacklashTakeUp, SWITCH, POSITIVE, POSITIVE, POSITIVE),
    st.builds(SampledDualLoop, SWITCH, *[POSITIVE] * 2, st.integers(1, 9), POSITIVE, SWITCH, *[POSITIVE] * 2),
    st.builds(AxisLimits, POSITIVE, POSITIVE, POSITIVE),
)
MOTIONS = st.builds(OffsetMotion, SIGNED, SIGNED, POSITIVE, POSITIVE, SWITCH)
STATES = st.builds(
    AxisState,
    *[SIGNED] * 6,
    st.builds(PositionState, SIGNED | st.just(math.nan), SIGNED, SIGNED),
    st.builds(
        PulseState, SIGNED, st.sampled_from([-1.0, 0.0, 1.0]), POSITIVE, st.builds(PulseShape, *[SIGNED] * 5)
    ),
    st.builds(ObserverState, SIGNED, SIGNED, SIGNED | st.just(math.nan)),
    SIGNED,
    MOTIONS,
    st.builds(SampledState, POSITIVE, st.integers(0, 9), MOTIONS),
)
SAMPLES = st.builds(AxisSample, *[MEASURED] * 7)


def without_tables(params: AxisParams) -> AxisParams:
    none = np.zeros(0)
    return params._replace(
        pulse=params.pulse._replace(learned=none),
        fuzzy=params.fuzzy._replace(surface=none),
        screw=params.screw._replace(table=none),
    )


def same_bits(left: np.ndarray, right: np.ndarray) -> bool:
    """Signs of zero included; one NaN is as good as another."""
    return np.array_equal(left, right, equal_nan=True) and np.array_equal(
        np.signbit(left) & ~np.isnan(left), np.signbit(right) & ~np.isnan(right)
    )


@settings(deadline=None)  # the first may have to compile
@given(PARAMS, STATES, st.lists(SAMPLES | st.builds(AxisSample, *[SIGNED] * 7), min_size=1, max_size=5))
@example(  # a zero of either sign everywhere
    AxisParams(
        1e-3,
        0,
        p_loop(0.0, False),
        NO_FUZZY,
        VelocityLoop(0.0, 0.0, 1, 1.0),
        Feedforward(0.0, 0.0),
        FrictionPulse(True, 1.0, 0.0, np.zeros((6, 1))),
        DisturbanceObserver(True, 0.0, 0.0, 1.0),
        *NO_LEADING,
        AxisLimits(1.0, 1.0, 1.0),
    ),
    initial_state(0.0),
    [AxisSample(*[0.0] * 7), AxisSample(*[-0.0] * 7)],
)
def test_both_outputs_are_those_of_the_tick(
    params: AxisParams, state: AxisState, samples: list[AxisSample]
) -> None:
    axis = flat_axis(params, 0.0)
    axis.state[:] = flat(state)
    for sample in samples:
        state, command = axis_tick(params, state, sample)
        axis.sample[:] = sample
        flat_tick(*axis)
        assert same_bits(axis.state, flat(state))
        assert same_bits(axis.command, flat(command))


@settings(deadline=None)  # the first may have to compile
@given(PARAMS, STATES)
def test_flattened_values_come_back_as_they_were(params: AxisParams, state: AxisState) -> None:
    tables = params.pulse.learned, params.fuzzy.surface, params.screw.table
    back = params_of(flat(params), *tables)
    for left, right in zip((back.pulse.learned, back.fuzzy.surface, back.screw.table), tables, strict=True):
        assert np.array_equal(left, right)
    assert repr(without_tables(back)) == repr(without_tables(params))
    assert repr(state_of(flat(state))) == repr(state)


def test_an_axis_begins_at_rest() -> None:
    params = AxisParams(
        1e-3,
        0,
        p_loop(1.0, True),
        NO_FUZZY,
        VelocityLoop(1.0, 1.0, 1, 1.0),
        Feedforward(1.0, 1.0),
        FrictionPulse(True, 0.01, 1.0, np.asfortranarray(np.arange(12.0).reshape(6, 2))),
        DisturbanceObserver(True, 1.0, 1.0, 1.0),
        *NO_LEADING,
        AxisLimits(1.0, 1.0, 1.0),
    )
    axis = flat_axis(params, 0.25)
    assert isinstance(axis, FlatAxis)
    assert axis.learned.flags.c_contiguous
    np.testing.assert_array_equal(axis.state, flat(initial_state(0.25)))
    assert len(axis.params) == 44
    assert len(axis.state) == 33


def test_each_is_compiled_once() -> None:
    assert signatures(flat_tick) == 1
    assert signatures(axis_tick) == 1


def test_what_a_gap_spoils_is_where_the_daemon_looks_for_it() -> None:
    state = initial_state(0.0)._replace(
        observer=ObserverState(1.0, 123.0, 2.0), position_loop=PositionState(456.0, 1.0, 2.0)
    )
    assert flat(state)[OBSERVER_VELOCITY] == 123.0
    assert flat(state)[POSITION_ERROR] == 456.0
