"""The pictures of one difference, as plotly.js takes them: data and layout, colours by their role.

A colour is the name of a CSS variable (`--before`); the page puts in what it is in light or in dark.
"""

from __future__ import annotations

import html
import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from reconcile.catalogue.kinds import Sense
from reconcile.locate_lines import spectrum
from reconcile.locate_noise import floor_density, spectral_density
from reconcile.locate_pitches import order_bands, over_turns
from reconcile.report_series import extremes, packed, peaks
from reconcile.report_words import reading, title
from reconcile.views import MODELS, of_model, over_travel, profiles, since_reversal

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from reconcile.rests import Rest
    from reconcile.views import Profile, View

    Array = NDArray[np.float64]

NAMES = {"before": "nominal model", "refitted": "its values refitted", "after": "with what was found"}
DASHES = {"before": "solid", "refitted": "dot", "after": "solid"}
SYMBOLS = {"before": "circle-open", "refitted": "diamond-open", "after": "square"}
LOGARITHMIC = {"type": "log", "dtick": 1, "exponentformat": "power"}
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
    found = [pen.time(rest, number, buckets) for number, rest in enumerate(seen.rests)]
    if seen.sense is Sense.DEVIATION:
        found += pen.ways("scale-less-motor", over_travel(seen), "measured")
    found += [pen.profile(profile) for profile in profiles(seen)]
    found += pen.ways("since-reversal", since_reversal(seen), "rests")
    return [*found, pen.spectrum(), *pen.orders(), pen.correlation()]


