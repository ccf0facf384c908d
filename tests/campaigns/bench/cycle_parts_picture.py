"""Draw where a cycle's microseconds go, of the figures that `cycle_parts` has written.

python -m tests.campaigns.bench.cycle_parts_picture docs/cycle_parts.json docs/cycle_parts.png
"""

import json
from pathlib import Path
from typing import Annotated

import matplotlib.pyplot as plt
import typer

SMALL_US = 1.2
"""A part below this gets no text in its bar; chosen."""


def main(
    json_file: Annotated[Path, typer.Argument(help="What `cycle_parts` has written.")],
    picture: Annotated[Path, typer.Argument(help="The PNG to draw.")],
) -> None:
    """Draw a bar for each side and each label, a piece of it for each part."""
    measured = json.loads(json_file.read_text(encoding="utf-8"))
    bars = [(side, label) for side in ("controller", "simulator") for label in measured]
    names = list(
        dict.fromkeys(part for entry in measured.values() for parts in entry["us"].values() for part in parts)
    )
    colours = dict(zip(names, plt.colormaps["tab20"].colors, strict=False))
    figure, axes = plt.subplots(figsize=(9.0, 3.4), layout="constrained")
    for row, (side, label) in enumerate(bars):
        left = 0.0
        for part, taken_us in measured[label]["us"][side].items():
            axes.barh(row, taken_us, left=left, color=colours[part], edgecolor="white")
            if taken_us > SMALL_US:
                text = f"{part}\n{taken_us:.1f}" if taken_us > 4.0 * SMALL_US else f"{taken_us:.1f}"
                axes.text(left + taken_us / 2, row, text, ha="center", va="center", fontsize=6)
            left += taken_us
        axes.text(left + 0.4, row, f"{left:.0f} us", va="center", fontsize=8)
    axes.set_yticks(range(len(bars)), [f"{side}, {label}" for side, label in bars], fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("us a cycle, two axes in lockstep")
    axes.spines[["top", "right"]].set_visible(False)
    handles = [plt.Rectangle((0, 0), 1, 1, color=colours[name]) for name in names]
    axes.legend(handles, names, fontsize=6, ncols=5, loc="upper center", bbox_to_anchor=(0.45, -0.2))
    figure.savefig(picture, dpi=130)


if __name__ == "__main__":
    typer.run(main)
