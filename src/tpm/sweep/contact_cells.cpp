// Declared in tpm/sweep/cell_model.hpp.
// Cells of a sweep over the paper's star in closed form.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/law/element/closed_form.hpp"
#include "tpm/law/relaxation/creep_exact.hpp"
#include "tpm/sweep/sweep_keys.hpp"
#include "tpmkit/error.hpp"

namespace tpm::sweep {
namespace {

using Kind = SweepOutput::Kind;

constexpr double kForever = std::numeric_limits<double>::infinity();
constexpr double kNotGiven = std::numeric_limits<double>::quiet_NaN();

/// Values that a cell is computed from, in the order of kContactParameters.
enum ContactIndex : std::size_t { kDepth = kTpmParameterCount, kRate, kHold, kLoad, kDuration };
constexpr std::size_t kContactParameterCount = kDuration + 1;
using ContactValues = std::array<double, kContactParameterCount>;

struct ContactParameter {
  std::size_t meaning;
  std::string_view text;
  Dimension dimension;
};

constexpr std::array<ContactParameter, kContactParameterCount> kContactParameters{{
    {kE1, "E1", Dimension::stress},
    {kE2, "E2", Dimension::stress},
    {kEprime, "Eprime", Dimension::stress},
    {kEta1, "eta1", Dimension::viscosity},
    {kSpacing, "spacing", Dimension::length},
    {kA0, "A0", Dimension::area},
    {kL0, "l0", Dimension::length},
    {kDepth, "depth", Dimension::length},
    {kRate, "rate", Dimension::speed},
    {kHold, "hold", Dimension::time},
    {kLoad, "load", Dimension::force},
    {kDuration, "duration", Dimension::time},
}};

enum class Indentation { none, ramp_hold, step_hold };

/// The star in a sweep's document.
struct ContactSetup {
  ContactValues values{};
  Indentation indentation = Indentation::none;
  bool creep = false;
  std::vector<SweepOutput> outputs;

  [[nodiscard]] bool uses(std::size_t parameter) const {
    switch (parameter) {
      case kRate:
        return indentation == Indentation::ramp_hold;
      case kDepth:
      case kHold:
        return indentation != Indentation::none;
      case kLoad:
      case kDuration:
        return creep;
      default:
        return true;
    }
  }
};

enum ContactCount : std::size_t { kUpdates, kCreepDepths, kContactCounts };

TpmParameters element_of(const ContactValues& values) {
  TpmVector v{};
  std::copy_n(values.begin(), v.size(), v.begin());
  return from_vector(v);
}

/// One star after another.
class ContactCell final : public CellModel {
 public:
  ContactCell(const ContactSetup& setup, std::vector<std::size_t> swept)
      : setup_(setup), swept_(std::move(swept)), values_(setup.values) {
    for (const SweepOutput& output : setup.outputs) {
      if (output.of_creep() || output.kind == Kind::lambda1) continue;
      forces_ += output.variable.width();
    }
    times_.reserve(forces_);
  }

  CellAnswer run(std::span<const double> swept, std::span<double> values,
                 std::span<std::int64_t> counts) override {
    for (std::size_t i = 0; i < swept.size(); ++i) values_[swept_[i]] = swept[i];
    const TpmParameters p = element_of(values_);
    require_valid(p, "material");
    if (forces_ > 0) find_forces(p, counts[kUpdates]);
    std::optional<CreepUnderConstantLoad> creep;
    std::size_t at = 0, force = 0;
    for (const SweepOutput& output : setup_.outputs) {
      const std::size_t width = output.variable.width();
      const auto found = values.subspan(at, width);
      at += width;
      if (output.kind == Kind::lambda1) {
        found[0] = lambda1_Pa(p.Eprime_Pa, values_[kDepth], p.spacing_m);
      } else if (output.of_creep()) {
        if (!creep) creep.emplace(creep_of(p));
        fill_creep(*creep, output, found);
        counts[kCreepDepths] += static_cast<std::int64_t>(width);
      } else {
        std::copy_n(forces_N_.begin() + static_cast<std::ptrdiff_t>(force), width, found.begin());
        force += width;
      }
    }
    return {};
  }

