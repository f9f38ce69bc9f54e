// Times CHOLMOD's simplicial or supernodal factorisation, ordered by METIS, of a matrix that
// measure_factorisation wrote:
//
//     g++ -O3 cholmod_factor.cpp -I/usr/include/suitesparse -lcholmod -o cholmod_factor
//     cholmod_factor MATRIX_FILE [supernodal]
//
// Only a measurement: nothing of tpm links it.
#include <cholmod.h>

#include <cstdint>
#include <cstdio>
#include <ctime>

static double lap() {
  static std::clock_t last = std::clock();
  const std::clock_t now = std::clock();
  const double taken = static_cast<double>(now - last) / CLOCKS_PER_SEC;
  last = now;
  return taken;
}

int main(int argc, char** argv) {
  std::FILE* file = argc >= 2 ? std::fopen(argv[1], "rb") : nullptr;
  std::int64_t sizes[2];
  if (file == nullptr || std::fread(sizes, sizeof sizes, 1, file) != 1) return 2;
  cholmod_common common;
  cholmod_start(&common);
  common.nmethods = 1;
  common.method[0].ordering = CHOLMOD_METIS;
  common.supernodal = argc == 3 ? CHOLMOD_SUPERNODAL : CHOLMOD_SIMPLICIAL;
  const auto n = static_cast<std::size_t>(sizes[0]);
  const auto entries = static_cast<std::size_t>(sizes[1]);
  cholmod_triplet* list = cholmod_allocate_triplet(n, n, entries, -1, CHOLMOD_REAL, &common);
  for (std::size_t i = 0; i < entries; ++i) {
    if (std::fread(static_cast<int*>(list->i) + i, 4, 1, file) != 1 ||
        std::fread(static_cast<int*>(list->j) + i, 4, 1, file) != 1 ||
        std::fread(static_cast<double*>(list->x) + i, 8, 1, file) != 1) {
      return 2;
    }
  }
  list->nnz = entries;
  std::fclose(file);
  cholmod_sparse* matrix = cholmod_triplet_to_sparse(list, entries, &common);
  cholmod_free_triplet(&list, &common);
  cholmod_dense* right = cholmod_ones(n, 1, CHOLMOD_REAL, &common);
  lap();
  cholmod_factor* factor = cholmod_analyze(matrix, &common);
  const double order_s = lap();
  if (cholmod_factorize(matrix, factor, &common) == 0 || common.status != CHOLMOD_OK) {
    std::printf("{\"failed\": %d}\n", common.status);
    return 1;
  }
  const double factorise_s = lap();
  cholmod_dense* x = cholmod_solve(CHOLMOD_A, factor, right, &common);
  const double solve_s = lap();
  double minus[2] = {-1, 0}, one[2] = {1, 0};
  const double before = cholmod_norm_dense(right, 2, &common);
  cholmod_sdmult(matrix, 0, minus, one, x, right, &common);
  std::printf(
      "{\"order_s\": %.4g, \"factorise_s\": %.4g, \"solve_s\": %.4g, \"factor_entries\": %.5g, "
      "\"operations\": %.5g, \"residual\": %.2g}\n",
      order_s, factorise_s, solve_s, common.lnz, common.fl,
      cholmod_norm_dense(right, 2, &common) / before);
  return 0;
}
