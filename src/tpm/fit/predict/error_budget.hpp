#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/select/recording_setup.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"
#include "tpm/show/short_answer.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::fit {

/// Kinds of stages of the chain from a recording to a hand.
enum class BudgetKind {
  data,         ///< what was measured, and the law fitted to it
  tissue,       ///< what stands for the tissue: the organ, its spacing, masses
  computation,  ///< how its equations are solved
  device,       ///< encoder, delay, period
};
[[nodiscard]] std::string_view budget_kind_name(BudgetKind kind) noexcept;

/// The force that one stage answers with at the times of the budget.
struct BudgetStage {
  std::string name;     ///< "law"
  std::string summary;  ///< one line: what is asked and how
  std::string line;     ///< name of the line that leads here from the stage before; first: empty
  BudgetKind kind = BudgetKind::data;
  std::vector<double> force_N;
};

/// Change by one step of the chain.
struct BudgetLine {
  std::string name, from, to;
  BudgetKind kind = BudgetKind::data;
  std::vector<double> difference_N;  ///< signed, of the later stage less the earlier
  double largest = 0.0, rms = 0.0;   ///< of |difference|, in parts of the peak
  double largest_at_s = 0.0;
};

/// The uncertainty of the law's parameters as a scatter of its force.
struct BudgetRandomPart {
  int samples = 0;
  double level = 0.95;
  double largest = 0.0;  ///< half width of the band over time, in parts of the peak
};

/// Uncertainty by a stated instrument of the recording's force: scale, zero and depth.
struct BudgetInstrumentPart {
  std::string id;
  double level = 0.95;
  double largest = 0.0;  ///< half width over time, in parts of the peak
};

/// Sum of the law's line, the parameters' scatter, and the errors of computing.
struct ErrorBudget {
  std::string title;
  std::vector<double> time_s;
  std::vector<BudgetStage> stages;
  std::vector<BudgetLine> lines;
  double peak_N = 0.0;      ///< of the first stage that is a model
  double total = 0.0;       ///< max |sum of the lines| = max |last - first|, in parts of the peak
  double not_closed = 0.0;  ///< max |sum of the lines - (last - first)|: rounding
  std::optional<BudgetRandomPart> random;
  std::optional<BudgetInstrumentPart> instrument;  ///< of a recording that states one
  double combined = 0.0;       ///< total, random part and instrument in quadrature
  double data_part = 0.0;      ///< the line `law` (if there is one), random part and instrument in
                               ///< quadrature
  double computed_part = 0.0;  ///< max |sum| of the lines of computation
  std::vector<Remark> sentences;  ///< the conclusions, in their order
  std::vector<Remark> remarks;
};

/// From this part of the peak on a line counts; smaller ones are named and compared with nothing.
inline constexpr double kLeastLine = 1e-3;

/// Device of the budget: how it feeds the model in the loop, and what reaches the hand.
struct BudgetDevice {
  double period_s = 1e-3;
  double encoder_step_m = 1e-5;
  int delay_periods = 0;
};

struct BudgetOptions {
  BudgetDevice device;
  int samples = 1000;  ///< laws drawn for the random part
  std::uint64_t seed = 0;
  double level = 0.95;
  std::optional<double> contact, zero;  ///< of a recording, held; none: found (PredictionOptions)
};

/// Signed differences between neighbouring stages in their order. They telescope: their sum is the
/// last stage less the first. Throws Error(bad_input) for fewer than two stages or forces of
/// unequal length.
[[nodiscard]] ErrorBudget budget_of(std::vector<double> time_s, std::vector<BudgetStage> stages);

/// One contact, from a law (and the recording it was fitted to, if given) to the hand:
///
///     recording -> law -> loop -> quantised -> delayed -> held
///
/// each stage the one before with one thing changed: the fitted law; the update of a period, with
/// the kernel linear within it; positions in steps of the encoder; forces some periods late; each
/// force kept until the next (its value a period late, at the period's end, the worst instant).
/// @param motion of depth; the surface is at 0
[[nodiscard]] ErrorBudget contact_budget(const LawFile& law, const Protocol& motion,
                                         std::vector<double> times_s, const BudgetOptions& options);
/// Along the ramp and hold of a recording; its contact point and offset are taken off.
[[nodiscard]] ErrorBudget contact_budget(const LawFile& law, const PreparedRecording& recording,
                                         const BudgetOptions& options);

/// An organ, from the law of one contact (if given) to the hand:
///
///     law -> organ -> [scene spacing] -> without masses -> at tolerance -> loop -> encoder ->
///     delayed -> hand
///
/// The organ is the scene's network with masses; with `finer` (the same organ at a finer spacing)
/// it is that one, whose masses are taken to change the force by what they change at the scene's
/// spacing, and a line `spacing` follows. Its bonds follow the spacing law `continuum` from the
/// scene's spacing on; Error(bad_input) for others. Then: masses left out; the tolerance of the
/// scene's runs instead of a hundredth of it; the model that tpm plan picks for the loop, a period
/// at a time.
/// @param tolerance of the plan, as --tolerance
[[nodiscard]] ErrorBudget organ_budget(const std::optional<LawFile>& law,
                                       const ExperimentScene& scene,
                                       const std::optional<ExperimentScene>& finer,
                                       const std::string& tolerance, const BudgetOptions& options);

/// Fills the sums and the sentences of a budget whose lines and random part are there.
void conclude(ErrorBudget& budget);

[[nodiscard]] Json to_json(const ErrorBudget& budget);
[[nodiscard]] std::string to_terminal_text(const ErrorBudget& budget);
[[nodiscard]] ShortAnswer short_answer(const ErrorBudget& budget);
/// time_s, each stage's force and each line's difference, SI.
[[nodiscard]] std::string to_csv(const ErrorBudget& budget);

/// `data_part` of a budget.json: the tolerance below which computing is finer than the data
/// uncertainty. Throws Error(bad_input) for a file that is no budget.
[[nodiscard]] double tolerance_of_data(const Json& budget, std::string_view where);

}  // namespace tpm::fit
