#include "tpm/files/import/reading_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/clock_text.hpp"
#include "tpm/files/keys/more_types.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {
namespace {

constexpr auto kSeparators =
    std::to_array<Word<char>>({{',', "comma"}, {';', "semicolon"}, {'\t', "tab"}, {' ', "blank"}});
constexpr auto kDecimals = std::to_array<Word<bool>>({{false, "point"}, {true, "comma"}});
constexpr auto kEncodings = std::to_array<Word<bool>>({{false, "utf-8"}, {true, "latin-1"}});
constexpr auto kTruths = std::to_array<Word<bool>>({{true, "true"}, {false, "false"}});
constexpr std::string_view kFound = "auto";  ///< what the reader finds out itself

double positive_size(const std::string& text, Dimension dimension, std::string_view where) {
  const double value = parse_quantity(text, dimension, where);
  if (value > 0.0) return value;
  throw bad_input(where, fmt::format("'{}'", printable(text)), "a size above 0");
}

int count_from(const std::string& text, int least, std::string_view where) {
  constexpr double kMost = 1e6;
  const double value = parse_number(text, where);
  if (value >= least && value <= kMost && value == std::floor(value)) {
    return static_cast<int>(value);
  }
  throw bad_input(where, fmt::format("'{}' is no such count", printable(text)),
                  fmt::format("a whole number from {}", least));
}

/// "185 s", or a time on the file's clock, "11:09:16.5".
double time_text(const std::string& text, std::string_view where) {
  if (const auto seconds = find_clock_seconds(text)) return *seconds;
  return parse_quantity(text, Dimension::time, where);
}

/// "50 nm/V" as metres per volt.
double sensitivity_text(const std::string& text, std::string_view where) {
  constexpr std::string_view kPerVolt = "/V", kPerMillivolt = "/mV";
  const bool milli = text.ends_with(kPerMillivolt);
  if (!milli && !text.ends_with(kPerVolt)) {
    throw bad_input(where, fmt::format("'{}' is no length per volt", printable(text)),
                    "a quantity such as \"50 nm/V\"");
  }
  const std::size_t unit = milli ? kPerMillivolt.size() : kPerVolt.size();
  const double length = positive_size(text.substr(0, text.size() - unit), Dimension::length, where);
  return milli ? 1e3 * length : length;
}

std::vector<std::string> list_from(const std::string& text) {
  std::vector<std::string> list;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    list.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return list;
}

std::string in_units(double si, double to_si, const char* unit) {
  return fmt::format("{} {}", shortest(si / to_si), unit);
}

template <typename T>
std::string text_or_empty(const std::optional<T>& value, std::string (*text)(const T&)) {
  return value ? text(*value) : std::string();
}

using Text = const std::string&;
using Where = std::string_view;

FormPtr plain_form() {
  return files::text(1).form;
}

FormPtr count_form() {
  return either_form({whole<int>(0, 1e9).form, plain_form()});
}

FormPtr flag_form() {
  return files::flag().form;
}

FormPtr list_of_plain_form() {
  return list_form(plain_form(), 0);
}

template <Dimension dimension>
FormPtr quantity_form() {
  return files::quantity(dimension).form;
}

/// A key, how its text is read, and how it is written; an empty text says nothing.
struct ReadingKey {
  ReadingOption option;
  void (*set)(ImportOptions&, Text, Where);
  std::string (*text)(const ImportOptions&);
  FormPtr (*form)() = plain_form;  ///< in files, unless it is one of the choices
};

constexpr auto kKeys = std::to_array<ReadingKey>({
    {{"encoding",
      "Encoding of the text: auto (UTF-8, UTF-16 with a mark, else latin-1), utf-8 or latin-1",
      "auto,utf-8,latin-1"},
     [](ImportOptions& o, Text t, Where w) {
       if (t == kFound) return;
       o.text.latin1 = parse_word(kEncodings, "encoding", t, w);
       o.text.utf8 = !o.text.latin1;
     },
     [](const ImportOptions& o) {
       return std::string(o.text.latin1 ? "latin-1" : o.text.utf8 ? "utf-8" : "");
     }},
    {{"separator", "Separator of columns: auto, comma, semicolon, tab or blank",
      "auto,comma,semicolon,tab,blank"},
     [](ImportOptions& o, Text t, Where w) {
       if (t != kFound) o.text.separator = parse_word(kSeparators, "separator", t, w);
     },
     [](const ImportOptions& o) {
       return text_or_empty<char>(
           o.text.separator, [](const char& c) { return std::string(word_for(kSeparators, c)); });
     }},
    {{"decimal", "Decimal sign: auto, point or comma", "auto,point,comma"},
     [](ImportOptions& o, Text t, Where w) {
       if (t != kFound) o.text.decimal_comma = parse_word(kDecimals, "decimal sign", t, w);
     },
     [](const ImportOptions& o) {
       return text_or_empty<bool>(o.text.decimal_comma, [](const bool& comma) {
         return std::string(word_for(kDecimals, comma));
       });
     }},
    {{"thousands",
      "Mark between groups of three digits: auto, none, comma, point, apostrophe or space",
      "auto,none,comma,point,apostrophe,space"},
     [](ImportOptions& o, Text t, Where w) {
       if (t != kFound) o.text.thousands = parse_thousands_name(t, w);
     },
     [](const ImportOptions& o) {
       return text_or_empty<ThousandsMark>(o.text.thousands, [](const ThousandsMark& mark) {
         return std::string(thousands_name(mark));
       });
     }},
    {{"header_rows", "Rows above the samples, if not found by themselves"},
     [](ImportOptions& o, Text t, Where w) { o.header_rows = count_from(t, 0, w); },
     [](const ImportOptions& o) {
       return text_or_empty<int>(o.header_rows, [](const int& n) { return std::to_string(n); });
     },
     count_form},
    {{"block", "Which of several blocks of samples in a file, from 1"},
     [](ImportOptions& o, Text t, Where w) { o.block = count_from(t, 1, w); },
     [](const ImportOptions& o) {
       return text_or_empty<int>(o.block, [](const int& n) { return std::to_string(n); });
     },
     count_form},
    {{"time", "Column of the times: name, or number from 1"},
     [](ImportOptions& o, Text t, Where) { o.time_column = t; },
     [](const ImportOptions& o) { return o.time_column; }},
    {{"drive", "Column of what was imposed: depth, strain or relative length"},
     [](ImportOptions& o, Text t, Where) { o.drive_column = t; },
     [](const ImportOptions& o) { return o.drive_column; }},
    {{"response", "Column of what was observed: force or stress"},
     [](ImportOptions& o, Text t, Where) { o.response_column = t; },
     [](const ImportOptions& o) { return o.response_column; }},
    {{"sd", "Column of the response's standard deviation"},
     [](ImportOptions& o, Text t, Where) { o.sd_column = t; },
     [](const ImportOptions& o) { return o.sd_column; }},
    {{"frequency", "Column of the frequency of a spectrum"},
     [](ImportOptions& o, Text t, Where) { o.frequency_column = t; },
     [](const ImportOptions& o) { return o.frequency_column; }},
    {{"storage", "Column of the storage modulus or stiffness of a spectrum"},
     [](ImportOptions& o, Text t, Where) { o.storage_column = t; },
     [](const ImportOptions& o) { return o.storage_column; }},
    {{"loss", "Column of the loss modulus or stiffness of a spectrum"},
     [](ImportOptions& o, Text t, Where) { o.loss_column = t; },
     [](const ImportOptions& o) { return o.loss_column; }},
    {{"drive_quantity",
      "Quantity that was imposed: indentation_depth, strain, relative_length or abscissa"},
     [](ImportOptions& o, Text t, Where w) { o.drive_quantity = parse_quantity_name(t, w); },
     [](const ImportOptions& o) {
       return text_or_empty<Quantity>(
           o.drive_quantity, [](const Quantity& q) { return std::string(quantity_name(q)); });
     }},
    {{"response_quantity",
      "Quantity that was observed: contact_force, stress, relaxation_modulus, creep_compliance or "
      "ordinate"},
     [](ImportOptions& o, Text t, Where w) { o.response_quantity = parse_quantity_name(t, w); },
     [](const ImportOptions& o) {
       return text_or_empty<Quantity>(
           o.response_quantity, [](const Quantity& q) { return std::string(quantity_name(q)); });
     }},
    {{"negate_drive", "The machine counts the imposed motion negative"},
     [](ImportOptions& o, Text t, Where w) { o.negate_drive = parse_word(kTruths, "word", t, w); },
     [](const ImportOptions& o) { return std::string(o.negate_drive ? "true" : ""); },
     flag_form},
    {{"negate_response", "The machine counts the force or stress negative"},
     [](ImportOptions& o, Text t, Where w) {
       o.negate_response = parse_word(kTruths, "word", t, w);
     },
     [](const ImportOptions& o) { return std::string(o.negate_response ? "true" : ""); },
     flag_form},
    {{"step_time",
      "Time of the step on the file's clock, for G(t), J(t) and a strain or stress "
      "that is kept: \"185 s\" or 11:09:16; times count from there"},
     [](ImportOptions& o, Text t, Where w) { o.step_time_s = time_text(t, w); },
     [](const ImportOptions& o) {
       return text_or_empty<double>(o.step_time_s,
                                    [](const double& s) { return in_units(s, 1.0, "s"); });
     }},
    {{"from", "Leave out samples before this time of the file, such as \"2 s\""},
     [](ImportOptions& o, Text t, Where w) { o.from_s = time_text(t, w); },
     [](const ImportOptions& o) {
       return text_or_empty<double>(o.from_s,
                                    [](const double& s) { return in_units(s, 1.0, "s"); });
     }},
    {{"until", "Leave out samples after this time of the file, such as \"30 s\""},
     [](ImportOptions& o, Text t, Where w) { o.until_s = time_text(t, w); },
     [](const ImportOptions& o) {
       return text_or_empty<double>(o.until_s,
                                    [](const double& s) { return in_units(s, 1.0, "s"); });
     }},
    {{"rest_length",
      "Unloaded length of a stretched specimen, for columns of its length or elongation"},
     [](ImportOptions& o, Text t, Where w) {
       o.rest_length_m = positive_size(t, Dimension::length, w);
     },
     [](const ImportOptions& o) {
       return text_or_empty<double>(o.rest_length_m,
                                    [](const double& m) { return in_units(m, 1e-3, "mm"); });
     },
     quantity_form<Dimension::length>},
    {{"area", "Cross section, of that specimen: for a column of its force"},
     [](ImportOptions& o, Text t, Where w) { o.area_m2 = positive_size(t, Dimension::area, w); },
     [](const ImportOptions& o) {
       return text_or_empty<double>(o.area_m2,
                                    [](const double& a) { return in_units(a, 1e-6, "mm^2"); });
     },
     quantity_form<Dimension::area>},
    {{"spring_constant",
      "Spring constant of the cantilever: JPK force files (instead of that of the file), and "
      "tables with the "
      "height of the piezo"},
     [](ImportOptions& o, Text t, Where w) {
       o.spring_constant_N_per_m = positive_size(t, Dimension::stiffness, w);
     },
     [](const ImportOptions& o) {
       return text_or_empty<double>(o.spring_constant_N_per_m,
                                    [](const double& k) { return in_units(k, 1.0, "N/m"); });
     },
     quantity_form<Dimension::stiffness>},
    {{"deflection_sensitivity",
      "Deflection per volt, of tables with a deflection in V or mV, such as \"50 nm/V\""},
     [](ImportOptions& o, Text t, Where w) {
       o.deflection_sensitivity_m_per_V = sensitivity_text(t, w);
     },
     [](const ImportOptions& o) {
       return text_or_empty<double>(o.deflection_sensitivity_m_per_V,
                                    [](const double& s) { return in_units(s, 1e-9, "nm/V"); });
     }},
    {{"segments",
      "Segments to read, of JPK force files: kinds, such as extend,pause; default: all"},
     [](ImportOptions& o, Text t, Where) { o.segments = list_from(t); },
     [](const ImportOptions& o) { return fmt::format("{}", fmt::join(o.segments, ",")); },
     list_of_plain_form},
});

constexpr std::string_view kUnits = "units";

/// The key as a file has it: its sentence is that of the help.
KeyForm key_form(const ReadingKey& key) {
  std::string sentence(key.option.meaning);
  sentence.front() = static_cast<char>(std::tolower(static_cast<unsigned char>(sentence.front())));
  FormPtr form = key.option.choices.empty()
                     ? key.form()
                     : one_of(list_from(std::string(key.option.choices))).form;
  return optional_key(std::string(key.option.key), std::move(form), std::move(sentence));
}

/// Options of a recording without a description, as a file states them.
ImportOptions import_of(const Json& json, const DocumentPlace& place) {
  ImportOptions import;
  for (const auto& [key, value] : json.items()) {
    const DocumentPlace here = place.key(key);
    if (key == kUnits) {
      for (const auto& [column, unit] : value.items()) {
        set_reading_unit(import, column, unit.get<std::string>(), here.key(column).where);
      }
    } else if (value.is_array()) {
      import.segments = value.get<std::vector<std::string>>();
    } else {
      set_reading_option(import, key, value.is_string() ? value.get<std::string>() : value.dump(),
                         here.where);
    }
  }
  return import;
}

Json json_of(const ImportOptions& import) {
  Json json = Json::object();
  for (const ReadingKey& known : kKeys) {
    const std::string text = known.text(import);
    if (text.empty()) continue;
    const Form::Type type = known.form()->type;
    Json& value = json[std::string(known.option.key)];
    if (type == Form::Type::list) {
      value = import.segments;
    } else if (type == Form::Type::flag) {
      value = true;
    } else {
      value = text;
    }
  }
  if (!import.units.empty()) json[std::string(kUnits)] = import.units;
  return json;
}

constexpr auto kOptions = [] {
  std::array<ReadingOption, kKeys.size()> options{};
  for (std::size_t i = 0; i < kKeys.size(); ++i) options[i] = kKeys[i].option;
  return options;
}();

}  // namespace

