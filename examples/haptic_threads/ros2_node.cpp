// A ROS 2 node around a tpmkit tissue: it subscribes to the tool's position
// (geometry_msgs/PointStamped) and publishes the force on the hand (geometry_msgs/WrenchStamped),
// one for one. The stamps of the messages are the clock of the tissue.
//
// Compiled here against a stand-in for rclcpp and the messages (ros2_stand_in.hpp), as ROS 2 is not
// a dependency of tpmkit: never run inside ROS 2 or with hardware. With ROS 2 include
// rclcpp/rclcpp.hpp and geometry_msgs/msg/{point_stamped,wrench_stamped}.hpp instead; topics come
// with jitter, so keep stiff contacts in the loop of the device itself (chai3d_tool.cpp).
#include <tpmkit/haptics.h>

#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#ifdef TPM_WITH_ROS2
#include <geometry_msgs/msg/point_stamped.hpp>
#include <geometry_msgs/msg/wrench_stamped.hpp>
#include <rclcpp/rclcpp.hpp>
#else
#include "ros2_stand_in.hpp"
#endif

class TissueNode : public rclcpp::Node {
 public:
  /// @param options those of your device: its `device_file`
  TissueNode(const std::string& session_or_law, const tpm_haptics_options& options)
      : rclcpp::Node("tpm_tissue") {
    char why[TPM_HAPTICS_MESSAGE];
    if (tpm_haptics_open(session_or_law.c_str(), &options, &tissue_, why, sizeof why) !=
        TPM_HAPTICS_OK) {
      throw std::runtime_error(why);
    }
    force_ = create_publisher<geometry_msgs::msg::WrenchStamped>("tool_force", 1);
    position_ = create_subscription<geometry_msgs::msg::PointStamped>(
        "tool_position", 1, std::bind(&TissueNode::moved, this, std::placeholders::_1));
  }
  ~TissueNode() { tpm_haptics_close(tissue_); }
  TissueNode(const TissueNode&) = delete;
  TissueNode& operator=(const TissueNode&) = delete;

 private:
  void moved(const geometry_msgs::msg::PointStamped::SharedPtr message) {
    const double time_s = static_cast<double>(message->header.stamp.sec) +
                          1e-9 * static_cast<double>(message->header.stamp.nanosec);
    const double position_m[3] = {message->point.x, message->point.y, message->point.z};
    double force_N[3];
    tpm_haptics_step_at(tissue_, time_s, position_m, force_N);
    geometry_msgs::msg::WrenchStamped wrench;
    wrench.header = message->header;
    wrench.wrench.force.x = force_N[0];
    wrench.wrench.force.y = force_N[1];
    wrench.wrench.force.z = force_N[2];
    force_->publish(wrench);
  }

  tpm_haptics_contact* tissue_ = nullptr;
  rclcpp::Publisher<geometry_msgs::msg::WrenchStamped>::SharedPtr force_;
  rclcpp::Subscription<geometry_msgs::msg::PointStamped>::SharedPtr position_;
};

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) return TPM_HAPTICS_USAGE;
  tpm_haptics_options options = TPM_HAPTICS_OPTIONS_INIT;
  if (argc == 3) options.device_file = argv[2];  // written by `tpm hil identify`
#ifndef TPM_WITH_ROS2
  std::strcpy(options.device, "virtual");  // the stand-in has no motors
#endif
  try {
    rclcpp::init(argc, argv);
    rclcpp::spin(std::make_shared<TissueNode>(argv[1], options));
    rclcpp::shutdown();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "ros2_node: %s\n", error.what());
    return TPM_HAPTICS_BAD_INPUT;
  }
}
