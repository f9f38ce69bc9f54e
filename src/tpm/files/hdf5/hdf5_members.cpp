#include "tpm/files/hdf5/hdf5_members.hpp"

#include <cstdint>
#include <vector>

namespace tpm::files {
namespace {

/// A dataset for each member of the objects in a list.
void write_columns(Hdf5Writer& file, const std::string& group, const Json& list) {
  for (const auto& [key, first] : list.front().items()) {
    std::vector<std::string> column;
    for (const Json& row : list) column.push_back(row.at(key).get<std::string>());
    file.texts(group + "/" + key, column);
  }
}

void write_attribute(Hdf5Writer& file, const std::string& group, const std::string& key,
                     const Json& value) {
  if (value.is_string()) {
    const auto text = value.get<std::string>();
    if (!text.empty()) file.attribute(group, key, text);
  } else if (value.is_number_float()) {
    file.real_attribute(group, key, value.get<double>());
  } else if (!value.is_null()) {
    const std::int64_t number =
        value.is_boolean() ? std::int64_t{value.get<bool>()} : value.get<std::int64_t>();
    file.attribute(group, key, std::vector<std::int64_t>{number});
  }
}

}  // namespace

void write_members(Hdf5Writer& file, const std::string& group, const Json& object) {
  for (const auto& [key, value] : object.items()) {
    const std::string path = (group == "/" ? "" : group) + "/" + key;
    if (value.is_object()) {
      file.group(path);
      write_members(file, path, value);
    } else if (value.is_array()) {
      if (!value.empty()) write_columns(file, path, value);
    } else {
      write_attribute(file, group, key, value);
    }
  }
}

}  // namespace tpm::files
