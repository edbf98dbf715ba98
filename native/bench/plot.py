# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the results of `compare` and writes them as tables.

    /usr/bin/python3 native/bench/plot.py RESULTS_FOLDER [--images docs/images] [--only FIGURE ...]

RESULTS_FOLDER holds NAME.jsonl for each figure of figure_table.py; figures without one are left
out. The pictures are written to IMAGES/NAME.svg, the tables to RESULTS_FOLDER/summary.md. A point
combines all seeds of a run: the root mean square of the errors and the median of the times. Bars
extend from the least to the largest value.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np

sys.dont_write_bytecode = True
matplotlib.use("svg")

from figure_table import FIGURES, Figure  # noqa: E402
from matplotlib import pyplot  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402

STYLE = {
    'axes.grid': True, 'grid.color': '0.9', 'grid.linewidth': 0.6, 'axes.spines.top': False,
    'axes.spines.right': False, 'font.size': 9, 'legend.frameon': False, 'legend.fontsize': 8,
    'svg.fonttype': 'none', 'svg.hashsalt': 'raybundle', 'lines.markersize': 4.5,
    'lines.linewidth': 1.3,
}
COLORS = pyplot.get_cmap('tab10').colors
MARKERS = "osD^vPX*<>"
LINE_STYLES = ('-', '--')
# Pixels per mean patch that lines_per_bundle = 0 aims at (native/src/bake/trace.cpp).
AUTOMATIC_PIXELS = 2.0
# Noise levels for which the time is read from the curves.
NOISES_OF_INTEREST = (0.05, 0.02, 0.01)


@dataclass(frozen=True)
class Point:
    """All seeds of one run on one scene."""

    rows: list[dict]
    error: str

    def median(self, value: Callable[[dict], float]) -> float:
        return float(np.median([value(row) for row in self.rows]))

    def noises(self) -> np.ndarray:
        return np.array([row[self.error]['noise'] for row in self.rows])

    @property
    def noise(self) -> float:
        return float(np.sqrt(np.mean(self.noises() ** 2)))

    @property
    def seconds(self) -> float:
        return self.median(lambda row: row['seconds']['total'])


def _pixel_per_patch(point: Point) -> float:
    row = point.rows[0]
    lines = float(row['settings']['lines_per_bundle'])
    return np.pi * row['scene_radius'] ** 2 / lines / row['patch_area']


# Key of an axis -> its label, the value of a point, and whether its scale is logarithmic.
AXES: dict[str, tuple[str, Callable[[Point], float], bool]] = {
    'x': ("local and global lines in all", lambda p: p.rows[0]['x'], True),
    'planes': ("planes per direction", lambda p: p.rows[0]['x'], True),
    'bundles': ("bundles", lambda p: p.rows[0]['bundles'], True),
    'seconds': ("seconds, whole bake", lambda p: p.seconds, True),
    'seconds_bundles': (
        "seconds, bundles and solve",
        lambda p: p.median(lambda row: row['seconds']['bundles'] + row['seconds']['solve']), True),
    'pixel_per_patch': ("pixel area / mean patch area", _pixel_per_patch, True),
    'noise': ("relative RMSE, %", lambda p: 100 * p.noise, True),
    'bias': ("bias, %", lambda p: 100 * np.mean([row[p.error]['bias'] for row in p.rows]), False),
}
ERROR_NAMES = {'error': "all light", 'error_indirect': "indirect light",
               'error_unlit': "all light, on sides without direct light"}

Curves = dict[str, list[Point]]  # points by label of the curve


def read_curves(path: Path, error: str) -> dict[str, Curves]:
    """Returns the curves of each scene, with curves and points in the order of the file."""
    groups: dict[tuple[str, str, str], list[dict]] = {}
    for line in path.read_text().splitlines():
        row = json.loads(line)
        key = (row['scene'], row['label'], json.dumps(row['settings'], sort_keys=True))
        groups.setdefault(key, []).append(row)
    scenes: dict[str, Curves] = {}
    for (scene, label, _), rows in groups.items():
        scenes.setdefault(scene, {}).setdefault(label, []).append(Point(rows, error))
    return scenes


