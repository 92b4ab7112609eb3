"""AUTO-07p on the ribbon at rest: equations written as Fortran, a run, the folds that it finds.

The boundary-value problem is that of the paper's section 3.1 in the smallest form that quaternions
allow: four of a unit quaternion and three moments in the frame of the rod are the functions; the
force, constant along the rod, is three parameters; the place of the right end is three integrals.
(With position and force as functions too there are 13 of them, and a run takes longer.)
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from ribbonfem import Scene, SolverError, kirchhoff
from ribbonfem.results import Array

# U = (w, x, y, z) of the frame and the moments about its axes; PAR = alpha and the force.
# w at the right end needs no condition: the equations keep |q|.
EQUATIONS = """\
subroutine frame(q, r)
  implicit none
  double precision, intent(in) :: q(4)
  double precision, intent(out) :: r(3,3)
  r(1,1) = q(1)**2 + q(2)**2 - q(3)**2 - q(4)**2
  r(2,1) = 2*(q(2)*q(3) + q(1)*q(4))
  r(3,1) = 2*(q(2)*q(4) - q(1)*q(3))
  r(1,2) = 2*(q(2)*q(3) - q(1)*q(4))
  r(2,2) = q(1)**2 - q(2)**2 + q(3)**2 - q(4)**2
  r(3,2) = 2*(q(3)*q(4) + q(1)*q(2))
  r(1,3) = 2*(q(2)*q(4) + q(1)*q(3))
  r(2,3) = 2*(q(3)*q(4) - q(1)*q(2))
  r(3,3) = q(1)**2 - q(2)**2 - q(3)**2 + q(4)**2
end subroutine

subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: f(ndim)
  double precision, intent(inout) :: dfdu(ndim,ndim), dfdp(ndim,*)
  double precision, parameter :: stiffness(3) = (/ @TWIST@, 1d0, @BENDING@ /)
  double precision :: r(3,3), o(3), n(3), c(3), dn(4)
  integer :: j
  call frame(u(1:4), r)
  o = u(5:7)/stiffness
  n = matmul(par(2:4), r)
  f(1) = -0.5d0*(u(2)*o(1) + u(3)*o(2) + u(4)*o(3))
  f(2) = 0.5d0*(u(1)*o(1) + u(3)*o(3) - u(4)*o(2))
  f(3) = 0.5d0*(u(1)*o(2) + u(4)*o(1) - u(2)*o(3))
  f(4) = 0.5d0*(u(1)*o(3) + u(2)*o(2) - u(3)*o(1))
  f(5) = u(6)*o(3) - u(7)*o(2)
  f(6) = u(7)*o(1) - u(5)*o(3) + n(3)
  f(7) = u(5)*o(2) - u(6)*o(1) - n(2)
  if (ijac == 0) return
  dfdu = 0
  dfdu(1,2:4) = -0.5d0*o
  dfdu(2:4,1) = 0.5d0*o
  dfdu(2,3) = 0.5d0*o(3)
  dfdu(2,4) = -0.5d0*o(2)
  dfdu(3,4) = 0.5d0*o(1)
  dfdu(3,2) = -0.5d0*o(3)
  dfdu(4,2) = 0.5d0*o(2)
  dfdu(4,3) = -0.5d0*o(1)
  c = 0.5d0/stiffness
  dfdu(1,5:7) = -u(2:4)*c
  dfdu(2,5:7) = (/ u(1), -u(4), u(3) /)*c
  dfdu(3,5:7) = (/ u(4), u(1), -u(2) /)*c
  dfdu(4,5:7) = (/ -u(3), u(2), u(1) /)*c
  dfdu(5,6) = u(7)*(1/stiffness(3) - 1/stiffness(2))
  dfdu(5,7) = u(6)*(1/stiffness(3) - 1/stiffness(2))
  dfdu(6,5) = u(7)*(1/stiffness(1) - 1/stiffness(3))
  dfdu(6,7) = u(5)*(1/stiffness(1) - 1/stiffness(3))
  dfdu(7,5) = u(6)*(1/stiffness(2) - 1/stiffness(1))
  dfdu(7,6) = u(5)*(1/stiffness(2) - 1/stiffness(1))
  c = 2*par(2:4)
  dn(1) = c(1)*u(3) - c(2)*u(2) + c(3)*u(1)
  dn(2) = c(1)*u(4) - c(2)*u(1) - c(3)*u(2)
  dn(3) = c(1)*u(1) + c(2)*u(4) - c(3)*u(3)
  dn(4) = c(1)*u(2) + c(2)*u(3) + c(3)*u(4)
  dfdu(6,1:4) = dn
  dn(1) = -c(1)*u(4) + c(2)*u(1) + c(3)*u(2)
  dn(2) = c(1)*u(3) - c(2)*u(2) + c(3)*u(1)
  dn(3) = c(1)*u(2) + c(2)*u(3) + c(3)*u(4)
  dn(4) = -c(1)*u(1) - c(2)*u(4) + c(3)*u(3)
  dfdu(7,1:4) = -dn
  if (ijac == 1) return
  dfdp(:,1) = 0
  do j = 1, 3
    dfdp(1:5,1+j) = 0
    dfdp(6,1+j) = r(j,3)
    dfdp(7,1+j) = -r(j,2)
  end do
