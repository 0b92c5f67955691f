"""The page about one body from its recordings: parameters, signals, residuals, the next push.

In: `RecordedBody`. Out: report.html, self-contained.
"""

from collections.abc import Sequence
from pathlib import Path

import jax
import numpy as np
from jaxtyping import Float
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure
from numpy import ndarray

from mjx_inertia.estimators import EstimateStatus
from mjx_inertia.estimators.force_driven import NextPush, Predictions, predicted_pushes
from mjx_inertia.evaluation import to_data_uri
from mjx_inertia.evaluation.appearance import BLUE, GREEN, GREY, ORANGE, RED, grid_of_axes, styled
from mjx_inertia.files import write_whole
from mjx_inertia.pushing import PushRecord
from mjx_inertia.recorded.body import PushRow, RecordedBody, push_rows

_MOST_DRAWN = 12  # pushes with a figure of signals
_ARROW = 0.35  # of the object's diameter


def write_page(
    path: Path,
    name: str,
    lines: Sequence[str],
    pictures: Sequence[tuple[str, Figure]],
    rows: Sequence[Sequence[str]] = (),
    notes: Sequence[object] = (),
) -> None:
    """Writes a page about one body, whole or not at all.

    Args:
      path: of the page.
      name: of the body.
      lines: what was found, in sentences.
      pictures: figures with their titles.
      rows: a table of single pushes, see the template.
      notes: settings and the like, at the end.
    """
    environment = Environment(
        loader=PackageLoader("mjx_inertia.recorded", "."),
        autoescape=True,
        undefined=StrictUndefined,
    )
    text = environment.get_template("report.html.j2").render(
        name=name,
        lines=lines,
        rows=rows,
        pictures=[(title, Markup(to_data_uri(figure))) for title, figure in pictures],
        notes=notes,
    )
    write_whole(path, text)


def write_recorded_report(path: Path, found: RecordedBody) -> None:
    """Writes the page of a body from its recordings."""
    pictures = [("The pushes, seen from above", _plan(found))]
    pictures += [(f"Signals of {name}", figure) for name, figure in _signals(found)]
    rows = [_cells(row) for row in push_rows(found)]
    notes = (found.instrument, found.settings)
    write_page(path, found.pushes[0].obj.name, found.explain().split("\n"), pictures, rows, notes)


def _cells(row: PushRow) -> list[str]:
    def number(value: float | None, sd: float | None, scale: float, digits: int) -> str:
        if value is None or sd is None:
            return "–"
        return f"{scale * value:.{digits}f} ± {scale * 2 * sd:.{digits}f}"

    com = ["–", "–"]
    if row.com_m is not None and row.com_sd_m is not None:
        pairs = zip(row.com_m, row.com_sd_m, strict=True)
        com = [number(value, sd, 1e3, 1) for value, sd in pairs]
    return [
        Path(row.file).name,
        number(row.mass_kg, row.mass_sd_kg, 1.0, 3),
        number(row.inertia_zz_kgm2, row.inertia_zz_sd_kgm2, 1e3, 2),
        *com,
        number(row.newton_mass_kg, row.newton_mass_sd_kg, 1.0, 3),
        row.status,
    ]


