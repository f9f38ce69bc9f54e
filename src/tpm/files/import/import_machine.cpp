#include "tpm/files/import/import_machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <iterator>
#include <tuple>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/clock_text.hpp"
#include "tpm/files/import/cantilever.hpp"
#include "tpm/files/import/column_choice.hpp"
#include "tpm/files/import/contact.hpp"
#include "tpm/files/import/machine_columns.hpp"
#include "tpm/files/import/step_clock.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

using Use = ColumnUse;

/// Builds the series column by column and says which column became what.
class SeriesReader {
 public:
  SeriesReader(const DelimitedTable& table, const MachineHeader& header,
               const std::vector<Use>& uses, const std::string& file)
      : table_(table), header_(header), file_(file), end_(header.block.end) {
    leave_out_blank_rows(uses);
    rows_.reserve(end_ - header.block.first);
    for (std::size_t i = header.block.first; i < end_; ++i) {
      require_width(table.rows[i], uses);
      rows_.push_back(i);
    }
    leave_out_missing_readings(uses);
    series_.lines.reserve(rows_.size());
    for (const std::size_t i : rows_) series_.lines.push_back(table.rows[i].line);
  }

  void add(const Use& use) {
    const MachineColumn& column = *use.column;
    const Bound bound = use.bound;
    const bool negate = use.negate;
    // A relative length counts the other way from 1: a slack length stays above 0.
    const bool mirror = negate && use.quantity == Quantity::relative_length &&
                        dimension_of(use) == Dimension::dimensionless;
    const double turned = mirror ? 2.0 : 0.0;
    ImportedColumn imported;
    imported.quantity = use.quantity;
    imported.bound = bound;
    imported.unit = unit_of_use(use);
    imported.values.reserve(series_.lines.size());
    for (const std::size_t i : rows_) {
      const double value = number_at(table_.rows[i], use);
      imported.values.push_back(negate ? turned - value : value);  // 0, not -0
    }
    if (use.clock) unwrap_midnights(imported.values);
    require_plausible_number(use, imported);
    series_.findings.push_back(
        ImportFinding::told_of(bound == Bound::sd ? "standard deviation" : finding_name(use),
                               fmt::format("{}, {}{}", column.label(),
                                           use.volts                      ? column.unit
                                           : use.clock                    ? "a clock, in s"
                                           : imported.unit.symbol.empty() ? "plain number"
                                                                          : imported.unit.symbol,
                                           mirror   ? ", mirrored about 1"
                                           : negate ? ", negated"
                                                    : "")));
    used_.push_back(column.index);
    series_.columns.push_back(std::move(imported));
  }

  [[nodiscard]] ImportedSeries take() {
    if (!missing_.empty()) {
      series_.findings.push_back(ImportFinding::told_of("missing", std::move(missing_)));
    }
    std::string unused;
    for (const MachineColumn& column : header_.columns) {
      if (std::find(used_.begin(), used_.end(), column.index) != used_.end()) continue;
      unused += fmt::format("{}{}", unused.empty() ? "" : ", ", column.label());
    }
    if (!unused.empty()) series_.findings.push_back({"not used", printable(unused, 200)});
    for (const MachineColumn& column : header_.columns) {
      if (!column.refused) continue;
      if (std::find(used_.begin(), used_.end(), column.index) != used_.end()) continue;
      series_.findings.push_back(ImportFinding::told_of(
          "no meaning", fmt::format("{}: {}", column.label(), column.refused->why)));
    }
    series_.findings.insert(series_.findings.end(), header_.findings.begin(),
                            header_.findings.end());
    return std::move(series_);
  }

