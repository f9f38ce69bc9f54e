#pragma once
#include <functional>
#include <set>
#include <string>

#include "tpmkit/device.hpp"

namespace tpm::haptics {

/// Is told a finding of a device; from the thread that writes records.
using FindingTold = std::function<void(const DeviceFinding&)>;

/// Tells each finding of a device once, by its code, although its numbers grow. The device must
/// live as long as this. Used by one thread at a time.
class FindingNotices {
 public:
  FindingNotices(const HapticDevice& device, FindingTold tell)
      : device_(device), tell_(std::move(tell)) {}
  void look();

 private:
  const HapticDevice& device_;
  FindingTold tell_;
  std::set<std::string> told_;  ///< codes
};

inline void FindingNotices::look() {
  if (!tell_) return;
  for (const DeviceFinding& finding : device_.findings()) {
    if (told_.insert(finding.code).second) tell_(finding);
  }
}

}  // namespace tpm::haptics
