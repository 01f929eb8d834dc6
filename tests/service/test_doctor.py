#!/usr/bin/env python3
"""pelt doctor: what it finds, what it misses, and drivers that crash or hang.

Drivers are stood in for by small libraries, compiled here, whose constructors misbehave; the names of
the libraries to open come from the environment (renderer/gl/README.md).
"""
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile

PELT = os.environ["PELT"]
ABSENT = {"PELT_EGL_LIBRARY": "libabsent-egl.so", "PELT_OSMESA_LIBRARY": "libabsent-osmesa.so"}


def doctor(*arguments, **environment):
    return subprocess.run([PELT, "doctor", *arguments], env={**os.environ, **environment},
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=100)


def findings(code, *arguments, **environment):
    run = doctor("--json", *arguments, **environment)
    assert run.returncode == code, f"exit code {run.returncode}, not {code}: {run.stderr}"
    return json.loads(run.stdout)


def library(folder, name, body):
    """A shared library that runs `body` when it is opened."""
    source, target = folder / f"{name}.c", folder / f"{name}.so"
    source.write_text("#include <signal.h>\n#include <stdio.h>\n#include <unistd.h>\n"
                      f"__attribute__((constructor)) static void start(void) {{ {body} }}\n")
    subprocess.run([os.environ.get("CC", "gcc"), "-shared", "-fPIC", "-o", target, source], check=True)
    return str(target)


def test_what_is_there(_):
    found = findings(0)
    assert found["usable"] and found["backend"] == "egl", found
    for name in ("egl", "osmesa"):
        one = found[name]
        assert one["usable"] and one["library_opened"], one
        assert one["gl_version"].startswith("4.") and one["gl_renderer"], one
        assert one["clock"] in ("fence", "query"), one
        assert "why" not in one, one
    assert [d["name"] for d in found["egl"]["devices"]], found
    assert {m["name"] for m in found["modules"]} == {"OpenImageIO", "tinygltf"}
    assert all(m["usable"] for m in found["modules"]), found["modules"]
    assert found["missing"] == []
    assert found["machine"]["cores"] == len(os.sched_getaffinity(0))
    assert found["machine"]["memory_bytes"] >= found["machine"]["memory_available_bytes"] > 0

    run = doctor()
    assert run.returncode == 0 and not run.stderr, run
    for words in ("can draw here, by EGL", found["egl"]["gl_renderer"], "OpenImageIO", "tinygltf",
                  "missing   nothing"):
        assert words in run.stdout, (words, run.stdout)


def test_nothing_is_there(folder):
    found = findings(6, PELT_LIBDIR=str(folder), **ABSENT)
    assert not found["usable"] and found["backend"] is None
    assert "libabsent-egl.so" in found["egl"]["why"] and not found["egl"]["library_opened"]
    missing = {m["what"]: m for m in found["missing"]}
    assert missing["EGL"]["packages"] == "libegl1 libegl-mesa0 libgl1-mesa-dri"
    assert missing["EGL"]["needed"] and not missing["OSMesa"]["needed"]
    assert missing["OSMesa"]["packages"] == "libosmesa6"
    assert missing["OpenImageIO"]["packages"] == "libopenimageio2.4"
    run = doctor(**ABSENT)
    assert run.returncode == 6
    for words in ("cannot draw here", "apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri"):
        assert words in run.stdout, (words, run.stdout)


def test_one_backend_is_enough(_):
    found = findings(0, PELT_EGL_LIBRARY="libabsent-egl.so")
    assert found["backend"] == "osmesa"
    assert [(m["what"], m["needed"]) for m in found["missing"]] == [("EGL", False)]


def test_a_driver_that_crashes(folder):
    crash = library(folder, "crash", 'fputs("about to fall\\n", stderr); raise(SIGSEGV);')
    found = findings(0, PELT_EGL_LIBRARY=crash)
    assert "crashed: Segmentation fault" in found["egl"]["why"], found["egl"]
    assert "about to fall" in found["egl"]["messages"]
    assert found["backend"] == "osmesa"
    run = doctor(PELT_EGL_LIBRARY=crash)
    assert "crashed" in run.stdout and "it said: about to fall" in run.stdout, run.stdout


