// How often tpm validate is right, by simulation (reports/validation):
//
//     measure_validation [EXPERIMENTS] [CASE] [SEED]
#include <fmt/format.h>

#include <boost/math/distributions/binomial.hpp>

#include "program.hpp"
#include "validation_studies.hpp"

namespace tpm::test {
namespace {

/// Clopper and Pearson's 95 % interval, %.
std::string rate_text(const Count& c) {
  using boost::math::binomial_distribution;
  const double low =
      c.held == 0 ? 0.0 : binomial_distribution<>::find_lower_bound_on_p(c.trials, c.held, 0.025);
  const double high = c.held == c.trials
                          ? 1.0
                          : binomial_distribution<>::find_upper_bound_on_p(c.trials, c.held, 0.025);
  return fmt::format("{} of {} ({:.1f} to {:.1f} %)", c.held, c.trials, 100.0 * low, 100.0 * high);
}

void say(const std::string& what, const std::string& quantity, const Count& count) {
  fmt::print("| {} | {} | {} |\n", what, quantity, rate_text(count));
  std::fflush(stdout);
}

void say(const std::string& what, const StudyCounts& counts) {
  say(what, "peak", counts.peak);
  say(what, "end of hold", counts.end);
}

RecordingComparison compared(const LawFile& law, const StudyTest& test, const StudyNoise& noise,
                             Random& random, PlacementRule placement, double stiffer = 1.0,
                             double slow_branch = 0.0,
                             std::optional<Requirement> requirement = std::nullopt) {
  ComparisonOptions options;
  options.placement = placement;
  options.requirement = std::move(requirement);
  options.quantities = {{QuantityKind::peak}, {QuantityKind::end_of_hold}};
  const PreparedRecording r =
      prepare_recording("validation", study_recording(test, noise, random, stiffer, slow_branch));
  return compare_with_recording(law, r, options);
}

/// |E| <= U without a model error: rests, contact by the depth or the onset, held and fitted.
void no_model_error(int experiments, int calibrations, double phi) {
  StudyNoise noise;
  noise.phi = phi;
  Random random(51);
  struct Case {
    const char* name;
    int rest;
    double contact_mm;
    PlacementRule placement;
    StudyCounts counts;
  };
  std::vector<Case> cases{{"held, rest 10, contact at depth 0", 10, 0.0, PlacementRule::held, {}},
                          {"held, rest 10, onset", 10, 0.4, PlacementRule::held, {}},
                          {"held, rest 200, onset", 200, 0.4, PlacementRule::held, {}},
                          {"fitted, rest 40", 40, 0.4, PlacementRule::fitted, {}}};
  for (int i = 0; i < experiments; ++i) {
    const LawFile law = study_calibration(calibrations, noise, random);
    for (Case& c : cases) {
      c.counts.add(
          compared(law, study_validation(c.rest, c.contact_mm), noise, random, c.placement), 0.0,
          0.0);
    }
  }
  for (const Case& c : cases) {
    say(fmt::format("no model error, {}, {} calibration recording{}, {}",
                    phi > 0.0 ? fmt::format("AR(1) {}", phi) : std::string("white noise"),
                    calibrations, calibrations > 1 ? "s" : "", c.name),
        c.counts);
  }
}

/// 5 % stiffer: [E - U, E + U] contains the model error, and verdicts at R = |delta|.
void known_error(int experiments) {
  const StudyNoise noise;
  const StudyTest test = study_validation(40, 0.4);
  Random random(52);
  StudyCounts counts;
  Count adequate, not_adequate;
  constexpr double kStiffer = 1.05;
  LawFile right;
  right = study_calibration(1, noise, random);
  right.values = {60.0, 45.0, 2.0, 0.0, 0.0};
  const TrueErrors delta = true_errors(right, test, kStiffer);
  Requirement requirement;
  requirement.share = false;
  requirement.dimension = Dimension::force;
  requirement.value = std::abs(delta.end);
  for (int i = 0; i < experiments; ++i) {
    const LawFile law = study_calibration(1, noise, random);
    const RecordingComparison r =
        compared(law, test, noise, random, PlacementRule::held, kStiffer, 0.0, requirement);
    counts.add(r, delta.peak, delta.end);
    const ModelVerdict verdict = study_quantity(r, QuantityKind::end_of_hold).verdict;
    adequate.add(verdict == ModelVerdict::adequate);
    not_adequate.add(verdict == ModelVerdict::not_adequate);
  }
  say("5 % stiffer, [E - U, E + U] contains delta", counts);
  say("abs(delta) = R, called adequate", "end of hold", adequate);
  say("abs(delta) = R, called not adequate", "end of hold", not_adequate);
}

/// A branch of 12 s left out of the law: delta of the law fitted to noise-free data.
void branch_left_out(int experiments, std::uint64_t seed) {
  const StudyNoise noise;
  const StudyTest test = study_validation(40, 0.4);
  constexpr double kBranch = 6.0;
  Random random(seed);
  StudyNoise clean;
  clean.sigma_N = 1e-7;
  clean.zero_N = 0.0;
  const LawFile limit = study_calibration(1, clean, random, kBranch);
  const TrueErrors delta = true_errors(limit, test, 1.0, kBranch);
  StudyCounts counts;
  for (int i = 0; i < experiments; ++i) {
    const LawFile law = study_calibration(1, noise, random, kBranch);
    counts.add(compared(law, test, noise, random, PlacementRule::held, 1.0, kBranch), delta.peak,
               delta.end);
  }
  say("a branch left out, [E - U, E + U] contains delta", counts);
}

/// Force cells that are off by at most 0.5 %, another one in the validation.
void instruments(int experiments) {
  constexpr double kLimit = 0.005;
  Instrument cell;
  cell.force = ChannelUncertainty{kLimit / std::numbers::sqrt3, 0.0};
  Random random(54);
  StudyCounts other, same;
  for (int i = 0; i < experiments; ++i) {
    StudyNoise noise;
    const LawFile law = study_calibration(1, noise, random, 0.0, kLimit);
    noise.force_scale = kLimit * (2.0 * random.uniform() - 1.0);
    ComparisonOptions options;
    options.quantities = {{QuantityKind::peak}, {QuantityKind::end_of_hold}};
    cell.id = "a";
    options.instrument = cell;
    cell.id = "b";
    options.calibration_instrument = cell;
    const PreparedRecording r =
        prepare_recording("validation", study_recording(study_validation(40, 0.4), noise, random));
    other.add(compare_with_recording(law, r, options), 0.0, 0.0);
  }
  say("no model error, force cells off by up to 0.5 %, two instruments", other);
}

/// Five recordings: the mean E, and the area metric beyond the 95 % point of its draws.
void several(int experiments) {
  const StudyNoise noise;
  Random random(55);
  Count mean, area;
  for (int i = 0; i < experiments; ++i) {
    ValidationRequest request;
    request.law = study_calibration(1, noise, random);
    request.quantities = {{QuantityKind::peak}};
    for (int k = 0; k < 5; ++k) {
      request.recordings.push_back(
          prepare_recording("validation " + std::to_string(k),
                            study_recording(study_validation(40, 0.4), noise, random)));
    }
    const Validation v = validate(request);
    const PooledQuantity& p = v.pooled.front();
    mean.add(std::abs(p.e.error) <= p.e.expanded());
    area.add(p.area->area > p.area->null_95);
  }
  say("no model error, mean over 5 recordings", "peak", mean);
  say("area metric beyond the 95 % point of its draws, 5 recordings", "peak", area);
}

/// Specimens whose stiffness scatters by a tenth: |E| <= U for new ones, alone and the mean of
/// five, and without --new-specimen.
void new_specimens(int experiments, int calibrations) {
  constexpr double kSpread = 0.1;
  const StudyNoise noise;
  Random random(57);
  StudyCounts alone, without, joined;
  Count together;
  for (int i = 0; i < experiments; ++i) {
    const auto add = [&](StudyCounts& counts, bool new_specimen) {
      const Validation v =
          study_new_specimens(calibrations, 1, kSpread, noise, random, new_specimen);
      counts.add(v.recordings.front(), 0.0, 0.0);
      if (new_specimen) together.add(v.recordings.front().joint.p_value >= 0.05);
    };
    add(alone, true);
    add(without, false);
    const Validation v = study_new_specimens(calibrations, 5, kSpread, noise, random);
    joined.peak.add(std::abs(v.pooled[0].e.error) <= v.pooled[0].e.expanded());
    joined.end.add(std::abs(v.pooled[1].e.error) <= v.pooled[1].e.expanded());
  }
  const std::string what =
      fmt::format("specimens that scatter by 10 %, {} calibration recordings", calibrations);
  say(what + ", a new specimen", alone);
  say(what + ", a new specimen, T^2 below its 95 % point", "peak and end of hold", together);
  say(what + ", mean over 5 new specimens", joined);
  say(what + ", a new specimen, without --new-specimen", without);
}

/// Two probes whose radii are off by up to 1 % each; forces of a half space grow with R for the
/// linear law, and one probe in both.
void probes(int experiments) {
  constexpr double kLimit = 0.01;
  Instrument cell;
  cell.id = "cell";
  cell.radius = kLimit / std::numbers::sqrt3;
  Random random(58);
  StudyCounts other, same;
  for (int i = 0; i < experiments; ++i) {
    StudyNoise noise;
    const auto radius = [&] { return 1.0 + kLimit * (2.0 * random.uniform() - 1.0); };
    const double fitted = radius(), compared = radius();
    const PreparedRecording calibration =
        prepare_recording("calibration", study_recording({}, noise, random, fitted));
    const LawFile law = study_fit({calibration});
    ComparisonOptions options;
    options.quantities = {{QuantityKind::peak}, {QuantityKind::end_of_hold}};
    cell.probe = "a";
    options.calibration_instrument = cell;
    options.instrument = cell;
    const auto with = [&](double factor) {
      return prepare_recording("validation",
                               study_recording(study_validation(40, 0.4), noise, random, factor));
    };
    same.add(compare_with_recording(law, with(fitted), options), 0.0, 0.0);
    options.instrument->probe = "b";
    other.add(compare_with_recording(law, with(compared), options), 0.0, 0.0);
  }
  say("no model error, flat punches off by up to 1 % of their radius, two probes", other);
  say("no model error, a flat punch off by up to 1 % of its radius, one probe", same);
}

/// An error and the uncertainty stated for it, over many experiments, N.
struct ErrorOfMany {
  int count = 0;
  double sum = 0.0, squares = 0.0, u_squares = 0.0;
  void add(double error, double u) {
    ++count;
    sum += error;
    squares += error * error;
    u_squares += u * u;
  }
  [[nodiscard]] double mean() const { return sum / count; }
  [[nodiscard]] double sd() const { return std::sqrt((squares - sum * sum / count) / (count - 1)); }
  [[nodiscard]] double u() const { return std::sqrt(u_squares / count); }
};

void say(const std::string& what, const char* quantity, const ErrorOfMany& e) {
  fmt::print("| {} | {} | {:.3f} | {:.3f} | {:.3f} | {:.3f} |\n", what, quantity, 1e3 * e.mean(),
             1e3 * e.sd(), 1e3 * e.u(), e.sd() / e.u());
  std::fflush(stdout);
}

/// Is each part of u_val what its error scatters by? S of the fitted law at the true contact
/// against S of the law without noise; the rest of E against the readings' u_D; E against u_val.
void parts(int experiments, int calibrations, double phi, double slow_branch) {
  StudyNoise noise;
  noise.phi = phi;
  const StudyTest test = study_validation(40, 0.4);
  Random random(56);
  Random unused(0);
  StudyNoise clean;
  clean.sigma_N = 1e-7;
  clean.zero_N = 0.0;
  const LawFile limit = study_calibration(1, clean, random, slow_branch);
  const TrueErrors delta = true_errors(limit, test, 1.0, slow_branch);
  const PreparedRecording truth =
      prepare_recording("truth", study_recording(test, clean, unused, 1.0, slow_branch));
  const RecordingParts parts = parts_of(truth);
  struct Quantity {
    QuantityKind kind;
    const char* name;
    double delta;
    ErrorOfMany s, d, e;
  };
  std::vector<Quantity> quantities{
      {QuantityKind::peak, "peak", delta.peak, {}, {}, {}},
      {QuantityKind::end_of_hold, "end of hold", delta.end, {}, {}, {}}};
  const auto simulated = [&](const LawAlong::At& at, QuantityKind kind) {
    return read_quantity({kind}, parts, truth.recording, 0.0, at.value).value();
  };
  const LawAlong limit_along(limit, truth);
  const LawAlong::At limit_at = limit_along.at(1e-3 * test.contact_mm);
  double sigma = 0.0, correlation = 0.0;
  for (int i = 0; i < experiments; ++i) {
    const LawFile law = study_calibration(calibrations, noise, random, slow_branch);
    const LawAlong along(law, truth);
    const LawAlong::At at = along.at(1e-3 * test.contact_mm);
    const RecordingComparison r =
        compared(law, test, noise, random, PlacementRule::held, 1.0, slow_branch);
    sigma += r.scatter.sigma / experiments;
    correlation += r.scatter.phi / experiments;
    for (Quantity& q : quantities) {
      const auto s = simulated(at, q.kind);
      const double of_law = s.value - simulated(limit_at, q.kind).value;
      const QuantityComparison& found = study_quantity(r, q.kind);
      q.s.add(of_law, (s.weight.transpose() * at.by_law * along.root()).norm());
      q.d.add(found.e.error - q.delta - of_law, found.u_D);
      q.e.add(found.e.error - q.delta, found.e.u_val);
    }
  }
  const std::string what = fmt::format("{}{} calibration recording{}",
                                       slow_branch > 0.0 ? "branch left out, "
                                       : phi > 0.0       ? "AR(1) 0.9, "
                                                         : "",
                                       calibrations, calibrations > 1 ? "s" : "");
  for (const Quantity& q : quantities) {
    say(what + ": S, u_input", q.name, q.s);
    say(what + ": D and contact, u_D", q.name, q.d);
    say(what + ": E, u_val", q.name, q.e);
  }
  fmt::print("scatter: sigma {:.4f} mN, correlation {:.4f} on average\n\n", 1e3 * sigma,
             correlation);
}

/// A jump to 3 mm anywhere between two samples, of the study's material; 0.3 mN of noise.
PreparedRecording jumped(Random& random, const char* name) {
  constexpr double kEvery_s = 0.1, kDepth = 3e-3, kNoise = 3e-4;
  constexpr int kRest = 40, kCount = 240;
  const double jump_s = kEvery_s * (kRest + random.uniform());
  Recording r;
  r.header.id = name;
  for (int i = 0; i < kCount; ++i) {
    const double t = kEvery_s * i;
    const bool pressed = i > kRest;
    r.time_s.push_back(t);
    r.drive.push_back(pressed ? kDepth : 0.0);
    const double force = pressed ? kDepth * (60.0 + 45.0 * std::exp(-(t - jump_s) / 2.0)) : 0.0;
    r.response.push_back(force + kNoise * random.normal());
  }
  return prepare_recording(name, std::move(r));
}

void jumps(int experiments) {
  Random random(57);
  StudyCounts by_ramps, by_jumps;
  ComparisonOptions options;
  options.quantities = {{QuantityKind::peak}, {QuantityKind::end_of_hold}};
  for (int i = 0; i < experiments; ++i) {
    const PreparedRecording r = jumped(random, "validation");
    const LawFile of_ramps = study_calibration(5, {}, random);
    by_ramps.add(compare_with_recording(of_ramps, r, options), 0.0, 0.0);
    const LawFile of_jump = study_fit({jumped(random, "calibration")});
    by_jumps.add(compare_with_recording(of_jump, r, options), 0.0, 0.0);
  }
  say("no model error, a jump between two samples, law of 5 ramps", by_ramps);
  say("no model error, a jump between two samples, law of another such jump", by_jumps);
}

}  // namespace
}  // namespace tpm::test

