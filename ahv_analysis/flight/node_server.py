# Copyright 2026 ahv developers, Apache-2.0
"""What the server that node processes are forked off loads once: the nodes and their laws."""

import os

from ahv_analysis.versions import source_hash
from ahv_msgs_py.node.warm_up import warm_up_nodes

SERVER = os.getpid()
SOURCE = source_hash()  # of the code that every process forked off here runs

warm_up_nodes()
os.setpgrp()  # a terminal's signals are for the one who watches the flight, and ends it in order
