"""How far the nodes can be heard, and how soon what is lost on the way is sent again: settings of ROS and Fast DDS."""

import os
from pathlib import Path

from rclpy.utilities import get_rmw_implementation_identifier

THIS_MACHINE, NETWORK = (Path(__file__).with_name(f"fastdds_{name}.xml") for name in ("this_machine", "network"))
PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
OPENING = ("ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER")
"""Variables that name other machines."""


def prepare_middleware() -> None:
    """Keep this process to this machine unless the environment opens it; repair lost messages within some 10 ms.

    Before rclpy.init: it sets variables, which processes that are started later get too. A user's own profiles for
    Fast DDS win over ours; with these, or another middleware, nothing but ROS's LOCALHOST keeps to this machine.
    """
    asked, profiles = os.environ.get(RANGE, ""), os.environ.get(PROFILES, "")
    if (profiles, asked) == (str(THIS_MACHINE), "SYSTEM_DEFAULT"):
        return  # the process that has started this one has been here
    ours = profiles in ("", str(THIS_MACHINE), str(NETWORK)) and "fastrtps" in get_rmw_implementation_identifier()
    opened = asked in ("SUBNET", "SYSTEM_DEFAULT") or any(os.environ.get(name) for name in OPENING)
    if ours:
        os.environ[PROFILES] = str(NETWORK if opened else THIS_MACHINE)
    if not opened and asked != "OFF":
        # asked for LOCALHOST, ROS would add a transport of its own to our profile's: on all interfaces
        os.environ[RANGE] = "SYSTEM_DEFAULT" if ours else "LOCALHOST"
        os.environ.pop("ROS_LOCALHOST_ONLY", None)  # an older name for it, which would go first
