#!/usr/bin/env python3
"""Times scipy's sparse direct solver (SuperLU) on a matrix that measure_factorisation wrote; one line of JSON.

    /usr/bin/python3 scripts/growth_scipy.py MATRIX_FILE

Orders by minimum degree on A + A^T with symmetric mode, the fastest of SuperLU's for these matrices. Processor
times in s.
"""
import json
import sys
import time

import numpy as np
import scipy.sparse
import scipy.sparse.linalg


def matrix_of(path):
    sizes = np.fromfile(path, np.int64, 2)
    entries = np.fromfile(path, np.dtype([("row", "<i4"), ("column", "<i4"), ("value", "<f8")]), offset=16)
    lower = scipy.sparse.csc_matrix((entries["value"], (entries["row"], entries["column"])), shape=(sizes[0],) * 2)
    return (lower + scipy.sparse.tril(lower, -1).T).tocsc()


def main():
    matrix = matrix_of(sys.argv[1])
    right = np.ones(matrix.shape[0])
    start = time.process_time()
    factor = scipy.sparse.linalg.splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                                      options={"SymmetricMode": True})
    factorise = time.process_time() - start
    start = time.process_time()
    x = factor.solve(right)
    solve = time.process_time() - start
    print(json.dumps({"factorise_s": float(f"{factorise:.4g}"), "solve_s": float(f"{solve:.4g}"),
                      "factor_entries": int(factor.L.nnz),
                      "residual": float(f"{np.linalg.norm(matrix @ x - right) / np.linalg.norm(right):.2g}")}))


if __name__ == "__main__":
    main()
