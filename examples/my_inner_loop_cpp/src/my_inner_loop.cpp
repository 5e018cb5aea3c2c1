// Copyright 2026 ahv developers, Apache-2.0

// An inner loop of one's own: body rates to surfaces by proportional and integral feedback.
// All it knows of the vehicle is how much angular acceleration a surface gives in cruise.

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <memory>

#include "geometry_msgs/msg/vector3_stamped.hpp"
#include "rclcpp/rclcpp.hpp"
#include "sensor_msgs/msg/joint_state.hpp"

using geometry_msgs::msg::Vector3Stamped;
using sensor_msgs::msg::JointState;

constexpr double ROLL = 5.11;    // [1/s^2] by elevons opposed
constexpr double PITCH = 1.146;  // [1/s^2] by elevons together
constexpr double YAW = -0.668;   // [1/s^2] by the rudder
constexpr double TRIM = -0.126;  // [rad] both elevons in cruise
constexpr double K = 2.0;        // [1/s]
constexpr double K_I = 4.0;      // [1/s^2]
constexpr double STEP = 0.01;    // [s]

class MyInnerLoop : public rclcpp::Node
{
public:
  MyInnerLoop()
  : Node("inner_loop", "/ahv")
  {
    const auto qos = rclcpp::QoS(rclcpp::KeepLast(20000)).reliable().transient_local();
    publisher_ = create_publisher<JointState>("surface_command", qos);
    states_ = create_subscription<JointState>(
      "state", qos, [this](JointState::ConstSharedPtr message) {
        const int64_t stamp = rclcpp::Time(message->header.stamp).nanoseconds();
        inputs_[stamp].state = message;
        answer(stamp);
      });
    commands_ = create_subscription<Vector3Stamped>(
      "rate_command", qos, [this](Vector3Stamped::ConstSharedPtr message) {
        const int64_t stamp = rclcpp::Time(message->header.stamp).nanoseconds();
        inputs_[stamp].command = message;
        answer(stamp);
      });
  }

private:
  struct Inputs
  {
    JointState::ConstSharedPtr state;
    Vector3Stamped::ConstSharedPtr command;
  };

  // Once both inputs of a step are there, which come in any order.
  void answer(int64_t stamp)
  {
    const Inputs inputs = inputs_[stamp];
    if (!inputs.state || !inputs.command) {
      return;
    }
    inputs_.erase(stamp);
    const auto & wanted = inputs.command->vector;
    const std::array<double, 3> command{wanted.x, wanted.y, wanted.z};
    std::array<double, 3> demand;  // [rad/s^2]
    for (size_t axis = 0; axis < 3; ++axis) {
      const double error = command[axis] - inputs.state->position.at(3 + axis);  // P, Q, R
      integral_[axis] += STEP * error;
      demand[axis] = K * error + K_I * integral_[axis];
    }
    const double together = TRIM + demand[1] / PITCH;
    const double opposed = demand[0] / ROLL;
    JointState surfaces;
    surfaces.header = inputs.state->header;
    surfaces.name = {"right_elevon", "left_elevon", "rudder"};
    surfaces.position = {together + opposed, together - opposed, demand[2] / YAW};
    for (double & surface : surfaces.position) {
      surface = std::clamp(surface, -0.69, 0.52);  // inside the stops
    }
    publisher_->publish(surfaces);
  }

  std::map<int64_t, Inputs> inputs_;       // of every step that is not answered yet
  std::array<double, 3> integral_{};       // [rad] of the rate errors
  rclcpp::Publisher<JointState>::SharedPtr publisher_;
  rclcpp::Subscription<JointState>::SharedPtr states_;
  rclcpp::Subscription<Vector3Stamped>::SharedPtr commands_;
};

int main(int argc, char ** argv)
{
  rclcpp::init(argc, argv);
  rclcpp::spin(std::make_shared<MyInnerLoop>());
  rclcpp::shutdown();
  return 0;
}
