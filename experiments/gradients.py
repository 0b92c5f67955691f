"""Gradients through contact against central differences: where they hold and where they do not.

    python experiments/gradients.py [steps=500]

Pushes of a cube of 2 kg and 0.15 m in every contact regime, at three time steps, for half a second
(`steps` of 1 ms). The derivative of every signal along each parameter (forward mode, float64)
meets central differences of the float64 simulation over steps of 1e-3 to 1e-7 of the parameter;
of these, the two neighbours that agree best are taken, and by how much they differ is the floor of
the check. The same program gives derivatives and differences, so it compiles once for each
precision. Writes gradients.md, the page of docs/.
"""

import functools
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from mjx_inertia import runtime
from mjx_inertia.experiment import experiment
from mjx_inertia.objects import cube
from mjx_inertia.pushing import Scene, SceneSettings, StraightMotion, build_scene, object_parameters
from mjx_inertia.pushing.rollout import State, initial_state, rollout

HALF, RADIUS = 0.075, 0.005  # m
SAMPLE = 0.01  # s: signals are means over it
SEGMENT = 50  # steps
TIMESTEPS = (0.005, 0.0025, 0.001)  # s
# value and what a relative step refers to: for lengths 1 cm
PARAMETERS = {
    "mass": (2.0, 2.0),
    "I_zz": (0.0075, 0.0075),
    "com_x": (0.004, 0.01),
    "com_y": (-0.006, 0.01),
    "friction": (0.4, 0.4),
    "friction_radius": (0.0574, 0.0574),
    "tip_friction": (0.3, 0.3),
    "tip_time_constant": (0.02, 0.02),
    "start_x": (0.0, 0.01),  # of the tip: moves the instant of first contact
}
STEPS = (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7)
SECANT = 1e-2
GROUPS = {"force": [0, 1], "moment": [2], "position": [3, 4], "yaw": [5], "twist": [6, 7, 8]}


TEXT = """# Gradients through contact: where they can be trusted

`python experiments/gradients.py` (writes this page into its run folder; two minutes on 2 cores)

A cube of 2 kg and 0.15 m on the `limit_surface` table (μ = 0.4, tip friction 0.3, CoM 4 and -6 mm
off the centre) is pushed for half a second. Each cell compares the derivative of a signal (force,
moment, position, yaw, twist; means over 10 ms) by forward mode, in float64, with central
differences. The error is the largest difference over the largest entry of that signal's
sensitivity to that parameter, and the worst of the signals is shown. The reference is the mean of
the two neighbouring step sizes (relative 1e-3 to 1e-7) that agree best; by how much they differ
stands in brackets: an error of that size is one of the check, not of the derivative. `start_x` is
the tip's start along the path's x: it moves the instant of contact. Solver: up to 100 Newton
steps, so that it always converges.

Share of samples in contact and median tip friction over its limit (1: sliding), at 5 ms:
{contact}.

## Error (floor of the check)
{errors}

Worst over the parameters of object and contacts: sticking {worst_sustained:.0e}, sliding
{worst_sliding:.0e}, leaving {worst_leaving:.0e}, first contact {worst_first_contact:.0e}.

## How far a derivative reaches: against the secant over ± 1 %
Lengths: ± 0.1 mm. A large entry here beside a small one above is a derivative that is right and
local.

{secants}

## float32
The same derivative computed in float32, against the float64 reference.

{float32}

## Where it cannot be trusted
- **As a model of finite changes.** The simulated push is smooth between events: a contact that
  opens or closes in another time step, a tip that goes from sticking to sliding. The derivative
  is that of the piece, and the more often such events come (a hard start, a tip that begins to
  slide), the shorter the piece. Along mass, I_zz and com_x it mostly reaches
  over 1 %; along tip friction and time constant it often does not. An identification that starts
  10 % off needs steps that are checked against the cost, not the derivative alone.
- **The instant of first contact** (`start_x`). Time is discrete: within the step in which the tip
  touches, the derivative says how the depth of the first penetration changes; it does not see
  that a longer way makes the contact one step later. Parameters of the object do not move that
  instant, and theirs hold.
- **With too few solver iterations.** A first touch takes up to some 40 Newton steps. A solver
  stopped early leaves one step that is off, differences across it are nonsense, and the derivative
  assumes the minimum.
- **In float32**: often to 1 %, but after a hard start errors reach 90 %.
"""


