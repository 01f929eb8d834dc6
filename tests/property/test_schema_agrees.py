#!/usr/bin/python3
"""The reader (scene_read.c) and the schema (scene.schema.json) agree, over thousands of documents
made from the examples by mutation; a real validator is the judge, python3-jsonschema.

For every document:
- what the schema refuses, the reader refuses;
- what the schema accepts, the reader refuses if and only if a rule below says so, and then each of
  its faults bears the text of that rule's row in api/refusals.def;
- each fault's pointer leads to a value of the document;
- what the reader accepts it writes back as a scene that the schema accepts, and that reads and
  writes back to the same bytes.

The rules are written here a second time, from the documentation, so that they can disagree."""

import copy
import json
import math
import os
import random
import re
import subprocess
import sys
import time

import jsonschema

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = os.environ.get("PELT_BUILD", os.path.join(ROOT, "build"))
API = os.path.join(ROOT, "api")
SEED, MUTATIONS, TEXTS = 20240229, 2400, 500
UNPARSED = object()

with open(os.path.join(API, "scene.schema.json")) as file:
    SCHEMA = json.load(file)
with open(os.path.join(API, "refusals.def")) as file:
    REFUSALS = dict(re.findall(r'^REFUSAL\((\w+), \w+,\s*"([^"]*)"\)', file.read(), re.M))


def examples():
    for folder in ("examples", "examples/later"):
        for name in sorted(os.listdir(os.path.join(API, folder))):
            if name.endswith(".json"):
                with open(os.path.join(API, folder, name)) as file:
                    yield f"{folder}/{name}", json.load(file)


# The rules beyond the schema, for documents that the schema accepts.

def length(v):
    return math.sqrt(sum(x * x for x in v))


def parallel(a, b):
    a, b = [x / length(a) for x in a], [x / length(b) for x in b]
    return length([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                   a[0] * b[1] - a[1] * b[0]]) < 1e-9


def camera_rule(scene):
    camera = scene.get("camera")
    if camera is None:
        return
    view = [t - e for t, e in zip(camera.get("target", [0, 0, 0]), camera["eye"])]
    up = camera.get("up", [0, 0, 1])
    if length(view) < 1e-12:
        yield "EYE_AT_TARGET"
    elif length(up) < 1e-12:
        yield "ZERO_DIRECTION"
    elif parallel(view, up):
        yield "UP_PARALLEL"


def light_rule(scene):
    for light in scene.get("lights", []):
        if length(light.get("direction", [1, 1, -2])) < 1e-12:
            yield "ZERO_DIRECTION"


def transform_rule(scene):
    for thing in scene["objects"]:
        transform = thing.get("transform", {})
        if "matrix" in transform:
            m = transform["matrix"]
            if [m[3], m[7], m[11], m[15]] != [0, 0, 0, 1]:
                yield "NOT_AFFINE"
                continue
            columns = [m[0:3], m[4:7], m[8:11]]
            if min(map(length, columns)) < 1e-12:
                yield "SINGULAR"
                continue
            a, b, c = [[x / length(v) for x in v] for v in columns]
            determinant = (a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
                           + a[2] * (b[0] * c[1] - b[1] * c[0]))
            if abs(determinant) < 1e-12:
                yield "SINGULAR"
        else:
            scale = transform.get("scale", 1)
            if min(map(abs, scale if isinstance(scale, list) else [scale])) < 1e-12:
                yield "SINGULAR"


def skeleton_rule(scene):
    for thing in scene["objects"]:
        skeleton = thing.get("skeleton", {})
        for i, j in skeleton.get("segments", []):
            if max(i, j) >= len(skeleton["joints"]):
                yield "SEGMENT_INDEX"
            if i == j:
                yield "SEGMENT_LOOP"


def cost_rule(scene):
    image = scene.get("image", {})
    k = math.isqrt(int(image.get("samples", 4)))
    width, height = (int(image.get(side, 512)) * k for side in ("width", "height"))
    if max(width, height) > 16384 or width * height > 16 * 1024 * 1024:
        yield "PICTURE_COST"
    default = {"plane": [16, 16], "sphere": [48, 24], "torus": [64, 32], "cylinder": [48, 16],
               "terrain": [64, 64], "teapot": [8, 8]}
    triangles = 0
    for thing in scene["objects"]:
        mesh = thing.get("shell", thing).get("mesh", {})
        if "shape" in mesh:
            n, m = mesh.get("divisions", default[mesh["shape"]])
            triangles += 2 * n * m * (32 if mesh["shape"] == "teapot" else 1)
    if triangles > 4000000:
        yield "TRIANGLES"


