#include "tpmkit/law_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/text.hpp"
#include "tpm/law/contact_history.hpp"
#include "tpm/law/contact_retreat.hpp"
#include "tpm/law/imposed_depth.hpp"
#include "tpm/law/imposed_load.hpp"
#include "tpm/law/kelvin_chain.hpp"
#include "tpm/law/kept_load_table.hpp"
#include "tpm/law/kept_step.hpp"
#include "tpm/law/relaxation/exponential_sum.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
using namespace law;

namespace {

/// Value of the imposed history inside a piece.
double between(const Knot& from, const Knot& to, double time) {
  const double h = to.time_s - from.time_s;
  return h > 0.0 ? from.value + (to.value - from.value) * ((time - from.time_s) / h) : from.value;
}

/// The smallest step between knots and asked times, and the span of all of them.
struct TimeWindow {
  double shortest_s;
  double longest_s;
};

TimeWindow window_of(const Protocol& protocol, std::span<const double> times_s) {
  std::vector<double> all;
  for (const Knot& k : protocol.knots()) all.push_back(k.time_s);
  for (const double t : times_s) {
    if (std::isfinite(t)) all.push_back(t);
  }
  std::sort(all.begin(), all.end());
  const double span = all.back() - all.front();
  if (!(span > 0.0)) return {1.0, 1.0};
  double shortest = span;
  for (std::size_t i = 1; i < all.size(); ++i) {
    const double gap = all[i] - all[i - 1];
    if (gap > 1e-9 * span) shortest = std::min(shortest, gap);  // else the times are meant equal
  }
  return {shortest, span};
}

/// The rates of a fractional law for a question. Where the depth is curved within a step (a kernel
/// that is no straight line, creep under a load that jumps) the window begins earlier.
ExponentialSum rates_for(const LawSpec& spec, const Protocol& protocol,
                         std::span<const double> times_s) {
  const TimeWindow window = window_of(protocol, times_s);
  double earlier = 1.0;
  if (spec.kernel != Kernel::linear || spec.tension == Tension::relaxing) earlier = 1e-2;
  if (protocol.drive() == Drive::force) earlier = 1e-4;
  return {earlier * window.shortest_s, window.longest_s, kFractionalTolerance};
}

/// Steps a contact by what is imposed on it, a depth or a load.
class Stepper {
 public:
  Stepper(ContactHistory& contact, const Protocol& protocol)
      : contact_(contact), displacement_(protocol.drive() == Drive::displacement) {
    for (const Knot& k : protocol.knots()) time_scale_ = std::max(time_scale_, std::abs(k.time_s));
  }
  void rest_at(double value) {
    displacement_ ? contact_.rest_at_drive(value) : contact_.rest_at_load(value);
  }
  void jump_to(double value) {
    displacement_ ? contact_.jump_to_drive(value) : contact_.jump_to_load(value);
  }
  void move(double from, double to, double h) {
    displacement_ ? contact_.move_drive(from, to, h, time_scale_)
                  : contact_.move_load(from, to, h, time_scale_);
  }

