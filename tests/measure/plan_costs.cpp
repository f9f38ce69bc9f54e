// What a step of the models that a servo steps takes, by the costs of operations that
// `tpm plan --calibrate` would keep, and by the clock: measure_plan_costs
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <numeric>
#include <vector>

#include "tpm/contact/condensed/condensed.hpp"
#include "tpm/contact/servo_network.hpp"
#include "tpm/organ/scene/scene.hpp"
#include "tpm/plan/operations.hpp"

using namespace tpm;
using namespace tpm::plan;

namespace {

constexpr double kDepth_m = 4e-3;

/// Mean over a push of the least time of each step over repeats: what other programs take falls
/// out. us.
double step_us(ContactModel& model, const Eigen::Vector3d& into) {
  constexpr int kSteps = 40, kRepeats = 250;
  std::vector<double> least(kSteps, 1e9);
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    model.reset();
    for (std::size_t i = 0; i < least.size(); ++i) {
      const Eigen::Vector3d at = kDepth_m * static_cast<double>(i + 1) / kSteps * into;
      const auto begin = std::chrono::steady_clock::now();
      (void)model.step(at);
      const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
      least[i] = std::min(least[i], 1e6 * taken.count());
    }
  }
  return std::accumulate(least.begin(), least.end(), 0.0) / kSteps;
}

OperationCount counted(const BalanceWork& work) {
  return OperationCount()
      .add(Operation::contact_step, 1.0)
      .add(Operation::servo_bond, static_cast<double>(work.bonds))
      .add(Operation::servo_block, static_cast<double>(work.blocks))
      .add(Operation::panel_product, static_cast<double>(work.products));
}

}  // namespace

int main() {
  const OperationCosts costs = measured_costs();
  for (const OperationEntry& entry : operation_table()) {
    fmt::print("{:<15} {:>9.2g} s\n", entry.text,
               costs.seconds[static_cast<std::size_t>(entry.meaning)]);
  }
  const Tissue tissue = read_tissue(TPM_TEST_SOURCE_DIR "/configs/liver_scene.json");
  const BondSystem bonds(tissue.network, tissue.materials);
  const Positions& rest = tissue.network.organ.position;
  const std::size_t contact = tissue.network.organ.contact.value();
  const Eigen::Vector3d into = -tissue.network.organ.normal.col(static_cast<Eigen::Index>(contact));
  fmt::print("\n{:<15} {:>9} {:>9}\n", "a step, us", "by costs", "by clock");
  const auto row = [&](const std::string& name, ContactModel& model, const OperationCount& work) {
    fmt::print("{:<15} {:>9.2f} {:>9.2f}\n", name, 1e6 * costs.seconds_of(work),
               step_us(model, into));
  };
  CondensedContact condensed =
      build_condensed(bonds, rest, tissue.constraints(), contact, into, {.depth_m = kDepth_m});
  row("condensed", condensed, OperationCount().add(Operation::condensed_step, 1.0));
  ServoNetworkOptions options;
  options.portable = true;
  options.most_balances = 1;  // as many as counted
  ServoNetwork network(bonds, rest, tissue.constraints(), contact, into, options);
  row("servo_network", network, counted(network.work()));
  return 0;
}
