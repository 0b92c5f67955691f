"""A robot that nobody made for us: a torso that turns between a base and two unlike arms."""

import numpy as np

from mjx_inertia.robots import load_robot
from mjx_inertia.space.capture import Capture
from mjx_inertia.spatial import InertialParameters, Pose

FOREIGN = """
<mujoco model="foreign">
  <compiler angle="radian"/>
  <option gravity="0 0 -1.6"/>
  <worldbody>
    <body name="stand" pos="3 0 0"><geom size="0.1"/></body>
    <body name="bus" pos="0.4 -0.3 1.5" quat="0.8 0.2 -0.4 0.3">
      <freejoint name="afloat"/>
      <inertial pos="0.05 0.02 -0.1" quat="0.9 0.1 0.2 0" mass="60" diaginertia="9 8 6"/>
      <body name="mast" pos="0 0 0.6" quat="0.9 0 0.3 0.1">
        <inertial pos="0 0 0.4" mass="4" diaginertia="0.4 0.4 0.01"/>
      </body>
      <body name="torso" pos="0.5 0 0.2" quat="0.7 0 0.7 0">
        <inertial pos="0 0.01 0.1" mass="12" diaginertia="0.3 0.25 0.2"/>
        <joint name="yaw" axis="1 0 0" pos="0 0 0.05" armature="0.4" range="-2 2"/>
        <body name="upper" pos="0.1 -0.3 0.1" quat="0.9 0.1 0.3 -0.2">
          <inertial pos="0.2 0 0.01" mass="3" diaginertia="0.01 0.05 0.05"/>
          <joint name="swing" axis="0 0 1" armature="0.1" ref="0.3" range="-3 3"/>
          <joint name="lift" axis="0 1 0" pos="0.02 0 0"/>
          <body name="fore" pos="0.5 0 0">
            <inertial pos="0.2 0.01 0" quat="0.8 0.1 0.2 0.5" mass="2"
              diaginertia="0.03 0.02 0.02"/>
            <joint name="elbow" axis="0 1 1"/>
            <body name="wrist" pos="0.4 0 0" quat="0.6 0.2 0 0.7">
              <inertial pos="0.05 0 0.02" mass="0.8" diaginertia="0.004 0.005 0.006"/>
              <joint name="bend" axis="1 0 0"/>
              <site name="grip" pos="0.1 0.02 0" quat="0.8 0.1 0 0.5"/>
            </body>
          </body>
        </body>
        <body name="boom" pos="0.1 0.4 0">
          <inertial pos="0.3 0 0" mass="5" diaginertia="0.02 0.2 0.2"/>
          <joint name="slew" axis="0 0.6 0.8" armature="0.2"/>
          <body name="rod" pos="0.6 0 0">
            <inertial pos="0.2 0 0" mass="1.5" diaginertia="0.005 0.03 0.03"/>
            <joint name="reach" type="slide" axis="1 0 0" range="-0.3 0.4" ref="0.1"
              armature="0.1"/>
            <body name="neck" pos="0.4 0 0">
              <inertial pos="0.05 0 0" mass="0.7" diaginertia="0.003 0.003 0.002"/>
              <joint name="pan" axis="0 0 1"/>
              <body name="knuckle" pos="0.1 0 0">
                <inertial pos="0.04 0 0" mass="0.6" diaginertia="0.002 0.002 0.002"/>
                <joint name="tilt" axis="0 1 0"/>
                <joint name="spin" axis="1 0 0"/>
                <body name="claw" pos="0.1 0 0.02" quat="0.7 0.1 0.7 0">
                  <inertial pos="0 0 0.03" mass="0.2" diaginertia="0.0002 0.0002 0.0001"/>
                </body>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
HANDS = ("grip", "claw")


def foreign_robot(folder):
    path = folder / "foreign.xml"
    path.write_text(FOREIGN)
    return load_robot(path, HANDS)


def foreign_capture():
    """On no special axes; the second hand's pose plays no part in a tree."""
    turns = np.stack([np.eye(3), np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])])
    inertia = np.array([[0.3, 0.02, 0.01], [0.02, 0.25, -0.03], [0.01, -0.03, 0.35]])
    return Capture(
        InertialParameters(np.asarray(7.0), np.array([0.1, -0.05, 0.2]), inertia),
        Pose(turns[::-1], np.array([[0.1, 0.2, 0.0], [0.0, 0.1, 0.3]])),
    )
