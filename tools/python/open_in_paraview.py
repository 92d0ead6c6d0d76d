#!/usr/bin/env pvpython
"""Opens a pour's frames.xdmf and walls.xdmf in ParaView off-screen, checks that every step is there
with all its points, and saves a picture of one of them.

    xvfb-run -a -s "-noreset -screen 0 1280x1024x24" \\
        pvpython tools/python/open_in_paraview.py build/pour-4k --out paraview.png --time 1.6

Debian: apt-get install paraview python3-paraview xvfb xauth. Without -noreset the X server may reset
between ParaView's connections, which ends it. Exit status 1 where steps, points or arrays are missing, 2 where
the folder holds no complete pour: the XDMF files are written when it ends.
"""
import argparse
import os
import sys
import xml.etree.ElementTree as xml

from one_line import need_file, refuse

try:
    from paraview import servermanager, simple
except ImportError as missing:
    refuse(f"{missing}: run it with pvpython")


def open_xdmf(file):
    """Reader of the file, updated once."""
    reader = simple.XDMFReader(FileNames=[os.path.abspath(file)])
    reader.UpdatePipeline()
    return reader


def expected(file):
    """Times and points a step, as the XDMF says."""
    try:
        steps = xml.parse(file).getroot().findall("./Domain/Grid/Grid")
        times = [float(step.find("Time").get("Value")) for step in steps]
        return times, int(steps[0].find("Topology").get("NumberOfElements"))
    except (xml.ParseError, AttributeError, IndexError, TypeError, ValueError) as error:
        refuse(f"{file}: not the XDMF of a pour, or cut off: {error}")


def check_folder(folder):
    """Refuses a folder without a complete pour; ParaView's own words for that fill a screen."""
    if not os.path.isdir(folder):
        refuse(f"{folder}: not a folder; a pour's --out is needed")
    if os.path.exists(os.path.join(folder, "frames.h5.partial")):
        refuse(f"{folder}: the pour is not complete: the same `decant pour` with --resume ends it and writes the "
               "XDMF files; render_pour.py draws the frames that there are")
    for name in ("frames.xdmf", "walls.xdmf", "frames.h5"):
        need_file(os.path.join(folder, name), f"{name} of a pour")
    check_whole(os.path.join(folder, "frames.h5"))


def check_whole(file):
    """Refuses what is no HDF5 file, and one that is cut off: the reader crashes on it."""
    with open(file, "rb") as opened:
        head = opened.read(64)
    # Where the superblock of versions 0 to 3 says how long the file is; h5py is not there for every pvpython.
    at = {0: 40, 1: 44, 2: 28, 3: 28}.get(head[8] if len(head) == 64 else None)
    if at is None or not head.startswith(b"\x89HDF\r\n\x1a\n"):
        refuse(f"{file}: not the frames of a pour")
    length = int.from_bytes(head[at:at + 8], "little")
    if os.path.getsize(file) < length:
        refuse(f"{file}: cut off, {os.path.getsize(file)} of {length} bytes")


def arrays(reader):
    return {reader.PointData.GetArray(k).Name for k in range(reader.PointData.NumberOfArrays)}


def check(fluid, times, points):
    """Complaints about steps and points."""
    complaints = []
    found = list(fluid.TimestepValues)
    if len(found) != len(times):
        complaints.append(f"{len(found)} time steps instead of {len(times)}")
    for index in sorted({0, len(times) // 2, len(times) - 1}):
        fluid.UpdatePipeline(times[index])
        count = fluid.GetDataInformation().GetNumberOfPoints()
        if count != points:
            complaints.append(f"{count} points at step {index} instead of {points}")
    missing = {"velocity", "density", "pressure", "place"} - arrays(fluid)
    if missing:
        complaints.append("no arrays " + ", ".join(sorted(missing)))
    return complaints


def check_walls(walls, times, moves):
    """Complaints about walls that ought to move and do not: a reader may keep old geometry."""
    first, last = bounds_of(walls, times[0]), bounds_of(walls, times[-1])
    if moves and max(abs(a - b) for a, b in zip(first, last)) == 0:
        return ["the walls stand still"]
    return []


def bounds_of(proxy, time):
    proxy.UpdatePipeline(time)
    return proxy.GetDataInformation().GetBounds()


def picture(fluid, walls, time, out):
    """The pour from the front, the walls cut open along y = 0."""
    view = simple.CreateView("RenderView")
    view.ViewSize = [1100, 800]
    view.UseColorPaletteForBackground = 0
    view.Background = [1, 1, 1]
    view.OrientationAxesVisibility = 0
    view.ViewTime = time

    dots = simple.Show(fluid, view)
    dots.Representation = "Point Gaussian"
    low, high = (bounds_of(walls, time)[k::2] for k in (0, 1))
    extent = max(h - l for l, h in zip(low, high))
    dots.GaussianRadius = 0.006 * extent
    dots.ShaderPreset = "Sphere"
    simple.ColorBy(dots, ("POINTS", "velocity", "Magnitude"))
    dots.RescaleTransferFunctionToDataRange(False, True)
    dots.SetScalarBarVisibility(view, True)
    bar = simple.GetScalarBar(simple.GetColorTransferFunction("velocity"), view)
    bar.Title, bar.ComponentTitle = "speed, m/s", ""
    bar.TitleColor = bar.LabelColor = [0.15, 0.19, 0.23]

    half = simple.Clip(Input=walls)
    half.ClipType = "Plane"
    half.ClipType.Origin = [0, 0, 0]
    half.ClipType.Normal = [0, -1, 0]
    shell = simple.Show(half, view)
    shell.Representation = "Surface"
    shell.DiffuseColor = shell.AmbientColor = [0.55, 0.6, 0.66]
    shell.ColorArrayName = [None, ""]

    centre = [(l + h) / 2 for l, h in zip(low, high)]
    view.CameraFocalPoint = centre
    view.CameraPosition = [centre[0], centre[1] - 3 * extent, centre[2] + 0.6 * extent]
    view.CameraViewUp = [0, 0, 1]
    simple.ResetCamera(view)
    view.GetActiveCamera().Dolly(1.4)
    simple.Render(view)
    simple.SaveScreenshot(out, view)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", help="the pour's --out")
    parser.add_argument("--out", required=True, help="PNG to write")
    parser.add_argument("--time", type=float, help="s; else the middle step")
    parser.add_argument("--moving-walls", action="store_true",
                        help="fail where the walls' bounds are the same at the end as at the start")
    a = parser.parse_args()
    check_folder(a.folder)
    times, points = expected(os.path.join(a.folder, "frames.xdmf"))
    fluid = open_xdmf(os.path.join(a.folder, "frames.xdmf"))
    walls = open_xdmf(os.path.join(a.folder, "walls.xdmf"))
    complaints = check(fluid, times, points)
    complaints += check_walls(walls, times, a.moving_walls)
    wanted = times[len(times) // 2] if a.time is None else a.time
    time = min(times, key=lambda t: abs(t - wanted))
    picture(fluid, walls, time, a.out)
    version = servermanager.vtkSMProxyManager.GetVersionMajor(), \
        servermanager.vtkSMProxyManager.GetVersionMinor()
    print(f"ParaView {version[0]}.{version[1]}: {len(times)} steps, {points} points, "
          f"picture at t = {time:.3f} s: {a.out}")
    for complaint in complaints:
        print("open_in_paraview: " + complaint, file=sys.stderr)
    return 1 if complaints else 0


if __name__ == "__main__":
    status = main()
    # ParaView 5.11 under Xvfb fails with GLXBadContext while it tears its window down.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)
