#include "tpm/law/kernel_tables.hpp"

#include <algorithm>

namespace tpm::law {

KernelTables::KernelTables(const LawAtParameters& law, const DepthPieces& pieces, double start,
                           Want want)
    : law_(law) {
  const KernelPlaces& p = law.place;
  if (want == Want::values_and_sensitivity) {
    for (const int place : {p.exponent, p.tension_share}) {
      if (place >= 0) parameters_.push_back(place);
    }
    if (p.tension_share >= 0) parameters_.push_back(p.spacing);
    parameters_.push_back(p.contact);
  }
  const Eigen::Index columns = 1 + std::ssize(parameters_);
  begin.resize(pieces.count(), columns);
  end.resize(pieces.count() + 1, columns);
  if (law.kernel.is_linear() && columns <= 2) {
    fill_straight_kernel(pieces, start);
    return;
  }
  if (!law.kernel.is_linear()) {
    for (auto& table : middle) table.setZero(pieces.count(), columns);
  }
  fill(pieces, start);
}

/// @param touching at u = 0 the slope just inside the contact is meant, not just outside
KernelTables::Row KernelTables::row_of(const KernelShape::Values& k, bool touching) const {
  Row row(begin.cols());
  Eigen::Index c = 0;
  row[c++] = k.value;
  if (row.size() == 1) return row;
  if (law_.place.exponent >= 0) row[c++] = k.d_exponent;
  if (law_.place.tension_share >= 0) {
    row[c++] = k.d_share;
    row[c++] = k.d_spacing;
  }
  row[c] = touching ? -k.slope : 0.0;
  return row;
}

/// d/du of what row_of gives, the last column (contact) apart.
KernelTables::Row KernelTables::slopes_of(const KernelShape::Tangent& k) const {
  return row_of({k.slope, 0.0, k.d_exponent, k.d_share, k.d_spacing}, false);
}

void KernelTables::fill_straight_kernel(const DepthPieces& pieces, double start) {
  const bool slopes = begin.cols() > 1;
  end(0, 0) = std::max(start, 0.0);
  if (slopes) end(0, 1) = start > 0.0 ? -1.0 : 0.0;
  for (Eigen::Index k = 0; k < pieces.count(); ++k) {
    const DepthPiece& piece = pieces[k];
    begin(k, 0) = std::max(piece.from, 0.0);
    end(k + 1, 0) = std::max(piece.to, 0.0);
    if (slopes) begin(k, 1) = end(k + 1, 1) = std::max(piece.from, piece.to) > 0.0 ? -1.0 : 0.0;
  }
}

void KernelTables::fill(const DepthPieces& pieces, double start) {
  KernelShape::Jet from = law_.kernel.jet(std::max(start, 0.0));
  end.row(0) = row_of(from.values, start > 0.0);
  for (Eigen::Index k = 0; k < pieces.count(); ++k) {
    const DepthPiece& piece = pieces[k];
    const bool touching = std::max(piece.from, piece.to) > 0.0;
    const bool cubic = piece.course == PieceCourse::cubic ||
                       (k + 1 < pieces.count() && pieces[k + 1].course == PieceCourse::cubic);
    const double depth = std::max(piece.to, 0.0);
    const KernelShape::Jet to =
        cubic ? law_.kernel.jet(depth) : KernelShape::Jet{law_.kernel.at(depth), {}};
    begin.row(k) = row_of(from.values, touching);
    end.row(k + 1) = row_of(to.values, touching);
    if (piece.course != PieceCourse::straight) fill_middle(k, piece, from, to);
    from = to;
  }
}

void KernelTables::fill_middle(Eigen::Index k, const DepthPiece& piece,
                               const KernelShape::Jet& from, const KernelShape::Jet& to) {
  const double a = std::max(piece.from, 0.0);
  const double b = std::max(piece.to, 0.0);
  if (piece.course == PieceCourse::quartic) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double share = 0.25 * static_cast<double>(i + 1);
      middle[i].row(k) = row_of(law_.kernel.at((1.0 - share) * a + share * b), true);
    }
    return;
  }
  const Row slope0 = slopes_of(from.tangent);
  const Row slope1 = slopes_of(to.tangent);
  const Eigen::Index contact = begin.cols() - 1;
  for (Eigen::Index c = 0; c < std::max<Eigen::Index>(contact, 1); ++c) {
    const KernelBetween v = kernel_between(b - a, begin(k, c), slope0[c], end(k + 1, c), slope1[c]);
    for (std::size_t i = 0; i < 3; ++i) {
      middle[i](k, c) = v.value[i];
      if (c == 0 && contact > 0) middle[i](k, contact) = -v.slope[i];
    }
  }
}

}  // namespace tpm::law
