#!/usr/bin/env python3
"""The licences of all crates that the program is built on, with their texts, for the packages.

    assets/licences.py [FILE]

Without FILE only checks that every licence is one that the program may be shipped under. Crates of
tests, benches and build scripts are in no program and are left out.
"""
import json
import pathlib
import re
import subprocess
import sys

ALLOWED = {
    "0BSD", "Apache-2.0", "Apache-2.0 WITH LLVM-exception", "BSD-2-Clause", "BSD-3-Clause", "BSL-1.0",
    "CC0-1.0", "ISC", "MIT", "MIT-0", "NCSA", "OFL-1.1", "LicenseRef-UFL-1.0", "Ubuntu-font-1.0",
    "Unicode-3.0", "Unlicense", "Zlib",
}
root = pathlib.Path(__file__).resolve().parent.parent
host = re.search(r"host: (\S+)", subprocess.check_output(["rustc", "-vV"], text=True))[1]
metadata = json.loads(subprocess.check_output(
    ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", host], cwd=root))
packages = {package["id"]: package for package in metadata["packages"]}
nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}

# What is reached from the program by dependencies that are linked into it.
own = metadata["resolve"]["root"]
reached, todo = set(), [own]
while todo:
    current = todo.pop()
    if current in reached:
        continue
    reached.add(current)
    todo += [dep["pkg"] for dep in nodes[current]["deps"]
             if any(kind["kind"] is None for kind in dep["dep_kinds"])]
reached.remove(own)
crates = sorted((packages[id] for id in reached), key=lambda crate: (crate["name"], crate["version"]))


def may_ship(expression):
    """Whether a licence expression can be met: all parts joined by AND, one of those joined by OR."""
    expression = expression.replace("/", " OR ").strip()
    depth, parts, words = 0, {"OR": [], "AND": []}, re.findall(r"\(|\)|[^\s()]+", expression)
    for operator in ("OR", "AND"):
        depth, part, found = 0, [], []
        for word in words:
            depth += {"(": 1, ")": -1}.get(word, 0)
            if word == operator and depth == 0:
                found.append(part)
                part = []
            else:
                part.append(word)
        found.append(part)
        if len(found) > 1:
            each = [may_ship(" ".join(part)) for part in found]
            return any(each) if operator == "OR" else all(each)
    if words and words[0] == "(" and words[-1] == ")":
        return may_ship(" ".join(words[1:-1]))
    return " ".join(words) in ALLOWED


wrong = [crate for crate in crates if not may_ship(crate["license"] or "")]
for crate in wrong:
    print(f"licences.py: {crate['name']} {crate['version']}: {crate['license'] or 'no licence is named'}",
          file=sys.stderr)
if wrong:
    sys.exit("licences.py: look at these licences; add them to ALLOWED or do without the crates")
if len(sys.argv) < 2:
    print(f"{len(crates)} crates, all under licences that are allowed")
    sys.exit()

texts = {}
for crate in crates:
    folder = pathlib.Path(crate["manifest_path"]).parent
    licences = [file for file in folder.iterdir() if file.is_file()
                and re.match(r"(?i)(licen[cs]e|copying|notice|copyright|unlicense)", file.name)]
    # Those of fonts lie beside the fonts.
    for file in sorted(licences + list(folder.glob("fonts/*.txt"))):
        text = file.read_text(errors="replace").strip().replace("\r\n", "\n")
        texts.setdefault(text, []).append(f"{crate['name']} {crate['version']}")
with open(sys.argv[1], "w") as out:
    out.write("lobelia is under the MIT licence. It is built on these crates:\n\n")
    for crate in crates:
        out.write(f"  {crate['name']} {crate['version']}: {crate['license']}\n")
    out.write("\nTheir texts:\n")
    for text, names in sorted(texts.items(), key=lambda item: item[1]):
        out.write(f"\n{'=' * 80}\n{', '.join(names)}\n{'=' * 80}\n\n{text}\n")
print(f"{len(crates)} crates, {len(texts)} texts")
