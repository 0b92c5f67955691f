"""Sequences of pushes: push, estimate from all pushes so far, choose again, against random choice.

In: a scene and its sensors (`Lab`). Out: errors after each push, and the deviations stated.
"""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from mjx_inertia.dataset import add_noise
from mjx_inertia.dataset.plan import SQUARE_FRICTION_RADIUS
from mjx_inertia.estimators.sysid import (
    SysidProblem,
    SysidSettings,
    fit,
    observed,
    to_coordinates,
)
from mjx_inertia.estimators.sysid.next_push import (
    PusherLimits,
    Pushes,
    candidates,
    choose,
    expected_information,
    predicted,
    target_slopes,
)
from mjx_inertia.pushing import PushRecord, Scene

LIMITS = PusherLimits(speed=(0.05, 0.2), length=0.08)
SAMPLES = 432  # every record is padded to this: one compiled program for all


def half_and_radius(edge: float) -> tuple[np.ndarray, float]:
    """Half extents and c of a cube."""
    return np.full(3, edge / 2), SQUARE_FRICTION_RADIUS * edge


def joined(parts: list[Any]) -> Any:
    """Trees with a leading axis, one after the other."""
    return jax.tree.map(lambda *x: np.concatenate([np.asarray(i) for i in x]), *parts)


def rows_of(tree: Any, rows: np.ndarray) -> Any:
    """Rows of a tree with a leading axis."""
    return jax.tree.map(lambda x: np.asarray(x)[rows], tree)


@dataclass(frozen=True)
class Lab:
    """The scene and the sensors of all three parts."""

    scene: Scene
    settings: SysidSettings

    def information(self, z: np.ndarray, pushes: Pushes, samples: int = SAMPLES) -> np.ndarray:
        """Fisher information of pushes."""
        return expected_information(
            self.scene, z, pushes, np.zeros(2), self.settings, samples=samples
        )

    def measured(self, z: np.ndarray, pushes: Pushes, first: int, seed: int) -> PushRecord:
        """Records with noise; push i has the noise of number first + i."""
        exact = predicted(self.scene, z, pushes, np.zeros(2), self.settings, samples=SAMPLES)
        number = np.arange(first, first + len(pushes), dtype=np.uint32)
        key = jax.random.key(seed)
        return add_noise(exact, jnp.asarray(number), self.settings.noise, key=key)


def deviations(fisher: np.ndarray, settings: SysidSettings, edge: Any) -> np.ndarray:
    """Bounds of mass (%), I_zz (%) and the CoM's place (mm), beliefs included, (..., 3)."""
    slope = target_slopes(settings)
    covariance = slope @ np.linalg.inv(fisher + np.eye(fisher.shape[-1])) @ slope.T
    variance = np.diagonal(covariance, axis1=-2, axis2=-1)
    com = np.sqrt(variance[..., 2] + variance[..., 3]) * 1e3 * np.asarray(edge) / 2
    return np.stack([*(100 * np.sqrt(variance[..., :2])).T, com.T]).T


