"""controller.toml as types: monitoring and learning."""

from typing import Annotated, Literal, Self

from pydantic import Field, Strict, model_validator

from servo_ctrl.config.section import FileSection, Positive

Steps = Annotated[int, Strict(), Field(ge=1, le=200)]


class MonitoringConfig(FileSection):
    """How the indicators are taken, and when they say that learning is due."""

    window_s: Positive = 0.2
    """Monitoring time Tm after a reversal, seconds."""
    required_um: Positive = 4.0
    """J_required: mean absolute error over Tm that is still good, micrometres."""
    due_after_reversals: Annotated[int, Strict(), Field(ge=1, le=1000)] = 4
    """So many reversals of an axis in a row must exceed J_required before learning is due."""
    settled_below: Annotated[float, Strict(), Field(gt=0.0, le=1.0)] = 0.9
    """Learning is due no more after as many in a row below this share of J_required."""


class LearningConfig(FileSection):
    """How the pulse functions are learned (Feng et al. 2015, sections 3 and 4)."""

    learner: Literal["fast", "paper"] = "fast"
    """"paper": the published sweeps. "fast": the same result from far fewer strokes."""
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
    """The durations tried reach from t2 - t1 to so many times that."""
    window_durations: Annotated[float, Strict(), Field(ge=1.0, le=20.0)] = 2.0
    """The evaluation of a stroke lasts so many times the duration of its pulse."""
    trailing: bool = True
    """Whether a second trapezoid is learned for the moment at which the friction lets go."""
    adaptation: bool = False
    """Whether production reversals go on changing what was learned."""

    @model_validator(mode="after")
    def _rising(self) -> Self:
        if sorted(set(self.accelerations_mm_s2)) != self.accelerations_mm_s2:
            raise ValueError("accelerations_mm_s2: must rise: a_min, a_1, a_2, a_max")
        return self