RULES = [camera_rule, light_rule, transform_rule, skeleton_rule, cost_rule]
TEXT_RULES = {"SYNTAX", "NOT_A_NUMBER", "ENCODING", "NUL", "TOO_LARGE", "TOO_DEEP", "DUPLICATE",
              "OVERFLOW"}


# Mutations of the parsed document.

def places(value, at=()):
    yield at
    if isinstance(value, dict):
        for key in value:
            yield from places(value[key], at + (key,))
    elif isinstance(value, list):
        for i in range(len(value)):
            yield from places(value[i], at + (i,))


def get(document, at):
    for step in at:
        document = document[step]
    return document


def put(document, at, value):
    if not at:
        return value
    get(document, at[:-1])[at[-1]] = value
    return document


NUMBERS = sorted({x for node in re.findall(r'"(?:minimum|maximum)": ([-+0-9.e]+)', json.dumps(SCHEMA))
                  for x in (float(node), float(node) + 1, float(node) - 1,
                            math.nextafter(float(node), math.inf),
                            math.nextafter(float(node), -math.inf))})
KEYS = sorted({key for definition in SCHEMA["$defs"].values()
               for closed in definition.get("oneOf", [definition])
               for key in closed.get("properties", {})})
VALUES = [None, True, False, 0, 1, -1, 0.5, 2.5, 512.0, 4, 9, 8, 1e300, -1e300, 5e-324, "", "x", "auto",
          "tetra", "fur", "sphere", "elm", "../x", "/etc/passwd", "a/../b", "a\\b", "tab\t", "..a/b..",
          "sha256:" + "0" * 64, "sha256:" + "0" * 63, "sha256:" + "A" * 64, "é" * 255, "é" * 256, "..",
          "ends with a line\n", [], {}, [0], [0, 0], [1, 1], [0, 0, 0], [1, 2, 3], [0, 0, 1], [0, 1],
          [1, 1, 1, 1], [[0, 1]], [{}], {"a": 1}, {"shape": "plane"}, {"builtin": "fur"}, {"eye": [0, 0, 0]}]


# Good alone, bad together: into the scene, into an object, into a mesh.
AIMED = {
    "scene": [("camera", {"eye": [0, 0, 0]}), ("camera", {"eye": [0, 0, 5]}),
              ("camera", {"eye": [1, 2, 3], "target": [1, 2, 3.0], "ortho_height": 1}),
              ("camera", {"eye": [1, 2, 3], "target": [2, 3, 4], "up": [-7, -7, -7]}),
              ("camera", {"eye": [1, 2, 3], "up": [0, 0, 0]}),
              ("camera", {"eye": [1e12, 0, 0], "target": [-1e12, 0, 0], "up": [1, 1e-6, 0]}),
              ("lights", [{"direction": [0, 0, 0]}]), ("lights", [{}, {"direction": [0, 1e-13, 0]}]),
              ("image", {"width": 8192, "height": 8192}), ("image", {"width": 8192, "samples": 9}),
              ("image", {"width": 1, "height": 2048, "samples": 64}),
              ("image", {"width": 8192, "height": 8192, "samples": 1})],
    "object": [("transform", {"scale": 0}), ("transform", {"scale": [1, 0, 1]}),
               ("transform", {"rotate_deg": [90, 45, 1e-3], "scale": -2}),
               ("transform", {"matrix": [0] * 15 + [1]}), ("transform", {"matrix": [1] * 16}),
               ("transform", {"matrix": [1, 2, 3, 0, 2, 4, 6, 0, 0, 0, 1, 0, 0, 0, 0, 1]}),
               ("transform", {"matrix": [1e-9, 0, 0, 0, 0, 1e9, 0, 0, 0, 7, 1, 0, 5, 5, 5, 1]}),
               ("quality", {"slices": 3}), ("quality", {"order": "auto", "rank": 2}),
               ("path", "tetra"), ("path", "slicing"), ("path", "auto")],
    "mesh": [("divisions", [2048, 2048]), ("divisions", [1000, 2000]), ("divisions", [3, 2])],
}


