// Contact models at servo rate: error and wall time of a step at each relaxation time.
#include "tpm/accuracy/servo_problems.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "tpm/accuracy/contact_reference.hpp"
#include "tpm/contact/condensed/condensed.hpp"
#include "tpm/contact/servo_network.hpp"
#include "tpm/files/file.hpp"
#include "tpm/organ/scene/scene.hpp"

namespace tpm::accuracy {
namespace {

constexpr double kServoPeriod_s = 1e-3;
constexpr double kFastServoPeriod_s = 2.5e-4;
constexpr double kDepth_m = 8e-3, kAside_m = 2e-3;
constexpr Eigen::Index kFieldEvery = 5;  // times between those at which positions are compared
/// Steps of less than a microsecond are timed in batches: the clock costs a tenth of one.
constexpr Eigen::Index kBatch = 20;

using Clock = std::chrono::steady_clock;

double seconds_of(Clock::duration passed) {
  return std::chrono::duration<double>(passed).count();
}

/// Forces at the times of comparison, and positions at some of them, of each motion.
struct ServoAnswer {
  std::vector<Eigen::MatrixXd> force;         ///< components by times
  std::vector<Eigen::MatrixXd> displacement;  ///< three per sphere by times
  std::vector<Eigen::VectorXd> claimed_N;
};

/// One organ, its motions and relaxation times, and the reference for them, found when first asked
/// for.
class ServoCase {
 public:
  /// @param motions forces are compared at the end of each of their periods, and models go straight
  ///   in between
  /// @param along_line forces along the normal are compared, else forces and positions in space
  ServoCase(Tissue read, const std::vector<double>& relaxation_times_s, bool along_line,
            const std::function<std::vector<ContactMotion>(const Eigen::Vector3d&)>& motions)
      : tissue(std::move(read)),
        constraints(tissue.constraints()),
        contact(tissue.network.organ.contact.value()),
        into(-tissue.network.organ.normal.col(static_cast<Eigen::Index>(contact))),
        taus_s(relaxation_times_s),
        line(along_line),
        compared(motions(into)) {
    for (const double tau_s : taus_s) {
      MaterialField materials = tissue.materials;
      set_value(materials.materials.front(), "tau1", tau_s, "servo problem");
      bonds_.push_back(std::make_unique<BondSystem>(tissue.network, materials));
    }
  }

  [[nodiscard]] const BondSystem& bonds(std::size_t tau) const { return *bonds_[tau]; }
  [[nodiscard]] const Positions& rest() const { return tissue.network.organ.position; }
  [[nodiscard]] double simulated_s() const {
    double sum = 0.0;
    for (const ContactMotion& motion : compared) {
      sum += motion.period_s * static_cast<double>(motion.steps());
    }
    return sum;
  }

  /// Built for all relaxation times at once, when first asked for.
  [[nodiscard]] const CondensedContact& condensed() {
    if (!condensed_) {
      const auto start = Clock::now();
      condensed_.emplace(build_condensed(bonds(0), rest(), constraints, contact, into,
                                         {.depth_m = kDepth_m, .tangential_m = kAside_m}));
      condensed_s_ = seconds_of(Clock::now() - start);
    }
    return *condensed_;
  }
  [[nodiscard]] double condensed_s() const { return condensed_s_; }

  const BenchmarkReference& reference() {
    if (!reference_) find_reference();
    return *reference_;
  }
  /// Response of a setting at a relaxation time.
  [[nodiscard]] AnsweredPart part(std::size_t tau, bool positions) const {
    return positions ? positions_[tau] : forces_[tau];
  }
  /// The numbers of one part, each over the peak of its protocol.
  [[nodiscard]] Eigen::VectorXd scaled(const ServoAnswer& answer, std::size_t tau,
                                       bool positions) const {
    const std::vector<Eigen::MatrixXd>& all = positions ? answer.displacement : answer.force;
    const std::vector<double>& peaks = positions ? peaks_m_[tau] : peaks_N_[tau];
    return joined(all, peaks);
  }
  [[nodiscard]] Eigen::VectorXd scaled_claims(const ServoAnswer& answer, std::size_t tau) const {
    std::vector<Eigen::MatrixXd> all(answer.claimed_N.begin(), answer.claimed_N.end());
    return joined(all, peaks_N_[tau]);
  }

