"""The pictures of one difference, as plotly.js takes them: data and layout, colours by their role.

A colour is the name of a CSS variable (`--before`); the page puts in what it is in light or in dark.
"""

from __future__ import annotations

import html
import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from reconcile.catalogue.kinds import Sense
from reconcile.locate import in_phase
from reconcile.locate_lines import spectrum
from reconcile.locate_noise import floor_density, spectral_density
from reconcile.locate_pitches import order_bands, over_turns
from reconcile.report_profiles import Profiles
from reconcile.report_traces import (
    LOGARITHMIC,
    NAMES,
    axis,
    band,
    dots,
    held,
    layout,
    line,
    mark,
    peaks,
    upright,
)
from reconcile.report_words import reading, title
from reconcile.views import MODELS, of_model
from servo_ctrl.report.packed import packed
from servo_ctrl.telemetry.min_max import thinned

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from reconcile.report_profiles import Profile
    from reconcile.rests import Rest
    from reconcile.views import View

    Array = NDArray[np.float64]

POINTS = 1500
"""Of a spectrum."""


class Figure(NamedTuple):
    """A picture; `heading` and `note` are plain text beside it."""

    name: str
    heading: str
    note: str
    data: list[dict[str, Any]]
    layout: dict[str, Any]


def figures(seen: View, buckets: int) -> list[Figure]:
    """All pictures of a difference; a series is cut to so many `buckets`, two points each."""
    whole = np.concatenate([rest.before[rest.used] for rest in seen.rests])
    factor, unit = reading(seen.floor.unit, float(np.abs(whole).max(initial=0.0)))
    pen = _Pen(seen, factor, unit)
    profiles = Profiles(seen)
    found = [pen.time(rest, number, buckets) for number, rest in enumerate(seen.rests)]
    if seen.sense is Sense.DEVIATION:
        found += pen.ways("scale-less-motor", profiles.by_way("position"), "measured")
    found += [pen.profile(profile) for profile in profiles.best()]
    found += pen.ways("since-reversal", profiles.by_way("distance_since_reversal"), "rests")
    return [*found, pen.spectrum(), *pen.orders(), pen.correlation()]


