#include "tpm/paper/show/paper_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tpmkit/error.hpp"
#include "tpmkit/frequency_response.hpp"
#include "tpmkit/model.hpp"

namespace tpm::paper {
namespace {

constexpr double kDepth_m = 4e-3;  // Figs. 7 and 10
constexpr double kHold_s = 30.0;
constexpr double kCreep_s = 300.0;
constexpr double kRelaxed = std::numeric_limits<double>::infinity();

std::vector<double> evenly(double from, double to, int intervals) {
  std::vector<double> x;
  for (int i = 0; i <= intervals; ++i) x.push_back(from + (to - from) * i / intervals);
  return x;
}

std::vector<double> evenly_in_log(double from, double to, int intervals) {
  std::vector<double> x = evenly(std::log(from), std::log(to), intervals);
  for (double& v : x) v = std::exp(v);
  return x;
}

std::vector<double> scaled(const Eigen::VectorXd& values, double factor) {
  const Eigen::VectorXd out = values * factor;
  return {out.begin(), out.end()};
}

std::string mm(double metres) {
  return fmt::format("{:.2f} mm", metres * 1e3);
}

Axis time_axis(double to_s) {
  return {"time since first contact", "s", false, 0.0, to_s};
}

Axis force_axis() {
  return {"contact force", "N", false, 0.0};
}

/// Ranges as brackets, each at the place `place` of its datum, values times `factor`.
template <class Place>
Series brackets(std::string label, const std::vector<Datum>& data, double factor, Place place) {
  Series s{.kind = Series::Kind::bracket, .label = std::move(label)};
  for (const Datum& d : data) {
    if (!d.is_band()) continue;
    s.provenance = std::string(provenance_name(d.provenance));
    s.add_range(place(d), *d.lower * factor, *d.upper * factor);
  }
  return s;
}

/// The force of the element through a ramp to 4 mm and 30 s of hold.
Series ramp_response(const TpmParameters& p, double rate_m_per_s, std::string label) {
  const double ramp_s = kDepth_m / rate_m_per_s;
  const Protocol protocol = ramp_and_hold(kDepth_m, rate_m_per_s, kHold_s);
  std::vector<double> times = evenly(0.0, ramp_s, 40);
  // After the ramp the samples crowd where the paper's dashpot relaxes, within milliseconds.
  for (const double t : evenly_in_log(1e-5, kHold_s, 120)) {
    times.push_back(std::min(ramp_s + t, protocol.end_s()));
  }
  const auto force =
      make_model("closed_form")->respond(protocol, times, to_vector(p), Want::values).value;
  return line(std::move(label), times, scaled(force, 1.0));
}

/// The printed peak and end at 4 mm. Their time axis counts from the end of the ramp.
Series printed_relaxation(const PointSet& relaxation, double ramp_s) {
  Series s{.kind = Series::Kind::points,
           .label = "pig liver, peak and 30 s (Table 2)",
           .assumed = "time"};
  for (const Datum& d : relaxation.data) {
    if (!d.value || !d.time_s || !d.depth_m || std::abs(*d.depth_m - kDepth_m) > 1e-9) continue;
    s.provenance = std::string(provenance_name(d.provenance));
    s.add(ramp_s + *d.time_s, *d.value);
  }
  return s;
}

/// Fig. 6: force against depth, 0-8 mm, with the range over three pigs.
Figure static_force_figure(const PaperFigureData& data) {
  const TpmParameters& p = data.paper;
  const std::vector<double> depth_mm = evenly(0.0, 8.0, 160);
  std::vector<double> relaxed;
  std::vector<double> instantaneous;
  for (const double mm : depth_mm) {
    const double e = mm * 1e-3;
    const double lambda1 = lambda1_Pa(p.Eprime_Pa, e, p.spacing_m);
    relaxed.push_back(step_relaxation_force_N(p, lambda1, e, kRelaxed));
    instantaneous.push_back(step_relaxation_force_N(p, lambda1, e, 0.0));
  }
  Panel panel{"", {"indentation depth", "mm", false, 0.0, 8.4}, force_axis()};
  panel.series = {
      line("equilibrium force (t → ∞)", depth_mm, relaxed),
      line("instantaneous force (t = 0+)", depth_mm, instantaneous),
      brackets("range over three pigs (Table 5)", data.static_bands.data, 1.0,
               [](const Datum& d) { return d.depth_m.value_or(0.0) * 1e3; }),
  };
  return {
      "figure_06",
      "Figure 6. Static force against depth",
      "The paper's parameters (12 kPa, x = 30 mm). A slow indentation is compared with the "
      "equilibrium force. Only the four tabulated ranges are data; nothing is known between them.",
      {std::move(panel)}};
}

}  // namespace

Figure relaxation_figure(const PaperFigureData& data) {
  constexpr double kRate = 4e-3;
  const double ramp_s = kDepth_m / kRate;
  const auto panel = [&](std::string title, const TpmParameters& p, std::string label) {
    Panel made{std::move(title), time_axis(ramp_s + kHold_s + 1.0), force_axis()};
    made.y.upper = 0.75;
    made.series = {ramp_response(p, kRate, std::move(label)),
                   printed_relaxation(data.relaxation, ramp_s)};
    return made;
  };
  return {"figure_07",
          "Figure 7. Relaxation at 4 mm, ramp of 4 mm/s, 30 s",
          fmt::format("(a) As the paper states its parameters, τ = {:.3g} ms, so the force has "
                      "relaxed before the ramp ends. (b) Fitted to the relaxation tables "
                      "({}). The paper prints two numbers for this depth; which ramp rate they "
                      "come from is not stated.",
                      data.paper.relaxation_time_s() * 1e3, data.fitted_as),
          {panel("(a) η₁ = 5 Pa s, as stated", data.paper, "stated parameters"),
           panel("(b) fitted", data.fitted, "fitted parameters")}};
}

Figure creep_figure(const PaperFigureData& data, const PrintedCreep& printed) {
  std::vector<Datum> bands;
  std::copy_if(
      data.creep.data.begin(), data.creep.data.end(), std::back_inserter(bands),
      [&](const Datum& d) { return d.load_N && std::abs(*d.load_N - printed.load_N) < 1e-9; });
  const Protocol protocol = creep(printed.load_N, kCreep_s);
  const auto depth_mm = [&](const TensionRule& rule, const std::vector<double>& times) {
    const auto model = make_model("closed_form", {rule});
    return scaled(model->respond(protocol, times, to_vector(data.paper), Want::values).value, 1e3);
  };
  const auto panel = [&](std::string title, Axis x, const std::vector<double>& times, double end) {
    Panel made{std::move(title), std::move(x), {"indentation depth", "mm", false, 0.0}};
    made.y.upper = std::max(8.0, 1.3 * printed.end_depth_m * 1e3);
    Series band = brackets("range over livers", bands, 1e3,
                           [](const Datum& d) { return d.time_s.value_or(kCreep_s); });
    band.assumed = "time";
    Series end_value{.kind = Series::Kind::mark,
                     .label = "Eq. 18 as printed, t → ∞",
                     .provenance = "text",
                     .x = {end},
                     .y = {printed.end_depth_m * 1e3},
                     .text = mm(printed.end_depth_m)};
    made.series = {
        line(fmt::format("Eq. 14, λ₁ = {:.4g} kPa as printed", printed.lambda1_Pa * 1e-3), times,
             depth_mm(TensionRule::frozen(printed.lambda1_Pa), times)),
        line("λ₁(ε) of the depth reached, x = 30 mm", times, depth_mm(TensionRule::exact(), times)),
        std::move(band), std::move(end_value)};
    return made;
  };
  std::vector<double> linear_times{0.0};
  for (const double t : evenly_in_log(1e-5, kCreep_s, 160))
    linear_times.push_back(std::min(t, kCreep_s));
  const std::vector<double> log_times(linear_times.begin() + 1, linear_times.end());
  return {
      fmt::format("figure_{:0>2}", printed.figure),
      fmt::format("Figure {}. Creep under {:.4g} N", printed.figure, printed.load_N),
      printed.figure == data.printed_creep.front().figure
          ? "The paper's parameters, on a linear and a logarithmic axis: the latter shows that "
            "the creep of the stated 5 Pa s is over within milliseconds. The end value of Eq. 18 "
            "counts the instantaneous depth twice. That the range belongs to t = 300 s is "
            "assumed."
          : "As the figure before, under the larger load.",
      {panel("(a) linear time", {"time under load", "s", false, -8.0, 380.0}, linear_times, 352.0),
       panel("(b) logarithmic time", {"time under load", "s", true, 1e-5, 1e5}, log_times, 8e3)}};
}

Figure rates_figure(const PaperFigureData& data) {
  const auto panel = [&](std::string title, const TpmParameters& p) {
    Panel made{std::move(title), time_axis(35.0), force_axis()};
    made.y.upper = 0.75;
    for (const double rate_mm_per_s : {4.0, 2.0, 1.0}) {
      made.series.push_back(
          ramp_response(p, rate_mm_per_s * 1e-3, fmt::format("{} mm/s", rate_mm_per_s)));
    }
    return made;
  };
  return {"figure_10",
          "Figure 10. 4 mm reached at three speeds",
          "The model's own curves; no measurement belongs to them. With the stated 5 Pa s the "
          "three differ only while the probe moves; with a fitted dashpot the peak depends on the "
          "rate of the ramp.",
          {panel("(a) η₁ = 5 Pa s, as stated", data.paper), panel("(b) fitted", data.fitted)}};
}

namespace {

/// A viscosity of elastography: a range, a value with what is printed after its sign, or one value.
Series elastography(const ValueSet& values, std::string_view name, std::string label,
                    double frequency_Hz) {
  const NamedValue& v = values.at(name);
  Series s{.label = std::move(label),
           .provenance = std::string(provenance_name(v.provenance)),
           .assumed = "frequency",
           .x = {frequency_Hz}};
  if (v.value && !v.plus_minus) {
    s.kind = Series::Kind::points;
    s.y = {*v.value};
    return s;
  }
  s.kind = Series::Kind::bracket;
  s.lower = {v.value ? *v.value - *v.plus_minus : v.lower.value_or(0.0)};
  s.upper = {v.value ? *v.value + *v.plus_minus : v.upper.value_or(0.0)};
  return s;
}

}  // namespace

Figure spectrum_figure(const PaperFigureData& data) {
  const std::vector<double> frequency_Hz = evenly_in_log(1e-3, 1e3, 180);
  const Axis x{"frequency", "Hz", true, 1e-3, 1e3};
  Panel moduli{"(a) storage and loss modulus", x, {"modulus", "kPa", true, 1e-6, 100.0}};
  Panel viscosity{"(b) complex viscosity", x, {"viscosity", "Pa s", true, 0.5, 5e6}};
  const auto draw = [&](const TpmParameters& p, const std::string& label) {
    const SpectrumResponse r = element_spectrum(to_vector(p), frequency_Hz, Want::values);
    moduli.series.push_back(line("storage, " + label, frequency_Hz, scaled(r.storage, 1e-3)));
    moduli.series.push_back(line("loss, " + label, frequency_Hz, scaled(r.loss, 1e-3)));
    viscosity.series.push_back(
        line("|η*|, " + label, frequency_Hz, scaled(r.complex_viscosity(frequency_Hz), 1.0)));
  };
  draw(data.paper, "η₁ = 5 Pa s");
  draw(data.fitted, "fitted");
  viscosity.series.push_back(
      elastography(data.literature, "klatt_viscosity", "Klatt [17], η", 25.0));
  viscosity.series.push_back(
      elastography(data.literature, "mohammad_viscosity", "Mohammad [18], η", 35.0));
  viscosity.series.push_back(elastography(data.literature, "asbach_viscosity_as_printed",
                                          "Asbach [19] as cited, η", 50.0));
  viscosity.series.push_back(
      elastography(data.literature, "asbach_viscosity_abstract", "Asbach, own abstract, η", 70.0));
  return {"figure_spectrum",
          "Over frequency: elastography and relaxation",
          fmt::format(
              "The element about its undeformed state, with the paper's 5 Pa s (loss at its peak "
              "near {:.2g} Hz) and fitted to relaxation over 30 s ({}; peak near {:.2g} Hz). The "
              "viscosities that the paper cites are from elastography at tens of Hz; the frequency "
              "of each is assumed, and they are parameters η of the authors' models, not |η*|. "
              "Neither dashpot speaks of the other's frequencies.",
              1.0 / (2.0 * std::numbers::pi * data.paper.relaxation_time_s()), data.fitted_as,
              1.0 / (2.0 * std::numbers::pi * data.fitted.relaxation_time_s())),
          {std::move(moduli), std::move(viscosity)}};
}

std::vector<Figure> paper_figures(const PaperFigureData& data) {
  std::vector<Figure> figures{static_force_figure(data), relaxation_figure(data)};
  for (const PrintedCreep& printed : data.printed_creep) {
    figures.push_back(creep_figure(data, printed));
  }
  figures.push_back(rates_figure(data));
  figures.push_back(spectrum_figure(data));
  return figures;
}

}  // namespace tpm::paper
