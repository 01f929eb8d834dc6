#!/usr/bin/python3
"""Renews the end of api/openapi.yaml: the schemas of scene, report and problem document, so that the
file that the daemon serves stands for itself. JSON is YAML, so they are put there as JSON.

Usage: openapi_schemas.py [--check]. With --check nothing is written: exits 1 if the file is out of
date, or if a problem type of api/status.def is missing in it."""

import json
import os
import re
import sys

API = os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))), "api")
MARKER = "    # problem.schema.json.\n"
# The command line alone reports these, or nobody is left to read them.
NEVER_SENT = {"ok", "usage", "unreachable", "cancelled"}


def rename(value, prefix):
    """References to $defs and to the scene become references to components."""
    if isinstance(value, dict):
        renamed = {key: rename(inner, prefix) for key, inner in value.items()}
        if value.get("$ref") == "scene.schema.json":
            renamed["$ref"] = "#/components/schemas/Scene"
        elif value.get("$ref", "").startswith("report.schema.json#/$defs/"):
            renamed["$ref"] = value["$ref"].replace("report.schema.json#/$defs/",
                                                    "#/components/schemas/Report.")
        elif value.get("$ref", "").startswith("report.schema.json#/"):
            renamed["$ref"] = value["$ref"].replace("report.schema.json#", "#/components/schemas/Report")
        elif "$ref" in value:
            renamed["$ref"] = value["$ref"].replace("#/$defs/", f"#/components/schemas/{prefix}")
        return renamed
    if isinstance(value, list):
        return [rename(inner, prefix) for inner in value]
    return value


def components():
    rows = {}
    for name in ("Scene", "Sequence", "Report", "Problem", "Sweep"):
        prefix = name + "."
        with open(os.path.join(API, name.lower() + ".schema.json")) as file:
            schema = json.load(file)
        definitions = schema.pop("$defs", {})
        for key in ("$schema", "$id", "$comment"):
            schema.pop(key, None)
        rows[name] = rename(schema, prefix)
        for key, inner in definitions.items():
            rows[prefix + key] = rename(inner, prefix)
    return rows


def main():
    path = os.path.join(API, "openapi.yaml")
    with open(path) as file:
        old = file.read()
    head = old[:old.index(MARKER) + len(MARKER)]
    lines = [head]
    for name, schema in components().items():
        text = json.dumps(schema, indent=2, ensure_ascii=False).replace("\n", "\n    ")
        # YAML 1.1, which many still read, takes 1e-09 for a text; 1.0e-09 it does not.
        text = re.sub(r'^( *(?:"\w+": )?-?\d+)e(?=[-+]?\d+,?$)', r"\1.0e", text, flags=re.M)
        lines.append(f"    {name}: {text}\n")
    new = "".join(lines)
    if sys.argv[1:] != ["--check"]:
        with open(path, "w") as file:
            file.write(new)
        return 0
    bad = old != new
    if bad:
        print("api/openapi.yaml is out of date: make generate")
    with open(os.path.join(API, "status.def")) as file:
        rows = re.findall(r'^STATUS\(\w+, "([^"]+)", "[^"]+", (\d+)', file.read(), re.M)
    for slug, http in rows:
        if slug not in NEVER_SENT and f"| `/problems/{slug}` | {http} |" not in head:
            print(f"api/openapi.yaml does not tell of /problems/{slug}, {http}")
            bad = True
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
