"""The rows of `--bench sheets` by VTK's vtkFixedPointVolumeRayCastMapper: the same head, transfer functions, views and sizes.

    pip install vtk numpy
    python3 benches/peers/vtk_volume.py [THREADS [STEP [WORD [VOLUME]]]]

A ray is sampled every STEP of the lattice's shortest steps, 1 if nothing is said; no antialiasing. Least times of several
frames, the camera moved by nothing visible so that each is cast anew: by the clock, and of all threads on processors. The error
is that to its own picture at a quarter of a step; finer steps lose digits of its fixed-point opacities. With WORD those rows whose name has it, with
VOLUME (MetaImage, NRRD or `dense`) that in the place of the head, as `--bench sheets` has it.
"""

import pathlib
import sys
import time

import numpy
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

HEAD = pathlib.Path(__file__).parents[2] / "assets/mni152/mni152_t1.nii.gz"
SEMI = [(30, 0.0), (80, 0.004), (150, 0.01), (200, 0.05), (255, 0.08)]
ISO = [(90, 0.0), (110, 2.0)]
REPEATS = 7


def dense():
    """Three waves whose values are 40 to 240."""
    wave = numpy.sin(numpy.arange(256) / 256.0 * 2.0 * numpy.pi * 3.0)
    values = numpy.rint(140.0 + 100.0 / 3.0 * (wave[:, None, None] + wave[:, None] + wave)).astype(numpy.uint8)
    data = vtk.vtkImageData()
    data.SetDimensions(256, 256, 256)
    data.GetPointData().SetScalars(numpy_to_vtk(values.ravel(), deep=True))
    producer = vtk.vtkTrivialProducer()
    producer.SetOutput(data)
    return producer


def source(file):
    if file == "dense":
        return dense()
    suffix = pathlib.Path(file).suffix
    reader = {".gz": vtk.vtkNIFTIImageReader, ".mha": vtk.vtkMetaImageReader, ".nrrd": vtk.vtkNrrdReader}[suffix]()
    reader.SetFileName(str(file))
    return reader


class Likeness:
    """What a volume is to the head: the value in the place of 0, that of one step of its 255, and its diagonal over the head's."""

    def __init__(self, data, in_bytes):
        self.lowest, highest = (0.0, 255.0) if in_bytes else data.GetScalarRange()
        self.step = (highest - self.lowest) / 255.0
        sides = [n * s for n, s in zip(data.GetDimensions(), data.GetSpacing())]
        self.length = numpy.linalg.norm(sides) / numpy.linalg.norm([197.0, 233.0, 189.0])


def transfer(points, volume, like):
    """Extinction per millimetre of the head, entry by entry: opacities between entries would not be those of their extinctions."""
    opacity, color = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
    values, extinctions = zip(*points)
    for value in range(256):
        extinction = numpy.interp(value, values, extinctions)
        stored = like.lowest + like.step * value
        opacity.AddPoint(stored, 1.0 - numpy.exp(-extinction))
        t = numpy.clip(value, values[0], values[-1]) / 255.0
        color.AddRGBPoint(stored, 0.4 + 0.6 * t, 0.9 * t, 0.8 - 0.6 * t)
    volume.SetScalarOpacity(opacity)
    volume.SetColor(color)
    volume.SetScalarOpacityUnitDistance(like.length)
    volume.SetInterpolationTypeToLinear()


