"""The daemon's tick over records equals the tick, bit for bit, for any input."""

import math

import numpy as np
from compensation_off import NO_FUZZY, NO_LEADING, NO_NOTCH, NO_WAVEFORM, p_loop
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from law_records import axis_records

from kernels.jit import signatures
from kernels.record_layout import store
from kernels.records import read, write
from servo_ctrl.control import position_loop, velocity_loop
from servo_ctrl.control.axis_record import tick_axis
from servo_ctrl.control.compensation import (
    backlash,
    disturbance_observer,
    feedforward,
    fuzzy_pd,
    learned_waveform,
    notch,
    sampled_dual_loop,
    screw_error,
    trapezoidal_pulse,
)
from servo_ctrl.control.limits import AxisLimits
from servo_ctrl.control.offset_motion import OffsetMotion
from servo_ctrl.control.presliding_memory import FORGOTTEN_M, Branch, Turn
from servo_ctrl.control.rest_memory import SPAN_M, Rest
from servo_ctrl.control.tick import AxisParams, AxisState, axis_tick, initial_state
from servo_ctrl.control.types import AxisCommand, AxisSample

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
TURNS = st.builds(Turn, SIGNED | st.just(FORGOTTEN_M), SIGNED)
BRANCHES = st.builds(Branch, SIGNED, *[TURNS] * 5)
RESTS = st.builds(Rest, POSITIVE | st.just(0.0), POSITIVE, SWITCH, st.floats(0.0, SPAN_M), SIGNED)
PARAMS = st.builds(
    AxisParams,
    st.floats(1e-4, 0.1),
    st.integers(0, 2),
    st.builds(position_loop.Params, POSITIVE, POSITIVE, POSITIVE, SHARE, SWITCH),
    st.builds(fuzzy_pd.Params, SWITCH, POSITIVE, POSITIVE, POSITIVE, *[POSITIVE] * 4, SURFACES),
    st.builds(velocity_loop.Params, POSITIVE, POSITIVE, st.integers(1, 2), SHARE),
    st.builds(notch.Params, SWITCH, *[SIGNED] * 3, SHARE),
    st.builds(feedforward.Params, SIGNED, SIGNED),
    st.builds(trapezoidal_pulse.Params, SWITCH, SHARE, POSITIVE, st.integers(1, 4).flatmap(table)),
    st.builds(disturbance_observer.Params, SWITCH, POSITIVE, POSITIVE, SHARE),
    st.builds(
        learned_waveform.Params,
        SWITCH,
        *[POSITIVE] * 3,
        st.builds(learned_waveform.Friction, *[SIGNED] * 7),
        *[st.integers(1, 4).flatmap(table).map(np.transpose).map(np.ascontiguousarray)] * 2,
    ),
    st.builds(screw_error.Params, SWITCH, SCREWS),
    st.builds(backlash.Params, SWITCH, POSITIVE, POSITIVE, POSITIVE),
    st.builds(
        sampled_dual_loop.Params,
        SWITCH,
        *[POSITIVE] * 2,
        st.integers(1, 9),
        POSITIVE,
        SWITCH,
        *[POSITIVE] * 2,
    ),
    st.builds(AxisLimits, POSITIVE, POSITIVE, POSITIVE),
)
MOTIONS = st.builds(OffsetMotion, SIGNED, SIGNED, POSITIVE, POSITIVE, SWITCH)
SHAPES = st.builds(trapezoidal_pulse.PulseShape, *[SIGNED] * 5)
STATES = st.builds(
    AxisState,
    *[SIGNED] * 2,
    st.builds(position_loop.State, SIGNED | st.just(math.nan), SIGNED, SIGNED),
    st.builds(velocity_loop.State, *[SIGNED] * 4),
    st.builds(notch.State, *[SIGNED] * 2),
    st.builds(
        trapezoidal_pulse.State,
        SIGNED,
        st.sampled_from([-1.0, 0.0, 1.0]),
        POSITIVE,
        st.builds(trapezoidal_pulse.PulseShape, *[SIGNED] * 5),
    ),
    st.builds(disturbance_observer.State, SIGNED, SIGNED, SIGNED | st.just(math.nan)),
    st.builds(learned_waveform.State, SIGNED, SIGNED, SIGNED, BRANCHES, *[SIGNED] * 4, RESTS),
    SIGNED,
    MOTIONS,
    st.builds(sampled_dual_loop.State, POSITIVE, st.integers(0, 9), MOTIONS),
)
SAMPLES = st.builds(AxisSample, *[MEASURED] * 7)


