"""Whatever the process is started in: streams, terminals, folders shared, odd files, other backends."""

import json
import math
import os
import random
import re
import signal
import stat
import subprocess
import sys
import threading
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from compare import archive
from compare.archive import finite, load, save
from compare.report.folder import require_room, sections_in, write_section
from compare.report.section import Section, Table
from compare.report.terminal import show, terminal
from compare.sweep import Sweep, pool
from compare.sweep.store import Store
from compare.sweep.task import edition
from ribbonfem import Fold, Scene, elastica
from ribbonfem.output.scene_file import read_scene

ROOT = Path(__file__).parents[1]
PLANAR = 'compression = 0.3\nshear = 0\nstart = "U+"\nrate = 0.3\nstop = 1.2\n'
BARE = {k: v for k, v in os.environ.items() if k not in ("PYTHONUNBUFFERED", "MPLBACKEND", "COLUMNS")}


def shell(line, folder, **environment):
    """A command of the package in a shell, `ribbonfem` standing for it."""
    line = re.sub(r"^ribbonfem", f"{sys.executable} -m compare", line)
    surrounding = {**BARE, "PYTHONPATH": str(ROOT), **environment}
    return subprocess.run(
        ["bash", "-c", line], cwd=folder, env=surrounding, capture_output=True, encoding="utf-8", timeout=120
    )


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "s.toml").write_text(PLANAR, encoding="utf-8")
    return tmp_path


RUN = "ribbonfem run s.toml --tolerance 1e-2 --quiet --out o"


# ---- streams


CLOSED = ((">&-", 0), ("2>&-", 0), (">&- 2>&- <&-", 0), (">/dev/full", 1))


@pytest.mark.parametrize(
    ("command", "to", "status"),
    [(command, to, status) for command in ("--help", "--version") for to, status in CLOSED]
    + [("report --out .", to, status) for to, status in CLOSED[2:]]
    + [(RUN[10:], ">&- 2>&- <&-", 0), (f"{RUN[10:]} --json", ">/dev/full", 1), ("rin", "2>&-", 2)]
    + [("--version", ">/dev/full 2>&1", 1), ("--help", "2>/dev/full", 0), ("report --out x", "2>&-", 1)],
)
def test_streams_that_are_closed_or_full(command, to, status, folder):
    done = shell(f"ribbonfem {command} {to}", folder)
    assert done.returncode == status
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr
    assert done.stderr.count("\n") <= (1 if status == 1 else 0)
    if to == ">/dev/full":
        assert "standard output cannot be written: No space left" in done.stderr
    if command.startswith("run") and status < 2:
        assert json.loads((folder / "o" / "run.json").read_text())["values"]["met"]
        assert (folder / "o" / "report.html").exists()


@pytest.mark.parametrize("columns", ["0", "00", "000"])
def test_no_columns_are_eighty(columns, monkeypatch, capsys, tmp_path):
    section = Section("run", "t", ["word " * 30], (Table("t", ["a"], [["x"]], ["s"]),), (), {})
    monkeypatch.setenv("COLUMNS", "80")
    show(section, tmp_path)
    expected = capsys.readouterr().out
    monkeypatch.setenv("COLUMNS", columns)
    with terminal():
        show(section, tmp_path)
    assert capsys.readouterr().out == expected
    assert os.environ["COLUMNS"] == columns


# ---- backends


