"""Collisions in simulation: against a mass and a spring, whose peak force is v √(k m)."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from mjx_inertia.grasping import GraspMotion
from mjx_inertia.robots import BASE, Robot, with_payload
from mjx_inertia.spatial import InertialParameters, Pose
from parts.collision import Bottle, ControlSettings, Pillar, collide

pytestmark = pytest.mark.float64

SPEED = 0.4  # m/s
IDLE = ControlSettings(stiffness=1e-6, damping=1e-6)  # lets go: inertia alone strikes


def sled(mass=1.5):
    """One joint that slides along x."""
    one = {"lower": -9.0, "upper": 9.0, "velocity_limit": 9.0, "torque_limit": 1e4, "armature": 0.0}
    return Robot(
        T_world_base=Pose.identity(),
        T_parent_joint=Pose(np.eye(3)[None], np.zeros((1, 3))),
        axis=np.array([[1.0, 0.0, 0.0]]),
        links=InertialParameters(np.array([mass]), np.zeros((1, 3)), 1e-3 * np.eye(3)[None]),
        T_link_hand=Pose(np.eye(3)[None], np.array([[0.1, 0.0, 0.3]])),
        gravity=np.array([0.0, 0.0, -9.81]),
        parents=(BASE,),
        hands=(0,),
        prismatic=(True,),
        name="sled",
        joint_names=("slide",),
        **{name: np.array([value]) for name, value in one.items()},
    )


def coasting():
    """At constant speed for a second."""
    time = jnp.linspace(0.0, 1.0, 51)
    along = jnp.zeros((51, 6)).at[:, 0].set(SPEED)
    return GraspMotion(
        time=time,
        weight=jnp.full(51, 1.0 / 51),
        q=SPEED * time[:, None],
        qd=jnp.full((51, 1), SPEED),
        qdd=jnp.zeros((51, 1)),
        twist=along,
        tangent=along,
        error=jnp.zeros((51, 2)),
        conditioning=jnp.ones(51),
    )


@pytest.mark.parametrize("payload", [0.0, 2.5])
def test_a_pillar_feels_the_whole_mass(payload):
    arm = sled()
    if payload:
        body = InertialParameters(jnp.asarray(payload), jnp.zeros(3), 1e-3 * jnp.eye(3))
        arm = with_payload(arm, body, Pose.identity())
    pillar = Pillar(damping=0.0, pad_mass=1e-3)
    found = collide(arm, coasting(), pillar, 20, IDLE)
    assert found.contact_time == pytest.approx(0.4, abs=2e-3)
    assert found.speed == pytest.approx(SPEED, rel=1e-3)
    expected = SPEED * np.sqrt(pillar.stiffness * (1.5 + payload))
    assert found.peak_force == pytest.approx(expected, rel=0.01)
    after = found.time[np.argmax(found.force)] - found.contact_time
    assert after == pytest.approx(np.pi / 2 * np.sqrt((1.5 + payload) / 2e4), rel=0.05)


def test_a_bottle_is_pushed_away_and_feels_the_reduced_mass():
    bottle = Bottle(damping=0.0, friction=1e-3)
    found = collide(sled(), coasting(), bottle, 20, IDLE)
    reduced = 1.5 * bottle.mass / (1.5 + bottle.mass)
    assert found.peak_force == pytest.approx(SPEED * np.sqrt(bottle.stiffness * reduced), rel=0.05)
    assert found.force[-1] < 0.1 * found.peak_force


def test_control_pushes_on():
    """Against a pillar the controller goes on pushing, the harder the stiffer it is."""
    soft, stiff = (
        collide(sled(), coasting(), Pillar(), 20, ControlSettings(k, 2 * np.sqrt(k), after=0.3))
        for k in (25.0, 400.0)
    )
    assert stiff.force[-1] > 3.0 * max(soft.force[-1], 0.1)


def test_nothing_is_hit_at_rest():
    still = dataclasses.replace(coasting(), twist=jnp.zeros((51, 6)))
    with pytest.raises(ValueError, match="waypoint 20: the hand is at rest"):
        collide(sled(), still, Pillar(), 20)
