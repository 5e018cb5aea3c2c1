# Copyright 2026 ahv developers, Apache-2.0
"""An end that comes, whatever hangs."""

import subprocess
import sys

# PyDLL keeps the lock of Python while it calls, as rclpy does when it destroys a node
HUNG = """
import ctypes
from ahv_msgs_py.node.deadline import end_within
end_within(0.2, 7)
print("written before", flush=True)
ctypes.PyDLL(None).sleep(600)
"""


def test_a_process_that_hangs_under_the_lock_of_python_ends_with_its_own_code():
    hung = subprocess.run([sys.executable, "-c", HUNG], capture_output=True, text=True)
    assert hung.returncode == 7
    assert hung.stdout == "written before\n"
