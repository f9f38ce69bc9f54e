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
#include "tpm/show/table_document.hpp"
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

std::string text_of(const LawFile& law, const std::vector<double>& frequency_Hz,
                    const SpectrumResponse& r) {
  const bool strip = law.spec.response == Quantity::stress;
  const std::string unit = strip ? "Pa" : "N/m";
  std::string text = fmt::format("{}: {}\n\n{:>12} {:>14} {:>14} {:>16} {:>10}\n",
                                 law_name(law.spec), law_words(law.spec), "f [Hz]",
                                 fmt::format("storage [{}]", unit), fmt::format("loss [{}]", unit),
                                 strip ? "|eta*| [Pa s]" : "|eta*| [N s/m]", "tan delta");
  const Eigen::VectorXd viscosity = r.complex_viscosity(frequency_Hz);
  const Eigen::VectorXd tangent = r.loss_tangent();
  for (std::size_t i = 0; i < frequency_Hz.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    text += fmt::format("{:>12} {:>14} {:>14} {:>16} {:>10}\n", significant(frequency_Hz[i], 4),
                        significant(r.storage[row], 5), significant(r.loss[row], 5),
                        significant(viscosity[row], 5), significant(tangent[row], 4));
  }
  return text;
}

Json json_of(const LawFile& law, const std::vector<double>& frequency_Hz,
             const SpectrumResponse& r) {
  constexpr int kDigits = 10;
  const bool strip = law.spec.response == Quantity::stress;
  const auto list = [&](const auto& values) {
    return array_json(values, [](double v) { return rounded(v, kDigits); });
  };
  Json json{{"law", to_json(law)}, {"frequency_Hz", list(frequency_Hz)}};
  json[strip ? "storage_Pa" : "storage_N_per_m"] = list(r.storage);
  json[strip ? "loss_Pa" : "loss_N_per_m"] = list(r.loss);
  json[strip ? "complex_viscosity_Pa_s" : "complex_viscosity_N_s_per_m"] =
      list(r.complex_viscosity(frequency_Hz));
  return json;
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

std::string csv_of(const LawFile& law, const std::vector<double>& frequency_Hz,
                   const SpectrumResponse& r) {
  constexpr int kDigits = 10;
  const bool strip = law.spec.response == Quantity::stress;
  std::string text = csv_line({"frequency_Hz", strip ? "storage_Pa" : "storage_N_per_m",
                               strip ? "loss_Pa" : "loss_N_per_m",
                               strip ? "complex_viscosity_Pa_s" : "complex_viscosity_N_s_per_m"});
  const Eigen::VectorXd viscosity = r.complex_viscosity(frequency_Hz);
  for (std::size_t i = 0; i < frequency_Hz.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    text += csv_line({significant(frequency_Hz[i], kDigits), significant(r.storage[row], kDigits),
                      significant(r.loss[row], kDigits), significant(viscosity[row], kDigits)});
  }
  return text;
}

}  // namespace

int write_spectrum(const SpectrumTexts& texts, const Session& session) {
  const auto csv = csv_beside(texts.output, session);
  const LawFile law = read_law(texts.law);
  const std::vector<double> frequency_Hz = frequencies(texts);
  const SpectrumResponse r = respond_spectrum(law.spec, law.values, frequency_Hz,
                                              operating_depth(texts, law.spec), Want::values);
  require_finite(frequency_Hz, r);
  deliver(session.json() ? answer_text(session, json_of(law, frequency_Hz, r))
                         : text_of(law, frequency_Hz, r),
          texts.output);
  deliver_csv(csv_of(law, frequency_Hz, r), csv);
  return 0;
}

}  // namespace tpm::app
