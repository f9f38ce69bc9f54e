#include "made_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "tpm/files/file.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::test {
using namespace files;

namespace {

struct UnitChoice {
  const char* symbol;
  double to_si;
};

struct Titles {
  const char* time;
  const char* depth;
  const char* force;
  const char* strain;
  const char* stress;
  const char* command;  ///< of the drive
  const char* limit;    ///< of the response
};

constexpr auto kTitles = std::to_array<Titles>({
    {"Time", "Displacement", "Force", "Strain", "Stress", "Displacement command", "Max. force"},
    {"Elapsed time", "Extension", "Load", "Shear strain", "Shear stress", "Target extension",
     "Peak load"},
    {"t", "Depth", "F", "gamma", "tau", "Depth set point", "Force limit"},
    {"Zeit", "Weg", "Kraft", "Scherung", "Schubspannung", "Sollweg", "Maximalkraft"},
    {"Pr\xC3\xBC"
     "fzeit",
     "Verformung", "Standardkraft", "Stauchung", "Spannung", "Verformung Sollwert", "Kraftgrenze"},
    {"Temps", "D\xC3\xA9placement", "Force",
     "D\xC3\xA9"
     "formation",
     "Contrainte", "Consigne de d\xC3\xA9placement", "Force maximale"},
    {"Tiempo", "Desplazamiento", "Fuerza", "Deformaci\xC3\xB3n", "Esfuerzo",
     "Consigna de desplazamiento", "Fuerza m\xC3\xA1xima"},
    {"Tempo", "Spostamento", "Forza", "Deformazione", "Sforzo", "Spostamento obiettivo",
     "Forza massima"},
});

constexpr auto kTimeUnits = std::to_array<UnitChoice>({{"s", 1.0}, {"ms", 1e-3}, {"min", 60.0}});
constexpr auto kDepthUnits =
    std::to_array<UnitChoice>({{"mm", 1e-3}, {"\xC2\xB5m", 1e-6}, {"um", 1e-6}, {"in", 0.0254}});
constexpr auto kForceUnits =
    std::to_array<UnitChoice>({{"N", 1.0}, {"mN", 1e-3}, {"uN", 1e-6}, {"lbf", 4.4482216152605}});
constexpr auto kStrainUnits = std::to_array<UnitChoice>({{"%", 1e-2}});
constexpr auto kStressUnits =
    std::to_array<UnitChoice>({{"Pa", 1.0}, {"kPa", 1e3}, {"psi", 6894.757293168361}});

/// A column on its way into the file.
struct MadeColumn {
  std::string title;
  UnitChoice unit{"", 1.0};
  std::vector<double> values;  ///< in the unit, rounded as printed
  int decimals = 3;
  bool clock = false;
};

class TableMaker {
 public:
  explicit TableMaker(std::uint32_t seed) : random_(seed) {}

  MadeTable make() {
    choose();
    make_samples();
    add_distractors();
    arrange();
    write();
    encode();
    return std::move(table_);
  }

 private:
  std::size_t pick(std::size_t of) { return random_() % of; }
  template <typename List>
  auto one_of(const List& list) {
    return list[pick(list.size())];
  }
  bool chance(std::size_t one_in) { return pick(one_in) == 0; }
  void note(const std::string& words) {
    table_.recipe += (table_.recipe.empty() ? "" : ", ") + words;
  }

  void choose() {
    separator_ = one_of(std::array{',', ';', '\t', ' '});
    decimal_comma_ = chance(2);
    quotes_ = pick(3);  // none, texts, everything
    // Commas twice need quotes around every number; without them the file says too little.
    thousands_ =
        chance(2) ? "" : one_of(std::array{decimal_comma_ ? "." : ",", "'", " ", "\xC2\xA0"});
    shortest_ = chance(3);
    titles_ = &kTitles[pick(kTitles.size())];
    kind_ = pick(4);  // depth, depth, strain, step
    note(fmt::format("separator '{}', decimal {}, thousands '{}', quotes {}, {}", separator_,
                     decimal_comma_ ? "comma" : "point", thousands_, quotes_,
                     shortest_ ? "shortest" : "fixed"));
  }

