#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <string_view>

#include "tpmkit/error.hpp"

namespace tpm::files {

/// Limits of a contained process.
struct ContainedLimits {
  /// True: the child writes the file with data of ours, without limits but `cpu_s`, which is then
  /// that of each request. Its end is a fault of the system (Error(environment)), not of the file.
  bool writes = false;
  std::uint64_t memory_bytes = std::uint64_t{256} << 20U;  ///< beyond that of the parent
  std::uint64_t answer_bytes = std::uint64_t{1} << 20U;    ///< of one answer
  double cpu_s = 5.0;                                      ///< until the first answer
  double cpu_s_per_megabyte = 0.1;                         ///< more for what it answers
};

/// A child process that answers requests about one open file, for code that cannot be trusted: HDF5
/// crashes, loops and takes gigabytes on crafted bytes, and crashes if it writes while memory is
/// short. What the child does wrong ends the child and becomes an Error in the parent.
///
/// The child is a copy of this process that keeps nothing open but the file and the way to its
/// parent. It cannot open files. If it reads, it cannot write either, and it has its limits of
/// memory and processor time. It ends with its parent.
class Contained {
 public:
  /// Answers a request with bytes; runs in the child. An Error that it throws is thrown in the
  /// parent by ask(). Must not use threads.
  using Answer = std::function<std::string(std::string_view request)>;
  /// Makes the Answer, in the child. `descriptor` is the file.
  using Start = std::function<Answer(int descriptor)>;

  /// @param where of the errors
  /// Throws Error(environment) if no process can be started.
  Contained(std::string where, int descriptor, const ContainedLimits& limits, const Start& start);
  ~Contained();
  Contained(const Contained&) = delete;
  Contained& operator=(const Contained&) = delete;

  /// Throws the Error of the Answer, or one that says how the child ended, also on every later
  /// call: Error(bad_input) of a child that reads, Error(environment) of one that writes. Throws
  /// std::bad_alloc if a child that writes got no memory.
  [[nodiscard]] std::string ask(std::string_view request);

  /// Takes an answer.
  using Taker = std::function<void(std::string_view answer)>;
  /// Sends a request and does not wait for the child: the answer is taken, or its Error thrown, by
  /// a later call of this or of ask(). Answers are taken in the order of their requests; some 64
  /// may be due. Throws as ask.
  void tell(std::string_view request, Taker taker = {});

 private:
  void take_answers();
  [[nodiscard]] std::string next_answer();
  [[noreturn]] void report_end();

  std::string where_;
  bool writes_;
  std::uint64_t most_bytes_;
  int socket_ = -1;
  int child_ = -1;
  std::string end_;        ///< the end of the child; empty: it lives
  std::deque<Taker> due_;  ///< of the answers that are due
};

}  // namespace tpm::files
