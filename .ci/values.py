"""Folds, curves and motions over all models and methods, to the last bit, before and after a change.

python .ci/values.py > before.json; ...; python .ci/values.py --against before.json
"""

import hashlib
import json
import sys

import numpy as np

import der
from ribbonfem import Ribbon, Scene, elastica, kirchhoff, quasilinear

PLANAR = Scene(compression=0.40, shear=0, start="U+", rate=0.1, stop=1.4)
SHEARED = Scene(compression=0.40, shear=0.37, start="U+S+", rate=0.3, stop=0.9, damping=0.3)
STIFF = Scene(
    compression=0.25, shear=-0.2, start="U+S-", rate=-0.5, stop=-1.2, ribbon=Ribbon(thickness=0.004)
)
SCENES = {"planar": PLANAR, "sheared": SHEARED, "stiff": STIFF}


def digest(*arrays):
    result = hashlib.sha256()
    for array in arrays:
        result.update(np.ascontiguousarray(array, dtype=float).tobytes())
    return result.hexdigest()[:16]


def curve(branch):
    return digest(branch.height, branch.slope, branch.load)


def motion(history):
    turned = getattr(history, "control", None)
    turned = history.angle if turned is None else turned
    return [digest(history.time, turned, history.height, history.slope), repr(history.crossing("height"))]


def cases():
    for name, scene in SCENES.items():
        models = [(kirchhoff, {"elements": 12}), (der, {"nodes": 51})]
        models += [(elastica, {}), (quasilinear, {})] if scene.shear == 0 else []
        for model, mesh in models:
            label = f"{model.__name__.split('.')[-1]} {name}"
            yield f"{label} folds", lambda m=model, s=scene, k=mesh: [repr(x) for x in m.folds(s, **k)]
            yield (
                f"{label} equilibria",
                lambda m=model, s=scene, k=mesh: digest(
                    *(lambda b: (b.height, b.slope, b.load))(m.equilibria(s, **k))
                ),
            )
            yield (
                f"{label} normal forms",
                lambda m=model, s=scene, k=mesh: [repr(x) for x in m.normal_forms(s, **k)],
            )
            yield f"{label} default", lambda m=model, s=scene: motion(m.simulate(s))
        for extensible in (False, True):
            yield (
                f"kirchhoff {name} folds extensible={extensible}",
                lambda s=scene, e=extensible: [repr(x) for x in kirchhoff.folds(s, extensible=e)],
            )
        for method in (
            "newmark",
            "generalised-alpha",
            "implicit-euler",
            "tr-bdf2",
            "esdirk4",
            "discrete-gradient",
        ):
            for extensible in (False, True):
                yield (
                    f"kirchhoff {name} {method} extensible={extensible}",
                    lambda s=scene, m=method, e=extensible: motion(
                        kirchhoff.simulate(s, elements=6, method=m, tolerance=1e-3, extensible=e)
                    ),
                )
        for method in ("implicit-euler", "tr-bdf2", "esdirk4"):
            yield (
                f"der {name} {method}",
                lambda s=scene, m=method: motion(der.simulate(s, nodes=31, method=m, tolerance=1e-3)),
            )
        yield f"kirchhoff {name} state", lambda s=scene: digest(kirchhoff.state(s).positions)
        yield f"der {name} state", lambda s=scene: digest(der.state(s).positions)
    for method in ("newmark", "generalised-alpha", "tr-bdf2", "esdirk4"):
        for model in (elastica, quasilinear):
            yield (
                f"{model.__name__} {method}",
                lambda m=model, k=method: motion(m.simulate(PLANAR, method=k, tolerance=1e-4)),
            )
    yield "pitchforks", lambda: repr(kirchhoff.pitchforks(0.4))


def main():
    values = {}
    for name, case in cases():
        try:
            values[name] = case()
        except Exception as error:
            values[name] = f"{type(error).__name__}: {error}"
    if "--against" in sys.argv:
        with open(sys.argv[-1]) as file:
            before = json.load(file)
        apart = [name for name in before if values.get(name) != before[name]]
        for name in apart:
            print(f"{name}\n  {before[name]}\n  {values.get(name)}")
        print(f"{len(before) - len(apart)} of {len(before)} the same to the last bit")
        return
    json.dump(values, sys.stdout, indent=1)


main()