@styled()
def _plan(found: RecordedBody) -> Figure:
    """The outline with the first contact of each push, the CoM, and the next push."""
    obj = found.pushes[0].obj
    figure, ((axes,),) = grid_of_axes(1, 1, 4.2)
    closed = 1e3 * np.concatenate([obj.outline, obj.outline[:1]])
    axes.fill(*closed.T, facecolor="#EEF1F4", edgecolor=GREY)
    length = 1e3 * _ARROW * obj.mean_diameter
    for number, push in enumerate(found.pushes, 1):
        point, normal = _in_object(push.record)
        tail = 1e3 * point - length * normal
        style = {"arrowstyle": "->", "color": BLUE, "lw": 1.2}
        axes.annotate("", 1e3 * point, tail, arrowprops=style)
        axes.text(*tail, f"{number}", color=BLUE, ha="center", va="center", fontsize=8)
    if found.status == EstimateStatus.OK and found.fit is not None:
        axes.plot(*(1e3 * found.fit.mean[2:]), "+", color=RED, ms=10, label="CoM")
        planned = _planned(found)
        if planned is not None:
            end = 1e3 * planned.contact_point
            tail = end - 1.3 * length * planned.direction
            style = {"arrowstyle": "-|>", "color": GREEN, "lw": 2.5}
            axes.annotate("", end, tail, arrowprops=style)
            label = f"next push, {1e3 * planned.speed:.0f} mm/s from rest"
            axes.plot([], [], color=GREEN, lw=2.5, label=label)
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes.set(aspect="equal", xlabel="x, mm (frame of the outline)", ylabel="y, mm")
    axes.margins(0.6)
    return figure


def _planned(found: RecordedBody) -> NextPush | None:
    try:
        return found.next_push()
    except ValueError:
        return None


def _in_object(record: PushRecord) -> tuple[np.ndarray, np.ndarray]:
    """First contact point and inward normal in the object's frame."""
    pose = np.asarray(record.pose, float)[0]
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    R_obj_world = np.array([[cos, sin], [-sin, cos]])
    point = R_obj_world @ (np.asarray(record.contact_point, float) - pose[:2])
    return point, R_obj_world @ np.asarray(record.contact_normal, float)


def _signals(found: RecordedBody) -> Sequence[tuple[str, Figure]]:
    if found.fit is None:
        return []
    used = [p for p, a in zip(found.pushes, found.alone, strict=True) if a is not None]
    with jax.enable_x64(True):
        predicted = jax.tree.map(
            np.asarray, predicted_pushes(found.fit.z, found.fit.samples, found.settings)
        )
    figures = []
    for k, push in enumerate(used[:_MOST_DRAWN]):
        count = int(np.sum(found.fit.samples.used[k])) - 1
        time = float(found.fit.samples.interval[k]) * np.arange(1, count + 1)
        figures.append((Path(push.file).name, _signals_figure(found, k, predicted, time)))
    return figures


@styled()
def _signals_figure(
    found: RecordedBody, k: int, predicted: Predictions, time: Float[ndarray, " t"]
) -> Figure:
    """Force, measured and fitted motion, and what the prediction missed, of one push."""
    assert found.fit is not None
    samples, count = found.fit.samples, len(time)
    figure, axes = grid_of_axes(1, 3, 2.5)
    force, motion, error = axes[0]
    for i, (axis, color) in enumerate((("x", BLUE), ("y", ORANGE))):
        force.plot(time, samples.force[k, 1 : count + 1, i], color=color, label=f"F{axis}")
        way = 1e3 * (samples.pose[k, : count + 1, i] - samples.pose[k, 0, i])
        fitted = 1e3 * (predicted.pose[k, :count, i] - samples.pose[k, 0, i])
        motion.plot(time, way[1:], color=color, lw=3, alpha=0.35, label=f"measured {axis}")
        motion.plot(time, fitted, color=color, lw=1, label=f"predicted {axis}")
        missed = 1e3 * (samples.pose[k, 1 : count + 1, i] - predicted.pose[k, :count, i])
        error.plot(time, missed, color=color, lw=0.9, label=f"{axis}, mm")
    turned = 1e3 * (samples.pose[k, 1 : count + 1, 2] - predicted.pose[k, :count, 2])
    error.plot(time, 0.1 * turned, color=GREEN, lw=0.9, label="yaw, 10 mrad")
    force.set(xlabel="time, s", title="Force on the object, N")
    motion.set(xlabel="time, s", title="Displacement, mm")
    error.set(xlabel="time, s", title="Error of one-step predictions")
    for panel in (force, motion, error):
        panel.legend()
    return figure