  double rounded_to(double value, int decimals) const {
    const double scale = std::pow(10.0, decimals);
    return std::round(value * scale) / scale;
  }

  void make_samples() {
    constexpr int kRows = 61;
    const bool step = kind_ == 3;
    const bool strain = kind_ >= 2;
    MadeColumn time, drive, answer;
    time.unit = one_of(kTimeUnits);
    if (strain) {
      drive.unit = one_of(kStrainUnits);
      answer.unit = one_of(kStressUnits);
    } else {
      drive.unit = one_of(kDepthUnits);
      answer.unit = one_of(kForceUnits);
    }
    time.title = titles_->time;
    drive.title = strain ? titles_->strain : titles_->depth;
    answer.title = strain ? titles_->stress : titles_->force;
    table_.late_clock = step && chance(2);
    const double late_s = table_.late_clock ? 185.0 : !step && chance(4) ? 1200.0 : 0.0;
    time.clock = chance(8);
    if (time.clock) time.unit = {"", 1.0};
    constexpr double kStep_s = 0.5;
    for (int i = 0; i < kRows; ++i) {
      const double t = kStep_s * (i + (step ? 1 : 0));
      const double ramp = std::min(t / 5.0, 1.0);
      const double faded = std::exp(-std::max(t - 5.0, 0.0) / 4.0);
      const double noise = 1e-3 * (static_cast<double>(pick(2001)) / 1000.0 - 1.0);
      const double d_SI = strain ? (step ? 0.02 : 0.15 * ramp) : 4e-3 * ramp;
      const double r = step ? 0.4 + 0.6 * std::exp(-t / 4.0) : ramp * (0.6 + 0.4 * faded);
      const double r_SI = (r + noise) * (strain ? 3000.0 : 0.35);
      time.values.push_back((t + late_s) / time.unit.to_si);
      drive.values.push_back(d_SI / drive.unit.to_si);
      answer.values.push_back(r_SI / answer.unit.to_si);
    }
    for (MadeColumn* column : {&time, &drive, &answer}) settle_digits(*column);
    table_.time_s = in_si(time);
    table_.drive_SI = in_si(drive);
    table_.response_SI = in_si(answer);
    note(fmt::format("{} [{}], {} [{}], {} [{}]{}", time.title,
                     time.clock ? "clock" : time.unit.symbol, drive.title, drive.unit.symbol,
                     answer.title, answer.unit.symbol, table_.late_clock ? ", late clock" : ""));
    columns_ = {time, drive, answer};
  }

  /// Between three and five digits of the largest number, so that marks of thousands show.
  void settle_digits(MadeColumn& column) {
    double largest = 0.0;
    for (const double v : column.values) largest = std::max(largest, std::abs(v));
    const int before = static_cast<int>(std::floor(std::log10(std::max(largest, 1e-9)))) + 1;
    column.decimals = std::clamp(5 - before, 0, 9);
    if (column.title == titles_->time) column.decimals = std::max(column.decimals, 2);
    if (column.unit.symbol == std::string("min")) column.decimals = 6;
    for (double& v : column.values) v = rounded_to(v, column.decimals) + 0.0;
  }

  static std::vector<double> in_si(const MadeColumn& column) {
    std::vector<double> si;
    for (const double v : column.values) si.push_back(v * column.unit.to_si);
    return si;
  }

  void add_distractors() {
    const MadeColumn& drive = columns_[1];
    const MadeColumn& answer = columns_[2];
    const bool plain = kind_ < 2;
    if (chance(3) && plain) {
      MadeColumn command = drive;
      command.title = titles_->command;
      for (double& v : command.values) v = rounded_to(1.1 * v, command.decimals);
      others_.push_back(command);
      note("a command");
    }
    if (chance(4) && plain) {
      MadeColumn limit = answer;
      limit.title = titles_->limit;
      const double most = *std::max_element(answer.values.begin(), answer.values.end());
      std::fill(limit.values.begin(), limit.values.end(), most);
      others_.push_back(limit);
      note("a limit");
    }
    if (chance(4)) {
      MadeColumn temperature;
      temperature.title = one_of(std::array{"T", "Temperature", "Load cell temperature"});
      temperature.unit = {
          "\xC2\xB0"
          "C",
          1.0};
      temperature.decimals = 1;
      for (std::size_t i = 0; i < drive.values.size(); ++i) {
        temperature.values.push_back(rounded_to(23.0 + 0.1 * static_cast<double>(i % 7), 1));
      }
      others_.push_back(temperature);
      note("a temperature");
    }
  }