def draw(results: Path, images: Path, names: Sequence[str]) -> None:
    images.mkdir(parents=True, exist_ok=True)
    summary = []
    for figure in FIGURES:
        path = results / f"{figure.name}.jsonl"
        if figure.name not in names or not path.exists() or path.stat().st_size == 0:
            continue
        scenes = read_curves(path, figure.error)
        summary.append(f"## {figure.title}")
        if figure.claim:
            summary.append(f"Thesis: {figure.claim}.")
        if figure.draws_table:
            summary += speed_up_table(scenes)
            continue
        with matplotlib.rc_context(STYLE):
            draw_figure(figure, scenes, images / f"{figure.name}.svg")
        summary += figure_table(figure, scenes)
    (results / "summary.md").write_text("\n\n".join(summary) + "\n")


# --------------------------------------------------------------------------------------------------
# Diagrams
# --------------------------------------------------------------------------------------------------


def draw_figure(figure: Figure, scenes: dict[str, Curves], path: Path) -> None:
    places = [(scene, panel) for scene in scenes for panel in figure.panels]
    # One row per scene, unless there is only one diagram per scene. The legend has its own cell.
    columns = len(figure.panels) if len(figure.panels) > 1 else min(3, len(places))
    rows = -(-len(places) // columns)
    beside = len(places) == rows * columns
    picture, grid = pyplot.subplots(
        rows, columns + beside, figsize=(3.4 * columns + 2.2 * beside, 3.1 * rows), squeeze=False,
        layout='constrained', width_ratios=[1.0] * columns + [0.6] * beside)
    axes = list(grid[:, :columns].ravel())
    for axis in axes[len(places):] + list(grid[:, columns:].ravel()):
        axis.axis('off')
    legend = grid[0, columns] if beside else axes[len(places)]
    styles = curve_styles(scenes)
    for axis, (scene, panel) in zip(axes, places):
        draw_panel(axis, panel, scenes[scene], styles)
        axis.set_title(scene, fontsize=9)
    handles = {label: line for axis in axes[:len(places)]
               for line, label in zip(*axis.get_legend_handles_labels())}
    legend.legend(handles.values(), handles.keys(), loc='center left')
    picture.suptitle(f"{figure.title} ({ERROR_NAMES[figure.error]})", fontsize=10)
    picture.savefig(path, metadata={'Date': None})
    pyplot.close(picture)


def curve_styles(scenes: dict[str, Curves]) -> dict[str, dict]:
    labels = list(dict.fromkeys(label for curves in scenes.values() for label in curves))
    return {label: {'color': COLORS[k % len(COLORS)], 'marker': MARKERS[k % len(MARKERS)],
                    'linestyle': LINE_STYLES[k // len(COLORS) % 2]}
            for k, label in enumerate(labels)}


def draw_panel(axis: Axes, panel, curves: Curves, styles: dict[str, dict]) -> None:
    x_name, x_value, x_log = AXES[panel.x]
    y_name, y_value, y_log = AXES[panel.y]
    for label, points in curves.items():
        points = sorted(points, key=x_value)
        x, y = [x_value(p) for p in points], [y_value(p) for p in points]
        axis.plot(x, y, label=label.replace("_", " ").replace(",", ", "), **styles[label])
        if panel.y == 'noise' and len(points[0].rows) > 1:
            low, high = zip(*((100 * p.noises().min(), 100 * p.noises().max()) for p in points))
            axis.vlines(x, low, high, color=styles[label]['color'], alpha=0.35)
    axis.set_xscale('log' if x_log else 'linear')
    axis.set_yscale('log' if y_log else 'linear')
    if panel.x == 'pixel_per_patch':
        axis.axvline(1 / AUTOMATIC_PIXELS, color='0.5', linestyle=':')
        axis.annotate("automatic", (1 / AUTOMATIC_PIXELS, 0.97),
                      xycoords=('data', 'axes fraction'), rotation=90, va='top', ha='right',
                      fontsize=7, color='0.4')
    for scale, log in ((axis.xaxis, x_log), (axis.yaxis, y_log)):
        if log:
            plain_ticks(scale)
    axis.set_xlabel(x_name)
    axis.set_ylabel(y_name)


def plain_ticks(scale) -> None:
    """Sets the ticks 1 2 5 10 20 50 ... instead of powers of ten, unless there are many decades."""
    low, high = scale.get_view_interval()
    if np.log10(high / low) > 3.5:
        return
    scale.set_major_locator(matplotlib.ticker.LogLocator(subs=(1, 2, 5), numticks=20))
    scale.set_major_formatter(matplotlib.ticker.FuncFormatter(short))
    scale.set_minor_formatter(matplotlib.ticker.NullFormatter())
    if scale.axis_name == 'x' and np.log10(high / low) > 1.7:
        scale.set_major_locator(matplotlib.ticker.LogLocator(subs=(1, 3), numticks=20))


def short(value: float, _position: int = 0) -> str:
    if value >= 1e6:
        return f"{value / 1e6:g}M"
    return f"{value / 1e3:g}k" if value >= 1e4 else f"{value:g}"


# --------------------------------------------------------------------------------------------------
# Tables
# --------------------------------------------------------------------------------------------------


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def figure_table(figure: Figure, scenes: dict[str, Curves]) -> Iterator[str]:
    x_name, x_value, _ = AXES[figure.panels[0].x]
    _, bundle_seconds, _ = AXES['seconds_bundles']
    _, bias, _ = AXES['bias']
    for scene, curves in scenes.items():
        rows = [[label, f"{x_value(p):.4g}", f"{100 * p.noise:.3g}", f"{bias(p):+.2g}",
                 f"{100 * p.median(lambda row: row['stated_error']):.3g}",
                 f"{bundle_seconds(p):.3g}", f"{p.seconds:.3g}",
                 f"{p.median(lambda row: row['peak_memory_bytes']) / 1e6:.0f}"]
                for label, points in curves.items() for p in sorted(points, key=x_value)]
        seeds = len(next(iter(curves.values()))[0].rows)
        yield f"`{scene}`, {ERROR_NAMES[figure.error]}, {seeds} seeds:"
        yield table(["curve", x_name, "RMSE %", "bias %", "stated % (all light)",
                     "s, bundles and solve", "s, whole", "MB"], rows)
        if figure.panels[0].x == 'seconds':
            yield f"`{scene}`, seconds to a noise of:"
            yield table(["curve"] + [f"{100 * noise:g} %" for noise in NOISES_OF_INTEREST],
                        [[label] + [time_to(noise, points) for noise in NOISES_OF_INTEREST]
                         for label, points in curves.items()])


def time_to(noise: float, points: list[Point]) -> str:
    """Returns the time at which a curve reaches a noise, interpolated in the logarithms.

    Outside the curve the result is a bound; nothing is extrapolated.
    """
    points = sorted(points, key=lambda p: p.seconds)
    if points[0].noise <= noise:
        return f"< {points[0].seconds:.2g}"
    for a, b in zip(points, points[1:]):
        if b.noise <= noise < a.noise:
            share = np.log(a.noise / noise) / np.log(a.noise / b.noise)
            return f"{a.seconds * (b.seconds / a.seconds) ** share:.2g}"
    return f"> {points[-1].seconds:.2g}"


def speed_up_table(scenes: dict[str, Curves]) -> Iterator[str]:
    """Yields tables of speed-up and efficiency, relative to one thread, for each stage."""
    stages = {"first shot": lambda row: row['seconds']['first_shot'],
              "bundles": lambda row: row['seconds']['bundles'],
              "whole": lambda row: row['seconds']['total']}
    for scene, curves in scenes.items():
        rows = []
        for label, points in curves.items():
            single = next(p for p in points if p.rows[0]['threads'] == 1)
            for point in points:
                threads = point.rows[0]['threads']
                cells = [label.replace("_", " "), str(threads)]
                for value in stages.values():
                    ratio = single.median(value) / point.median(value)
                    cells.append(f"{point.median(value):.3f} s, {ratio:.2f}, "
                                 f"{ratio / threads:.2f}")
                rows.append(cells + [f"{100 * point.noise:.4g}"])
        yield f"`{scene}`; time, speed-up, efficiency; medians of {len(point.rows)} runs:"
        yield table(["", "threads", *stages, "RMSE %"], rows)


def main() -> None:
    names = [figure.name for figure in FIGURES]
    parser = argparse.ArgumentParser(prog="plot", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path)
    parser.add_argument("--images", type=Path,
                        default=Path(__file__).parent.parent.parent / "docs/images")
    parser.add_argument("--only", nargs="+", choices=names, default=names, metavar="FIGURE")
    arguments = parser.parse_args()
    draw(arguments.results, arguments.images, arguments.only)


if __name__ == "__main__":
    main()
