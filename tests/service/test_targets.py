#!/usr/bin/python3
"""Errors and targets through a daemon: what the report says, and that its times add up."""

from harness import Daemon, main, scene

PLANE = [{"shell": {"mesh": {"shape": "plane", "divisions": [3, 3]}, "thickness": 0.3,
                    "tiles": [3, 3], "material": {"builtin": "clouds", "size": [32, 32, 16]}}}]


def report_of(daemon, objects=PLANE, **members):
    reply = daemon.post(scene(side=64, objects=objects, **members),
                        accept="application/json")
    assert reply.status == 200, reply.body
    report = reply.json()["report"]
    stages = {name: ms for name, ms in report["timing_ms"].items() if name != "total"}
    total = report["timing_ms"]["total"]
    assert abs(sum(stages.values()) - total) <= max(0.05 * total, 2), report["timing_ms"]
    return report


def test_errors():
    with Daemon("--workers", "1") as daemon:
        report = report_of(daemon)
        assert "error" not in report and "target" not in report
        assert {"error", "trials"} <= {row["pass"] for row in report["plan"]["left_out"]}
        assert report["timing_ms"]["error"] == report["timing_ms"]["choose"] == 0
        estimate = report_of(daemon, report={"error": "estimate"})["error"]
        truth = report_of(daemon, report={"error": "reference"})["error"]
        assert estimate["kind"] == "estimate" and truth["kind"] == "reference"
        assert truth["pixels"] == 64 * 64 and truth["rmse_standard_error"] == 0
        assert truth["flip"] > 0 and estimate["flip"] is None
        ratio = estimate["discretisation"] / truth["discretisation"]
        assert 0.5 < ratio < 2, ratio


def test_targets():
    with Daemon("--workers", "1") as daemon:
        report = report_of(daemon, target={"max_error": 0.005})
        target = report["target"]
        assert target["max_error"] == 0.005 and target["met"] and target["reached"] <= 0.005
        chosen = report["resolved"]["objects"][0]["quality"]["samples"]
        held = [dict(PLANE[0], quality={"samples": chosen})]
        reply = daemon.post(scene(side=64, objects=held, report={"error": "reference"}),
                            accept="application/json")
        assert reply.json()["report"]["error"]["rmse"] < 0.005 * 1.3
        # What was chosen is in the resolved scene, which gives the same picture.
        again = daemon.post(report["resolved"]).body
        assert again == daemon.post(scene(side=64, objects=PLANE, target={"max_error": 0.005})).body
        walked = [dict(PLANE[0], path="tetra")]
        # Plenty of time: as good as it gets. None: the least, and it says so.
        report = report_of(daemon, objects=walked, target={"deadline_ms": 600000})
        assert report["target"]["met"] and report["target"]["reached"] == report["timing_ms"]["total"]
        assert report["resolved"]["objects"][0]["quality"]["samples"] == 8 * 16
        report = report_of(daemon, objects=walked, target={"deadline_ms": 1})
        assert not report["target"]["met"] and report["target"]["reached"] > 1
        assert report["resolved"]["objects"][0]["quality"]["samples"] == 1
        for bad, pointer in (({"max_error": -1}, "/target/max_error"), ({}, "/target"),
                             ({"max_error": 0.1, "deadline_ms": 5}, "/target"),
                             ({"deadline_ms": 0}, "/target/deadline_ms")):
            reply = daemon.post(scene(target=bad))
            assert reply.status == 422, reply.body
            assert reply.json()["errors"][0]["pointer"].startswith(pointer), reply.body


if __name__ == "__main__":
    main(globals())
