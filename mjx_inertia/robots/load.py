"""Any MJCF or URDF arm, by path and the name of its end effector.

In: a file. Out: `Arm`. What is read is in `link_tree.py`, `urdf_file.py` and `mjcf_file.py`.
"""

from pathlib import Path
from xml.etree import ElementTree as ET

from mjx_inertia.robots.arm import Arm
from mjx_inertia.robots.link_tree import arm_on_path
from mjx_inertia.robots.mjcf_file import read_mjcf_links
from mjx_inertia.robots.urdf_file import read_urdf_links
from mjx_inertia.spatial import Pose


def load_arm(
    path: str | Path,
    end_effector: str,
    base: str | None = None,
    T_hand: Pose | None = None,
) -> Arm:
    """The chain of joints that ends at a body, link or site of a file.

    Links that are fixed to a link of the chain join it. Joints beside the chain, such as those of
    fingers, are held at their reference position (MuJoCo's `qpos0`, zero in URDF), and what they
    carry joins the chain; `Arm.note` names them. A URDF's meshes are not needed. The world is that
    of the file: the root link of a URDF, with gravity along its -z.

    Args:
      path: of an MJCF or a URDF file.
      end_effector: name of a body or site (MJCF) or of a link (URDF).
      base: name of the link or body from which on joints belong to the arm; all of them if None.
        Joints before it are held.
      T_hand: the hand's frame in that of the end effector; the same frame if None.

    Raises:
      ValueError: the file is not XML of either kind, a name is not in it, a joint of the chain is
        free, ball, planar or coupled, or a moving link has no mass; each by its name.
      FileNotFoundError: there is no such file.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file; expected an MJCF or URDF file")
    try:
        root = ET.parse(path).getroot()
    except (ET.ParseError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not an XML file ({error})") from None
    if root.tag not in ("robot", "mujoco"):
        raise ValueError(
            f"{path}: the root element is <{root.tag}>; expected <robot> (URDF) or <mujoco> (MJCF)"
        )
    tree = read_urdf_links(path, root) if root.tag == "robot" else read_mjcf_links(path)
    return arm_on_path(tree, end_effector, base, T_hand or Pose.identity())
