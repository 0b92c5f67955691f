"""An arm that runs into something on its way, carried out in MuJoCo.

In: a `Robot` with its payload, a planned `GraspMotion`, an obstacle. Out: the contact force over
time. The arm follows its motion under computed-torque control, which knows the payload; a small
ball at the hand is what hits. The force of a compliant collision is what effective mass is about:
of a mass m at speed v against a spring k it is at most v √(k m).
"""

import dataclasses

import mujoco
import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

from mjx_inertia.grasping import GraspMotion
from mjx_inertia.robots import Robot, robot_spec

_BUMPER = 0.01  # m, radius of the ball at the hand
# time constant (s) and damping ratio of the contact itself, and its impedance, as near rigid as the
# time step allows: the compliance is that of the spring behind it
_HARD, _RIGID = (0.0002, 1.0), (0.999, 0.999, 0.001, 0.5, 2.0)
_RATE = 10_000.0  # Hz, of the simulation


@dataclasses.dataclass(frozen=True)
class Pillar:
    """A rigid pillar with a force sensor: a pad on a spring."""

    stiffness: float = 2e4  # of the sensor, N/m
    damping: float = 5.0  # of the sensor, N s/m
    pad_mass: float = 0.02  # kg


@dataclasses.dataclass(frozen=True)
class Bottle:
    """A bottle that stands on a table and yields like a spring where it is hit."""

    mass: float = 0.5  # kg
    height: float = 0.2  # m
    radius: float = 0.035  # m
    friction: float = 0.5  # with the table
    stiffness: float = 5e3  # of its wall, N/m
    damping: float = 5.0  # of its wall, N s/m
    hit_height: float = 0.1  # where it is hit, above its base, m


@dataclasses.dataclass(frozen=True)
class Collision:
    """Contact force of a collision."""

    time: Float[ndarray, " t"]  # s since the start of the motion
    force: Float[ndarray, " t"]  # of the obstacle's spring, N
    contact_time: float  # when the force first rises, s; NaN if nothing was hit
    speed: float  # of the hand before, m/s

    @property
    def peak_force(self) -> float:
        """N."""
        return float(self.force.max())


@dataclasses.dataclass(frozen=True)
class ControlSettings:
    """Computed-torque control: τ = M (q̈_d + k_d ė + k_p e) + bias."""

    # k_p, 1/s²; soft, as an arm of series elastic drives is, so that what is felt in the first
    # hundredths of a second is inertia and not control
    stiffness: float = 25.0
    damping: float = 10.0  # k_d, 1/s
    after: float = 0.1  # how long the simulation goes on after the first contact, s


def collide(
    arm: Robot,
    motion: GraspMotion,
    obstacle: Pillar | Bottle,
    waypoint: int,
    control: ControlSettings | None = None,
) -> Collision:
    """Carries out a planned motion of one move; at a waypoint the hand meets an obstacle head-on.

    The controller knows the inertia of the arm with its payload.

    Raises:
      ValueError: a waypoint at which the hand is at rest.
    """
    chosen = control or ControlSettings()
    linear = np.asarray(motion.twist, np.float64)[waypoint, :3]
    speed = float(np.linalg.norm(linear))
    if not speed > 1e-3:
        raise ValueError(f"waypoint {waypoint}: the hand is at rest there and hits nothing")
    time, q, qd = (np.asarray(x, np.float64) for x in (motion.time, motion.q, motion.qd))
    planned = CubicHermiteSpline(time, q, qd)
    model = _model(arm, planned(float(motion.time[waypoint])), linear / speed, obstacle)
    return _run(model, arm.dof, planned, obstacle, chosen, float(motion.time[-1]))


def _model(
    arm: Robot, q: Float[ndarray, " n"], direction: Float[ndarray, "3"], obstacle: Pillar | Bottle
) -> mujoco.MjModel:
    spec = robot_spec(arm)
    spec.option.timestep = 1.0 / _RATE
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for geom in spec.geoms:
        geom.contype, geom.conaffinity = 0, 0
    hand = spec.site("hand")
    bumper = hand.parent.add_geom(
        name="bumper", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[_BUMPER, 0, 0], pos=hand.pos,
        mass=0.0, contype=0, conaffinity=0,
    )  # fmt: skip
    bare = spec.compile()
    data = mujoco.MjData(bare)
    data.qpos[:] = q
    mujoco.mj_kinematics(bare, data)
    place = data.geom("bumper").xpos + _BUMPER * direction
    condim = 3
    if isinstance(obstacle, Pillar):
        body = spec.worldbody.add_body(name="pad", pos=place, quat=_across(direction))
        body.gravcomp = 1.0
        body.add_geom(
            name="face", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.01, 0.1, 0.1], pos=[0.01, 0, 0],
            mass=obstacle.pad_mass, contype=0, conaffinity=0,
        )  # fmt: skip
        _spring(body, obstacle.stiffness, obstacle.damping)
        condim = 1
    else:
        _add_bottle(spec, obstacle, place, direction)
    spec.add_pair(
        name="hit", geomname1=bumper.name, geomname2="face", condim=condim, solref=_HARD,
        solimp=_RIGID,
    )  # fmt: skip
    return spec.compile()


