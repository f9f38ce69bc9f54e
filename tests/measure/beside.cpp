// Prints the measured numbers of reports/haptics/report.md, "The network beside the loop", as
// CSV:
//     measure_beside SCENE STEPS SEED
// The whole network in the loop at 1 kHz, and beside it (without a thread: its answer is used 5 ms
// later), over random motions in space: how far the second is from the first, its own estimate, and
// the work drawn from rest, by the trapezoidal rule over each period.
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "program.hpp"
#include "tpm/accuracy/contact_reference.hpp"
#include "tpm/haptics/session/network_beside.hpp"
#include "tpm/organ/scene/scene.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::organ;
using namespace tpm::contact;
using namespace tpm::haptics;
using namespace tpm::accuracy;

namespace {

constexpr double kPeriod_s = 1e-3;
constexpr double kDeepest_m = 10e-3;

class Work {
 public:
  void add(const Eigen::Vector3d& force_N, const Eigen::Vector3d& at_m) {
    now_J_ -= 0.5 * (before_N_ + force_N).dot(at_m - at_m_);
    before_N_ = force_N;
    at_m_ = at_m;
    least_J = std::min(least_J, now_J_);
    largest_J = std::max(largest_J, now_J_);
  }
  double least_J = 0.0, largest_J = 0.0;

 private:
  double now_J_ = 0.0;
  Eigen::Vector3d before_N_ = Eigen::Vector3d::Zero(), at_m_ = Eigen::Vector3d::Zero();
};

void measure(const std::string& file, Eigen::Index steps, std::uint64_t seed) {
  const Tissue tissue = read_tissue(file);
  const Constraints constraints = tissue.constraints();
  const Positions& rest = tissue.network.organ.position;
  const std::size_t contact = tissue.network.organ.contact.value();
  const Eigen::Vector3d into = -tissue.network.organ.normal.col(static_cast<Eigen::Index>(contact));
  const ContactMotion motion =
      random_motion_in_space(contact_axes(into), 8e-3, 2e-3, steps, seed, kPeriod_s);
  fmt::print(
      "tau_s,peak_N,off_of_peak,rms_off_of_peak,estimate_of_peak,least_work_J,largest_work_J,"
      "least_work_in_loop_J\n");
  for (const double tau_s : {0.1, 1.0, 10.0}) {
    const BondSystem bonds(tissue.network, tissue.element().with_relaxation_time(tau_s));
    const auto network = [&](double period_s) {
      return std::make_unique<ServoNetwork>(
          bonds, rest, constraints, contact, into,
          ServoNetworkOptions{.period_s = period_s, .deepest_m = kDeepest_m});
    };
    const auto inside = network(kPeriod_s);
    NetworkBeside beside(network(kPeriod_s * NetworkBeside::periods_between(kPeriod_s)),
                         {bonds, rest, constraints, contact, into, kDeepest_m}, kPeriod_s, false);
    double peak_N = 0.0, off_N = 0.0, squares = 0.0, estimate_N = 0.0;
    Work drawn, drawn_inside;
    for (Eigen::Index i = 0; i < steps; ++i) {
      const Eigen::Vector3d at = motion.displacement_m.col(i);
      const ContactAnswer expected = inside->step(at), answer = beside.step(at);
      const double off = (answer.force_N - expected.force_N).norm();
      peak_N = std::max(peak_N, expected.force_N.norm());
      off_N = std::max(off_N, off);
      squares += off * off;
      estimate_N = std::max(estimate_N, answer.error_N);
      drawn.add(answer.force_N, at);
      drawn_inside.add(expected.force_N, at);
    }
    fmt::print("{:g},{:.4g},{:.2e},{:.2e},{:.2e},{:.2e},{:.2e},{:.2e}\n", tau_s, peak_N,
               off_N / peak_N, std::sqrt(squares / static_cast<double>(steps)) / peak_N,
               estimate_N / peak_N, drawn.least_J, drawn.largest_J, drawn_inside.least_J);
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(argc, argv, 3, 3, "measure_beside SCENE STEPS SEED", [](const auto& words) {
    measure(words[0], std::stol(words[1]), std::stoull(words[2]));
  });
}