def test_reports_are_drawn_whatever_the_backend(tmp_path):
    named = [
        "module://matplotlib_inline.backend_inline",
        "module://not.there",
        "nonsense",
        "TkAgg",
        "svg",
        "",
    ]
    script = """
import os, sys
import PIL.Image, ribbonfem, scipy.interpolate
folder, *backends = sys.argv[1:]
for backend in backends:
    if os.fork():
        assert os.wait()[1] == 0, backend
        continue
    os.environ["MPLBACKEND"] = backend
    from ribbonfem.output.style import figure, in_style
    import ribbonfem.output.film
    with in_style():
        fig, axes = figure(1)
        axes.plot([1, 2], label="x")
        fig.savefig(f"{folder}/{len(backend)}.png")
    assert os.environ["MPLBACKEND"] == backend
    assert "matplotlib.pyplot" not in sys.modules
    os._exit(0)
"""
    surrounding = {**BARE, "PYTHONPATH": str(ROOT)}
    words = [sys.executable, "-c", script, tmp_path, *named]
    subprocess.run(words, env=surrounding, check=True, timeout=120)
    assert len(list(tmp_path.glob("*.png"))) == len({len(backend) for backend in named})


@pytest.mark.parametrize("backend", ["svg"])
def test_plots_leave_settings_and_the_backend_alone(backend):
    script = f"""
import matplotlib
matplotlib.use({backend!r})
matplotlib.rcParams["font.size"] = 13
before = dict(matplotlib.rcParams)
import compare
from ribbonfem.output.film import film
from ribbonfem import Scene, elastica, kirchhoff
beam = Scene(compression=0.3, shear=0.0, start="U+", rate=1.0, stop=0.1)
motion = elastica.simulate(beam, elements=4)
axes = motion.plot(curve=elastica.equilibria(beam, elements=4))
elastica.equilibria(beam, elements=4).plot()
import tempfile, pathlib
film(motion, pathlib.Path(tempfile.mkdtemp()) / "f.gif", frames=2)
assert type(axes.figure.canvas).__module__.endswith({backend!r}), type(axes.figure.canvas)
assert dict(matplotlib.rcParams) == before
assert matplotlib.get_backend() == {backend!r}
from ribbonfem.output.style import figure
import matplotlib.pyplot as plt
shown = plt.get_fignums()
figure(2)
assert plt.get_fignums() == shown
"""
    surrounding = {**BARE, "PYTHONPATH": str(ROOT)}
    subprocess.run([sys.executable, "-c", script], env=surrounding, check=True, timeout=120)


def test_a_curve_takes_the_word_of_matplotlib_and_the_old_one():
    branch = elastica.equilibria(Scene(compression=0.3, shear=0.0, start="U+"), elements=4)
    for named in ({"color": "red"}, {"colour": "red"}):
        axes = Figure().add_subplot()
        branch.plot(axes, **named)
        assert {line.get_color() for line in axes.lines} == {"red"}
    with pytest.raises(TypeError, match="one of them"):
        branch.plot(Figure().add_subplot(), color="red", colour="blue")


# ---- folders that processes share


TOGETHER = """
import os, sys, time
from pathlib import Path
from compare.report.folder import require_room, write_page
from compare.archive import write_whole
from compare.sweep.store import Store
from compare.report.registry import ORDER
folder, begin = Path(sys.argv[1]), time.time() + 0.2

def work(k):
    time.sleep(max(0.0, begin - time.time()))
    for n in range(60):
        require_room(folder)
        store = Store(folder / ".finished" / "run")
        store.write(f"{k:02d}{n:04d}", n)
        write_whole(folder / "run.csv", f"{k} {n} " * 4000)
        write_page(folder, ORDER)
        if n % 5 == k:
            store.clear()

for k in range(6):
    if not os.fork():
        work(k)
        os._exit(0)
assert [os.wait()[1] for _ in range(6)] == [0] * 6
"""


