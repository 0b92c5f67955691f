"""Candidate grasps of a parallel jaw: antipodal pairs of points on a mesh that the hand can reach.

In: an object, a gripper, a number of grasps. Out: `GraspSample`.
"""

import dataclasses
import warnings

import numpy as np
import trimesh
from jaxtyping import Float
from numpy import ndarray

from mjx_inertia.grasping.grasp import Grasp, Gripper, grasps_at, hand_frames_from_points
from mjx_inertia.grasping.hand_clearance import above_plane, collides, pads_blocked
from mjx_inertia.objects import ObjectModel

_INSIDE = 1e-6  # of the object's size: how far inside the surface a ray starts


@dataclasses.dataclass(frozen=True)
class SamplerSettings:
    """How candidates are drawn."""

    # directions of approach tried for each pair of contacts, at equal angles about the closing
    # direction from a random one on
    approaches: int = 8
    # how far the closing direction may lean from the first contact's normal, as a share of the half
    # angle of the friction cone; 0 is along the normal
    tilt: float = 0.5
    # by how much each finger stands back from its contact when the hand arrives, m
    clearance: float = 0.003
    above_table: bool = False  # whether the hand must be above the plane z = 0 of the object frame
    rays_per_grasp: int = 25  # rays cast at most for each grasp asked for, and 20,000 in any case

    def __post_init__(self) -> None:
        """Checks the figures."""
        if self.approaches < 1 or not 0.0 <= self.tilt <= 1.0 or self.clearance < 0.0:
            raise ValueError(
                f"`approaches` is {self.approaches}, `tilt` {self.tilt} and `clearance` "
                f"{self.clearance}; expected at least 1, from 0 to 1, and not negative"
            )


@dataclasses.dataclass(frozen=True)
class GraspSample:
    """What a search for grasps found."""

    grasps: Grasp  # with one leading axis, as many as were found, at most `requested`
    requested: int  # how many were asked for
    rays: int  # how many rays were cast through the object
    # candidates lost by their reason: pairs of contacts by `friction`, `width` and `pads` (no room
    # for a finger from any side), hands by `table` and `collision`
    rejected: dict[str, int]

    @property
    def complete(self) -> bool:
        """Whether as many were found as were asked for."""
        return len(self.grasps.width) == self.requested


@dataclasses.dataclass(frozen=True)
class _Candidates:
    """Contacts with directions of approach, before they become grasps."""

    points: Float[ndarray, "n 2 3"]
    normals: Float[ndarray, "n 2 3"]
    approach: Float[ndarray, "n 3"]

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, rows: ndarray | slice) -> "_Candidates":
        return _Candidates(self.points[rows], self.normals[rows], self.approach[rows])

    @property
    def width(self) -> Float[ndarray, " n"]:
        return np.linalg.norm(self.points[:, 1] - self.points[:, 0], axis=1)


def sample_grasps(
    obj: ObjectModel,
    gripper: Gripper,
    count: int,
    *,
    seed: int,
    friction: float = 0.5,
    settings: SamplerSettings = SamplerSettings(),  # frozen
) -> GraspSample:
    """Antipodal grasps: the line between the contacts is in both friction cones (Nguyen 1988).

    The first contact is uniform on the surface. A ray from it into the object, within the friction
    cone, leaves the object at one or more places, each of which may be the other contact (so a mug
    is held by its wall or around it). A pair is kept if the jaw can open that wide and the hand
    does not overlap the object, see `hand_clearance`.

    The same `seed` gives the same grasps; `friction` is Coulomb's coefficient between pad and
    object.

    Warns:
      UserWarning: fewer than `count` were found.

    Raises:
      ValueError: none was found, with the widths met; or `count` or `friction` is not positive.
    """
    if count < 1 or not friction > 0.0:
        raise ValueError(f"`count` {count} and `friction` {friction} must be positive")
    generator = np.random.default_rng(seed)
    rejected: dict[str, int] = {
        why: 0 for why in ("friction", "width", "pads", "table", "collision")
    }
    found: list[_Candidates] = []
    widths = [np.inf, -np.inf]
    have = rays = 0
    # batches of rays, as many as the yield so far suggests
    while have < count and rays < 20_000 + settings.rays_per_grasp * count:
        batch = int(np.clip(1.2 * (count - have) * rays / max(have, 1), 512, 20_000))
        pairs = _opposite_contacts(obj.mesh, batch, friction, settings.tilt, generator, rejected)
        widths = [min(widths[0], *pairs.width), max(widths[1], *pairs.width)]
        found.append(_reachable(obj.mesh, gripper, pairs, settings, generator, rejected))
        rays += batch
        have += len(found[-1])
    # fewer than asked for, or none
    if have == 0:
        raise ValueError(_nothing_found(obj.name, gripper, friction, widths, rejected))
    if have < count:
        warnings.warn(
            f"{obj.name}: {have} of {count} grasps for {gripper.name} found with {rays} rays; "
            f"rejected: {rejected}",
            stacklevel=2,
        )
    grasps = grasps_at(
        *(
            np.concatenate([getattr(some, field) for some in found])[:count]
            for field in ("points", "normals", "approach")
        )
    )
    return GraspSample(grasps, count, rays, rejected)