@settings(deadline=None)  # the first may have to compile
@given(PARAMS, STATES, st.lists(SAMPLES | st.builds(AxisSample, *[SIGNED] * 7), min_size=1, max_size=5))
@example(  # a zero of either sign everywhere
    AxisParams(
        1e-3,
        0,
        p_loop(0.0, False),
        NO_FUZZY,
        velocity_loop.Params(0.0, 0.0, 1, 1.0),
        NO_NOTCH,
        feedforward.Params(0.0, 0.0),
        trapezoidal_pulse.Params(True, 1.0, 0.0, np.zeros((6, 1))),
        disturbance_observer.Params(True, 0.0, 0.0, 1.0),
        NO_WAVEFORM,
        *NO_LEADING,
        AxisLimits(1.0, 1.0, 1.0),
    ),
    initial_state(0.0),
    [AxisSample(*[0.0] * 8), AxisSample(*[-0.0] * 8)],
)
def test_both_outputs_are_those_of_the_tick(
    params: AxisParams, state: AxisState, samples: list[AxisSample]
) -> None:
    axes, tables = axis_records([params], [0.0])
    store(axes["state"], [state])
    for sample in samples:
        state, command = axis_tick(params, state, sample)
        write(axes["sample"][0], sample)
        tick_axis(axes[0], tables)
        assert repr(read(axes["state"][0], AxisState)) == repr(state)  # signs of zero included
        assert repr(read(axes["command"][0], AxisCommand)) == repr(command)


@settings(deadline=None, max_examples=20)
@given(st.lists(PARAMS, min_size=2, max_size=3), SAMPLES)
def test_each_axis_has_its_own_parameters_and_tables(params: list[AxisParams], sample: AxisSample) -> None:
    axes, tables = axis_records(params, [0.0] * len(params))
    axes["sample"] = sample
    for record, own in zip(axes, params, strict=True):
        tick_axis(record, tables)
        assert repr(read(record["params"], AxisParams, tables)) == repr(own)
        assert repr(read(record["command"], AxisCommand)) == repr(
            axis_tick(own, initial_state(0.0), sample)[1]
        )


def test_an_axis_begins_at_rest_and_its_tables_may_lie_in_memory_as_they_like() -> None:
    params = AxisParams(
        1e-3,
        0,
        p_loop(1.0, True),
        NO_FUZZY,
        velocity_loop.Params(1.0, 1.0, 1, 1.0),
        NO_NOTCH,
        feedforward.Params(1.0, 1.0),
        trapezoidal_pulse.Params(True, 0.01, 1.0, np.asfortranarray(np.arange(12.0).reshape(6, 2))),
        disturbance_observer.Params(True, 1.0, 1.0, 1.0),
        NO_WAVEFORM,
        *NO_LEADING,
        AxisLimits(1.0, 1.0, 1.0),
    )
    axes, tables = axis_records([params], [0.25])
    assert read(axes["params"][0], AxisParams, tables).pulse.learned.tolist() == params.pulse.learned.tolist()
    assert repr(read(axes["state"][0], AxisState)) == repr(initial_state(0.25))


def test_each_kernel_is_compiled_once() -> None:
    assert signatures(tick_axis) == 1
    assert signatures(axis_tick) == 1
