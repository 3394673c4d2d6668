"""How long the pictures of `organza view` take, and how much memory: one Markdown table.

    cargo build --release
    python3 benches/view.py [--organza PROGRAM] [--size WxH] [INPUT ...]

An INPUT is a scene or a data file; without any, the scenes of `scenes/` and three data files of `assets/`. Each is viewed by the command itself, without a
browser: this program asks for what a page would. `PROGRAM` is `target/release/organza` unless told otherwise.

Columns, in milliseconds of processor time of the whole process, all threads, unless said otherwise:

first       from the start of the command to its first picture, a coarse one; behind it by the clock
drag        of a picture, during five seconds in which the hand moves; behind it the median time between two by the clock
whole       from the end of the hand's movement in the first view to the whole picture, by the clock; behind it a second frame of `organza render` in a turn
intensity, visible, curve    to the first picture after such a change, where the scene has something to change
memory      greatest resident memory of the view, MB; behind it that of `organza render`
"""

import argparse
import json
import os
import pathlib
import signal
import statistics
import subprocess
import tempfile
import threading
import time
import urllib.request

ROOT = pathlib.Path(__file__).parents[1]
DATA = ["stanford-bunny/bunny.ply.gz", "autzen/autzen_trim.laz", "mni152/mni152_t1.nii.gz"]
TICK = os.sysconf("SC_CLK_TCK")
DRAG = 5.0
"""Seconds that the hand moves."""
EVENTS = 30
"""Events a second of a hand."""
QUIET = 0.6
"""Seconds without processor time after which nothing is made ahead any more."""


class View:
    """A view without a browser."""

    def __init__(self, program, source, size):
        self.started = time.monotonic()
        command = [program, "view", source, "--no-open", "--size", size]
        self.process = subprocess.Popen(command, cwd=ROOT, text=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self.url = self.process.stdout.readline().strip()
        if not self.url:
            raise SystemExit(f"{source}: no view")

    def ask(self, path, events=None):
        body = None if events is None else json.dumps(events).encode()
        request = urllib.request.Request(f"{self.url}{path}", data=body, headers={"content-type": "application/json"})
        return urllib.request.urlopen(request, timeout=600)

    def state(self):
        return json.load(self.ask("state?client=bench&after=0"))

    def send(self, *events):
        return json.load(self.ask("events?client=bench", events))

    def picture_after(self, number):
        """Number and state of the next picture."""
        while True:
            answer = self.ask(f"picture?client=bench&after={number}")
            if answer.status == 200:
                answer.read()
                return int(answer.headers["organza-number"]), int(answer.headers["organza-generation"])

    def processor(self):
        """Milliseconds of processor time of the process."""
        fields = pathlib.Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return 1e3 * (int(fields[11]) + int(fields[12])) / TICK

    def memory(self):
        """Greatest resident memory, MB."""
        lines = pathlib.Path(f"/proc/{self.process.pid}/status").read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024

    def wait_for_whole(self):
        """The state with its whole picture."""
        version = 0
        while True:
            state = json.load(self.ask(f"state?client=bench&after={version}"))
            version = state["version"]
            if state["failure"]:
                raise SystemExit(f"{state['title']}: {state['failure']['message']}")
            if state["is_whole"]:
                return state

    def wait_for_quiet(self):
        before = -1.0
        while (now := self.processor()) != before:
            before = now
            time.sleep(QUIET)

    def drag(self):
        """Milliseconds of a picture during a drag: of the processor, and by the clock."""
        begun, clock = self.processor(), time.monotonic()
        times = []
        is_over = threading.Event()

        def follow():
            number = self.state()["picture"]["number"]
            while not is_over.is_set():
                number, _ = self.picture_after(number)
                times.append(time.monotonic())

        follower = threading.Thread(target=follow)
        follower.start()
        for step in range(int(DRAG * EVENTS)):
            self.send({"do": "orbit", "right": 0.004, "up": 0})
            time.sleep(max(0.0, clock + (step + 1) / EVENTS - time.monotonic()))
        spent, pictures = self.processor() - begun, len(times)
        is_over.set()
        follower.join()
        between = [after - before for before, after in zip(times[:pictures], times[1:pictures])]
        return spent / max(1, pictures), 1e3 * statistics.median(between or [DRAG])

    def change(self, *events):
        """Milliseconds of processor time until the first picture after events; `None` without any."""
        if not events:
            return None
        self.wait_for_whole()
        self.wait_for_quiet()
        begun = self.processor()
        number = self.state()["picture"]["number"]
        generation = self.send(*events)["generation"]
        while True:
            number, shown = self.picture_after(number)
            if shown >= generation:
                return self.processor() - begun

    def close(self):
        self.process.send_signal(signal.SIGINT)
        self.process.wait()


def rendered(program, source, size):
    """Milliseconds by the clock of the second frame of a turn, and the greatest memory of one picture, MB."""
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "render", source, "--size", size, "-q", "-o", f"{folder}/picture.png"]
        process = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        if status != 0:
            raise SystemExit(f"{source}: `organza render` failed")
        frames = [program, "render", source, "--size", size, "--turntable", "36", "--frames=0-1", "-o", f"{folder}/turn.png", "--json"]
        done = subprocess.run(frames, cwd=ROOT, stderr=subprocess.DEVNULL, stdout=subprocess.PIPE, check=True)
        second = json.loads(done.stdout)["frames"][1]
        return 1e3 * sum(stage["seconds"] for stage in second["cost"]), usage.ru_maxrss / 1024


