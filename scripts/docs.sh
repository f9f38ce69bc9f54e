#!/usr/bin/env bash
# Builds the site into build/site/html from the pages of docs and reports, the commands' own help, the schemas, and
# the comments of the C, C++ and Python interfaces. A warning is an error, a broken link too. Uses no network but to
# install what is missing. Open build/site/html/index.html.
#     scripts/docs.sh [TPM]     TPM: the program whose help is shown; default build/release/tpm, built if missing
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/install_packages.sh

install_missing "to build the site" "${packages_docs[@]}"
tpm=${1:-build/release/tpm}
if [ $# = 0 ] && [ ! -x "$tpm" ]; then
  install_missing "to build tpm" "${packages_run[@]}"
  configure release -DTPM_BUILD_TESTS=OFF
  build release tpm
fi
folder=build/site
mkdir -p "$folder"

step "gathering pages"
/usr/bin/python3 scripts/make_site.py . "$tpm" "$folder/source"

step "reading the comments of the interfaces (doxygen)"
mkdir -p "$folder/doxygen"
doxygen - >"$folder/doxygen.log" 2>&1 <<END || { tail -n 15 "$folder/doxygen.log" >&2; die "doxygen failed"; }
PROJECT_NAME = tpmkit
INPUT = include/tpmkit
FULL_PATH_NAMES = YES
STRIP_FROM_PATH = include src
OUTPUT_DIRECTORY = $folder/doxygen
EXTENSION_MAPPING = h=C
GENERATE_XML = YES
TYPEDEF_HIDES_STRUCT = YES
GENERATE_HTML = NO
GENERATE_LATEX = NO
QUIET = YES
WARN_IF_UNDOCUMENTED = NO
JAVADOC_AUTOBRIEF = YES
MACRO_EXPANSION = YES
EXPAND_ONLY_PREDEF = YES
PREDEFINED = TPM_HAPTICS_API= TPM_DEVICE_API= __attribute__(x)=
END

step "building (sphinx)"
rm -rf "$folder/html"  # a page that is gone is no page of the site
TPMKIT_VERSION=$("$tpm" version | cut -d' ' -f2) TPMKIT_DOXYGEN=$PWD/$folder/doxygen/xml \
  /usr/bin/python3 -m sphinx -q -W --keep-going -b html -d "$folder/doctrees" "$folder/source" "$folder/html"
mathjax=/usr/share/javascript/mathjax
mkdir -p "$folder/html/_static/mathjax"
(cd "$mathjax" && cp -rL --parents MathJax.js config/TeX-AMS_SVG-full.js extensions jax/element jax/input/TeX jax/output/SVG/*.js \
  jax/output/SVG/autoload jax/output/SVG/fonts/TeX "$OLDPWD/$folder/html/_static/mathjax")
cat >"$folder/html/index.html" <<'END'
<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>tpmkit</title>
<meta http-equiv="refresh" content="0; url=docs/site/index.html"></head>
<body><a href="docs/site/index.html">tpmkit</a></body></html>
END

step "checking links"
/usr/bin/python3 tests/programs/site_pages.py links "$folder/html"
step "done: $PWD/$folder/html/index.html"
