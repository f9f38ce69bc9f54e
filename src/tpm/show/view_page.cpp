#include "tpm/show/view_page.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>

#include "tpm/files/file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::show {
namespace {

constexpr std::string_view kPlaceOfData = "<!-- data -->";

std::string base64(std::string_view bytes) {
  constexpr std::size_t kPart = 3U << 20U;  // a multiple of 3: only the last part is padded
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4 + 1);
  for (std::size_t at = 0; at < bytes.size(); at += kPart) {
    const std::string_view part = bytes.substr(at, kPart);
    const std::size_t before = text.size();
    text.resize(before + (part.size() + 2) / 3 * 4 + 1);  // and the zero that OpenSSL appends
    const int length = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data() + before),
                                       reinterpret_cast<const unsigned char*>(part.data()),
                                       static_cast<int>(part.size()));
    text.resize(before + static_cast<std::size_t>(length));
  }
  return text;
}

/// JSON inside of a script element: no name from a file may end the element.
std::string script_text(const Json& value) {
  std::string text;
  for (const char c : value.dump(-1, ' ', false, Json::error_handler_t::replace)) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

/// pages/view.html with these elements.
std::string page_with(std::string_view elements) {
  std::string page = read_page("view.html");
  const std::size_t at = page.find(kPlaceOfData);
  if (at == std::string::npos) {
    throw Error(ExitCode::environment, "pages/view.html", "has no place for the data",
                "the page that belongs to this version of tpm");
  }
  return page.replace(at, kPlaceOfData.size(), elements);
}

std::string array_name(std::size_t index) {
  return fmt::format("array-{}", index);
}

std::string json_element(std::string_view id, const Json& value) {
  return fmt::format("<script type=\"application/json\" id=\"{}\">{}</script>\n", id,
                     script_text(value));
}

template <class Number>
std::string_view bytes_of(std::span<const Number> numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()};
}

}  // namespace

std::string ViewPage::put_bytes(std::string_view type, std::string_view bytes) {
  arrays_.push_back({type, base64(bytes)});
  return array_name(arrays_.size() - 1);
}

std::string ViewPage::put(std::span<const float> numbers) {
  return put_bytes("float32", bytes_of(numbers));
}

std::string ViewPage::put(std::span<const double> numbers) {
  return put_bytes("float64", bytes_of(numbers));
}

std::string ViewPage::put(std::span<const std::uint32_t> numbers) {
  return put_bytes("uint32", bytes_of(numbers));
}

void ViewPage::fact(std::string_view name, std::string_view value) {
  if (!value.empty()) description["facts"].push_back({name, value});
}

void ViewPage::plot_over_time(std::string_view title, std::string_view unit, Json series) {
  description["plots"].push_back({{"title", title},
                                  {"x", {{"quantity", "time"}, {"unit", "s"}}},
                                  {"y", {{"quantity", title}, {"unit", unit}}},
                                  {"time", true},
                                  {"series", std::move(series)}});
}

std::string ViewPage::elements(std::string_view prefix) const {
  std::string text = json_element(fmt::format("{}description", prefix), description);
  for (std::size_t i = 0; i < arrays_.size(); ++i) {
    text += fmt::format("<script type=\"text/plain\" id=\"{}{}\" data-type=\"{}\">", prefix,
                        array_name(i), arrays_[i].type);
    text += arrays_[i].base64;
    text += "</script>\n";
  }
  return text;
}

std::string ViewPage::html() const {
  return page_with(elements(""));
}

std::string html_of(const std::vector<ViewPage>& results, const std::vector<std::string>& names,
                    const std::vector<std::string>& not_shown) {
  Json kinds = Json::array(), titles = Json::array();
  for (const ViewPage& page : results) {
    kinds.push_back(page.description.at("kind"));
    titles.push_back(page.description.at("title"));
  }
  std::string text = json_element("results", {{"names", names},
                                              {"kinds", std::move(kinds)},
                                              {"titles", std::move(titles)},
                                              {"not_shown", not_shown}});
  for (std::size_t i = 0; i < results.size(); ++i) {
    text += results[i].elements(fmt::format("result-{}-", i + 1));
  }
  return page_with(text);
}

}  // namespace tpm::show
