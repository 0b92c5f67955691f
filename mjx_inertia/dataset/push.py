"""One push as identification takes it, and its simulation in one call.

In: an object and where it is pushed. Out: `Push`. The object's frame is the world's at the start;
the record follows the centroid of the outline.
"""

import functools
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from jaxtyping import Float

from mjx_inertia.dataset.batch import PushTruth
from mjx_inertia.dataset.noise import SensorNoise, add_noise
from mjx_inertia.objects import ObjectModel, closest_on_outline, cube, friction_radius
from mjx_inertia.pushing import (
    PushRecord,
    PushSetup,
    Scene,
    SceneSettings,
    StraightMotion,
    build_scene,
    first_contact,
    object_parameters,
    plan_polygons,
    simulate,
    stack_polygons,
)
from mjx_inertia.pushing.settings import CLEARANCE


@struct.dataclass
class Push:
    """One push of one object; an estimator reads the record and the setup, never the truth."""

    record: PushRecord  # what was measured
    setup: PushSetup  # what was known before: outline, pose, path of the tip
    truth: PushTruth | None = None  # of the simulated object; None for a real push


def simulate_push(
    obj: ObjectModel,
    contact_point: Sequence[float],
    direction: Sequence[float] | None = None,
    *,
    speed: float = 0.06,
    duration: float = 0.6,
    friction: float | None = None,
    tip_friction: float = 0.3,
    tip_time_constant: float = 0.02,
    rate: float = 100.0,
    noise: SensorNoise | None = None,
    seed: int = 0,
) -> Push:
    """Pushes an object on a table along a straight line, at constant speed from the first touch.

    Boxes of all sizes share one compiled program, as do other objects whose outlines take about as
    many convex polygons.

    Args:
      obj: the object, at rest on the table.
      contact_point: x, y of a point of the outline, object frame, m. The path of the tip leads
        there; the tip touches the object where that path first meets it.
      direction: of the path, x, y; the inward normal at `contact_point` if None.
      speed: of the tip, m/s.
      duration: of the push, s.
      friction: between object and table; that of `obj` if None.
      tip_friction: between tip and object.
      tip_time_constant: of their contact, s; at least 0.01.
      rate: samples a second, Hz.
      noise: of the sensors; signals are exact if None.
      seed: of the noise.

    Raises:
      ValueError: a contact point off the outline, a direction that does not lead into the object
        or in which the tip misses it, a speed, duration or friction that is not positive, or a
        contact that is too stiff; each by its name.
    """
    friction = obj.friction if friction is None else friction
    _check_positive(speed=speed, duration=duration, friction=friction, rate=rate)
    if not 0.0 <= tip_friction < np.inf:
        raise ValueError(f"tip_friction={tip_friction}: must be zero or more")
    if not 0.01 <= tip_time_constant < np.inf:
        raise ValueError(f"tip_time_constant={tip_time_constant}: must be 0.01 s or more")
    settings = SceneSettings(rate=rate)
    height, radius = min(settings.tip_height, obj.height / 2), settings.tip_radius
    polygons = plan_polygons(obj, height, radius)
    middle, point, normal, path = _first_touch(obj, polygons, contact_point, direction, radius)
    motion = StraightMotion(
        start=middle - CLEARANCE * path,
        direction=path,
        speed=np.asarray(speed),
        ramp=np.zeros(()),
        duration=np.asarray(duration),
    )

    # the tracked frame lies at the outline's centroid: the frame in which all objects are alike
    centroid = obj.footprint.centroid
    pose = np.append(centroid, 0.0)
    plan = None if obj.is_box else _of_shape_class(polygons - centroid)
    parameters = object_parameters(obj, friction, tip_friction, tip_time_constant)
    com = np.asarray(obj.inertial.com, float)
    parameters = parameters.replace(com=com - np.append(centroid, 0.0), polygons=plan)

    batch = jax.tree.map(lambda x: np.asarray(x)[None], (parameters, motion))
    where = {"contact_point": point[None], "contact_normal": normal[None], "pose": pose[None]}
    record = simulate(shared_scene(settings), *batch, **where)
    if noise is not None:
        record = add_noise(record, np.zeros(1, np.uint32), noise, key=jax.random.key(seed))

    return Push(
        record=jax.tree.map(lambda x: np.asarray(x[0]), record),
        setup=PushSetup(
            motion=motion,
            pose=pose,
            half_extents=obj.half_extents,
            friction_radius=np.asarray(friction_radius(obj.outline, centroid)),
            shape=np.zeros((), np.int32),
            polygons=plan,
        ),
        truth=_truth_from_contact(obj, point, normal),
    )


def _check_positive(**values: float) -> None:
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0.0):
            raise ValueError(f"{name}={value}: must be positive")


def _truth_from_contact(obj: ObjectModel, point: np.ndarray, normal: np.ndarray) -> PushTruth:
    """True parameters, the CoM in the frame of the contact."""
    arm = np.asarray(obj.inertial.com, float)[:2] - point
    return PushTruth(
        mass=np.asarray(obj.inertial.mass, float),
        inertia=np.asarray(obj.inertial.inertia, float)[2, 2],
        com=np.array([arm @ normal, normal[0] * arm[1] - normal[1] * arm[0]]),
    )


def shared_scene(settings: SceneSettings) -> Scene:
    """The scene in which the object of any `Push` moves, in the precision that JAX is set to.

    It is made once, and a scene that is kept keeps its compiled programs.
    """
    return _scene(settings, jnp.result_type(float))


@functools.lru_cache(maxsize=8)
def _scene(settings: SceneSettings, dtype: np.dtype) -> Scene:
    return build_scene(cube(0.15, 1.0), settings)


def _first_touch(
    obj: ObjectModel,
    polygons: Float[np.ndarray, "m k 2"],
    contact_point: Sequence[float],
    direction: Sequence[float] | None,
    radius: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Middle of the tip at the first touch, point touched, inward normal there, unit direction."""
    aim = np.asarray(contact_point, float)
    if aim.shape != (2,) or not np.isfinite(aim).all():
        raise ValueError(f"contact_point={contact_point}: give two finite numbers, x and y in m")
    nearest = closest_on_outline(obj.outline, aim[None])
    if abs(nearest.distance[0]) > radius:
        raise ValueError(
            f"contact_point={contact_point} is {1e3 * abs(nearest.distance[0]):.0f} mm off the "
            f"outline of {obj.name}; the nearest point of it is {nearest.point[0].tolist()}"
        )
    path = np.asarray(nearest.normal[0] if direction is None else direction, float)
    length = np.linalg.norm(path)
    if path.shape != (2,) or not (np.isfinite(length) and length > 0.0):
        raise ValueError(f"direction={direction}: give two finite numbers, not both zero")
    path = path / length
    if path @ nearest.normal[0] < 1e-9:
        raise ValueError(
            f"direction={direction} does not lead into {obj.name} at contact_point="
            f"{contact_point}; the inward normal there is {nearest.normal[0].tolist()}"
        )
    found = first_contact(polygons, nearest.point[0] - radius * nearest.normal[0], path, radius)
    if found is None:
        raise ValueError(f"direction={direction}: the tip passes by {obj.name} on this path")
    return *found, path


def _of_shape_class(polygons: Float[np.ndarray, "m k 2"]) -> Float[np.ndarray, "p q 2"]:
    """The polygons, filled up to powers of two in number and corners: few programs for many."""
    pieces, corners = (1 << (count - 1).bit_length() for count in polygons.shape[:2])
    return stack_polygons([polygons, np.zeros((pieces, corners, 2))])[0]
