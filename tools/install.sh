#!/bin/sh
# Make .venv and install the project with the extras named in $1; says what is missing and how to get it.
set -eu
extras=$1
python=${PYTHON:-python3}

if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
    echo "gelslim-cad needs Python 3.11 or newer, not '$("$python" --version 2>&1 || true)'." >&2
    echo "On Debian: apt-get install python3 python3-venv; elsewhere: make PYTHON=/path/to/python3.11 ..." >&2
    exit 1
fi
if [ ! -x .venv/bin/pip ]; then
    "$python" -m venv .venv || {
        echo "The venv module is missing. On Debian: apt-get install python3-venv" >&2
        rm -rf .venv
        exit 1
    }
fi
echo "Installing gelslim-cad[$extras] into .venv (the first time takes a few minutes) ..."
.venv/bin/pip install --quiet --disable-pip-version-check \
    --constraint requirements/constraints.txt --editable ".[$extras]"
.venv/bin/python - <<'EOF'
import sys

PACKAGES = {
    "libGL.so.1": "libgl1",
    "libX11.so.6": "libx11-6",
    "libXrender.so.1": "libxrender1",
    "libEGL.so.1": "libegl1",
    "libexpat.so.1": "libexpat1",
}
try:
    import OCP.gp  # noqa: F401
except ImportError as error:
    missing = str(error).split(":")[0]
    package = PACKAGES.get(missing, "libgl1")
    print(f"The CAD kernel cannot load: {error}", file=sys.stderr)
    print(f"On Debian or Ubuntu: apt-get install {package}", file=sys.stderr)
    sys.exit(1)
EOF
