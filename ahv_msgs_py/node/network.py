# Copyright 2026 ahv developers, Apache-2.0
"""Whom the nodes of this process can hear and be heard by."""

import os

from ahv_msgs_py.config import config_folder

DISCOVERY_RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
MIDDLEWARE = "RMW_IMPLEMENTATION"


def keep_to_this_machine(shared_memory: bool = False) -> None:
    """Fly on the loopback interface alone, unless another range or profile has been chosen.

    ROS's word for this machine, LOCALHOST, only says whom to look for: Fast DDS listens on every
    interface then, and who knows the address is served. The profiles in `config/fastdds` listen on
    the loopback alone. Through `shared_memory` processes in lockstep are faster; one that is
    started again in flight is not heard for seconds. Other middleware is left with that word.
    """
    here = os.environ.setdefault(DISCOVERY_RANGE, "LOCALHOST") == "LOCALHOST"
    fast_dds = os.environ.get(MIDDLEWARE, "rmw_fastrtps_cpp").startswith("rmw_fastrtps")
    if here and fast_dds and PROFILES not in os.environ:
        os.environ[DISCOVERY_RANGE] = "SYSTEM_DEFAULT"  # of the profile
        profile = "shared_memory.xml" if shared_memory else "loopback.xml"
        os.environ[PROFILES] = str(config_folder() / "fastdds" / profile)
