// Prints the measured numbers of reports/methods/report.md as CSV:
//     measure_servo SCENE errors [TAU_S ...]     error, estimate and step time of each motion
//     measure_servo SCENE energy STEPS SEED [TAU_S ...]
//                                                work drawn over random motions in space
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

#include "tpm/accuracy/contact_reference.hpp"
#include "tpm/contact/servo_network.hpp"
#include "tpm/organ/scene/scene.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::accuracy;

namespace {

constexpr double kPeriod_s = 1e-3;
constexpr int kRepeats = 21;
const std::vector<double> kTaus_s{2e-4, 2e-3, 0.05, 1.0, 100.0};

double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

struct Setup {
  explicit Setup(const std::string& file)
      : tissue(read_tissue(file)), constraints(tissue.constraints()) {
    contact = tissue.network.organ.contact.value();
    into = -tissue.network.organ.normal.col(static_cast<Eigen::Index>(contact));
  }
  [[nodiscard]] BondSystem bonds(double tau_s) const {
    return {tissue.network, tissue.element().with_relaxation_time(tau_s)};
  }
  [[nodiscard]] const Positions& rest() const { return tissue.network.organ.position; }

  Tissue tissue;
  Constraints constraints;
  std::size_t contact = 0;
  Eigen::Vector3d into;
};

struct Built {
  std::string name;
  std::unique_ptr<ContactModel> model;
  double build_cpu_s = 0.0;
};

std::vector<Built> models(const Setup& setup, const BondSystem& bonds) {
  std::vector<Built> all;
  const auto add = [&](std::string name,
                       const std::function<std::unique_ptr<ContactModel>()>& make) {
    const double start = cpu_s();
    auto model = make();
    all.push_back({std::move(name), std::move(model), cpu_s() - start});
  };
  add("full network", [&] {
    return std::make_unique<ServoNetwork>(bonds, setup.rest(), setup.constraints, setup.contact,
                                          setup.into, ServoNetworkOptions{.period_s = kPeriod_s});
  });
  return all;
}

std::vector<ContactMotion> motions(const Eigen::Vector3d& into) {
  const ContactAxes axes = contact_axes(into);
  return {ramp_motion(into, 8e-3, 1e-3, 1.0, kPeriod_s),
          ramp_motion(into, 8e-3, 1e-2, 1.0, kPeriod_s),
          ramp_motion(into, 8e-3, 1e-1, 1.0, kPeriod_s),
          random_motion(into, 8e-3, 3.0, 1, kPeriod_s),
          sideways_motion(axes, 4e-3, 2e-3, 20e-3, kPeriod_s),
          circling_motion(axes, 6e-3, 2e-3, 10.0, 2.0, kPeriod_s)};
}

/// Of each step the median over repeats, sorted: what other programs take from the processor in
/// between falls out. us.
std::vector<double> step_times_us(ContactModel& model, const ContactMotion& motion) {
  const auto steps = static_cast<std::size_t>(std::min<Eigen::Index>(motion.steps(), 500));
  std::vector<std::vector<double>> taken(steps);
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    model.reset();
    for (std::size_t i = 0; i < steps; ++i) {
      const Eigen::Vector3d at = motion.displacement_m.col(static_cast<Eigen::Index>(i));
      const auto start = std::chrono::steady_clock::now();
      model.step(at);
      const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start;
      taken[i].push_back(1e6 * passed.count());
    }
  }
  std::vector<double> medians;
  for (auto& of_step : taken) {
    std::nth_element(of_step.begin(), of_step.begin() + kRepeats / 2, of_step.end());
    medians.push_back(of_step[kRepeats / 2]);
  }
  std::sort(medians.begin(), medians.end());
  return medians;
}

