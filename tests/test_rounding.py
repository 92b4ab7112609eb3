"""What rounding may not decide: answers are the same whatever kernel the linear algebra picks."""

import os
import platform
import subprocess
import sys
from functools import cache

import pytest

import der
from ribbonfem import Ribbon, Scene, SceneError, kirchhoff

MESHES = (8, 16, 24, 30, 36, 40, 48)
SCRIPT = """
from tests.test_rounding import states_of_one_stiffness
print(states_of_one_stiffness(30))
"""


@cache
def states_of_one_stiffness(elements):
    """Stable states by (ratio - 1, dL, dW), on a mesh."""
    result = {}
    for off in (0.0, 1e-12, -1e-11, 1e-8, 1e-6):
        for compression in (0.05, 0.4, 0.8):
            for shear in (0.0, 1e-4, 1e-2, 0.1):
                scene = Scene(
                    compression=compression, shear=shear, start="U+", ribbon=Ribbon(bending_ratio=1.0 + off)
                )
                result[off, compression, shear] = kirchhoff.stable_states(scene, elements=elements)
    return result


@pytest.mark.parametrize("elements", MESHES)
def test_a_rod_of_one_stiffness_on_every_mesh(elements):
    """Without a shear it turns freely, and has no stable state; with one U+ and U- are stable."""
    for (off, _, shear), names in states_of_one_stiffness(elements).items():
        free = shear == 0.0 and abs(off) < 1e-9
        assert names == (() if free else ("U+", "U-"))


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="kernels of x86 processors")
def test_kernels_agree():
    # of the kernel that is picked here, as it was printed there
    answers = {f"{states_of_one_stiffness(30)}\n"}
    for kernel in ("Sandybridge", "Haswell"):
        environment = {**os.environ, "OPENBLAS_CORETYPE": kernel}
        root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
        environment["PYTHONPATH"] = os.pathsep.join([root, environment.get("PYTHONPATH", "")])
        run = subprocess.run(
            [sys.executable, "-c", SCRIPT],
            env=environment,
            cwd=root,
            capture_output=True,
            text=True,
            check=True,
        )
        answers.add(run.stdout)
    assert len(answers) == 1


@pytest.mark.parametrize("off", [0.0, 1e-12, -1e-10])
@pytest.mark.parametrize("shear", [0.0, 1e-9, -5e-5])
def test_neutral_starts_are_refused_by_every_model(off, shear):
    scene = Scene(
        compression=0.4, shear=shear, start="U+", rate=1.0, stop=0.1, ribbon=Ribbon(bending_ratio=1.0 + off)
    )
    for function in (
        kirchhoff.folds,
        kirchhoff.state,
        kirchhoff.equilibria,
        der.folds,
        der.equilibria,
        der.simulate,
    ):
        with pytest.raises(SceneError, match=r"Ribbon\.bending_ratio = (1\.0|0\.9999)"):
            function(scene)
    assert kirchhoff.stable_states(scene) == der.stable_states(scene) == ()
