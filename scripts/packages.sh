# shellcheck shell=bash
# The Debian packages that the project needs: the one list. Sourced, not run.

# What builds and runs the program and draws its figures.
packages_run=(
  g++ cmake ninja-build
  libeigen3-dev libceres-dev libsundials-dev libboost-dev
  libhdf5-dev nlohmann-json3-dev libcsv-dev libutfcpp-dev libssl-dev
  libmuparser-dev libcpp-httplib-dev pkg-config libcli11-dev libfmt-dev libnanoflann-dev
  libtbb-dev zlib1g-dev libdeflate-dev libminizip-dev libmetis-dev
  python3 python3-numpy python3-matplotlib
)

# What the Python package needs to be built, installed and used.
packages_python=(
  pybind11-dev python3-dev python3-setuptools python3-wheel python3-pip python3-venv
  python3-numpy python3-pandas python3-xarray python3-matplotlib python3-h5py python3-h5netcdf
)

# What makes Debian packages and looks at them.
packages_debian=(
  dpkg-dev file lintian
)

# What the tests need besides.
packages_test=(
  catch2 python3-scipy python3-h5py python3-xarray python3-h5netcdf python3-jsonschema python3-yaml
)

# What checks the sources, and programs that have to read what tpm writes.
packages_check=(
  git clang-format clang-tidy chromium python3-paraview python3-nbconvert python3-ipykernel
)

# What builds the site (scripts/docs.sh). CI installs it only where the site is wanted.
packages_docs=(
  python3-sphinx furo python3-breathe python3-myst-parser libjs-mathjax doxygen
)