  void arrange() {
    for (MadeColumn& other : others_) columns_.push_back(std::move(other));
    // Fisher and Yates, so that the order is the same with every library.
    for (std::size_t i = columns_.size(); i-- > 1;) std::swap(columns_[i], columns_[pick(i + 1)]);
  }

  [[nodiscard]] std::string number(const MadeColumn& column, double value) const {
    if (column.clock) {
      const auto tenths = static_cast<long>(std::lround(value * 100.0));
      return fmt::format("{}:{:02}:{:02}{}{:02}", tenths / 360000, tenths / 6000 % 60,
                         tenths / 100 % 60, decimal_comma_ ? ',' : '.', tenths % 100);
    }
    std::string text = shortest_ ? fmt::format("{:.{}f}", value, column.decimals)
                                 : fmt::format("{:.{}f}", value, column.decimals);
    if (shortest_ && text.find('.') != std::string::npos) {
      while (text.back() == '0') text.pop_back();
      if (text.back() == '.') text.pop_back();
    }
    if (text == "-0") text = "0";
    const auto point = std::min(text.find('.'), text.size());
    std::string whole = text.substr(0, point);
    const std::string rest = text.substr(point);
    const std::size_t sign = whole.starts_with('-') ? 1 : 0;
    for (std::size_t at = whole.size(); at > sign + 3;) {
      at -= 3;
      whole.insert(at, thousands_);
    }
    if (rest.empty()) return whole;
    return whole + (decimal_comma_ ? "," : ".") + rest.substr(1);
  }

  [[nodiscard]] std::string field(const std::string& text, bool is_number) const {
    if (quotes_ == 2 || (quotes_ == 1 && !is_number)) return "\"" + text + "\"";
    return text;
  }

