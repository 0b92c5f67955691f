"""Ragged, made-up push records and what may be done to them without changing the push."""

import numpy as np

from mjx_inertia.pushing import PushRecord


def random_records(seed, number, samples, interval_s=0.01):
    """Smooth random pushes of all lengths; the first sample in contact is neither early nor late.

    Signals obey no mechanics, except that pose, twist, tip position and tip velocity fit together.
    """
    rng = np.random.default_rng(seed)
    time = np.tile((np.arange(samples) + 1) * interval_s, (number, 1))

    def smooth(width):
        knots = rng.normal(size=(number, 3, width))
        phase = time[:, :, None, None] * np.array([1.0, 3.0, 9.0])[:, None]
        return (np.sin(phase + knots[:, None]) * knots[:, None]).sum(axis=2)

    before = rng.integers(0, 5, number)
    touching = np.arange(samples) >= before[:, None]
    force = (3.0 + smooth(2)) * touching[..., None]
    twist = 0.03 * smooth(3) * touching[..., None]
    tip_velocity = 0.04 + 0.01 * smooth(2)
    start = rng.normal(size=(number, 1, 3))
    angle = rng.uniform(0, 2 * np.pi, number)
    contact_point = start[:, 0, :2] + rng.normal(size=(number, 2)) * 0.05
    return PushRecord(
        time=time,
        force=force,
        moment=0.1 * smooth(1)[..., 0] * touching,
        pose=start + np.cumsum(twist, axis=1) * interval_s,
        twist=twist,
        tip_position=contact_point[:, None] + np.cumsum(tip_velocity, axis=1) * interval_s,
        tip_velocity=tip_velocity,
        contact_point=contact_point,
        contact_normal=np.stack([np.cos(angle), np.sin(angle)], axis=1),
        length=rng.integers(samples // 3, samples + 1, number).astype(np.int32),
        status=np.zeros(number, np.int32),
    )


def turned(angle):
    """Matrix that turns plane vectors by `angle`."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def in_another_world(records, angle, shift):
    """The same pushes described in world axes that are turned and shifted."""
    R = turned(angle)
    pose = np.concatenate([records.pose[..., :2] @ R.T + shift, records.pose[..., 2:] + angle], -1)
    return records.replace(
        force=records.force @ R.T,
        pose=pose,
        twist=np.concatenate([records.twist[..., :2] @ R.T, records.twist[..., 2:]], -1),
        tip_position=records.tip_position @ R.T + shift,
        tip_velocity=records.tip_velocity @ R.T,
        contact_point=records.contact_point @ R.T + shift,
        contact_normal=records.contact_normal @ R.T,
    )


def with_tracker_at(records, offset_obj, turn):
    """The same pushes as another frame on the object reports them."""
    yaw = records.pose[..., 2]
    arm = np.stack(
        [
            np.cos(yaw) * offset_obj[0] - np.sin(yaw) * offset_obj[1],
            np.sin(yaw) * offset_obj[0] + np.cos(yaw) * offset_obj[1],
        ],
        axis=-1,
    )
    velocity = records.twist[..., 2:] * np.stack([-arm[..., 1], arm[..., 0]], axis=-1)
    moment = arm[..., 0] * records.force[..., 1] - arm[..., 1] * records.force[..., 0]
    return records.replace(
        pose=np.concatenate([records.pose[..., :2] + arm, records.pose[..., 2:] + turn], -1),
        twist=np.concatenate([records.twist[..., :2] + velocity, records.twist[..., 2:]], -1),
        moment=records.moment - moment,
    )
