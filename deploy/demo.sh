#!/usr/bin/env bash
# make demo: starts a daemon on a free port, posts the demo scene with its asset, leaves demo.png and
# demo.json (the report) in the working directory, and prints what each stage took.
# Usage: deploy/demo.sh BUILD
set -eu
pelt=$1/pelt
examples=$(dirname "$0")/../api/examples
scratch=$(mktemp -d)
daemon=

cleanup() {
    if [ -n "$daemon" ] && kill -TERM "$daemon" 2>/dev/null; then
        wait "$daemon" || true
    fi
    rm -rf "$scratch"
}
trap cleanup EXIT

# The daemon says on its first line where it listens, once it can answer: nothing to poll for.
mkfifo "$scratch/out"
"$pelt" serve --listen 127.0.0.1:0 >"$scratch/out" 2>"$scratch/log" &
daemon=$!
exec 3<"$scratch/out"
read -r line <&3 || { echo "demo: the daemon did not start:" >&2; cat "$scratch/log" >&2; exit 1; }
url=$(grep -oE 'http://[^ ]+' <<<"$line")
echo "demo: $line"

curl --fail-with-body --silent --show-error --noproxy '*' \
    --header 'Accept: application/json' \
    --form "scene=@$examples/demo.json;type=application/json" \
    --form "assets/bunny.glb=@$examples/assets/bunny.glb" \
    --output "$scratch/reply.json" "$url/v1/render" || { cat "$scratch/reply.json" >&2; exit 1; }

/usr/bin/python3 - "$scratch/reply.json" <<'PYTHON'
import base64, json, sys

reply = json.load(open(sys.argv[1]))
report = reply["report"]
open("demo.png", "wb").write(base64.b64decode(reply["image"]["data"]))
json.dump(report, open("demo.json", "w"), indent=1)
timing, work, renderer = report["timing_ms"], report["work"], report["renderer"]
print(f"demo: {work['tetrahedra']} tetrahedra, {work['samples']} samples; "
      f"{renderer['backend']}, {renderer['gl_renderer']}")
print(f"      loaded: {', '.join(renderer['loaded']) or 'nothing'}; clock: {report['clock']}; "
      f"{'cold' if report['cold'] else 'warm'}")
for stage, ms in timing.items():
    if stage != "total":
        print(f"  {stage:<10} {ms:9.2f} ms")
print(f"  {'total':<10} {timing['total']:9.2f} ms")
PYTHON
echo "demo: the picture is demo.png, the whole report demo.json"