void measure_errors(const Setup& setup, const std::vector<double>& taus_s) {
  fmt::print(
      "tau_s,motion,model,peak_N,error_of_peak,reference_error_of_peak,estimate_over_error,"
      "median_us,p99_us,build_cpu_s\n");
  for (const double tau_s : taus_s) {
    const BondSystem bonds = setup.bonds(tau_s);
    const TouchedTissue tissue{bonds, setup.rest(), setup.constraints, setup.contact};
    std::vector<Built> all = models(setup, bonds);
    for (const ContactMotion& motion : motions(setup.into)) {
      ContactReference exact;
      if (motion.line) {
        exact.force_N = motion.direction * line_reference(tissue, motion, 1e-9).transpose();
      } else {
        exact = fine_reference(tissue, motion, tau_s < 1e-3 ? 8 : 2);
      }
      const double peak_N = exact.peak_N();
      for (const Built& built : all) {
        const std::vector<double> times = step_times_us(*built.model, motion);
        built.model->reset();
        double error_N = 0.0;
        double estimate_N = 0.0;
        for (Eigen::Index i = 0; i < motion.steps(); ++i) {
          const ContactAnswer answer = built.model->step(motion.displacement_m.col(i));
          const Eigen::Vector3d off = answer.force_N - exact.force_N.col(i);
          const double here_N = motion.line ? std::abs(off.dot(motion.direction)) : off.norm();
          error_N = std::max(error_N, here_N);
          estimate_N = std::max(estimate_N, answer.error_N);
        }
        fmt::print("{:g},{},{},{:.5g},{:.2e},{:.1e},{:.2f},{:.1f},{:.1f},{:.2f}\n", tau_s,
                   motion.name, built.name, peak_N, error_N / peak_N, exact.error_N / peak_N,
                   estimate_N / error_N, times[times.size() / 2], times[times.size() * 99 / 100],
                   built.build_cpu_s);
        std::fflush(stdout);
      }
    }
  }
}

/// Work of the contact on the tissue from rest, by the trapezoidal rule over each period.
void measure_energy(const Setup& setup, Eigen::Index steps, std::uint64_t seed,
                    const std::vector<double>& taus_s) {
  fmt::print("tau_s,model,steps,least_work_J,largest_work_J,end_work_J,not_valid\n");
  const ContactMotion motion =
      random_motion_in_space(contact_axes(setup.into), 8e-3, 2e-3, steps, seed, kPeriod_s);
  for (const double tau_s : taus_s) {
    const BondSystem bonds = setup.bonds(tau_s);
    for (const Built& built : models(setup, bonds)) {
      Eigen::Vector3d at = Eigen::Vector3d::Zero();
      Eigen::Vector3d before_N = Eigen::Vector3d::Zero();
      double work_J = 0.0;
      double least_J = 0.0;
      double largest_J = 0.0;
      long not_valid = 0;
      for (Eigen::Index i = 0; i < steps; ++i) {
        const Eigen::Vector3d to = motion.displacement_m.col(i);
        const ContactAnswer answer = built.model->step(to);
        work_J -= 0.5 * (before_N + answer.force_N).dot(to - at);
        before_N = answer.force_N;
        at = to;
        least_J = std::min(least_J, work_J);
        largest_J = std::max(largest_J, work_J);
        not_valid += answer.valid ? 0 : 1;
      }
      fmt::print("{:g},{},{},{:.3e},{:.3e},{:.3e},{}\n", tau_s, built.name, steps, least_J,
                 largest_J, work_J, not_valid);
      std::fflush(stdout);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  try {
    const auto taus_from = [&](std::size_t first) {
      std::vector<double> taus_s;
      for (std::size_t i = first; i < words.size(); ++i) taus_s.push_back(std::stod(words[i]));
      return taus_s.empty() ? kTaus_s : taus_s;
    };
    if (words.size() >= 2 && words[1] == "errors") {
      measure_errors(Setup(words[0]), taus_from(2));
      return 0;
    }
    if (words.size() >= 4 && words[1] == "energy") {
      measure_energy(Setup(words[0]), std::stol(words[2]), std::stoull(words[3]), taus_from(4));
      return 0;
    }
  } catch (const Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return static_cast<int>(error.code());
  }
  fmt::print(stderr,
             "measure_servo SCENE errors [TAU_S ...] | SCENE energy STEPS SEED [TAU_S ...]\n");
  return 2;
}