def aim(rng, document):
    """Puts one of AIMED where it belongs."""
    kind = rng.choice(["scene", "object", "mesh"])
    here = document
    if kind != "scene":
        here = rng.choice(document["objects"])
    if kind == "mesh":
        here = here.get("shell", here).get("mesh", {})
    key, value = rng.choice(AIMED[kind])
    here[key] = copy.deepcopy(value)
    return document


def mutate(rng, document, others):
    """A copy of the document, changed in one to three places."""
    document = copy.deepcopy(document)
    if rng.random() < 0.2:
        return aim(rng, document)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        at = rng.choice(list(places(document)))
        here = get(document, at)
        kind = rng.randrange(12)
        if kind == 0:
            document = put(document, at, copy.deepcopy(rng.choice(VALUES)))
        elif kind == 1 and at:
            del get(document, at[:-1])[at[-1]]
        elif kind == 2 and isinstance(here, dict):
            here[rng.choice(KEYS + ["x", "Size", "", "a/b", "m~n"])] = copy.deepcopy(rng.choice(VALUES))
        elif kind == 3 and isinstance(here, list):
            here.insert(rng.randrange(len(here) + 1),
                        copy.deepcopy(rng.choice(here if here else VALUES)))
        elif kind == 4:
            document = put(document, at, rng.choice([[here], {"x": here}, [here, here]]))
        elif kind == 5 and isinstance(here, (dict, list)) and here:
            inner = rng.choice(list(here.values()) if isinstance(here, dict) else here)
            document = put(document, at, inner)
        elif kind == 6:
            other = rng.choice(others)
            document = put(document, at, copy.deepcopy(get(other, rng.choice(list(places(other))))))
        elif kind == 7 and isinstance(here, dict):
            # A member of the same name, taken from elsewhere: likely to be valid.
            other = rng.choice(others)
            found = [get(other, p) for p in places(other) if p and p[-1] in KEYS]
            names = [p[-1] for p in places(other) if p and p[-1] in KEYS]
            pick = rng.randrange(len(found))
            here[names[pick]] = copy.deepcopy(found[pick])
        else:
            numbers = [p for p in places(document) if isinstance(get(document, p), (int, float))
                       and not isinstance(get(document, p), bool)]
            if numbers:
                at = rng.choice(numbers)
                here = get(document, at)
                document = put(document, at, rng.choice(
                    [float(here), here * 2, -here, here + 0.5, 0, 1, rng.choice(NUMBERS),
                     rng.choice(NUMBERS), rng.randrange(1, 3000)]))
        if not isinstance(document, (dict, list)):
            break
    return document


# Mutations of the text.

def replace_number(rng, text, new):
    found = list(re.finditer(r"(?<=[ \[:,])-?\d[\d.e+-]*(?=[,\]} ])", text))
    if not found:
        return text + new
    match = rng.choice(found)
    return text[:match.start()] + new + text[match.end():]


def repeat_member(rng, text, _):
    match = rng.choice(list(re.finditer(r'"(\w+)": ', text)))
    return text[:match.start()] + f'"{match.group(1)}": 1, ' + text[match.start():]


def nest(_, text, depth):
    return text[:-1] + ', "x": ' + "[" * depth + "]" * depth + "}"


TEXT_MUTATIONS = [
    (replace_number, ["NaN", "Infinity", "-Infinity", "1e999", "-1e999", "9" * 400, "1e-999", "-0",
                      "01", "1.", ".5", "+1", "0x10", "1e", "512.0", "5.12e2", "1E2", "1e+2", "nan",
                      "9007199254740993", "18446744073709551616", "tru", "'a'", '"\\u0000"',
                      '"\\ud800"', '"\\ud83d\\ude00"', '"\\x"', '"tab\t"', "4.0", "16.000"]),
    (repeat_member, [None]),
    (nest, [2, 31, 32, 33, 1000]),
    (lambda rng, text, _: text[:rng.randrange(len(text))], [None]),
    (lambda rng, text, new: (lambda i: text[:i] + new + text[i + 1:])(rng.randrange(len(text))),
     ["", " ", ",", ":", "{", "}", "[", "]", '"', "\\", "\0", "\n", "//", "é"]),
    (lambda rng, text, new: text + new, [" ", "\n\t", "{}", "x", "\0", "]"]),
    (lambda rng, text, new: new + text, ["\ufeff", " ", "[", "x"]),
]


