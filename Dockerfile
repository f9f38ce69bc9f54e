# tpmkit on Debian 12: the packages are built in one stage and installed in another, which has no compiler.
#     docker build -t tpmkit .
#     docker run --rm -v "$PWD:/data" -w /data tpmkit tpm fit recording.csv
FROM debian:12 AS build
COPY . /src
RUN apt-get update && apt-get install -y --no-install-recommends ca-certificates && cd /src && scripts/packages_debian.sh

FROM debian:12-slim
COPY --from=build /src/dist /debs
RUN apt-get update \
 && apt-get install -y --no-install-recommends /debs/tpmkit_*.deb /debs/libtpmkit-haptics1_*.deb \
      /debs/python3-tpmkit_*.deb python3-numpy python3-munkres python3-matplotlib python3-h5py python3-h5netcdf \
 && rm -rf /debs /var/lib/apt/lists/*
CMD ["tpm", "--help"]
