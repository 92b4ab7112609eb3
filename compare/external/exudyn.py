"""Exudyn on the moving beam and ribbon: its geometrically exact beams, its generalised-alpha integrator.

In the plane quadratic elements (three nodes), in space linear ones, for it has no others; the
clamps are constraints, the damping is a dashpot to the ground at every node, with the weights of
a quadrature that keeps the order of the elements.  The beams of this library are shearable and
ours are not: their shear stiffness is set to a multiple of EA, high enough for the angle of the
snap and not so high that Newton suffers.
"""

from __future__ import annotations

import time
import warnings
from importlib import import_module
from importlib.util import find_spec
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from ribbonfem import History, Scene, SolverError, kirchhoff
from ribbonfem.closed_form import euler


def missing() -> str:
    """What keeps Exudyn from running here; "" if nothing does."""
    return "" if find_spec("exudyn") else "Exudyn is not installed: the extra ribbonfem[peers] brings it"


class _Model:
    """A system of Exudyn for a scene; the sensor records the place of the middle."""

    sensor: Any

    def __init__(self, scene: Scene) -> None:
        lacking = missing()
        if lacking:
            raise SolverError(lacking)
        # its import takes long, and the rest has to work without it
        exudyn: Any = import_module("exudyn")
        items: Any = import_module("exudyn.itemInterface")
        self.library, self.items, self.scene = exudyn, items, scene
        # a failure arrives as an exception; its banner would land in what a command prints
        exudyn.config.printToConsole = False
        self.container = exudyn.SystemContainer()
        self.system = self.container.AddSystem()

    def watch(self, node: Any) -> None:
        """Record the displacement of a node in memory, and make the system ready."""
        self.sensor = self.system.AddSensor(
            self.items.SensorNode(
                nodeNumber=node,
                outputVariableType=self.library.OutputVariableType.Displacement,
                storeInternal=True,
                writeToFile=False,
            )
        )
        self.system.Assemble()

    def settings(self) -> Any:
        """Settings that print nothing, write no file and use one thread."""
        settings = self.library.SimulationSettings()
        settings.solutionSettings.writeSolutionToFile = False
        settings.displayStatistics = settings.displayComputationTime = False
        settings.timeIntegration.verboseMode = settings.staticSolver.verboseMode = 0
        settings.linearSolverType = self.library.LinearSolverType.EigenSparse
        settings.parallel.numberOfThreads = 1
        return settings


