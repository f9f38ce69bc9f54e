#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "tpmkit/model.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::law {

/// Creep at many times from creep at few: the answer to a load that is imposed instantaneously and
/// kept is a smooth function of the logarithm of the time (relaxation and retardation spread over
/// more than half a decade whatever their spectrum), so that Chebyshev interpolation on pieces of
/// half a decade reproduces it to some 1e-12. The answer to a kept depth is not tabulated: it may
/// fall by any number of decades, and then its digits are those of the largest value of a piece.
class KeptLoadTable {
 public:
  /// Nothing for other histories, and where the table would not be much smaller than the times.
  [[nodiscard]] static std::optional<KeptLoadTable> covering(const Protocol& protocol,
                                                             std::span<const double> times_s);

  /// At which the response is needed, s.
  [[nodiscard]] const std::vector<double>& times_s() const { return node_times_s_; }

  /// The response at the times that were asked for.
  /// @param at_nodes the response at times_s()
  [[nodiscard]] Response at_asked(const Response& at_nodes) const;

 private:
  KeptLoadTable(double start_s, double first_s, double last_s, std::span<const double> times_s);

  double start_s_, log_first_, pieces_per_log_;
  Eigen::Index pieces_;
  std::span<const double> asked_s_;
  std::vector<double> node_times_s_;  ///< of all pieces, then the start itself if it is asked for
};

}  // namespace tpm::law
