#include "tpm/fit/validate/pooled.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/fit/groups/random_effects.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

/// A quantity of one recording as it is pooled.
struct Member {
  const RecordingComparison* recording;
  const QuantityComparison* quantity;
  double scale = 1.0;  ///< that its E is divided by
};

bool one_instrument(const std::vector<Member>& members) {
  const auto& first = members.front().recording->instrument;
  return first && std::ranges::all_of(members, [&](const Member& m) {
           const auto& own = m.recording->instrument;
           return own && own->id == first->id &&
                  m.quantity->of_instrument.size() ==
                      members.front().quantity->of_instrument.size();
         });
}

/// Probes whose radius is in u_input of two recordings or more.
std::vector<std::string> common_probes(const std::vector<Member>& members) {
  std::vector<std::string> once, common;
  for (const Member& m : members) {
    if (m.quantity->of_probe == 0.0) continue;
    const std::string id = m.recording->instrument.value().probe_id();
    const bool again = std::ranges::find(once, id) != once.end();
    if (again && std::ranges::find(common, id) == common.end()) common.push_back(id);
    once.push_back(id);
  }
  return common;
}

/// Place of its probe among those; their number if it is none of them.
std::size_t place_of_probe(const Member& m, const std::vector<std::string>& common) {
  if (m.quantity->of_probe == 0.0) return common.size();
  const auto found = std::ranges::find(common, m.recording->instrument.value().probe_id());
  return static_cast<std::size_t>(found - common.begin());
}

/// The effects of what recordings share, one row each.
struct SharedEffects {
  Eigen::MatrixXd rows;
  Eigen::Index filling = 0, fillings = 0;    ///< columns of the fillings of an organ
  Eigen::Index specimen = 0, specimens = 0;  ///< of the law's mean over specimens
};

SharedEffects shared_of(const std::vector<Member>& members, bool instrument) {
  Eigen::Index columns = 0, of_instrument = 0, of_filling = 0, of_specimen = 0;
  const std::vector<std::string> probes = common_probes(members);
  const auto of_probe = static_cast<Eigen::Index>(probes.size());
  for (const Member& m : members) {
    columns = std::max(columns, m.quantity->shared.size());
    of_filling = std::max(of_filling, m.quantity->of_filling.size());
    of_specimen = std::max(of_specimen, m.quantity->of_specimen.size());
    if (instrument) of_instrument = std::max(of_instrument, m.quantity->of_instrument.size());
  }
  const Eigen::Index specimen = columns + of_filling, probe = specimen + of_specimen;
  Eigen::MatrixXd shared = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(members.size()),
                                                 probe + of_probe + of_instrument);
  for (std::size_t j = 0; j < members.size(); ++j) {
    const Member& m = members[j];
    const auto row = static_cast<Eigen::Index>(j);
    shared.row(row).head(m.quantity->shared.size()) = m.quantity->shared / m.scale;
    shared.row(row).segment(columns, m.quantity->of_filling.size()) =
        m.quantity->of_filling / m.scale;
    shared.row(row).segment(specimen, m.quantity->of_specimen.size()) =
        m.quantity->of_mean / m.scale * m.quantity->of_specimen;
    const std::size_t place = place_of_probe(m, probes);
    if (place < probes.size()) {
      shared(row, probe + static_cast<Eigen::Index>(place)) = m.quantity->of_probe / m.scale;
    }
    if (instrument) shared.row(row).tail(of_instrument) = m.quantity->of_instrument / m.scale;
  }
  return {std::move(shared), columns, of_filling, specimen, of_specimen};
}

double own_of(const Member& m, bool instrument, const std::vector<std::string>& probes) {
  const double apart = instrument ? 0.0 : m.quantity->of_instrument.norm();
  const double probe = place_of_probe(m, probes) < probes.size() ? 0.0 : m.quantity->of_probe;
  return std::hypot(m.quantity->u_own, apart, probe) / m.scale;
}

