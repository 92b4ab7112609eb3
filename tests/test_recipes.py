"""The recipes of .github/CONTRIBUTING.md, followed in a copy of the sources."""

import json
import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

import der
from compare.limits import edge_ratio, two_point
from ribbonfem import Ribbon, Scene, elastica, kirchhoff
from ribbonfem.tableaus import Tableau

ROOT = Path(__file__).parents[1]

COMMAND = '''
    """How high is the buckled beam?  One number of the closed form."""

    from __future__ import annotations

    from dataclasses import dataclass

    from compare.report.section import Drawing, Table
    from ribbonfem.output.style import figure
    from compare.sweep import Sweep
    from ribbonfem.closed_form import euler

    from compare.report.registry import Command


    @dataclass(frozen=True)
    class Heights:
        """What was found: z(1/2)/L by dL/L."""

        heights: dict[float, float]


    def main(*, compressions: tuple[float, ...] = (0.1, 0.2), sweep: Sweep | None = None) -> Heights:
        """The height of Euler's buckled beam."""
        return Heights({c: float(euler.shape(c, 0.5)[1]) for c in compressions})


    def drawings(found: Heights):
        fig, axes = figure(1)
        axes.plot(list(found.heights), list(found.heights.values()))
        yield Drawing("heights.png", "Heights.", fig)


    COMMAND = Command(
        name="heights",
        title="Heights of the buckled beam",
        takes="no time",
        main=main,
        summary=lambda result: [f"{len(result.heights)} heights."],
        values=lambda found: {"heights": list(found.heights.values())},
        tables=lambda found: [
            Table("Heights", ["dL/L", "z"], list(map(list, found.heights.items())), [".2f", ".4f"])
        ],
        drawings=drawings,
    )
'''

MODEL = '''
    """A beam that is known in closed form: no mesh, and no motion."""

    from ribbonfem.closed_form import closed_form_fold
    from ribbonfem.model_info import ModelInfo
    from ribbonfem.options import checked
    from ribbonfem.results import Fold

    MODEL_INFO = ModelInfo(
        name="known",
        mesh="elements",
        least=1,
        planar=True,
        methods={},
        adaptive=(),
        order=lambda options: 1.0,
        size=lambda options: 1.0 / options["elements"],
        at_rest=lambda options: 0,
        in_motion=lambda options: 0,
    )


    @checked
    def folds(scene, *, elements=1):
        """The fold of the quasi-linear beam; `elements` spoil it, so that there is something to refine."""
        fold, root = closed_form_fold(), scene.compression**0.5
        return (Fold(fold.mu * root + 0.1 / elements, fold.height * root, fold.sigma**2, "known", scene),)
'''

ELEMENT = '''
    """Continuous quadratics with the values at both ends and at the middle as dofs."""

    import numpy as np
    from skfem.element import ElementH1
    from skfem.refdom import RefLine


    class ElementLineQuadratic(ElementH1):
        """1 - 3 x + 2 x^2 and its like."""

        nodal_dofs = 1
        interior_dofs = 1
        maxdeg = 2
        dofnames = ["u", "u"]
        doflocs = np.array([[0.0], [1.0], [0.5]])
        refdom = RefLine

        def lbasis(self, X, i):
            """Value and derivative of the i-th basis function."""
            x = X[0]
            value = ((1 - x) * (1 - 2 * x), x * (2 * x - 1), 4 * x * (1 - x))[i]
            return value, np.array([(4 * x - 3, 4 * x - 1, 4 - 8 * x)[i]])
'''

