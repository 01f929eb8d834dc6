#!/usr/bin/env bash
# pelt reference: pictures, errors of another picture, progress, exit codes.
set -u
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder" || exit 1
fail() { echo "FAIL: $*"; exit 1; }
expect() { # CODE COMMAND...
    local wanted=$1 code=0
    shift
    "$@" >out 2>err || code=$?
    [ "$code" -eq "$wanted" ] || fail "exit $code, expected $wanted: $* ($(cat err))"
}

cat >slab.json <<'END'
{"image": {"width": 24, "height": 16, "samples": 4},
 "objects": [{"shell": {"mesh": {"shape": "torus"}, "thickness": 0.2,
   "material": {"builtin": "homogeneous", "extinction": 3}}}]}
END
expect 0 "$PELT" reference slab.json -o truth.exr --verbose --threads 2
grep -q '100.0 %' err || fail "no progress: $(cat err)"
[ -s truth.exr ] || fail "no picture"
expect 0 "$PELT" reference slab.json -o again.png --quiet
if [ -s out ] || [ -s err ]; then fail "not quiet"; fi
[ "$(head -c 4 again.png | tail -c 3)" = PNG ] || fail "not a PNG"
expect 0 "$PELT" reference slab.json --compare truth.exr --flip-map map.png
grep -q 'whole *384 pixels  rmse 0.000e+00' out || fail "a picture is not itself: $(cat out)"
grep -q 'coverage *0 pixels' out || fail "coverage of the same picture"
[ -s map.png ] || fail "no map"
"$PELT" reference slab.json -o - --quiet | cmp -s - again.png || fail "other bytes on the standard output"

# The camera is framed as the paths frame it: a homogeneous shell differs by fp32 and by its sides.
expect 0 "$PELT" render slab.json -o drawn.exr --quiet
expect 0 "$PELT" reference slab.json --compare drawn.exr
grep -Eq 'touched .* rmse [0-9.]+e-0[3-9]' out || fail "far from the truth: $(cat out)"

expect 2 "$PELT" reference
expect 2 "$PELT" reference slab.json
expect 2 "$PELT" reference slab.json -o out.gif
expect 2 "$PELT" reference slab.json -o out.png --threads 0
expect 2 "$PELT" reference slab.json -o out.png --flip-map map.png
expect 2 "$PELT" reference missing.json -o out.png
echo '{"objects": []}' >bad.json
expect 3 "$PELT" reference bad.json -o out.png
expect 4 "$PELT" reference slab.json --compare again.png
sed 's/"width": 24/"width": 23/' slab.json >narrow.json
expect 4 "$PELT" reference narrow.json --compare truth.exr
echo '{"objects": [{"skeleton": {"builtin": "elm"}}]}' >elm.json
expect 5 "$PELT" reference elm.json -o out.png
grep -q '/objects/0/skeleton' err || fail "no pointer: $(cat err)"
echo "pelt reference: pictures, errors and exit codes"
