"""Recordings as a laboratory makes them, from simulated pushes: the helper of several tests.

Streams have rates, stamps, units and noise of their own; the force sensor weighs a probe too.
"""

import csv

import numpy as np

import mjx_inertia as mi

RATE = 500.0  # Hz, of the simulation
REST = 0.2  # s before the push
PROBE = 0.25  # kg between sensor and object
FORCE_YAW = 30.0  # degrees, of the sensor's axes in the world


def box(mass=1.8, com=(0.0, 0.0)):
    """A box of 150 by 100 mm."""
    return mi.cuboid((0.15, 0.10, 0.06), mass=mass)


def streams(
    obj, contact_point, *, seed=0, probe=PROBE, speed=0.1, duration=0.5, pose=(0.3, -0.2, 0.8)
):
    """Time and values of force on the object with the probe's inertia, pose, and tip; SI, world."""
    push = mi.simulate_push(
        obj,
        contact_point,
        speed=speed,
        duration=duration,
        tip_friction=0.1,
        friction=0.3,
        rate=RATE,
    )
    record, setup = push.record, push.setup
    still = round(REST * RATE)

    def rested(values, first):
        first = np.broadcast_to(np.asarray(first, float), (still, *np.shape(values)[1:]))
        return np.concatenate([first, np.asarray(values, float)])

    length = int(record.length)
    local = rested(record.pose[:length], setup.pose)
    tip = rested(record.tip_position[:length], setup.motion.start)
    force = rested(record.force[:length], np.zeros(2))
    twist = rested(record.twist[:length], np.zeros(3))
    time = np.arange(1, len(local) + 1) / RATE
    # the probe rides on the point of contact
    arm = tip - local[:, :2]
    at_contact = twist[:, :2] + twist[:, 2:] * np.stack([-arm[:, 1], arm[:, 0]], 1)
    acceleration = (
        np.diff(at_contact, axis=0, prepend=at_contact[:1]) * RATE
    )  # over the step before
    touching = np.hypot(*force.T) > 0.3
    force = force + probe * acceleration * touching[:, None]
    # somewhere on the table
    x, y, yaw = pose
    R = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    placed = np.column_stack([local[:, :2] @ R.T + [x, y], local[:, 2] + yaw])
    tip, force = tip @ R.T + [x, y], force @ R.T
    rng = np.random.default_rng(seed)

    # rates and stamps of their own
    def resampled(values, rate, offset, time=time):
        at = np.arange(time[0] + offset, time[-1], 1.0 / rate)
        return at, np.stack([np.interp(at, time, column) for column in values.T], 1)

    # the simulation's force is a mean over the step before, so that of its middle
    t_force, f = resampled(force, 250.0, 0.0013, time - 0.5 / RATE)
    t_pose, p = resampled(placed, 240.0, 0.0021)
    t_tip, q = resampled(tip, 125.0, 0.0007)
    f = f + rng.normal(0.0, 0.05, f.shape)
    p = p + rng.normal(0.0, 1.0, p.shape) * [2e-5, 2e-5, 3e-4]
    q = q + rng.normal(0.0, 1e-5, q.shape)
    return (t_force, f), (t_pose, p), (t_tip, q)


def write_csv(path, force, pose, tip, *, header=None):
    """One table: each stream in its own rows, millimetres, degrees, the sensor's axes and sign."""
    angle = -np.radians(FORCE_YAW)
    R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    reaction = -force[1] @ R.T
    names = header or [
        "time [s]", "force_x [N]", "force_y [N]", "object_x [mm]", "object_y [mm]",
        "object_yaw [deg]", "tip_x [mm]", "tip_y [mm]",
    ]  # fmt: skip
    rows = []
    for t, (fx, fy) in zip(force[0], reaction, strict=True):
        rows.append([t, fx, fy, "", "", "", "", ""])
    for t, (x, y, yaw) in zip(*pose, strict=True):
        rows.append([t, "", "", 1e3 * x, 1e3 * y, np.degrees(yaw), "", ""])
    for t, (x, y) in zip(*tip, strict=True):
        rows.append([t, "", "", "", "", "", 1e3 * x, 1e3 * y])
    rows.sort(key=lambda row: row[0])
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(names)
        writer.writerows([[f"{v:.5f}" if v != "" else "" for v in row] for row in rows])


DESCRIPTION = f"""\
object: "box:0.15x0.10x0.06"
tip_radius: 0.005
force_on: tip
force_yaw: {FORCE_YAW}
probe_mass: {PROBE}
"""
