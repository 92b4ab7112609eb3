from dataclasses import replace

import numpy as np

from compare.report.registry import publish
from compare.reproduction import cases, delay, delays
from compare.reproduction.named_runs import CASES
from compare.studies.speed import equal_error
from compare.studies.speed import study as speed
from compare.sweep import Sweep
from ribbonfem.output.style import STYLE


def test_delay_against_theory(tmp_path, monkeypatch):
    for name, elements in (("quasi-linear beam", 22), ("elastica", 14)):
        coarse = replace(delays.SYSTEMS[name], mesh={"elements": elements})
        monkeypatch.setitem(delays.SYSTEMS, name, coarse)
    # room for the words of twelve logarithmic axes takes longer to find than the rest of the picture
    monkeypatch.setitem(STYLE, "figure.constrained_layout.use", False)
    result = delay.main(systems="beam", dampings=(1e-3, 1e3), decades=2, sweep=Sweep(processes=1))
    section, _ = publish(delay.COMMAND, result, tmp_path)
    cells = {(c["system"], c["damping"], round(np.log10(c["rate"]))): c for c in section.values["cells"]}
    assert len(cells) == 24
    for cell in cells.values():
        assert cell["measured"] is not None, cell
    # models that share no mechanics agree on the delay of a slow ramp
    for damping, rate in ((1e3, -3), (1e-3, -1)):
        planar, elastica = (cells[name, damping, rate]["measured"] for name in ("DER planar", "elastica"))
        assert abs(planar / elastica - 1) < 0.02
    # the overdamped ratio has nearly reached its limit
    assert abs(cells["elastica", 1e3, -3]["measured"] / cells["elastica", 1e3, -3]["predicted"] - 1) < 0.05
    assert (tmp_path / "delay-beam.png").exists()


def test_ratio_limit_and_slope_of_known_laws():
    def cell(rate, ratio):
        predicted = rate**0.8
        return delay.Cell("x", 1e-3, rate, 1e-3, predicted, ratio * predicted, 0.0)

    group = [cell(rate, 1.0 - 0.3 * rate**0.2 + 0.05 * rate**0.4) for rate in (1e-4, 1e-3, 1e-2)]
    assert np.isclose(delay.ratio_limit(group), 1.0, atol=1e-9)
    exponent, low, high = delay.slope_of([cell(rate, 1.0) for rate in (1e-4, 1e-3, 1e-2)])
    assert np.isclose(exponent, 0.8)
    assert (low, high) == (1e-4, 1e-2)
    assert delay.rates_for(1e3, 5)[-1] < delay.rates_for(1.0, 5)[-1]


def test_a_case_is_settled_and_a_sensitive_one_would_be_named():
    case = next(c for c in CASES if c.label.startswith("(0.40, 0.40) nu 10, rate 1"))
    verdict = cases.settle(case, (31, 51), 1e-4, (1e-2,))
    assert verdict.outcome == case.paper == "type 2"
    assert verdict.second is not None
    limit, uncertainty = verdict.second
    assert abs(limit - verdict.runs[1].second) < 0.02
    assert 0 < uncertainty < 5e-3
    runs = [cases.CaseRun("der", "a", kind, None, None, "", 0.0) for kind in ("type 1", "type 2", "type 2")]
    assert len({run.outcome for run in runs}) > 1


def test_selection_ends_in_the_papers_states():
    for case in CASES:
        if case.kind == "selection" and case.scene.damping >= 10.0 and case.scene.rate >= 1.0:
            run, _ = cases.one_run(case, "", "der", {"nodes": 31, "tolerance": 1e-4})
            assert run.outcome == case.paper, (case.label, run)


def test_parts_of_an_iteration_add_up():
    parts = speed.parts_of_an_iteration(21)
    assert parts["forces and Hessian"] > parts["forces"] > 0.0
    assert speed.reference_kernel() > 0.0


def test_a_price_is_of_an_error_that_no_tighter_tolerance_exceeds():
    """Made-up runs: errors fall with mesh and tolerance, but for one lucky run of the coarsest elements."""
    limit, result = 0.5, {}
    for key, model, options in (*equal_error.ELEMENTS, *equal_error.RODS):
        tolerance, mesh = options["tolerance"], int(key[1].split()[0])
        if model == "kirchhoff":
            off, seconds = 0.1 * tolerance + 20.0 * mesh**-10.0, 1e-3 * mesh * tolerance**-0.25
        else:
            # by Richardson's rule nothing is left of the mesh
            off, seconds = 0.1 * tolerance + 1.0 / (mesh - 2) ** 2, 1e-4 * mesh * tolerance**-0.25
        result[key] = limit + off, seconds
    lucky = ("elements", "4 elements", "esdirk4", equal_error.ELEMENTS.tolerances[0])
    limits = {"elements": limit}
    result[lucky] = limit, 1e-9
    best = equal_error.prices(result, limits, 1.1e-5)
    # 4 elements are off by 1.9e-5, 6 by 3e-7, so that 0.1 of the tolerance may be 1.07e-5
    assert best["elements"].how == "6 elements, esdirk4, 1e-04"
    assert np.isclose(best["elements"].seconds, 6e-3 * 1e-4**-0.25)
    assert best["rods"].how == "25 and 35 nodes, esdirk4, 6e-05"
    assert best["rods, tr-bdf2"].how == "25 and 35 nodes, tr-bdf2, 6e-05"
    assert best["rods"].seconds > best["elements"].seconds
    assert "elements" in equal_error.prices(result, limits, 2e-5)
    assert equal_error.prices(result, limits, 1e-15) == {}
