# Copyright 2026 ahv developers, Apache-2.0
"""What the server that node processes are forked off loads first: a signal ends it silently."""

import signal

from ahv_analysis.interrupt import SIGNALS

for number in SIGNALS:
    signal.signal(number, signal.SIG_DFL)
signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
