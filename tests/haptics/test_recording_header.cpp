// Recordings of sessions with damaged headers: each is read or refused in one sentence with its
// place, whatever is then asked of it.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "hil_scenes.hpp"
#include "odd_documents.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/checksum.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/haptics/session/recording_export.hpp"
#include "tpm/haptics/session/recording_keys.hpp"
#include "tpm/haptics/show/hil_report.hpp"
#include "tpm/haptics/show/view_recording.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

/// The motion of a recording, felt by a law.
Json law_session() {
  Json session;
  session["model"] = {{"kind", "law"},
                      {"law", read_json(std::filesystem::path(TPM_TEST_SOURCE_DIR) /
                                        "tests/fuzz/corpus/law/linear_1.json")}};
  session["motion"] = {{"name", "poke.csv"},
                       {"initial_hold_s", 0.5},
                       {"spacing_s", 0.1},
                       {"depths_m", {0.0, 1e-3, 1e-3}},
                       {"measured_N", {0.0, 0.1, 0.08}}};
  return session;
}

/// A header with every key that one can have.
Json whole_header(const Json& of = test::short_session()) {
  const HilSession session = test::parsed(of);
  LoopModel model;
  model.name = "the element";
  model.error_bound = "none";
  model.stiffness_N_per_m = 150.0;
  model.plan = Json::parse(R"({"tolerance": 0.01, "tolerance_source": "stated", "rate_Hz": 1000,
    "reference": "network", "peak_N": 0.4, "masses_left_out": null, "choice": "element",
    "candidates": [{"name": "element", "period_s": 1e-6, "claimed_error": null,
                    "verified_error": 0.001, "feasible": true, "reason": ""}]})");
  const Json rendering = Json::parse(R"({"verdict": "passive", "stable": true, "passive": true,
    "remarks": [{"code": "none", "text": "nothing"}], "stiffness_N_per_m": 150.0})");
  DeviceIdentity device;
  device.kind = "virtual";
  device.name = "simulated Omega.7";
  device.assumptions = {{"moving_mass", "moving mass 0.3 kg"}};
  return recording_header(session, device, model, false, {"2020-01-01", "a", "b"}, rendering);
}

Json whole_closing() {
  return Json::parse(R"({"cause": "finished", "detail": "", "cycles": 2, "counts": {"damped": 0},
    "dropped_records": 0, "device_error": 0, "device_error_text": "", "forces_off": "yes",
    "host": "a machine", "scheduling": "none",
    "woke_late": {"p50_s": 0, "p99_s": 0, "p999_s": 0, "max_s": 0},
    "busy": {"p50_s": 0, "p99_s": 0, "p999_s": 0, "max_s": 0}, "stop_took_s": 0.001})");
}

template <class Number>
std::string bytes_of(const Number& number) {
  return {reinterpret_cast<const char*>(&number), sizeof number};
}

std::uint32_t sum_of(std::uint32_t number, const std::string& text) {
  return crc32_of(text.data(), text.size(), crc32_of(&number, sizeof number));
}

std::string text_bytes(const std::string& text) {
  return bytes_of(static_cast<std::uint32_t>(text.size())) + text + bytes_of(sum_of(0, text));
}

