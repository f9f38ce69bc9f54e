#include "tpm/fit/online/identified_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr double kRoomBelow = 1.5;  // of the recording's depth: the loop never leaves it

/// The law in the loop, and the one that waits to take its place.
class ReplayedLoop {
 public:
  ReplayedLoop(const Identification& identification, const PreparedRecording& recording,
               const IdentifiedLoopOptions& options)
      : identification_(identification), recording_(recording), options_(options) {
    settings_.period_s = options.period_s;
    settings_.longest_s = recording.recording.time_s.back() - recording.recording.time_s.front();
  }

  /// The tool has been moved to a sample.
  void move_to(std::size_t sample) {
    const Recording& r = recording_.recording;
    const double depth = r.drive[sample] - surface_m_;
    if (!current_ || sample == 0) return;
    const double before = r.drive[sample - 1] - surface_m_;
    const double span = r.time_s[sample] - r.time_s[sample - 1];
    const int steps = std::max(1, static_cast<int>(std::lround(span / options_.period_s)));
    for (int k = 1; k <= steps; ++k) {
      const double along = static_cast<double>(k) / steps;
      step(std::max(before + along * (depth - before), 0.0));
    }
    try_hand_over(r.time_s[sample]);
  }

  /// Takes a sample's law and parameters if they are known better than those in the loop.
  void learn(const IdentifiedSample& known) {
    const double width = known.estimate.widest_relative_half_width();
    if (!(width <= options_.first_width)) return;
    if (!current_) return enter(known, width);
    const bool other = known.law != law_;
    if (!other && !(width <= options_.narrower * width_)) return;
    if (waiting_ && known.law == waiting_law_ && !(width <= options_.narrower * waiting_width_)) {
      return;
    }
    waiting_ = in_loop(known);
    waiting_law_ = known.law;
    waiting_width_ = width;
    LoopHandOver& change = loop_.hand_overs.emplace_back();
    change.asked_s = known.time_s;
    change.from = law_name(current_->file.spec);
    change.to = law_name(waiting_->file.spec);
    change.widest_relative_half_width = width;
  }

  [[nodiscard]] IdentifiedLoop take() { return std::move(loop_); }

 private:
  [[nodiscard]] std::unique_ptr<LawInLoop> in_loop(const IdentifiedSample& known) {
    const double deepest = std::max(recording_.phases.peak_drive - surface_m_, 1e-6);
    settings_.deepest_m = deepest;
    settings_.deepest_valid_m = kRoomBelow * deepest;
    return std::make_unique<LawInLoop>(law_of_sample(identification_, known), settings_);
  }

  /// The first law enters with the motion so far behind it.
  void enter(const IdentifiedSample& known, double width) {
    surface_m_ = known.estimate.values[known.estimate.values.size() - 2];
    current_ = in_loop(known);
    law_ = known.law;
    width_ = width;
    loop_.first_s = known.time_s;
    const Recording& r = recording_.recording;
    std::size_t sample = 0;
    while (sample < r.time_s.size() && r.time_s[sample] <= known.time_s) move_to(sample++);
  }

  void step(double depth) { (void)current_->contact.step(Eigen::Vector3d(0.0, 0.0, depth)); }

  void try_hand_over(double now_s) {
    if (!waiting_) return;
    LoopHandOver& change = loop_.hand_overs.back();
    change.decision = consider_hand_over(*current_, *waiting_);
    if (!change.decision.possible) return;
    hand_over(change.decision, *waiting_);
    change.done_s = now_s;
    current_ = std::move(waiting_);
    law_ = waiting_law_;
    width_ = waiting_width_;
  }

  const Identification& identification_;
  const PreparedRecording& recording_;
  IdentifiedLoopOptions options_;
  LawContactSettings settings_;
  IdentifiedLoop loop_;
  std::unique_ptr<LawInLoop> current_, waiting_;
  std::size_t law_ = 0, waiting_law_ = 0;
  double width_ = 0.0, waiting_width_ = 0.0;
  double surface_m_ = 0.0;
};

}  // namespace

