# Copyright 2026 ahv developers, Apache-2.0
"""Our parameters as those of a ROS node: declared with description, unit and range."""

import sys
from collections.abc import Mapping

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from ahv_msgs_py.case_file import with_base
from ahv_msgs_py.parameter_file import given_files, shared_names
from ahv_msgs_py.parameters import (
    BASE,
    SHARED,
    SIMULATED_TIME,
    Parameter,
    Value,
    check_parameters,
    check_time,
    ignored,
)

OF_ROS = (SIMULATED_TIME, "start_type_description_service")  # which it gives to every node


def declare_parameters(node: Node, known: Mapping[str, Parameter]) -> dict[str, Value]:
    """Check what `node` was given, then declare all it knows; ParameterError if it is wrong.

    What a file gives to all nodes, and this one does not know, it ignores and says so.
    """
    check_time(node.get_name(), node.get_parameter(SIMULATED_TIME).value)
    unused = {*OF_ROS, *SHARED} - {*known, BASE}
    given = {
        key: parameter.value
        for key, parameter in node.get_parameters_by_prefix("").items()
        if key not in unused and not key.startswith("qos_overrides.")
    }
    unknown = given.keys() - known.keys() - {BASE}
    for name in sorted(unknown & shared_names(given_files(sys.argv), node.get_name())):
        del given[name]
        node.get_logger().warning(ignored(name, known))
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