def drawn_objects(count: int, settings: SysidSettings, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and edges of random cubes whose CoM and I_zz are not those of uniform ones."""
    rng = np.random.default_rng(seed)
    values = {
        "mass": np.exp(rng.uniform(np.log(0.5), np.log(5.0), count)),
        "inertia": rng.uniform(0.7, 1.3, count),
        "com_x": rng.uniform(-0.3, 0.3, count),
        "com_y": rng.uniform(-0.3, 0.3, count),
        "friction": rng.uniform(0.2, 0.6, count),
        "tip_friction": rng.uniform(0.2, 0.5, count),
        "tip_time_constant": rng.uniform(0.012, 0.04, count),
    }
    return np.asarray(to_coordinates(values, settings)), rng.uniform(0.1, 0.2, count)


@dataclass
class Campaign:
    """Sequences of pushes under way: some choose, the others push at random."""

    truth: np.ndarray  # coordinates of each sequence's object
    grid: list[Pushes]  # its candidates
    chooses: np.ndarray  # whether it chooses
    z: np.ndarray  # estimate so far
    known: np.ndarray  # information so far, belief included
    pushes: list[Pushes]  # made so far, all sequences together
    observation: list[Any]  # of each
    group: np.ndarray  # which sequence made it


def next_pushes(lab: Lab, c: Campaign, active: np.ndarray, rng: np.random.Generator) -> list[int]:
    """The number of the next push of each active sequence."""
    targets = target_slopes(lab.settings)
    thinking = [s for s in active if c.chooses[s]]
    number = {int(s): int(rng.integers(len(c.grid[s]))) for s in active}
    if thinking:
        size = len(c.grid[0])
        z = np.repeat(c.z[thinking], size, 0)
        fisher = lab.information(z, joined([c.grid[s] for s in thinking]))
        for s, part in zip(thinking, fisher.reshape(-1, size, *fisher.shape[1:]), strict=True):
            number[int(s)] = choose(c.known[s], part, targets, "A")[0]
    return [number[int(s)] for s in active]


def estimated(lab: Lab, c: Campaign, active: np.ndarray, number: int) -> np.ndarray:
    """Updates estimate and information of the active sequences; returns which of them fit."""
    rows = np.flatnonzero(np.isin(c.group, active))
    observation, pushes = rows_of(joined(c.observation), rows), rows_of(joined(c.pushes), rows)
    body = np.searchsorted(active, c.group[rows])
    problem = SysidProblem.of(lab.scene, observation, pushes.setup, lab.settings, body=body)
    found = fit(problem, c.z[active], key=jax.random.key(number))
    c.z[active], c.known[active] = found.search.z, found.search.hessian
    return np.asarray(found.fits)


def errors(c: Campaign, edge: np.ndarray, settings: SysidSettings) -> np.ndarray:
    """Error of mass (%), I_zz (%), CoM (mm) of every sequence, then deviations stated, (s, 6)."""
    change = (c.z - c.truth) @ target_slopes(settings).T
    com = np.hypot(change[:, 2], change[:, 3]) * 1e3 * edge / 2
    made = 100 * np.abs(np.expm1(change[:, :2]))
    expected = deviations(c.known - np.eye(c.z.shape[1]), settings, edge)
    return np.column_stack([made, com, expected])


def campaign(
    lab: Lab, objects: int, rounds: int, random_rounds: int
) -> tuple[Float[np.ndarray, "k s 6"], Bool[np.ndarray, " s"], dict[str, Any]]:
    """Chosen against random pushes; two random sequences for each object.

    Errors after each push (see `errors`), which sequences chose, and how many pushes were lost and
    fits were stuck.
    """
    settings, rng = lab.settings, np.random.default_rng(4)
    truth, edge = drawn_objects(objects, settings, seed=3)
    of = np.tile(np.arange(objects), 3)
    grids = [candidates(LIMITS, *half_and_radius(float(e))) for e in edge]
    n, p = len(of), truth.shape[1]
    c = Campaign(
        truth[of], [grids[i] for i in of], np.arange(n) < objects, np.zeros((n, p)),
        np.tile(np.eye(p), (n, 1, 1)), [], [], np.zeros(0, int),
    )  # fmt: skip
    history, misfits, lost = [], [], 0
    for k in range(random_rounds):
        active = np.flatnonzero(~c.chooses) if k >= rounds else np.arange(n)
        number = next_pushes(lab, c, active, rng)
        pairs = zip(active, number, strict=True)
        new = joined([rows_of(c.grid[s], np.array([i])) for s, i in pairs])
        record = lab.measured(c.truth[active], new, n * k, seed=5)
        lost += int((np.asarray(record.status) != 0).sum())
        c.pushes.append(new)
        c.observation.append(observed(record, settings))
        c.group = np.concatenate([c.group, active])
        stuck = ~estimated(lab, c, active, k)
        misfits.append(int(stuck.sum()))
        history.append(errors(c, edge[of], settings))
        middle = [np.median(history[-1][s], 0).round(3).tolist() for s in (c.chooses, ~c.chooses)]
        print(f"after {k + 1} pushes, medians (m %, I %, CoM mm, stated): chosen {middle[0]}, "
              f"random {middle[1]}; stuck {misfits[-1]}", flush=True)  # fmt: skip
        if k < rounds:
            last = new.setup.motion.speed[:objects], new.offset[:objects], new.angle[:objects]
            print("   chosen speed, offset, angle:", [np.round(x, 2).tolist() for x in last])
    return np.stack(history), c.chooses, {"lost_pushes": lost, "stuck_fits": misfits}
