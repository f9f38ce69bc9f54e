#pragma once
// Verification that a user can run: what the program computes beside what is known otherwise.
// See docs/accuracy.md.
#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"

namespace tpm::accuracy {

/// A number that the program computes, and what it must be.
struct VerificationCheck {
  std::string what;      ///< the method and the problem
  std::string quantity;  ///< "observed order", "relative error"
  std::string source;    ///< where the expected value, or the reference, comes from
  double expected = 0.0;
  double tolerance = 0.0;  ///< largest |measured - expected|
  /// Computes it.
  /// @param flaw one coefficient of what is verified is wrong by this share, its reference is not:
  ///   the check must then fail
  std::function<double(double flaw)> measure;
  std::string problem{};  ///< that several checks share, and a table of the page is of; or empty
};

/// A check with its result.
struct VerificationRow {
  std::string group, what, quantity, source, problem;
  double expected = 0.0, tolerance = 0.0;
  double measured = std::numeric_limits<double>::quiet_NaN();
  std::string failure;  ///< why there is no number

  /// False also where there is no number.
  [[nodiscard]] bool holds() const { return std::abs(measured - expected) <= tolerance; }
};

/// Checks of one kind.
struct VerificationGroup {
  std::string_view name;  ///< a word
  std::string_view summary;
  std::vector<VerificationCheck> (*checks)();
};

/// All groups, in the order of the report.
[[nodiscard]] std::span<const VerificationGroup> verification_groups();

/// The groups of these names, in the order of the list; all for none.
/// Throws Error(usage) with the known names for one that is not there.
[[nodiscard]] std::vector<VerificationGroup> chosen_groups(std::span<const std::string> names);

struct VerificationRun {
  std::vector<VerificationRow> rows;
  double flaw = 0.0;

  [[nodiscard]] std::size_t failed() const;
};

/// Runs the checks of some groups, one after the other; deterministic. A check in which a solver
/// gives up (Error(numerical)) has failed.
/// @param flaw see VerificationCheck::measure
/// @param progress if any, called after each check
[[nodiscard]] VerificationRun run_verification(std::span<const VerificationGroup> groups,
                                               double flaw,
                                               const std::function<void()>& progress = {});

// --- the groups, one source each
[[nodiscard]] std::vector<VerificationCheck> order_checks();
[[nodiscard]] std::vector<VerificationCheck> reduction_checks();
[[nodiscard]] std::vector<VerificationCheck> regression_checks();
[[nodiscard]] std::vector<VerificationCheck> closed_form_checks();
[[nodiscard]] std::vector<VerificationCheck> energy_checks();

/// Largest |a - b| in parts of the largest |b|.
[[nodiscard]] double relative_difference(const Eigen::VectorXd& a, const Eigen::VectorXd& b);

}  // namespace tpm::accuracy