ELEMENT_TEST = """
    import numpy as np
    from ribbonfem.elements.quadratic import ElementLineQuadratic
    from skfem import Basis, MeshLine

    element = ElementLineQuadratic()
    for i in range(3):
        value, _ = element.lbasis(element.doflocs.T, i)
        assert np.allclose(value, np.eye(3)[i])
    errors = []
    for n in (16, 32, 64):
        basis = Basis(MeshLine(np.linspace(0, 1, n + 1)), ElementLineQuadratic(), intorder=6)
        u = basis.project(lambda x: np.sin(3 * x[0]))
        off = basis.interpolate(u) - np.sin(3 * basis.global_coordinates()[0])
        errors.append(float(np.sqrt(np.sum(np.asarray(off) ** 2 * basis.dx))))
    orders = np.diff(np.log(errors)) / np.log(0.5)
    assert np.allclose(orders, 3.0, atol=0.1), orders
    print("ok")
"""


MATERIAL = '''
    """A strip that is stiff along and soft in shear: moduli of its own."""

    from typing import Any

    from ribbonfem.ribbon import Ribbon


    def orthotropic(*, young: float, shear_modulus: float, **sizes: Any) -> Ribbon:
        """A ribbon of these moduli in Pa, of the other fields of `Ribbon`."""
        same = Ribbon(young=young, poisson=0.0, **sizes)
        # poisson 0 has G = E / 2
        return Ribbon(young=young, twist_ratio=same.twist_ratio * 2.0 * shear_modulus / young, **sizes)
'''


def bank():
    """Trapezoidal rule and BDF2 with a cruder estimate: R. Bank et al., IEEE Trans. ED 32 (1985) 1992."""
    d, w = 1.0 - 0.5 * np.sqrt(2.0), 0.25 * np.sqrt(2.0)
    a = [[0.0, 0.0, 0.0], [d, d, 0.0], [w, w, d]]
    return Tableau("bank", 2, 2, a, [0.3, -0.5, 0.2], 2)


