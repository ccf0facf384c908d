"""Status of a stub machine: ready, no learning run, all nodes operational."""

from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.bus_status import BusStatus, CycleHistogram, EmcyEntry, EventEntry, NodeStatus
from servo_ctrl.commands.learning_status import LearningStatus
from servo_ctrl.commands.machine_status import ContourStatus, DriveStatus, MachineStatus, ProgramStatus
from servo_ctrl.commands.settings import Settings
from servo_ctrl.commands.stage import Stage
from servo_ctrl.learning.types import Learned, ReversalReport

AXES = ("x", "y")
NODES = (
    ("axis.x.drive", 1, "eds/servo_drive.eds"),
    ("axis.x.scale", 11, "eds/linear_scale.eds"),
    ("axis.y.drive", 2, "eds/servo_drive.eds"),
    ("axis.y.scale", 12, "eds/linear_scale.eds"),
)
TIME = "2026-01-02T03:04:05.678+00:00"
FIRST_REVERSAL = ReversalReport(
    cycle=1000,
    direction=1,
    acceleration_m_s2=0.0617,
    contour_peak_m=4.8e-6,
    error_peak_m=5e-6,
    error_rms_m=2.5e-6,
    error_mean_m=2e-6,
)
_LEARNED = Learned(
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


def first_status() -> MachineStatus:
    """Return the status: ready, no learning run, all nodes operational."""
    return MachineStatus(
        time=TIME,
        stage=Stage.READY,
        reason="",
        cycles=0,
        missed_ticks=0,
        learning=LearningStatus(),
        axes=tuple(
            AxisStatus(
                name=name,
                compensation_enabled=True,
                observer_enabled=False,
                learning_due=False,
                reversals=3,
                last=FIRST_REVERSAL,
                version=2,
                learned_at=TIME,
                learned=_LEARNED,
            )
            for name in AXES
        ),
        drives=tuple(
            DriveStatus(
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
        program=ProgramStatus(
            name="circles.toml",
            step=-1,
            label="",
            progress=0.0,
            held=False,
            loaded=True,
            preparing=False,
            problem="",
        ),
        contour=ContourStatus(AXES, error_m=1.2e-6),
        settings=Settings(required_m=3e-6, learner="fast", adaptation=False),
        bus=BusStatus(
            load=0.62,
            frames_per_s=7010.0,
            cycle_us=CycleHistogram(edges_us=(900.0, 1000.0, 1100.0), counts=(1, 480, 510, 9)),
            missed_ticks=0,
            missing_inputs=0,
        ),
        nodes=tuple(
            NodeStatus(name=name, node_id=node_id, nmt_state="operational", heartbeat_age_s=0.05)
            for name, node_id, _eds in NODES
        ),
        emcy=(
            EmcyEntry(
                time=TIME, node="axis.x.drive", code=0x8611, error_register=0x21, text="following error"
            ),
        ),
        events=(EventEntry(cycle=0, text="the machine is ready"),),
    )
