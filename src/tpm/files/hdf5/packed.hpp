#pragma once
// Internal to store/: requests to a contained process and its answers.
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "tpmkit/error.hpp"

namespace tpm::files {

/// Packs what goes between a process and its contained child (contained.hpp), both on one machine
/// and of one program: numbers as they are, lists and texts after their length.
class Packer {
 public:
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void put(const T& value) { bytes_.append(reinterpret_cast<const char*>(&value), sizeof value); }
  void put(std::string_view text) {
    put(std::uint64_t{text.size()});
    bytes_.append(text);
  }
  template <class T>
  void put(const std::vector<T>& list) {
    put(std::uint64_t{list.size()});
    if constexpr (std::is_trivially_copyable_v<T>) {
      bytes_.append(reinterpret_cast<const char*>(list.data()), list.size() * sizeof(T));
    } else {
      for (const T& value : list) put(std::string_view(value));
    }
  }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

template <class... Parts>
[[nodiscard]] std::string packed(const Parts&... parts) {
  Packer packer;
  (packer.put(parts), ...);
  return packer.take();
}

/// Takes apart what a Packer packed. The child may have been led astray by the file: nothing that
/// it says is believed, and sizes are checked against what is there.
class Unpacker {
 public:
  Unpacker(std::string_view bytes, std::string_view where) : bytes_(bytes), where_(where) {}

  template <class T>
  requires std::is_trivially_copyable_v<T>
  void take(T& value) { std::memcpy(&value, next(sizeof value), sizeof value); }
  void take(std::string& text) {
    std::uint64_t size = 0;
    take(size);
    const char* begin = next(size);
    text.assign(begin, size);
  }
  template <class T>
  void take(std::vector<T>& list) {
    std::uint64_t size = 0;
    take(size);
    if constexpr (std::is_trivially_copyable_v<T>) {
      if (size > bytes_.size() / sizeof(T)) next(bytes_.size() + 1);
      const char* begin = next(size * sizeof(T));
      list.resize(size);
      if (size > 0) std::memcpy(list.data(), begin, size * sizeof(T));
    } else {
      for (std::uint64_t i = 0; i < size; ++i) take(list.emplace_back());
    }
  }

 private:
  const char* next(std::uint64_t size) {
    if (size > bytes_.size()) {
      throw bad_input(where_, "its content crashes the reader", "a whole file");
    }
    const char* begin = bytes_.data();
    bytes_.remove_prefix(size);
    return begin;
  }
  std::string_view bytes_;
  std::string_view where_;
};

/// Takes arguments from a request, in their order, and calls with them.
/// @return what the call returns, packed; empty if that is nothing
template <class... Arguments, class Call>
[[nodiscard]] std::string answered(Unpacker& request, const Call& call) {
  std::tuple<std::remove_cvref_t<Arguments>...> arguments;
  std::apply([&](auto&... each) { (request.take(each), ...); }, arguments);
  if constexpr (std::is_void_v<std::invoke_result_t<Call, Arguments...>>) {
    std::apply(call, arguments);
    return {};
  } else {
    return packed(std::apply(call, arguments));
  }
}

}  // namespace tpm::files
