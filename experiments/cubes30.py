"""Figs 3.5 to 3.7 of the thesis: 30 cubes, 10 pushes each, then one property varied by ±30 %.

    python experiments/cubes30.py [overrides]

The cube with the smallest error of mass and inertia in the test is taken as nominal; its size, mass
and friction are varied one at a time in six steps, and the forest of the first part estimates each
of the 18 new cubes from a single push at the contact point that served it best.
"""

import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mjx_inertia.dataset import Cubes30Protocol, SimulatedSettings, simulated_source
from mjx_inertia.estimators import ESTIMATORS
from mjx_inertia.evaluation import (
    HeldOutEstimates,
    Section,
    error_averages,
    error_images,
    relative_error_percent,
)
from mjx_inertia.experiment import experiment, sweep_result
from mjx_inertia.settings import SweepSettings
from mjx_inertia.sweep import SweepResult, tabulate
from parts.variation_figure import VariationGroup, variation_boxes

STEPS = np.array([-0.3, -0.2, -0.1, 0.1, 0.2, 0.3])
PROPERTIES = ("mass", "size", "friction")  # the order of a cube in the protocol


def errors(evaluation: HeldOutEstimates) -> np.ndarray:
    """Relative errors of mass and inertia (Eq. 3.5), (pushes, 2), %; NaN where it failed."""
    truth = np.stack([evaluation.truth.mass, evaluation.truth.inertia], 1)
    return np.asarray(relative_error_percent(truth, np.asarray(evaluation.estimate.mean)[:, :2]))


def nominal(evaluation: HeldOutEstimates) -> tuple[tuple[float, float, float], int]:
    """The best cube of the test (mass, edge, friction), and the contact point that served best."""
    error = errors(evaluation).sum(1)
    conditions = evaluation.conditions
    offsets = np.unique(np.asarray(conditions.contact_offset).round(6))
    cubes = np.unique(conditions.object_id)
    best = cubes[np.nanargmin([np.nanmean(error[conditions.object_id == c]) for c in cubes])]
    at = [np.nanmean(error[np.isclose(conditions.contact_offset, o, atol=1e-5)]) for o in offsets]
    row = np.flatnonzero(conditions.object_id == best)[0]
    mass, edge = float(evaluation.truth.mass[row]), float(conditions.size[row])
    return (mass, edge, float(conditions.friction[row])), int(np.nanargmin(at))


def vary(
    settings: SweepSettings, result: SweepResult, folder: Path
) -> tuple[tuple[Section, ...], dict[str, Any]]:
    """The ±30 % study: figures for the report and median errors for the headline."""
    dataset = settings.dataset
    assert isinstance(dataset, SimulatedSettings)
    assert isinstance(dataset.generate.protocol, Cubes30Protocol)
    if "forest" not in settings.estimators:
        raise ValueError("the ±30 % study is about the forest; run with it in estimator.names")
    evaluation = next(e for e in result.evaluations if e.estimator == "forest")
    cube, point = nominal(evaluation)
    cubes = [
        tuple(x * (1 + step) if i == which else x for i, x in enumerate(cube))
        for which in range(3)
        for step in STEPS
    ]
    protocol = replace(dataset.generate.protocol, cubes=tuple(cubes))
    path = folder / f"variation-{zlib.crc32(repr((protocol, settings.seed)).encode()):08x}.zarr"
    source = simulated_source(
        replace(
            dataset, splits=(), generate=replace(dataset.generate, path=path, protocol=protocol)
        ),
        progress=settings.progress,
    )
    assert source is not None
    tables, _ = tabulate(source, settings)
    choice = settings.estimators["forest"]
    model = result.fitted["grouped", "forest"]
    estimate = ESTIMATORS["forest"].factory(choice).predict(model, tables[choice.features])
    error = errors(
        HeldOutEstimates("variation", "±30 %", "forest", estimate, source.truth, source.conditions)
    )[point :: protocol.pushes_per_cube]
    groups = [
        VariationGroup(f"{name} ±30 %", *error[6 * i : 6 * i + 6].T)
        for i, name in enumerate(PROPERTIES)
    ]
    sections = (
        Section(
            "Errors by cube and contact point",
            error_images(evaluation),
            "Forest, test cubes (thesis Fig. 3.5). A push near the middle tells the mass, one near "
            "the edge the inertia.",
        ),
        Section("Their averages", error_averages(evaluation), "Thesis Fig. 3.6."),
        Section(
            "One property varied",
            variation_boxes(groups),
            f"Thesis Fig. 3.7. Nominal: {cube[0]:.3f} kg, {cube[1]:.3f} m, μ = {cube[2]:.2f}; one "
            "push each.",
        ),
    )
    medians = {
        f"variation_{name}_{target}_median_percent": round(float(np.nanmedian(values)), 1)
        for name, group in zip(PROPERTIES, groups, strict=True)
        for target, values in (
            ("mass", group.mass_error_percent),
            ("inertia", group.inertia_error_percent),
        )
    }
    return sections, medians


@experiment(SweepSettings)
def main(settings: SweepSettings, folder: Path) -> dict[str, Any]:
    """Runs the main job and the ±30 % study."""
    return sweep_result("cubes30", settings, folder, vary)


if __name__ == "__main__":
    main()
