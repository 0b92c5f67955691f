"""A short arm with both kinds of joint, on no special axes, as MJCF and as a `Robot`."""

from mjx_inertia.robots import load_robot

SMALL_ARM = """
<mujoco model="small">
  <compiler angle="radian"/>
  <option gravity="0.3 -1.2 -9"/>
  <worldbody>
    <body name="stand" pos="0.1 0.2 0.3" quat="0.9 0.1 -0.3 0.2">
      <inertial pos="0 0 0" mass="3" diaginertia="1 1 1"/>
      <body name="upper" pos="0.1 -0.2 0.3" quat="0.7 0.1 0.5 0.3">
        <inertial pos="0.1 0.02 0.3" quat="0.8 0.3 0.1 0.2" mass="2.5"
          diaginertia="0.03 0.04 0.02"/>
        <joint name="turn" axis="1 2 -0.5" pos="0.05 0.1 -0.02" range="-1 2" armature="0.3"
          ref="0.4" actuatorfrcrange="-20 20"/>
        <body name="rail" pos="0.05 0.2 0.1" quat="0.2 0.9 0.1 -0.4">
          <inertial pos="0 0.1 0.05" mass="1.2" diaginertia="0.02 0.01 0.015"/>
          <joint name="slide" type="slide" axis="0 1 1" range="-0.3 0.4" armature="0.1"
            ref="0.1"/>
          <body name="wrist" pos="0.1 0.05 0.2">
            <inertial pos="0.05 0 0.02" mass="0.8" diaginertia="0.004 0.005 0.006"/>
            <joint name="bend" axis="0 1 0" pos="0 0 0.03"/>
            <joint name="roll" axis="0.6 0 0.8" pos="0.02 0 0"/>
            <body name="palm" pos="0 0 0.1" quat="0.9 0 0 0.3">
              <inertial pos="0 0 0.03" mass="0.4" diaginertia="0.001 0.001 0.0005"/>
              <site name="grip" pos="0.01 0.02 0.12" quat="0.8 0.1 0 0.5"/>
              <body name="finger" pos="0 0.02 0.05">
                <inertial pos="0 0 0.02" mass="0.05" diaginertia="1e-5 1e-5 1e-6"/>
                <joint name="close" type="slide" axis="0 1 0" range="0 0.04" ref="0.01"/>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def small_arm(folder):
    path = folder / "small.xml"
    path.write_text(SMALL_ARM)
    return load_robot(path, "grip")
