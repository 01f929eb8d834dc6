#!/usr/bin/env python3
"""The root README's commands run as printed (but for the clone, and a port that may be taken), and
every relative link of every README leads somewhere.

Usage: readme.py BUILD"""

import os
import re
import socket
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
build = sys.argv[1] if len(sys.argv) > 1 else "build"
faults = []


def tracked(pattern):
    out = subprocess.run(["git", "ls-files", "-z", pattern], cwd=ROOT, check=True,
                         capture_output=True).stdout
    return [name for name in out.decode().split("\0") if name]


def check_links():
    count = 0
    for name in tracked("*.md"):
        with open(os.path.join(ROOT, name), encoding="utf-8") as file:
            text = re.sub(r"```.*?```", "", file.read(), flags=re.S)
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            if re.match(r"[a-z]+:|#", target):
                continue
            count += 1
            path = os.path.join(ROOT, os.path.dirname(name), target.split("#")[0])
            if not os.path.exists(path):
                faults.append(f"{name}: {target} leads nowhere")
    print(f"{count} links")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def run_blocks():
    with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as file:
        blocks = re.findall(r"```sh\n(.*?)```", file.read(), flags=re.S)
    with tempfile.TemporaryDirectory() as folder:
        # A tree like a fresh clone that has been built; what the commands leave stays here.
        for name in os.listdir(ROOT):
            if name == ".git" or not name.startswith((".", "build", "demo.")):
                os.symlink(os.path.join(ROOT, name), os.path.join(folder, name))
        os.symlink(os.path.abspath(os.path.join(ROOT, build)), os.path.join(folder, "build"))
        port = free_port()
        for block in blocks:
            script = re.sub(r"^git clone .*\n", "", block, flags=re.M)
            script = script.replace("build/pelt serve", f"build/pelt serve --listen 127.0.0.1:{port}")
            script = script.replace(":8748/", f":{port}/")
            run = subprocess.run(["bash", "-euo", "pipefail", "-c", script], cwd=folder,
                                 capture_output=True, text=True, timeout=600,
                                 env=dict(os.environ, no_proxy="*"))
            print(f"{'ok' if run.returncode == 0 else 'FAIL'}: {block.splitlines()[0]} ...")
            if run.returncode != 0:
                faults.append(f"README.md: exit {run.returncode} of\n{script}{run.stderr[-2000:]}")
        for name in ("demo.png", "sphere.png", "flip.png", "bunny.png", "pictures/least.png"):
            path = os.path.join(folder, name)
            if not os.path.exists(path):
                faults.append(f"README.md: {name} did not come out")
                continue
            with open(path, "rb") as file:
                if file.read(8) != b"\x89PNG\r\n\x1a\n":
                    faults.append(f"README.md: {name} is no PNG")
        print(f"{len(blocks)} blocks")


check_links()
run_blocks()
for fault in faults:
    print(fault)
sys.exit(1 if faults else 0)
