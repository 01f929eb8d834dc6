"""bench.py --only sequence: what a frame of an animation takes beside its drawing. Sixty frames of which
only the eye differs, in one process; the first two make everything and are not counted."""

import json
import math
import os
import subprocess
import tempfile

FRAMES, WARM = 60, 2
SCENES = ("torus-fur", "torus-chain")


def turning(scene):
    """The eye goes round the target by a degree and a half a frame; frames of 512 x 512."""
    camera = {"eye": [0, -3, 2.2], "target": [0, 0, 0], **scene.get("camera", {})}
    (x, y, z), (cx, cy, _) = camera.pop("eye"), camera["target"]
    keys = []
    for frame in range(FRAMES):
        c, s = math.cos(math.radians(1.5 * frame)), math.sin(math.radians(1.5 * frame))
        keys.append({"frame": frame, "value": [cx + c * (x - cx) - s * (y - cy), cy + s * (x - cx) + c * (y - cy), z]})
    scene = {**scene, "camera": camera}
    scene.pop("report", None)
    scene.pop("target", None)
    return {"frames": FRAMES, "scene": scene, "tracks": [{"pointer": "/camera/eye", "keys": keys}]}


def bench_sequence(pelt, examples, spread, repeats):
    """A frame in all, and all of it but encoding, as ratios to its own draw time."""
    del repeats  # sixty frames are enough
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in SCENES:
            with open(os.path.join(examples, name + ".json")) as file:
                sequence = turning(json.load(file))
            path, index = os.path.join(folder, "s.json"), os.path.join(folder, "i.json")
            with open(path, "w") as file:
                json.dump(sequence, file)
            subprocess.run([pelt, "render", path, "--frames", "-o", os.path.join(folder, "f%d.png"), "--assets",
                            examples, "--report", index, "--quiet"], check=True)
            with open(index) as file:
                frames = json.load(file)["frames"][WARM:]
            made = sorted({part for frame in frames for part, count in frame["reuse"].items() if count["renewed"]})
            times = [frame["timing_ms"] for frame in frames]
            draw = spread([t["draw"] for t in times])
            picture = spread([(t["total"] - t["encode"]) / t["draw"] for t in times])
            stages = {stage: spread([t[stage] for t in times])["median"] for stage in times[0] if stage != "total"}
            rest = ", ".join(f"{stage} {ms:.2f}" for stage, ms in stages.items() if ms >= 0.05 and stage != "draw")
            rows.append({"figure": f"{name}, frame to its draw time", "asked": "at most 1.10", "measured": picture,
                         "unit": "x", "digits": 3, "met": picture["median"] <= 1.1,
                         "note": f"draw {draw['median']:.1f} ms; {rest} ms; made anew: {', '.join(made)}"})
            rows.append({"figure": f"{name}, with its PNG", "unit": "x", "digits": 3,
                         "measured": spread([t["total"] / t["draw"] for t in times])})
    return rows
