"""Objects with their figures: a table, and a sheet of pictures with CoM and principal axes.

In: `ObjectModel`s, a path. Out: plain text; one PNG, or a page of HTML that holds its pictures.
Red, green and blue lines are the axes of the smallest, the middle and the largest principal moment,
as long as those of the uniform ellipsoid with the same mass and tensor.
"""

import base64
import dataclasses
import io
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from jaxtyping import Float
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imsave
from matplotlib.patheffects import Normal, Stroke
from numpy import ndarray
from tqdm import tqdm

from mjx_inertia import runtime
from mjx_inertia.command import aligned
from mjx_inertia.files import check_writable, write_whole
from mjx_inertia.objects.model import ObjectModel
from mjx_inertia.objects.picture import Picture, View, draw_meshes

_AXIS_COLORS = ("#1f6fd0", "#1d9a4a", "#d62728")  # largest moment first
_INK, _SOFT = "#1d2329", "#5b6570"
_KEY = (
    "circle: centre of mass; lines: principal axes of the smallest (red), middle (green) and "
    "largest (blue) moment"
)
_CELL, _TEXT, _HEADING, _MARGIN = 240, 46, 46, 24  # pixels
_DPI = 100


@dataclasses.dataclass(frozen=True, eq=False)
class ObjectSummary:
    """Figures of one object, in the units that one would say them in."""

    name: str  # of the object
    category: str  # of the catalogue
    size_mm: Float[ndarray, "3"]  # extents along x, y, z
    mass: float  # kg
    com_mm: Float[ndarray, "3"]  # in the object frame
    moments: Float[ndarray, "3"]  # principal moments about the CoM, largest first, kg m²
    axes: Float[ndarray, "3 3"]  # of these moments, rows, unit vectors in the object frame
    # of the uniform ellipsoid with the same mass and tensor, along `axes`, m
    semi_axes: Float[ndarray, "3"]


def summarize_object(obj: ObjectModel) -> ObjectSummary:
    """The figures of an object."""
    mass = float(obj.inertial.mass)
    moments, axes = np.linalg.eigh(np.asarray(obj.inertial.inertia, np.float64))
    moments, axes = moments[::-1], axes.T[::-1]
    # an ellipsoid has I₁ = m (b² + c²) / 5, so a² = 5 (I₁ + I₂ + I₃ - 2 I₁) / (2 m)
    squares = 2.5 * (moments.sum() - 2.0 * moments) / mass
    return ObjectSummary(
        name=obj.name,
        category=obj.category,
        size_mm=2e3 * obj.half_extents,
        mass=mass,
        com_mm=1e3 * np.asarray(obj.inertial.com, np.float64),
        moments=moments,
        axes=axes,
        semi_axes=np.sqrt(np.maximum(squares, 0.0)),
    )


def object_table(objects: Iterable[ObjectModel]) -> str:
    """Name, category, size, mass, CoM, principal moments and `pieces_error` of each, aligned."""
    head = ("name", "category", "size / mm", "mass / kg", "CoM / mm", "principal moments / kg m²")
    head = (*head, "pieces off, %")
    rows = [
        head,
        *((*_cells(summarize_object(o)), f"{100.0 * o.pieces_error:.1f}") for o in objects),
    ]
    lines = aligned(rows, left=(0, 1, 2, 4, 5))
    return "\n".join([lines[0], "-" * len(lines[0]), *lines[1:]])


def _cells(figures: ObjectSummary) -> tuple[str, ...]:
    return (
        figures.name,
        figures.category,
        " x ".join(f"{x:3.0f}" for x in figures.size_mm),
        f"{figures.mass:.3f}",
        " ".join(f"{x + 0.0:6.1f}" for x in np.round(figures.com_mm, 1)),
        " ".join(f"{x:.3e}" for x in figures.moments),
    )


def gallery(
    objects: Mapping[str, ObjectModel], path: Path | str, *, columns: int = 8, progress: bool = True
) -> None:
    """Draws all objects, category by category, into a PNG or HTML file, with a progress bar.

    Raises:
      ValueError: another ending, or no objects.
      OSError: the file cannot be written.
    """
    file = Path(path)
    if file.suffix not in (".png", ".html"):
        raise ValueError(f"{file}: expected a name that ends in .png or .html")
    if not objects:
        raise ValueError("objects: there are none to draw")
    check_writable(file)
    shown = _shown(objects, progress)
    write_whole(file, _png(shown, columns) if file.suffix == ".png" else _html(shown))


def sheet(objects: Mapping[str, ObjectModel], *, columns: int = 8) -> Figure:
    """All objects in one figure, category by category, `columns` pictures side by side.

    Raises:
      ValueError: no objects.
    """
    if not objects:
        raise ValueError("objects: there are none to draw")
    return _figure(_shown(objects, progress=False), columns)


def _shown(
    objects: Mapping[str, ObjectModel], progress: bool
) -> list[tuple[ObjectSummary, Picture]]:
    def shown(obj: ObjectModel) -> tuple[ObjectSummary, Picture]:
        return summarize_object(obj), portrait(obj)

    with ThreadPoolExecutor(runtime.cores()) as pool:  # NumPy lets other threads run
        found = pool.map(shown, objects.values())
        return list(tqdm(found, total=len(objects), disable=not progress, unit="object"))


