// Declared in tpm/fit/select/selection.hpp.
#include <fmt/format.h>

#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/fit/select/selection.hpp"

namespace tpm::fit {
namespace {

Json held_out_json(const Candidate& c) {
  return array_json(c.held_out, [](const HeldOut& h) {
    return Json{{"what", h.what},
                {"rms_SI", rounded(h.rms)},
                {"rms_over_peak", rounded(h.rms_over_peak)},
                {"rms_over_sd", rounded(h.rms_standardised)},
                {"rms_if_fitted_SI", rounded(h.rms_if_fitted)}};
  });
}

Json candidate_json(const Candidate& c) {
  Json j{{"law", law_name(c.law)}, {"summary", law_words(c.law)}, {"failed", c.failed}};
  if (c.failed) {
    j["reason"] = c.reason;
    return j;
  }
  j["parameters_estimated"] = c.parameters - 1;
  j["rms_over_peak"] = rounded(c.rms_over_peak);
  j["delta_bic"] = rounded(c.delta_bic);
  j["delta_aicc"] = rounded(c.delta_aicc);
  j["identified"] = c.identified;
  j["reason"] = c.reason;
  if (!c.special.empty()) j["special_case"] = c.special;
  j["held_out"] = held_out_json(c);
  return j;
}

std::string held_out_text(const Candidate& c) {
  std::string text;
  for (const HeldOut& h : c.held_out) {
    text += fmt::format("{:>9}  ", significant(100.0 * h.rms_over_peak, 3) + " %");
  }
  return text;
}

}  // namespace

Json to_json(const Selection& s) {
  Json j{{"recommended", law_name(s.candidates[s.recommended].law)},
         {"lowest_bic", law_name(s.candidates[s.best_bic].law)},
         {"margin_bic", s.margin},
         {"samples", s.samples},
         {"effective_readings", rounded(s.effective_count)}};
  if (s.drift) {
    j["drift_or_slow_branch"] = {
        {"separable", false},
        {"k_inf_without_drift_SI", rounded(s.drift->k_inf)},
        {"k_inf_with_drift_SI", or_null(s.drift->drifting)},
        {"drift_SI_per_s", array_json(s.drift->drift_per_s, [](double v) { return rounded(v); })}};
  }
  Json laws = array_json(s.candidates, candidate_json);
  j["laws"] = std::move(laws);
  if (const auto& adequacy = s.candidates[s.recommended].fit.adequacy) {
    j["adequacy"] = files::to_json(*adequacy);
  }
  j["summary"] = s.summary;
  j["remarks"] = remarks_json(s.remarks);
  j["fit"] = to_json(s.candidates[s.recommended].fit);
  if (s.preferred) {
    const Candidate& best = s.candidates[*s.preferred];
    j["preferred"] = {{"law", law_name(best.law)},
                      {"ahead_in_bic", rounded(s.candidates[s.recommended].delta_bic)},
                      {"not_identified_because", best.reason},
                      {"fit", to_json(best.fit)}};
  }
  return j;
}

std::string to_terminal_text(const Selection& s) {
  std::string text = fmt::format("{:<26} {:>6} {:>9} {:>9} {:>9}  {}\n", "law", "param.",
                                 "rms/peak", "dBIC", "dAICc", "held-out rms/peak; note");
  for (std::size_t i = 0; i < s.candidates.size(); ++i) {
    const Candidate& c = s.candidates[i];
    const char* mark = i == s.recommended ? "*" : " ";
    if (c.failed) {
      text += fmt::format("{}{:<25} failed: {}\n", mark, law_name(c.law), c.reason);
      continue;
    }
    text += fmt::format("{}{:<25} {:>6} {:>9} {:>9} {:>9}{}  {}\n", mark, law_name(c.law),
                        c.parameters - 1, significant(100.0 * c.rms_over_peak, 3) + " %",
                        fixed(c.delta_bic, 1), fixed(c.delta_aicc, 1), held_out_text(c),
                        c.reason.empty() ? c.special : c.reason);
  }
  text += "\n";
  for (const std::string& line : s.summary) text += fmt::format("{}\n", line);
  if (s.preferred) {
    const Candidate& best = s.candidates[*s.preferred];
    text += fmt::format("\nof the law that the data prefer, {} ({}):\n", law_name(best.law),
                        law_words(best.law));
    for (const ParameterResult& p : best.fit.parameters) text += fmt::format("- {}\n", p.summary);
    text += "\n";
  }
  for (const Remark& remark : s.remarks) text += fmt::format("! {}\n", remark.text);
  return text;
}

}  // namespace tpm::fit
