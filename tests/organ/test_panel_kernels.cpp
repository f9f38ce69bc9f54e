#include "tpm/organ/linear/panel_kernels.hpp"

#include <catch2/catch.hpp>
#include <random>

#include "tpm/organ/linear/aligned_floats.hpp"

using namespace tpm;
using namespace tpm::organ;

TEST_CASE("packed panels are the matrix to 1/256 of each number, on every processor") {
  std::mt19937 random(0);
  std::normal_distribution<double> number;
  AlignedWords words;
  for (const Eigen::Index rows : {1, 8, 9, 16, 17, 24, 25, 33, 47, 64, 65}) {
    for (const Eigen::Index columns : {1, 2, 3, 4, 5, 9}) {
      CAPTURE(rows, columns);
      const Eigen::MatrixXd matrix = Eigen::MatrixXd::NullaryExpr(
          rows, columns, [&] { return number(random) * std::exp(4.0 * number(random)); });
      const auto count = static_cast<std::size_t>(rows);
      words.assign(static_cast<std::size_t>(columns) * PackedPanel::words_of(count), 0);
      pack_panel(matrix, words);
      const PackedPanel panel{words.data(), PackedPanel::filled(count),
                              static_cast<std::size_t>(columns)};
      AlignedFloats x(std::max<std::size_t>(panel.rows, 16), 0.0F);
      AlignedFloats out(x.size(), 0.0F);
      for (const bool portable : {false, true}) {
        const PanelKernels& kernels = panel_kernels(portable);
        // Column by column: what is kept of every number.
        Eigen::MatrixXd kept(panel.rows, columns);
        for (Eigen::Index j = 0; j < columns; ++j) {
          std::fill(x.begin(), x.end(), 0.0F);
          x[static_cast<std::size_t>(j)] = 1.0F;
          kernels.packed_times(panel, x.data(), out.data());
          for (std::size_t i = 0; i < panel.rows; ++i) {
            kept(static_cast<Eigen::Index>(i), j) = static_cast<double>(out[i]);
          }
        }
        CHECK((kept.topRows(rows) - matrix).cwiseQuotient(matrix).cwiseAbs().maxCoeff() <=
              1.0 / 256.0);
        // What fills a panel up is next to nothing.
        const Eigen::Index beyond = kept.rows() - rows;
        CHECK((beyond == 0 || kept.bottomRows(beyond).cwiseAbs().maxCoeff() < 1e-35));

        // Products with many numbers at once are those of what is kept.
        Eigen::VectorXd by(kept.rows());
        std::fill(x.begin(), x.end(), 0.0F);
        for (Eigen::Index i = 0; i < kept.rows(); ++i) {
          x[static_cast<std::size_t>(i)] = static_cast<float>(number(random));
          by[i] = static_cast<double>(x[static_cast<std::size_t>(i)]);
        }
        std::fill(out.begin(), out.end(), 1.0F);
        kernels.subtract_packed_transposed(panel, x.data(), out.data());
        for (Eigen::Index j = 0; j < columns; ++j) {
          const double size = kept.col(j).cwiseAbs().dot(by.cwiseAbs()) + 1.0;
          CHECK(std::abs(static_cast<double>(out[static_cast<std::size_t>(j)]) - 1.0 +
                         kept.col(j).dot(by)) <= 1e-6 * size);
        }
        if (columns > kept.rows()) continue;
        kernels.packed_times(panel, x.data(), out.data());
        for (Eigen::Index i = 0; i < kept.rows(); ++i) {
          const Eigen::RowVectorXd row = kept.row(i);
          const double size = row.cwiseAbs().dot(by.head(columns).cwiseAbs());
          CHECK(std::abs(static_cast<double>(out[static_cast<std::size_t>(i)]) -
                         row.dot(by.head(columns))) <= 1e-6 * size + 1e-35);
        }
      }
    }
  }
}