class _Pen:
    """One difference in one unit."""

    def __init__(self, seen: View, factor: float, unit: str) -> None:
        self._seen, self._factor, self._unit = seen, factor, unit
        self._what = "force missed" if seen.sense is Sense.FORCE else "scale less motor, missed"
        self._floor = seen.floor.rms / factor

    def time(self, rest: Rest, number: int, buckets: int) -> Figure:
        t = rest.scene.time_s
        data = []
        for model in MODELS:
            y = np.where(rest.used, getattr(rest, model) / self._factor, np.nan)
            x, y = extremes(t, y, buckets)
            data.append(self._line(model, x, y, name=NAMES[model]))
        x, y = extremes(t, rest.scene.motion.position_m * 1e3, buckets // 2)
        position = self._line("position", x, y, name="position")
        data.append({**position, "yaxis": "y2", "showlegend": False})
        band = _band("y", -2.0 * self._floor, 2.0 * self._floor)
        held = [_held(float(t[a]), float(t[b - 1])) for a, b in _runs(rest.held_out)]
        layout = _layout("time (s)", f"{self._what} ({self._unit})")
        layout["xaxis"].update(anchor="y2", domain=[0.0, 1.0])
        layout["yaxis"]["domain"] = [0.3, 1.0]
        layout["yaxis2"] = {**_axis("position (mm)"), "domain": [0.0, 0.22]}
        layout["shapes"] = [*held, band]
        layout["height"] = 430
        note = f"{rest.source}. Grey band: noise floor, twice its RMS of {self._floor:.3g} {self._unit}."
        note += " Shaded stretches were held out: nothing was fitted to them." if held else ""
        return Figure(f"time-{number}", "Over time", note, data, layout)

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
            data.append(self._dots(model, x, y, error, bars=bool(coordinate.labels)))
        name = title(coordinate.name)
        turned = ", turned round with the direction" if profile.by_direction else ""
        layout = _layout(f"{name} ({unit})" if unit else name, f"mean{turned} ({self._unit})")
        if coordinate.logarithmic:
            layout["xaxis"].update(LOGARITHMIC)
        layout["shapes"] = [_band("y", -self._floor, self._floor)]
        note = f"Explains {100.0 * profile.share:.1f} % of what no value of the nominal model explains"
        note += " (on unseen blocks)" if profile.share > 0.0 else ""
        both = "; its sign turns with the direction of motion." if profile.by_direction else "."
        return Figure(f"over-{coordinate.name}", f"Over the {name}", note + both, data, layout)

    def ways(self, kind: str, given: Mapping[str, Profile], what: str) -> list[Figure]:
        if not given:
            return []
        coordinate = next(iter(given.values())).coordinate
        factor, unit = _reading(coordinate.unit, coordinate.edges)
        data, models = [], ("measured",) if what == "measured" else ("before", "after")
        for way, profile in given.items():
            for model in models:
                some = profile.counts > 0.0
                y = np.where(some, profile.means[model] / self._factor, np.nan)
                if model == "measured":
                    y -= np.nanmean(y)
                role = {"forwards": "before", "backwards": "after"}[way] if model == "measured" else model
                trace = self._line(role, coordinate.centres[some] / factor, y[some], name=way)
                if model != "measured":
                    trace["name"] = f"{NAMES[model]}, {way}"
                trace["mode"] = "lines+markers"
                trace["marker"] = {
                    "symbol": "triangle-right" if way == "forwards" else "triangle-left",
                    "size": 7,
                }
                trace["line"]["dash"] = "solid" if way == "forwards" else "dash"
                data.append(trace)
        quantity = "mean of scale less motor" if what == "measured" else f"mean of {self._what}"
        layout = _layout(f"{title(coordinate.name)} ({unit})", f"{quantity} ({self._unit})")
        if coordinate.logarithmic:
            layout["xaxis"].update(LOGARITHMIC)
        if what == "measured":
            heading, note = (
                "Scale less motor over the travel",
                "As measured, less its mean. A gap between the ways is lost motion, a slope the lead.",
            )
        else:
            layout["shapes"] = [_band("y", -self._floor, self._floor)]
            heading, note = (
                "After a reversal",
                "A step that is there at once is play or Coulomb friction, one that grows is presliding.",
            )
        return [Figure(kind, heading, note, data, layout)]

    def spectrum(self) -> Figure:
        rests = self._seen.rests
        data = []
        f = np.zeros(1)
        for model in ("before", "after"):
            f, density = spectral_density(rests, of_model(rests, model))
            y = np.sqrt(np.maximum(density, 0.0)) / self._factor
            data.append(self._line(model, f[1:], y[1:], name=NAMES[model]))
        floor = np.sqrt(floor_density(self._seen.floor, f, rests[0].scene.period_s)) / self._factor
        data.append(self._line("floor", f[1:], floor[1:], name="noise floor"))
        data[-1]["line"]["dash"] = "dash"
        layout = _layout("frequency (Hz)", f"density ({self._unit}/√Hz)")
        layout["xaxis"].update(LOGARITHMIC)
        layout["yaxis"].update(LOGARITHMIC)
        top = max(float(np.max(np.sqrt(density))) / self._factor, 1e-300)
        layout["yaxis"]["range"] = [math.log10(top) - 4.0, math.log10(top) + 1.0]
        note = "A line is a disturbance fixed in time, a hump a resonance; the filter takes off above 60 Hz."
        return Figure("spectrum", "Spectrum", note, data, layout)

    def orders(self) -> list[Figure]:
        bands, data = order_bands(self._seen.pitches), []
        for model in ("before", "after"):
            tracks = [over_turns(rest, getattr(rest, model)) for rest in self._seen.rests]
            wave, height = spectrum(tracks, bands)
            if not len(wave):
                return []
            x, y = peaks(wave, height / self._factor, POINTS)
            data.append(self._line(model, x, y, name=NAMES[model]))
        layout = _layout("cycles a turn", f"amplitude ({self._unit})")
        layout["xaxis"].update(LOGARITHMIC)
        marks = [("turn", 1.0)]
        pitches = self._seen.pitches
        if pitches.pole_pairs is not None:
            marks.append(("pole pair", float(pitches.pole_pairs)))
        if pitches.grating_m is not None:
            marks.append(("grating period", pitches.lead_m / pitches.grating_m))
        layout["shapes"] = [_upright(at) for _, at in marks]
        layout["annotations"] = [_mark(f"1 a {name}", at) for name, at in marks]
        note = "What repeats with the way, not with time: screw, motor poles, grating."
        return [Figure("orders", "Order spectrum", note, data, layout)]

    def correlation(self) -> Figure:
        white = self._seen.white
        data = [
            self._dots(model, packed(white[model].lags_s), white[model].correlation, None, bars=False)
            for model in ("before", "after")
        ]
        layout = _layout("lag (s)", "correlation with itself")
        bound = white["after"].bound
        layout["shapes"] = [_band("y", -bound, bound)]
        layout["yaxis"]["range"] = [-1.0, 1.0]
        after = white["after"].probability
        told = "could be white noise" if after > 0.05 else "is not white: something is left in it"
        note = f"Grey band: 95 % of white noise. What is left {told} (Ljung-Box, p = {after:.2g})."
        return Figure("whiteness", "Is what is left noise?", note, data, layout)

    @staticmethod
    def _line(role: str, x: Array, y: Array, *, name: str) -> dict[str, Any]:
        line: dict[str, Any] = {"color": f"--{role}", "width": 1.4, "dash": DASHES.get(role, "solid")}
        trace = {
            "type": "scatter",
            "mode": "lines",
            "name": name,
            "x": packed(x),
            "y": packed(y),
            "line": line,
        }
        return {**trace, "visible": "legendonly"} if role == "refitted" else trace

    @staticmethod
    def _dots(model: str, x: Any, y: Array, error: Array | None, *, bars: bool) -> dict[str, Any]:
        trace: dict[str, Any] = {
            "type": "scatter",
            "mode": "markers" if bars else "lines+markers",
            "name": NAMES[model],
            "x": x,
            "y": packed(y),
            "line": {"color": f"--{model}", "width": 1.4, "dash": DASHES[model]},
            "marker": {"color": f"--{model}", "symbol": SYMBOLS[model], "size": 10 if bars else 6},
        }
        if error is not None:
            trace["error_y"] = {"array": packed(error), "color": f"--{model}", "thickness": 1, "width": 2}
        return {**trace, "visible": "legendonly"} if model == "refitted" else trace


def _reading(unit: str, edges: Array) -> tuple[float, str]:
    size = float(np.sqrt(edges[0] * edges[-1])) if edges[0] > 0.0 else float(np.abs(edges).max())
    return reading(unit, size)


def _layout(x: str, y: str) -> dict[str, Any]:
    return {
        "xaxis": _axis(x),
        "yaxis": _axis(y),
        "height": 320,
        "margin": {"l": 62, "r": 12, "t": 28, "b": 46},
        "paper_bgcolor": "--card",
        "plot_bgcolor": "--card",
        "font": {"color": "--ink", "size": 12, "family": "system-ui, sans-serif"},
        "legend": {"orientation": "h", "x": 0.0, "y": 1.02, "yanchor": "bottom"},
        "hovermode": "closest",
    }


def _axis(text: str) -> dict[str, Any]:
    return {
        "title": {"text": text, "standoff": 8},
        "gridcolor": "--grid",
        "zerolinecolor": "--line",
        "linecolor": "--line",
        "automargin": True,
    }


def _band(axis: str, low: float, high: float) -> dict[str, Any]:
    place = {"x0": 0.0, "x1": 1.0, "xref": "paper", "y0": low, "y1": high, "yref": axis}
    return {"type": "rect", **place, "fillcolor": "--floor-band", "line": {"width": 0}, "layer": "below"}


def _held(start_s: float, end_s: float) -> dict[str, Any]:
    place = {"x0": start_s, "x1": end_s, "xref": "x", "y0": 0.0, "y1": 1.0, "yref": "paper"}
    return {"type": "rect", **place, "fillcolor": "--held-out", "line": {"width": 0}, "layer": "below"}


def _upright(at: float) -> dict[str, Any]:
    place = {"x0": at, "x1": at, "xref": "x", "y0": 0.0, "y1": 1.0, "yref": "paper"}
    return {"type": "line", **place, "line": {"color": "--line", "width": 1, "dash": "dot"}, "layer": "below"}


def _mark(text: str, at: float) -> dict[str, Any]:
    place = {"x": math.log10(at), "xref": "x", "y": 1.0, "yref": "paper", "yanchor": "top", "xanchor": "left"}
    return {"text": text, **place, "showarrow": False, "font": {"color": "--faint", "size": 11}}


def _runs(mask: NDArray[np.bool_]) -> Sequence[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0))
    return [(int(first), int(last)) for first, last in zip(edges[::2], edges[1::2], strict=True)]