 private:
  /// A specimen that is shorter than the one beside it leaves its cells blank.
  void leave_out_blank_rows(const std::vector<Use>& uses) {
    const std::size_t all = end_;
    const auto blank = [&](const DelimitedRow& row) {
      return std::all_of(uses.begin(), uses.end(), [&row](const Use& use) {
        return use.column->index < row.fields.size() && row.fields[use.column->index].empty();
      });
    };
    while (end_ > header_.block.first + 1 && blank(table_.rows[end_ - 1])) --end_;
    if (end_ == all) return;
    series_.findings.push_back(ImportFinding::told_of(
        "blank", fmt::format("{} in these columns", lines_of(table_, end_, all))));
  }

  static constexpr std::size_t kFewestForASlowerColumn = 20;

  /// A column that was logged at a lower rate: enough complete rows, equally many rows apart.
  static bool is_slower_column(const std::vector<std::size_t>& complete) {
    constexpr std::size_t kTimes = 2;
    if (complete.size() < kFewestForASlowerColumn) return false;
    std::size_t least = complete[1] - complete[0], most = least;
    for (std::size_t i = 2; i < complete.size(); ++i) {
      least = std::min(least, complete[i] - complete[i - 1]);
      most = std::max(most, complete[i] - complete[i - 1]);
    }
    return most <= kTimes * least;
  }