@dataclass(frozen=True)
class Options:
    """Command-line options."""

    steps: int = 500  # of 1 ms, the length of a push


@dataclass(frozen=True)
class Regime:
    """A push: contact offset (m), gap before the face (m), path angle (rad), speed (m/s)."""

    name: str
    offset: float
    angle: float
    speed: float
    gap: float = 1e-5
    stops: bool = False  # the tip stops halfway: the object leaves it


REGIMES = (
    Regime("sticking, 0.01 m/s", 0.02, 0.1, 0.01),
    Regime("sticking, 0.04 m/s", 0.02, 0.1, 0.04),
    Regime("sticking, 0.06 m/s", 0.02, 0.1, 0.06),
    Regime("sliding, 0.01 m/s", -0.02, 0.9, 0.01),
    Regime("sliding, 0.04 m/s", -0.02, 0.9, 0.04),
    Regime("leaving, tip stops", 0.02, 0.1, 0.06, stops=True),
    Regime("sliding, near the corner", 0.066, 0.7, 0.04),
    Regime("first contact, 0.04 m/s", 0.02, 0.1, 0.04, gap=2e-3),
)


def program(scene: Scene) -> Callable:
    """Signals of one segment and their derivative, for many pushes; a sample is a step."""
    nominal = object_parameters(scene.object_model, friction=0.4)

    def signals(theta: jax.Array, state: State, motion: StraightMotion) -> tuple:
        parameters = nominal.replace(
            mass=theta[0],
            inertia=jnp.asarray(nominal.inertia).at[2].set(theta[1]),
            com=jnp.asarray(nominal.com).at[:2].set(theta[2:4]),
            friction=theta[4],
            friction_radius=theta[5],
            tip_friction=theta[6],
            tip_time_constant=theta[7],
        )
        state, s = rollout(scene, parameters, motion, state, jnp.int32(0), SEGMENT)
        return state, jnp.concatenate([s.force, s.moment[:, None], s.pose, s.twist], 1)

    def both(
        theta: jax.Array, change: jax.Array, state: State, slope: State, motion: StraightMotion
    ) -> tuple:
        run = functools.partial(signals, motion=motion)
        return jax.jvp(run, (theta, state), (change, slope))

    return jax.jit(jax.vmap(both), compiler_options=runtime.compiler_options())


