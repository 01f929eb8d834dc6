#!/usr/bin/python3
"""Reports, sweeps and problem documents, as the program writes them, follow their schemas; and the schemas
allow no member that the program never writes (else they describe something that does not exist)."""

import json
import os
import re
import subprocess
import sys

import jsonschema

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = os.environ.get("PELT_BUILD", os.path.join(ROOT, "build"))


def load(name):
    with open(os.path.join(ROOT, "api", name)) as file:
        schema = json.load(file)
    jsonschema.Draft202012Validator.check_schema(schema)
    return schema


SCENE, REPORT, SWEEP, PROBLEM = map(load, ("scene.schema.json", "report.schema.json",
                                           "sweep.schema.json", "problem.schema.json"))
STORE = {schema["$id"]: schema for schema in (SCENE, REPORT, SWEEP, PROBLEM)}
SCHEMAS = {"report": REPORT, "sweep": SWEEP, "problem": PROBLEM}


def validator(schema):
    return jsonschema.Draft202012Validator(
        schema, resolver=jsonschema.RefResolver(schema["$id"], schema, store=STORE))


def members(schema, at=""):
    """Every member that a closed object of the schema has, as a path; not those behind references."""
    for name, inner in schema.get("properties", {}).items():
        yield f"{at}/{name}"
        yield from members(inner, f"{at}/{name}")
        yield from members(inner.get("items", {}), f"{at}/{name}/*")


def written(value, at=""):
    if isinstance(value, dict):
        for name, inner in value.items():
            yield f"{at}/{name}"
            yield from written(inner, f"{at}/{name}")
    elif isinstance(value, list):
        for inner in value:
            yield from written(inner, f"{at}/*")


def main():
    tool = os.path.join(BUILD, "tests", "tools", "documents")
    lines = subprocess.run([tool], stdout=subprocess.PIPE, check=True).stdout.decode().splitlines()
    bad = 0
    with open(os.path.join(ROOT, "api", "status.def")) as file:
        slugs = set(re.findall(r'^STATUS\(\w+, "([^"]+)"', file.read(), re.M))
    seen = {kind: set() for kind in SCHEMAS}
    types = set()
    for line in lines:
        kind, text = line.split(" ", 1)
        document = json.loads(text)
        schema = SCHEMAS[kind]
        for error in validator(schema).iter_errors(document):
            bad += 1
            print(f"{kind}: {list(error.absolute_path)}: {error.message[:200]}")
        seen[kind].update(written(document))
        if kind == "problem":
            types.add(document["type"])
    for kind, schema in SCHEMAS.items():
        for member in members(schema):
            if member not in seen[kind]:
                bad += 1
                print(f"{kind}: the schema has {member}, which was never written")
    if types != {f"/problems/{slug}" for slug in slugs - {"ok"}}:
        bad += 1
        print(f"types of problems: {types ^ {f'/problems/{slug}' for slug in slugs}}")
    print(f"{len(lines)} documents, {bad} faults")
    return 1 if bad or len(lines) < 50 else 0


if __name__ == "__main__":
    sys.exit(main())