end subroutine

subroutine stpnt(ndim, u, par, t)
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(inout) :: u(ndim), par(*)
  double precision, intent(in) :: t
  par(1:4) = (/ 0d0, @FORCE@ /)
end subroutine

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
  implicit none
  integer, intent(in) :: ndim, icp(*), nbc, ijac
  double precision, intent(in) :: par(*), u0(ndim), u1(ndim)
  double precision, intent(out) :: fb(nbc)
  double precision, intent(inout) :: dbc(nbc,*)
  integer :: j
  fb(1) = u0(1) - cos(0.5d0*par(1))
  fb(2) = u0(2)
  fb(3) = u0(3) - sin(0.5d0*par(1))
  fb(4) = u0(4)
  fb(5:7) = u1(2:4)
  if (ijac == 0) return
  dbc(:,1:2*ndim) = 0
  do j = 1, 4
    dbc(j,j) = 1
  end do
  do j = 5, 7
    dbc(j,ndim+j-3) = 1
  end do
  if (ijac == 1) return
  dbc(:,2*ndim+1:2*ndim+4) = 0
  dbc(1,2*ndim+1) = 0.5d0*sin(0.5d0*par(1))
  dbc(3,2*ndim+1) = -0.5d0*cos(0.5d0*par(1))
end subroutine

subroutine icnd(ndim, par, icp, nint, u, uold, udot, upold, fi, ijac, dint)
  implicit none
  integer, intent(in) :: ndim, icp(*), nint, ijac
  double precision, intent(in) :: par(*), u(ndim), uold(ndim), udot(ndim), upold(ndim)
  double precision, intent(out) :: fi(nint)
  double precision, intent(inout) :: dint(nint,*)
  double precision, parameter :: chord(3) = (/ @CHORD@ /)
  double precision :: r(3,3)
  call frame(u(1:4), r)
  fi(1:3) = r(:,1) - chord
  if (ijac == 0) return
  dint(:,1:ndim) = 0
  dint(1,1:4) = 2*(/ u(1), u(2), -u(3), -u(4) /)
  dint(2,1:4) = 2*(/ u(4), u(3), u(2), u(1) /)
  dint(3,1:4) = 2*(/ -u(3), u(4), -u(1), u(2) /)
  if (ijac == 1) return
  dint(:,ndim+1:ndim+4) = 0
end subroutine

subroutine fopt
end subroutine

subroutine pvls
end subroutine
"""

CONSTANTS = """\
dat = 'start'
NDIM = 7, IPS = 4, IRS = 0, ILP = 1
ICP = [1, 2, 3, 4]
NTST = {intervals}, NCOL = {degree}, IAD = 3, ISP = 0, ISW = 1, IPLT = 0, NBC = 7, NINT = 3
NMX = 2000, NPR = 100000, MXBF = 0, IID = 0, ITMX = 9, ITNW = 7, NWTN = 3, JAC = 1
EPSL = {tolerance:g}, EPSU = {tolerance:g}, EPSS = {fold_tolerance:g}
DS = {step:g}, DSMIN = 1e-7, DSMAX = {largest:g}, IADS = 1
NPAR = 4, THL = {{}}, THU = {{}}
SP = ['LP{folds}']
"""


def home() -> Path | None:
    """The folder of AUTO-07p: AUTO_DIR, or found from its executable; None if it is not installed."""
    places = [Path(os.environ["AUTO_DIR"])] if os.environ.get("AUTO_DIR") else []
    for name in ("auto-07p", "auto"):
        result = shutil.which(name)
        if result:
            up = Path(result).resolve().parents
            places += [up[1] / "lib" / "auto-07p", *up[:3]]
    return next((place for place in places if (place / "lib" / "main.o").exists()), None)


def missing() -> str:
    """What keeps AUTO-07p from running here; "" if nothing does."""
    if home() is None:
        return "AUTO-07p is not installed: neither AUTO_DIR nor `auto` or `auto-07p` was found"
    if shutil.which("gfortran") is None:
        return "AUTO-07p needs a Fortran compiler, and gfortran was not found"
    return ""


def start(scene: Scene, points: int = 101) -> tuple[Array, Array]:
    """The start state as AUTO's functions: rows (s, w, x, y, z, moments), and the force (3,)."""
    rest = kirchhoff.state(scene)
    # columns of the frame: tangent, minus the width, normal
    axes = np.stack((rest.directors[:, 2], -rest.directors[:, 1], rest.directors[:, 0]), axis=2)
    q = Rotation.from_matrix(axes).as_quat()[:, [3, 0, 1, 2]]
    q *= np.where(np.cumsum(np.concatenate(([0], (q[1:] * q[:-1]).sum(axis=1) < 0))) % 2, -1.0, 1.0)[:, None]
    q *= np.sign(q[0, 0])
    ribbon = scene.ribbon
    moments = np.column_stack(
        (ribbon.twist_ratio * rest.tau, -rest.kappa2, ribbon.bending_ratio * rest.kappa1)
    )
    s = np.linspace(0.0, 1.0, points)
    return np.column_stack((s, CubicSpline(rest.s, q)(s), CubicSpline(rest.points, moments)(s))), rest.force


