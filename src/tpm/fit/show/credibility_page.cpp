#include "tpm/fit/show/credibility_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/show/document.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/version.hpp"

namespace tpm::fit {
namespace {

constexpr std::string_view kRecordOpens =
    "<script type=\"application/json\" id=\"tpm-credibility\">";
constexpr std::string_view kRecordCloses = "</script>";
constexpr const char* kNotStated = "not stated";
constexpr std::size_t kShortSha = 12;
constexpr int kLawDigits = 6;
// Of the FDA's guidance of November 2023.
constexpr auto kCategories = std::to_array<std::string_view>(
    {"code verification", "calculation verification", "calibration", "bench-test validation",
     "in vivo validation", "population-based validation", "emergent behaviour", "plausibility"});

std::string stated(const Json& summary, const char* key) {
  const std::string text = summary.at(key).get<std::string>();
  return text.empty() ? kNotStated : text;
}

/// Cells of a record turn red if what they show is no longer so.
class EvidencePage {
 public:
  EvidencePage(const Json& record, const std::vector<CredibilityChange>& changes)
      : record_(record), validation_(record.at("validation")) {
    for (const CredibilityChange& change : changes) changed_[change.place] = change.now;
  }

  Document document(const std::vector<CredibilityChange>& changes) {
    Document d;
    d.title = fmt::format("Credibility of {}", validation_.at("law_file").get<std::string>());
    d.subtitle = "Headings after ASME V&V 40 and the FDA's guidance of November 2023";
    if (!changes.empty()) add_changes(d, changes);
    const Json& summary = record_.at("summary");
    d.heading(2, "Question, context and risk");
    d.table({"",
             {{"item"}, {"in the words of the user"}},
             {{{"question of interest"}, {stated(summary, "question")}},
              {{"context of use"}, {stated(summary, "context")}},
              {{"model risk"}, {stated(summary, "risk")}}}});
    d.heading(2, "Evidence by category");
    add_categories(d);
    d.heading(2, "Calibration");
    add_law(d);
    d.heading(2, "Validation");
    add_validation(d);
    d.heading(2, "Applicability");
    add_applicability(d);
    d.heading(2, "Provenance");
    add_files(d);
    return d;
  }

 private:
  [[nodiscard]] Cell cell(const std::string& place, const std::string& text) const {
    const auto found = changed_.find(place);
    if (found == changed_.end()) return {text};
    return {fmt::format("{} (now {})", text, found->second), Tone::bad};
  }
  [[nodiscard]] Cell number_cell(const std::string& place, int digits = 4) const {
    const Json::json_pointer pointer(place);
    if (!record_.contains(pointer)) return {"-"};
    const Json& value = record_.at(pointer);
    return cell(place, value.is_number() ? significant(value.get<double>(), digits)
                                         : value.get<std::string>());
  }
  /// "not_adequate" as people say it.
  [[nodiscard]] Cell verdict_cell(const std::string& place) const {
    std::string words = record_.at(Json::json_pointer(place)).get<std::string>();
    std::ranges::replace(words, '_', ' ');
    return cell(place, words);
  }
  /// "peak force, N"
  [[nodiscard]] Cell quantity_cell(const std::string& at) const {
    Cell name = number_cell(at + "quantity");
    const std::string unit = record_.at(Json::json_pointer(at + "unit")).get<std::string>();
    if (!unit.empty()) name.text += unit == "1" ? ", share of S" : ", " + unit;
    return name;
  }

  static void add_changes(Document& d, const std::vector<CredibilityChange>& changes) {
    constexpr std::size_t kMost = 48;  // characters, so that what is now stands beside what was
    d.heading(2, "Changed since this page was written");
    Table table{"", {{"place"}, {"was"}, {"now"}}};
    for (const CredibilityChange& c : changes) {
      table.rows.push_back(
          {{c.place}, {printable(c.before, kMost)}, {printable(c.now, kMost), Tone::bad}});
    }
    d.table(std::move(table));
  }

