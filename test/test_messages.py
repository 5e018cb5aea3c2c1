# Copyright 2026 ahv developers, Apache-2.0
"""Bytes of fixed layout are those of ROS and rosbags for the same message, to every bit."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.typesys import Stores, get_typestore

from ahv_control.disturbance_learner import Basis, start_learner
from ahv_control.learner_message import estimate_values, learned_of, learner_values, unlearned
from ahv_msgs_py.layout import MessageError, clock_bytes
from ahv_msgs_py.node.messages import message_class
from ahv_msgs_py.topics import (
    BASIS_NAMES,
    BODY_FRAME,
    LEARNER_NAMES,
    LOOP_TOPICS,
    STATE,
    STATE_NAMES,
    SURFACE_COMMAND,
    SURFACE_NAMES,
)
from ahv_plant.model.vectors import Rates, State, Surfaces

pytestmark = pytest.mark.unit

STORE = get_typestore(Stores.ROS2_JAZZY)
STAMPS = st.integers(0, 2**31 * 10**9 - 1)
ANY_DOUBLE = st.floats(width=64)
TOPICS = pytest.mark.parametrize("topic", LOOP_TOPICS, ids=lambda topic: topic.name)


def bits(values):
    return struct.pack(f"<{len(values)}d", *values)


def message_of(topic, stamp, values):
    """The message as an object, the way a user of rclpy fills it."""
    message = message_class(topic.layout.type_name)()
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
    message.header.frame_id = topic.layout.frame
    if topic.layout.type_name == "sensor_msgs/msg/JointState":
        message.name = list(topic.layout.fields)
        message.position = list(values)
    elif topic.layout.type_name == "geometry_msgs/msg/AccelStamped":
        linear, angular = message.accel.linear, message.accel.angular
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = values
    else:
        message.vector.x, message.vector.y, message.vector.z = values
    return message


def test_names_are_those_of_the_vehicle():
    assert State._fields == STATE_NAMES
    assert Surfaces._fields == SURFACE_NAMES
    assert Basis._fields == BASIS_NAMES
    assert len(learner_values(start_learner(Rates(1.0, 2.0, 3.0)))) == len(LEARNER_NAMES)
    assert LEARNER_NAMES[:6] == ("X_a.P", "X_a.Q", "X_a.R", "X_d.P", "X_d.Q", "X_d.R")


def test_the_learner_comes_back_from_its_messages():
    values = tuple(float(number) for number in range(len(LEARNER_NAMES)))
    learned = learned_of(values, (0.0, 0.0, 0.0, 7.0, 8.0, 9.0))
    assert learned == ((0.0, 1.0, 2.0), (3.0, 4.0, 5.0), (7.0, 8.0, 9.0))
    assert estimate_values(learned.estimate) == (0.0, 0.0, 0.0, 7.0, 8.0, 9.0)


def test_without_a_learner_the_observers_are_at_the_state():
    state = State(*range(len(STATE_NAMES)))
    rates = Rates(state.P, state.Q, state.R)
    assert unlearned(state, (0.0, 0.0, 0.0, 7.0, 8.0, 9.0)) == (rates, rates, (7.0, 8.0, 9.0))


@TOPICS
@given(stamp=STAMPS, data=st.data())
def test_every_bit_comes_back(topic, stamp, data):
    values = data.draw(st.tuples(*[ANY_DOUBLE] * len(topic.layout.fields)))
    found_stamp, found = topic.layout.decode(topic.layout.encode(stamp, values))
    assert found_stamp == stamp
    assert bits(found) == bits(values)


@TOPICS
def test_many_messages_are_read_as_one_by_one(topic):
    size = len(topic.layout.fields)
    sent = [(stamp, tuple(0.1 * stamp + i for i in range(size))) for stamp in (0, 7, 10**10)]
    data = [topic.layout.encode(*message) for message in sent]
    spoilt = bytes([data[0][0] ^ 1]) + data[0][1:]
    rows = np.frombuffer(data[0] + spoilt + data[1] + data[2], np.uint8)
    stamps, values, known = topic.layout.decode_rows(rows.reshape(4, topic.layout.size))
    read = zip(stamps[known].tolist(), map(tuple, values[known].tolist()), strict=True)
    assert list(read) == sent
    assert known.tolist() == [True, False, True, True]


@TOPICS
def test_bytes_are_those_of_rclpy(topic):
    values = [0.1 * (number + 1) for number in range(len(topic.layout.fields))]
    stamp = 12_340_000_000
    encoded = topic.layout.encode(stamp, values)
    message = message_of(topic, stamp, values)
    by_rclpy = serialize_message(message)
    # rclpy leaves garbage in padding and behind the end, so compare what it reads from either
    message_type = message_class(topic.layout.type_name)
    assert deserialize_message(encoded, message_type) == message
    assert deserialize_message(by_rclpy, message_type) == message


@TOPICS
def test_bytes_are_those_of_rosbags(topic):
    values = [-0.3 * (number + 1) for number in range(len(topic.layout.fields))]
    encoded = topic.layout.encode(98_760_000_000, values)
    message = STORE.deserialize_cdr(encoded, topic.layout.type_name)
    assert bytes(STORE.serialize_cdr(message, topic.layout.type_name)) == encoded
    assert topic.layout.values_of(message) == (98_760_000_000, tuple(values))


def test_clock_bytes_are_those_of_rosbags():
    message = STORE.deserialize_cdr(clock_bytes(3_010_000_000), "rosgraph_msgs/msg/Clock")
    assert (message.clock.sec, message.clock.nanosec) == (3, 10_000_000)


@TOPICS
def test_a_message_without_a_frame_is_read_the_general_way(topic):
    values = tuple(float(number) for number in range(len(topic.layout.fields)))
    message = message_of(topic, 20_000_000, values)
    message.header.frame_id = ""
    data = serialize_message(message)
    assert topic.layout.decode(data) is None
    assert topic.layout.values_of(message) == (20_000_000, values)


@TOPICS
def test_a_message_of_another_frame_is_refused(topic):
    message = message_of(topic, 20_000_000, (0.0,) * len(topic.layout.fields))
    message.header.frame_id = "base_link_flu"
    with pytest.raises(MessageError, match="base_link_flu"):
        topic.layout.values_of(message)


@pytest.mark.parametrize(
    "names, positions",
    [
        (["left_elevon", "right_elevon", "rudder"], [0.0, 0.0, 0.0]),
        (["right_elevon", "left_elevon"], [0.0, 0.0]),
        (["right_elevon", "left_elevon", "rudder"], [0.0, 0.0]),
        ([], []),
    ],
)
def test_wrong_names_or_lengths_are_named(names, positions):
    message = message_of(SURFACE_COMMAND, 0, (0.0, 0.0, 0.0))
    message.name, message.position = names, positions
    with pytest.raises(MessageError, match="right_elevon"):
        SURFACE_COMMAND.layout.values_of(message)


@given(st.binary(max_size=600))
def test_other_bytes_are_not_taken_for_a_message(data):
    assert STATE.layout.decode(data) is None


def test_a_refused_message_of_any_size_is_told_in_a_short_sentence():
    layout = STATE.layout
    for names, frame in ((["x"] * 100_000, BODY_FRAME), (["x" * 10**6] * 13, BODY_FRAME)):
        message = message_of(STATE, 0, (0.0,) * 13)
        message.name, message.header.frame_id = names, frame
        with pytest.raises(MessageError) as error:
            layout.values_of(message)
        assert len(str(error.value)) < 200
    message.header.frame_id = "f" * 10**6
    with pytest.raises(MessageError, match="frame_id is 'ffff") as error:
        layout.values_of(message)
    assert len(str(error.value)) < 200
