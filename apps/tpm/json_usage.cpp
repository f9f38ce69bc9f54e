#include "json_usage.hpp"

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "option_kinds.hpp"
#include "tpm/base/namespaces.hpp"

namespace tpm::app {
namespace {

using files::Json;

/// "TEXT:{text,json}" lists two.
std::vector<std::string> listed_values(std::string_view type) {
  const auto open = type.find('{'), close = type.rfind('}');
  std::vector<std::string> values;
  if (open == std::string_view::npos || close == std::string_view::npos) return values;
  std::string_view rest = type.substr(open + 1, close - open - 1);
  while (!rest.empty()) {
    const auto comma = rest.find(',');
    values.emplace_back(rest.substr(0, comma));
    rest.remove_prefix(comma == std::string_view::npos ? rest.size() : comma + 1);
  }
  return values;
}

Json names_of(const CLI::Option& option) {
  if (option.get_positional()) return Json::array({option.get_name(true)});
  Json names = Json::array();
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

Json option_json(const CLI::Option& option) {
  Json json{{"names", names_of(option)}, {"text", option.get_description()}};
  if (option.get_group() != "Options") json["group"] = option.get_group();
  if (option.get_required()) json["required"] = true;
  if (option.get_items_expected_max() == 0) json["flag"] = true;
  if (option.get_items_expected_max() > 1) json["several"] = true;
  if (!option.get_default_str().empty()) json["default"] = option.get_default_str();
  const std::string_view kind = kind_of_option(option.get_name());
  if (!kind.empty() && option.get_items_expected_max() != 0) json["kind"] = kind;
  if (const auto values = listed_values(option.get_type_name()); !values.empty()) {
    json["values"] = values;
  }
  std::set<std::string> excludes;
  for (const CLI::Option* other : option.get_excludes()) {
    for (const std::string& name : other->get_lnames()) excludes.insert("--" + name);
  }
  if (!excludes.empty()) json["excludes"] = excludes;
  return json;
}

}  // namespace

Json json_usage(const CLI::App& app) {
  Json arguments = Json::array(), options = Json::array(), commands = Json::array();
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;  // hidden
    (option->get_positional() ? arguments : options).push_back(option_json(*option));
  }
  for (const CLI::App* command : app.get_subcommands({})) commands.push_back(json_usage(*command));
  Json json{{"name", app.get_name()}, {"text", app.get_description()}};
  if (!app.get_group().empty() && app.get_group() != "Subcommands") json["group"] = app.get_group();
  if (!arguments.empty()) json["arguments"] = std::move(arguments);
  json["options"] = std::move(options);
  if (const std::string footer = app.get_footer(); !footer.empty()) json["footer"] = footer;
  if (!commands.empty()) json["commands"] = std::move(commands);
  return json;
}

}  // namespace tpm::app
