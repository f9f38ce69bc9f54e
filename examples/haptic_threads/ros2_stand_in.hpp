// Stands in for the few names of rclcpp and geometry_msgs that ros2_node.cpp uses. It is not ROS 2:
// spin plays a scripted motion into the one subscription and watches the one publisher.
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "scripted_motion.hpp"

namespace geometry_msgs::msg {

struct Stamp {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
};
struct Header {
  Stamp stamp;
};
struct Vector {
  double x = 0.0, y = 0.0, z = 0.0;
};
struct PointStamped {
  using SharedPtr = std::shared_ptr<PointStamped>;
  Header header;
  Vector point;
};
struct WrenchStamped {
  Header header;
  struct {
    Vector force, torque;
  } wrench;
};

}  // namespace geometry_msgs::msg

namespace rclcpp {

inline double& stand_in_largest_N() {
  static double largest = 0.0;
  return largest;
}
inline std::function<void(geometry_msgs::msg::PointStamped::SharedPtr)>& stand_in_callback() {
  static std::function<void(geometry_msgs::msg::PointStamped::SharedPtr)> callback;
  return callback;
}

template <class Message>
class Publisher {
 public:
  using SharedPtr = std::shared_ptr<Publisher>;
  void publish(const Message& message) {
    stand_in_largest_N() = std::max(stand_in_largest_N(), message.wrench.force.z);
  }
};

template <class Message>
class Subscription {
 public:
  using SharedPtr = std::shared_ptr<Subscription>;
};

class Node {
 public:
  explicit Node(const std::string& /*name*/) {}
  template <class Message>
  typename Publisher<Message>::SharedPtr create_publisher(const std::string& /*topic*/,
                                                          int /*depth*/) {
    return std::make_shared<Publisher<Message>>();
  }
  template <class Message, class Callback>
  typename Subscription<Message>::SharedPtr create_subscription(const std::string& /*topic*/,
                                                                int /*depth*/, Callback callback) {
    stand_in_callback() = std::move(callback);
    return std::make_shared<Subscription<Message>>();
  }
};

inline void init(int /*argc*/, char** /*argv*/) {}
inline void shutdown() {}

template <class AnyNode>
void spin(std::shared_ptr<AnyNode> /*node*/) {
  for (int i = 0; i < kScriptedPeriods; ++i) {
    auto message = std::make_shared<geometry_msgs::msg::PointStamped>();
    message->header.stamp.sec = i / 1000;
    message->header.stamp.nanosec = static_cast<std::uint32_t>(i % 1000) * 1000000U;
    message->point.z = scripted_height_m(i);
    stand_in_callback()(message);
  }
  std::printf("stand-in for ROS 2: %d periods, largest force %.4f N along z\n", kScriptedPeriods,
              stand_in_largest_N());
}

}  // namespace rclcpp
