"""Evaluations that look like real ones: simulated cubes, estimators with known noise."""

import numpy as np

from mjx_inertia.dataset import PushConditions, PushTruth
from mjx_inertia.estimators import Estimate
from mjx_inertia.evaluation import HeldOutEstimates
from mjx_inertia.pushing import PushRecord

MASSES = np.linspace(0.5, 5, 20)
FRICTIONS = np.linspace(0.2, 0.6, 6)
EDGES = np.linspace(0.1, 0.2, 4)
OFFSETS = np.array([-0.8, -0.4, 0, 0.4, 0.8])
SPEEDS = np.array([0.01, 0.02, 0.04, 0.06])


def fake_truth(pushes: int, seed: int = 0) -> tuple[PushTruth, PushConditions]:
    rng = np.random.default_rng(seed)
    cubes = rng.choice(480, size=min(480, max(2, pushes // 8)), replace=False)
    object_id = rng.choice(cubes, size=pushes)
    mass = MASSES[object_id // 24]
    friction, edge = FRICTIONS[object_id // 4 % 6], EDGES[object_id % 4]
    offset = rng.choice(OFFSETS, size=pushes)
    truth = PushTruth(
        mass=mass,
        inertia=mass * edge**2 / 6,
        com=np.stack([edge / 2, -offset * edge / 2], axis=1),
    )
    conditions = PushConditions(
        object_id=object_id,
        friction=friction.astype(np.float32),
        size=edge,
        speed=rng.choice(SPEEDS, size=pushes),
        contact_offset=offset,
        angle=rng.uniform(-0.3, 0.3, size=pushes),
    )
    return truth, conditions


def fake_evaluation(
    estimator: str,
    noise: float | None,
    *,
    pushes: int = 480,
    split: str = "grouped",
    failed: int = 0,
    claimed: float = 1.0,
    seed: int = 0,
) -> HeldOutEstimates:
    """Relative noise `noise` on mass, twice on I_zz, a third in CoM; None: the training mean."""
    truth, conditions = fake_truth(pushes, seed)
    true = np.column_stack([truth.mass, truth.inertia, truth.com])
    rng = np.random.default_rng(seed + 1)
    if noise is None:
        sigma = np.broadcast_to(true.std(axis=0), true.shape)
        mean = np.broadcast_to(true.mean(axis=0), true.shape).copy()
    else:
        half = conditions.size / 2
        sigma = noise * np.column_stack([truth.mass, 2 * truth.inertia, half / 3, half / 4])
        sigma[:, 1] *= 2 - np.abs(conditions.contact_offset)
        mean = true + sigma * rng.normal(size=true.shape)
    covariance = np.einsum("ni,ij->nij", (sigma / claimed) ** 2, np.eye(4))
    status = np.zeros(pushes, int)
    status[:failed] = 1
    mean[:failed] = np.nan
    push_status = np.zeros(pushes, int)
    push_status[: failed // 2] = 1
    return HeldOutEstimates(
        dataset="quick",
        split=split,
        estimator=estimator,
        estimate=Estimate(mean=mean, covariance=covariance, status=status),
        truth=truth,
        conditions=conditions,
        push_status=push_status,
    )


def fake_evaluations(pushes: int = 480, failed: int = 3) -> list[HeldOutEstimates]:
    rows = []
    for seed, split in enumerate(("thesis", "grouped")):
        worse = 1 + 0.4 * seed
        for name, noise in (("mean", None), ("forest", 0.11 * worse), ("boosted", 0.055 * worse)):
            claimed = 1.3 if name == "boosted" else 0.9
            settings = {"pushes": pushes, "failed": failed, "claimed": claimed, "seed": seed}
            rows.append(fake_evaluation(name, noise, split=split, **settings))
    return rows


def fake_records(pushes: int = 4, samples: int = 300, rate_hz: float = 100) -> PushRecord:
    rng = np.random.default_rng(0)
    time = np.broadcast_to(np.arange(1, samples + 1) / rate_hz, (pushes, samples))
    rise = 1 - np.exp(-time / 0.05)
    level = rng.uniform(2, 15, size=(pushes, 1))
    spin = rng.uniform(-0.3, 0.3, size=(pushes, 1)) * rise
    force = np.stack([level * rise, 0.2 * level * np.sin(time)], axis=-1)
    force += 0.1 * rng.normal(size=force.shape)
    pose = np.stack([0.04 * time, 0.01 * time**2, spin * time], axis=-1)
    twist = np.stack([0.04 * rise, 0.01 * np.sin(2 * time), spin], axis=-1)
    tip = np.stack([np.full_like(time, 0.04), np.zeros_like(time)], axis=-1)
    return PushRecord(
        time=time,
        force=force,
        moment=0.05 * level * spin,
        pose=pose,
        twist=twist,
        tip_position=tip * time[..., None],
        tip_velocity=tip,
        contact_point=np.zeros((pushes, 2)),
        contact_normal=np.broadcast_to([1.0, 0.0], (pushes, 2)),
        length=np.linspace(samples // 2, samples, pushes).astype(int),
        status=np.zeros(pushes, int),
    )
