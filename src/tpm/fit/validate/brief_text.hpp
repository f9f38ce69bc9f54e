#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace tpm::fit {

/// An answer on a screen: lines by their importance, of which no more are printed than a reader
/// takes in. What is left out is named in a line of its own.
class BriefText {
 public:
  /// Two less than an answer has: the files written and the next command follow.
  static constexpr std::size_t kMostLines = 23, kWidth = 118;

  /// The least important are left out first, of equals the last.
  enum class Rank { always, quantity, remark, context, recording, detail };

  /// Lines as they are, each by itself; empty ones stay empty.
  void add(const std::string& lines, Rank rank, std::string_view name = {});
  /// Rows below a head of two lines, and an empty line. Where no row is printed, the head is not
  /// either.
  void add_table(const std::string& table, Rank rank, std::string_view rows);
  /// "title          words", wrapped at kWidth. What is printed always takes three lines at most
  /// and ends in "..." there.
  void add_line(std::string_view title, const std::string& words, Rank rank);
  /// Words without a title, wrapped, as what is printed always.
  void add_words(const std::string& words);

  /// At most kMostLines, each ended.
  [[nodiscard]] std::string text() const;

 private:
  struct Item {
    std::string name;  ///< for the line that tells what was left out
    std::string lines;
    Rank rank = Rank::always;
    int table = 0;  ///< that it is a row of, or if `frame` the head or the end of; 0: none
    bool frame = false;
  };
  void keep_frames(std::vector<bool>& kept, std::size_t& lines) const;
  std::vector<Item> items_;
  int tables_ = 0;
};

}  // namespace tpm::fit