 private:
  ContactHistory& contact_;
  bool displacement_;
  double time_scale_ = 0.0;
};

/// Walks a contact (Stepper or LoadedSurface) through a protocol, stopping at each asked time.
/// @param report called once for each asked time with its index
/// @param passed called after each knot
template <class Contact, class Report, class Passed>
void walk(const Protocol& protocol, std::span<const double> times_s, Contact& contact,
          const Report& report, const Passed& passed) {
  const auto order = rising_order(times_s);
  const auto knots = protocol.knots();
  const auto jump = [&](double value) { contact.jump_to(value); };
  const auto move = [&](double from, double to, double h) {
    if (h > 0.0) contact.move(from, to, h);
  };
  if (protocol.equilibrium_at_start()) {
    contact.rest_at(knots.front().value);
  } else {
    jump(knots.front().value);
  }
  std::size_t next = 0;
  for (std::size_t i = 0; i < knots.size(); ++i) {
    const bool last = i + 1 == knots.size();
    const Knot& to = last ? knots[i] : knots[i + 1];
    Knot at = knots[i];
    while (next < order.size() && (last || times_s[order[next]] < to.time_s)) {
      const double time = times_s[order[next]];
      const Knot there{time, last ? at.value : between(knots[i], to, time)};
      move(at.value, there.value, there.time_s - at.time_s);
      at = there;
      report(order[next]);
      ++next;
    }
    if (last || next == order.size()) break;  // what comes after the last asked time is not needed
    if (to.time_s > knots[i].time_s) {
      move(at.value, to.value, to.time_s - at.time_s);
    } else {
      jump(to.value);
    }
    passed();
  }
}

/// True if a law is the solution of a contact problem only while the contact grows. A contact
/// without relaxation has no history and may shrink and grow.
bool depends_on_growth(const LawSpec& spec) {
  return spec.kernel == Kernel::hertz && (spec.branches > 0 || spec.fractional != Fractional::none);
}

/// True if Ting's solution is built in for the law; of the others nothing is predicted once the
/// contact shrinks.
bool may_shrink(const LawSpec& spec) {
  return spec.fractional == Fractional::none && spec.tension == Tension::none;
}

/// Moments at which the history of the contact is looked at to answer each asked time.
struct Stops {
  std::vector<double> time_s;           ///< the asked time, or when the edge of then was met
  std::vector<ContactEdge> edges;       ///< after the turn, rising in time
  std::vector<std::ptrdiff_t> edge_of;  ///< place in edges of each asked time, or -1
};

Stops stops_for(const LawSpec& spec, const LawAtParameters& law, const Protocol& protocol,
                std::span<const double> times_s, Want want) {
  Stops stops{{times_s.begin(), times_s.end()}, {}, {}};
  stops.edge_of.assign(times_s.size(), -1);
  if (protocol.drive() == Drive::force || !depends_on_growth(spec)) return stops;
  const auto turn = find_turn(protocol, law.contact);
  if (!turn) return stops;
  std::vector<double> later;
  for (const std::size_t i : rising_order(times_s)) {
    if (times_s[i] <= (may_shrink(spec) ? turn->peak_s : turn->noticed_s)) continue;
    stops.edge_of[i] = std::ssize(later);
    later.push_back(times_s[i]);
  }
  if (may_shrink(spec)) {
    stops.edges = contact_edges(law, protocol, *turn, later, want);
  } else {
    stops.edges.resize(later.size(), {.state = ContactEdge::State::unknown, .pull_by = {}});
  }
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    if (stops.edge_of[i] < 0) continue;
    const ContactEdge& edge = stops.edges[static_cast<std::size_t>(stops.edge_of[i])];
    const bool touching = edge.state == ContactEdge::State::touching;
    stops.time_s[i] = touching ? edge.met_s : protocol.start_s();
  }
  return stops;
}

struct Answer {
  double value;
  Slopes slopes;
};

Answer not_predicted(int parameters) {
  constexpr double kUnpredicted = std::numeric_limits<double>::quiet_NaN();
  return {kUnpredicted, Slopes::Constant(parameters, kUnpredicted)};
}

/// The answer of a contact that stands at one of the stops.
/// @param edge null while the contact grows
Answer answer_of(const ContactHistory& contact, const ContactEdge* edge, const LawAtParameters& law,
                 bool displacement, bool want_slopes) {
  const Slopes none;
  if (edge == nullptr && !displacement) {
    return {contact.drive(), want_slopes ? contact.drive_slopes() : none};
  }
  if (edge == nullptr) return {contact.force(), want_slopes ? contact.force_slopes() : none};
  switch (edge->state) {
    case ContactEdge::State::touching:
      return {contact.force_within(*edge), want_slopes ? contact.force_slopes_within(*edge) : none};
    case ContactEdge::State::lost: {
      Slopes offset_alone = Slopes::Zero(law.parameter_count);
      offset_alone[law.place.offset] = 1.0;
      return {law.offset, offset_alone};
    }
    case ContactEdge::State::unknown:
      break;
  }
  return not_predicted(law.parameter_count);
}

/// The general way: any drive, with contact lost and found again.
Response respond_by_steps(const LawSpec& spec, const LawAtParameters& law, const Protocol& protocol,
                          const Stops& stops, Want want) {
  const bool displacement = protocol.drive() == Drive::displacement;
  const bool want_slopes = want == Want::values_and_sensitivity;
  const double peak = displacement ? protocol.peak() - law.contact : law.tension.reference;
  ContactHistory contact(law, peak, want);
  Response response;
  response.value.resize(std::ssize(stops.time_s));
  if (want_slopes) response.sensitivity.resize(response.value.size(), law.parameter_count);
  ShrinkWatch watch(!displacement && depends_on_growth(spec));
  const auto watch_depth = [&] { watch.see(contact.drive() - law.contact); };
  const auto answer = [&](std::size_t i) {
    const auto row = static_cast<Eigen::Index>(i);
    watch_depth();
    const std::ptrdiff_t place = stops.edge_of[i];
    const ContactEdge* edge = place < 0 ? nullptr : &stops.edges[static_cast<std::size_t>(place)];
    const Answer a = watch.shrunk() ? not_predicted(law.parameter_count)
                                    : answer_of(contact, edge, law, displacement, want_slopes);
    response.value[row] = a.value;
    if (want_slopes) response.sensitivity.row(row) = a.slopes.matrix().transpose();
  };
  Stepper stepper(contact, protocol);
  walk(protocol, stops.time_s, stepper, answer, watch_depth);
  return response;
}