  void add_row(const std::vector<std::string>& cells, bool numbers) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (i > 0) text_ += separator_;
      text_ += field(cells[i], numbers);
    }
    text_ += line_end_;
  }

  std::string titled(const MadeColumn& column, std::size_t style) {
    const std::string unit = column.unit.symbol;
    if (unit.empty()) return column.title;
    switch (style) {
      case 0:
        return fmt::format("{} [{}]", column.title, unit);
      case 1:
        return fmt::format("{} ({})", column.title, unit);
      case 2:
        return fmt::format("{} / {}", column.title, unit);
      case 3:
        return fmt::format("{}_{}", column.title, unit);
      case 4:
        return fmt::format("{} {}", column.title, unit);
      default:
        return column.title;
    }
  }

  void write_preamble() {
    const std::size_t kind = pick(7);
    note(fmt::format("preamble {}", kind));
    const auto pair = [&](const std::string& key, const std::string& value) {
      text_ += field(key, false) + separator_ + field(value, false) + line_end_;
    };
    if (kind == 1) {
      pair("Operator", "A. B.");
      pair("Probe", "7");
      pair("Software", decimal_comma_ ? "5.1" : "5,1");
    } else if (kind == 2) {
      for (int i = 0; i < 150; ++i) pair(fmt::format("Setting {}", i), fmt::format("{}", 3 * i));
    } else if (kind == 3) {
      text_ += "# made for a test" + line_end_;
    } else if (kind == 4) {
      // A table of results.
      add_row({"Specimen", "Maximum", "Modulus"}, false);
      for (int i = 1; i <= 4; ++i) {
        add_row({fmt::format("{}", i), fmt::format("{}", 10 + i), fmt::format("{}", 20 + 3 * i)},
                true);
      }
      text_ += line_end_;
    } else if (kind == 5) {
      pair("Room temperature", decimal_comma_ ? "23.5" : "23,5");
    }
  }

  void write() {
    line_end_ = one_of(std::array<std::string, 3>{"\n", "\r\n", "\r"});
    write_preamble();
    const std::size_t style = pick(7);
    note(fmt::format("titles {}", style));
    std::vector<std::string> titles, units;
    for (const MadeColumn& column : columns_) {
      titles.push_back(titled(column, style));
      units.push_back(column.unit.symbol[0] == '\0' ? "-" : column.unit.symbol);
    }
    const bool commented = style < 5 && chance(8);
    if (commented) {
      text_ += "# ";
      note("titles in a comment");
    }
    add_row(titles, false);
    if (style == 5) add_row(units, false);
    if (style == 6) {
      for (std::string& unit : units) unit = "(" + unit + ")";
      add_row(units, false);
    }
    for (std::size_t i = 0; i < columns_.front().values.size(); ++i) {
      std::vector<std::string> cells;
      for (const MadeColumn& column : columns_) cells.push_back(number(column, column.values[i]));
      add_row(cells, true);
    }
    write_tail();
  }

  void write_tail() {
    const std::size_t kind = pick(6);
    if (kind == 1) text_ += "<END DATA>" + line_end_;
    if (kind == 2) {
      std::vector<std::string> cells{"Maximum"};
      for (std::size_t i = 1; i < columns_.size(); ++i) {
        cells.push_back(number(columns_[i], columns_[i].values.back()));
      }
      add_row(cells, false);
    }
    if (kind == 3) text_ += line_end_ + line_end_;
    note(fmt::format("tail {}", kind));
  }

  void encode() {
    const std::size_t kind = pick(6);
    note(fmt::format("encoding {}", kind));
    std::string& bytes = table_.bytes;
    if (kind == 1) bytes = "\xEF\xBB\xBF";
    if (kind <= 2) {
      bytes += text_;
      return;
    }
    std::string wide = kind == 3 ? "\xFF\xFE" : kind == 4 ? "\xFE\xFF" : "";
    for (std::size_t i = 0; i < text_.size(); ++i) {
      auto c = static_cast<unsigned char>(text_[i]);
      if (c >= 0xC0) {  // two bytes of UTF-8: nothing longer is written
        c = static_cast<unsigned char>(((c & 0x03U) << 6U) |
                                       (static_cast<unsigned char>(text_[++i]) & 0x3FU));
      }
      if (kind == 4) wide += '\0';
      wide += static_cast<char>(c);
      if (kind == 3) wide += '\0';
    }
    bytes = wide;
  }

  std::mt19937 random_;
  MadeTable table_;
  char separator_ = ',';
  bool decimal_comma_ = false, shortest_ = false;
  std::size_t quotes_ = 0, kind_ = 0;
  std::string thousands_, line_end_, text_;
  const Titles* titles_ = nullptr;
  std::vector<MadeColumn> columns_, others_;
};

/// Empty if both agree within rounding.
std::string difference(const char* what, const std::vector<double>& found,
                       const std::vector<double>& expected) {
  if (found.size() != expected.size()) {
    return fmt::format("{} {}s, not {}", found.size(), what, expected.size());
  }
  double size = 0.0;
  for (const double value : expected) size = std::max(size, std::abs(value));
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (std::abs(found[i] - expected[i]) <= 1e-9 * size) continue;
    return fmt::format("{} {} is {}, not {}", what, i, found[i], expected[i]);
  }
  return {};
}

}  // namespace

MadeTable made_table(std::uint32_t seed) {
  return TableMaker(seed).make();
}

ReadingResult read_made_table(const MadeTable& table, const std::string& path, std::string& said) {
  write_file(path, table.bytes);
  try {
    const Recording r = read_recording_file(path).recording;
    std::vector<double> expected = table.response_SI;
    const bool step = is_step_response(r.response_quantity);
    if (step) {
      for (std::size_t i = 0; i < expected.size(); ++i) expected[i] /= table.drive_SI[i];
    }
    said = difference("time", r.time_s, table.time_s);
    if (said.empty()) said = difference("response", r.response, expected);
    if (said.empty() && !step) said = difference("drive", r.drive, table.drive_SI);
    if (said.empty() && table.late_clock) said = "the clock started before the step";
  } catch (const Error& error) {
    said = error.what();
    return ReadingResult::refused;
  }
  return said.empty() ? ReadingResult::right : ReadingResult::wrong;
}

}  // namespace tpm::test