def _number(value: float) -> str:
    """A double precision literal of Fortran."""
    return f"{value:.17e}".replace("e", "d")


def equations(scene: Scene, force: Array) -> str:
    """The equations file of a scene, free-form Fortran."""
    chord = (1.0 - scene.compression, -scene.shear, 0.0)
    values = {
        "TWIST": _number(scene.ribbon.twist_ratio),
        "BENDING": _number(scene.ribbon.bending_ratio),
        "FORCE": ", ".join(_number(v) for v in force),
        "CHORD": ", ".join(_number(v) for v in chord),
    }
    text = EQUATIONS
    for name, value in values.items():
        text = text.replace(f"@{name}@", value)
    return text


@dataclass(frozen=True)
class AutoRun:
    """What one run found: the angles of the folds, points on the branch, CPU seconds of the process."""

    folds: tuple[float, ...]
    points: int
    seconds: float


class Auto:
    """AUTO-07p made ready for a scene: compiled once, run as often as wanted; `close` it."""

    def __init__(self, scene: Scene) -> None:
        lacking = missing()
        if lacking:
            raise SolverError(lacking)
        self._folder = tempfile.TemporaryDirectory(prefix="ribbonfem-auto-")
        self.path = Path(self._folder.name)
        rows, force = start(scene)
        np.savetxt(self.path / "start.dat", rows, fmt="%.16e")
        (self.path / "rod.f90").write_text(equations(scene, force), encoding="ascii")
        objects = sorted(str(path) for path in (Path(str(home())) / "lib").glob("*.o"))
        command = ["gfortran", "-O3", "-fopenmp", "-o", "rod", "rod.f90", *objects]
        made = subprocess.run(command, cwd=self.path, capture_output=True, text=True, check=False)
        if made.returncode:
            raise SolverError(f"gfortran could not make AUTO's program: {made.stderr.strip()[-600:]}")

    def close(self) -> None:
        """Remove its folder."""
        self._folder.cleanup()

    def run(
        self,
        *,
        intervals: int = 25,
        degree: int = 4,
        tolerance: float = 1e-7,
        fold_tolerance: float = 1e-5,
        step: float = 0.1,
        largest: float = 5.0,
        folds: int = 4,
    ) -> AutoRun:
        """Follow the branch from alpha = 0 upwards, to the fold numbered `folds`, on one thread."""
        constants = CONSTANTS.format(
            intervals=intervals,
            degree=degree,
            tolerance=tolerance,
            fold_tolerance=fold_tolerance,
            step=step,
            largest=largest,
            folds=folds,
        )
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(
            [str(self.path / "rod")],
            cwd=self.path,
            input=constants,
            capture_output=True,
            text=True,
            check=False,
            timeout=120,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        result = self.path / "fort.7"
        lines = result.read_text(encoding="ascii").splitlines() if result.exists() else []
        # branch, point, type, label, alpha, ...; header lines are of branch 0; a limit point has type 5
        rows = [line.split() for line in lines if line.split()[:1] not in ([], ["0"])]
        folded = tuple(float(row[4]) for row in rows if row[2] in ("5", "-5"))
        if done.returncode or len(folded) < folds:
            output = (done.stdout + done.stderr).strip()[-600:]
            raise SolverError(f"AUTO-07p found {len(folded)} of {folds} folds: {output}")
        return AutoRun(folded[:folds], len(rows), seconds)