std::span<const ReadingOption> reading_options() {
  return kOptions;
}

void set_reading_option(ImportOptions& options, std::string_view key, const std::string& text,
                        std::string_view where) {
  for (const ReadingKey& known : kKeys) {
    if (known.option.key == key) return known.set(options, text, where);
  }
  auto keys = mapped<std::string>(kKeys, [](const ReadingKey& k) { return k.option.key; });
  keys.emplace_back(kUnits);
  throw unknown_word(where, "unknown option", key, keys);
}

void set_reading_unit(ImportOptions& options, const std::string& column, const std::string& unit,
                      std::string_view where) {
  const bool volts = unit == "V" || unit == "mV";  // of a deflection: no quantity of the project
  if (!volts) static_cast<void>(parse_unit(unit, where));
  options.units[column] = unit;
}

std::vector<std::pair<std::string, std::string>> reading_texts(const ImportOptions& options) {
  std::vector<std::pair<std::string, std::string>> texts;
  for (const ReadingKey& known : kKeys) {
    std::string text = known.text(options);
    if (!text.empty()) texts.emplace_back(known.option.key, std::move(text));
  }
  return texts;
}

ValueType<ImportOptions> reading_type() {
  std::vector<KeyForm> keys = mapped<KeyForm>(kKeys, key_form);
  keys.push_back(
      optional_key(std::string(kUnits), map_form(plain_form()), "of columns, by their names"));
  return {object_form("", "", std::move(keys)), import_of, json_of};
}

bool says_how_to_read(const ImportOptions& options) {
  return !reading_texts(options).empty() || !options.units.empty();
}

}  // namespace tpm::files