 private:
  /// All forces that are asked for, in the order of the outputs.
  void find_forces(const TpmParameters& p, std::int64_t& updates) {
    if (!(values_[kDepth] > 0.0)) {
      throw bad_input("indentation", "a depth that is not above 0", "a depth above 0");
    }
    const bool ramp = setup_.indentation == Indentation::ramp_hold;
    const double peak_s = ramp ? values_[kDepth] / values_[kRate] : 0.0;
    times_.clear();
    for (const SweepOutput& output : setup_.outputs) {
      if (output.kind == Kind::peak_force) times_.push_back(peak_s);
      if (output.kind == Kind::end_force) times_.push_back(kForever);  // put right below
      if (output.kind == Kind::force_at) times_.push_back(output.time_s);
      if (output.kind == Kind::force_over) {
        times_.insert(times_.end(), output.variable.times_s.begin(), output.variable.times_s.end());
      }
    }
    updates += static_cast<std::int64_t>(times_.size() + (ramp ? 2 : 0));
    if (!ramp) return step_forces(p);
    const Protocol protocol = ramp_and_hold(values_[kDepth], values_[kRate], values_[kHold]);
    for (double& time : times_) time = time == kForever ? protocol.end_s() : time;
    parameters_ = to_vector(p);
    forces_N_ = model_.respond(protocol, times_, parameters_, Want::values).value;
  }

  /// Eqs. 15 and 16 and what lies between: the force after a jump.
  void step_forces(const TpmParameters& p) {
    const double lambda1 = lambda1_Pa(p.Eprime_Pa, values_[kDepth], p.spacing_m);
    forces_N_.resize(static_cast<Eigen::Index>(times_.size()));
    for (std::size_t i = 0; i < times_.size(); ++i) {
      if (times_[i] != kForever && times_[i] > values_[kHold]) {
        throw bad_input("indentation", "a time after the end of the hold", "times within it");
      }
      forces_N_[static_cast<Eigen::Index>(i)] =
          step_relaxation_force_N(p, lambda1, values_[kDepth], std::min(times_[i], values_[kHold]));
    }
  }

  [[nodiscard]] CreepUnderConstantLoad creep_of(const TpmParameters& p) const {
    if (!(values_[kLoad] > 0.0 && values_[kDuration] > 0.0)) {
      throw bad_input("creep", "a load or a duration that is not above 0", "both above 0");
    }
    return {p, values_[kLoad]};
  }

  void fill_creep(const CreepUnderConstantLoad& creep, const SweepOutput& output,
                  std::span<double> found) const {
    const auto depth_at = [&](double time_s) {
      if (time_s <= values_[kDuration]) return creep.depth_m(time_s);
      throw bad_input("creep", "a time after the end of the load", "times within it");
    };
    switch (output.kind) {
      case Kind::instantaneous_creep_depth:
        found[0] = creep.instantaneous_depth_m();
        return;
      case Kind::creep_depth_at:
        found[0] = depth_at(output.time_s);
        return;
      case Kind::creep_depth_over:
        std::transform(output.variable.times_s.begin(), output.variable.times_s.end(),
                       found.begin(), depth_at);
        return;
      default:
        found[0] = depth_at(values_[kDuration]);
    }
  }

  const ContactSetup& setup_;
  std::vector<std::size_t> swept_;
  ContactValues values_;
  std::size_t forces_ = 0;
  ClosedForm model_{ModelOptions{}};
  std::vector<double> times_;
  TpmVector parameters_{};
  Eigen::VectorXd forces_N_;
};

class ContactModel final : public SweepModel {
 public:
  explicit ContactModel(ContactSetup setup) : setup_(std::move(setup)) {
    for (const SweepOutput& output : setup_.outputs) variables_.push_back(output.variable);
  }

