#include "tpm/fit/recording/kept_load.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

/// A load that stands from the first sample on while the drive creeps under it: the readings of the
/// load stay within a small part of it, and do not follow the drive.
bool is_kept_load(const PreparedRecording& r) {
  constexpr double kKept = 0.02;  // of the load
  constexpr double kFollows = 0.25;
  constexpr std::size_t kFewest = 8;
  const std::vector<double>& drive = r.recording.drive;
  const std::vector<double>& load = r.recording.response;
  if (r.load_imposed || load.size() < kFewest || drive.size() != load.size()) return false;
  const auto x = Eigen::ArrayXd::Map(drive.data(), std::ssize(drive));
  const auto y = Eigen::ArrayXd::Map(load.data(), std::ssize(load));
  if (y.maxCoeff() - y.minCoeff() > kKept * std::abs(y.mean())) return false;
  const Eigen::ArrayXd from_x = x - x.mean(), from_y = y - y.mean();
  const double both = from_x.square().sum() * from_y.square().sum();
  return from_x.square().sum() > 0.0 && std::pow((from_x * from_y).sum(), 2) <= kFollows * both;
}

}  // namespace

void require_no_kept_load(const PreparedRecording& r) {
  if (!is_kept_load(r)) return;
  const Unit load = shown_unit(quantity_dimension(r.recording.response_quantity));
  const Unit moved = shown_unit(quantity_dimension(r.recording.drive_quantity));
  const std::vector<double>& drive = r.recording.drive;
  const auto [least, most] = std::ranges::minmax_element(drive);
  const bool depth = r.recording.drive_quantity == Quantity::indentation_depth;
  throw bad_input(
      fmt::format("recording '{}'", r.name),
      fmt::format("creep under a load that was on before: the response stands at {} from the first "
                  "sample on while the drive goes from {} to {}; how far it went before is unknown",
                  with_unit(significant(r.recording.response.front() / load.to_si, 3), load),
                  significant(*least / moved.to_si, 3),
                  with_unit(significant(*most / moved.to_si, 3), moved)),
      depth
          ? "the recording from before the load on; where the depth of contact is known, three or "
            "more rows with this depth and a force of 0 before the first; of a specimen that is "
            "stretched, --rest-length and --area make it a strain and a stress, of which the creep "
            "compliance is fitted"
          : "the recording from before the load on");
}

}  // namespace tpm::fit
