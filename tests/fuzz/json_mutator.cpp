#include "fuzz/json_mutator.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <random>
#include <vector>

#include "tpm/files/json.hpp"

namespace tpm::fuzz {
using namespace files;

namespace {

/// Brackets open at once, those in texts counted too.
int deepest_nesting(std::string_view document) {
  int open = 0;
  int deepest = 0;
  for (const char c : document) {
    if (c == '[' || c == '{') deepest = std::max(deepest, ++open);
    if (c == ']' || c == '}') --open;
  }
  return deepest;
}

void collect(Json& value, std::vector<Json*>& places) {
  places.push_back(&value);
  for (Json& member : value) {
    if (member.is_structured()) {
      collect(member, places);
    } else {
      places.push_back(&member);
    }
  }
}

Json hostile_value(std::mt19937& random) {
  static const std::array<Json, 26> values = {Json(0),
                                              Json(-1),
                                              Json(1e308),
                                              Json(5e-324),
                                              Json(4294967299),
                                              Json(INT64_MIN),
                                              Json(true),
                                              Json(nullptr),
                                              Json(""),
                                              Json("0 mm"),
                                              Json("-3 mm"),
                                              Json("1e300 mm"),
                                              Json("1e-300 s"),
                                              Json("nan kPa"),
                                              Json("12 kPa"),
                                              Json("1 kHz"),
                                              Json("10 s"),
                                              Json("5 N"),
                                              Json("inf"),
                                              Json("../../etc/passwd"),
                                              Json("."),
                                              Json("case.json"),
                                              Json(std::string(300, 'a')),
                                              Json::array(),
                                              Json::object(),
                                              Json(std::vector<int>(1000, 1))};
  return values[random() % values.size()];
}

/// The number at the front of a text such as "20 mm" by another.
std::string renumbered(const std::string& text, std::mt19937& random) {
  static constexpr std::array<std::string_view, 8> numbers = {"0", "-1",    "1e9",  "1e-9",
                                                              "7", "0.333", "1e40", "99999"};
  const std::size_t end = text.find_first_not_of("0123456789.eE+-");
  if (end == 0 || text.empty()) return text + text;
  return std::string(numbers[random() % numbers.size()]) +
         (end == std::string::npos ? "" : text.substr(end));
}

}  // namespace

std::string mutated_json(std::string_view document, std::uint32_t seed) {
  if (deepest_nesting(document) > 100) return {};  // to be walked by recursion here
  Json json = Json::parse(document, nullptr, false);
  if (json.is_discarded()) return {};
  std::mt19937 random(seed);
  std::vector<Json*> places;
  collect(json, places);
  Json& place = *places[random() % places.size()];
  switch (random() % 6) {
    case 0:
      place = hostile_value(random);
      break;
    case 1:  // a copy, since one may hold the other
      place = Json(*places[random() % places.size()]);
      break;
    case 2:
      if (place.is_structured() && !place.empty()) {
        auto member = place.begin();
        std::advance(member, static_cast<std::ptrdiff_t>(random() % place.size()));
        place.erase(member);
      } else {
        place = nullptr;
      }
      break;
    case 3:
      if (place.is_array() && !place.empty()) {
        place.push_back(Json(place[random() % place.size()]));
      } else if (place.is_object()) {
        place["unknown"] = hostile_value(random);
      } else {
        place = Json::array({place, hostile_value(random)});
      }
      break;
    default:
      if (place.is_string()) {
        place = renumbered(place.get<std::string>(), random);
      } else if (place.is_number()) {
        place = place.get<double>() * (random() % 2 == 0 ? -1.0 : 1e6);
      } else {
        place = hostile_value(random);
      }
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace tpm::fuzz
