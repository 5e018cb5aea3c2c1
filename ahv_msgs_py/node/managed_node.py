# Copyright 2026 ahv developers, Apache-2.0
"""A managed node by the standard lifecycle, set up by checked parameters."""

import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter as RosParameter
from rclpy.task import Future
from rclpy.timer import Timer

from ahv_msgs_py.node.rclpy_internals import (
    RCLError,
    change_state_service,
    destroy_state_machine,
)
from ahv_msgs_py.node.ros_parameters import declare_parameters
from ahv_msgs_py.node.warm_up import Law, warm_up
from ahv_msgs_py.parameters import (
    SIMULATED_TIME,
    Parameter,
    ParameterError,
    Value,
    check_time,
    no_parameter,
)
from ahv_msgs_py.topics import NAMESPACE

REALTIME = Parameter("realtime", False, "100 Hz by the wall clock; if false, lockstep")
AUTOSTART = Parameter("autostart", True, "configure and activate when started as a process")
SHELL_PARAMETERS = (REALTIME, AUTOSTART)


class ManagedNode(LifecycleNode):
    """A node with its parameters and its lifecycle, without topics.

    A subclass fills in `prepare`, which makes the law from the settings (on configure, and when
    parameters change in flight), and `start`, which opens the topics (on activate; what it opened
    is closed on deactivate). Its `laws` are the functions that it calls in a step.
    `finished` is the future that ends the process.
    """

    laws: Sequence[Law] = ()

    def __init__(
        self,
        name: str,
        parameters: Sequence[Parameter],
        values: Mapping[str, Value] | None = None,
        context: rclpy.Context | None = None,
    ):
        """`values` overrides parameters, as a YAML file of `--params-file` does.

        Parameters that do not fit are refused by name when the node is configured.
        """
        overrides = [RosParameter(key, value=value) for key, value in (values or {}).items()]
        super().__init__(
            name,
            namespace=NAMESPACE,
            context=context,
            parameter_overrides=overrides,
            automatically_declare_parameters_from_overrides=True,
            start_parameter_services=True,
        )
        self.finished = Future(executor=None)
        self.refusal = ""  # why the node could not be configured
        self.settings: dict[str, Value] = {}
        self.own_parameters = tuple(parameters)
        self._known = {entry.name: entry for entry in (*parameters, *SHELL_PARAMETERS)}
        try:
            self.own_parameters += self.further_parameters()
            self._known |= {entry.name: entry for entry in self.own_parameters}
            self.settings = declare_parameters(self, self._known)
        except ParameterError as error:
            self.refusal = str(error)
        self.realtime = bool(self.settings.get(REALTIME.name))
        self._opened: list[Callable[[], object]] = []  # closes what `start` opened
        self._changed: dict[str, Value] = {}  # in flight, not yet in force
        self.add_on_set_parameters_callback(self._change)
        # an impossible transition is answered with a refusal; rclpy would end the process
        service = change_state_service(self)
        service.callback = partial(self._change_state, service.callback)

    def create_timer(self, period: float, callback: Callable[[], None], **options: Any) -> Timer:
        """Create a timer by the steady clock: whoever sets the system's clock moves no step."""
        options.setdefault("clock", Clock(clock_type=ClockType.STEADY_TIME))
        return super().create_timer(period, callback, **options)

    # Parameters

    def further_parameters(self) -> tuple[Parameter, ...]:
        """Parameters that depend on those that were given; ParameterError if there is none."""
        return ()

    def _change(self, parameters: Sequence[RosParameter]) -> SetParametersResult:
        """Take parameters that change in flight; they are in force from the next step on."""
        own = [entry for entry in parameters if entry.name in self._known and self.settings]
        try:
            for entry in parameters:
                if entry.name == SIMULATED_TIME:
                    check_time(self.get_name(), entry.value)
            given = {
                entry.name: self._known[entry.name].check(self.get_name(), entry.value)
                for entry in own
            }
            if given:
                self.prepare(self.settings | given)
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        self.settings |= given
        self._changed |= given
        return SetParametersResult(successful=True)

    def set_parameters_atomically(
        self, parameter_list: Sequence[RosParameter]
    ) -> SetParametersResult:
        """Set parameters, as services do that somebody calls; a refusal is told to `refused`."""
        unknown = [one.name for one in parameter_list if not self.has_parameter(one.name)]
        if unknown:
            reason = no_parameter(self.get_name(), unknown[0], self._known)
            result = SetParametersResult(successful=False, reason=reason)
        else:
            result = super().set_parameters_atomically(list(parameter_list))
        if not result.successful:
            self.refused(result.reason)
        return result

    def refused(self, reason: str) -> None:
        """Hear of a change of parameters that was refused, and why."""

    # Lifecycle

    def prepare(self, settings: dict[str, Value]) -> None:
        """Make the law from checked settings; ParameterError if they do not go together."""

    def start(self) -> None:
        """Open the topics and start from the beginning."""

    def bring_up(self) -> None:
        """Configure and activate at once; ParameterError if the node cannot be configured."""
        for trigger in (self.trigger_configure, self.trigger_activate):
            if trigger() != TransitionCallbackReturn.SUCCESS:
                raise ParameterError(self.refusal or f"{self.get_name()} could not be started")

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Make the law; refuse bad parameters in one sentence."""
        return self._transition("configured", self._configure)

    def _configure(self) -> None:
        if not self.settings:
            raise ParameterError(self.refusal)
        self.prepare(self.settings)
        warm_up(self.laws)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open the topics."""
        return self._transition("active", self.activate)

    def activate(self) -> None:
        """Do the work of activation."""
        self.start()

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Close the topics."""
        return self._transition("inactive", self.close)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the node."""
        if not self.finished.done():
            self.finished.set_result("")
        return self._transition("shut down", self.close)

    def close(self) -> None:
        """Close what was opened."""
        while self._opened:
            self._opened.pop()()

    def conclude(self) -> None:
        """Do what has to be done before the node goes."""

    def destroy_node(self) -> None:
        """Conclude, close what is open, then go."""
        self.conclude()
        self.close()
        super().destroy_node()
        destroy_state_machine(self)

    def _transition(self, after: str, work: Callable[[], None]) -> TransitionCallbackReturn:
        """Do the work of a transition, and log it; rclpy would swallow what it raises.

        Why it failed is told once: by `bring_up` to its caller, to that of the service by the log.
        """
        self.refusal = self.refusal if not self.settings else ""
        try:
            work()
        except ParameterError as error:
            self.refusal = str(error)
            return TransitionCallbackReturn.FAILURE
        except Exception:
            self.refusal = traceback.format_exc()
            return TransitionCallbackReturn.ERROR
        self.get_logger().info(after)
        return TransitionCallbackReturn.SUCCESS

    def _change_state(self, change: Callable[[Any, Any], Any], request: Any, response: Any) -> Any:
        try:
            answer = change(request, response)
            if not answer.success and self.refusal:
                self.get_logger().error(self.refusal)
            return answer
        except RCLError as error:
            self.get_logger().warning(f"impossible transition: {str(error).splitlines()[0]}")
            response.success = False
            return response
