"""Copies gpu/ with faults in it, all in one build: a number chosen at run time says which is on.

plant.py GPU_FOLDER OUT             the catalogue's faults
plant.py GPU_FOLDER OUT --mutate N  N mutations of operators and constants, chosen by --seed
plant.py GPU_FOLDER OUT --catalogue heldout   the faults of heldout.py instead of the catalogue's

Leaves OUT/gpu/… and OUT/faults.json, which lists them for run_faults.cpp. Files that stay the same
are not touched, so that nothing is compiled for nothing.
"""

import argparse
import importlib
import json
import random
import re
from pathlib import Path

# Where formulas and searches are; what starts kernels, copies or decides when to search again is left to
# the catalogue.
MUTATED = ["physics.cuh", "passes.cuh", "contact.cuh", "walls.cuh", "queries.cuh", "collect.cuh",
           "cells.cuh", "brute_force.cuh", "device_scene.cpp"]


def planted(text, changes, file):
    """The file's text with the changes (number, name, find, put); what is put is an expression, or says
    ON where it asks."""
    places = {}
    for number, name, find, put in changes:
        count = text.count(find)
        if count != 1:
            raise SystemExit(f"{name}: {find!r} stands {count} times in {file}")
        at = text.index(find)
        places.setdefault((at, at + len(find)), []).append((number, name, put))
    end, parts = 0, []
    for (begin, stop), here in sorted(places.items()):
        if begin < end:
            raise SystemExit(f"{here[0][1]}: overlaps another fault in {file}")
        found = new = text[begin:stop]
        asks = any("ON" in put for _, _, put in here)
        if asks and len(here) > 1:
            raise SystemExit(f"{here[0][1]}: shares its place in {file}")
        for number, _, put in here:
            put = put.replace("$", f"({found})")
            if asks:
                new = re.sub(r"\bON\b", f"fault({number})", put)
            else:
                new = f"(fault({number}) ? ({put}) : ({new}))"
        parts += [text[end:begin], new]
        end = stop
    return "".join(parts) + text[end:]


def host_lines(text):
    """Line numbers that g++ compiles and that may hold an expression worth a mutation."""
    cuda, lines = [], []
    for number, line in enumerate(text.split("\n")):
        bare = line.strip()
        if bare.startswith("#if"):
            cuda.append(bare == "#ifdef __CUDACC__")
        elif bare.startswith("#else"):
            cuda[-1] = False
        elif bare.startswith("#endif"):
            cuda.pop()
        elif not (any(cuda) or bare.startswith(("#", "//", "static_assert", "static constexpr",
                                               "constexpr", "inline constexpr", "for (",
                                               "while ("))):
            lines.append(number)
    return lines


def sites(file, text):
    """Every place of the file that can be mutated: (line, column, length, put, what)."""
    rows = text.split("\n")
    for number in host_lines(text):
        code = rows[number].split("//")[0]
        for m in re.finditer(r"(?<=[\w\)\]]) ([+\-]) (?=[\w\(])", code):
            yield number, m.start(), 3, f" {m[1]} Turn{{@}} * ", f"{m[1]} turned"
        for m in re.finditer(r"(?<=[\w\)\]]) \* (?=[\w\(])", code):
            yield number, m.start(), 3, " * Gain{@} * ", "left of * larger by 1 %, integers by 1"
        for m in re.finditer(r"(?<=[\w\)\]]) (<|>=) (?=[\w\(\-])", code):
            yield number, m.start(), len(m[0]), f" {m[1]} Beyond{{@}} + ", f"{m[1]} one step on"
        for m in re.finditer(r"(?<![\w.])(\d+\.\d*(?:e-?\d+)?f)\b", code):
            value = float(m[1][:-1])
            for instead, what in (((1.01 * value, "× 1.01"), (0.5 * value, "halved")) if value
                                  else ((0.01, "→ 0.01"),)):
                yield number, m.start(), len(m[0]), f"altered(@, {m[1]}, {instead!r}f)", f"{m[1]} {what}"


def mutations(texts, count, seed):
    """(file, line, column, length, put, what), at most one a place and operator, spread at random."""
    every = [(file, *site) for file in MUTATED for site in sites(file, texts[file])]
    chosen = random.Random(seed).sample(every, min(4 * count, len(every)))
    taken, kept = set(), []
    for site in chosen:
        if (site[0], site[1], site[2]) in taken or len(kept) == count:
            continue
        taken.add((site[0], site[1], site[2]))
        kept.append(site)
    return kept, len(every)


def mutated(texts, kept):
    """Texts with the mutations, and the list of them."""
    faults = []
    for file in MUTATED:
        rows = texts[file].split("\n")
        mine = sorted((s for s in kept if s[0] == file), key=lambda s: (s[1], -s[2]))
        for _, line, column, length, put, what in mine:
            number = len(faults) + 1
            original = texts[file].split("\n")[line].strip()
            faults.append(dict(number=number, name=f"{file}:{line + 1}:{column + 1}", what=what,
                               line=original, file=file))
            row = rows[line]
            rows[line] = row[:column] + put.replace("@", str(number)) + row[column + length:]
        texts[file] = "\n".join(rows)
    return faults


def main():
    p = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    p.add_argument("source", type=Path)
    p.add_argument("out", type=Path)
    p.add_argument("--mutate", type=int, metavar="N")
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--catalogue", default="catalogue", metavar="MODULE", help="where FAULTS are listed")
    a = p.parse_args()
    texts = {f.name: f.read_text() for f in sorted(a.source.iterdir()) if f.name != "CMakeLists.txt"}
    if a.mutate:
        kept, every = mutations(texts, a.mutate, a.seed)
        listed = mutated(texts, kept)
        print(f"{len(kept)} of {every} mutations")
    else:
        faults = importlib.import_module(a.catalogue).FAULTS
        listed = [dict(f, number=k) for k, f in enumerate(faults, 1)]
        changes = [(f["number"], f["name"], *change) for f in listed for change in f["changes"]]
        for file in {c[2] for c in changes}:
            texts[file] = planted(texts[file], [(*c[:2], *c[3:]) for c in changes if c[2] == file],
                                  file)
    for file in ("exec.cuh", "device_scene.hpp", "options.hpp"):
        texts[file] = texts[file].replace("#pragma once\n", '#pragma once\n\n#include "gpu/fault.hpp"\n', 1)
    texts["fault.hpp"] = Path(__file__).with_name("fault.hpp").read_text()
    if not a.mutate:
        texts["executor_cuda.cu"] += CHOOSE_ON_DEVICE
    texts["faults.json"] = json.dumps(listed, indent=1, ensure_ascii=False)
    (a.out / "gpu").mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        to = a.out / name if name == "faults.json" else a.out / "gpu" / name
        if not to.exists() or to.read_text() != text:
            to.write_text(text)


CHOOSE_ON_DEVICE = """
namespace decant::gpu::cuda {
void choose_fault(int number) {
  CUDA_CHECK(cudaMemcpyToSymbol(fault_on_device, &number, sizeof number));
}
}  // namespace decant::gpu::cuda
"""

if __name__ == "__main__":
    main()
