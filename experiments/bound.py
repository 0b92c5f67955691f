"""What one push can tell: the Cramér-Rao bound of the regressors' problem, by speed.

    python experiments/bound.py [pushes=200] [spread=0.05]

The bound is for whoever knows that uniform cubes are pushed (as a regressor trained on cubes does)
and the ranges of the data, and nothing else: unknown are mass, edge, contact offset, both frictions
and the contact's time constant. Derivatives are central differences of the float64 simulation;
noise is that of the data plus a floor of 0.02 N, 0.2 N mm, 0.2 mm/s and 2 mrad/s.
"""

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from mjx_inertia import runtime
from mjx_inertia.dataset import CubesProtocol, PushPlan, cubes_plan, select_pushes
from mjx_inertia.dataset.plan import SQUARE_FRICTION_RADIUS
from mjx_inertia.experiment import experiment
from mjx_inertia.features import FeatureSettings
from mjx_inertia.features.signals import signals
from mjx_inertia.objects import cube
from mjx_inertia.pushing import build_scene, simulate

FLOOR = np.array([0.02, 0.02, 2e-4, 2e-4, 2e-4, 2e-3])  # f_x, f_y, m, u_x, u_y, ω
NAMES = ("mass", "edge", "offset", "friction", "tip_friction", "tip_time_constant")
STEP = 1e-4  # relative


@dataclass(frozen=True)
class Options:
    """Command-line options."""

    pushes: int = 200  # of the 4,800
    spread: float = 0.05  # of the noise, relative


def varied(plan: PushPlan, name: str, change: float) -> PushPlan:
    """The same pushes with one unknown changed: relative, the offset by a share of the edge."""
    p, half = plan.parameters, np.asarray(plan.parameters.half_extents)[:, 0]
    mass, edge, y = np.asarray(p.mass), 2 * half, np.asarray(plan.contact_point)[:, 1]
    if name == "mass":
        mass = mass * (1 + change)
    if name == "edge":
        edge = edge * (1 + change)
    if name == "offset":
        y = y + change * 2 * half
    other = {
        k: np.asarray(getattr(p, k)) * (1 + change if k == name else 1)
        for k in ("friction", "tip_friction", "tip_time_constant")
    }
    point = np.stack([-edge / 2, y], 1)
    start = np.asarray(plan.motion.start) + point - np.asarray(plan.contact_point)
    zero = np.zeros_like(edge)
    parameters = p.replace(
        mass=mass,
        inertia=np.tile((mass * edge**2 / 6)[:, None], (1, 3)),
        com=np.stack([zero, zero, edge / 2], 1),
        half_extents=np.tile(edge[:, None] / 2, (1, 3)),
        friction_radius=SQUARE_FRICTION_RADIUS * edge,
        **other,
    )
    return plan.replace(
        parameters=parameters, motion=plan.motion.replace(start=start), contact_point=point
    )


def prior(plan: PushPlan) -> np.ndarray:
    """Information of the ranges that the unknowns are drawn from, as if normal, (n, 6, 6)."""
    p, protocol = plan.parameters, CubesProtocol()
    spans = {
        "mass": (protocol.mass.low, protocol.mass.high),
        "friction": (protocol.friction.low, protocol.friction.high),
        "tip_friction": protocol.tip_friction,
        "tip_time_constant": protocol.tip_time_constant,
    }
    edge = 2 * np.asarray(p.half_extents)[:, 0]
    width = {k: (high - low) / np.asarray(getattr(p, k)) for k, (low, high) in spans.items()}
    width["edge"] = (protocol.edge.high - protocol.edge.low) / edge
    width["offset"] = np.ones_like(edge)
    return np.stack([np.diag(12 / w**2) for w in np.stack([width[n] for n in NAMES], -1)])


@experiment(Options)
def main(options: Options, _folder: Path) -> dict[str, Any]:
    """Prints the bound by speed."""
    pushes, spread = options.pushes, options.spread
    runtime.configure(float64=True)
    scene = build_scene(cube(0.15, 1.0))
    whole = cubes_plan(CubesProtocol(pushes_per_cube=10), seed=1)
    plan = select_pushes(whole, np.linspace(0, len(whole) - 1, pushes).round().astype(int))
    see = jax.jit(jax.vmap(functools.partial(signals, settings=FeatureSettings())))

    def observed(plan: PushPlan) -> np.ndarray:
        record = simulate(
            scene,
            plan.parameters,
            plan.motion,
            contact_point=plan.contact_point,
            contact_normal=plan.contact_normal,
        )
        return np.asarray(see(jax.tree.map(jnp.asarray, record)).values)[..., :6]

    nominal = observed(plan)
    slopes = [
        (observed(varied(plan, n, STEP)) - observed(varied(plan, n, -STEP))) / (2 * STEP)
        for n in NAMES
    ]
    sigma = spread / 3 * np.abs(nominal) + FLOOR
    jacobian = np.stack(slopes, -1) / sigma[..., None]
    fisher = np.einsum("ntsi,ntsj->nij", jacobian, jacobian)
    covariance = np.linalg.inv(fisher + prior(plan))
    edge = 2e3 * np.asarray(plan.parameters.half_extents)[:, 0]
    inertia = np.array([1.0, 2.0, 0, 0, 0, 0])  # log I = log m + 2 log a
    deviation = {
        "mass_percent": 100 * np.sqrt(covariance[:, 0, 0]),
        "inertia_percent": 100 * np.sqrt(np.einsum("i,nij,j->n", inertia, covariance, inertia)),
        "com_x_mm": np.sqrt(covariance[:, 1, 1]) * edge / 2,
        "com_y_mm": np.sqrt(covariance[:, 2, 2]) * edge,
    }
    speed = np.asarray(plan.motion.speed)
    headline = {}
    for name, values in deviation.items():
        # the mean absolute error of an efficient, normal estimator is 0.8 of its deviation
        groups = {"all": values, **{f"{v:g}": values[speed == v] for v in np.unique(speed)}}
        headline[name] = {k: round(0.8 * float(v.mean()), 3) for k, v in groups.items()}
        print(f"{name:16} mean absolute error at the bound: {headline[name]}")
    return {"pushes": pushes, "spread": spread, **headline}


if __name__ == "__main__":
    main()