  /// A sample that was lost is an empty cell, "NaN", "null" or "---". Where most rows have one, the
  /// column is none, unless it was logged at a lower rate.
  void leave_out_missing_readings(const std::vector<Use>& uses) {
    const auto missing = [&](std::size_t i) {
      return std::ranges::any_of(uses, [&](const Use& use) {
        std::string field(field_at(table_.rows[i], use.column->index));
        std::ranges::transform(field, field.begin(),
                               [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        static constexpr auto kNone = std::to_array<std::string_view>(
            {"", "nan", "-nan", "na", "n/a", "#n/a", "null", "none"});
        return std::ranges::find(kNone, field) != kNone.end() ||
               field.find_first_not_of('-') == std::string::npos;  // "---"
      });
    };
    const auto first = std::ranges::find_if(rows_, missing);
    const auto count = static_cast<std::size_t>(std::ranges::count_if(rows_, missing));
    if (count == 0) return;
    const DelimitedRow& row = table_.rows[*first];
    const auto lost = std::ranges::find_if(uses, [&](const Use& use) {
      const std::string_view field = field_at(row, use.column->index);
      return use.clock ? field.empty() : !find_styled_number(field, header_.style);
    });
    if (2 * count >= rows_.size()) {
      std::vector<std::size_t> complete;
      std::ranges::copy_if(rows_, std::back_inserter(complete),
                           [&](auto i) { return !missing(i); });
      if (count < kFewestForASlowerColumn) return;  // whoever reads the cells refuses them
      if (!is_slower_column(complete)) {
        throw bad_input(
            lost == uses.end() ? fmt::format("{}:{}", file_, row.line)
                               : fmt::format("{}:{}: {}", file_, row.line, lost->column->label()),
            fmt::format("empty where a number belongs, as {} of {} rows are", count, rows_.size()),
            "a number in each column of each row: columns that were logged in turn, interpolated "
            "to the times of one of them");
      }
    }
    missing_ = fmt::format("{} of {} rows have an empty cell or NaN, from line {} on{}: left out",
                           count, rows_.size(), row.line,
                           lost == uses.end() ? "" : fmt::format(" ({})", lost->column->label()));
    std::erase_if(rows_, missing);
  }

  void require_width(const DelimitedRow& row, const std::vector<Use>& uses) const {
    const std::size_t width = header_.block.width;
    const bool longer =
        row.fields.size() > width &&
        std::any_of(row.fields.begin() + static_cast<std::ptrdiff_t>(width), row.fields.end(),
                    [](std::string_view field) { return !field.empty(); });
    const bool shorter = std::any_of(uses.begin(), uses.end(), [&row](const Use& use) {
      return use.column->index >= row.fields.size();
    });
    if (!longer && !shorter) return;
    throw bad_input(fmt::format("{}:{}", file_, row.line),
                    fmt::format("{} fields in this row", row.fields.size()),
                    fmt::format("{} as in the first row of samples", width));
  }

  [[nodiscard]] double number_at(const DelimitedRow& row, const Use& use) const {
    const std::string_view field = field_at(row, use.column->index);
    if (const auto number = find_styled_number(field, header_.style)) return *number;
    const std::string where = fmt::format("{}:{}: {}", file_, row.line, use.column->label());
    if (!use.clock) return parse_styled_number(field, header_.style, where);
    if (const auto seconds = find_clock_seconds(field)) return *seconds;
    throw bad_input(where, fmt::format("'{}'", printable(field)),
                    "a time such as 11:09:16.5 (h:mm:ss), or m:ss.s");
  }

  [[nodiscard]] Unit unit_of_use(const Use& use) const {
    if (use.volts) return {"V", Dimension::length, use.column->unit == "mV" ? 1e-3 : 1.0};
    if (use.clock) return parse_unit("s", Dimension::time, file_);
    return unit_of(*use.column, dimension_of(use), file_);
  }

  /// A strain of 2000 % is hardly one: a plain number that large is more likely percent.
  void require_plausible_number(const Use& use, const ImportedColumn& imported) const {
    constexpr double kImplausible = 20.0;
    const bool relative =
        use.quantity == Quantity::strain || use.quantity == Quantity::relative_length;
    const bool plain = imported.unit.dimension == Dimension::dimensionless &&
                       imported.unit.to_si == 1.0 && !use.column->unit_is_chosen;
    if (!relative || !plain) return;
    const auto large = std::find_if(imported.values.begin(), imported.values.end(),
                                    [](double v) { return std::abs(v) >= kImplausible; });
    if (large == imported.values.end()) return;
    throw bad_input(fmt::format("{}: {}", file_, use.column->label()),
                    fmt::format("reaches {} and has no unit", shortest(*large)),
                    unit_option(*use.column, Dimension::dimensionless));
  }

  const DelimitedTable& table_;
  const MachineHeader& header_;
  const std::string& file_;
  std::size_t end_;                ///< row behind the last sample
  std::vector<std::size_t> rows_;  ///< that are read
  std::string missing_;            ///< which rows are left out; empty: none
  ImportedSeries series_;
  std::vector<std::size_t> used_;
};

/// The columns of a spectrum, nothing if the file holds something else: a frequency alone may be
/// that of the sampling, and a column that is named as time, drive or response says what is meant.
std::vector<Use> spectrum_uses(const ColumnChoice& choice, const std::string& file,
                               const ImportOptions& options) {
  const bool chosen = !options.frequency_column.empty() || !options.storage_column.empty() ||
                      !options.loss_column.empty();
  const bool recording = !options.time_column.empty() || !options.drive_column.empty() ||
                         !options.response_column.empty();
  if (recording && !chosen) return {};
  const MachineColumn* frequency =
      choice.find(ColumnRole::frequency, options.frequency_column, "--frequency");
  const MachineColumn* storage =
      choice.find(ColumnRole::storage, options.storage_column, "--storage");
  const MachineColumn* loss = choice.find(ColumnRole::loss, options.loss_column, "--loss");
  const MachineColumn* magnitude =
      chosen ? nullptr : choice.by_title(ColumnRole::magnitude, "--storage");
  const MachineColumn* angle = chosen ? nullptr : choice.by_title(ColumnRole::phase, "--storage");
  const MachineColumn* tangent =
      chosen ? nullptr : choice.by_title(ColumnRole::loss_tangent, "--storage");
  const bool polar = magnitude != nullptr && (angle != nullptr || tangent != nullptr);
  if (!chosen && (frequency == nullptr || (storage == nullptr && loss == nullptr && !polar))) {
    return {};
  }
  const bool compliance = storage != nullptr && is_compliance(*storage);
  if (frequency != nullptr && storage != nullptr && loss == nullptr && tangent != nullptr &&
      !compliance) {
    return {{frequency, Quantity::frequency, Bound::value, false},
            {storage, spectrum_quantity(*storage, false), Bound::value, false},
            {tangent, Quantity::abscissa, Bound::value, false}};
  }
  if (polar && storage == nullptr && loss == nullptr) {
    Use second{angle, Quantity::abscissa, Bound::value, false, Dimension::angle};
    if (angle == nullptr) second = {tangent, Quantity::abscissa, Bound::value, false};
    return {{frequency, Quantity::frequency, Bound::value, false},
            {magnitude, spectrum_quantity(*magnitude, false), Bound::value, false},
            second};
  }
  using Dimensions = std::initializer_list<Dimension>;
  const Dimensions rates = {Dimension::frequency};
  const Dimensions parts = {Dimension::stress, Dimension::compliance, Dimension::viscosity};
  for (const auto& [column, words, option, may_be] :
       {std::tuple{frequency, "a frequency", "--frequency", rates},
        std::tuple{storage, "a storage modulus", "--storage", parts},
        std::tuple{loss, "a loss modulus", "--loss", parts}}) {
    if (column != nullptr) continue;
    const std::string others = choice.list_of(may_be, {frequency, storage, loss});
    throw bad_input(file, fmt::format("no column is recognised as {}", words),
                    others.empty()
                        ? fmt::format("{} with a column of it: a law is fitted to storage and loss "
                                      "(or |G*| and delta, or G' and tan delta)",
                                      option)
                        : fmt::format("{} with one of {}", option, others));
  }
  if (storage == loss) {
    throw bad_input(fmt::format("{}: {}", file, storage->label()), "both storage and loss",
                    "--storage and --loss with a column each");
  }
  const auto part = [](const MachineColumn& column, bool of_loss) {
    Use use{&column, spectrum_quantity(column, of_loss), Bound::value, false};
    if (is_compliance(column)) use.dimension = Dimension::compliance;
    return use;
  };
  return {{frequency, Quantity::frequency, Bound::value, false},
          part(*storage, false),
          part(*loss, true)};
}

/// Storage and loss from the magnitude, or the storage, and from the phase angle or its tangent.
void resolve_phase(ImportedSeries& series, const std::vector<Use>& uses) {
  ImportedColumn& first = series.columns.at(1);
  ImportedColumn& second = series.columns.at(2);
  if (second.quantity != Quantity::abscissa) return;
  const bool polar = uses[1].column->meaning->role == ColumnRole::magnitude;
  const bool angle = second.unit.dimension == Dimension::angle;
  for (std::size_t i = 0; i < first.values.size(); ++i) {
    const double given = second.values[i] * second.unit.to_si;
    const double delta = angle ? given : std::atan(given);
    const double size = polar ? first.values[i] : first.values[i] / std::cos(delta);
    if (polar) first.values[i] = size * std::cos(delta);
    second.values[i] = size * std::sin(delta);
  }
  first.shifted = polar;
  second.shifted = true;  // converted: not the digits of the file
  series.from_angle = true;
  second.quantity = spectrum_quantities(first.unit.dimension).loss;
  second.unit = first.unit;
  series.findings.push_back(
      ImportFinding::told_of("converted", polar ? "magnitude and phase to storage and loss"
                                                : "storage and loss tangent to loss"));
}

/// The response of a strain is a stress, if there is one beside a force. Without a drive only the
/// answer to a unit step can be fitted.
const MachineColumn* response_column(const ColumnChoice& choice, const MachineColumn* drive,
                                     const ImportOptions& options) {
  const bool chosen = !options.response_column.empty() || options.response_quantity;
  if (!chosen && drive == nullptr) {
    const auto* step = choice.by_title(
        ColumnRole::response, "--response",
        [](const MachineColumn& column) { return is_step_response(column.meaning->quantity); });
    if (step != nullptr) return step;
  }
  if (!chosen && drive != nullptr && is_answered_by_stress(drive_quantity(*drive, options))) {
    const auto* stress = choice.by_title(
        ColumnRole::response, "--response",
        [](const MachineColumn& column) { return column.meaning->quantity == Quantity::stress; });
    if (stress != nullptr) return stress;
  }
  return choice.find(ColumnRole::response, options.response_column, "--response");
}

/// Refuses a recording that would go without what only a refused title could give.
void require_not_refused(const ColumnChoice& choice, ColumnRole role, const std::string& file,
                         const char* option) {
  const MachineColumn* column = choice.refused(role);
  if (column == nullptr) return;
  throw bad_input(fmt::format("{}: {}", file, column->label()), column->refused->why,
                  fmt::format("a column of what was measured, or {} {} to take this one", option,
                              column->index + 1));
}

/// Refuses storage or loss over something else than the frequency.
void require_no_other_sweep(const ColumnChoice& choice, const std::string& file) {
  for (const ColumnRole role : {ColumnRole::storage, ColumnRole::loss}) {
    const MachineColumn* part = choice.by_title(role, "--storage");
    if (part == nullptr) continue;
    throw bad_input(
        fmt::format("{}: {}", file, part->label()),
        "a storage or loss modulus without a frequency, as of a sweep of the "
        "amplitude, the temperature or the time",
        fmt::format("a sweep of the frequency, or --frequency with one of {}", choice.list()));
  }
  const bool timed = choice.by_title(ColumnRole::time, "--time") != nullptr;
  if (timed || choice.by_title(ColumnRole::frequency, "--frequency") == nullptr) return;
  throw bad_input(file, "a frequency without a storage and a loss modulus",
                  fmt::format("columns of both (or |G*| and delta, or G' and tan delta); --storage "
                              "and --loss choose among {}",
                              choice.list()));
}

/// The columns of a recording. Those of an AFM are a height, and a deflection or a force.
std::vector<Use> recording_uses(const MachineHeader& header, const ColumnChoice& choice,
                                const std::string& file, const ImportOptions& options) {
  const MachineColumn* time = choice.find(ColumnRole::time, options.time_column, "--time");
  if (time == nullptr) time = choice.lone_clock();
  const MachineColumn* drive = choice.find(ColumnRole::drive, options.drive_column, "--drive");
  if (drive == nullptr) drive = choice.by_title(ColumnRole::height, "--drive");
  const MachineColumn* response = response_column(choice, drive, options);
  const bool deflection = response == nullptr;
  if (deflection) response = choice.by_title(ColumnRole::deflection, "--response");
  const MachineColumn* sd = choice.find(ColumnRole::sd, options.sd_column, "--sd");
  if (response == nullptr) {
    require_not_refused(choice, ColumnRole::response, file, "--response");
    require_no_other_sweep(choice, file);
    const bool titled = std::ranges::any_of(
        header.columns, [](const MachineColumn& column) { return !column.name.empty(); });
    if (!titled && drive == nullptr && header.columns.size() > 2) {
      throw bad_input(
          file, fmt::format("no titles above its {} columns", header.columns.size()),
          "titles with units in the first line, such as Time (s), Depth (mm) and Force (N), or "
          "the number and the unit of each column: --time 1 --drive 2 --response 3 --unit 1=s "
          "--unit 2=mm --unit 3=N, if they are these");
    }
    require_more_than_ratio(header, file);
    const std::string others = choice.list_of(
        {Dimension::force, Dimension::stress, Dimension::compliance, Dimension::dimensionless},
        {time, drive});
    throw bad_input(file, "no column is recognised as a force, stress, modulus or compliance",
                    others.empty() ? std::string("a column of it with its unit, such as Force (N)")
                                   : fmt::format("--response with one of {}", others));
  }
  const Quantity observed = response_quantity(*response, options);
  if (drive == nullptr && !is_step_response(observed)) {
    require_not_refused(choice, ColumnRole::drive, file, "--drive");
  }
  if (time == nullptr && drive == nullptr) {
    require_not_refused(choice, ColumnRole::time, file, "--time");
    const std::string others =
        choice.list_of({Dimension::time, Dimension::length, Dimension::dimensionless}, {response});
    throw bad_input(file, "no column is recognised as time or displacement",
                    others.empty() ? std::string("columns of them with units, such as Time (s) and "
                                                 "Depth (mm)")
                                   : fmt::format("--time or --drive with one of {}", others));
  }

  std::vector<Use> uses;
  if (time != nullptr) {
    uses.push_back({time, Quantity::time, Bound::value, false});
    uses.back().clock = choice.is_clock(*time);
  }
  Use answer{response, observed, Bound::value, options.negate_response};
  answer.volts = is_deflection(*response) && (response->unit == "V" || response->unit == "mV");
  if (is_deflection(*response)) answer.dimension = Dimension::length;
  if (drive != nullptr && !is_step_response(observed)) {
    Use imposed{drive, drive_quantity(*drive, options), Bound::value, options.negate_drive};
    if (!is_deflection(*response)) resolve_specimen(imposed, answer, file, options);
    uses.push_back(imposed);
  }
  uses.push_back(answer);
  if (sd != nullptr) {
    uses.push_back({sd, answer.quantity, Bound::sd, false, answer.dimension});
  }
  if (const MachineColumn* bending = find_deflection_beside(header.columns, uses, options)) {
    uses.push_back({bending, Quantity::contact_force, Bound::value, options.negate_response,
                    Dimension::length});
    uses.back().taken_away = true;
  }
  return uses;
}

std::vector<CantileverColumn> cantilever_columns(const std::vector<Use>& uses) {
  std::vector<CantileverColumn> columns;
  for (const Use& use : uses) columns.push_back({use.column, use.volts, use.taken_away});
  return columns;
}

}  // namespace

ImportedSeries read_machine(const DelimitedTable& table, const std::string& file,
                            const ImportOptions& options) {
  const MachineHeader header = read_machine_header(table, file, options);
  const ColumnChoice choice(table, header, file);
  for (const auto& [selector, unit] : options.units) choice.require_column_for_unit(selector);
  std::vector<Use> uses = spectrum_uses(choice, file, options);
  const bool spectrum = !uses.empty();
  if (!spectrum) uses = recording_uses(header, choice, file, options);
  require_units(uses, file);
  SeriesReader reader(table, header, uses, file);
  for (const Use& use : uses) reader.add(use);
  ImportedSeries series = reader.take();
  if (choice.specimens() > 1) {
    series.findings.push_back(ImportFinding::told_of(
        "specimens", fmt::format("{} side by side, of which the first is read (--time, --drive "
                                 "and --response choose another)",
                                 choice.specimens())));
  }
  if (spectrum) {
    resolve_phase(series, uses);
    resolve_compliances(series, file);
    tell_unread_deviations(header, series);
  } else {
    resolve_cantilever(series, cantilever_columns(uses), file, options);
    divide_by_size(series, options);
    sort_shuffled_rows(series);
    keep_time_window(series, file, options);
    if (resolve_kept_step(series, options) == 0) require_step_clock(series, file, options);
    leave_out_zero_at_step(series);
  }
  series.name = header.sheet;
  series.findings.insert(
      series.findings.begin(),
      {{"decimal sign", header.style.decimal_comma ? "comma" : "point"},
       {"header rows", fmt::format("{}{}{}", header.rows, header.sheet.empty() ? "" : ", sheet ",
                                   printable(header.sheet))}});
  if (header.style.thousands != ThousandsMark::none) {
    series.findings.insert(
        series.findings.begin() + 1,
        ImportFinding::told_of("marks of thousands",
                               std::string(thousands_name(header.style.thousands))));
  }
  const bool step = !spectrum && is_step_response(series.columns.back().bound == Bound::sd
                                                      ? series.columns.at(1).quantity
                                                      : series.columns.back().quantity);
  if (!spectrum && !step) start_at_contact(series, file, options);
  return series;
}

}  // namespace tpm::files
