#!/bin/sh
# paraview_opens.sh TPM: runs paraview_opens.py with a Python that has ParaView's XDMF reader.
# Exit code 77 (skipped) where there is none.
here=$(dirname "$0")
for python in "${TPMKIT_PYTHON:-python3}" python3 /usr/bin/python3; do
  if "$python" -c 'import numpy, vtkmodules.vtkIOXdmf2' >/dev/null 2>&1; then
    exec "$python" "$here/paraview_opens.py" "$1"
  fi
done
echo "SKIPPED: no Python with ParaView's XDMF reader (Debian: python3-paraview, 757 MB)"
exit 77
