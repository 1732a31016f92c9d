#!/bin/sh
# Build the wheel, install it in a new environment without the checkout, build a finger there and
# estimate a force. Run from the root of the checkout; PYTHON names the interpreter.
set -eu
python=${PYTHON:-python3}
here=$(pwd)
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT

"$python" -m venv "$place/env"
"$place/env/bin/pip" wheel --quiet --disable-pip-version-check --no-deps --wheel-dir "$place" "$here"
rm -rf "$here/build"
"$place/env/bin/pip" install --quiet --disable-pip-version-check \
    --constraint "$here/requirements/constraints.txt" "$(ls "$place"/*.whl)[cad,vision]"

cd "$place"
PATH="$place/env/bin:$PATH"
gelslim --version
gelslim examples
gelslim new --camera ov9281 mono
gelslim check mono.yaml
gelslim new --from mini20 mine
gelslim build mine.yaml -o mine
gelslim new --from press_sphere press
# A push of a fifth of the gel's thickness in few steps: --gel auto takes the neo-Hookean law there.
sed -i.bak -e 's/depth_mm: 0.8/depth_mm: 0.4/' -e 's/steps: 16/steps: 4/' press.yaml
gelslim simulate press.yaml -o press
gelslim bundle gelslim2.yaml --no-ladder -o sensor
# The first frame of the scene shows the untouched gel.
reference=$(find press/frames -name '*.png' | sort | head -n 1)
gelslim calibrate sensor "$reference" -o calibration.json
gelslim force sensor press/frames -c calibration.json -r "$reference" --indenter sphere:10 --gel auto -o run
tail -n 1 run/wrenches.csv
python - "$here" <<'EOF'
import csv
import sys

import gelslim

if gelslim.__file__.startswith(sys.argv[1]):
    sys.exit("the checkout was imported, not the wheel")
with open("run/wrenches.csv", newline="") as stream:
    rows = list(csv.DictReader(line for line in stream if not line.startswith("#")))
with open("press/truth.csv", newline="") as stream:
    truth = list(csv.DictReader(line for line in stream if not line.startswith("#")))
name = next(key for key in rows[-1] if key.startswith("fz"))
found, true = float(rows[-1][name]), float(truth[-1][next(k for k in truth[-1] if k.startswith("fz"))])
print(f"normal force {found:.2f} N, true {true:.2f} N")
if abs(found - true) > 0.2 * abs(true):
    sys.exit("the normal force is off by more than 20 %")
EOF
echo "The wheel builds a finger and estimates a force."