void set_mean(PooledQuantity& pooled, const std::vector<Member>& members,
              const SharedEffects& all_share, const std::vector<double>& own,
              double degrees_of_law) {
  const Eigen::MatrixXd& shared = all_share.rows;
  std::vector<SpecimenEstimate> estimates;
  const double tiny = 1e-12 * std::abs(members.front().quantity->simulated / members.front().scale);
  for (std::size_t j = 0; j < members.size(); ++j) {
    const Member& m = members[j];
    estimates.push_back({m.recording->name, m.quantity->e.error / m.scale,
                         std::max({own[j], tiny, std::numeric_limits<double>::min()})});
  }
  const RandomEffects effects = random_effects(estimates);
  const double spread = effects.tau_squared.value_or(0.0);
  Eigen::RowVectorXd mean_shared = Eigen::RowVectorXd::Zero(shared.cols());
  double weights = 0.0, specimens_with_own = 0.0;
  for (std::size_t j = 0; j < members.size(); ++j) {
    const double s = estimates[j].standard_error;
    const double weight = 1.0 / (s * s + spread);
    const QuantityComparison& q = *members[j].quantity;
    specimens_with_own += weight * q.of_mean * q.specimen_with_own / members[j].scale;
    mean_shared += weight * shared.row(static_cast<Eigen::Index>(j));
    weights += weight;
  }
  pooled.between = std::sqrt(spread);
  pooled.u_shared = mean_shared.norm() / weights;
  CombinedUncertainty sum;
  sum.add(effects.standard_error, static_cast<double>(members.size() - 1));
  const double of_fillings =
      mean_shared.segment(all_share.filling, all_share.fillings).norm() / weights;
  const double of_specimens =
      mean_shared.segment(all_share.specimen, all_share.specimens).norm() / weights;
  const double apart = of_fillings * of_fillings + of_specimens * of_specimens;
  sum.add(std::sqrt(std::max(pooled.u_shared * pooled.u_shared - apart, 0.0)), degrees_of_law);
  sum.add(of_fillings, static_cast<double>(std::max<Eigen::Index>(all_share.fillings - 1, 1)));
  if (const int degrees = members.front().quantity->specimen_degrees; degrees > 0) {
    sum.add_difference(of_specimens, specimens_with_own / weights, degrees);
  }
  pooled.e = {effects.mean, sum.u(), sum.degrees(), coverage_factor(sum.degrees())};
}

void set_area(PooledQuantity& pooled, const std::vector<Member>& members,
              const Eigen::MatrixXd& shared, const std::vector<double>& own,
              const std::optional<std::string>& at) {
  std::vector<double> z;
  for (std::size_t j = 0; j < members.size(); ++j) {
    const double u = std::hypot(shared.row(static_cast<Eigen::Index>(j)).norm(), own[j]);
    if (!(u > 0.0)) return;
    z.push_back(-members[j].quantity->e.error / members[j].scale / u);
  }
  AreaMetric area = standard_area(z, shared, own);
  double scale = 1.0;
  if (!pooled.relative) {
    double sum = 0.0;
    for (std::size_t j = 0; j < members.size(); ++j) {
      sum += std::hypot(shared.row(static_cast<Eigen::Index>(j)).norm(), own[j]);
    }
    scale = sum / static_cast<double>(members.size());
  } else if (at) {
    const auto named =
        std::ranges::find_if(members, [&](const Member& m) { return m.recording->name == *at; });
    if (named == members.end()) return;
    scale = named->quantity->e.u_val;
    pooled.area_at = at;
    pooled.simulated = named->quantity->simulated;
    pooled.measured = named->quantity->measured;
  }
  area.area *= scale;
  area.null_mean *= scale;
  area.null_95 *= scale;
  if (area.lower) *area.lower *= scale;
  if (area.upper) *area.upper *= scale;
  pooled.area = area;
}

