"""The schema of controller.toml: monitoring and learning."""

from typing import Annotated, Literal, Self

from pydantic import Field, Strict, model_validator

from servo_ctrl.config.section import FileSection, Positive

Steps = Annotated[int, Strict(), Field(ge=1, le=200)]


class MonitoringConfig(FileSection):
    """Settings of the reversal indicators and of the rule that learning is due."""

    window_s: Positive = 0.2
    """Monitoring time Tm after a reversal, seconds."""
    required_um: Positive = 4.0
    """J_required: largest acceptable mean absolute error over Tm, micrometres."""
    due_after_reversals: Annotated[int, Strict(), Field(ge=1, le=1000)] = 4
    """Number of consecutive reversals of an axis above J_required after which learning is due."""
    settled_below: Annotated[float, Strict(), Field(gt=0.0, le=1.0)] = 0.9
    """Learning is no longer due after the same number of reversals below this share of J_required."""


RestTime = Annotated[float, Strict(), Field(gt=0.0, le=300.0)]


class LearningConfig(FileSection):
    """Settings for learning the pulse functions (Feng et al. 2015, sections 3 and 4)."""

    learner: Literal["fast", "paper"] = "fast"
    """"paper": the published sweeps; "fast": the same result with far fewer strokes."""
    radius_mm: Positive = 50.0
    """Amplitude of the sine strokes, millimetres."""
    accelerations_mm_s2: Annotated[list[Positive], Field(min_length=4, max_length=4)] = Field(
        default_factory=lambda: [2.0, 8.0, 30.0, 120.0]
    )
    """Reverse accelerations a_min, a_1, a_2, a_max, mm/s^2."""
    steps: Annotated[list[Steps], Field(min_length=3, max_length=3)] = Field(
        default_factory=lambda: [4, 4, 4]
    )
    """N_1, N_2, N_3: steps of the coarse stage in the three intervals."""
    coarse_steps: Steps = 18
    """N_c: amplitude steps of the coarse stage and of the duration stage."""
    fine_steps: Steps = 20
    """N_f: amplitude steps of the fine stage."""
    initial_share: Annotated[float, Strict(), Field(ge=0.01, le=0.5)] = 0.1
    """k: the sweeps begin at A_0 = k A_max."""
    duration_step_ms: Positive = 5.0
    """dT: step of the duration stage, milliseconds."""
    duration_reach: Annotated[float, Strict(), Field(gt=1.0, le=5.0)] = 1.6
    """The tried durations range from t2 - t1 to this multiple of it."""
    window_durations: Annotated[float, Strict(), Field(ge=1.0, le=20.0)] = 2.0
    """Duration of a stroke's evaluation, as a multiple of the pulse duration."""
    trailing: bool = True
    """Whether to learn a second trapezoid for the moment of breakaway."""
    rests_s: Annotated[list[RestTime], Field(min_length=0, max_length=6)] = Field(default_factory=list)
    """Rests whose additional friction a waveform learns, seconds, e.g. [0.3, 3.0, 30.0]; none by default."""
    adaptation: bool = False
    """Whether reversals in production adapt the learned functions."""

    @model_validator(mode="after")
    def _rising(self) -> Self:
        if sorted(set(self.accelerations_mm_s2)) != self.accelerations_mm_s2:
            raise ValueError("accelerations_mm_s2: must rise: a_min, a_1, a_2, a_max")
        if sorted(set(self.rests_s)) != self.rests_s:
            raise ValueError("rests_s: must rise")
        return self
