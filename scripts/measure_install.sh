#!/usr/bin/env bash
# Installs the packages of dist/ (scripts/packages_debian.sh) on a bare Debian 12 root in a folder, and
# prints how long that takes: download and installation apart, then `tpm fit recording.csv` and
# `import tpmkit` together, which must end within 10 s. No compiler is installed. Needs root and debootstrap;
# uses the package sources of this machine. Nothing outside a temporary folder is changed, but for the base
# system, which is kept in ${XDG_CACHE_HOME:-~/.cache}/tpmkit-bare.
set -euo pipefail
cd "$(dirname "$0")/.."
cache=${XDG_CACHE_HOME:-$HOME/.cache}/tpmkit-bare
base=$cache/base
die() { printf 'measure_install.sh: %s\n' "$*" >&2; exit 1; }
[ "$(id -u)" = 0 ] || die "needs root for a chroot"
command -v debootstrap >/dev/null || die "needs debootstrap (Debian: apt-get install debootstrap)"
compgen -G 'dist/*.deb' >/dev/null || die "no packages in dist; expected those of scripts/packages_debian.sh"

suite=bookworm
mirror=$(apt-get indextargets --format '$(REPO_URI)' "Codename: $suite" 2>/dev/null | head -n 1)
[ -n "$mirror" ] || die "this machine has no package source of $suite"
if [ ! -f "$base/etc/debian_version" ]; then
  mkdir -p "$base"
  debootstrap --variant=minbase --include=ca-certificates "$suite" "$base" "$mirror" \
    >"$cache/debootstrap.log" 2>&1 || { tail -n 5 "$cache/debootstrap.log" >&2; rm -rf "$base"; die "debootstrap failed"; }
  rm -rf "$base"/etc/apt/sources.list*
  mkdir -p "$base/etc/apt/sources.list.d"
  if [ -f /etc/apt/sources.list.d/debian.sources ]; then
    cp /etc/apt/sources.list.d/debian.sources "$base/etc/apt/sources.list.d/"
  else
    cp /etc/apt/sources.list "$base/etc/apt/"
  fi
  for file in /etc/apt/apt.conf.d/*; do
    if grep -qiE 'proxy|verify|cert' "$file"; then cp "$file" "$base/etc/apt/apt.conf.d/"; fi
  done
fi
root=$(mktemp -d "$cache/try.XXXXXX")
cleanup() {
  for place in dev/shm dev proc; do
    if mountpoint -q "$root/$place"; then umount -l "$root/$place"; fi
  done
  rm -rf "$root"
}
trap cleanup EXIT
cp -a "$base/." "$root/"
cp -L /etc/resolv.conf "$root/etc/resolv.conf"
cp -L /etc/hosts "$root/etc/hosts"
if compgen -G '/usr/local/share/ca-certificates/*' >/dev/null; then
  cp -a /usr/local/share/ca-certificates/. "$root/usr/local/share/ca-certificates/"
  chroot "$root" update-ca-certificates >/dev/null 2>&1
fi
mount -t proc proc "$root/proc"
mount --bind /dev "$root/dev"
mount -t tmpfs tmpfs "$root/dev/shm"
mkdir "$root/debs"
cp dist/*.deb "$root/debs/"
inside() {
  env -i HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive PATH=/usr/sbin:/usr/bin:/sbin:/bin \
    $(env | grep -iE '^(http|https|no)_proxy=' || true) chroot "$root" /bin/bash -c "$1"
}
seconds() { awk -v from="$1" -v to="$(date +%s.%N)" 'BEGIN {printf "%.1f", to - from}'; }

# Debian's matplotlib wants scipy, and with it g++, or munkres instead.
wanted="/debs/tpmkit_*.deb /debs/libtpmkit-haptics1_*.deb /debs/python3-tpmkit_*.deb
        python3-numpy python3-munkres python3-matplotlib"
wanted=${wanted//$'\n'/ }
inside "apt-get -qq update" || die "apt-get update failed"
before=$(inside "dpkg-query -f '.\n' -W | wc -l")
start=$(date +%s.%N)
inside "apt-get -qq -y --no-install-recommends --download-only install $wanted" >"$cache/apt.log" 2>&1 ||
  { tail -n 5 "$cache/apt.log" >&2; die "apt-get could not download"; }
echo "download: $(seconds "$start") s"
start=$(date +%s.%N)
inside "apt-get -qq -y --no-install-recommends install $wanted" >"$cache/apt.log" 2>&1 ||
  { tail -n 5 "$cache/apt.log" >&2; die "apt-get could not install"; }
echo "installation: $(seconds "$start") s, $(($(inside "dpkg-query -f '.\n' -W | wc -l") - before)) packages"
for compiler in cc gcc g++ c++ clang; do
  if inside "command -v $compiler" >/dev/null; then die "a compiler was installed: $compiler"; fi
done

# A synthetic recording, made by the package itself: real ones are not shipped.
inside "mkdir /work && cd /work && python3 - <<'END'
import numpy, tpmkit
t = numpy.linspace(0, 12.5, 501)
d = numpy.minimum(6e-3 * t, 3e-3)
law = tpmkit.Law('linear-1', {'k_inf_N_per_m': 60, 'k1_N_per_m': 45, 'tau1_s': 2})
f = law.respond(tpmkit.Protocol.history(t, d), t) + 2e-4 * numpy.random.default_rng(1).standard_normal(t.size)
numpy.savetxt('recording.csv', numpy.column_stack([t, 1e3 * d, f]), '%.9g', ',', header='time (s),depth (mm),force (N)', comments='')
END"
start=$(date +%s.%N)
inside "cd /work && tpm fit recording.csv >fit.txt"
fit=$(seconds "$start")
start=$(date +%s.%N)
inside "cd /work && python3 -c 'import tpmkit'"
import=$(seconds "$start")
echo "tpm fit recording.csv: $fit s; import tpmkit: $import s"
inside "cd /work && grep -m 1 linear-1 fit.txt && ls recording_fit"
awk -v a="$fit" -v b="$import" 'BEGIN {exit !(a + b < 10)}' || die "together above 10 s"