def portrait(obj: ObjectModel, size: int = _CELL) -> Picture:
    """An object as it stands, the flatter the more from above."""
    flatness = obj.height / float(2.0 * obj.half_extents[:2].max())
    elevation = float(np.interp(flatness, [0.1, 0.4], [52.0, 26.0]))
    meshes = [part.mesh for part in obj.parts] or [obj.mesh]
    colors = [part.color for part in obj.parts] or [obj.color]
    return draw_meshes(meshes, colors, View(elevation_deg=elevation, size=size))


def _axis_ends(figures: ObjectSummary, picture: Picture) -> np.ndarray:
    """Pixels (3, 2, 2) of both ends of each principal axis."""
    com = 1e-3 * figures.com_mm
    reach = figures.semi_axes[:, None] * figures.axes
    return np.stack([picture.place(com - reach), picture.place(com + reach)], axis=1)


def _png(shown: Sequence[tuple[ObjectSummary, Picture]], columns: int) -> bytes:
    buffer = io.BytesIO()
    FigureCanvasAgg(_figure(shown, columns)).print_png(buffer)
    return buffer.getvalue()


def _figure(shown: Sequence[tuple[ObjectSummary, Picture]], columns: int) -> Figure:
    groups = _by_category(shown)
    columns = min(columns, max(4, *(len(group) for _, group in groups)))
    rows = sum(-(-len(group) // columns) for _, group in groups)
    height = 3 * _MARGIN + rows * (_CELL + _TEXT) + len(groups) * _HEADING
    width = 2 * _MARGIN + columns * _CELL
    figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI, facecolor="white")
    figure.text(_MARGIN / width, 1.0 - _MARGIN / height, _KEY, fontsize=10, color=_SOFT)
    top = 1.5 * _MARGIN
    for category, group in groups:
        title = f"{category or 'Objects'} ({len(group)})"
        place = (_MARGIN / width, 1.0 - (top + 0.7 * _HEADING) / height)
        figure.text(*place, title, fontsize=17, weight="bold", color=_INK, parse_math=False)
        top += _HEADING
        for i, (figures, picture) in enumerate(group):
            left = _MARGIN + (i % columns) * _CELL
            low = top + (i // columns) * (_CELL + _TEXT) + _CELL
            box = (left / width, 1.0 - low / height, _CELL / width, _CELL / height)
            _cell(figure.add_axes(box), figures, picture)
            middle = (left + 0.5 * _CELL) / width
            name = figures.name.replace("_", " ")
            figure.text(
                middle, 1.0 - (low + 16) / height, name, ha="center", fontsize=12.5,
                parse_math=False,
            )  # fmt: skip
            figure.text(
                middle, 1.0 - (low + 33) / height, _caption(figures), ha="center", fontsize=9,
                color=_SOFT,
            )  # fmt: skip
        top += -(-len(group) // columns) * (_CELL + _TEXT)
    return figure


def _cell(axes: Axes, figures: ObjectSummary, picture: Picture) -> None:
    size = len(picture.image)
    axes.imshow(picture.image, extent=(0, size, size, 0), interpolation="none")
    axes.set_axis_off()
    halo = [Stroke(linewidth=3.2, foreground="white", alpha=0.7), Normal()]
    for (start, end), color in zip(_axis_ends(figures, picture), _AXIS_COLORS, strict=True):
        axes.plot([start[0], end[0]], [start[1], end[1]], color=color, lw=1.5, path_effects=halo)
    com = picture.place(1e-3 * figures.com_mm[None])[0]
    axes.plot(*com, "o", ms=6.5, mfc="white", mec="black", mew=1.6)
    axes.set(xlim=(0, size), ylim=(size, 0))


def _html(shown: Sequence[tuple[ObjectSummary, Picture]]) -> bytes:
    cards = []
    for figures, picture in shown:
        buffer = io.BytesIO()
        imsave(buffer, picture.image, format="png")
        cards.append(
            {
                "figures": figures,
                "caption": _caption(figures),
                "image": base64.b64encode(buffer.getvalue()).decode(),
                "size": len(picture.image),
                "lines": list(zip(_axis_ends(figures, picture), _AXIS_COLORS, strict=True)),
                "com": picture.place(1e-3 * figures.com_mm[None])[0],
            }
        )
    groups = _by_category([(card["figures"], card) for card in cards])
    pages = PackageLoader("mjx_inertia.objects", ".")
    environment = Environment(loader=pages, autoescape=True, undefined=StrictUndefined)
    text = environment.get_template("gallery.html.j2").render(
        total=len(cards), groups=[(name, [card for _, card in group]) for name, group in groups]
    )
    return text.encode()


def _caption(figures: ObjectSummary) -> str:
    size = " × ".join(f"{x:.0f}" for x in figures.size_mm)
    return f"{size} mm, {figures.mass:.3g} kg"


def _by_category(shown: Iterable[tuple[ObjectSummary, object]]) -> list[tuple[str, list]]:
    """Categories in the order in which they first come, with their members."""
    groups: dict[str, list] = {}
    for figures, content in shown:
        groups.setdefault(figures.category, []).append((figures, content))
    return list(groups.items())