@pytest.fixture
def copy(tmp_path):
    for name in ("ribbonfem", "der", "compare"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(textwrap.dedent(text).lstrip("\n"), encoding="utf-8")


def python(copy, *words, script=None):
    words = [*words] if script is None else ["-c", textwrap.dedent(script)]
    done = subprocess.run(
        [sys.executable, *words],
        cwd=copy,
        env={**os.environ, "PYTHONPATH": str(copy)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_command(copy):
    write(copy / "compare/commands/heights.py", COMMAND)
    registry = copy / "compare/report/registry.py"
    text = registry.read_text(encoding="utf-8")
    registry.write_text(
        text.replace("COMMANDS = {\n", 'COMMANDS = {\n    "heights": "compare.commands.heights",\n'),
        encoding="utf-8",
    )
    assert "How high is the buckled beam?" in python(copy, "-m", "compare", "--help")
    told = python(copy, "-m", "compare", "heights", "--json", "--compressions", "0.4", "--out", "report")
    assert json.loads(told)["heights"][0] == pytest.approx(0.37, abs=0.03)
    picture = (copy / "report/heights.png").read_bytes()
    (copy / "report/heights.png").unlink()
    python(copy, "-m", "compare", "report", "--redraw", "--out", "report")
    assert (copy / "report/heights.png").read_bytes() == picture
    assert "Heights of the buckled beam" in (copy / "report/report.html").read_text(encoding="utf-8")


def test_a_model(copy):
    write(copy / "ribbonfem/known/__init__.py", MODEL)
    models = copy / "compare/models.py"
    text = models.read_text(encoding="utf-8")
    text = text.replace(
        "from ribbonfem.model_info", "import ribbonfem.known as known\nfrom ribbonfem.model_info"
    )
    models.write_text(
        text.replace('    "der": der,\n', '    "der": der,\n    "known": known,\n'), encoding="utf-8"
    )
    script = """
        import compare
        from ribbonfem import Scene
        scene = Scene(compression=0.2, shear=0.0, start="U+")
        found = compare.convergence("known", scene, "fold", over={"elements": (2, 4, 8)})
        assert abs(found.order - 1.0) < 1e-9
        assert abs(found.limit - 1.781776041156 * 0.2**0.5) < 1e-9
        print("ok")
    """
    assert "ok" in python(copy, script=script)


def test_an_element(copy):
    write(copy / "ribbonfem/elements/quadratic.py", ELEMENT)
    assert "ok" in python(copy, script=ELEMENT_TEST)


@pytest.mark.parametrize(
    ("model", "mesh"), [(elastica, {"elements": 6}), (kirchhoff, {"elements": 4}), (der, {"nodes": 21})]
)
def test_a_stepper(model, mesh):
    scene = Scene(compression=0.40, shear=0.0, start="U+", rate=1.0, damping=1.0, stop=1.6)
    runs = [
        model.simulate(scene, method=bank(), step=step, until="snap", **mesh) for step in (4e-3, 2e-3, 1e-3)
    ]
    snaps = [run.crossing()[1] for run in runs]
    order = np.log2((snaps[0] - snaps[1]) / (snaps[1] - snaps[2]))
    assert order == pytest.approx(2.0, abs=0.3)
    loose = model.simulate(scene, method=bank(), tolerance=1e-5, until="snap", **mesh).crossing()[1]
    assert loose == pytest.approx(snaps[2], abs=2e-3)
    # it stands in the result, and files hold it
    assert runs[0].options["method"] == bank()


@pytest.mark.parametrize(
    ("a", "error"),
    [
        ([[0.0, 0.0], [0.5, 0.5]], [1.0]),
        ([[0.1, 0.0], [0.5, 0.5]], [0.5, -0.5]),
        ([[0.0, 0.0], [0.5, 0.6]], [0.5, -0.5]),
        ([[0.0, 0.0, 0.0], [0.2, 0.2, 0.0], [0.3, 0.4, 0.3]], [0.0, 0.0, 0.0]),
        ([[0.0, 0.2], [0.5, 0.5]], [0.5, -0.5]),
        ([[0.0]], [0.0]),
    ],
)
def test_a_table_that_is_none_is_refused(a, error):
    with pytest.raises(ValueError, match=r"^(a|error)\b"):
        Tableau("none", 1, 1, a, error, 1)


def change(path, *edits):
    text = path.read_text(encoding="utf-8")
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    path.write_text(text, encoding="utf-8")


def test_a_load(copy):
    change(
        copy / "ribbonfem/scene.py",
        (
            "    damping: float = 1.0\n    ribbon",
            "    load: tuple[float, float, float] = (0.0, 0.0, 0.0)\n    damping: float = 1.0\n    ribbon",
        ),
        (
            "        **unknown",
            "        load: tuple[float, float, float] = (0.0, 0.0, 0.0),\n        **unknown",
        ),
        (
            '        self._set("gravity", as_gravity(gravity))\n',
            '        self._set("gravity", as_gravity(gravity))\n'
            '        self._set("load", tuple(field_number("Scene", "load", w) for w in load))\n',
        ),
        (
            "for g in self.gravity or (0.0, 0.0, 0.0))\n        return x, y, z",
            "for g in self.gravity or (0.0, 0.0, 0.0))\n"
            "        return x + self.load[0], y + self.load[1], z + self.load[2]",
        ),
        (
            "preset={}, gravity=(0.0, 0.0, 0.0), ribbon",
            "preset={}, load=(0, 0, 0), gravity=(0.0, 0.0, 0.0), ribbon",
        ),
        (
            "        if self.gravity is not None:\n            image",
            '        image["load"] = (*self.load[:2], -self.load[2])\n'
            "        if self.gravity is not None:\n            image",
        ),
    )
    write(copy / "loaded.toml", "compression = 0.3\nload = [0, 0.5, -2]")
    script = """
        from pathlib import Path
        from ribbonfem.ends import Ends, moving
        from ribbonfem.output.scene_file import read_scene
        from ribbonfem import Scene
        scene = read_scene(Path("loaded.toml"))
        heavy = Scene(compression=0.3, gravity=[w / scene.ribbon.weight_ratio for w in scene.load])
        assert scene.weight == (0.0, 0.5, -2.0) and scene.dressed and not scene.planar
        for one in (scene, scene.mirror):
            assert (Ends.of(one).weight == one.weight).all()
        assert (moving(Scene(load=(0, 0, 1), stop=0.1)).weight == (0.0, 0.0, 1.0)).all()
        assert scene.mirror.weight == (0.0, 0.5, 2.0)
        assert scene.mirror.mirror == scene
        assert scene.plain == Scene(compression=0.3, gravity=(0, 0, 0)).plain and scene != heavy
        print("ok", max(abs(a - b) for a, b in zip(scene.weight, heavy.weight)) < 1e-12)
    """
    assert "ok True" in python(copy, script=script)


def test_models_read_nothing_but_the_weight_of_a_load(monkeypatch):
    """A dead load is what a weight of that size is, to the last digit, at rest and in motion."""
    given = {"compression": 0.31, "shear": 0.30, "start": "U+S-", "rate": 1.0, "stop": 1e-2, "damping": 1.0}
    heavy = Scene(gravity=(0.0, 0.5, -2.0), **given)
    wanted = [
        (model.state(heavy, **mesh).height, model.simulate(heavy, **mesh).height[-1])
        for model, mesh in ((der, {"nodes": 21}), (kirchhoff, {"elements": 4}))
    ]
    weight = heavy.weight
    monkeypatch.setattr(Scene, "weight", weight)
    loaded = Scene(**given)
    assert loaded.gravity is None
    for (model, mesh), (at_rest, last) in zip(
        ((der, {"nodes": 21}), (kirchhoff, {"elements": 4})), wanted, strict=True
    ):
        assert model.state(loaded, **mesh).height == pytest.approx(at_rest, abs=1e-12)
        assert model.simulate(loaded, **mesh).height[-1] == pytest.approx(last, abs=1e-9)


def test_a_drive(copy):
    change(
        copy / "ribbonfem/drive.py",
        ('    "opposed": ', '    "rocked": Drive(left=1.0, right=0.5),\n    "opposed": '),
    )
    write(copy / "rocked.toml", 'drive = "rocked"\nstop = 0.5')
    script = """
        import numpy as np
        from pathlib import Path
        from ribbonfem.ends import Ends
        from ribbonfem.output.scene_file import read_scene
        from ribbonfem import Drive, Scene
        scene = read_scene(Path("rocked.toml"))
        assert scene == Scene(drive=Drive(left=1, right=0.5), stop=0.5) and scene.drive == "rocked"
        assert scene.drives.unit == "rad" and "rocked" in scene.in_words
        ends = Ends.of(scene)
        assert np.allclose(ends.left(0.4)[0], [np.cos(0.2), 0, np.sin(0.2), 0])
        assert np.allclose(ends.right(0.4)[0], [np.cos(0.1), 0, -np.sin(0.1), 0])
        print("ok")
    """
    assert "ok" in python(copy, script=script)


def test_a_material():
    names = {}
    exec(textwrap.dedent(MATERIAL), names)
    made = names["orthotropic"]
    # of an isotropic material it is that
    nu = Ribbon().poisson
    assert made(young=1e8, shear_modulus=1e8 / (2.0 + 2.0 * nu)).twist_ratio == pytest.approx(
        Ribbon().twist_ratio
    )
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", ribbon=made(young=1e8, shear_modulus=3e7))
    (fold,) = kirchhoff.folds(scene, extensible=True)
    coarse, fine = (der.folds(scene, nodes=nodes)[0].angle for nodes in (51, 101))
    limit = two_point(coarse, fine, edge_ratio(51, 101))
    assert fold.angle == pytest.approx(limit, abs=5e-5)
    usual = kirchhoff.folds(Scene(compression=0.40, shear=0.37, start="U+S-"), extensible=True)[0]
    # what the models agree on is not the default
    assert abs(fold.angle - usual.angle) > 3e-3