void judge_pooled(PooledQuantity& pooled, const std::vector<Member>& members,
                  const PooledOptions& options) {
  const bool residual =
      std::ranges::any_of(members, [](const Member& m) { return m.recording->calibration; });
  const auto unknown =
      std::ranges::find_if(members, [](const Member& m) { return m.quantity->unknown; });
  if (options.requirement) {
    if (pooled.relative) {
      const Member& largest = *std::ranges::max_element(members, {}, &Member::scale);
      const auto limit =
          limit_of(*options.requirement, *largest.quantity, largest.quantity->unit.dimension, 0.0);
      if (limit && options.requirement->share) {
        pooled.limit = options.requirement->value;
      } else if (limit) {
        pooled.limit = *limit / largest.scale;
        pooled.limit_at = largest.recording->name;
      }
    } else {
      QuantityComparison mean = *members.front().quantity;
      mean.measured = pooled.measured;
      mean.u_D = pooled.e.u_val;
      pooled.limit = limit_of(*options.requirement, mean, mean.unit.dimension, 0.0);
    }
  }
  pooled.verdict = judge_error(pooled.e, pooled.limit);
  pooled.p_value = error_p_value(pooled.e, pooled.limit);
  if (options.requirement && !pooled.limit) pooled.verdict = ModelVerdict::no_requirement;
  if (unknown != members.end()) {
    pooled.verdict = ModelVerdict::undetermined;
    const Remark& why = unknown->quantity->remark.value();
    pooled.remark = {why.code, fmt::format("{} ({})", why.text, unknown->recording->name)};
    pooled.unknown = true;
    pooled.p_value = 1.0;
  } else if (pooled.verdict == ModelVerdict::undetermined) {
    const double own = std::sqrt(
        std::max(pooled.e.u_val * pooled.e.u_val - pooled.u_shared * pooled.u_shared, 0.0));
    pooled.remark = shrink_remark(
        pooled.e, *pooled.limit,
        {{"what all recordings share (the law, the instrument, an organ's spheres)",
          pooled.u_shared},
         {fmt::format("the mean over {} recordings", pooled.recordings), own}},
        pooled.relative
            ? Unit{"%", Dimension::dimensionless, 0.01}
            : scaled_unit(pooled.unit, std::max(std::abs(pooled.measured), pooled.e.expanded())));
  }
  if (residual) pooled.verdict = ModelVerdict::residual;
}

}  // namespace

bool equal_protocols(std::span<const Applicability> motions) {
  constexpr double kEqual = 0.02;
  const auto agree = [&](double Applicability::*member) {
    const double first = motions.front().*member;
    return std::ranges::all_of(motions, [&](const Applicability& m) {
      return std::abs(m.*member - first) <= kEqual * std::abs(first);
    });
  };
  return agree(&Applicability::depth) && agree(&Applicability::rate) &&
         agree(&Applicability::duration_s);
}

const QuantityComparison* same_quantity(const RecordingComparison& recording,
                                        const QuantityComparison& quantity) {
  for (const QuantityComparison& q : recording.quantities) {
    if (q.quantity == quantity.quantity && q.name == quantity.name) return &q;
  }
  return nullptr;
}

std::vector<QuantityComparison> each_quantity(std::span<const RecordingComparison> recordings) {
  std::vector<QuantityComparison> all;
  for (const RecordingComparison& r : recordings) {
    for (const QuantityComparison& q : r.quantities) {
      const bool known = std::ranges::any_of(all, [&](const QuantityComparison& other) {
        return other.quantity == q.quantity && other.name == q.name;
      });
      if (!known) all.push_back(q);
    }
  }
  return all;
}

std::vector<PooledQuantity> pool_recordings(std::span<const RecordingComparison> recordings,
                                            std::span<const Applicability> motions,
                                            double degrees_of_law, const PooledOptions& options) {
  std::vector<PooledQuantity> all;
  if (recordings.size() < 2) return all;
  const bool equal = equal_protocols(motions);
  for (const QuantityComparison& one : each_quantity(recordings)) {
    std::vector<Member> members;
    for (const RecordingComparison& r : recordings) {
      const QuantityComparison* found = same_quantity(r, one);
      if (found == nullptr) continue;
      members.push_back({&r, found, equal ? 1.0 : std::abs(found->simulated)});
    }
    if (members.size() < 2) continue;
    PooledQuantity pooled;
    pooled.name = one.name;
    pooled.unit = one.unit;
    pooled.recordings = static_cast<int>(members.size());
    pooled.relative = !equal;
    if (equal) {
      for (const Member& m : members) {
        pooled.simulated += m.quantity->simulated / static_cast<double>(members.size());
        pooled.measured += m.quantity->measured / static_cast<double>(members.size());
      }
    }
    const bool instrument = one_instrument(members);
    const SharedEffects shared = shared_of(members, instrument);
    std::vector<double> own;
    const std::vector<std::string> probes = common_probes(members);
    for (const Member& m : members) own.push_back(own_of(m, instrument, probes));
    set_mean(pooled, members, shared, own, degrees_of_law);
    set_area(pooled, members, shared.rows, own, options.at);
    judge_pooled(pooled, members, options);
    all.push_back(std::move(pooled));
  }
  return all;
}

}  // namespace tpm::fit
