"""The motor's encoder: counts from the power-up origin, and one index pulse a turn."""

from typing import Any

from hil_sim.config import AxisPlant


class MotorEncoder:
    """Reads the encoder from the plant's `state` of the axis; without the polarity 607Eh."""

    def __init__(self, config: AxisPlant, state: Any) -> None:
        self._state = state
        self.counts_per_rev = config.encoder.counts_per_rev
        pulse_counts = round(config.encoder.index_mm * 1e-3 * (self.counts_per_rev / config.lead_m))
        self._pulse_counts = pulse_counts - int(state["encoder_origin_counts"])

    def counts(self) -> int:
        """Return motor counts from the power-up origin."""
        return int(self._state["encoder_counts"])

    def index_between(self, before: int, now: int) -> int | None:
        """Return the motor counts of the first index pulse from `before` to `now`, None without one."""
        turn = self.counts_per_rev
        if now >= before:
            first = before + 1 + (self._pulse_counts - before - 1) % turn
            return first if first <= now else None
        first = before - 1 - (before - 1 - self._pulse_counts) % turn
        return first if first >= now else None
