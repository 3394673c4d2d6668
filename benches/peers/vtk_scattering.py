"""Rows of `--bench half_vector -- head` by VTK's vtkGPUVolumeRayCastMapper: shading alone, and volumetric scattering, which casts
shadow rays from every sample.

    pip install vtk numpy
    python3 benches/peers/vtk_scattering.py [REACH [VOLUME]]

Without a graphics board that is Mesa's llvmpipe. Rays towards the light end after REACH of the volume (0, the mapper's default, to 1). Least
seconds of three frames of the translucent head at 400x400, one sample a step of the lattice, by the clock and of all threads on processors.
"""

import sys
import time

import vtk
from vtk_volume import HEAD, SEMI, Likeness, scene, source

REPEATS = 3


def main():
    reach = float(sys.argv[1]) if len(sys.argv) > 1 else 0.0
    file = sys.argv[2] if len(sys.argv) > 2 else HEAD
    reader = source(file)
    reader.Update()
    data = reader.GetOutputDataObject(0)
    window, renderer, _ = scene(reader, Likeness(data, file in (HEAD, "dense")), SEMI, True, False, 400, 2)
    mapper = vtk.vtkGPUVolumeRayCastMapper()
    mapper.SetInputConnection(reader.GetOutputPort())
    mapper.SetAutoAdjustSampleDistances(False)
    mapper.SetSampleDistance(min(data.GetSpacing()))
    renderer.GetVolumes().GetItemAsObject(0).SetMapper(mapper)
    window.Render()
    print(f"VTK {vtk.vtkVersion().GetVTKVersion()}, {data.GetDimensions()}, reach {reach}: {board(window)}")
    for name, blending in (("shaded", 0.0), ("scattering", 1.0)):
        mapper.SetVolumetricScatteringBlending(blending)
        mapper.SetGlobalIlluminationReach(reach)
        best, busy = float("inf"), float("inf")
        for n in range(REPEATS):
            renderer.GetActiveCamera().Azimuth(1e-4 * (-1) ** n)
            start, start_busy = time.perf_counter(), time.process_time()
            window.Render()
            window.WaitForCompletion()
            best = min(best, time.perf_counter() - start)
            busy = min(busy, time.process_time() - start_busy)
        print(f"{name:>12} {best:7.2f} {busy:7.2f} s", flush=True)


def board(window):
    lines = window.ReportCapabilities().splitlines()
    return next((line for line in lines if "renderer string" in line), "an unknown renderer")


main()