def refuse_constant(name):
    raise ValueError(name)


def parse(text):
    try:
        return json.loads(text, parse_constant=refuse_constant)
    except (ValueError, RecursionError):
        return UNPARSED


def resolves(document, pointer):
    if pointer == "":
        return True
    for step in pointer[1:].split("/"):
        step = step.replace("~1", "/").replace("~0", "~")
        try:
            document = document[int(step)] if isinstance(document, list) else document[step]
        except (KeyError, IndexError, ValueError, TypeError):
            return False
    return True


def read_all(texts):
    """The reader's answers, in order."""
    stream = b"".join(b"%d\n%s" % (len(t), t) for t in (x.encode("utf-8", "surrogatepass") for x in texts))
    tool = os.path.join(BUILD, "tests", "tools", "scene_check")
    done = subprocess.run([tool], input=stream, stdout=subprocess.PIPE, check=True)
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(answers) == len(texts), (len(answers), len(texts))
    return answers


def judge(text, answer, validator, tally):
    """What is wrong with the reader's answer, or None."""
    document = parse(text)
    accepted = answer["status"] == "ok"
    faults = answer.get("errors", [])
    rows = [next((name for name, row in REFUSALS.items() if f["detail"].startswith(row)), None)
            for f in faults]
    for name in filter(None, rows):
        tally["rows"][name] = tally["rows"].get(name, 0) + 1
    if document is UNPARSED:
        tally["unparsed"] += 1
        if accepted:
            return "accepted, but it is not JSON"
        return None if set(rows) & TEXT_RULES else "not JSON, but no fault says so"
    for fault in faults:
        if fault.get("pointer") is None or not resolves(document, fault["pointer"]):
            return f"pointer leads nowhere: {fault}"
    if not validator.is_valid(document):
        tally["refused by schema"] += 1
        return "accepted, but the schema refuses it" if accepted else None
    expected = {name for rule in RULES for name in rule(document)}
    found = set(rows)
    if found & TEXT_RULES and None not in found:
        tally["refused for its text"] += 1
        return None
    if accepted:
        tally["accepted"] += 1
        return f"accepted, but {sorted(expected)} apply" if expected else None
    tally["refused beyond"] += 1
    if None in found:
        return f"refused without a row of refusals.def: {faults}"
    return None if found <= expected and expected else f"refused for {found}, expected {expected}"


def main():
    began = time.monotonic()
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    validator = jsonschema.Draft202012Validator(SCHEMA)
    scenes = list(examples())
    for name, scene in scenes:
        validator.validate(scene)
    others = [scene for _, scene in scenes]
    rng = random.Random(SEED)
    texts = [json.dumps(scene) for scene in others]
    for i in range(MUTATIONS):
        document = mutate(rng, others[i % len(others)], others)
        texts.append(json.dumps(document, ensure_ascii=rng.random() < 0.5))
    for i in range(TEXTS):
        change, choices = TEXT_MUTATIONS[i % len(TEXT_MUTATIONS)]
        texts.append(change(rng, json.dumps(rng.choice(others)), rng.choice(choices)))

    tally = {"accepted": 0, "refused by schema": 0, "refused beyond": 0, "refused for its text": 0,
             "unparsed": 0, "rows": {}}
    bad = 0
    answers = read_all(texts)
    written = []
    for text, answer in zip(texts, answers):
        wrong = judge(text, answer, validator, tally)
        if wrong:
            bad += 1
            print(f"{wrong}\n  {text[:600]!r}\n  {json.dumps(answer)[:600]}")
        if answer["status"] == "ok":
            written.append(answer["scene"])
    again = read_all([json.dumps(scene) for scene in written])
    for scene, answer in zip(written, again):
        if answer.get("scene") != scene or not validator.is_valid(scene):
            bad += 1
            print(f"written back, it changes or is invalid:\n  {scene}\n  {answer}")
    print(f"{len(texts)} documents: {tally}; {bad} faults; {time.monotonic() - began:.1f} s")
    if tally["accepted"] < 300 or tally["refused by schema"] < 1000 or tally["refused beyond"] < 100:
        print("the documents do not cover enough of both sides")
        bad += 1
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