  const Tissue tissue;
  const Constraints constraints;
  const std::size_t contact;
  const Eigen::Vector3d into;
  const std::vector<double> taus_s;
  const bool line;
  const std::vector<ContactMotion> compared;

 private:
  static Eigen::VectorXd joined(const std::vector<Eigen::MatrixXd>& all,
                                const std::vector<double>& peaks) {
    Eigen::Index size = 0;
    for (const Eigen::MatrixXd& one : all) size += one.size();
    Eigen::VectorXd numbers(size);
    Eigen::Index at = 0;
    for (std::size_t m = 0; m < all.size(); ++m) {
      numbers.segment(at, all[m].size()) = all[m].reshaped() / peaks[m];
      at += all[m].size();
    }
    return numbers;
  }

  [[nodiscard]] int components() const { return line ? 1 : 3; }

  /// First and second reference of one motion.
  [[nodiscard]] std::array<ContactReference, 2> answers(std::size_t tau,
                                                        const ContactMotion& motion) const {
    const TouchedTissue touched{bonds(tau), rest(), constraints, contact};
    const double x = motion.period_s / taus_s[tau];
    const auto substeps = [&](double longest) {
      return std::max(1, static_cast<int>(std::ceil(x / longest)));
    };
    // The effect of a kink decays within a few relaxation times, so its share of a period has to be
    // resolved; slower tissue needs no more than a step a period.
    constexpr double kLongestLinear = 5.0;
    constexpr double kLongestStage = 1.25;
    ContactReference fine = fine_reference(touched, motion, substeps(kLongestLinear), kFieldEvery);
    if (!line) {
      return {runge_kutta_reference(touched, motion, substeps(kLongestStage), kFieldEvery),
              std::move(fine)};
    }
    constexpr double kTolerance = 1e-8;
    ContactReference first;
    first.force_N = motion.direction * line_reference(touched, motion, kTolerance).transpose();
    return {std::move(first), std::move(fine)};
  }

  void find_reference() {
    std::array<ServoAnswer, 2> found;
    std::array<std::vector<double>, 2> numbers;
    for (std::size_t tau = 0; tau < taus_s.size(); ++tau) {
      found = {};
      peaks_N_.emplace_back();
      peaks_m_.emplace_back();
      for (const ContactMotion& motion : compared) {
        std::array<ContactReference, 2> both = answers(tau, motion);
        peaks_N_[tau].push_back(both[0].peak_N());
        if (!line) {
          peaks_m_[tau].push_back(both[0]
                                      .displacement_m.reshaped(3, both[0].displacement_m.size() / 3)
                                      .colwise()
                                      .norm()
                                      .maxCoeff());
        }
        for (std::size_t who = 0; who < 2; ++who) {
          if (line) {
            found[who].force.emplace_back(motion.direction.transpose() * both[who].force_N);
          } else {
            found[who].force.emplace_back(both[who].force_N);
            found[who].displacement.push_back(std::move(both[who].displacement_m));
          }
        }
      }
      for (const bool positions : {false, true}) {
        if (positions && line) continue;
        AnsweredPart part{static_cast<Eigen::Index>(numbers[0].size()), 0};
        for (std::size_t who = 0; who < 2; ++who) {
          const Eigen::VectorXd more = scaled(found[who], tau, positions);
          numbers[who].insert(numbers[who].end(), more.begin(), more.end());
          part.count = more.size();
        }
        (positions ? positions_ : forces_).push_back(part);
      }
    }
    const auto vector = [](const std::vector<double>& all) {
      return Eigen::VectorXd::Map(all.data(), static_cast<Eigen::Index>(all.size())).eval();
    };
    BenchmarkAnswer first{
        "rk4",
        "Runge-Kutta of order 4 for the viscous elongations, forces balanced at each "
        "stage to rounding",
        vector(numbers[0])};
    if (line) first = {"collocation", "collocation (QuasiStatic) at 1e-8", first.response};
    constexpr double kWorstFloor = 2e-4;
    reference_ = checked_reference(
        std::move(first),
        {"exponential", "steps of linear elongation and steps of half their length, extrapolated",
         vector(numbers[1])},
        false, kWorstFloor, "contact models", components());
  }