def test_many_processes_share_a_folder(tmp_path):
    words = [sys.executable, "-c", TOGETHER, str(tmp_path / "o")]
    done = subprocess.run(words, env={**BARE, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    text = (tmp_path / "o" / "run.csv").read_text()
    k, n = text.split()[:2]
    assert text == f"{k} {n} " * 4000
    assert not [path for path in (tmp_path / "o").iterdir() if path.name.startswith(".") and path.is_file()]


def test_room_is_asked_for_by_many_threads(tmp_path):
    failures = []

    def ask():
        try:
            for _ in range(50):
                require_room(tmp_path / "o")
        except OSError as error:
            failures.append(error)

    threads = [threading.Thread(target=ask) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures
    assert not list((tmp_path / "o").iterdir())


def test_a_store_that_is_cleared_beside_its_writing(tmp_path):
    store, stop = Store(tmp_path / "store"), threading.Event()

    def clear():
        while not stop.is_set():
            store.clear()

    thread = threading.Thread(target=clear)
    thread.start()
    try:
        for k in range(200):
            store.write(f"{k % 7:02d}{k:04d}", k)
            kept = store.read(f"{k % 7:02d}{k:04d}")
            assert kept in (None, (k,))
    finally:
        stop.set()
        thread.join()


# ---- files


def kinds(tmp_path):
    """Places to write to, and how what lies there is looked at afterwards."""
    (tmp_path / "there").mkdir()
    target = tmp_path / "there" / "target"
    target.write_bytes(b"old")
    (tmp_path / "link").symlink_to(target)
    (tmp_path / "dangling").symlink_to(tmp_path / "there" / "new")
    (tmp_path / "chain").symlink_to("link")
    return {"link": target, "dangling": tmp_path / "there" / "new", "chain": target}


@pytest.mark.parametrize("name", ["link", "dangling", "chain"])
def test_what_a_link_leads_to_is_written(name, tmp_path):
    target = kinds(tmp_path)[name]
    save(Fold(0.1, 0.2, 0.3), tmp_path / name)
    assert (tmp_path / name).is_symlink()
    assert load(target) == Fold(0.1, 0.2, 0.3)
    assert not target.is_symlink()


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o660, 0o644, 0o664, 0o666, 0o444, 0o755])
def test_a_file_keeps_its_mode(mode, tmp_path):
    path = tmp_path / "kept"
    path.write_bytes(b"old")
    path.chmod(mode)
    save(Fold(0.1, 0.2, 0.3), path)
    assert stat.S_IMODE(path.stat().st_mode) == mode


@pytest.mark.parametrize("mask", [0o022, 0o002, 0o077])
def test_a_new_file_has_the_mode_of_the_process(mask, tmp_path):
    before = os.umask(mask)
    try:
        save(Fold(0.1, 0.2, 0.3), tmp_path / "new")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o666 & ~mask


def test_a_device_stays_one(tmp_path):
    save(Fold(0.1, 0.2, 0.3), "/dev/null")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    read = []
    thread = threading.Thread(target=lambda: read.append(pipe.read_bytes()))
    thread.start()
    save(Fold(0.1, 0.2, 0.3), pipe)
    thread.join()
    assert archive.from_bytes(read[0]) == Fold(0.1, 0.2, 0.3)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    with pytest.raises(OSError, match="No space left"):
        save(Fold(0.1, 0.2, 0.3), "/dev/full")
    with pytest.raises(IsADirectoryError):
        save(Fold(0.1, 0.2, 0.3), tmp_path)


@pytest.mark.parametrize("length", [1, 200, 240, 252, 255])
def test_names_as_long_as_there_may_be(length, tmp_path):
    assert load(save(Fold(0.1, 0.2, 0.3), tmp_path / ("n" * length))) == Fold(0.1, 0.2, 0.3)
    assert [path.name for path in tmp_path.iterdir()] == ["n" * length]


@pytest.mark.parametrize("seed", range(20))
def test_names_that_are_no_letters(seed, tmp_path):
    rng = random.Random(seed)
    raw = bytes(rng.choice([b for b in range(1, 256) if b != ord("/")]) for _ in range(rng.randrange(1, 40)))
    name = os.fsdecode(raw + b"x")
    scene = tmp_path / f"{name}.toml"
    scene.write_text(PLANAR, encoding="utf-8")
    assert read_scene(scene).compression == 0.3
    assert load(save({"file": str(scene), "path": scene}, tmp_path / name)) == {
        "file": str(scene),
        "path": scene,
    }
    section = Section("run", str(scene), [str(scene)], (), (), {"scene": str(scene)})
    out = tmp_path / f"{name}-out"
    write_section(section, out, ("run",))
    assert not sections_in(out, ("run",))[1]


def test_a_run_of_a_file_whose_name_is_no_utf_8(folder):
    (folder / "s.toml").rename(os.fsdecode(os.fsencode(folder) + b"/\xff\xe9\xc3\xbc.toml"))
    names = r"$'\xff\xe9\xc3\xbc.toml' --out $'o\xe9'"
    poor = {"LC_ALL": "C", "LANG": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    # words are UTF-8 whatever the locale
    poor["PYTHONIOENCODING"] = "ascii"
    done = shell(f"ribbonfem run {names} --tolerance 1e-2 --quiet", folder, **poor)
    assert done.returncode == 0, done.stderr
    assert "snap at" in done.stdout
    out = Path(os.fsdecode(os.fsencode(folder) + b"/o\xe9"))
    assert json.loads((out / "run.json").read_text())["values"]["met"]


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_a_scene_with_a_byte_order_mark(mark, tmp_path):
    path = tmp_path / "s.toml"
    path.write_bytes(mark + PLANAR.encode())
    assert read_scene(path) == read_scene(path)
    assert read_scene(path).start == "U+"


def test_json_has_no_words_for_numbers(tmp_path):
    odd = {
        "a": math.inf,
        "b": [-math.inf, (math.nan, 1.5)],
        "c": {"d": np.float64("inf")},
        "e": "inf",
        "f": True,
    }
    assert finite(odd) == {"a": None, "b": [None, [None, 1.5]], "c": {"d": None}, "e": "inf", "f": True}
    rows = [["x", math.inf, -math.inf, math.nan, 2.0]]
    table = Table("t", ["a", "b", "c", "d", "e"], rows, ["s", ".1f", ".1f", ".1f", ".1f"])
    section = Section("run", "t", ["w"], (table,), (), odd)
    write_section(section, tmp_path, ("run",))
    text = (tmp_path / "run.json").read_text()

    def refuse(word):
        raise AssertionError(word)

    json.loads(text, parse_constant=refuse)
    (again,), left_out = sections_in(tmp_path, ("run",))
    assert not left_out
    assert again.tables[0].cells() == [["x", "inf", "-inf", "–", "2.0"]] == table.cells()


def test_the_package_in_a_zip(folder):
    whole = folder / "package.zip"
    with zipfile.ZipFile(whole, "w") as packed:
        for room in ("ribbonfem", "der", "compare"):
            for path in (ROOT / room).rglob("*"):
                if path.is_file() and "__pycache__" not in path.parts:
                    packed.write(path, path.relative_to(ROOT))
    script = """
import compare, sys
from compare.sweep.task import edition
from compare.report.registry import ORDER, first_line
from ribbonfem import Branch, History
from ribbonfem.jit.sources import digest
assert "package.zip" in compare.__file__
assert hasattr(History, "plot") and hasattr(Branch, "plot")
assert all(len(first_line(name)) > 20 for name in ORDER)
print(edition(), digest("ribbonfem.kirchhoff.kernels.loop"))
"""
    from ribbonfem.jit.sources import digest

    surrounding = {**BARE, "PYTHONPATH": str(whole)}
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=folder, env=surrounding, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [edition(), digest("ribbonfem.kirchhoff.kernels.loop")]
    for command in ("--help", "scenes"):
        assert shell(f"ribbonfem {command}", folder, PYTHONPATH=str(whole)).returncode == 0


# ---- workers


THREADS = """(
    __import__('numpy').linalg.inv(__import__('numpy').eye(400)),
    __import__('scipy.linalg').linalg.lu_factor(__import__('numpy').eye(400)),
    [line.split()[1] for line in open('/proc/self/status') if line.startswith('Threads')][0],
)[-1]"""


def test_a_worker_has_one_thread_in_every_library():
    """Also where more are asked for, by a user or by the libraries themselves on many processors."""
    script = (
        "from compare.sweep import Sweep\nwith Sweep(processes=2) as sweep:\n"
        f"    print(sweep('x', eval, [{THREADS!r}] * 4))"
    )
    surrounding = {k: v for k, v in BARE.items() if "NUM_THREADS" not in k}
    surrounding |= {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "4", "OPENBLAS_NUM_THREADS": "4"}
    done = subprocess.run([sys.executable, "-c", script], env=surrounding, capture_output=True, text=True)
    # its own, and that which waits for the end of its parent
    assert done.stdout.strip() == str(["2"] * 4), done.stderr


def test_sweeps_in_threads_leave_the_main_module():
    main, result = sys.modules["__main__"], []

    def work():
        with Sweep(processes=2) as sweep:
            result.append(sweep("roots", math.sqrt, range(6)))

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert result == [[math.sqrt(k) for k in range(6)]] * 4
    assert sys.modules["__main__"] is main


def test_hiding_the_main_module_takes_turns():
    main = sys.modules["__main__"]

    def hide():
        for _ in range(200):
            with pool._without_main():
                assert sys.modules["__main__"] is not main
                time.sleep(0.0)

    threads = [threading.Thread(target=hide) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sys.modules["__main__"] is main


@pytest.mark.parametrize(
    "error", [OSError(38, "Function not implemented"), FileNotFoundError(2, "no"), ImportError("no")]
)
def test_without_shared_memory_everything_runs_here(error, monkeypatch):
    def broken(*_, **__):
        raise error

    monkeypatch.setattr("multiprocessing.synchronize.SemLock.__init__", broken)
    with Sweep(processes=3) as sweep:
        assert sweep("roots", math.sqrt, range(9)) == [math.sqrt(k) for k in range(9)]


def test_a_sweep_in_a_worker_that_may_have_none_runs_there():
    script = """
import math, multiprocessing
def work(_):
    from compare.sweep import Sweep
    return Sweep(processes=2)("roots", math.sqrt, range(9)) == [math.sqrt(k) for k in range(9)]
if __name__ == "__main__":
    with multiprocessing.get_context("fork").Pool(1) as workers:
        print(workers.map(work, [0]))
"""
    surrounding = {**BARE, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", script], env=surrounding, capture_output=True, text=True)
    assert done.stdout.strip() == "[True]", done.stderr


def of_tag(tag):
    result = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            state = (place / "stat").read_text().rpartition(")")[2].split()[0]
            if tag in (place / "environ").read_bytes() and state != "Z":
                result.append(int(place.name))
        except OSError:
            continue
    return result


@pytest.mark.parametrize("seed", range(3))
def test_workers_end_whenever_their_parent_is_killed(seed):
    script = (
        "from compare.sweep import Sweep\nimport math\nwith Sweep(processes=3) as sweep:\n"
        "    while True: sweep('x', math.sqrt, range(2000))"
    )
    tag = f"RIBBON_TEST_{os.getpid()}_{seed}"
    surrounding = {**BARE, "PYTHONPATH": str(ROOT), tag: "1"}
    process = subprocess.Popen([sys.executable, "-c", script], env=surrounding, stderr=subprocess.DEVNULL)
    limit = time.monotonic() + 60.0
    # the tracker of semaphores, and some of the workers
    while len(of_tag(tag.encode())) < 2 + seed and time.monotonic() < limit:
        time.sleep(0.01)
    time.sleep(random.Random(seed).uniform(0.0, 0.3))
    process.send_signal(signal.SIGKILL)
    process.wait()
    limit = time.monotonic() + 15.0
    while of_tag(tag.encode()) and time.monotonic() < limit:
        time.sleep(0.05)
    assert not of_tag(tag.encode())
