"""Random cubes and straight pushes that the tests of the simulator share."""

import numpy as np

from mjx_inertia.pushing import (
    PushParameters,
    Scene,
    StraightMotion,
    simulate,
)

SQUARE_C = 0.38259786


def cubes(n: int, seed: int, *, com_offset: float = 0.0) -> PushParameters:
    """Random cubes over the ranges of the data; CoM off by up to a fraction of the edge."""
    rng = np.random.default_rng(seed)
    mass, edge = rng.uniform(0.5, 5.0, n), rng.uniform(0.1, 0.2, n)
    com = np.stack([*(rng.uniform(-com_offset, com_offset, (2, n)) * edge), edge / 2], 1)
    return PushParameters(
        mass=mass,
        inertia=np.tile((mass * edge**2 / 6)[:, None], (1, 3)),
        com=com,
        half_extents=np.tile(edge[:, None] / 2, (1, 3)),
        friction=rng.uniform(0.2, 0.6, n),
        friction_radius=SQUARE_C * edge,
        tip_friction=rng.uniform(0.2, 0.5, n),
        tip_time_constant=rng.uniform(0.01, 0.04, n),
    )


def straight(parameters: PushParameters, offset, speed, duration, angle=0.0, radius=0.005):
    """Pushes of the face x = -edge/2, first met at `offset` (fraction of half the edge)."""
    half = np.asarray(parameters.half_extents)[:, 0]
    n = len(half)
    y = np.broadcast_to(offset, n) * half
    angle = np.broadcast_to(angle, n)
    return StraightMotion(
        start=np.stack([-half - radius - 1e-5, y], 1),
        direction=np.stack([np.cos(angle), np.sin(angle)], 1),
        speed=np.broadcast_to(np.asarray(speed, float), n),
        ramp=np.zeros(n),
        duration=np.broadcast_to(np.asarray(duration, float), n),
    )


def push(scene: Scene, parameters: PushParameters, motion: StraightMotion):
    """Simulates; the contact point lies straight ahead of the tip's start."""
    point = np.asarray(motion.start) + np.array([scene.settings.tip_radius, 0.0])
    normal = np.tile([1.0, 0.0], (len(point), 1))
    return simulate(scene, parameters, motion, contact_point=point, contact_normal=normal)
