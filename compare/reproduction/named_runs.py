"""The paper's named runs of skipping and selection as data: scenes and what the paper reports (section 7)."""

from __future__ import annotations

from dataclasses import dataclass

from ribbonfem import Scene


@dataclass(frozen=True)
class Case:
    """One of the paper's runs: its scene, what the paper reports, and where."""

    scene: Scene
    paper: str
    where: str

    @property
    def kind(self) -> str:
        """ "skipping" (the ramp goes on past both folds) or "selection" (it stops between them)."""
        return "selection" if self.scene.hold else "skipping"

    @property
    def label(self) -> str:
        """Compression, shear, damping, rate; for selection also where the ramp stops."""
        s = self.scene
        stop = f", stop {s.stop:g}" if self.kind == "selection" else ""
        return f"({s.compression:.2f}, {s.shear:.2f}) nu {s.damping:g}, rate {s.rate:g}{stop}"


def _skip(compression: float, damping: float, rate: float, paper: str, where: str) -> Case:
    # far enough for the slowest second snap; overdamped and fast, that is far beyond the fold
    stop = 0.6 if rate < 0.1 or damping < 10.0 else 0.9
    return Case(
        Scene(compression=compression, shear=0.40, rate=rate, damping=damping, stop=stop), paper, where
    )


def _select(compression: float, stop: float, damping: float, rate: float, paper: str, where: str) -> Case:
    # until a free vibration has lost all but e^-8 of its energy, or an overdamped one its speed
    hold = max(8.0 / damping, 0.3 * damping, 2.0)
    scene = Scene(compression=compression, shear=0.40, rate=rate, damping=damping, stop=stop, hold=hold)
    return Case(scene, paper, where)


CASES: tuple[Case, ...] = (
    _skip(0.40, 0.1, 0.01, "no skip", "Fig. 10A"),
    _skip(0.40, 0.1, 1.0, "type 2", "Fig. 10A"),
    _skip(0.40, 10.0, 0.01, "no skip", "Fig. 10B"),
    _skip(0.40, 10.0, 1.0, "type 2", "Fig. 10B"),
    _skip(0.35, 0.3, 0.01, "type 1", "Fig. 10C"),
    _skip(0.35, 0.3, 1.0, "type 2", "Fig. 10C"),
    _skip(0.35, 30.0, 0.01, "no skip", "Fig. 10D"),
    _skip(0.35, 30.0, 1.0, "type 2", "Fig. 10D"),
    _select(0.40, 0.36, 0.1, 0.01, "U+S-", "Fig. 12A"),
    _select(0.40, 0.36, 0.1, 1.0, "U-S+", "Fig. 12A, caption's rate"),
    _select(0.40, 0.36, 0.1, 100.0, "U-S+", "Fig. 12A, text's rate"),
    _select(0.40, 0.36, 10.0, 0.01, "U+S-", "Fig. 12B"),
    _select(0.40, 0.36, 10.0, 1.0, "U+S-", "Fig. 12B, caption's rate"),
    _select(0.40, 0.36, 10.0, 100.0, "U+S-", "Fig. 12B, text's rate"),
    _select(0.35, 0.27, 0.3, 0.01, "U-S+", "Fig. 13A"),
    _select(0.35, 0.27, 0.3, 1.0, "U-S+", "Fig. 13A"),
    _select(0.35, 0.27, 30.0, 0.01, "U+S-", "Fig. 13B"),
    _select(0.35, 0.27, 30.0, 1.0, "U+S-", "Fig. 13B"),
)
