#include "tpm/accuracy/verify/verification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::accuracy {
namespace {

constexpr std::array<VerificationGroup, 5> kGroups{{
    {"orders", "observed orders of convergence of every step rule and formulation", order_checks},
    {"reduction", "contact models at servo rate against the full network", reduction_checks},
    {"regression", "NIST's certified problems, solved as fits are", regression_checks},
    {"closed-forms", "laws, contacts, springs and masses with a known answer", closed_form_checks},
    {"energy", "work against what is stored and dissipated, and energy that must stay",
     energy_checks},
}};

VerificationRow run_check(const VerificationGroup& group, const VerificationCheck& check,
                          double flaw) {
  VerificationRow row;
  row.group = group.name;
  row.what = check.what;
  row.quantity = check.quantity;
  row.source = check.source;
  row.problem = check.problem;
  row.expected = check.expected;
  row.tolerance = check.tolerance;
  try {
    row.measured = check.measure(flaw);
  } catch (const Error& error) {
    if (error.code() != ExitCode::numerical) throw;
    row.failure = error.what();
  }
  if (row.failure.empty() && !std::isfinite(row.measured)) row.failure = "not a finite number";
  return row;
}

}  // namespace

std::span<const VerificationGroup> verification_groups() {
  return kGroups;
}

std::vector<VerificationGroup> chosen_groups(std::span<const std::string> names) {
  const auto named = [&](std::string_view name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  for (const std::string& name : names) {
    const auto known = [&](const VerificationGroup& group) { return group.name == name; };
    if (std::any_of(kGroups.begin(), kGroups.end(), known)) continue;
    std::vector<std::string_view> all;
    for (const VerificationGroup& group : kGroups) all.push_back(group.name);
    throw Error(ExitCode::usage, "GROUP", fmt::format("'{}'", printable(name)),
                fmt::format("one of {}", fmt::join(all, ", ")));
  }
  std::vector<VerificationGroup> chosen;
  for (const VerificationGroup& group : kGroups) {
    if (names.empty() || named(group.name)) chosen.push_back(group);
  }
  return chosen;
}

std::size_t VerificationRun::failed() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(rows, [](const VerificationRow& row) { return !row.holds(); }));
}

VerificationRun run_verification(std::span<const VerificationGroup> groups, double flaw,
                                 const std::function<void()>& progress) {
  VerificationRun verification;
  verification.flaw = flaw;
  for (const VerificationGroup& group : groups) {
    for (const VerificationCheck& check : group.checks()) {
      verification.rows.push_back(run_check(group, check, flaw));
      if (progress) progress();
    }
  }
  return verification;
}

double relative_difference(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  if (!a.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

}  // namespace tpm::accuracy
