#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "tpm/law/contact_history.hpp"
#include "tpm/law/depth_pieces.hpp"

namespace tpm::law {

/// V(u) along the pieces in the first column, its derivatives by the kernel's parameters in the
/// others.
class KernelTables {
 public:
  KernelTables(const LawAtParameters& law, const DepthPieces& pieces, double start, Want want);

  /// Parameter of each column after the first.
  [[nodiscard]] const std::vector<int>& parameters() const { return parameters_; }

  Eigen::ArrayXXd begin;                  ///< a row for each piece
  Eigen::ArrayXXd end;                    ///< row 0 is the start, row k + 1 the end of piece k
  std::array<Eigen::ArrayXXd, 3> middle;  ///< within curved pieces; other rows are 0

 private:
  using Row = Eigen::Array<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, 6>;

  [[nodiscard]] Row row_of(const KernelShape::Values& k, bool touching) const;
  [[nodiscard]] Row slopes_of(const KernelShape::Tangent& k) const;
  void fill(const DepthPieces& pieces, double start);
  void fill_straight_kernel(const DepthPieces& pieces, double start);
  void fill_middle(Eigen::Index k, const DepthPiece& piece, const KernelShape::Jet& from,
                   const KernelShape::Jet& to);

  const LawAtParameters& law_;
  std::vector<int> parameters_;
};

}  // namespace tpm::law
