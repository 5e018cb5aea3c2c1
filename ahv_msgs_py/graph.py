# Copyright 2026 ahv developers, Apache-2.0
"""The graph: its nodes, where their code is, what each hears and sends of the loop's topics.

The one list of nodes: launchers, replay, faults, documents and setup.py read it here. Code and
topics stand as names and nothing is imported, so that setup.py can read the list by its path,
before anything that the package needs is installed.
"""

from importlib import import_module
from typing import Any, NamedTuple


class GraphNode(NamedTuple):
    """A node of the graph."""

    name: str
    module: str  # has its `main`
    class_name: str
    table: str  # of its parameters: module and name
    hears: tuple[str, ...]  # topics of the loop; those whose sender does not fly stay silent
    sends: tuple[str, ...]
    controller: bool = False
    adaptive: bool = False  # flies with adaptive cases only
    guided: bool = False  # flies with cases that have guidance only
    own_law: bool = False  # flies in the place of the loops, with a law of one's own

    @property
    def node_class(self) -> type[Any]:
        """The class, imported."""
        found: type[Any] = getattr(import_module(self.module), self.class_name)
        return found

    @property
    def parameters(self) -> tuple[Any, ...]:
        """What it can be set to, less what every node can be set to; imported."""
        module, _, name = self.table.rpartition(".")
        found: tuple[Any, ...] = getattr(import_module(module), name)
        return found


# In the order of a step: the plant, then its controllers as they answer it.
_NODES = (
    GraphNode(
        "plant",
        "ahv_plant.plant_node",
        "PlantNode",
        "ahv_plant.parameters.PLANT_PARAMETERS",
        hears=("surface_command", "throttle_command"),
        sends=("state", "surfaces", "truth"),  # the last two if its hardware is not ideal
    ),
    GraphNode(
        "guidance",
        "ahv_control.guidance_node",
        "GuidanceNode",
        "ahv_control.guidance_parameters.GUIDANCE_PARAMETERS",
        hears=("state",),
        sends=("reference",),
        controller=True,
        guided=True,
    ),
    GraphNode(
        "outer_intermediate",
        "ahv_control.outer_intermediate_node",
        "OuterIntermediateNode",
        "ahv_control.parameters.OUTER_INTERMEDIATE_PARAMETERS",
        hears=("state", "reference"),
        sends=("attitude_command", "rate_command"),
        controller=True,
    ),
    GraphNode(
        "disturbance_learner",
        "ahv_control.disturbance_learner_node",
        "DisturbanceLearnerNode",
        "ahv_control.parameters.LEARNER_PARAMETERS",
        hears=("state", "rate_command", "surface_command", "surfaces"),
        sends=("learner", "disturbance_estimate"),
        controller=True,
        adaptive=True,
    ),
    GraphNode(
        "inner_loop",
        "ahv_control.inner_loop_node",
        "InnerLoopNode",
        "ahv_control.parameters.INNER_LOOP_PARAMETERS",
        hears=("state", "rate_command", "learner", "disturbance_estimate"),
        sends=("surface_command",),
        controller=True,
    ),
    GraphNode(
        "velocity",
        "ahv_control.velocity_node",
        "VelocityNode",
        "ahv_control.parameters.VELOCITY_PARAMETERS",
        hears=("state", "reference", "surface_command"),
        sends=("throttle_command",),
        controller=True,
    ),
    GraphNode(
        "flight_control",
        "ahv_control.flight_control_node",
        "FlightControlNode",
        "ahv_control.parameters.FLIGHT_CONTROL_PARAMETERS",
        hears=("state", "surfaces", "reference"),
        sends=("attitude_command", "rate_command", "surface_command", "throttle_command"),
        controller=True,
        own_law=True,
    ),
    GraphNode(  # hears every topic there is, those of the loop among them
        "recorder",
        "ahv_analysis.bag.recorder_node",
        "RecorderNode",
        "ahv_analysis.bag.recorder_node.RECORDER_PARAMETERS",
        hears=(),
        sends=(),
    ),
)
NODES = {node.name: node for node in _NODES}


def case_nodes() -> list[str]:
    """Names of the nodes that a case sets up: all that say something in the loop."""
    return [name for name, node in NODES.items() if node.sends]


def controllers(adaptive: bool, guided: bool = False, own_law: bool = False) -> list[str]:
    """Names of the controllers of a case, in the order in which they answer a state."""
    return [
        name
        for name, node in NODES.items()
        if node.controller
        and adaptive >= node.adaptive
        and guided >= node.guided
        and (own_law == node.own_law or node.guided)
    ]


def sender(topic: str) -> str:
    """Name of the node that sends a topic of the loop, where no law of one's own flies."""
    return next(name for name, node in NODES.items() if topic in node.sends)


def listeners(topic: str) -> list[str]:
    """Names of the nodes that act upon a topic of the loop."""
    return [name for name, node in NODES.items() if topic in node.hears]
