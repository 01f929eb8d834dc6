#!/usr/bin/python3
"""The daemon keeps to the OpenAPI document that it serves: every reply's status, media type, headers
and body are those that the document gives for the request. Needs python3-yaml and python3-jsonschema."""

import json
import re
import sys

try:
    import jsonschema
    import yaml
except ImportError as missing:
    print(f"python3-yaml or python3-jsonschema is not installed: {missing}")
    sys.exit(77)

from harness import Daemon, SHELL, SMALL, main, multipart, scene

LATER = scene(objects=[{"skeleton": {"builtin": "elm"}}, {"skeleton": {"builtin": "pine"}}])
FORM, FORM_BODY = multipart([("scene", SMALL)])
JSON = {"Content-Type": "application/json"}


def post(path, document, accept="image/png", **headers):
    body = document if isinstance(document, (str, bytes)) else json.dumps(document)
    return "POST", path, body, {**JSON, "Accept": accept, **headers}


REQUESTS = [
    (200, post("/v1/render", SMALL)),
    (200, post("/v1/render", SMALL, "*/*")),
    (200, post("/v1/render", SMALL, "image/x-exr")),
    (200, post("/v1/render", SMALL, "application/json")),
    (200, ("POST", "/v1/render", FORM_BODY, {"Content-Type": FORM})),
    (200, post("/v1/plan", SMALL, "application/json")),
    (200, ("GET", "/v1/capabilities", None, {})),
    (200, ("GET", "/livez", None, {})),
    (200, ("GET", "/readyz", None, {})),
    (200, ("GET", "/metrics", None, {})),
    (200, ("GET", "/openapi.yaml", None, {})),
    (400, post("/v1/render", "")),
    (400, post("/v1/render", '{"objects": [NaN, ]}')),
    (405, ("GET", "/v1/render", None, {})),
    (405, ("POST", "/livez", b"", {})),
    (406, post("/v1/render", SMALL, "image/tiff")),
    (413, post("/v1/render", " " * (1 << 20) + json.dumps(SMALL))),
    (415, ("POST", "/v1/render", json.dumps(SMALL), {"Content-Type": "text/plain"})),
    (422, post("/v1/render", {"objects": [{"mesh": {"shape": "cube"}}, {}], "x": 1})),
    (422, post("/v1/render", {"objects": [{"mesh": {"asset": "none.glb"}}]})),
    (422, post("/v1/plan", scene(side=8192, samples=16), "application/json")),
    (501, post("/v1/render", LATER)),
    (501, post("/v1/plan", {"objects": [{**SHELL, "path": "gdm"}]}, "application/json")),
]


def template_of(document, path):
    """The path of the document that this one is an instance of."""
    path = path.split("?")[0]
    for template in document["paths"]:
        if re.fullmatch(re.sub(r"\\{\w+\\}", "[^/]+", re.escape(template)), path):
            return template
    raise AssertionError(f"{path} is not documented")


def resolve(document, value):
    while "$ref" in value:
        target = document
        for step in value["$ref"][2:].split("/"):
            target = target[step.replace("~1", "/").replace("~0", "~")]
        value = target
    return value


def check(document, request, reply):
    """Raises where the reply is none that the document allows."""
    method, template = request[0].lower(), template_of(document, request[1])
    operations = {name: operation for name, operation in document["paths"][template].items()
                  if name != "parameters"}
    # A method that is not there is answered as the resource's own operation says.
    operation = operations.get(method) or next(iter(operations.values()))
    responses = operation["responses"]
    assert str(reply.status) in responses, f"{reply.status} is not documented"
    response = resolve(document, responses[str(reply.status)])
    for name, header in response.get("headers", {}).items():
        header = resolve(document, header)
        value = reply.headers.get(name)
        assert value or not header.get("required"), f"no {name}"
        if value and header["schema"].get("type") == "integer":
            jsonschema.validate(int(value), header["schema"])
    kind = reply.headers["Content-Type"]
    if "content" not in response:
        assert kind is None and reply.body == b"", (kind, reply.body)
        return
    media = response["content"].get(kind) or response["content"].get(kind.split(";")[0])
    assert media, f"Content-Type {kind} is not documented"
    if "json" in kind:
        # The whole document, so that references resolve.
        schema = {**media["schema"], "components": document["components"]}
        jsonschema.Draft202012Validator(schema).validate(reply.json())
    if reply.status >= 400:
        assert kind == "application/problem+json"
        problem = reply.json()
        assert problem["status"] == reply.status
        assert problem["request_id"] == reply.headers["X-Request-Id"]
        types = document["info"]["description"]
        assert re.search(rf"\| `{problem['type']}` \| {reply.status} \|", types), problem["type"]


