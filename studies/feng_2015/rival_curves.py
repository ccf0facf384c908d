"""Draw every setting of every rival that the rule has tried: J over the observers' bandwidth, and over Ms.

python -m studies.feng_2015.rival_curves docs/friction_waveforms.json docs/friction_rivals.png
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from servo_ctrl.plots.figures import save
from servo_ctrl.plots.matplotlib_agg import Figure
from studies.feng_2015.rival_tuning import NOISE_SHARE, SENSITIVITY_LIMIT

AXES = ("x", "y")
BANDWIDTH = "bandwidth_hz"
MARKERS = "osD^vPX"


def allowed(entry: dict[str, Any], plain_noise_n_um: float) -> bool:
    """Whether a setting keeps the rule's bounds of Ms and noise."""
    return bool(entry["Ms"] <= SENSITIVITY_LIMIT and entry["noise_n_um"] <= NOISE_SHARE * plain_noise_n_um)


def plot_rivals(path: Path, rivals: Sequence[dict[str, Any]]) -> None:
    """Draw a column for each axis; hollow: outside the bounds; ringed: chosen, the least J within them."""
    figure = Figure(figsize=(10.4, 7.4))
    panels = figure.subplots(2, len(AXES), sharey="row")
    for column, axis in enumerate(AXES):
        plain = next(r for r in rivals if "level_n" in r["setting"][axis])["robustness"][axis]["noise_n_um"]
        for number, rival in enumerate(rivals):
            colour, curve = f"C{number}", rival["curve"][axis]
            within = [entry for entry in curve if allowed(entry, plain)]
            best = min(within, key=lambda entry: float(entry["J_um"]))
            over = ["Ms", BANDWIDTH] if BANDWIDTH in rival["setting"][axis] else ["Ms"]
            for key in over:
                panel = panels[int(key == "Ms")][column]
                if key == BANDWIDTH:
                    panel.plot([e[key] for e in curve], [e["J_um"] for e in curve], color=colour, lw=1.0)
                for entry in curve:
                    face = colour if entry in within else "white"
                    marker, label = MARKERS[number], rival["name"] if entry is curve[0] else None
                    panel.plot(
                        entry[key], entry["J_um"], marker, color=colour, mfc=face, ms=5, ls="", label=label
                    )
                panel.plot(best[key], best["J_um"], "o", mfc="none", mec="black", ms=11)
        panels[0][column].set_title(f"axis {axis}", fontsize=10)
        panels[0][column].set_xlabel("bandwidth of the observer (Hz)")
        panels[1][column].set_xlabel("Ms")
        panels[1][column].axvline(SENSITIVITY_LIMIT, color="0.5", lw=0.8)
        for panel in panels[:, column]:
            panel.set_ylim(bottom=0.0)
            panel.grid(alpha=0.3)
    for row in panels:
        row[0].set_ylabel("mean J of the tuning strokes (um)")
        row[0].legend(fontsize=7)
    save(figure, path)


def main() -> None:
    """Read what `waveform_robustness` has written, and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("figures", type=Path, help="docs/friction_waveforms.json")
    parser.add_argument("picture", type=Path, help="the PNG to draw")
    arguments = parser.parse_args()
    document = json.loads(arguments.figures.read_text(encoding="utf-8"))
    plot_rivals(arguments.picture, document["rivals"])


if __name__ == "__main__":
    main()