IdentifiedLoop replay_in_loop(const Identification& identification,
                              const PreparedRecording& recording,
                              const IdentifiedLoopOptions& options) {
  const Recording& r = recording.recording;
  if (r.drive_quantity != Quantity::indentation_depth ||
      r.response_quantity != Quantity::contact_force) {
    throw bad_input(fmt::format("recording '{}'", recording.name), "cannot be felt",
                    "a contact force over an indentation depth");
  }
  ReplayedLoop loop(identification, recording, options);
  std::size_t next = 0;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    loop.move_to(i);
    const auto& history = identification.history;
    if (next >= history.size() || history[next].time_s > r.time_s[i]) continue;
    loop.learn(history[next++]);
  }
  return loop.take();
}

namespace {

/// "done"; "waits": the law would store more energy at equal force; "replaced": it waited until a
/// better one was known.
const char* hand_over_state(const IdentifiedLoop& loop, const LoopHandOver& hand_over) {
  if (hand_over.done_s) return "done";
  return &hand_over == &loop.hand_overs.back() ? "waits" : "replaced";
}

}  // namespace

Json to_json(const IdentifiedLoop& loop) {
  Json list = Json::array();
  for (const LoopHandOver& h : loop.hand_overs) {
    list.push_back({{"asked_s", h.asked_s},
                    {"done_s", h.done_s ? Json(*h.done_s) : Json()},
                    {"state", hand_over_state(loop, h)},
                    {"from", h.from},
                    {"to", h.to},
                    {"widest_relative_half_width", h.widest_relative_half_width},
                    {"depth_m", h.decision.depth_m},
                    {"force_N", h.decision.force_N},
                    {"energy_before_J", h.decision.energy_before_J},
                    {"energy_after_J", h.decision.energy_after_J}});
  }
  return {{"first_law_s", loop.first_s ? Json(*loop.first_s) : Json()}, {"hand_overs", list}};
}

std::string loop_words(const IdentifiedLoop& loop) {
  if (!loop.first_s) return "no law was known well enough to enter the loop";
  std::string text =
      fmt::format("the first law entered the loop at {} s", significant(*loop.first_s, 4));
  if (loop.hand_overs.empty()) return text;
  const auto done = [](const LoopHandOver& h) { return h.done_s.has_value(); };
  text += fmt::format("; {} of {} hand-overs done", std::ranges::count_if(loop.hand_overs, done),
                      loop.hand_overs.size());
  const auto latest = std::find_if(loop.hand_overs.rbegin(), loop.hand_overs.rend(), done);
  if (latest != loop.hand_overs.rend()) {
    text +=
        fmt::format(", the last at {} s to {}, {} N on the hand", significant(*latest->done_s, 4),
                    latest->to, significant(latest->decision.force_N, 3));
  }
  if (!loop.hand_overs.back().done_s) {
    text += fmt::format("; {} waits: it would store more energy at equal force",
                        loop.hand_overs.back().to);
  }
  return text;
}

std::string to_terminal_text(const IdentifiedLoop& loop) {
  if (!loop.first_s) return "no law was known well enough to enter the loop\n";
  std::string text =
      fmt::format("the first law entered the loop at {} s\n", significant(*loop.first_s, 4));
  for (std::size_t i = 0; i < loop.hand_overs.size(); ++i) {
    const LoopHandOver& h = loop.hand_overs[i];
    const bool last = i + 1 == loop.hand_overs.size();
    text +=
        fmt::format("{} -> {}, known at {} s to +-{} %: ", h.from, h.to, significant(h.asked_s, 4),
                    significant(100.0 * h.widest_relative_half_width, 3));
    text += h.done_s
                ? fmt::format("handed over at {} s, {} N on the hand, stored energy {} -> {} mJ\n",
                              significant(*h.done_s, 4), significant(h.decision.force_N, 3),
                              significant(1e3 * h.decision.energy_before_J, 4),
                              significant(1e3 * h.decision.energy_after_J, 4))
            : last ? std::string("waits: it would store more energy at equal force\n")
                   : std::string("waited until a better one was known\n");
  }
  return text;
}

}  // namespace tpm::fit
