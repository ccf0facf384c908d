"""What a benchmark gives: ratios with their two measurements and their aim, and what was left out and why."""

from typing import Any, NamedTuple


class Ratio(NamedTuple):
    """`value` = `ours` / `reference`, both measured in one run; met when it is at least (at most) `aim`.

    Without an aim the ratio is for information.
    """

    name: str
    ours: float
    reference: float
    unit: str
    aim: float | None
    at_most: bool = False
    reference_unit: str = ""
    """Where it is not that of `ours`."""

    @property
    def value(self) -> float:
        return self.ours / self.reference

    @property
    def met(self) -> bool | None:
        if self.aim is None:
            return None
        return self.value <= self.aim if self.at_most else self.value >= self.aim

    @property
    def aim_text(self) -> str:
        return "" if self.aim is None else f"{'at most' if self.at_most else 'at least'} {self.aim:g}"

    def as_json(self) -> dict[str, Any]:
        return {
            **{key: value for key, value in self._asdict().items() if key != "at_most"},
            "aim": self.aim_text,
            "value": self.value,
            "met": self.met,
        }


class Skip(NamedTuple):
    """A measurement that this machine does not allow."""

    name: str
    reason: str


class Section(NamedTuple):
    """One benchmark."""

    name: str
    facts: dict[str, Any]
    ratios: list[Ratio]
    skips: list[Skip]

    def as_json(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "facts": self.facts,
            "ratios": [ratio.as_json() for ratio in self.ratios],
            "skipped": [skip._asdict() for skip in self.skips],
        }