/// A load that the kernel alone carries; nothing where the probe leaves the surface, or where an
/// infinite time is asked for.
std::optional<Response> respond_to_load(const LawSpec& spec, const LawAtParameters& law,
                                        const Protocol& protocol, std::span<const double> times_s,
                                        Want want) {
  if (protocol.drive() != Drive::force || !LoadedSurface::answers(law)) return std::nullopt;
  if (!std::all_of(times_s.begin(), times_s.end(), [](double t) { return std::isfinite(t); })) {
    return std::nullopt;
  }
  const bool want_slopes = want == Want::values_and_sensitivity;
  Response response;
  response.value.resize(std::ssize(times_s));
  if (want_slopes) response.sensitivity.resize(response.value.size(), law.parameter_count);
  LoadedSurface surface(law, want);
  ShrinkWatch watch(depends_on_growth(spec));
  bool in_contact = true;
  const auto look = [&] {
    in_contact = in_contact && surface.in_contact();
    watch.see(surface.drive() - law.contact);
  };
  const auto answer = [&](std::size_t i) {
    look();
    const auto row = static_cast<Eigen::Index>(i);
    const Answer a = watch.shrunk()
                         ? not_predicted(law.parameter_count)
                         : Answer{surface.drive(), want_slopes ? surface.drive_slopes() : Slopes()};
    response.value[row] = a.value;
    if (want_slopes) response.sensitivity.row(row) = a.slopes.matrix().transpose();
  };
  walk(protocol, times_s, surface, answer, look);
  if (!in_contact) return std::nullopt;
  return response;
}

/// A depth without jumps that the surface follows all the way, which is what recordings are fitted
/// with; nothing where it is otherwise.
std::optional<Response> respond_quickly(const LawAtParameters& law, const Protocol& protocol,
                                        std::span<const double> times_s, Want want) {
  const auto& rates = law.relaxation.rate_parameter;
  const bool fixed_rates = std::find(rates.begin(), rates.end(), -1) != rates.end();
  if (protocol.drive() != Drive::displacement || fixed_rates) return std::nullopt;
  const auto path = drive_path(protocol, times_s);
  return path ? respond_in_contact(law, *path, want) : std::nullopt;
}

}  // namespace

/// The law in parallel form at given parameters, and how its slopes turn into those of the
/// parameters that were given.
struct LawModel::Prepared {
  LawAtParameters law;
  Eigen::MatrixXd chain_slopes;  ///< d(k_inf, k_i, tau_i)/d(k0, kc_i, T_i); empty if parallel
};

LawModel::LawModel(LawSpec spec) : spec_(spec), name_(law_name(spec)) {
  parameters_ = tpm::law_parameters(spec_);
  descriptions_.reserve(parameters_.size());
  for (const LawParameter& p : parameters_) {
    descriptions_.push_back({p.name, p.dimension, p.meaning});
  }
}

std::size_t LawModel::index(std::string_view parameter) const {
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    if (parameters_[i].name == parameter) return i;
  }
  throw unknown_word(fmt::format("law {}", name_), "no parameter is called", parameter,
                     mapped<std::string>(parameters_, &LawParameter::name));
}

bool LawModel::linear_in(std::size_t parameter) const {
  return parameters_.at(parameter).linear;
}

std::pair<double, double> LawModel::range(std::size_t parameter) const {
  return {parameters_.at(parameter).lower, parameters_.at(parameter).upper};
}

void LawModel::require_in_range(std::span<const double> values) const {
  if (values.size() != parameters_.size()) {
    throw bad_input(fmt::format("law {}", name_), fmt::format("{} parameters given", values.size()),
                    fmt::format("{}", parameters_.size()));
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    const LawParameter& p = parameters_[i];
    const bool time_like = p.dimension == Dimension::time || p.name == "spacing";
    const bool in_series = spec_.form == BranchForm::series && p.dimension != Dimension::time &&
                           i <= static_cast<std::size_t>(spec_.branches);
    const bool above = time_like || in_series ? values[i] > p.lower : values[i] >= p.lower;
    const bool finite = std::isfinite(values[i]) || p.name == "spacing";
    if (above && values[i] <= p.upper && finite) continue;
    const std::string expected =
        std::isfinite(p.upper)
            ? fmt::format("a value from {} to {}", shortest(p.lower), shortest(p.upper))
            : fmt::format("a value {} {}", time_like || in_series ? "above" : "of at least",
                          shortest(p.lower));
    throw bad_input(fmt::format("law {}", name_),
                    fmt::format("{} = {}", p.name, shortest(values[i])), expected);
  }
}