  std::vector<std::unique_ptr<BondSystem>> bonds_;
  std::optional<CondensedContact> condensed_;
  double condensed_s_ = 0.0;
  std::optional<BenchmarkReference> reference_;
  std::vector<AnsweredPart> forces_, positions_;        ///< by relaxation time
  std::vector<std::vector<double>> peaks_N_, peaks_m_;  ///< by relaxation time and motion
};

/// A contact model of a case, built when first asked for.
struct ServoModel {
  std::string method, variant;
  double period_s = kServoPeriod_s;
  bool positions = false;
  Eigen::Index batch = 1;  ///< steps that are timed together
  /// @returns the model and the wall time of its building, s
  std::function<std::pair<std::unique_ptr<ContactModel>, double>(ServoCase&, std::size_t tau)> make;
};

/// Places at the ends of a model's periods.
Eigen::Matrix3Xd places_of(const ContactMotion& motion, double period_s) {
  return refined(motion, static_cast<int>(std::lround(motion.period_s / period_s))).displacement_m;
}

ServoAnswer answer_of_model(const ServoCase& asked, ContactModel& model) {
  ServoAnswer answer;
  const auto spheres = static_cast<Eigen::Index>(asked.tissue.network.organ.size());
  Eigen::Matrix3Xd field(3, spheres);
  for (const ContactMotion& motion : asked.compared) {
    const Eigen::Matrix3Xd places = places_of(motion, model.period_s());
    const Eigen::Index pieces = places.cols() / motion.steps();
    Eigen::MatrixXd force(asked.line ? 1 : 3, motion.steps());
    Eigen::MatrixXd displacement(3 * spheres, motion.steps() / kFieldEvery);
    Eigen::VectorXd claimed(motion.steps());
    model.reset();
    for (Eigen::Index i = 0; i < places.cols(); ++i) {
      const ContactAnswer now = model.step(places.col(i));
      if ((i + 1) % pieces != 0) continue;
      const Eigen::Index time = i / pieces;
      claimed[time] = now.error_N;
      if (asked.line) {
        force(0, time) = now.force_N.dot(motion.direction);
      } else {
        force.col(time) = now.force_N;
      }
      if ((time + 1) % kFieldEvery != 0) continue;
      model.displacements(field);
      displacement.col(time / kFieldEvery) = field.reshaped();
    }
    answer.force.push_back(std::move(force));
    answer.displacement.push_back(std::move(displacement));
    answer.claimed_N.push_back(std::move(claimed));
  }
  return answer;
}

/// Wall time of each step of all motions, or means of batches.
std::vector<double> step_times(const ServoCase& asked, ContactModel& model, const ServoModel& how) {
  std::vector<double> taken;
  Eigen::Matrix3Xd field(3, model.spheres());
  for (const ContactMotion& motion : asked.compared) {
    const Eigen::Matrix3Xd places = places_of(motion, model.period_s());
    model.reset();
    for (Eigen::Index first = 0; first + how.batch <= places.cols(); first += how.batch) {
      const auto start = Clock::now();
      for (Eigen::Index i = first; i < first + how.batch; ++i) {
        model.step(places.col(i));
        if (how.positions) model.displacements(field);
      }
      taken.push_back(seconds_of(Clock::now() - start) / static_cast<double>(how.batch));
    }
  }
  return taken;
}

BenchmarkSetting setting_of(const std::shared_ptr<ServoCase>& asked, std::size_t tau,
                            const ServoModel& how) {
  struct Kept {
    std::unique_ptr<ContactModel> model;
    double build_s = 0.0;
  };
  BenchmarkSetting setting;
  setting.method = how.method;
  setting.variant = how.variant;
  setting.parameter = "relaxation_time_s";
  setting.value = asked->taus_s[tau];
  setting.step_s = how.period_s;
  const auto kept = std::make_shared<Kept>();
  setting.part = [asked, tau, how] { return asked->part(tau, how.positions); };
  setting.run = [asked, tau, how, kept](bool time_steps) {
    BenchmarkRun run;
    if (!kept->model) std::tie(kept->model, kept->build_s) = how.make(*asked, tau);
    run.build_s = kept->build_s;
    if (time_steps) {
      run.step_wall_s = step_times(*asked, *kept->model, how);
      return run;
    }
    asked->reference();  // its peaks scale the answer
    const ServoAnswer answer = answer_of_model(*asked, *kept->model);
    run.outcome.response = asked->scaled(answer, tau, how.positions);
    if (!how.positions) run.claimed = asked->scaled_claims(answer, tau);
    run.outcome.end_time_s = asked->simulated_s();
    run.outcome.work.steps = std::lround(asked->simulated_s() / how.period_s);
    return run;
  };
  return setting;
}

ServoModel condensed_model(bool positions, double period_s) {
  ServoModel model{
      "condensed",
      positions ? "all positions" : "",
      period_s,
      positions,
      positions ? 1 : kBatch,
      [period_s](ServoCase& asked, std::size_t tau) {
        auto contact = std::make_unique<CondensedContact>(
            asked.condensed().with_relaxation_time(asked.taus_s[tau]).with_period(period_s));
        return std::pair<std::unique_ptr<ContactModel>, double>(std::move(contact),
                                                                asked.condensed_s());
      }};
  return model;
}

template <class Model, class Options>
ServoModel network_model(std::string method, std::string variant, const Options& options) {
  return {std::move(method),
          std::move(variant),
          options.period_s,
          false,
          1,
          [options](ServoCase& asked, std::size_t tau) {
            const auto start = Clock::now();
            auto model = std::make_unique<Model>(asked.bonds(tau), asked.rest(), asked.constraints,
                                                 asked.contact, asked.into, options);
            return std::pair<std::unique_ptr<ContactModel>, double>(
                std::move(model), seconds_of(Clock::now() - start));
          }};
}

ServoModel full_model(double period_s) {
  return network_model<ServoNetwork>("full_network", "", ServoNetworkOptions{.period_s = period_s});
}

/// Limits: force within 0.5 % in 1 us, positions in 5 us, the full
/// network within 0.1 % in 50 us (median) and 150 us (99th percentile); models built in 2 s.
std::vector<BenchmarkTarget> servo_targets(bool positions) {
  std::vector<BenchmarkTarget> targets{{"condensed", 5e-3, 1e-6, 0.0, 2.0},
                                       {"full_network", 1e-3, 50e-6, 150e-6, 0.0}};
  if (positions) targets.push_back({"condensed, all positions", 5e-3, 5e-6, 0.0, 2.0});
  return targets;
}

BenchmarkProblem servo_problem(const std::shared_ptr<ServoCase>& asked,
                               const std::vector<ServoModel>& models) {
  BenchmarkProblem problem;
  problem.response = asked->line ? "contact force" : "force, and of positions,";
  problem.unit = "";
  problem.simulated_s = asked->simulated_s();
  problem.targets = servo_targets(!asked->line);
  for (const ServoModel& model : models) {
    for (std::size_t tau = 0; tau < asked->taus_s.size(); ++tau) {
      problem.settings.push_back(setting_of(asked, tau, model));
    }
  }
  problem.reference = [asked] { return asked->reference(); };
  return problem;
}

Tissue servo_liver(const char* file) {
  return read_tissue(share_dir() / "configs" / file);
}

const std::vector<double>& servo_taus_s() {
  static const std::vector<double> taus{2e-4, 1e-2, 0.1, 1.25, 10.0, 100.0};
  return taus;
}

constexpr double kSpacing_s = 4e-3;  // of the times at which answers are compared

std::vector<ContactMotion> motions_in_space(const Eigen::Vector3d& into) {
  const ContactAxes axes = contact_axes(into);
  return {sideways_motion(axes, 4e-3, kAside_m, 20e-3, kSpacing_s),
          circling_motion(axes, 6e-3, kAside_m, 10.0, 2.0, kSpacing_s),
          random_motion_in_space(axes, kDepth_m, kAside_m, 200, 3, kSpacing_s)};
}

constexpr const char* kServoText =
    " Each point is one model at one relaxation time, 0.2 ms to 100 s, stepped at 1 kHz (or as its "
    "name says). Errors are over the peak of each motion by itself, the largest is told. Wall time "
    "is that of single steps, of the condensed model without positions of batches of 20 steps.";

BenchmarkProblem space_problem(const char* file, std::string name, std::string title,
                               const std::string& whose, const std::vector<ServoModel>& models) {
  const auto asked =
      std::make_shared<ServoCase>(servo_liver(file), servo_taus_s(), false, motions_in_space);
  BenchmarkProblem problem = servo_problem(asked, models);
  problem.name = std::move(name);
  problem.title = std::move(title);
  problem.text =
      whose +
      ": at 4 mm of depth 2 mm to one side and to the other at 20 mm/s with holds; at "
      "6 mm in circles of 2 mm radius at 10 Hz; and 0.8 s at random in space, to 8 mm of "
      "depth and 2 mm aside at 1 to 100 mm/s." +
      kServoText;
  return problem;
}

}  // namespace

BenchmarkProblem servo_normal_problem() {
  const auto motions = [](const Eigen::Vector3d& into) -> std::vector<ContactMotion> {
    ContactMotion poke = poke_motion(into, kDepth_m, 0.1, 0.04, kSpacing_s);
    return {ramp_motion(into, kDepth_m, 4e-3, 1.0, 5.0 * kSpacing_s),
            ramp_motion(into, 2e-3, 1e-2, 0.2, kSpacing_s), std::move(poke),
            random_motion(into, kDepth_m, 1.0, 1, kSpacing_s)};
  };
  const auto asked =
      std::make_shared<ServoCase>(servo_liver("liver_scene.json"), servo_taus_s(), true, motions);
  BenchmarkProblem problem =
      servo_problem(asked, {condensed_model(false, kServoPeriod_s), full_model(kServoPeriod_s)});
  problem.name = "servo_normal";
  problem.title = "Contact models along the normal";
  problem.text = fmt::format(
      "The liver of 424 spheres (configs/liver_scene.json) at sphere 71: 8 mm at 4 "
      "mm/s and held for 1 s; 2 mm at 10 mm/s and held; in and out at 100 mm/s; random "
      "probing for 1 s at 1 to 100 mm/s.{}",
      kServoText);
  return problem;
}

BenchmarkProblem servo_space_problem() {
  ServoModel fast_condensed = condensed_model(false, kFastServoPeriod_s);
  fast_condensed.variant = "4 kHz";
  ServoModel fast_full = full_model(kFastServoPeriod_s);
  fast_full.variant = "4 kHz";
  return space_problem(
      "liver_scene.json", "servo_space", "Contact models in space",
      "The liver of 424 spheres (configs/liver_scene.json) at sphere 71",
      {condensed_model(false, kServoPeriod_s), fast_condensed,
       condensed_model(true, kServoPeriod_s), full_model(kServoPeriod_s), fast_full});
}

BenchmarkProblem servo_inner_problem() {
  return space_problem("liver_inner_fixed_scene.json", "servo_inner",
                       "Contact models in space, inner layer fixed",
                       "The liver of 424 spheres with its inner layer fixed "
                       "(configs/liver_inner_fixed_scene.json)",
                       {condensed_model(false, kServoPeriod_s),
                        condensed_model(true, kServoPeriod_s), full_model(kServoPeriod_s)});
}

}  // namespace tpm::accuracy
