#!/usr/bin/env bash
# Called by recipe.yaml in the unpacked sources: builds the two libraries that conda-forge does not have, then tpm.
#     PREFIX     where everything is installed; CMAKE_ARGS, CPU_COUNT: of the caller
#     TPM_ONLY_LIBRARIES=1     stops before tpm
set -euo pipefail
read -ra arguments <<<"${CMAKE_ARGS:-}"
common=(-G Ninja -DCMAKE_BUILD_TYPE=Release "-DCMAKE_INSTALL_PREFIX=$PREFIX" -DCMAKE_INSTALL_LIBDIR=lib "${arguments[@]}")

(cd libcsv && ./configure --prefix="$PREFIX" --libdir="$PREFIX/lib" --disable-static && make -j "${CPU_COUNT:-1}" && make install)

cmake -S cpp-httplib -B cpp-httplib/build "${common[@]}" -DBUILD_SHARED_LIBS=ON -DHTTPLIB_COMPILE=ON
cmake --build cpp-httplib/build --target install
if [[ ! -e $PREFIX/lib/pkgconfig/cpp-httplib.pc ]]; then  # Debian's package adds it to the sources
  mkdir -p "$PREFIX/lib/pkgconfig"
  printf 'prefix=%s\nName: cpp-httplib\nDescription: HTTP\nVersion: 0.11.4\nLibs: -L${prefix}/lib -lhttplib\nCflags: -I${prefix}/include %s\n' \
    "$PREFIX" "-DCPPHTTPLIB_OPENSSL_SUPPORT -DCPPHTTPLIB_ZLIB_SUPPORT -DCPPHTTPLIB_BROTLI_SUPPORT" >"$PREFIX/lib/pkgconfig/cpp-httplib.pc"
fi

if [[ -n ${TPM_ONLY_LIBRARIES:-} ]]; then exit 0; fi

export PKG_CONFIG_PATH=$PREFIX/lib/pkgconfig${PKG_CONFIG_PATH:+:$PKG_CONFIG_PATH}
cmake -S . -B build/release "${common[@]}" -DTPM_TOGETHER=ON -DTPM_BUILD_TESTS=OFF
cmake --build build/release --target tpm
cmake --install build/release --component program