/// Without waiting for the disk.
std::string put(const test::TempFolder& folder, const std::string& bytes) {
  std::string path = folder / "r.tpmrec";
  std::filesystem::remove(path);  // what takes the place of a file is brought to the disk
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

/// A recording of two rows as RowLogWriter writes it, its check sums right.
std::string written(const test::TempFolder& folder, const std::string& header,
                    const std::string& closing) {
  std::string bytes =
      "TPMROWS1" + bytes_of(static_cast<std::uint32_t>(sizeof(ServoRecord))) + text_bytes(header);
  for (std::uint32_t row = 0; row < 2; ++row) {
    ServoRecord record{};
    record.cycle = row;
    bytes += bytes_of(row) + bytes_of(record) + bytes_of(sum_of(row, bytes_of(record)));
  }
  return put(folder, bytes + bytes_of(0xffffffffU) + text_bytes(closing));
}

/// What reading it and showing it is refused with; "" if all is done. Anything but an Error is a
/// fault of the reader. Pages and exports take their time: they are made for some numbers only.
std::string answer_to(const std::string& path, const test::TempFolder& folder,
                      std::size_t number = 0) {
  return test::refusal_of([&] {
    const HilRecording recording = read_recording(path);
    (void)device_line(recording);
    (void)damage_line(recording);
    (void)haptics::summary_of(recording);
    show::ViewOptions plain;
    plain.organ = false;
    if (number % 4 == 0) (void)haptics::view_recording(path, "", plain);
    if (number % 40 == 0) export_recording(recording, "", folder / "r.h5");
  });
}

void require_sentence(const std::string& answer, const std::string& what) {
  INFO(what << ": " << answer);
  CHECK(answer.find('\n') == std::string::npos);
  CHECK((answer.empty() || answer.find("r.tpmrec") != std::string::npos));
}

/// Pointers to all members and items.
void collect(const Json& json, const Json::json_pointer& at, std::vector<Json::json_pointer>& all) {
  if (json.is_object()) {
    for (const auto& [key, value] : json.items()) {
      all.push_back(at / key);
      collect(value, at / key, all);
    }
  } else if (json.is_array()) {
    for (std::size_t i = 0; i < json.size(); ++i) {
      all.push_back(at / i);
      collect(json[i], at / i, all);
    }
  }
}

/// The document with another value, or none, at a random place.
Json mutated(Json json, Random& random, std::string& what) {
  std::vector<Json::json_pointer> places;
  collect(json, Json::json_pointer(), places);
  const auto pick = [&random](std::size_t size) {
    return std::min(size - 1,
                    static_cast<std::size_t>(random.uniform() * static_cast<double>(size)));
  };
  const Json::json_pointer place = places[pick(places.size())];
  const std::vector<Json> others{nullptr,
                                 true,
                                 -1,
                                 1e300,
                                 9007199254740993,
                                 "",
                                 "x",
                                 Json::array(),
                                 Json::object(),
                                 Json::array({1, "a"}),
                                 Json{{"a", 1}}};
  const std::size_t choice = pick(others.size() + 3);
  what = place.to_string() + " " + std::to_string(choice);
  Json& parent = json[place.parent_pointer()];
  if (choice < others.size()) {
    json[place] = others[choice];
  } else if (parent.is_object()) {
    const Json value = json[place];
    parent.erase(place.back());
    if (choice == others.size()) parent[place.back() + "_"] = value;
  } else {
    parent.erase(static_cast<std::size_t>(std::stoul(place.back())));
  }
  return json;
}

TEST_CASE("schema and reader of a recording's header and closing record agree on odd ones",
          "[keys]") {
  test::compare_schema_and_form(recording_header_kind(),
                                {whole_header(), whole_header(law_session())}, 300);
  test::compare_schema_and_form(recording_closing_kind(), {whole_closing()}, 200);
}

TEST_CASE("remarks of a rendering are read with their codes, and those of earlier recordings") {
  const DocumentPlace place{"header"};
  Json header = whole_header();
  const auto read = [&] { return recording_header_block().read(header, place).rendering.value(); };
  CHECK(read().remarks == std::vector<Remark>{{"none", "nothing"}});
  CHECK(read().texts() == std::vector<std::string>{"nothing"});
  header["rendering"].erase("remarks");
  header["rendering"]["warnings"] = Json::array({"something"});
  CHECK(read().remarks.empty());
  CHECK(read().texts() == std::vector<std::string>{"something"});
  const auto assumed = [&] {
    return recording_header_block().read(header, place).device.assumptions;
  };
  CHECK(assumed() == std::vector<Remark>{{"moving_mass", "moving mass 0.3 kg"}});
  header["device"]["assumptions"] = Json::array({"moving mass 0.3 kg"});
  CHECK(assumed() == std::vector<Remark>{{"uncoded", "moving mass 0.3 kg"}});
}

TEST_CASE("a whole recording is read, its header that of the writer") {
  const test::TempFolder folder;
  const std::string path = written(folder, to_text(whole_header()), to_text(whole_closing()));
  CHECK(answer_to(path, folder) == "");
  const HilRecording recording = read_recording(path);
  CHECK(recording.header == whole_header());
  CHECK(recording.rows.size() == 2);
  for (const Json& session : {law_session(), test::slide_session()}) {
    const Json header = whole_header(session);
    CHECK(answer_to(written(folder, to_text(header), to_text(whole_closing())), folder) == "");
  }
}

TEST_CASE("a header that was changed is refused with its key") {
  const test::TempFolder folder;
  const auto refusal = [&](const char* place, const Json& value) {
    Json header = whole_header();
    header[Json::json_pointer(place)] = value;
    return answer_to(written(folder, to_text(header), to_text(whole_closing())), folder);
  };
  CHECK_THAT(
      refusal("/device", 3),
      Contains("r.tpmrec: header: key /device: is of the wrong type: 3; expected an object"));
  CHECK_THAT(refusal("/device/name", nullptr),
             Contains("header: key /device/name: is of the wrong"));
  CHECK_THAT(refusal("/time", "later"), Contains("header: key /time: unknown word 'later'"));
  CHECK_THAT(refusal("/rendering", Json{{"verdict", "good"}}),
             Contains("header: key /rendering/") && Contains("is missing"));
  CHECK_THAT(refusal("/model/plan/candidates/0/name", 1),
             Contains("header: key /model/plan/candidates/0/name"));
  CHECK_THAT(refusal("/surface_by_phase_m/0", "deep"),
             Contains("header: key /surface_by_phase_m/0: is of the wrong type"));
  CHECK_THAT(refusal("/surface_by_phase_m", Json::array()),
             Contains("header: key /surface_by_phase_m: has surfaces for another number"));
  CHECK_THAT(refusal("/session/model/kind", 1), Contains("header: session: key /model/kind"));
  CHECK_THAT(refusal("/session/indentations/depths", Json::array({"4 kg"})),
             Contains("header: session: key /indentations/depths"));
  CHECK_THAT(refusal("/session/model/scene", "s.json"),
             Contains("header: session: key /model/scene: is the name of a file"));
  CHECK_THAT(refusal("/format", 2), Contains("is a recording of another version of tpm"));
  Json closing = whole_closing();
  closing.erase("host");
  const std::string path = written(folder, to_text(whole_header()), to_text(closing));
  CHECK_THAT(answer_to(path, folder), Contains("r.tpmrec: closing record: "));
  CHECK_THAT(answer_to(written(folder, "[1, 2]", "{}"), folder),
             Contains("another version of tpm"));
  CHECK_THAT(answer_to(written(folder, "{\"format\": ", "{}"), folder),
             Contains("r.tpmrec: header: parse error at line 1"));
}

TEST_CASE("a header damaged at any byte is named") {
  const test::TempFolder folder;
  const std::string whole = read_file(written(folder, to_text(whole_header()), "{}"));
  constexpr std::size_t kBefore = 12;  // magic and the size of a row
  const std::size_t end = kBefore + 4 + to_text(whole_header()).size() + 4;
  for (std::size_t at = 0; at < end; ++at) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << (at % 8)));
    const std::string path = put(folder, bytes);
    const std::string answer = test::refusal_of([&] { (void)read_recording(path); });
    INFO(at << ": " << answer);
    CHECK_FALSE(answer.empty());
    if (at >= kBefore + 4) CHECK_THAT(answer, Contains("header: is damaged: its check sum"));
  }
  CHECK_THAT(answer_to(put(folder, whole.substr(0, 200)), folder),
             Contains("ends inside its header"));
}

TEST_CASE("a header with any of its bytes changed, its check sum right, is read or refused") {
  const test::TempFolder folder;
  const std::string header = whole_header().dump(), closing = whole_closing().dump();
  Random random(5);
  for (std::size_t at = 0; at < header.size(); ++at) {
    std::string changed = header;
    changed[at] = static_cast<char>(32 + static_cast<int>(95.0 * random.uniform()));
    require_sentence(answer_to(written(folder, changed, closing), folder, at),
                     changed.substr(at, 20));
  }
}

TEST_CASE("1000 headers and closing records with another value somewhere are read or refused") {
  const test::TempFolder folder;
  const std::vector<Json> headers{whole_header(), whole_header(law_session()),
                                  whole_header(test::slide_session())};
  const Json closing = whole_closing();
  Random random(6);
  std::string what;
  for (std::size_t i = 0; i < 1000; ++i) {
    const bool last = i % 5 == 0;
    const Json& header = headers[i % headers.size()];
    const Json other = mutated(last ? closing : header, random, what);
    const std::string path =
        written(folder, last ? header.dump() : other.dump(), last ? other.dump() : closing.dump());
    require_sentence(answer_to(path, folder, i), what);
  }
}

}  // namespace
}  // namespace tpm::haptics