  /// Categories filled by the validation itself.
  [[nodiscard]] std::map<std::string, Cell> found() const {
    std::string calibration = "files that the law does not name";
    const Json& files = validation_.at("calibration");
    if (!files.empty()) calibration.clear();
    for (const Json& file : files) {
      calibration += fmt::format("{}{} (SHA-256 {})", calibration.empty() ? "" : ", ",
                                 file.at("name").get<std::string>(),
                                 file.at("sha256").get<std::string>().substr(0, kShortSha));
    }
    double worst = 0.0;
    bool tested = false;
    std::string largest = "rounding";
    for (const Json& r : validation_.at("recordings")) {
      tested = tested || !r.at("fitted").get<bool>();
      for (const Json& q : r.at("quantities")) {
        const double size = std::abs(q.at("S").get<double>());
        if (!(size > 0.0) || q.at("u_num").get<double>() / size <= worst) continue;
        worst = q.at("u_num").get<double>() / size;
        largest = q.at("numerical").at(0).at("name").get<std::string>();
      }
    }
    std::string numbers =
        fmt::format("u_num at most {} of S, the most of it {}", significant(worst, 1), largest);
    const Json& first = validation_.at("recordings").at(0);
    if (first.contains("u_num_of_spheres")) {
      numbers += ", " + first.at("u_num_of_spheres").get<std::string>();
    }
    std::map<std::string, Cell> cells{
        {"calculation verification", {std::move(numbers)}},
        {"calibration",
         {fmt::format("{}, fitted to {}; u_input from {}",
                      validation_.at("subject").get<std::string>(), calibration,
                      validation_.at("u_input_from").get<std::string>())}}};
    if (tested) {
      cells["bench-test validation"] =
          cell("/validation/verdict", validation_.at("summary").get<std::string>());
    }
    return cells;
  }

  void add_categories(Document& d) const {
    const std::map<std::string, Cell> own = found();
    Table table{"", {{"category"}, {"evidence"}}};
    for (const std::string_view name : kCategories) {
      const std::string category(name);
      bool any = own.contains(category);
      if (any) table.rows.push_back({{category}, own.at(category)});
      for (const Json& e : record_.at("evidence")) {
        if (e.at("category") != category) continue;
        const std::string file = e.at("file").get<std::string>();
        table.rows.push_back({{category}, file_cell(file)});
        table.rows.back().back().file = file;  // beside the page, as it was given
        any = true;
      }
      if (any) continue;
      const bool code = category == kCategories.front();
      table.rows.push_back({{category},
                            {code ? "empty: nothing was given (`tpm accuracy verify --folder "
                                    "verification` writes it)"
                                  : "empty: nothing was given"}});
    }
    d.table(std::move(table));
  }

  [[nodiscard]] Cell file_cell(const std::string& file) const {
    Json::json_pointer place("/files");
    place /= file;
    const std::string sha256 = record_.at(place).get<std::string>();
    return cell(place.to_string(),
                fmt::format("{} (SHA-256 {})", file, sha256.substr(0, kShortSha)));
  }

  void add_law(Document& d) const {
    const std::string file = validation_.at("law_file").get<std::string>();
    Table table{
        fmt::format("{}, SHA-256 {}", file, validation_.at("law_sha256").get<std::string>()),
        {{"parameter"}, {"meaning"}, {"value", true}, {"standard uncertainty", true}}};
    table.stacks = true;  // its caption is long
    const Json& parameters = record_.at("law").at("parameters");
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const std::string at = fmt::format("/law/parameters/{}/", i);
      const bool said = parameters[i].contains("meaning");  // not by earlier versions
      table.rows.push_back({number_cell(at + (said ? "symbol" : "name")),
                            said ? number_cell(at + "meaning") : Cell{"-"},
                            number_cell(at + "value", kLawDigits), number_cell(at + "u", 2)});
    }
    d.table(std::move(table));
    d.paragraph(fmt::format("Does the law describe what it was fitted to: {}",
                            record_.at("law").at("adequacy").get<std::string>()));
  }

