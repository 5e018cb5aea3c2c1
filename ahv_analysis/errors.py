# Copyright 2026 ahv developers, Apache-2.0
"""What can be wrong around a flight; the message of each is one sentence."""


class BagError(Exception):
    """A bag that cannot be written or read."""


class CampaignError(Exception):
    """A campaign that cannot be flown as asked, or is not one."""


class CampaignStopped(Exception):
    """A campaign that was not flown to its end; what was flown is kept."""


class GraphError(Exception):
    """A graph that did not do what a graph must."""
