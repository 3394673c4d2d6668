"""Gathered sheets beside VTK's vtkFixedPointVolumeRayCastMapper, row by row: one Markdown table.

    pip install vtk numpy
    python3 benches/peers/volume_table.py [--bench PROGRAM] [--only WORD] [VOLUME ...]

A VOLUME is `head` (the default), `dense` or a MetaImage or NRRD file. Each row is drawn by `--bench sheets`, by the kernels `linear` and `gathered`, and
right after it by VTK with steps as wide as the sheets' slabs: parallel rays, two threads, `--only` those rows whose name has the word. PROGRAM is the compiled
benchmark where it is not to be built here.

Times are milliseconds of processor time of all threads, least of seven: VTK's of a frame of a volume that it knows, `first` of one that has changed, so
that it finds its normals and empty blocks anew; sheets' with all that they prepare, and after a + of the fold alone. Errors are RMSE of colours to the
same program's own picture with the same kernel at finer steps: a quarter (VTK, whose fixed-point opacities lose digits at less) and an eighth.
"""

import argparse
import os
import pathlib
import subprocess

import vtk_volume as peer

ROOT = pathlib.Path(__file__).parents[2]
THREADS = 2


def sheets_row(program, volume, label, kernel):
    """Milliseconds of preparing and of folding, RMSE, slab width."""
    words = {"head": [], "dense": ["dense"]}.get(volume, [str(pathlib.Path(volume).resolve())]) + [f"{label} parallel {kernel}"]
    environment = os.environ | {"RAYON_NUM_THREADS": str(THREADS)}
    done = subprocess.run([*program, *words], cwd=ROOT, env=environment, text=True, stdout=subprocess.PIPE, check=True)
    numbers = done.stdout.strip().splitlines()[-1].split(kernel)[-1].split()
    return float(numbers[1]), float(numbers[3]), float(numbers[9]), float(numbers[10])


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--bench", metavar="PROGRAM")
    arguments.add_argument("--only", metavar="WORD", default="")
    arguments.add_argument("volumes", metavar="VOLUME", nargs="*")
    given = arguments.parse_args()
    program = [given.bench, "--bench"] if given.bench else ["cargo", "bench", "-q", "-p", "organza-benches", "--bench", "sheets", "--"]
    print("| volume, ms | VTK | first | error | linear | / VTK | error | gaussian | / VTK | error |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for volume in given.volumes or ["head"]:
        file = peer.HEAD if volume == "head" else volume
        reader = peer.source(file)
        reader.Update()
        data = reader.GetOutputDataObject(0)
        like = peer.Likeness(data, volume in ("head", "dense"))
        for pixels in (400, 512):
            for name, word, points in (("semi", "translucent", peer.SEMI), ("iso", "nearly opaque", peer.ISO)):
                for lit in (False, True):
                    light = "shaded" if lit else "unlit"
                    label = f"{pixels} {name} {light}"
                    if given.only not in label:
                        continue
                    linear = sheets_row(program, volume, label, "linear")
                    gaussian = sheets_row(program, volume, label, "gathered")
                    vtk = peer.measure(peer.scene(reader, like, points, lit, False, pixels, THREADS), data, linear[3])
                    cells = [f"{pathlib.Path(volume).stem}, {pixels}\u00b2, {word}, {light}"]
                    cells += [f"{vtk.busy:.0f}", f"{vtk.first:.0f}", f"{vtk.rmse:.4f}"]
                    for prepare, fold, rmse, _ in (linear, gaussian):
                        both = prepare + fold
                        cells += [f"{both:.0f} ({prepare:.0f} + {fold:.0f})", f"{both / vtk.busy:.2f}", f"{rmse:.4f}"]
                    print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