def _opposite_contacts(
    mesh: trimesh.Trimesh,
    count: int,
    friction: float,
    tilt: float,
    generator: np.random.Generator,
    rejected: dict[str, int],
) -> _Candidates:
    """Pairs within both friction cones, with a random direction of approach."""
    # a point on the surface, and a ray from it into the object
    drawn = trimesh.sample.sample_surface(mesh, count, seed=generator)
    start, face = np.asarray(drawn[0]), np.asarray(drawn[1])
    inward = -mesh.face_normals[face]
    direction = _within_cone(inward, tilt * np.arctan(friction), generator)
    origin = start + _INSIDE * mesh.scale * inward
    hit, ray, other = mesh.ray.intersects_location(origin, direction, multiple_hits=True)
    # where the ray leaves the object, the first hit first, within the other friction cone
    order = np.lexsort((np.sum((hit - origin[ray]) ** 2, axis=1), ray))
    hit, ray, other = hit[order], ray[order], other[order]
    cosine = np.sum(mesh.face_normals[other] * direction[ray], axis=1)
    held = cosine * np.sqrt(1.0 + friction**2) > 1.0
    rejected["friction"] += int(np.sum(~held & (cosine > 0.0)))
    hit, ray, other = hit[held], ray[held], other[held]
    return _Candidates(
        points=np.stack([start[ray], hit], axis=1),
        normals=np.stack([inward[ray], -mesh.face_normals[other]], axis=1),
        approach=generator.normal(size=(len(ray), 3)),
    )


def _within_cone(
    axis: Float[ndarray, "n 3"], half_angle: float, generator: np.random.Generator
) -> Float[ndarray, "n 3"]:
    """Directions uniform in solid angle within cones."""
    cosine = 1.0 - (1.0 - np.cos(half_angle)) * generator.uniform(size=len(axis))
    across = np.cross(axis, generator.normal(size=axis.shape))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return cosine[:, None] * axis + np.sqrt(1.0 - cosine**2)[:, None] * across


def _reachable(
    mesh: trimesh.Trimesh,
    gripper: Gripper,
    pairs: _Candidates,
    settings: SamplerSettings,
    generator: np.random.Generator,
    rejected: dict[str, int],
) -> _Candidates:
    """Hands on the pairs that the gripper can open to and that overlap nothing, in random order."""
    # pairs that the jaw opens to and whose fingers have room
    fits = (pairs.width >= gripper.closed_width) & (pairs.width <= gripper.open_width)
    rejected["width"] += int(np.sum(~fits))
    pairs = pairs[fits]
    blocked = pads_blocked(mesh, gripper, pairs.points, settings.clearance)
    rejected["pads"] += int(np.sum(blocked))
    # hands that approach from all sides, above the table, around the object
    hands = _turned(pairs[~blocked], settings.approaches)
    hands = hands[generator.permutation(len(hands))]
    frames = hand_frames_from_points(hands.points, hands.approach)
    if settings.above_table:
        above = above_plane(gripper, frames, settings.clearance)
        rejected["table"] += int(np.sum(~above))
        hands = hands[above]
        frames = hand_frames_from_points(hands.points, hands.approach)
    hit = collides(mesh, gripper, frames, settings.clearance)
    rejected["collision"] += int(np.sum(hit))
    return hands[~hit]


def _turned(pairs: _Candidates, count: int) -> _Candidates:
    """Each pair `count` times, with its approach turned about the closing direction."""
    axes = hand_frames_from_points(pairs.points, pairs.approach).axes
    angle = 2.0 * np.pi * np.arange(count)[:, None, None] / count
    approach = np.cos(angle) * axes[:, :, 2] + np.sin(angle) * axes[:, :, 0]
    rows = np.tile(np.arange(len(pairs)), count)
    return _Candidates(pairs.points[rows], pairs.normals[rows], approach.reshape(-1, 3))


def _nothing_found(
    name: str, gripper: Gripper, friction: float, widths: list[float], rejected: dict[str, int]
) -> str:
    met = f"opposite contacts are {widths[0]:.4f} to {widths[1]:.4f} m apart"
    if not np.isfinite(widths[0]):
        met = f"no two opposite contacts within a friction of {friction}"
    return (
        f"{name}: no grasp for {gripper.name}, which takes {gripper.closed_width:.4f} to "
        f"{gripper.open_width:.4f} m; {met}; rejected: {rejected}"
    )
