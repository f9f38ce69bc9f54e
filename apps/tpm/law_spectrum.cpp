#include "law_spectrum.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <vector>

#include "answer.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/rising_values.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/show/result_table.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/frequency_response.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm::app {
namespace {

std::vector<double> frequencies(const SpectrumTexts& texts) {
  constexpr int kMost = 100'000;
  return parse_rising(texts.frequencies,
                      {Dimension::frequency, kMost, "frequencies",
                       "\"0.1 Hz, 1 Hz\", or \"0.001 Hz : 100 Hz : 16\""},
                      "--frequencies");
}

std::optional<double> operating_depth(const SpectrumTexts& texts, const LawSpec& spec) {
  if (texts.depth.empty()) return std::nullopt;
  const bool strip = is_answered_by_stress(spec.drive);
  return option_quantity(texts.depth, strip ? Dimension::dimensionless : Dimension::length,
                         "--depth");
}

struct SpectrumRow {
  double frequency_Hz, storage, loss, viscosity, loss_tangent;
};

std::vector<SpectrumRow> rows_of(const std::vector<double>& frequency_Hz,
                                 const SpectrumResponse& r) {
  const Eigen::VectorXd viscosity = r.complex_viscosity(frequency_Hz);
  const Eigen::VectorXd tangent = r.loss_tangent();
  std::vector<SpectrumRow> rows;
  for (std::size_t i = 0; i < frequency_Hz.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    rows.push_back({frequency_Hz[i], r.storage[k], r.loss[k], viscosity[k], tangent[k]});
  }
  return rows;
}

/// @param strip the law answers with a stress, else with a force
ResultTable<SpectrumRow> spectrum_table(bool strip) {
  using Row = SpectrumRow;
  using Of = ResultColumn<Row>;
  constexpr int kDigits = 10, kShown = 5;
  const std::string per = strip ? "_Pa" : "_N_per_m", unit = strip ? "[Pa]" : "[N/m]";
  return {{Of("frequency_Hz", &Row::frequency_Hz, kDigits).shown("f [Hz]", 12),
           Of("storage" + per, &Row::storage, kDigits).shown("storage " + unit, 14, 1.0, kShown),
           Of("loss" + per, &Row::loss, kDigits).shown("loss " + unit, 14, 1.0, kShown),
           Of(strip ? "complex_viscosity_Pa_s" : "complex_viscosity_N_s_per_m", &Row::viscosity,
              kDigits)
               .shown(strip ? "|eta*| [Pa s]" : "|eta*| [N s/m]", 16, 1.0, kShown),
           Of("", &Row::loss_tangent).shown("tan delta", 10)}};
}

void require_finite(const std::vector<double>& frequency_Hz, const SpectrumResponse& r) {
  for (std::size_t i = 0; i < frequency_Hz.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    if (std::isfinite(r.storage[row]) && std::isfinite(r.loss[row])) continue;
    throw Error(
        ExitCode::numerical, "spectrum",
        fmt::format("storage and loss at {} Hz are not finite numbers", shortest(frequency_Hz[i])),
        "frequencies within the range of the law");
  }
}

}  // namespace

int write_spectrum(const SpectrumTexts& texts, const Session& session) {
  const auto csv = csv_beside(texts.output, session);
  const LawFile law = read_law(texts.law);
  const std::vector<double> frequency_Hz = frequencies(texts);
  const SpectrumResponse r = respond_spectrum(law.spec, law.values, frequency_Hz,
                                              operating_depth(texts, law.spec), Want::values);
  require_finite(frequency_Hz, r);
  const std::vector<SpectrumRow> rows = rows_of(frequency_Hz, r);
  const ResultTable<SpectrumRow> table = spectrum_table(law.spec.response == Quantity::stress);
  Json json{{"law", to_json(law)}};
  json.update(table.lists(rows));
  const std::string next = next_with_law(texts.law, law.spec);
  add_end(json, {}, {}, next);
  deliver(session.json() ? answer_text(session, std::move(json))
                         : fmt::format("{}: {}\n\n{}{}", law_name(law.spec), law_words(law.spec),
                                       table.text(rows), next_line(next)),
          texts.output);
  deliver_csv(table.csv(rows), csv);
  return 0;
}

}  // namespace tpm::app