def ask_about_jobs(daemon, document):
    """A job's whole life; the templates of the paths that were asked."""
    asked = set()

    def ask(status, method, path, accept="*/*", body=None, kind="application/json"):
        if isinstance(body, dict):
            body = json.dumps(body)
        request = (method, path, body, {"Content-Type": kind, "Accept": accept})
        reply = daemon.request(*request)
        assert reply.status == status, (method, path, reply.status, reply.body[:300])
        try:
            check(document, request, reply)
        except Exception as error:
            raise AssertionError(f"{method} {path}: {reply.status}") from error
        asked.add(template_of(document, path))
        return reply
    ask(400, "POST", "/v1/jobs?kind=none", body=SMALL)
    ask(422, "POST", "/v1/jobs", body={})
    ask(405, "DELETE", "/v1/jobs")
    ask(404, "GET", "/v1/jobs/none")
    endless = ask(202, "POST", "/v1/jobs", body=scene(side=1024)).headers["Location"]
    where = ask(202, "POST", "/v1/jobs?kind=reference",
                body=scene(side=8, objects=[{"mesh": {"shape": "torus"}}])).headers["Location"]
    ask(200, "GET", "/v1/jobs")
    ask(200, "GET", where)
    ask(409, "GET", where + "/result")
    ask(409, "GET", where + "/result/flip.png")
    ask(204, "DELETE", endless)
    ask(404, "DELETE", endless)
    ask(200, "GET", endless)
    kind, form = multipart([("scene", {"objects": [{"mesh": {"asset": "bad.glb"}}]}),
                            ("bad.glb", b"bad")])
    broken = ask(202, "POST", "/v1/jobs", body=form, kind=kind).headers["Location"]
    daemon.until(lambda: daemon.get(where).json()["state"] == "done", "the job is done")
    for row in ask(200, "GET", where).json()["results"]:
        ask(200, "GET", row["href"])
    for accept in ["image/png", "image/x-exr", "application/json"]:
        ask(200, "GET", where + "/result", accept)
    ask(400, "POST", "/v1/sweep?quality=none", body=scene(side=8))
    swept = ask(202, "POST", "/v1/sweep?quality=2,4&repeats=1&series=tetra-walk",
                body=scene(side=8)).headers["Location"]
    daemon.until(lambda: daemon.get(swept).json()["state"] == "done", "the sweep is done")
    for accept in ["application/json", "text/html", "text/csv"]:
        ask(200, "GET", swept + "/result", accept)
    moving = {"frames": 2, "scene": scene(side=8), "tracks": [
        {"pointer": "/ambient", "keys": [{"frame": 0, "value": [0, 0, 0]}, {"frame": 1, "value": [1, 1, 1]}]}]}
    ask(400, "POST", "/v1/sequences?output=mp4", body=moving)
    ask(422, "POST", "/v1/sequences", body=scene(side=8))
    moved = ask(202, "POST", "/v1/sequences?frames=0-1&output=png,gif", body=moving).headers["Location"]
    daemon.until(lambda: daemon.get(moved).json()["state"] == "done", "the sequence is done")
    ask(200, "GET", moved)
    for accept in ["*/*", "multipart/mixed", "image/gif", "application/json"]:
        ask(200, "GET", moved + "/result", accept)
    ask(200, "GET", moved + "/result/frame-0001.png")
    ask(404, "GET", moved + "/result/frame-0002.png")
    ask(406, "GET", where + "/result", "text/html")
    ask(405, "POST", where + "/result")
    ask(404, "GET", where + "/result/none")
    daemon.until(lambda: daemon.get(broken).json()["state"] == "failed", "the other one failed")
    ask(200, "GET", broken)
    ask(200, "GET", "/v1/jobs")
    return asked


def test_every_reply_is_documented():
    with Daemon("--workers", "1") as daemon:
        served = daemon.get("/openapi.yaml").body.decode()
        with open("api/openapi.yaml") as file:
            assert served == file.read()
        document = yaml.safe_load(served)
        asked = set()
        for status, request in REQUESTS:
            reply = daemon.request(*request)
            what = f"{request[0]} {request[1]} {str(request[2])[:80]}"
            assert reply.status == status, (what, reply.status, reply.body[:300])
            try:
                check(document, request, reply)
            except Exception as error:
                raise AssertionError(f"{what}: {reply.status}") from error
            asked.add(template_of(document, request[1]))
        asked |= ask_about_jobs(daemon, document)
        assert asked == set(document["paths"]), asked ^ set(document["paths"])


def test_pointers_of_every_fault():
    with Daemon("--workers", "1") as daemon:
        reply = daemon.post({"image": {"width": 0}, "objects": [{"mesh": {"shape": "cube"}}, {}],
                             "unknown": 1, "camera": {"eye": [0, 0, 0]}})
        assert reply.status == 422 and reply.slug() == "invalid-scene", reply.body
        assert {error["pointer"] for error in reply.json()["errors"]} == {
            "/image/width", "/objects/0/mesh/shape", "/objects/1", "/unknown", "/camera"}, reply.body
        reply = daemon.post(LATER)
        assert reply.status == 501 and reply.slug() == "not-implemented", reply.body
        assert {error["pointer"] for error in reply.json()["errors"]} == {
            "/objects/0/skeleton", "/objects/1/skeleton"}, reply.body
        daemon.check_good()


if __name__ == "__main__":
    main(globals())
