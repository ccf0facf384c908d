"""The schema of a learned waveform: presliding friction, the force around a reversal and behind a rest."""

from typing import Annotated, Any

from pydantic import Field, Strict, field_validator

from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.section import FileSection, Number, Positive
from servo_ctrl.control.compensation.learned_waveform import Friction, LearnedWaveformSettings
from servo_ctrl.learned.file_model import Basis, LearnedContent
from servo_ctrl.learned.pulse_model import LearnedFunctions
from servo_ctrl.learning.level_over_temperature import LevelNode, LevelSchedule
from servo_ctrl.learning.reversal_waveform import RestForce, WaveformLearned

SAMPLES_MAX, ROWS_MAX = 6000, 50
"""Bound the samples and the accelerations of a waveform; chosen: learning uses 0.48 s and ten. Rests and
their forces are fewer."""
NODES_MAX = 100
"""Bounds the nodes over temperature; chosen: from -40 to 150 degC there are 39."""
_PULSE_SECTION = "friction_compensation."

Force = Annotated[float, Strict(), Field(ge=-1e6, le=1e6)]


class FrictionPart(FileSection):
    """The fields of `Friction`."""

    level_1_n: Force
    level_2_n: Force
    level_3_n: Force
    level_4_n: Force
    per_speed_n_s_m: Number
    per_acceleration_kg: Number
    per_jerk_kg_s: Number = 0.0
    """Absent in files of earlier releases."""


class WaveRow(FileSection):
    """The force around a reversal at one acceleration, one sample a period."""

    acceleration_m_s2: Positive
    force_n: Annotated[list[Force], Field(min_length=2, max_length=SAMPLES_MAX)]


class RestRow(FileSection):
    """The fields of `RestForce`."""

    rest_s: Positive
    onward_n: Annotated[list[Force], Field(min_length=1, max_length=SAMPLES_MAX)]
    turned_n: Annotated[list[Force], Field(min_length=1, max_length=SAMPLES_MAX)]


class LevelRow(FileSection):
    """The fields of `LevelNode`."""

    temperature_degc: Number
    level: Positive
    variance: Positive


class LevelOverTemperature(FileSection):
    """The fields of `LevelSchedule`."""

    followed: Positive
    moved: Number
    evidence: Number
    nodes: Annotated[list[LevelRow], Field(min_length=1, max_length=NODES_MAX)]

    @field_validator("nodes")
    @classmethod
    def _rising(cls, value: list[LevelRow]) -> list[LevelRow]:
        temperatures = [node.temperature_degc for node in value]
        if sorted(set(temperatures)) != temperatures:
            raise ValueError("the temperatures must rise")
        return value


class LearnedWaveform(LearnedContent):
    """`learning.reversal_waveform.WaveformLearned` with the parts by name."""

    result = WaveformLearned
    friction: FrictionPart
    rows: Annotated[list[WaveRow], Field(max_length=ROWS_MAX)]
    rests: Annotated[list[RestRow], Field(default_factory=list, max_length=ROWS_MAX)]
    """Absent in files of earlier releases."""
    level_over_temperature: LevelOverTemperature | None = None
    """Absent in files of earlier releases, and without a temperature."""

    @field_validator("rows")
    @classmethod
    def _rising(cls, value: list[WaveRow]) -> list[WaveRow]:
        accelerations = [row.acceleration_m_s2 for row in value]
        if sorted(set(accelerations)) != accelerations:
            raise ValueError("the accelerations must rise")
        if len({len(row.force_n) for row in value}) > 1:
            raise ValueError("all rows must have as many samples")
        return value

    @field_validator("rests")
    @classmethod
    def _longer(cls, value: list[RestRow]) -> list[RestRow]:
        rests = [row.rest_s for row in value]
        if sorted(set(rests)) != rests:
            raise ValueError("the rests must rise")
        if len({len(force_n) for row in value for force_n in (row.onward_n, row.turned_n)}) > 1:
            raise ValueError("all rests must have as many forces of both kinds")
        return value

    @classmethod
    def values(cls, learned: WaveformLearned) -> dict[str, Any]:
        """Convert a result to a mapping of plain numbers."""
        rows = zip(learned.accelerations_m_s2, learned.waves_n, strict=True)
        return {
            "learner": learned.learner,
            "before_m": float(learned.before_m),
            "after_m": float(learned.after_m),
            "strokes": learned.strokes,
            "machine_time_s": float(learned.machine_time_s),
            "friction": dict(zip(Friction._fields, map(float, learned.friction), strict=True)),
            "rows": [
                {"acceleration_m_s2": float(a), "force_n": [float(force) for force in wave]}
                for a, wave in rows
            ],
            "rests": [
                {
                    "rest_s": float(rest_s),
                    "onward_n": [float(force) for force in onward_n],
                    "turned_n": [float(force) for force in turned_n],
                }
                for rest_s, onward_n, turned_n in learned.rests
            ],
            "level_over_temperature": _values_of(learned.schedule),
        }

    def learned(self) -> WaveformLearned:
        """Return the result, identical to the bit."""
        return WaveformLearned(
            learner=self.learner,
            friction=tuple(getattr(self.friction, name) for name in Friction._fields),
            accelerations_m_s2=tuple(row.acceleration_m_s2 for row in self.rows),
            waves_n=tuple(tuple(row.force_n) for row in self.rows),
            before_m=self.before_m,
            after_m=self.after_m,
            strokes=self.strokes,
            machine_time_s=self.machine_time_s,
            rests=tuple(
                RestForce(row.rest_s, tuple(row.onward_n), tuple(row.turned_n)) for row in self.rests
            ),
            schedule=_schedule_of(self.level_over_temperature),
        )

    @staticmethod
    def basis(machine: MachineConfig, axis: str) -> Basis:
        """Return the machine-file values that a waveform depends on: those of a pulse except its section."""
        basis = LearnedFunctions.basis(machine, axis)
        basis = {key: value for key, value in basis.items() if not key.startswith(_PULSE_SECTION)}
        waveform = machine.axes[axis].section(LearnedWaveformSettings)
        if waveform is not None:
            basis["learned_waveform.amplifier_delay_ms"] = waveform.amplifier_delay_ms
        return basis

    def objection(self, _machine: MachineConfig, _axis: str) -> str:
        """Return "", because the control law bounds the force."""
        return ""


def _values_of(schedule: LevelSchedule) -> dict[str, Any] | None:
    """Convert a schedule to a mapping of plain numbers; None before the first reversal with a temperature."""
    if not schedule.nodes:
        return None
    return {**schedule._asdict(), "nodes": [node._asdict() for node in schedule.nodes]}


def _schedule_of(part: LevelOverTemperature | None) -> LevelSchedule:
    if part is None:
        return LevelSchedule()
    nodes = tuple(LevelNode(**vars(node)) for node in part.nodes)
    return LevelSchedule(nodes, part.followed, part.moved, part.evidence)