int main(int argc, char** argv) {
  using namespace tpm::test;
  return measured(
      argc, argv, 0, 3, "usage: measure_validation [EXPERIMENTS] [CASE] [SEED of the case branch]",
      [](const std::vector<std::string>& words) {
        const int n = words.empty() ? 1000 : std::stoi(words[0]);
        const std::string only = words.size() > 1 ? words[1] : "";
        const auto wanted = [&](const char* name) { return only.empty() || only == name; };
        fmt::print("| what | quantity | how often (exact 95 % interval) |\n|---|---|---|\n");
        if (wanted("white")) no_model_error(n, 1, 0.0);
        if (wanted("white5")) no_model_error(n, 5, 0.0);
        if (wanted("ar")) no_model_error(n, 1, 0.9);
        if (wanted("ar5")) no_model_error(n, 5, 0.9);
        if (wanted("stiffer")) known_error(n);
        if (wanted("branch")) branch_left_out(n, words.size() > 2 ? std::stoull(words[2]) : 53);
        if (wanted("instruments")) instruments(n);
        if (wanted("jumps")) jumps(n);
        if (wanted("several")) several(n);
        if (wanted("specimens")) {
          new_specimens(n, 5);
          new_specimens(n, 2);
        }
        if (wanted("probes")) probes(n);
        if (wanted("parts")) {
          fmt::print("| what | quantity | mean error, mN | its sd | u | sd / u |\n");
          fmt::print("|---|---|---|---|---|---|\n");
          parts(n, 1, 0.0, 0.0);
          parts(n, 5, 0.0, 0.0);
          parts(n, 1, 0.9, 0.0);
          parts(n, 1, 0.0, 6.0);
        }
      });
}