void LawModel::require_no_jump(const Protocol& protocol, double contact) const {
  const auto knots = protocol.knots();
  double before = protocol.equilibrium_at_start() ? knots.front().value : 0.0;
  double time = knots.front().time_s;
  for (const Knot& k : knots) {
    const bool instantaneous = k.time_s == time && &k != knots.data();
    const bool first = &k == knots.data();
    const double depth = std::max(k.value - contact, 0.0);
    if ((instantaneous || first) && depth != std::max(before - contact, 0.0)) {
      throw bad_input(fmt::format("law {}", name_),
                      fmt::format("the drive jumps at {} s, which a spring-pot answers with an "
                                  "infinite force",
                                  shortest(k.time_s)),
                      "a ramp");
    }
    before = k.value;
    time = k.time_s;
  }
}

LawModel::Prepared LawModel::prepare(std::span<const double> values,
                                     const ExponentialSum* rates) const {
  const KernelAtParameters at = kernel_at(spec_, parameters_, values);
  Prepared prepared{{{},
                     at.kernel,
                     TensionShape{spec_.reference, at.spacing},
                     at.k_tension,
                     at.contact,
                     at.offset,
                     at.place,
                     static_cast<int>(parameters_.size())},
                    {}};
  if (spec_.form == BranchForm::series) {
    const auto n = static_cast<std::size_t>(spec_.branches);
    KelvinChain chain;
    chain.k0 = values[0];
    const auto k = values.subspan(1, n);
    const auto times_s = values.subspan(1 + n, n);
    chain.k.assign(k.begin(), k.end());
    chain.T_s.assign(times_s.begin(), times_s.end());
    ParallelWithSlopes parallel = to_parallel_with_slopes(chain);
    std::vector<double> flat{parallel.law.k_inf};
    flat.insert(flat.end(), parallel.law.k.begin(), parallel.law.k.end());
    flat.insert(flat.end(), parallel.law.tau_s.begin(), parallel.law.tau_s.end());
    flat.resize(2 * n + 1);
    prepared.law.relaxation = branch_relaxation(true, spec_.branches, flat);
    prepared.chain_slopes = std::move(parallel.slopes);
  } else if (spec_.fractional != Fractional::none) {
    prepared.law.relaxation = fractional_relaxation(spec_.fractional, values, *rates);
  } else {
    prepared.law.relaxation = branch_relaxation(spec_.solid, spec_.branches, values);
  }
  return prepared;
}

LawAtParameters LawModel::at(std::span<const double> values, const ExponentialSum* rates) const {
  return prepare(values, rates).law;
}

Response LawModel::respond(const Protocol& protocol, std::span<const double> times_s,
                           std::span<const double> parameters, Want want) const {
  require_times_within(protocol, times_s);
  require_in_range(parameters);
  if (const auto table = KeptLoadTable::covering(protocol, times_s)) {
    return table->at_asked(respond(protocol, table->times_s(), parameters, want));
  }
  if (auto stepped = respond_to_step(spec_, parameters_, parameters, protocol, times_s, want)) {
    return *std::move(stepped);
  }
  std::optional<ExponentialSum> rates;
  if (spec_.fractional != Fractional::none) rates = rates_for(spec_, protocol, times_s);
  const Prepared prepared = prepare(parameters, rates ? &*rates : nullptr);
  const LawAtParameters& law = prepared.law;
  const bool displacement = protocol.drive() == Drive::displacement;
  if (displacement && law.relaxation.infinite_under_jump) require_no_jump(protocol, law.contact);
  const bool want_slopes = want == Want::values_and_sensitivity;
  Response response;
  const Stops stops = stops_for(spec_, law, protocol, times_s, want);
  std::optional<Response> in_contact;
  if (stops.edges.empty()) in_contact = respond_quickly(law, protocol, times_s, want);
  if (!in_contact) in_contact = respond_to_load(spec_, law, protocol, times_s, want);
  if (!in_contact) in_contact = respond_to_kept_load(law, protocol, times_s, want);
  response =
      in_contact ? *std::move(in_contact) : respond_by_steps(spec_, law, protocol, stops, want);
  if (want_slopes && prepared.chain_slopes.size() > 0) {
    const Eigen::Index n = prepared.chain_slopes.rows();
    response.sensitivity.leftCols(n) =
        (response.sensitivity.leftCols(n) * prepared.chain_slopes).eval();
  }
  return response;
}

}  // namespace tpm