def test_a_driver_that_hangs(folder):
    hang = library(folder, "hang", "for (;;) pause();")
    found = findings(6, "--wait", "0.4", PELT_EGL_LIBRARY=hang, PELT_OSMESA_LIBRARY="libabsent.so")
    assert found["egl"]["why"] == "its driver hung: no answer within 400 ms", found["egl"]


def test_a_driver_that_hangs_in_silence(folder):
    """The end of its streams is not the end of the process."""
    hang = library(folder, "mute", "close(1); close(2); for (;;) pause();")
    found = findings(6, "--wait", "0.4", PELT_EGL_LIBRARY=hang, PELT_OSMESA_LIBRARY="libabsent.so")
    assert "its driver hung" in found["egl"]["why"], found["egl"]


def test_a_driver_that_leaves_a_process_behind(folder):
    """The end of the process is the end of the probe, whoever holds its streams."""
    list_of_pids = folder / "pids"
    fork = library(folder, "fork", "int pid = fork(); if (pid == 0) for (;;) pause(); "
                   'FILE *f = fopen("%s", "a"); fprintf(f, "%%d\\n", pid); fclose(f);'
                   % list_of_pids)
    found = findings(0, PELT_EGL_LIBRARY=fork)
    assert "is no EGL library" in found["egl"]["why"], found["egl"]
    pids = [int(line) for line in list_of_pids.read_text().split()]
    assert pids
    for pid in pids:
        os.kill(pid, signal.SIGKILL)  # raises, were it gone: then the doctor had waited for it


def test_a_driver_that_ends_the_process(folder):
    ends = library(folder, "ends", "_exit(7);")
    assert findings(0, PELT_EGL_LIBRARY=ends)["egl"]["why"] == "its probe ended with exit code 7"
    silent = library(folder, "silent", "_exit(0);")
    assert findings(0, PELT_EGL_LIBRARY=silent)["egl"]["why"] == "its probe gave no findings"


def test_a_driver_that_talks_much(folder):
    loud = library(folder, "loud", 'for (int i = 0; i < 100000; i++) fputs("\\xff talk\\n", stderr);')
    found = findings(0, PELT_EGL_LIBRARY=loud)
    assert 10000 < len(found["egl"]["messages"]) < 100000, len(found["egl"]["messages"])


def test_the_shader_cache_as_mesa_sees_it(folder):
    """Mesa compiles while it is probed, so its folder shows afterwards whether the doctor was right."""
    near, far = folder / "near", folder / "far" / "away"
    found = findings(0, MESA_SHADER_CACHE_DIR=str(near))["shader_cache"]
    assert found == {"folder": f"{near}/mesa_shader_cache", "writable": True}, found
    assert (near / "mesa_shader_cache").is_dir()
    found = findings(0, MESA_SHADER_CACHE_DIR=str(far))["shader_cache"]
    assert not found["writable"] and "No such file" in found["why"], found
    assert not far.exists()
    found = findings(0, MESA_SHADER_CACHE_DISABLE="1", MESA_SHADER_CACHE_DIR=str(near))["shader_cache"]
    assert not found["writable"] and "switched off" in found["why"], found
    plain = folder / "plain"
    plain.write_text("")
    found = findings(0, MESA_SHADER_CACHE_DIR=str(plain))["shader_cache"]
    assert not found["writable"], found


def test_wrong_usage(_):
    for arguments in (["--nonsense"], ["extra"], ["--wait", "-1"], ["--wait", "x"], ["--probe", "sky"]):
        run = doctor(*arguments)
        assert run.returncode == 2 and run.stderr and not run.stdout, (arguments, run)
    run = doctor("--help")
    assert run.returncode == 0 and "--json" in run.stdout


def main():
    failed = 0
    for name, test in list(globals().items()):
        if name.startswith("test_"):
            with tempfile.TemporaryDirectory() as folder:
                try:
                    test(pathlib.Path(folder))
                    print("ok  ", name)
                except AssertionError as fault:
                    failed += 1
                    print("FAIL", name, fault)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