  void add_validation(Document& d) const {
    d.paragraph(fmt::format(
        "Requirement: {}. S: simulated, D: measured, E = S - D: error of the comparison, U: its "
        "expanded uncertainty (95 %), of the standard uncertainties u_num (numerical), u_input "
        "(parameters of the law) and u_D (data), R: the largest error that the requirement allows.",
        validation_.at("requirement").get<std::string>()));
    const Json& recordings = validation_.at("recordings");
    for (std::size_t i = 0; i < recordings.size(); ++i) {
      Table table{fmt::format("{}, SHA-256 {}", recordings[i].at("recording").get<std::string>(),
                              recordings[i].at("sha256").get<std::string>()),
                  {{"quantity"},
                   {"S", true},
                   {"D", true},
                   {"E", true},
                   {"U", true},
                   {"u_num", true},
                   {"u_input", true},
                   {"u_D", true},
                   {"R", true},
                   {"verdict"}}};
      table.stacks = true;
      const std::size_t count = recordings[i].at("quantities").size();
      for (std::size_t k = 0; k < count; ++k) {
        const std::string at = fmt::format("/validation/recordings/{}/quantities/{}/", i, k);
        std::vector<Cell> row{quantity_cell(at)};
        constexpr auto kShown = std::to_array<std::pair<const char*, int>>({{"S", 4},
                                                                            {"D", 4},
                                                                            {"E", 3},
                                                                            {"U", 3},
                                                                            {"u_num", 1},
                                                                            {"u_input", 2},
                                                                            {"u_D", 2},
                                                                            {"R", 3}});
        for (const auto& [key, digits] : kShown) row.push_back(number_cell(at + key, digits));
        row.push_back(verdict_cell(at + "verdict"));
        table.rows.push_back(std::move(row));
      }
      d.table(std::move(table));
      const Cell part = number_cell(fmt::format("/validation/recordings/{}/compared/summary", i));
      d.bullets({{"compared: " + part.text, part.tone}});
    }
    if (!validation_.contains("pooled")) return;
    Table table{"mean over the recordings",
                {{"quantity"},
                 {"n", true},
                 {"S", true},
                 {"D", true},
                 {"E", true},
                 {"U", true},
                 {"R", true},
                 {"area metric", true},
                 {"95 % of draws", true},
                 {"verdict"}}};
    table.stacks = true;
    for (std::size_t k = 0; k < validation_.at("pooled").size(); ++k) {
      const std::string at = fmt::format("/validation/pooled/{}/", k);
      std::vector<Cell> row{quantity_cell(at)};
      constexpr auto kShown =
          std::to_array<std::pair<const char*, int>>({{"recordings", 4},
                                                      {"S", 4},
                                                      {"D", 4},
                                                      {"E", 3},
                                                      {"U", 3},
                                                      {"R", 3},
                                                      {"area_metric/area", 3},
                                                      {"area_metric/upper_95_of_draws", 3}});
      for (const auto& [key, digits] : kShown) row.push_back(number_cell(at + key, digits));
      row.push_back(verdict_cell(at + "verdict"));
      table.rows.push_back(std::move(row));
    }
    d.table(std::move(table));
  }

  void add_applicability(Document& d) const {
    std::vector<Cell> items;
    for (const Json& r : validation_.at("recordings")) {
      const Json& a = r.at("applicability");
      std::string text;
      for (const Json& outside : a.at("outside")) {
        text += text.empty() ? "outside the calibration: " : "; ";
        text += outside.at("text").get<std::string>();
      }
      if (text.empty()) text = "inside the calibration";
      for (const Json& unknown : a.at("unknown")) {
        text += fmt::format(" ({} not known)", unknown.get<std::string>());
      }
      items.push_back({fmt::format("{}: {}", r.at("recording").get<std::string>(), text)});
    }
    d.bullets(std::move(items));
  }

  void add_files(Document& d) const {
    Table table{"", {{"file"}, {"SHA-256"}}};
    table.stacks = true;
    for (const auto& [name, sha256] : record_.at("files").items()) {
      Json::json_pointer place("/files");
      place /= name;
      table.rows.push_back({{name}, cell(place.to_string(), sha256.get<std::string>())});
    }
    d.table(std::move(table));
    d.paragraph(fmt::format("Written by tpm {}. tpm validate --recheck computes it again.",
                            record_.at("tpm").get<std::string>()));
  }

