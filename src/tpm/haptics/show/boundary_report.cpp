#include "tpm/haptics/show/boundary_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/show/result_table.hpp"

namespace tpm::haptics {
namespace {

const Axis kRate{"rate", "Hz", true};

constexpr auto kRuleWords =
    std::to_array<Word<ElementRule>>({{ElementRule::exact, "TPM, exact update"},
                                      {ElementRule::forward_euler, "TPM, forward Euler"},
                                      {ElementRule::mass_spring, "MSM"}});

Json points_json(const std::vector<BoundaryPoint>& points, const char* measured,
                 const char* predicted) {
  return array_json(points, [&](const BoundaryPoint& p) {
    return Json{{"rate_Hz", rounded(p.rate_Hz)},
                {"delay_s", rounded(p.delay_periods / p.rate_Hz)},
                {"damping_N_s_per_m", rounded(p.damping_N_s_per_m)},
                {measured, or_null(p.measured)},
                {predicted, or_null(p.predicted)}};
  });
}

double worst_difference(const std::vector<BoundaryPoint>& points) {
  double worst = 0.0;
  for (const BoundaryPoint& p : points) {
    if (p.predicted > 0.0) worst = std::max(worst, std::abs(p.measured / p.predicted - 1.0));
  }
  return worst;
}

std::string value(double v) {
  return std::isfinite(v) ? significant(v, 4) : "diverges";
}

Series measured_beside(const Series& predicted) {
  return {.kind = Series::Kind::points,
          .label = predicted.label + ", on the simulated device",
          .provenance = "simulated"};
}

/// One curve and its measured points, over the rate, for one delay.
void add_rate_curve(Panel& panel, const std::vector<BoundaryPoint>& points, int delay,
                    double damping) {
  Series predicted = line(delay == 0 ? "no delay" : fmt::format("delay {} periods", delay), {}, {});
  Series measured = measured_beside(predicted);
  for (const BoundaryPoint& p : points) {
    if (p.delay_periods != delay || p.damping_N_s_per_m != damping) continue;
    predicted.add(p.rate_Hz, p.predicted);
    measured.add(p.rate_Hz, p.measured);
  }
  panel.series.push_back(std::move(predicted));
  panel.series.push_back(std::move(measured));
}

Series colgate_line(const std::vector<BoundaryPoint>& points, double damping) {
  Series s = line("Colgate-Schenkel 2b/T, all taut", {}, {});
  for (const BoundaryPoint& p : points) {
    if (p.delay_periods != 0 || p.damping_N_s_per_m != damping) continue;
    s.add(p.rate_Hz, 2.0 * damping * p.rate_Hz);
  }
  return s;
}

Figure boundary_figure(const BoundaryStudy& study) {
  const double damping = study.plant.damping_N_s_per_m;
  const Axis stiffness{"largest instantaneous stiffness", "N/m", true};
  Panel passive{fmt::format("passive, device with {} N s/m", significant(damping, 3)), kRate,
                stiffness};
  Panel stable{"stable with the arm of one operator", kRate, stiffness};
  for (const int delay : {0, 1, 2, 5}) {
    add_rate_curve(passive, study.passive, delay, damping);
    add_rate_curve(stable, study.stable, delay, damping);
  }
  passive.series.push_back(colgate_line(study.passive, damping));
  return {
      "boundaries",
      "Passivity and stability of the contact (simulated device)",
      "Lines: passivity by the condition of Colgate and Schenkel with the discrete transfer "
      "function of the exactly updated Zener contact, stability by the spectral radius of the "
      "loop. Points: measured on the simulated device by bisection. Passivity is safe with every "
      "passive operator and found at the worst frequency; stability belongs to one operator, and "
      "asks for less.",
      {std::move(passive), std::move(stable)}};
}

Figure rule_figure(const BoundaryStudy& study) {
  Panel panel{"friction that the device needs at 1 kHz",
              {"relaxation time over period", "", true},
              {"friction over T/2", "N/m", true}};
  constexpr double kHalfPeriod_s = 0.5e-3, kPeriod_s = 1e-3;
  for (const auto& [rule, words] : kRuleWords) {
    Series predicted = line(std::string(words), {}, {});
    Series measured = measured_beside(predicted);
    for (const RulePoint& p : study.rules) {
      if (p.rule != rule || !std::isfinite(p.measured_N_s_per_m)) continue;
      predicted.add(p.relaxation_time_s / kPeriod_s, p.predicted_N_s_per_m / kHalfPeriod_s);
      measured.add(p.relaxation_time_s / kPeriod_s, p.measured_N_s_per_m / kHalfPeriod_s);
    }
    panel.series.push_back(std::move(predicted));
    panel.series.push_back(std::move(measured));
  }
  return {
      "rules",
      "Three ways to advance the contact (simulated device)",
      fmt::format(
          "A contact of {0} N/m instantaneously and {1} N/m at equilibrium. The exact update needs "
          "between {1} T/2 "
          "and "
          "{0} T/2 at every relaxation time; forward Euler diverges below T/2, to the left of "
          "where "
          "its "
          "curve ends, at the paper's parameters (0.208 ms) too; the mass-spring model has nothing "
          "that "
          "relaxes.",
          significant(study.stiffness_N_per_m, 3), significant(0.5 * study.stiffness_N_per_m, 3)),
      {std::move(panel)}};
}

}  // namespace

namespace {

Json impacts_json(const BoundaryStudy& study) {
  return array_json(study.impacts, [&](const ImpactPoint& p) {
    Json json{{"delay_periods", p.delay_periods},
              {"speed_m_per_s", p.speed_m_per_s},
              {"share_of_linear_boundary", p.share},
              {"stiffness_N_per_m", rounded(p.stiffness_N_per_m)}};
    Json by_limit = Json::object();
    for (const RiseLimit limit : kRiseLimits) {
      const auto which = static_cast<std::size_t>(limit);
      by_limit[std::string(to_string(limit))] = {
          {"comes_to_rest", p.rests[which]},
          {"delivered_to_hand_J", rounded(p.delivered_J[which])}};
    }
    json["by_limit_of_rise"] = std::move(by_limit);
    return json;
  });
}

const ResultTable<DeviceCorner>& corner_table() {
  using Row = DeviceCorner;
  using Of = ResultColumn<Row>;
  const auto passive = [](const Row& c) {
    return c.assumed_friction_N_s_per_m
               ? Json(c.assumed_friction_N_s_per_m->first > c.needed_N_s_per_m)
               : Json(nullptr);
  };
  const auto verdict = [=](const Row& c) {
    if (!c.assumed_friction_N_s_per_m) return Cell{"none: its friction is not known"};
    const auto& [least, most] = *c.assumed_friction_N_s_per_m;
    return Cell{fmt::format("{} (friction assumed to be {} to {})",
                            passive(c).get<bool>() ? "passive" : "not passive",
                            significant(least, 3), significant(most, 3))};
  };
  static const ResultTable<Row> table(
      {Of("device", &Row::device).shown("device", -10),
       Of("stiffness_N_per_m", &Row::stiffness_N_per_m, 0).shown("N/m", 7),
       Of("damping_N_s_per_m", &Row::damping_N_s_per_m, 0).shown("N s/m", 7),
       Of("friction_needed_N_s_per_m", &Row::needed_N_s_per_m, 0).shown("needed", 9),
       Of("friction_needed_with_a_period_of_delay_N_s_per_m", &Row::needed_delayed_N_s_per_m, 0)
           .shown("needed, 1 late", 15),
       {"assumed_friction_N_s_per_m", &Row::assumed_friction_N_s_per_m},
       Of("passive", passive).shown("verdict").in_words(verdict)});
  return table;
}

/// A letter for each limit of the rise: the tool comes to rest, or it does not.
std::string impact_text(const BoundaryStudy& study) {
  std::string text =
      "\na hand runs into the contact and stays 4 mm deep, at 1 kHz: r comes to rest (0.1 mm "
      "within 5 s), O goes on to "
      "oscillate;\nfirst letter without a limit of the rise, second with the slip of a session "
      "(400 "
      "N/s, 8 N), third with ramp-in besides;\nstiffness over that of the boundary of the linear, "
      "two-sided loop\n";
  int delay = -1;
  double share = -1.0;
  for (const ImpactPoint& p : study.impacts) {
    if (p.delay_periods != delay) {
      delay = p.delay_periods;
      share = -1.0;
      text += fmt::format("delay {} periods, boundary {} N/m\n{:>9}", delay,
                          significant(p.stiffness_N_per_m / p.share, 4), "m/s");
      double last = 0.0;
      for (const ImpactPoint& other : study.impacts) {
        if (other.speed_m_per_s <= last) break;
        last = other.speed_m_per_s;
        text += fmt::format("{:>6}", significant(last, 3));
      }
      text += "\n";
    }
    if (p.share != share) {
      share = p.share;
      text += fmt::format("{:>9}", significant(share, 3));
    }
    std::string cell;
    for (const bool rests : p.rests) cell += rests ? 'r' : 'O';
    text += fmt::format("{:>6}", cell);
    if (&p == &study.impacts.back() || (&p)[1].share != share || (&p)[1].delay_periods != delay) {
      text += "\n";
    }
  }
  return text;
}

/// Up to which share of the linear boundary every impact comes to rest, whatever limits its rise.
std::string rest_sentence(const BoundaryStudy& study) {
  double restless = std::numeric_limits<double>::infinity(), all_rest = 0.0;
  const auto rests = [](const ImpactPoint& p) {
    return std::ranges::all_of(p.rests, std::identity{});
  };
  for (const ImpactPoint& p : study.impacts) {
    if (!rests(p)) restless = std::min(restless, p.share);
  }
  for (const ImpactPoint& p : study.impacts) {
    if (p.share < restless) all_rest = std::max(all_rest, p.share);
  }
  return fmt::format("impacts: up to {} of the stable stiffness every hand comes to rest{}",
                     significant(all_rest, 3),
                     std::isfinite(restless) ? fmt::format("; from {} on some go on to oscillate",
                                                           significant(restless, 3))
                                             : "");
}

std::string corner_text(const BoundaryStudy& study) {
  return "\nfriction that a device needs to be passive at 1 kHz with all of its maker's stiffness "
         "and "
         "damping (software limits of CHAI3D), N s/m\n" +
         corner_table().text(study.corners);
}

/// Where impacts come to rest with the slip of a session, a panel for each delay.
Figure impact_figure(const BoundaryStudy& study) {
  Figure figure{
      "impacts", "Impacts with the slip of a session (simulated device)",
      "A hand runs into the one-sided contact and stays 4 mm deep; stiffness over that at which "
      "the linear, two-sided loop becomes unstable. The rise of the force is limited to 400 N/s "
      "by a slip of the model's tool, its size to 8 N."};
  for (const ImpactPoint& p : study.impacts) {
    const std::string title = fmt::format("delay {} periods", p.delay_periods);
    if (figure.panels.empty() || figure.panels.back().title != title) {
      Panel panel{title,
                  {"speed of the hand", "m/s", true},
                  {"stiffness over the linear boundary", "", true}};
      for (const char* label : {"comes to rest", "oscillates"}) {
        Series series{.kind = Series::Kind::points, .label = label, .provenance = "simulated"};
        panel.series.push_back(std::move(series));
      }
      figure.panels.push_back(std::move(panel));
    }
    Series& series = figure.panels.back().series[p.rests[1] ? 0 : 1];
    series.add(p.speed_m_per_s, p.share);
  }
  for (Panel& panel : figure.panels) {
    std::erase_if(panel.series, [](const Series& series) { return series.x.empty(); });
  }
  return figure;
}

}  // namespace

Json boundary_json(const BoundaryStudy& study) {
  const Json rules = array_json(study.rules, [](const RulePoint& p) {
    return Json{{"rule", word_for(kRuleWords, p.rule)},
                {"relaxation_time_s", rounded(p.relaxation_time_s)},
                {"measured_N_s_per_m", or_null(p.measured_N_s_per_m)},
                {"predicted_N_s_per_m", or_null(p.predicted_N_s_per_m)}};
  });
  return {{"simulated_device", true},
          {"assumptions", remarks_json(assumptions_of(study.plant))},
          {"relaxation_time_s", rounded(study.relaxation_time_s)},
          {"stiffness_N_per_m", rounded(study.stiffness_N_per_m)},
          {"passive", points_json(study.passive, "measured_N_per_m", "predicted_N_per_m")},
          {"stable", points_json(study.stable, "measured_N_per_m", "predicted_N_per_m")},
          {"rules", rules},
          {"shortest_forward_euler", points_json(study.shortest, "measured_s", "predicted_s")},
          {"shortest_exact", points_json(study.shortest_exact, "measured_s", "predicted_s")},
          {"impacts", impacts_json(study)},
          {"device_corners", corner_table().list(study.corners)},
          {"worst_passive", rounded(worst_difference(study.passive))},
          {"worst_stable", rounded(worst_difference(study.stable))}};
}

std::string boundary_text(const BoundaryStudy& study) {
  std::string text = fmt::format(
      "SIMULATED DEVICE\nlargest instantaneous stiffness, N/m, half of it at equilibrium, "
      "relaxation time {} "
      "ms\n"
      "{:>7} {:>6} {:>9} {:>22} {:>22}\n",
      significant(1e3 * study.relaxation_time_s, 3), "Hz", "delay", "b N s/m",
      "passive: measured/theory", "stable: measured/theory");
  for (const BoundaryPoint& p : study.passive) {
    std::string stable;
    for (const BoundaryPoint& s : study.stable) {
      if (s.rate_Hz == p.rate_Hz && s.delay_periods == p.delay_periods &&
          s.damping_N_s_per_m == p.damping_N_s_per_m) {
        stable = value(s.measured) + " / " + value(s.predicted);
      }
    }
    text += fmt::format("{:>7} {:>6} {:>9} {:>22} {:>22}\n", significant(p.rate_Hz, 4),
                        p.delay_periods, significant(p.damping_N_s_per_m, 3),
                        value(p.measured) + " / " + value(p.predicted), stable);
  }
  text += fmt::format(
      "worst difference: passivity {} %, stability {} %\nfriction needed at 1 kHz for {} N/m at "
      "once, N s/m (measured/theory)\n",
      significant(100.0 * worst_difference(study.passive), 3),
      significant(100.0 * worst_difference(study.stable), 3),
      significant(study.stiffness_N_per_m, 3));
  for (const RulePoint& p : study.rules) {
    text += fmt::format("{:>7} ms  {:<20} {} / {}\n", significant(1e3 * p.relaxation_time_s, 3),
                        word_for(kRuleWords, p.rule), value(p.measured_N_s_per_m),
                        value(p.predicted_N_s_per_m));
  }
  for (std::size_t i = 0; i < study.shortest.size(); ++i) {
    const BoundaryPoint& euler = study.shortest[i];
    text += fmt::format(
        "{:>7} Hz: shortest passive relaxation time: forward Euler {} / {} ms, exact update {}\n",
        significant(euler.rate_Hz, 4), value(1e3 * euler.measured), value(1e3 * euler.predicted),
        study.shortest_exact[i].measured == 0.0 ? "any" : value(study.shortest_exact[i].measured));
  }
  return text + impact_text(study) + corner_text(study);
}

ShortAnswer short_answer(const BoundaryStudy& study) {
  constexpr double kShownRate_Hz = 1000.0;
  const double friction = study.plant.damping_N_s_per_m;
  ShortAnswer answer;
  answer.conclusion = {
      "SIMULATED DEVICE: largest instantaneous stiffness of a contact, found by bisection",
      fmt::format("theory holds: measured boundaries of passivity within {} %, of stability within "
                  "{} %",
                  significant(100.0 * worst_difference(study.passive), 3),
                  significant(100.0 * worst_difference(study.stable), 3))};
  answer.head = {fmt::format("at {} Hz with {} N s/m of friction, relaxation time {} ms:",
                             significant(kShownRate_Hz, 4), significant(friction, 3),
                             significant(1e3 * study.relaxation_time_s, 3)),
                 fmt::format("{:>6} {:>13} {:>13}", "delay", "passive", "stable")};
  for (const BoundaryPoint& p : study.passive) {
    if (p.rate_Hz != kShownRate_Hz || p.damping_N_s_per_m != friction) continue;
    const auto stable = std::ranges::find_if(study.stable, [&](const BoundaryPoint& s) {
      return s.rate_Hz == p.rate_Hz && s.delay_periods == p.delay_periods;
    });
    const auto words = [](double v) {
      return std::isfinite(v) ? sized_text(Dimension::stiffness, v, 4) : value(v);
    };
    answer.rows.push_back(fmt::format(
        "{:>6} {:>13} {:>13}", significant(1e3 * p.delay_periods / p.rate_Hz, 3) + " ms",
        words(p.measured), stable == study.stable.end() ? "-" : words(stable->measured)));
  }
  answer.limits.push_back(rest_sentence(study));
  for (std::size_t i = 0; i < study.shortest.size(); ++i) {
    const BoundaryPoint& euler = study.shortest[i];
    if (euler.rate_Hz != kShownRate_Hz) continue;
    const double exact = study.shortest_exact[i].measured;
    answer.limits.push_back(fmt::format(
        "forward Euler is passive at relaxation times above {} ms, the exact update at {}",
        value(1e3 * euler.measured), exact == 0.0 ? "all" : value(1e3 * exact) + " ms and more"));
  }
  for (const DeviceCorner& corner : study.corners) {
    if (!corner.assumed_friction_N_s_per_m) continue;
    answer.warnings.push_back(fmt::format(
        "{} at its maker's largest stiffness and damping needs {} N s/m of friction to be passive; "
        "it has {} to {} (assumed)",
        corner.device, significant(corner.needed_N_s_per_m, 3),
        significant(corner.assumed_friction_N_s_per_m->first, 3),
        significant(corner.assumed_friction_N_s_per_m->second, 3)));
  }
  return answer;
}

std::vector<Figure> boundary_figures(const BoundaryStudy& study) {
  return {boundary_figure(study), rule_figure(study), impact_figure(study)};
}

}  // namespace tpm::haptics