def scene(reader, like, points, lit, perspective, pixels, threads):
    mapper = vtk.vtkFixedPointVolumeRayCastMapper()
    mapper.SetInputConnection(reader.GetOutputPort())
    mapper.SetAutoAdjustSampleDistances(False)
    mapper.SetLockSampleDistanceToInputSpacing(False)
    mapper.SetImageSampleDistance(1.0)
    mapper.SetNumberOfThreads(threads)
    volume = vtk.vtkVolume()
    volume.SetMapper(mapper)
    transfer(points, volume.GetProperty(), like)
    look = volume.GetProperty()
    look.SetShade(lit)
    look.SetAmbient(0.1)
    look.SetDiffuse(0.9)
    look.SetSpecular(0.2)
    look.SetSpecularPower(32.0)
    renderer = vtk.vtkRenderer()
    renderer.AddVolume(volume)
    renderer.RemoveAllLights()
    renderer.AutomaticLightCreationOff()
    sun = vtk.vtkLight()
    sun.SetPosition(-0.6, 0.5, 0.6)
    sun.SetFocalPoint(0.0, 0.0, 0.0)
    renderer.AddLight(sun)
    middle = numpy.array(volume.GetCenter())
    camera = renderer.GetActiveCamera()
    camera.SetFocalPoint(*middle)
    camera.SetPosition(*(middle + numpy.array([-260.0, 260.0, 100.0]) * like.length))
    camera.SetViewUp(0.0, 0.0, 1.0)
    if perspective:
        camera.SetViewAngle(numpy.degrees(0.54))
    else:
        camera.ParallelProjectionOn()
        camera.SetParallelScale(120.0 * like.length)
    renderer.ResetCameraClippingRange()
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.SetSize(pixels, pixels)
    window.AddRenderer(renderer)
    return window, renderer, mapper


def picture(window, mapper, distance):
    mapper.SetSampleDistance(distance)
    window.Render()
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    return vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars()).astype(float) / 255.0


class Row:
    """Milliseconds of a frame by the clock and of all threads on processors, the latter with what a new volume takes, too; RMSE; mean of all pixels."""

    clock = busy = first = float("inf")
    rmse = mean = 0.0


def measure(drawn, data, step):
    window, renderer, mapper = drawn
    row = Row()
    coarse = picture(window, mapper, step)
    for n in range(REPEATS):
        renderer.GetActiveCamera().Azimuth(1e-4 * (-1) ** n)
        start, start_busy = time.perf_counter(), time.process_time()
        window.Render()
        row.clock = min(row.clock, 1e3 * (time.perf_counter() - start))
        row.busy = min(row.busy, 1e3 * (time.process_time() - start_busy))
    for n in range(2):
        data.Modified()
        start_busy = time.process_time()
        window.Render()
        row.first = min(row.first, 1e3 * (time.process_time() - start_busy))
    fine = picture(window, mapper, 0.25 * min(data.GetSpacing()))
    row.rmse = numpy.sqrt(numpy.mean((coarse - fine) ** 2))
    row.mean = fine.mean()
    return row


def main():
    threads = int(sys.argv[1]) if len(sys.argv) > 1 else 2
    step = float(sys.argv[2]) if len(sys.argv) > 2 else 1.0
    word = sys.argv[3] if len(sys.argv) > 3 else ""
    file = sys.argv[4] if len(sys.argv) > 4 else HEAD
    reader = source(file)
    reader.Update()
    data = reader.GetOutputDataObject(0)
    like = Likeness(data, file in (HEAD, "dense"))
    step *= min(data.GetSpacing())
    print(f"VTK {vtk.vtkVersion().GetVTKVersion()}, {threads} threads, {data.GetDimensions()}, {data.GetScalarTypeAsString()}")
    for pixels in (400, 512):
        for name, points in (("semi", SEMI), ("iso", ISO)):
            for lit in (False, True):
                for perspective in (False, True):
                    light, lens = "shaded" if lit else "unlit", "pinhole" if perspective else "parallel"
                    label = f"{pixels} {name} {light} {lens}"
                    if word not in label:
                        continue
                    drawn = scene(reader, like, points, lit, perspective, pixels, threads)
                    row = measure(drawn, data, step)
                    print(f"{label:>28} {row.clock:6.0f} {row.busy:6.0f} ms, RMSE {row.rmse:.5f}, mean {row.mean:.4f}", flush=True)


if __name__ == "__main__":
    main()