def simulate(
    run: Callable,
    scene: Scene,
    regimes: list[Regime],
    theta: np.ndarray,
    change: np.ndarray,
    duration: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Signals (n, samples, 9) and their derivatives along `change`, for n pushes."""
    dtype, timestep = scene.data.qpos.dtype, scene.settings.timestep
    column = functools.partial(np.array, dtype=dtype)
    start = column([[-HALF - RADIUS - r.gap, r.offset] for r in regimes])
    start[:, 0] += theta[:, -1]
    angle = np.array([r.angle for r in regimes])
    n = len(regimes)
    motion = StraightMotion(
        start=start,
        direction=column(np.stack([np.cos(angle), np.sin(angle)], 1)),
        speed=column([r.speed for r in regimes]),
        ramp=np.zeros(n, dtype),
        duration=np.full(n, 1e6, dtype),
    )
    at_rest = jax.vmap(functools.partial(initial_state, scene))
    state = at_rest(jnp.zeros((n, 3), dtype), jnp.asarray(start))
    slope = jax.tree.map(jnp.zeros_like, state)
    slope = slope.replace(qpos=(*slope.qpos[:-2], column(change[:, -1]), slope.qpos[-1]))
    values, slopes = [], []
    segments = round(duration / (timestep * SEGMENT))
    for i in range(segments):
        if 2 * i >= segments:
            stops = np.array([r.stops for r in regimes])
            motion = motion.replace(speed=column([r.speed for r in regimes]) * ~stops)
        (state, y), (slope, dy) = run(column(theta), column(change), state, slope, motion)
        values.append(y)
        slopes.append(dy)
    mean = functools.partial(samples, steps=round(SAMPLE / timestep))
    return mean(values), mean(slopes)


def samples(parts: list, steps: int) -> np.ndarray:
    """Means over a sample of what was recorded at each step."""
    whole = np.concatenate([np.asarray(p, float) for p in parts], 1)
    return whole.reshape(len(whole), -1, steps, whole.shape[-1]).mean(2)


def difference(a: np.ndarray, b: np.ndarray, sensitive: list[list[int]]) -> float:
    """Largest |a - b| over the largest |b|, the worst of the signals that are sensitive at all."""
    errors = [np.abs(a - b)[:, i].max() / np.abs(b[:, i]).max() for i in sensitive]
    return float(max(errors, default=np.nan))


def reference(central: np.ndarray) -> tuple[np.ndarray, float]:
    """Of central differences by step, the mean of the two neighbours that agree best; their gap.

    A large step meets curvature and kinks, a small one rounding.
    """
    gaps = np.abs(np.diff(central, axis=0)).max(axis=(1, 2))
    best = int(gaps.argmin())
    mean = 0.5 * (central[best] + central[best + 1])
    return mean, float(gaps[best] / np.abs(mean).max())


def check(timestep: float, duration: float) -> list[dict]:
    """Rows of errors at one time step: for each regime and parameter."""
    settings = SceneSettings(rate=1 / timestep, max_timestep=timestep, solver_iterations=100)
    runs: dict[str, tuple[Callable, Scene]] = {}
    for name, wide in (("float64", True), ("float32", False)):
        with jax.enable_x64(wide):
            scene = build_scene(cube(2 * HALF, 2.0), settings)
            runs[name] = (program(scene), scene)
    value = np.array([v for v, _ in PARAMETERS.values()])
    size = np.array([s for _, s in PARAMETERS.values()])
    p, relative = len(size), np.array([0.0, *STEPS, SECANT])
    signs = np.concatenate([relative, -relative[1:]])  # 0, +h..., -h...
    unit = np.diag(size)
    theta = value + signs[:, None, None] * unit  # (signs, p, p)
    moved = np.zeros_like(theta)
    moved[0] = np.eye(p)
    many = [r for r in REGIMES for _ in range(len(signs) * p)]
    y, dy = simulate(
        *runs["float64"], many, np.tile(theta.reshape(-1, p), (len(REGIMES), 1)),
        np.tile(moved.reshape(-1, p), (len(REGIMES), 1)), duration,
    )  # fmt: skip
    y = y.reshape(len(REGIMES), len(signs), p, *y.shape[1:])
    dy = dy.reshape(y.shape)[:, 0]
    with jax.enable_x64(False):
        few = [r for r in REGIMES for _ in range(p)]
        base = np.tile(value, (len(few), 1)).astype(np.float32)
        one = np.tile(np.eye(p, dtype=np.float32), (len(REGIMES), 1))
        _, single = simulate(*runs["float32"], few, base, one, duration)
    single = single.reshape(dy.shape)
    return [
        compared(r, timestep, name, y[i, :, j], dy[i, j], single[i, j], relative, size[j])
        for i, r in enumerate(REGIMES)
        for j, name in enumerate(PARAMETERS)
    ]


def compared(
    regime: Regime,
    timestep: float,
    name: str,
    y: np.ndarray,
    slope: np.ndarray,
    single: np.ndarray,
    relative: np.ndarray,
    size: float,
) -> dict:
    """One row: signals `y` at 0, +h, -h (signs, samples, 9) and the derivatives of two precisions.

    A signal counts when the whole parameter (`size`) as a change moves it by 1e-6 at least.
    """
    k = len(relative)
    central = (y[1:k] - y[k:]) / (2 * relative[1:, None, None] * size)
    best, floors, sensitive = np.zeros_like(slope), [np.nan], []
    for index in GROUPS.values():
        if np.abs(slope[:, index]).max() * size > 1e-6 * np.abs(y[0][:, index]).max():
            best[:, index], floor = reference(central[:-1][..., index])
            floors.append(floor)
            sensitive.append(index)
    # a tip that starts closer to the face than the secant reaches would start inside it
    secant = name != "start_x" or regime.gap > SECANT * size
    return {
        "regime": regime.name,
        "timestep": timestep,
        "parameter": name,
        "error": difference(slope, best, sensitive),
        "floor": float(np.nanmax(floors)),
        "float32": difference(single, best, sensitive),
        "secant": difference(slope, central[-1], sensitive) if secant else np.nan,
        "contact": contact(y[0]),
    }


def contact(signal: np.ndarray) -> tuple[float, float]:
    """Share of samples in contact, and the median of the tip's friction over its limit."""
    yaw, (fx, fy) = signal[:, 5], signal[:, :2].T
    normal, tangent = fx * np.cos(yaw) + fy * np.sin(yaw), fy * np.cos(yaw) - fx * np.sin(yaw)
    touches = normal > 1e-3
    limit = PARAMETERS["tip_friction"][0] * normal[touches]
    return float(touches.mean()), float(np.median(np.abs(tangent[touches]) / limit))


def table(rows: list[dict], cell: Callable[[dict], str]) -> str:
    """Markdown: a row for each regime and time step, a column for each parameter."""
    names = list(PARAMETERS)
    lines = [f"| regime | step ms | {' | '.join(names)} |", "| --- " * (len(names) + 2) + "|"]
    for first in range(0, len(rows), len(names)):
        cells = [cell(r) for r in rows[first : first + len(names)]]
        regime, timestep = rows[first]["regime"], rows[first]["timestep"]
        lines.append(f"| {regime} | {1e3 * timestep:g} | {' | '.join(cells)} |")
    return "\n".join(lines)


def number(x: float) -> str:
    """Two digits are one too many for an error."""
    return "–" if np.isnan(x) else f"{x:.0e}".replace("e-0", "e-").replace("e+0", "e+")


def worst(rows: list[dict], key: str, regime: str) -> float:
    """The largest over parameters of the object and its contacts, all time steps."""
    rows = [r for r in rows if r["regime"].startswith(regime)]
    chosen = [r[key] for r in rows if r["parameter"] != "start_x"]
    return float(f"{np.nanmax(chosen):.2g}")


def summary(rows: list[dict]) -> dict[str, float]:
    """The largest errors by kind of contact."""
    kinds = {"sustained": "sticking", "sliding": "sliding", "leaving": "leaving"}
    return {
        f"worst_{name}{suffix}": worst(rows, key, prefix)
        for name, prefix in {**kinds, "first_contact": "first"}.items()
        for key, suffix in (("error", ""), ("float32", "_float32"), ("secant", "_secant"))
    }


def document(rows: list[dict], headline: dict) -> str:
    """The text of gradients.md."""
    ratio = [
        f"{r['regime']} {r['contact'][0]:.2f}, {r['contact'][1]:.2f}"
        for r in rows
        if r["parameter"] == "mass" and r["timestep"] == TIMESTEPS[0]
    ]
    return TEXT.format(
        errors=table(rows, lambda r: f"{number(r['error'])} ({number(r['floor'])})"),
        secants=table(rows, lambda r: number(r["secant"])),
        float32=table(rows, lambda r: number(r["float32"])),
        contact="; ".join(ratio),
        **headline,
    )


@experiment(Options)
def main(options: Options, folder: Path) -> dict[str, Any]:
    """Measures, prints and writes the tables."""
    begin = time.perf_counter()
    duration = 1e-3 * options.steps
    runtime.configure(devices=1, float64=True)
    rows = []
    for timestep in TIMESTEPS:
        rows += check(timestep, duration)
        print(f"{1e3 * timestep:g} ms done, {time.perf_counter() - begin:.0f} s", flush=True)
    order = [r.name for r in REGIMES]
    rows.sort(key=lambda r: order.index(r["regime"]))  # stable: time steps keep their order
    headline = {"seconds": round(time.perf_counter() - begin, 1), **summary(rows)}
    text = document(rows, headline)
    print(text)
    (folder / "gradients.md").write_text(text)
    return headline


if __name__ == "__main__":
    main()