def _add_bottle(
    spec: mujoco.MjSpec,
    obstacle: Bottle,
    place: Float[ndarray, "3"],
    direction: Float[ndarray, "3"],
) -> None:
    """A free cylinder on its table; the spring of its wall carries the face that is hit."""
    level = direction * [1.0, 1.0, 0.0] / np.linalg.norm(direction[:2])
    base = place + level * obstacle.radius - [0.0, 0.0, obstacle.hit_height]
    middle = base + np.array([0.0, 0.0, obstacle.height / 2])
    bottle = spec.worldbody.add_body(name="bottle", pos=middle)
    bottle.add_freejoint()
    bottle.add_geom(
        name="bottle", type=mujoco.mjtGeom.mjGEOM_CYLINDER, mass=obstacle.mass, contype=0,
        size=[obstacle.radius, obstacle.height / 2, 0], conaffinity=0,
    )  # fmt: skip
    spec.worldbody.add_geom(
        name="table", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 0.1], pos=base, contype=0,
        conaffinity=0,
    )  # fmt: skip
    friction = [obstacle.friction, obstacle.friction, 0.0, 0.0, 0.0]
    spec.add_pair(geomname1="table", geomname2="bottle", condim=3, friction=friction)
    face = bottle.add_body(name="pad", pos=place - middle, quat=_across(level))
    face.add_geom(
        name="face", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.005, 0.03, 0.05], pos=[0.005, 0, 0],
        mass=0.01, contype=0, conaffinity=0,
    )  # fmt: skip
    _spring(face, obstacle.stiffness, obstacle.damping)


def _spring(body: mujoco.MjsBody, stiffness: float, damping: float) -> None:
    body.add_joint(
        name="spring", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1, 0, 0], stiffness=stiffness,
        damping=damping,
    )  # fmt: skip


def _across(direction: Float[ndarray, "3"]) -> Float[ndarray, "4"]:
    """Quaternion (wxyz) of a frame whose x axis is `direction`."""
    turn = Rotation.align_vectors([direction], [[1.0, 0.0, 0.0]])[0]
    return turn.as_quat(scalar_first=True)


def _run(
    model: mujoco.MjModel,
    dof: int,
    planned: CubicHermiteSpline,
    obstacle: Pillar | Bottle,
    control: ControlSettings,
    duration: float,
) -> Collision:
    # start on the planned motion
    data = mujoco.MjData(model)
    spring = model.joint("spring")
    at, moving = spring.qposadr[0], spring.dofadr[0]
    speed_at, rate_at = planned.derivative(), planned.derivative(2)
    data.qpos[:dof], data.qvel[:dof] = planned(0.0), speed_at(0.0)
    mass, times, forces = np.zeros((model.nv, model.nv)), [], []
    contact_time, speed = np.nan, np.nan
    hand, last = model.site("hand").id, np.zeros(3)
    while data.time < duration:
        time = data.time
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fullM(model, data, mass)
        # computed torque
        error, slip = planned(time) - data.qpos[:dof], speed_at(time) - data.qvel[:dof]
        wanted = rate_at(time) + control.damping * slip + control.stiffness * error
        torque = mass[:dof, :dof] @ wanted + data.qfrc_bias[:dof]
        data.qfrc_applied[:dof] = torque
        # one step, and whether it brought the first contact
        here = data.site_xpos[hand].copy()
        mujoco.mj_step(model, data)
        times.append(data.time)
        forces.append(obstacle.stiffness * data.qpos[at] + obstacle.damping * data.qvel[moving])
        if np.isnan(contact_time) and data.ncon and _touches(model, data):
            contact_time = data.time
            speed = float(np.linalg.norm(here - last) * _RATE)
        if data.time > contact_time + control.after:
            break
        last = here
    return Collision(np.array(times), np.array(forces), contact_time, speed)


def _touches(model: mujoco.MjModel, data: mujoco.MjData) -> bool:
    face = model.geom("face").id
    return any(face in pair for pair in data.contact.geom)