def row(program, source, size):
    view = View(program, source, size)
    view.picture_after(0)
    first, first_clock = view.processor(), 1e3 * (time.monotonic() - view.started)
    view.wait_for_whole()
    view.wait_for_quiet()
    drag, drag_clock = view.drag()
    begun = time.monotonic()
    view.send({"do": "reset"}, {"do": "done"})
    state = view.wait_for_whole()
    whole = 1e3 * (time.monotonic() - begun)
    lights = [light["name"] for light in state["lights"]]
    shown = [found for found in state["objects"] if found["visible"]]
    volumes = [found for found in shown if found["curve"]]
    intensity = view.change(*[{"do": "light_intensity", "light": name, "stops": 0.5} for name in lights[:1]])
    visible = view.change(*[{"do": "show", "object": found["name"], "visible": False} for found in shown[:1] if len(shown) > 1])
    view.change({"do": "restore"})
    thinner = lambda knots: [knot | {"extinction": 0.7 * knot["extinction"]} for knot in knots]
    curve = view.change(*[{"do": "transfer", "object": found["name"], "knots": thinner(found["curve"]["knots"])} for found in volumes[:1]])
    view.wait_for_whole()
    view.wait_for_quiet()
    memory = view.memory()
    view.close()
    frame, memory_of_render = rendered(program, source, size)
    number = lambda ms: "–" if ms is None else f"{ms:.0f}"
    cells = [source, f"{number(first)}, {number(first_clock)}", f"{number(drag)}, {number(drag_clock)}", f"{number(whole)} / {number(frame)}"]
    cells += [number(intensity), number(visible), number(curve), f"{memory:.0f} / {memory_of_render:.0f}"]
    print(f"| {' | '.join(cells)} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--organza", default=str(ROOT / "target/release/organza"), help="the command")
    parser.add_argument("--size", default="960x540", help="of the whole picture, pixels")
    parser.add_argument("input", nargs="*", help="a scene or a data file")
    arguments = parser.parse_args()
    scenes = sorted(str(path.relative_to(ROOT)) for path in (ROOT / "scenes").glob("*.toml"))
    inputs = arguments.input or scenes + [f"assets/{name}" for name in DATA]
    print("| input | first, clock | drag, clock | whole / frame | intensity | visible | curve | memory / render |\n|---|---|---|---|---|---|---|---|")
    for source in inputs:
        row(arguments.organza, source, arguments.size)


if __name__ == "__main__":
    main()
