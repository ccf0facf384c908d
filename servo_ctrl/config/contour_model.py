"""The schema of `[contour_control]`."""

from typing import Annotated

from pydantic import Field

from servo_ctrl.config.section import FileSection, NonNegative, Positive


class ContourControl(FileSection):
    """Cross-coupled contour control of two axes, off without this section."""

    enabled: bool = True
    """Whether it acts."""
    axes: Annotated[list[str], Field(min_length=2, max_length=2)]
    """Names of the two axes, at right angles, both in cst."""
    kp_1_s: NonNegative
    """Velocity per contour error, 1/s: added, beside the path, to kp_1_s of the axes."""
    ki_1_s2: NonNegative = 0.0
    """Integral gain, 1/s^2; 0 = no integrator."""
    limit_mm_s: Positive = 10.0
    """Limit of the added velocity, and of its integral, mm/s."""
    full_speed_mm_s: Positive = 1.0
    """Commanded speed from which on it acts fully, mm/s; below, its effect falls to 0 at standstill."""
