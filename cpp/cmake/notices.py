"""Writes the licences of all crates that are linked into Halite to a file.

    python3 notices.py CARGO FILE
"""
import json
import pathlib
import subprocess
import sys

cargo, target = sys.argv[1:]


def ask(*arguments):
    return subprocess.run([cargo, *arguments], check=True, stdout=subprocess.PIPE).stdout.decode()


linked = {tuple(line.split()[:2]) for line in
          ask("tree", "--locked", "--edges", "normal", "--package", "halite-bridge", "--prefix", "none").splitlines() if line}
packages = json.loads(ask("metadata", "--locked", "--format-version", "1"))["packages"]

out = ["Halite contains the following software.\n"]
for p in sorted(packages, key=lambda p: (p["name"], p["version"])):
    if p["name"] in ("halite", "halite-bridge") or (p["name"], "v" + p["version"]) not in linked:
        continue
    out.append("=" * 100)
    out.append(f"{p['name']} {p['version']}: {p['license'] or p['license_file']}")
    out.append(f"{p['repository'] or ''}\n")
    folder = pathlib.Path(p["manifest_path"]).parent
    names = ("licen", "copying", "notice", "unlicense")
    for file in sorted(f for f in folder.iterdir() if f.is_file() and f.name.lower().startswith(names)):
        out.append(f"--- {file.name}\n\n{file.read_text(errors='replace').strip()}\n")
text = "\n".join(out)
pathlib.Path(target).write_text(text)
