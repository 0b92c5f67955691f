"""A pusher with two fingers, each of which feels its force: the experiment of thesis §3.7.3.

In: an object, its friction and the motion of the pusher, a rigid body that turns about a point of
the table or moves straight. Out: `TwoFingerPush`, what the two fingers and a tracker measure. Few
pushes are made so, and C MuJoCo runs them one by one; the contacts are those of `scene.py`.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from flax import struct
from jaxtyping import Float

from mjx_inertia.objects import ObjectModel, friction_radius
from mjx_inertia.pushing.scene import build_spec
from mjx_inertia.pushing.settings import CLEARANCE, TIP_MASS, TIP_SOLIMP, SceneSettings
from mjx_inertia.spatial import AnyArray

# A cone lifts what slips, the more the faster, and fingers held at their height rub downward on an
# object that rises while it speeds up: that adds up to a fifth to its weight. So fingers are heavy
# in the plane, where they are driven, and light and free up and down.
_FINGER_MASS = 0.05  # kg, felt by vertical motion alone
_FINGERS = ("left", "right")
_PLANE = np.array([[4, 5], [7, 8]])  # their positions in the state, after the object's four


@struct.dataclass
class TwoFingerPush:
    """One push with two fingers (or, with a leading axis, many of one length).

    World axes; sampled at one fixed rate. The object frame is the tracker's.
    """

    time: Float[AnyArray, "*n t"]  # s, at the end of each sampling interval
    # of each finger on the object, N, averaged over the sampling interval
    force: Float[AnyArray, "*n t 2 2"]
    finger_position: Float[AnyArray, "*n t 2 2"]  # centres of the spherical fingers, m
    finger_velocity: Float[AnyArray, "*n t 2 2"]  # m/s
    pose: Float[AnyArray, "*n t 3"]  # x, y (m) and yaw (rad) of the object frame
    # velocity of the object frame's origin (m/s) and angular velocity (rad/s)
    twist: Float[AnyArray, "*n t 3"]


@dataclass(frozen=True)
class TwoFingerSettings:
    """The pusher, its contacts and its sensors."""

    width: float = 0.1  # between the fingers, m
    finger_radius: float = 0.005  # m
    finger_height: float = 0.02  # of their centres above the table, m
    tip_friction: float = 0.3  # between fingers and object
    tip_time_constant: float = 0.02  # of their contacts, s
    rate: float = 20.0  # samples a second, Hz
    timestep: float = 0.001  # of the simulation, s


@dataclass(frozen=True)
class TwoFingerMotion:
    """The pusher speeds up evenly from rest."""

    # of the face's side where the fingers start, m, world: the point between the contacts
    middle: tuple[float, float]
    direction: tuple[float, float]  # unit vector along the inward normal of the face
    acceleration: float  # of the point between the fingers, m/s²
    length: float  # of its path, m
    # from that point to the centre of rotation, which lies along the face to the left of
    # `direction` and as deep in the object as `depth`; None for a straight push
    turning_radius: float | None = None
    depth: float = 0.0  # of the centre of rotation behind the face, m

    @property
    def duration(self) -> float:
        """Of the push, s."""
        return float(np.sqrt(2 * self.length / self.acceleration))

    def place(self, time: float, points: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "k 2"]:
        """Where points of the pusher that start at `points` are at `time`, m."""
        path = 0.5 * self.acceleration * time**2
        ahead = np.asarray(self.direction)
        if self.turning_radius is None:
            return points + path * ahead
        left = np.array([-ahead[1], ahead[0]])
        center = np.asarray(self.middle) + self.turning_radius * left + self.depth * ahead
        turn = path / self.turning_radius
        cos, sin = np.cos(turn), np.sin(turn)
        # what lies to the right of the centre moves ahead when the pusher turns to the left
        return center + (points - center) @ np.array([[cos, sin], [-sin, cos]])


def _add_finger(spec: mujoco.MjSpec, name: str, radius: float, height: float) -> None:
    body = spec.worldbody.add_body(name=name, pos=(0, 0, height), gravcomp=1.0)
    for axis, direction in (("x", (1, 0, 0)), ("y", (0, 1, 0)), ("z", (0, 0, 1))):
        joint = body.add_joint(name=f"{name}_{axis}", axis=direction)
        joint.type = mujoco.mjtJoint.mjJNT_SLIDE
        joint.armature = 0.0 if axis == "z" else TIP_MASS
    sphere = mujoco.mjtGeom.mjGEOM_SPHERE
    off = {"contype": 0, "conaffinity": 0}
    body.add_geom(name=name, type=sphere, size=(radius, 0, 0), mass=_FINGER_MASS, **off)


def _model(obj: ObjectModel, friction: float, settings: TwoFingerSettings) -> mujoco.MjModel:
    scene = SceneSettings(
        rate=1 / settings.timestep,
        max_timestep=settings.timestep,
        tip_radius=settings.finger_radius,
        tip_height=settings.finger_height,
    )
    # the scene of a push with two fingers in place of the tip
    spec = build_spec(obj, scene)
    spec.delete(spec.body("tip"))
    height = min(settings.finger_height, obj.height / 2)
    for name in _FINGERS:
        _add_finger(spec, name, settings.finger_radius, height)
    hulls = [geom.name for geom in spec.geoms if geom.name.startswith("hull")]
    for name in _FINGERS:
        for hull in hulls:
            spec.add_pair(
                name=f"{name}_{hull}", geomname1=name, geomname2=hull, condim=3, solimp=TIP_SOLIMP
            )
    # the foot under the CoM, and the friction of table and fingers
    com = np.asarray(obj.inertial.com)
    spec.body("object").ipos = com
    spec.geom("foot0").pos = (com[0], com[1], spec.geom("foot0").size[0])
    torsion = friction * float(friction_radius(obj.support, com[:2]))
    for pair in spec.pairs:
        if pair.name.startswith("floor"):
            pair.friction = (friction, friction, torsion, 0.0, 0.0)
        else:
            pair.friction = (settings.tip_friction, settings.tip_friction, 0.0, 0.0, 0.0)
            pair.solref = (settings.tip_time_constant, 1.0)
    model = spec.compile()
    for name in _FINGERS:  # MuJoCo scales the stiffness of contacts by it, and knows no armature
        model.body_invweight0[model.body(name).id] = 1 / TIP_MASS
    return model


def simulate_two_finger(
    obj: ObjectModel,
    friction: float,
    motion: TwoFingerMotion,
    settings: TwoFingerSettings = TwoFingerSettings(),
) -> TwoFingerPush:
    """One push of an object that rests at the world's origin, without sensor noise.

    Args:
      obj: the object, on a table that bears it with the limit surface of Eq. 3.7.
      friction: μ between object and table.
      motion: of the pusher.
      settings: the pusher.
    """
    # the fingers a hair's breadth off the face, the object at rest on its foot
    model = _model(obj, friction, settings)
    data = mujoco.MjData(model)
    ahead = np.asarray(motion.direction)
    along = np.array([-ahead[1], ahead[0]])
    back = settings.finger_radius + CLEARANCE
    start = np.asarray(motion.middle) - back * ahead
    fingers = start + np.outer([0.5, -0.5], settings.width * along)
    data.qpos[_PLANE] = fingers
    data.qpos[2] = _sunk(model)
    # driven fingers; forces are means over each sample
    substeps = round(1 / (settings.rate * settings.timestep))
    samples = int(motion.duration * settings.rate)
    rows: list[tuple[np.ndarray, ...]] = []
    for sample in range(samples):
        force = np.zeros((2, 2))
        for i in range(substeps):
            time = (sample * substeps + i) * settings.timestep
            here = motion.place(time, fingers)
            there = motion.place(time + settings.timestep, fingers)
            data.qvel[_PLANE] = (there - here) / settings.timestep
            mujoco.mj_step(model, data)
            force -= data.qfrc_constraint[_PLANE] / substeps
        pose, twist = data.qpos[[0, 1, 3]], data.qvel[[0, 1, 3]]
        rows.append((force, data.qpos[_PLANE], data.qvel[_PLANE], pose, twist))
    force, finger, velocity, pose, twist = (np.stack(x) for x in zip(*rows, strict=True))
    time = (np.arange(samples) + 1) / settings.rate
    return TwoFingerPush(time, force, finger, velocity, pose, twist)


def _sunk(model: mujoco.MjModel) -> float:
    """Height at which the object rests on its foot, m."""
    data = mujoco.MjData(model)
    data.qpos[_PLANE] = 1.0  # fingers out of the way
    for _ in range(400):
        mujoco.mj_step(model, data)
    return float(data.qpos[2])


def measured(push: TwoFingerPush, spread: float, rng: np.random.Generator) -> TwoFingerPush:
    """The same push as sensors with noise give it: sigma = spread/3 of each value (§3.6.1).

    Positions are measured from where the push began.
    """

    def scaled(x: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        return x * (1 + spread / 3 * rng.standard_normal(x.shape))

    def displaced(x: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        return x[0] + scaled(x - x[0])

    return TwoFingerPush(
        time=push.time,
        force=scaled(np.asarray(push.force)),
        finger_position=displaced(np.asarray(push.finger_position)),
        finger_velocity=scaled(np.asarray(push.finger_velocity)),
        pose=displaced(np.asarray(push.pose)),
        twist=scaled(np.asarray(push.twist)),
    )
