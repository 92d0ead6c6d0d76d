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
from fnmatch import fnmatch
from pathlib import Path

# Where formulas and searches are; what starts kernels, copies or decides when to search again is left to
# the catalogue.
MUTATED = ["physics/*.cuh", "kernels/density.cuh", "kernels/force.cuh", "kernels/diagnostics.cuh",
           "kernels/integrate.cuh", "kernels/place_walls.cuh", "kernels/boundary_volume.cuh",
           "kernels/find_near_walls.cuh", "kernels/build_list.cuh", "kernels/neighbor_ranges.cuh",
           "core/cell_table.cuh", "core/device_scene.cpp", "backends/brute_force.cu"]

# Where it is declared what asks for a fault: all others include one of these.
ASKING = ["core/executor.cuh", "core/device_scene.hpp", "options.hpp"]


def pattern(text):
    """Finds the text however its tokens are spaced and broken into lines."""
    tokens = re.findall(r"\w+|\S", text)
    parts = [re.escape(tokens[0])]
    for before, token in zip(tokens, tokens[1:]):
        both_words = re.fullmatch(r"\w+", before) and re.fullmatch(r"\w+", token)
        parts.append((r"\s+" if both_words else r"\s*") + re.escape(token))
    return re.compile(r"(?<!\w)" * tokens[0].isidentifier() + "".join(parts) + r"(?!\w)" * tokens[-1].isidentifier())


def located(texts, name, find, file):
    """Where the change is to be made, (file, begin, end): what it looks for stands in one place."""
    if file is not None and file not in texts:
        raise SystemExit(f"{name}: there is no file {file}")
    wanted = pattern(find)
    places = [(f, m.start(), m.end()) for f in ([file] if file else texts) for m in wanted.finditer(texts[f])]
    if len(places) != 1:
        files = ", ".join(sorted({f for f, _, _ in places}))
        raise SystemExit(f"{name}: {find!r} stands {len(places)} times" + (f" in {files}" if files else ""))
    return places[0]


def planted(texts, changes):
    """The texts with the changes (number, name, find, put, file or None); what is put is an expression, or
    says ON where it asks."""
    places = {}
    for number, name, find, put, file in changes:
        places.setdefault(located(texts, name, find, file), []).append((number, name, put))
    new_texts = dict(texts)
    for file in {file for file, _, _ in places}:
        text, end, parts = texts[file], 0, []
        for (_, begin, stop), here in sorted((place, here) for place, here in places.items() if place[0] == file):
            if begin < end:
                raise SystemExit(f"{here[0][1]}: overlaps another fault in {file}")
            found = new = text[begin:stop]
            asks = any("ON" in put for _, _, put in here)
            if asks and len(here) > 1:
                raise SystemExit(f"{here[0][1]}: shares its place in {file} with {here[1][1]}")
            for number, _, put in here:
                put = put.replace("$", f"({found})")
                if asks:
                    new = re.sub(r"\bON\b", f"fault({number})", put)
                else:
                    new = f"(fault({number}) ? ({put}) : ({new}))"
            parts += [text[end:begin], new]
            end = stop
        new_texts[file] = "".join(parts) + text[end:]
    return new_texts


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
    files = [f for glob in MUTATED for f in sorted(texts) if fnmatch(f, glob)]
    every = [(file, *site) for file in files for site in sites(file, texts[file])]
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
    for file in sorted({site[0] for site in kept}):
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
    texts = {f.relative_to(a.source).as_posix(): f.read_text()
             for f in sorted(a.source.rglob("*")) if f.suffix in (".cuh", ".hpp", ".cu", ".cpp")}
    if a.mutate:
        kept, every = mutations(texts, a.mutate, a.seed)
        listed = mutated(texts, kept)
        print(f"{len(kept)} of {every} mutations")
    else:
        faults = importlib.import_module(a.catalogue).FAULTS
        listed = [dict(f, number=k) for k, f in enumerate(faults, 1)]
        texts = planted(texts, [(f["number"], f["name"], *change, *[None] * (3 - len(change)))
                                for f in listed for change in f["changes"]])
    for file in ASKING:
        texts[file] = texts[file].replace("#pragma once\n", '#pragma once\n\n#include "gpu/fault.hpp"\n', 1)
    texts["fault.hpp"] = Path(__file__).with_name("fault.hpp").read_text()
    for file in texts:
        if re.fullmatch(r"backends/\w+\.cu", file):
            texts[file] += CHOOSE_IN_BACKEND
    texts["solver/cuda_device.cu"] += CHOOSE_ON_DEVICE
    for name, text in {**{f"gpu/{name}": text for name, text in texts.items()},
                       "faults.json": json.dumps(listed, indent=1, ensure_ascii=False)}.items():
        to = a.out / name
        if not to.exists() or to.read_text() != text:
            to.parent.mkdir(parents=True, exist_ok=True)
            to.write_text(text)


# Each file of kernels has constant memory of its own.
CHOOSE_IN_BACKEND = """
#ifdef __CUDACC__
namespace decant::gpu {
namespace {
[[maybe_unused]] const bool chooses_faults =
    (cuda::fault_choosers().push_back(
         [](int number) { CUDA_CHECK(cudaMemcpyToSymbol(fault_on_device, &number, sizeof number)); }),
     true);
}  // namespace
}  // namespace decant::gpu
#endif
"""
CHOOSE_ON_DEVICE = """
namespace decant::gpu::cuda {
void choose_fault(int number) {
  for (const auto choose : fault_choosers()) choose(number);
}
}  // namespace decant::gpu::cuda
"""

if __name__ == "__main__":
    main()
