"""A robot with a captured object in its hands as a MuJoCo model.

In: a `Robot` with two hands, a `Capture`. Out: `mujoco.MjSpec` of `robots.robot_spec` with the body
`object`, fixed to the first hand and welded to the second. Sensors `force_right`, `torque_right`,
`force_left`, `torque_left` show what each hand exerts on it, in the axes of the hand, about its
origin.
"""

import mujoco
import numpy as np

from mjx_inertia.robots import Robot, robot_spec
from mjx_inertia.robots.mjcf import SIDES, Color, add_geom, placement, set_inertial
from mjx_inertia.space.capture import Capture
from mjx_inertia.spatial import Pose

_OBJECT_COLOR: Color = (0.2, 0.45, 0.8, 1.0)


def capture_spec(robot: Robot, capture: Capture) -> mujoco.MjSpec:
    """The robot and its object as an editable model."""
    spec = robot_spec(robot)
    links = [spec.site(f"hand_{side}").parent for side in SIDES]
    held = links[0].add_body(
        name="object", **placement(robot.T_link_hand[0] @ capture.T_hand_obj[0])
    )
    set_inertial(held, capture.inertial)
    add_geom(held, mujoco.mjtGeom.mjGEOM_SPHERE, [capture.radius, 0.0, 0.0], rgba=_OBJECT_COLOR)
    # a force sensor shows what a body's parent exerts on it: the second hand is a body without
    # mass, and what its link exerts on it, it passes on to the object
    palm = links[1].add_body(name="palm", **placement(robot.T_link_hand[1]))
    palm.explicitinertial = True
    palm.mass, palm.inertia = 0.0, np.zeros(3)
    places = ((held, capture.T_hand_obj[0].inverse()), (palm, Pose.identity()))
    for side, (body, T_body_hand) in zip(SIDES, places, strict=True):
        site = body.add_site(
            name=f"grasp_{side}", size=[0.01, 0.01, 0.01], **placement(T_body_hand)
        )
        for kind in ("force", "torque"):
            spec.add_sensor(
                name=f"{kind}_{side}",
                type=getattr(mujoco.mjtSensor, f"mjSENS_{kind.upper()}"),
                objtype=mujoco.mjtObj.mjOBJ_SITE,
                objname=site.name,
            )
    relative = placement(capture.T_hand_obj[1])
    weld = spec.add_equality(
        name="grasp", type=mujoco.mjtEq.mjEQ_WELD, name1="palm", name2="object"
    )
    weld.objtype = mujoco.mjtObj.mjOBJ_BODY
    weld.data[:11] = np.concatenate([np.zeros(3), relative["pos"], relative["quat"], [1.0]])
    return spec
