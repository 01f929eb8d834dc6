#!/usr/bin/env python3
"""The house holds: who may include what, where GL may be called, how long a file may be, what a file
must begin with, and words that have no place in it. DESIGN: README.md, 'The house'.

Usage: floors.py [BUILD]. Prints one line a fault; exits 1 if there was one."""

import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
os.chdir(ROOT)

# Which rooms each room may include, besides itself. The facade's headers (renderer/*.h) count as
# 'renderer'. reference and error stand beside the other rooms: on api and asset alone.
GROUND = {"api"}
LOW = GROUND | {"shaders", "renderer/gl", "renderer/asset"}
MAY_INCLUDE = {
    "api": set(),
    "shaders": set(),
    "renderer/gl": GROUND | {"shaders"},
    "renderer/asset": GROUND,
    "renderer/shell": LOW,
    "renderer/bake": LOW,
    "renderer/light": LOW,
    "renderer/path": LOW | {"renderer/shell", "renderer/bake", "renderer/light"},
    "renderer/reference": GROUND | {"renderer/asset"},
    "renderer/error": GROUND | {"renderer/asset"},
    "renderer": LOW | {"renderer/shell", "renderer/bake", "renderer/light", "renderer/path",
                       "renderer/reference", "renderer/error"},
    # The service sees the facade, the sources and modules of assets, and what it prints about GL.
    "service": GROUND | {"renderer", "renderer/asset", "renderer/gl"},
}
TOP = {"service", "renderer", "shaders", "api", "tests", "deploy", "Makefile", "README.md",
       "LICENSE", "CONTRIBUTING.md", "CHANGELOG.md", ".ci", ".clang-format", ".clang-tidy",
       ".editorconfig", ".gitignore", ".gitattributes", ".dockerignore"}
GL_ROOMS = {"renderer/gl", "renderer/bake", "renderer/light", "renderer/path"}
GL_CALL = re.compile(r"\b(?:gl[A-Z][A-Za-z0-9]*|egl[A-Z][A-Za-z0-9]*|OSMesa[A-Z]\w*)\s*\(")
LINES_MAX = 600
# Spelt apart, so that this file does not hold them.
WORDS = re.compile(r"\b(" + "|".join(["TO" + "DO", "FIX" + "ME", "XX" + "X", "HA" + "CK"]) + r")\b|"
                   + "#if" + r"\s+0\b|not " + "implemented yet")
MACHINE = re.compile(r"(?<![\w.])/(?:" + "|".join(["work", "root", "home/\\w+", "Users"]) + r")/|"
                     + r"\.\./" + r"shared\b")

faults = []


def fault(path, line, text):
    faults.append(f"{path}:{line}: {text}" if line else f"{path}: {text}")


def tracked():
    out = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                         check=True, capture_output=True).stdout
    return sorted(p for p in out.decode().split("\0") if p and os.path.exists(p))


def room_of(path):
    parts = path.split("/")
    if parts[0] == "renderer" and len(parts) > 2:
        return "/".join(parts[:2])
    return parts[0]


def strip_comments(text):
    """Comments and strings blanked, newlines kept."""
    def blank(match):
        return re.sub(r"[^\n]", " ", match.group(0))
    return re.sub(r"/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\\\n])*\"", blank, text, flags=re.S)


def check_includes(path, text):
    room = room_of(path)
    for number, line in enumerate(text.split("\n"), 1):
        match = re.match(r'\s*#\s*include\s+"([^"]+)"', line)
        if not match:
            continue
        target = match.group(1)
        if room == "shaders" and "/" not in target:
            target = "shaders/" + target
        if target.startswith(("glad/", "KHR/")):
            continue
        if not os.path.exists(target):
            fault(path, number, f'"{target}" is not a path from the root')
            continue
        if room == "tests":
            continue
        other = room_of(target)
        if other != room and other not in MAY_INCLUDE.get(room, set()):
            fault(path, number, f"{room} may not include {target}")


def check_gl(path, text):
    if room_of(path) in GL_ROOMS or path.startswith("tests/"):
        return
    code = strip_comments(text)
    for number, line in enumerate(code.split("\n"), 1):
        match = GL_CALL.search(line)
        if match:
            fault(path, number, f"calls {match.group(0)[:-1].strip()} outside "
                  + ", ".join(sorted(GL_ROOMS)))
    if re.search(r"#\s*include\s*<glad/", text):
        fault(path, 0, "includes the GL loader outside the rooms that draw")


def check_state(path, text):
    """No mutable globals: a file-scope definition that is neither const nor a function."""
    if not path.endswith(".c") or path.startswith("tests/"):
        return
    code = strip_comments(text)
    for number, line in enumerate(code.split("\n"), 1):
        if re.match(r"static\s+(?!const\b|inline\b|_Thread_local\b)[^()]*(=|;|\[[^\]]*\]\s*=)", line) \
                and "const" not in line:
            fault(path, number, "a mutable global: " + line.strip())


def check_text(path, text):
    for number, line in enumerate(text.split("\n"), 1):
        word = WORDS.search(line)
        if word:
            fault(path, number, f"'{word.group(0)}' has no place here")
        if MACHINE.search(line) and "debian" not in path:
            fault(path, number, "names a path of one machine: " + line.strip()[:80])


def main():
    files = tracked()
    for top in sorted({p.split("/")[0] for p in files} - TOP):
        fault(top, 0, "the top level is fixed")
    folders = {os.path.dirname(p) for p in files
               if p.split("/")[0] in ("service", "renderer", "shaders", "api", "tests", "deploy")}
    # A folder of tests or of data is described by the README of the folder above.
    for folder in sorted(folders):
        depth = folder.count("/")
        if depth == 0 or (depth == 1 and folder.startswith("renderer/")):
            if not os.path.exists(folder + "/README.md"):
                fault(folder, 0, "has no README.md")
    for path in files:
        if not path.endswith((".c", ".h", ".cc", ".def", ".vert", ".frag", ".comp", ".glsl", ".sh",
                              ".py", ".md", ".yaml", ".yml", ".json", ".txt", ".service", "Makefile",
                              "/run", "/asan")):
            continue
        with open(path, encoding="utf-8") as file:
            text = file.read()
        if path.endswith((".c", ".h", ".cc", ".def", ".vert", ".frag", ".comp", ".glsl")):
            check_includes(path, text)
            check_gl(path, text) if path.endswith((".c", ".h", ".cc")) else None
            check_state(path, text)
            if not text.startswith("/*") and not text.startswith(("#version", "//")):
                fault(path, 1, "does not open with what it is for")
            lines = text.count("\n")
            if lines > LINES_MAX:
                fault(path, 0, f"{lines} lines: past {LINES_MAX} a file has two subjects")
        if text and not text.endswith("\n"):
            fault(path, 0, "does not end in a newline")
        check_text(path, text)
    for line in faults:
        print(line)
    print(f"{len(files)} files, {len(faults)} faults")
    return 1 if faults else 0


sys.exit(main())
