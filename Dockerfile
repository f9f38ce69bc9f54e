# tpmkit on Debian 12: the packages are built in one stage and installed in another, which has no compiler. The program
# runs as a user without rights, in /data.
#     docker build -t tpmkit .
#     docker run --rm -v "$PWD:/data" -u "$(id -u):$(id -g)" tpmkit fit recording.csv
FROM debian:12 AS build
WORKDIR /src
COPY . .
RUN apt-get update && apt-get install -y --no-install-recommends ca-certificates && scripts/packages_debian.sh

FROM debian:12-slim
COPY --from=build /src/dist /debs
RUN apt-get update \
 && apt-get install -y --no-install-recommends /debs/tpmkit_*.deb /debs/libtpmkit-haptics1_*.deb \
      /debs/python3-tpmkit_*.deb python3-numpy python3-munkres python3-matplotlib python3-h5py python3-h5netcdf \
 && rm -rf /debs /var/lib/apt/lists/* \
 && useradd --uid 1000 --create-home --shell /usr/sbin/nologin tpm && install -d -o tpm -g tpm /data
USER tpm
ENV MPLCONFIGDIR=/tmp/matplotlib
WORKDIR /data
ENTRYPOINT ["tpm"]
CMD ["--help"]
