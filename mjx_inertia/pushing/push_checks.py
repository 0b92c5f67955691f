"""What a batch of pushes must be before it is simulated.

In: parameters, motions, contacts and poses of n pushes. Out: `ValueError` for arrays that do not
belong together; which pushes no object and no tip can make, and why.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from mjx_inertia.pushing.parameters import PushParameters
from mjx_inertia.pushing.record import Motion, SampledMotion, StraightMotion
from mjx_inertia.pushing.scene import Scene

LONGEST_PUSH = 600.0  # s; the slowest push of the data takes 15 s
_REACH = 5.0  # m from the world's origin; nothing on a table is further
_FASTEST = 10.0  # m/s
_UNIT = 1e-3  # by which the length of a unit vector may be off

# of one push; None for any number of rows
_SHAPES: dict[str, tuple[int | None, ...]] = {
    **dict.fromkeys(("parameters.inertia", "parameters.com", "parameters.half_extents"), (3,)),
    "parameters.polygons": (None, None, 2),
    **dict.fromkeys(("motion.start", "motion.direction", "contact_point", "contact_normal"), (2,)),
    "motion.offsets": (None, 2),
    "pose": (3,),
}
_ABOVE_ZERO = ("mass", "inertia", "half_extents", "friction", "tip_time_constant")
_ZERO_OR_MORE = ("friction_radius", "tip_friction")


def named_arrays(
    parameters: PushParameters, motion: Motion, others: Mapping[str, Any]
) -> dict[str, np.ndarray]:
    """The arrays of a call by the names that a message gives them; what is None is left out."""
    records = {"parameters": parameters, "motion": motion}
    found = {
        f"{owner}.{name}": value
        for owner, record in records.items()
        for name, value in vars(record).items()
        if value is not None
    }
    return {name: np.asarray(value) for name, value in (found | dict(others)).items()}


def check_shapes(arrays: Mapping[str, np.ndarray], n: int) -> None:
    """Raises ValueError for the first array that does not have one entry for each of n pushes."""
    for name, value in arrays.items():
        wanted = _SHAPES.get(name, ())
        fits = len(value.shape) == 1 + len(wanted) and all(
            size is None or size == found
            for size, found in zip(wanted, value.shape[1:], strict=True)
        )
        if not fits or value.shape[0] != n:
            expected = ", ".join("any" if size is None else str(size) for size in (n, *wanted))
            raise ValueError(
                f"{name} has shape {value.shape}, expected ({expected}): contact_point has {n} "
                "rows, give every argument one entry for each push"
            )


def impossible_pushes(
    scene: Scene, arrays: Mapping[str, np.ndarray], motion: Motion
) -> tuple[Bool[np.ndarray, " n"], str]:
    """Which pushes cannot be, and one sentence on the first fault found.

    Args:
      scene: in which they are to run.
      arrays: of the call, see `named_arrays`; their shapes are as `check_shapes` wants them.
      motion: of the tips.
    """
    wrong = np.zeros(len(arrays["contact_point"]), bool)
    sentence = ""
    with np.errstate(invalid="ignore", over="ignore"):
        conditions = list(_conditions(scene, arrays, motion))
    for name, good, expected in conditions:
        new = ~good.reshape(len(wrong), -1).all(1)
        if new.any() and not sentence:
            row = int(np.flatnonzero(new)[0])
            value = arrays[name][row]
            shown = value.tolist() if value.size <= 3 else f"an array of {value.size} numbers"
            sentence = f"{name}={shown} of push {row}: expected {expected}"
        wrong |= new
    return wrong, sentence


def _conditions(
    scene: Scene, arrays: Mapping[str, np.ndarray], motion: Motion
) -> Iterator[tuple[str, Bool[np.ndarray, "n ..."], str]]:
    """Argument, where it is as it should be, and what it should be; NaN fails every comparison."""
    for name, value in arrays.items():
        yield name, np.isfinite(value), "finite numbers"
    for name in _ABOVE_ZERO:
        yield f"parameters.{name}", arrays[f"parameters.{name}"] > 0.0, "more than 0"
    for name in _ZERO_OR_MORE:
        yield f"parameters.{name}", arrays[f"parameters.{name}"] >= 0.0, "0 or more"
    duration = arrays["motion.duration"]
    yield "motion.duration", (duration > 0.0) & (duration <= LONGEST_PUSH), "above 0, up to 600 s"

    # the CoM and the first contact lie within the object, whose frame is not always at its centre
    extents = arrays["parameters.half_extents"][:, :2]
    if (polygons := arrays.get("parameters.polygons")) is not None:
        extents = np.maximum(extents, np.abs(polygons).max((1, 2)))
    center = np.asarray(scene.object_model.center)
    reach = 2.0 * np.linalg.norm(extents, axis=1) + np.linalg.norm(center[:2])
    at = f"within {reach.max():.3g} m of the object frame's origin"
    com = arrays["parameters.com"]
    yield "parameters.com", np.linalg.norm(com[:, :2], axis=1) <= reach, at
    yield "parameters.com", np.abs(com[:, 2]) <= _REACH, f"a height below {_REACH} m"
    yield "pose", np.abs(arrays["pose"][:, :2]) <= _REACH, f"x and y within {_REACH} m"
    offset = arrays["contact_point"] - arrays["pose"][:, :2]
    approach = np.linalg.norm(arrays["motion.start"] - arrays["pose"][:, :2], axis=1)
    near = np.linalg.norm(offset, axis=1) <= np.maximum(reach, approach)
    yield "contact_point", near, "a point as near to the object as the tip's start"

    yield "motion.start", np.abs(arrays["motion.start"]) <= _REACH, f"x and y within {_REACH} m"
    yield from _of_motion(arrays, motion)
    normal = arrays["contact_normal"]
    yield "contact_normal", _is_unit(normal), "a unit vector"
    inward = _inward(motion, normal)
    yield "contact_normal", inward, "the inward normal: at some time the tip moves along it"


def _of_motion(
    arrays: Mapping[str, np.ndarray], motion: Motion
) -> Iterator[tuple[str, Bool[np.ndarray, "n ..."], str]]:
    if isinstance(motion, StraightMotion):
        speed = arrays["motion.speed"]
        yield "motion.direction", _is_unit(arrays["motion.direction"]), "a unit vector"
        yield "motion.speed", (speed >= 0.0) & (speed <= _FASTEST), f"0 to {_FASTEST} m/s"
        yield "motion.ramp", arrays["motion.ramp"] >= 0.0, "0 s or more"
    if isinstance(motion, SampledMotion):
        offsets, interval = arrays["motion.offsets"], arrays["motion.interval"]
        yield "motion.interval", interval > 0.0, "more than 0 s"
        steps = np.linalg.norm(np.diff(offsets, axis=1), axis=-1)
        slow = steps <= _FASTEST * interval[:, None]
        yield "motion.offsets", slow, f"knots that the tip passes at up to {_FASTEST} m/s"


def _is_unit(vectors: Float[np.ndarray, "n 2"]) -> Bool[np.ndarray, " n"]:
    return np.abs(np.linalg.norm(vectors, axis=1) - 1.0) <= _UNIT


def _inward(motion: Motion, normal: Float[np.ndarray, "n 2"]) -> Bool[np.ndarray, " n"]:
    """Whether the tip is further along the normal than at its start, at some time."""
    straight = isinstance(motion, StraightMotion)
    travel = np.asarray(motion.direction)[:, None] if straight else np.asarray(motion.offsets)
    return (travel * normal[:, None]).sum(-1).max(1) > 0.0
