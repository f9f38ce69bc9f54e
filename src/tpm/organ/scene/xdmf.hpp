#pragma once
#include <string>
#include <string_view>

namespace tpm::organ {

/// Parts of an XDMF that points into an HDF5 file beside it.
class XdmfSource {
 public:
  /// @param file name of the HDF5 file, without its folder
  explicit XdmfSource(std::string_view file);

  enum class Number { whole, real };
  /// @param shape such as "424 3"
  [[nodiscard]] std::string item(std::string_view dataset, std::string_view shape,
                                 Number number) const;

  enum class Centre { node, cell };
  /// One number for each point or cell.
  [[nodiscard]] std::string scalar(std::string_view name, std::string_view dataset, Centre centre,
                                   std::size_t size, Number number) const;
  /// Three numbers for each point.
  [[nodiscard]] std::string vector(std::string_view name, std::string_view dataset,
                                   std::size_t size) const;

  /// Spheres as points at positions.
  [[nodiscard]] std::string points(std::string_view position, std::size_t spheres) const;
  /// Bonds as lines between points at positions.
  [[nodiscard]] std::string lines(std::string_view position, std::size_t spheres,
                                  std::size_t bonds) const;

 private:
  [[nodiscard]] std::string geometry(std::string_view position, std::size_t spheres) const;
  std::string file_;
};

}  // namespace tpm::organ
