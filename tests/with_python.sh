#!/bin/sh
# with_python.sh MODULES SCRIPT [ARGUMENT...]: runs a script with the first Python that has the modules
# (separated by commas). Exit code 77 (skipped) where there is none.
modules=$1
shift
for python in "${TPMKIT_PYTHON:-python3}" python3 /usr/bin/python3; do
  if (cd / && "$python" -c "import $modules") >/dev/null 2>&1; then
    exec "$python" "$@"
  fi
done
echo "SKIPPED: no Python has the modules $modules"
exit 77
