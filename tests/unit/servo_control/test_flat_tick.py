"""The daemon's tick over arrays is the tick, bit for bit, whatever it is given."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from servo_ctrl.control.flat_tick import (
    OBSERVER_VELOCITY,
    FlatAxis,
    flat,
    flat_axis,
    flat_tick,
    params_of,
    state_of,
)
from servo_ctrl.control.jit import signatures
from servo_ctrl.control.tick import axis_tick
from servo_ctrl.control.types import (
    AxisLimits,
    AxisParams,
    AxisSample,
    AxisState,
    DisturbanceObserver,
    Feedforward,
    FrictionPulse,
    ObserverState,
    PositionLoop,
    PulseShape,
    PulseState,
    VelocityLoop,
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


PARAMS = st.builds(
    AxisParams,
    st.floats(1e-4, 0.1),
    st.integers(0, 2),
    st.builds(PositionLoop, POSITIVE, SWITCH),
    st.builds(VelocityLoop, POSITIVE, POSITIVE, st.integers(1, 2), SHARE),
    st.builds(Feedforward, SIGNED, SIGNED),
    st.builds(FrictionPulse, SWITCH, SHARE, POSITIVE, st.integers(1, 4).flatmap(table)),
    st.builds(DisturbanceObserver, SWITCH, POSITIVE, POSITIVE, SHARE),
    st.builds(AxisLimits, POSITIVE, POSITIVE, POSITIVE),
)
STATES = st.builds(
    AxisState,
    *[SIGNED] * 6,
    st.builds(
        PulseState, SIGNED, st.sampled_from([-1.0, 0.0, 1.0]), POSITIVE, st.builds(PulseShape, *[SIGNED] * 5)
    ),
    st.builds(ObserverState, SIGNED, SIGNED, SIGNED | st.just(math.nan)),
)
SAMPLES = st.builds(AxisSample, *[MEASURED] * 7)


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
        PositionLoop(0.0, False),
        VelocityLoop(0.0, 0.0, 1, 1.0),
        Feedforward(0.0, 0.0),
        FrictionPulse(True, 1.0, 0.0, np.zeros((6, 1))),
        DisturbanceObserver(True, 0.0, 0.0, 1.0),
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
    back = params_of(flat(params), params.pulse.learned)
    assert back.pulse.learned is params.pulse.learned or np.array_equal(
        back.pulse.learned, params.pulse.learned
    )
    learned = {"learned": np.zeros(0)}
    assert repr(back._replace(pulse=back.pulse._replace(**learned))) == repr(
        params._replace(pulse=params.pulse._replace(**learned))
    )
    assert repr(state_of(flat(state))) == repr(state)


def test_an_axis_begins_at_rest() -> None:
    params = AxisParams(
        1e-3,
        0,
        PositionLoop(1.0, True),
        VelocityLoop(1.0, 1.0, 1, 1.0),
        Feedforward(1.0, 1.0),
        FrictionPulse(True, 0.01, 1.0, np.asfortranarray(np.arange(12.0).reshape(6, 2))),
        DisturbanceObserver(True, 1.0, 1.0, 1.0),
        AxisLimits(1.0, 1.0, 1.0),
    )
    axis = flat_axis(params, 0.25)
    assert isinstance(axis, FlatAxis)
    assert axis.learned.flags.c_contiguous
    np.testing.assert_array_equal(axis.state, flat(initial_state(0.25)))
    assert len(axis.params) == 20
    assert len(axis.state) == 17


def test_each_is_compiled_once() -> None:
    assert signatures(flat_tick) == 1
    assert signatures(axis_tick) == 1


def test_the_observers_velocity_is_where_the_daemon_looks_for_it() -> None:
    state = initial_state(0.0)._replace(observer=ObserverState(1.0, 123.0, 2.0))
    assert flat(state)[OBSERVER_VELOCITY] == 123.0