  [[nodiscard]] Dimension dimension_of(const std::string& target,
                                       std::string_view where) const override {
    const std::size_t index = parse_word(kContactParameters, "parameter", target, where);
    if (setup_.uses(index)) return entry_of(kContactParameters, index).dimension;
    throw bad_input(where, fmt::format("'{}' belongs to an experiment that is not there", target),
                    "an indentation with a rate or a creep beside it");
  }
  [[nodiscard]] const std::vector<SweepVariable>& variables() const override { return variables_; }
  [[nodiscard]] std::vector<std::string> counted() const override {
    return {"relaxation_updates", "creep_depths"};
  }
  [[nodiscard]] std::vector<std::pair<std::string, double>> constants() const override {
    std::vector<std::pair<std::string, double>> constants;
    for (const ContactParameter& parameter : kContactParameters) {
      if (!std::isfinite(setup_.values[parameter.meaning])) continue;
      constants.emplace_back(parameter.text, setup_.values[parameter.meaning]);
    }
    return constants;
  }
  [[nodiscard]] std::uint64_t usual_block() const override { return 8192; }
  [[nodiscard]] std::unique_ptr<CellModel> cell_model(
      const std::vector<SweptTarget>& targets) const override {
    auto swept = mapped<std::size_t>(targets, [](const SweptTarget& target) {
      return parse_word(kContactParameters, "parameter", target.target, "sweep");
    });
    for (const ContactParameter& parameter : kContactParameters) {
      if (!setup_.uses(parameter.meaning) || !std::isnan(setup_.values[parameter.meaning]) ||
          std::find(swept.begin(), swept.end(), parameter.meaning) != swept.end()) {
        continue;
      }
      throw bad_input("sweep", fmt::format("no '{}'", parameter.text),
                      "a value in its block, or an axis");
    }
    return std::make_unique<ContactCell>(setup_, std::move(swept));
  }

 private:
  ContactSetup setup_;
  std::vector<SweepVariable> variables_;
};

ContactSetup setup_of(const SweepKeys& keys, const DocumentPlace& place) {
  require_valid(keys.material, place.key("material").where);
  ContactSetup setup;
  const TpmVector material = to_vector(keys.material);
  std::copy(material.begin(), material.end(), setup.values.begin());
  std::fill(setup.values.begin() + kTpmParameterCount, setup.values.end(), kNotGiven);
  const auto put = [&](std::size_t index, const std::optional<double>& value, double otherwise) {
    setup.values[index] = value.value_or(otherwise);
  };
  // The value after a jump may be held for ever; a ramp's hold has an end.
  if (keys.indentation) {
    const bool step = keys.indentation->kind == ProtocolKind::step_hold;
    setup.indentation = step ? Indentation::step_hold : Indentation::ramp_hold;
    put(kDepth, keys.indentation->depth_m, kNotGiven);
    put(kRate, keys.indentation->rate_m_per_s, kNotGiven);
    put(kHold, keys.indentation->hold_s, step ? kForever : kNotGiven);
  }
  setup.values[kDuration] = kForever;
  setup.creep = keys.creep.has_value();
  if (setup.creep) {
    put(kLoad, keys.creep->load_N, kNotGiven);
    put(kDuration, keys.creep->duration_s, kForever);
  }
  setup.outputs = outputs_of(keys.outputs, place.key("outputs"));
  return setup;
}

/// Outputs of an experiment that the document does not have.
void require_experiments(const ContactSetup& setup, const DocumentPlace& place) {
  if (setup.indentation == Indentation::none && !setup.creep) {
    throw bad_input(place.where, "nothing is done to the contact",
                    "'indentation', 'creep' or both");
  }
  for (const SweepOutput& output : setup.outputs) {
    const bool there = output.of_creep() ? setup.creep : setup.indentation != Indentation::none;
    if (there) continue;
    throw bad_input(place.key("outputs").where,
                    fmt::format("'{}' without {}", output.variable.name,
                                output.of_creep() ? "creep" : "indentation"),
                    "a block for every experiment that is looked at");
  }
}

}  // namespace

std::shared_ptr<const SweepModel> single_contact_model(const SweepKeys& keys,
                                                       std::string_view where) {
  const DocumentPlace place{std::string(where)};
  ContactSetup setup = setup_of(keys, place);
  require_experiments(setup, place);
  return std::make_shared<ContactModel>(std::move(setup));
}

}  // namespace tpm::sweep