class _Beam(_Model):
    """The planar beam of a scene."""

    def __init__(self, scene: Scene, elements: int, shear: float) -> None:
        super().__init__(scene)
        items, system = self.items, self.system
        ribbon = scene.ribbon
        length = ribbon.length
        area = ribbon.width * ribbon.thickness
        inertia = ribbon.width * ribbon.thickness**3 / 12.0
        count = 2 * elements + 1
        s = np.linspace(0.0, 1.0, count)
        side = 1.0 if scene.start == "U+" else -1.0
        x, z = euler.shape(scene.compression, s)
        phi = euler.tangent_angle(scene.compression, s)
        nodes = [
            system.AddNode(
                items.NodeRigidBody2D(
                    referenceCoordinates=[length * s[k], 0.0, 0.0],
                    initialCoordinates=[length * (x[k] - s[k]), side * length * z[k], side * phi[k]],
                )
            )
            for k in range(count)
        ]
        for left in range(0, count - 1, 2):
            system.AddObject(
                items.ObjectBeamGeometricallyExact2D(
                    nodeNumbers=nodes[left : left + 3],
                    length=length / elements,
                    massPerLength=ribbon.density * area,
                    crossSectionInertia=ribbon.density * inertia,
                    bendingStiffness=ribbon.young * inertia,
                    axialStiffness=ribbon.young * area,
                    shearStiffness=shear * ribbon.young * area,
                )
            )
        ground = system.AddMarker(
            items.MarkerNodeCoordinate(nodeNumber=system.AddNode(items.NodePointGround()), coordinate=0)
        )

        def marker(node: int, coordinate: int) -> Any:
            return system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))

        weights = np.zeros(count)
        for left in range(0, count - 1, 2):
            weights[left : left + 3] += np.array([1.0, 4.0, 1.0]) / (6.0 * elements)
        mass = ribbon.density * area * length
        for k in range(1, count - 1):
            for coordinate in (0, 1):
                system.AddObject(
                    items.ObjectConnectorCoordinateSpringDamper(
                        markerNumbers=[ground, marker(nodes[k], coordinate)],
                        stiffness=0.0,
                        damping=scene.damping * mass * weights[k],
                    )
                )
        ends = {(0, 0): 0.0, (0, 1): 0.0, (-1, 0): -scene.compression * length, (-1, 1): 0.0, (-1, 2): 0.0}
        for (end, coordinate), offset in ends.items():
            system.AddObject(
                items.ObjectConnectorCoordinate(
                    markerNumbers=[ground, marker(nodes[end], coordinate)], offset=offset
                )
            )
        rate = scene.rate
        system.AddObject(
            items.ObjectConnectorCoordinate(
                markerNumbers=[ground, marker(nodes[0], 2)],
                offset=0.0,
                # alpha > 0 turns the tangent down
                offsetUserFunction=lambda mbs, t, index, offset: -rate * t,
                offsetUserFunction_t=lambda mbs, t, index, offset: -rate,
            )
        )
        self.watch(nodes[count // 2])

    def rest(self) -> None:
        """Its own equilibrium near the closed form, as the state that the motion starts from."""
        settings = self.settings()
        settings.staticSolver.numberOfLoadSteps = 1
        settings.staticSolver.newton.relativeTolerance = 1e-8
        # rounding in the axial forces: EA is 1e5 times the bending stiffness
        settings.staticSolver.newton.absoluteTolerance = 1e-4
        self.system.SolveStatic(settings)
        data, initial = self.system.systemData, self.library.ConfigurationType.Initial
        data.SetODE2Coordinates(data.GetODE2Coordinates(), configuration=initial)
        data.SetAECoordinates(data.GetAECoordinates(), configuration=initial)


class _Ribbon(_Model):
    """The ribbon of a scene in space, with the frames (tangent, minus the width, normal)."""

    def __init__(self, scene: Scene, elements: int, shear: float) -> None:
        super().__init__(scene)
        items, system = self.items, self.system
        ribbon = scene.ribbon
        length = ribbon.length
        area = ribbon.width * ribbon.thickness
        # second moments of area about the normal, I1, and about the width, I2
        i2 = ribbon.width * ribbon.thickness**3 / 12.0
        i1 = ribbon.width**3 * ribbon.thickness / 12.0
        rest = kirchhoff.state(scene)
        axes = np.stack((rest.directors[:, 2], -rest.directors[:, 1], rest.directors[:, 0]), axis=2)
        s = np.linspace(0.0, 1.0, elements + 1)
        turns = Rotation.from_matrix(axes).as_quat()
        flips = np.concatenate(([1.0], np.cumprod(np.sign((turns[1:] * turns[:-1]).sum(axis=1)))))
        rotation = Rotation.from_quat(CubicSpline(rest.s, turns * flips[:, None])(s)).as_rotvec()
        place = CubicSpline(rest.s, rest.positions)(s)
        section = self.library.BeamSection()
        section.massPerLength = ribbon.density * area
        # rotary inertia about the tangent as in `der`; about the others that of the thickness alone
        section.inertia = ribbon.density * np.diag([i2 + i1, i2, i2])
        axial, bending = ribbon.young * area, ribbon.young * i2
        section.stiffnessMatrix = np.diag(
            [axial, shear * axial, shear * axial]
            + [ribbon.twist_ratio * bending, bending, ribbon.bending_ratio * bending]
        )
        nodes = [
            system.AddNode(
                items.NodeRigidBodyRotVecLG(
                    referenceCoordinates=[length * s[k], 0.0, 0.0, 0.0, 0.0, 0.0],
                    initialCoordinates=[*(length * (place[k] - [s[k], 0.0, 0.0])), *rotation[k]],
                    initialVelocities=[0.0] * 6,
                )
            )
            for k in range(elements + 1)
        ]
        for pair in pairwise(nodes):
            system.AddObject(
                items.ObjectBeamGeometricallyExact(
                    nodeNumbers=list(pair), length=length / elements, sectionData=section
                )
            )
        ground = system.AddObject(items.ObjectGround())
        dashpot = scene.damping * ribbon.density * area * length / elements
        for node in nodes[1:-1]:
            ends = [
                system.AddMarker(items.MarkerBodyPosition(bodyNumber=ground)),
                system.AddMarker(items.MarkerNodePosition(nodeNumber=node)),
            ]
            system.AddObject(
                items.ObjectConnectorCartesianSpringDamper(
                    markerNumbers=ends, stiffness=[0.0] * 3, damping=[dashpot] * 3
                )
            )
        rate = scene.rate
        rotation = {"offsetUserFunction": lambda mbs, t, index, given: [0.0, 0.0, 0.0, 0.0, rate * t, 0.0]}
        right = [(1.0 - scene.compression) * length, -scene.shear * length, 0.0]
        clamps: list[tuple[Any, list[float], dict[str, Any]]] = [
            (nodes[0], [0.0, 0.0, 0.0], rotation),
            (nodes[-1], right, {}),
        ]
        for node, position, given in clamps:
            ends = [
                system.AddMarker(items.MarkerBodyRigid(bodyNumber=ground, localPosition=position)),
                system.AddMarker(items.MarkerNodeRigid(nodeNumber=node)),
            ]
            system.AddObject(items.ObjectJointGeneric(markerNumbers=ends, **given))
        self.watch(nodes[elements // 2])

    def rest(self) -> None:
        """Leave the state of `kirchhoff` as it is: the library's static solver diverges from it."""


def simulate(
    scene: Scene,
    *,
    elements: int = 16,
    step: float = 1e-2,
    shear: float = 100.0,
    spectral_radius: float = 0.5,
    newton_tolerance: float = 1e-8,
    modified_newton: bool = True,
) -> History:
    """The motion from rest in the start state through the ramp, as the functions `simulate` of the models.

    Parameters
    ----------
    scene: planar or sheared.
    elements: quadratic ones of a planar scene, linear ones (an even number) of a sheared one.
    step: s.
    shear: the shear stiffness in EA.
    spectral_radius: of generalised-alpha; its Newton needs fewer iterations below the default 0.9.
    newton_tolerance: relative; the default is the library's.
    modified_newton: keep the Jacobian from step to step, as the library does by default.

    Raises
    ------
    SolverError
        If Exudyn is not installed or its solver gives up.
    """
    stop = scene.require_stop()
    with warnings.catch_warnings():
        # names of settings that have moved and still work, in older and newer releases alike
        warnings.simplefilter("ignore", DeprecationWarning)
        beam = _Beam(scene, elements, shear) if scene.planar else _Ribbon(scene, elements, shear)
        settings = beam.settings()
        steps = round(stop / scene.rate / step)
        control = settings.timeIntegration
        control.numberOfSteps, control.endTime = steps, steps * step
        control.generalizedAlpha.spectralRadius = spectral_radius
        control.newton.useModifiedNewton = modified_newton
        control.newton.relativeTolerance = newton_tolerance
        settings.solutionSettings.sensorsWritePeriod = step
        try:
            beam.rest()
            begin = time.process_time()
            beam.system.SolveDynamic(settings)
            seconds = time.process_time() - begin
        except (beam.library.SolverError, RuntimeError, ValueError) as error:
            raise SolverError(f"Exudyn: {error}") from error
        rows = np.array(beam.system.GetSensorStoredData(beam.sensor))
    # a step that was halved leaves rows closer than `step`, and one instant twice
    rows = rows[np.concatenate(([True], np.diff(rows[:, 0]) > 0.0))]
    # z is the second axis of the planar beam, the last of the other
    moments, height = rows[:, 0], rows[:, 2 if scene.planar else 3] / scene.ribbon.length
    return History(
        time=moments,
        control=scene.rate * moments,
        height=height,
        slope=np.full(len(height), np.nan),
        energies={},
        configurations={},
        stats={"steps": steps, "seconds": seconds},
        scene=scene,
        options={
            "elements": elements,
            "step": step,
            "shear": shear,
            "spectral_radius": spectral_radius,
            "newton_tolerance": newton_tolerance,
            "modified_newton": modified_newton,
        },
    )
