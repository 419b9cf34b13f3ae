#!/usr/bin/env python3
"""The tables of assets/guide/validation.md, from what accuracy.py measured: tables.py

Replaces the first table below each of the headings "Reflectances" and "Pictures" by one that is made from
accuracy.csv and pictures.csv, which accuracy.py writes. A line is of a capture of captures.toml, in its order.
Needs Python 3.11 alone.
"""

import csv
import pathlib
import statistics
import tomllib

HERE = pathlib.Path(__file__).parent
PAGE = HERE.parent / "guide/validation.md"


def lines(name, *keys):
    with open(HERE / name, newline="") as file:
        return {tuple(line[key] for key in keys): line for line in csv.DictReader(file)}


def row(cells):
    return "| " + " | ".join(cells) + " |"


def table(heads, rows):
    return [row(heads), "|---" * len(heads) + "|", *map(row, rows)]


def reflectances(captures):
    measured = lines("accuracy.csv", "capture", "run")
    rows, columns = [], []
    inside = intervals = 0
    for capture in captures:
        own = {run: measured.get((capture["name"], run)) for run in ("joint", "pinned", "paper")}
        if own["joint"] is None:
            continue
        joint = own["joint"]
        inside, intervals = inside + int(joint["inside"]), intervals + int(joint["intervals"])
        numbers = [joint["error"], joint["one_scale"]]
        numbers += [own[run]["error"] if own[run] else "" for run in ("pinned", "paper")]
        columns.append(numbers)
        rows.append(
            [f"`{capture['name']}`", capture["what"]]
            + [f"{float(number):.4f}" if number else "" for number in numbers]
            + [f"{joint['inside']} of {joint['intervals']}"]
        )
    means = [statistics.mean(float(number) for number in column if number) for column in zip(*columns)]
    rows.append(["mean", ""] + [f"{mean:.4f}" for mean in means] + [f"{inside} of {intervals}"])
    heads = ["capture", "what it is", "error", "after one scale", "one material known", "`paper`", "in intervals"]
    return table(heads, rows)


def pictures(captures):
    measured = lines("pictures.csv", "capture", "run", "kind")
    rows, columns = [], []
    for capture in captures:
        own = {kind: measured.get((capture["name"], "joint", kind)) for kind in ("view", "relit", "inserted", "light_only")}
        if own["view"] is None:
            continue
        paper = measured.get((capture["name"], "paper", "view"))
        numbers = [own["view"]["psnr"], own["view"]["flip"]]
        numbers += [own[kind]["psnr"] if own[kind] else "" for kind in ("relit", "inserted", "light_only")]
        numbers.append(paper["psnr"] if paper else "")
        columns.append(numbers)
        rows.append([capture["what"], *(told(place, number) for place, number in enumerate(numbers))])
    means, worst = [], []
    for place, column in enumerate(zip(*columns)):
        known = [float(number) for number in column if number]
        means.append(told(place, statistics.mean(known)))
        worst.append(told(place, max(known) if place == FLIP else min(known)))
    rows += [["mean", *means], ["the worst", *worst]]
    heads = ["capture", "a view that was held out", "FLIP", "relit", "inserted", "light only", "the view by `paper`"]
    return table(heads, rows)


FLIP = 1


def told(place, number):
    if number == "":
        return ""
    return f"{float(number):.3f}" if place == FLIP else f"{float(number):.1f} dB"


def replaced(page, heading, new):
    """The lines of a page with another first table below a heading."""
    start = page.index(heading)
    first = next(index for index in range(start, len(page)) if page[index].startswith("|"))
    last = first
    while page[last].startswith("|"):
        last += 1
    return page[:first] + new + page[last:]


def main():
    captures = tomllib.loads((HERE / "captures.toml").read_text())["capture"]
    page = PAGE.read_text().split("\n")
    page = replaced(page, "## Reflectances", reflectances(captures))
    page = replaced(page, "## Pictures", pictures(captures))
    PAGE.write_text("\n".join(page))


if __name__ == "__main__":
    main()
