"""What a machine that is none says of itself: ready, nothing learning, all nodes well."""

from __future__ import annotations

from servo_ctrl.config.local_status import (
    AxisState,
    BusState,
    DriveState,
    EmcyEntry,
    EventEntry,
    Histogram,
    LearnedState,
    LearningState,
    NodeState,
    ProgramState,
    ReversalState,
    ScrewState,
    SettingsState,
    Status,
)

AXES = ("x", "y")
NODES = (
    ("axis.x.drive", 1, "eds/servo_drive.eds"),
    ("axis.x.scale", 11, "eds/linear_scale.eds"),
    ("axis.y.drive", 2, "eds/servo_drive.eds"),
    ("axis.y.scale", 12, "eds/linear_scale.eds"),
)
TIME = "2026-01-02T03:04:05.678+00:00"
FIRST_REVERSAL = ReversalState(
    cycle=1000,
    direction=1,
    acceleration_m_s2=0.0617,
    contour_peak_m=4.8e-6,
    error_peak_m=5e-6,
    error_rms_m=2.5e-6,
    error_mean_m=2e-6,
)
_LEARNED = LearnedState(
    learner="fast",
    durations=((0.01, 0.03), (0.1, 0.015)),
    amplitudes=((0.01, 0.001), (0.1, 0.004)),
    trailing=(),
    spread_m_s2=0.02,
    before_m=6e-6,
    after_m=1.5e-6,
    strokes=130,
    machine_time_s=2160.0,
)
_SCREW = ScrewState(
    enabled=False, version=0, learned_at="", points=(), lost_motion_m=None, before_m=None, after_m=None
)


def first_status() -> Status:
    """Ready, nothing learning, all nodes well."""
    return Status(
        time=TIME,
        stage="ready",
        reason="",
        cycles=0,
        missed_ticks=0,
        learning=LearningState(
            state="idle",
            axis="",
            reason="",
            stage="",
            strokes_done=0,
            strokes_total=0,
            progress=0.0,
            remaining_s=None,
            acceleration_m_s2=None,
            best_m=None,
        ),
        axes=tuple(
            AxisState(
                name=name,
                compensation_enabled=True,
                observer_enabled=False,
                learning_due=False,
                reversals=3,
                last=FIRST_REVERSAL,
                version=2,
                learned_at=TIME,
                learned=_LEARNED,
                screw=_SCREW,
            )
            for name in AXES
        ),
        drives=tuple(
            DriveState(
                axis=name,
                phase="servo",
                state="operation enabled",
                statusword=0x1637,
                error_code=None,
                homed=True,
                position_m=0.0,
                ready=True,
                limits_m=(-0.1, 0.1),
            )
            for name in AXES
        ),
        program=ProgramState(
            name="circles.toml",
            step=-1,
            label="",
            progress=0.0,
            held=False,
            loaded=True,
            preparing=False,
            problem="",
        ),
        settings=SettingsState(required_m=3e-6, learner="fast", adaptation=False),
        bus=BusState(
            load=0.62,
            frames_per_s=7010.0,
            cycle_us=Histogram(edges_us=(900.0, 1000.0, 1100.0), counts=(1, 480, 510, 9)),
            missed_ticks=0,
            missing_inputs=0,
        ),
        nodes=tuple(
            NodeState(name=name, node_id=node_id, nmt_state="operational", heartbeat_age_s=0.05)
            for name, node_id, _eds in NODES
        ),
        emcy=(
            EmcyEntry(
                time=TIME, node="axis.x.drive", code=0x8611, error_register=0x21, text="following error"
            ),
        ),
        events=(EventEntry(cycle=0, text="the machine is ready"),),
    )
