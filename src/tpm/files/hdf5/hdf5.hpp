#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/files/replacement.hpp"

namespace tpm::files {

/// Owns one HDF5 identifier and closes it with the function that belongs to its kind. Spelled with
/// plain types, so that users of this header need no HDF5 header.
class Hdf5Handle {
 public:
  using Id = std::int64_t;
  using Closer = int (*)(Id);
  Hdf5Handle() = default;
  Hdf5Handle(Id id, Closer closer) : id_(id), closer_(closer) {}
  ~Hdf5Handle() { reset(); }
  Hdf5Handle(Hdf5Handle&& other) noexcept;
  Hdf5Handle& operator=(Hdf5Handle&& other) noexcept;
  Hdf5Handle(const Hdf5Handle&) = delete;
  Hdf5Handle& operator=(const Hdf5Handle&) = delete;

  [[nodiscard]] Id get() const noexcept { return id_; }
  [[nodiscard]] bool valid() const noexcept { return id_ >= 0; }
  void reset() noexcept;

 private:
  Id id_ = -1;
  Closer closer_ = nullptr;
};

class Contained;

/// Writes an HDF5 file through a Replacement. HDF5 itself, which crashes if memory is short, runs
/// in a child process (contained.hpp) and arranges the file; numbers are written past it, by this
/// process, to where they stand. commit() adds a check sum (checksum.hpp), passes it to the disk
/// and gives it its name. A writer that is destroyed without commit() leaves nothing behind. Paths
/// inside the file are absolute ("/curves/a/time"); groups on the way are created. No time stamps
/// are stored, so that the same content gives the same bytes. Errors are Error(environment).
class Hdf5Writer {
 public:
  explicit Hdf5Writer(std::filesystem::path path);
  ~Hdf5Writer();
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;

  /// Asks the disk for so many bytes beforehand.
  void reserve(std::uint64_t bytes);

  void group(const std::string& name);
  void numbers(const std::string& name, const std::vector<double>& values);
  /// Rows of `columns` numbers each, one after the other.
  void table(const std::string& name, const std::vector<double>& values, std::size_t columns);
  /// A list (one column), or rows of `columns` whole numbers each.
  void integers(const std::string& name, const std::vector<std::int32_t>& values,
                std::size_t columns);
  void long_integers(const std::string& name, const std::vector<std::int64_t>& values);
  void bytes(const std::string& name, const std::vector<std::uint8_t>& values);
  void texts(const std::string& name, const std::vector<std::string>& values);
  /// Attaches a text to a group or dataset that stands already.
  void attribute(const std::string& object, const std::string& name, const std::string& text);
  /// Attaches ASCII characters of a fixed number, as VTK wants to read them.
  void fixed_text_attribute(const std::string& object, const std::string& name,
                            const std::string& text);
  /// Attaches whole numbers; a single one as a scalar.
  void attribute(const std::string& object, const std::string& name,
                 const std::vector<std::int64_t>& values);
  void real_attribute(const std::string& object, const std::string& name, double value);

  /// Numbers over several dimensions, to be written in parts. What is never written is zero.
  enum class Number { float64, int64, int32, uint8 };
  void array(const std::string& name, Number kind, const std::vector<std::uint64_t>& extents);
  /// Writes the numbers from `first` on, counted row by row through all dimensions, of the kind
  /// that the array has. Straight to where they stand in the file, past HDF5, which does one thing
  /// at a time: several threads may write while nobody calls another function.
  template <class T>
  void part(const std::string& name, std::uint64_t first, std::span<const T> values) const {
    write_at(places_.at(name) + first * sizeof(T), std::as_bytes(values));
  }

  /// Makes a list the coordinate of a dimension: readers name the dimension after it.
  void dimension_scale(const std::string& name);
  void attach_scale(const std::string& array, unsigned dimension, const std::string& scale);
  void commit();

 private:
  [[nodiscard]] std::uint64_t arrange(const std::string& name, Number kind,
                                      const std::vector<std::uint64_t>& extents);
  void write_at(std::uint64_t place, std::span<const std::byte> values) const;

  std::filesystem::path path_;
  Replacement place_;
  std::unique_ptr<Contained> child_;
  std::map<std::string, std::uint64_t> places_;  ///< of arrays, in bytes from the file's beginning
};

enum class ChecksumState;

/// Reads an HDF5 file, of which nothing is trusted: a child process reads it with limits of memory
/// and processor time (contained.hpp), and content that lies outside the file is refused. A file
/// whose check sum is wrong is not opened. Every error is one line, Error(bad_input) with file and
/// object name.
class Hdf5Reader {
 public:
  explicit Hdf5Reader(std::filesystem::path path);
  ~Hdf5Reader();
  Hdf5Reader(Hdf5Reader&&) noexcept;
  Hdf5Reader& operator=(Hdf5Reader&&) noexcept;
  Hdf5Reader(const Hdf5Reader&) = delete;
  Hdf5Reader& operator=(const Hdf5Reader&) = delete;

  /// True if the file has a check sum, which then is right.
  [[nodiscard]] bool has_checksum() const noexcept;

  [[nodiscard]] bool has(const std::string& name) const;
  /// Names of the members of a group, in alphabetical order.
  [[nodiscard]] std::vector<std::string> members(const std::string& group) const;
  [[nodiscard]] std::vector<double> numbers(const std::string& name) const;
  /// The rows of a table, one after the other.
  [[nodiscard]] std::vector<double> table(const std::string& name) const;
  /// Of an array of numbers of any kind.
  [[nodiscard]] std::vector<std::uint64_t> extents(const std::string& name) const;
  /// Numbers of an array of any kind: `counts` of them from `first` on along each dimension.
  [[nodiscard]] std::vector<double> part(const std::string& name,
                                         const std::vector<std::uint64_t>& first,
                                         const std::vector<std::uint64_t>& counts) const;
  [[nodiscard]] std::vector<std::string> texts(const std::string& name) const;
  [[nodiscard]] bool has_attribute(const std::string& object, const std::string& name) const;
  [[nodiscard]] std::string attribute(const std::string& object, const std::string& name) const;
  /// Of a single number of any kind.
  [[nodiscard]] double number_attribute(const std::string& object, const std::string& name) const;

 private:
  template <class Result, class... Parts>
  [[nodiscard]] Result ask(const Parts&... request) const;

  std::filesystem::path path_;
  ChecksumState check_sum_{};
  std::unique_ptr<Contained> child_;
};

}  // namespace tpm::files
