#pragma once
#include <chrono>
#include <cstddef>
#include <string>

namespace tpm::work {

/// One line of progress on standard error, rewritten in place, with an estimate of the time that is
/// left once some seconds have passed; silent unless standard error is a
/// terminal, so that pipes and logs stay clean. While one is shown, any other is silent: the fits
/// of a study do not overwrite the line of the study.
class Progress {
 public:
  /// @param what a short phrase ("profiling", "coverage")
  /// @param total number of steps; 0 if not known
  /// @param already steps of the total that were done before: they say nothing about the time left
  Progress(std::string what, std::size_t total, std::size_t already = 0);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(std::size_t steps = 1);
  /// False: nobody sees it, and what only serves it can be left out.
  [[nodiscard]] bool is_shown() const { return shown_; }

 private:
  void draw() const;
  [[nodiscard]] std::string time_left() const;
  std::string what_;
  std::size_t total_;
  std::size_t done_ = 0;
  std::size_t already_ = 0;
  std::chrono::steady_clock::time_point start_;
  bool shown_;
};

}  // namespace tpm::work
