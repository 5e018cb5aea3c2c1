# Copyright 2026 ahv developers, Apache-2.0
"""Our parameters as those of a ROS node: declared with description, unit and range."""

from collections.abc import Mapping

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from ahv_msgs_py.case_file import with_base
from ahv_msgs_py.parameters import BASE, SHARED, Parameter, ParameterError, Value, check_parameters

SIMULATED_TIME = "use_sim_time"  # what ROS gives to every node


def check_time(name: str, value: object) -> None:
    """Refuse simulated time for the node `name`; ParameterError."""
    if value is not False:
        raise ParameterError(
            f"{name}: {SIMULATED_TIME} is {value!r}, but must be False: nodes go by the stamps of "
            "the plant's states, in real time by the steady clock"
        )


def declare_parameters(node: Node, known: Mapping[str, Parameter]) -> dict[str, Value]:
    """Check what `node` was given, then declare all it knows; ParameterError if it is wrong."""
    check_time(node.get_name(), node.get_parameter(SIMULATED_TIME).value)
    ignored = {SIMULATED_TIME, "start_type_description_service", *SHARED} - {*known, BASE}
    given = {
        key: parameter.value
        for key, parameter in node.get_parameters_by_prefix("").items()
        if key not in ignored and not key.startswith("qos_overrides.")
    }
    given = with_base(node.get_name(), given)
    values = check_parameters(node.get_name(), known.values(), given)
    for parameter in known.values():
        if node.has_parameter(parameter.name):
            node.undeclare_parameter(parameter.name)
        node.declare_parameter(
            parameter.name, values[parameter.name], _descriptor(parameter), ignore_override=True
        )
    return values


def _descriptor(parameter: Parameter) -> ParameterDescriptor:
    """Description, unit and range, as `ros2 param describe` shows them."""
    descriptor = ParameterDescriptor(
        description=f"{parameter.description} [{parameter.unit or '-'}]",
        read_only=not parameter.in_flight,
    )
    low, high = parameter.minimum, parameter.maximum
    if low is not None and high is not None:
        if isinstance(parameter.default, float):
            bounds = FloatingPointRange(from_value=low, to_value=high)
            descriptor.floating_point_range = [bounds]
        else:
            limits = IntegerRange(from_value=int(low), to_value=int(high))
            descriptor.integer_range = [limits]
    return descriptor