  const Json& record_;
  const Json& validation_;
  std::map<std::string, std::string> changed_;
};

std::string value_text(const Json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

}  // namespace

CredibilityEvidence parse_evidence(std::string_view text, std::string_view where) {
  const auto equals = text.find('=');
  const std::string category(text.substr(0, equals));
  const bool known = std::ranges::find(kCategories, category) != kCategories.end();
  if (equals == std::string_view::npos || !known) {
    throw bad_input(
        where, fmt::format("'{}'", printable(text)),
        fmt::format("CATEGORY=FILE, the category one of {}", fmt::join(kCategories, ", ")));
  }
  return {category, std::string(text.substr(equals + 1))};
}

namespace {

Json law_record(const LawFile& law) {
  Json parameters = Json::array();
  const std::vector<LawParameter> all = law_parameters(law.spec);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (belongs_to_recording(law.spec, all[i])) continue;
    const std::string_view unit = si_symbol(all[i].dimension);
    Json entry{{"name", law_key(all[i])},
               {"symbol", unit.empty() ? all[i].name : fmt::format("{}, {}", all[i].name, unit)},
               {"meaning", all[i].meaning}};
    // JSON has no infinity.
    if (std::isfinite(law.values[i])) entry["value"] = rounded(law.values[i], kLawDigits);
    const auto& places = law.uncertainty->place;
    const auto place = std::ranges::find(places, i);
    if (place != places.end()) {
      const auto k = static_cast<Eigen::Index>(place - places.begin());
      const double slope =
          coordinate_slope(law.uncertainty->coordinate[static_cast<std::size_t>(k)], law.values[i]);
      entry["u"] =
          rounded(std::abs(slope) * std::sqrt(law.uncertainty->covariance(k, k)), kLawDigits);
    }
    parameters.push_back(std::move(entry));
  }
  return {
      {"parameters", std::move(parameters)},
      {"adequacy", law.adequacy ? law.adequacy->summary : std::string("not stated by the law")}};
}

}  // namespace

Json credibility_record(const ValidationRequest& request, const Validation& validation,
                        const CredibilitySummary& summary, Json invocation,
                        const std::vector<CredibilityEvidence>& evidence,
                        const std::vector<std::string>& other_files) {
  Json record{
      {"tpm", version()},
      {"summary",
       {{"question", summary.question}, {"context", summary.context}, {"risk", summary.risk}}},
      {"invocation", std::move(invocation)}};
  Json files = Json::object();
  files[validation.law_file] = request.law_sha256;
  for (const RecordingComparison& r : validation.recordings) files[r.name] = r.sha256;
  for (const CalibrationData::File& file : validation.calibration) files[file.name] = file.sha256;
  for (const std::string& file : other_files) files[file] = sha256_hex(read_file(file));
  record["evidence"] = Json::array();
  for (const CredibilityEvidence& e : evidence) {
    files[e.file] = sha256_hex(read_file(e.file));
    record["evidence"].push_back({{"category", e.category}, {"file", e.file}});
  }
  record["files"] = files;
  record["law"] = law_record(request.law);
  record["validation"] = to_json(validation);
  return record;
}

std::vector<CredibilityChange> changes_of(const Json& before, const Json& now) {
  std::vector<CredibilityChange> changes;
  const Json old_values = before.flatten(), new_values = now.flatten();
  std::set<std::string> seen;
  for (const auto& [place, value] : old_values.items()) {
    seen.insert(place);
    const auto found = new_values.find(place);
    if (found == new_values.end()) {
      changes.push_back({place, value_text(value), "gone"});
    } else if (*found != value) {
      changes.push_back({place, value_text(value), value_text(*found)});
    }
  }
  for (const auto& [place, value] : new_values.items()) {
    if (!seen.contains(place)) changes.push_back({place, "not there", value_text(value)});
  }
  return changes;
}

bool shows_its_record(const std::filesystem::path& page, const Json& record) {
  return read_file(page) == credibility_page(record);
}

std::string credibility_page(const Json& record, const std::vector<CredibilityChange>& changes) {
  std::string html = to_html(EvidencePage(record, changes).document(changes), {});
  std::string data = to_text(record);
  // "</script>" in a name must not end the record.
  for (std::size_t at = 0; (at = data.find('<', at)) != std::string::npos;) {
    data.replace(at, 1, "\\u003c");
  }
  const std::string block = fmt::format("{}\n{}{}\n", kRecordOpens, data, kRecordCloses);
  const auto end = html.rfind("</body>");
  return end == std::string::npos ? html + block : html.insert(end, block);
}

Json read_credibility_record(const std::filesystem::path& page) {
  const std::string text = read_file(page);
  const auto begin = text.rfind(kRecordOpens);
  const auto end = begin == std::string::npos ? begin : text.find(kRecordCloses, begin);
  if (end == std::string::npos) {
    throw bad_input(page.string(), "is no credibility page",
                    "a page that tpm validate --credibility has written");
  }
  const auto from = begin + kRecordOpens.size();
  Json record = parse_json(std::string_view(text).substr(from, end - from), page.string());
  for (const char* key :
       {"tpm", "summary", "invocation", "files", "evidence", "law", "validation"}) {
    if (!record.is_object() || !record.contains(key)) {
      throw bad_input(page.string(), fmt::format("its record lacks '{}'", key),
                      "a page that tpm validate --credibility has written");
    }
  }
  return record;
}

}  // namespace tpm::fit