class _Pen:
    """One difference in one unit."""

    def __init__(self, seen: View, factor: float, unit: str) -> None:
        self._seen, self._factor, self._unit = seen, factor, unit
        self._what = "force missed" if seen.sense is Sense.FORCE else "deviation missed"
        self._floor = seen.floor.rms / factor

    def time(self, rest: Rest, number: int, buckets: int) -> Figure:
        t = rest.scene.time_s
        data = []
        for model in MODELS:
            y = np.where(rest.used, getattr(rest, model) / self._factor, np.nan)
            x, y = thinned(t, y, buckets)
            data.append(line(model, x, y, name=NAMES[model]))
        x, y = thinned(t, rest.scene.motion.position_m * 1e3, buckets // 2)
        position = line("position", x, y, name="position")
        data.append({**position, "yaxis": "y2", "showlegend": False})
        shaded = [held(float(t[a]), float(t[b - 1])) for a, b in _runs(rest.held_out)]
        page = layout("time (s)", f"{self._what} ({self._unit})")
        page["xaxis"].update(anchor="y2", domain=[0.0, 1.0])
        page["yaxis"]["domain"] = [0.3, 1.0]
        page["yaxis2"] = {**axis("position (mm)"), "domain": [0.0, 0.22]}
        page["shapes"] = [*shaded, band("y", -2.0 * self._floor, 2.0 * self._floor)]
        page["height"] = 430
        note = f"{rest.source}. Grey band: noise floor, twice its RMS of {self._floor:.3g} {self._unit}."
        note += " Shaded stretches were held out: nothing was fitted to them." if shaded else ""
        return Figure(f"time-{number}", "Over time", note, data, page)

    def profile(self, profile: Profile) -> Figure:
        coordinate = profile.coordinate
        factor, unit = _reading(coordinate.unit, coordinate.edges)
        x: Any = packed(coordinate.centres / factor)
        if coordinate.labels:
            x = [html.escape(label) for label in coordinate.labels]
        data = []
        for model in MODELS:
            some = profile.counts > 0.0
            y = np.where(some, profile.means[model] / self._factor, np.nan)
            error = np.where(some, 2.0 * profile.errors[model] / self._factor, 0.0)
            data.append(dots(model, x, y, error, bars=bool(coordinate.labels)))
        name = title(coordinate.name)
        turned = " times direction" if profile.by_direction else ""
        page = layout(f"{name} ({unit})" if unit else name, f"mean{turned} ({self._unit})")
        if coordinate.logarithmic:
            page["xaxis"].update(LOGARITHMIC)
        page["shapes"] = [band("y", -self._floor, self._floor)]
        note = f"Explains {100.0 * profile.share:.1f} % of what no value of the nominal model explains"
        note += " (on unseen blocks)" if profile.share > 0.0 else ""
        both = "; its sign turns with the direction of motion." if profile.by_direction else "."
        return Figure(f"over-{coordinate.name}", f"Over the {name}", note + both, data, page)

    def ways(self, kind: str, given: Mapping[str, Profile], what: str) -> list[Figure]:
        if not given:
            return []
        coordinate = next(iter(given.values())).coordinate
        factor, unit = _reading(coordinate.unit, coordinate.edges)
        data, models = [], ("measured",) if what == "measured" else ("before", "after")
        levels = [profile.means["measured"][profile.counts > 0.0] for profile in given.values()]
        middle = float(np.concatenate(levels).mean()) if any(map(len, levels)) else 0.0
        for way, profile in given.items():
            for model in models:
                some = profile.counts > 0.0
                y = np.where(some, profile.means[model] / self._factor, np.nan)
                if model == "measured":
                    y -= middle / self._factor
                role = {"forwards": "before", "backwards": "after"}[way] if model == "measured" else model
                trace = line(role, coordinate.centres[some] / factor, y[some], name=way)
                if model != "measured":
                    trace["name"] = f"{NAMES[model]}, {way}"
                trace["mode"] = "lines+markers"
                trace["marker"] = {
                    "symbol": "triangle-right" if way == "forwards" else "triangle-left",
                    "size": 7,
                }
                trace["line"]["dash"] = "solid" if way == "forwards" else "dash"
                data.append(trace)
        page = layout(f"{title(coordinate.name)} ({unit})", f"mean ({self._unit})")
        if coordinate.logarithmic:
            page["xaxis"].update(LOGARITHMIC)
        if what == "measured":
            heading, note = (
                "Scale less motor over the travel",
                "As measured, less its mean. A gap between the ways is lost motion, a slope the lead.",
            )
        else:
            page["shapes"] = [band("y", -self._floor, self._floor)]
            heading, note = (
                "After a reversal",
                "A step that is there at once is play or Coulomb friction, one that grows is presliding.",
            )
        return [Figure(kind, heading, note, data, page)]

    def spectrum(self) -> Figure:
        rests = self._seen.rests
        data = []
        f, highest = np.zeros(1), 1e-300
        for model in ("before", "after"):
            f, density = spectral_density(rests, of_model(rests, model))
            y = np.sqrt(np.maximum(density, 0.0)) / self._factor
            highest = max(highest, float(y[1:].max()))
            data.append(line(model, f[1:], y[1:], name=NAMES[model]))
        floor = np.sqrt(floor_density(self._seen.floor, f, rests[0].scene.period_s)) / self._factor
        data.append(line("floor", f[1:], floor[1:], name="noise floor"))
        data[-1]["line"]["dash"] = "dash"
        page = layout("frequency (Hz)", f"density ({self._unit}/√Hz)")
        page["xaxis"].update(LOGARITHMIC)
        page["yaxis"].update(LOGARITHMIC)
        page["yaxis"]["range"] = [math.log10(highest) - 4.5, math.log10(highest) + 0.5]
        note = "A line is a disturbance fixed in time, a hump a resonance; the filter takes off above 60 Hz."
        return Figure("spectrum", "Spectrum", note, data, page)

    def orders(self) -> list[Figure]:
        bands, data = order_bands(self._seen.pitches), []
        for model in ("before", "after"):
            rests = self._seen.rests
            tracks = [over_turns(rest, in_phase(rest, getattr(rest, model))) for rest in rests]
            wave, height = spectrum(tracks, bands)
            if not len(wave):
                return []
            x, y = peaks(wave, height / self._factor, POINTS)
            data.append(line(model, x, y, name=NAMES[model]))
        page = layout("cycles a turn", f"amplitude ({self._unit})")
        page["xaxis"].update(LOGARITHMIC)
        marks = [("turn", 1.0)]
        pitches = self._seen.pitches
        if pitches.pole_pairs is not None:
            marks.append(("pole pair", float(pitches.pole_pairs)))
        if pitches.grating_m is not None:
            marks.append(("grating period", pitches.lead_m / pitches.grating_m))
        page["shapes"] = [upright(at) for _, at in marks]
        page["annotations"] = [mark(f"1 a {name}", at) for name, at in marks]
        note = (
            "What repeats with the way, not with time: screw, motor poles, grating. Weighted with the part "
            "of the samples that are slow enough to show it."
        )
        return [Figure("orders", "Order spectrum", note, data, page)]

    def correlation(self) -> Figure:
        white = self._seen.white
        data = [
            dots(model, packed(white[model].lags_s), white[model].correlation, None, bars=False)
            for model in ("before", "after")
        ]
        page = layout("lag (s)", "correlation with itself")
        bound = white["after"].bound
        page["shapes"] = [band("y", -bound, bound)]
        page["yaxis"]["range"] = [-1.0, 1.0]
        after = white["after"].probability
        told = "could be white noise" if after > 0.05 else "is not white: something is left in it"
        note = f"Grey band: 95 % of white noise. What is left {told} (Ljung-Box, p = {after:.2g})."
        return Figure("whiteness", "Is what is left noise?", note, data, page)


def _reading(unit: str, edges: Array) -> tuple[float, str]:
    size = float(np.sqrt(edges[0] * edges[-1])) if edges[0] > 0.0 else float(np.abs(edges).max())
    return reading(unit, size)


def _runs(mask: NDArray[np.bool_]) -> Sequence[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0))
    return [(int(first), int(last)) for first, last in zip(edges[::2], edges[1::2], strict=True)]
