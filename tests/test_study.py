import math

import numpy as np
import pytest

from compare.report.section import Table
from compare.studies.study import Study, cheapest, here, settled
from compare.sweep import Sweep


def test_a_study_is_every_case_in_every_configuration(tmp_path):
    study = Study("powers", math.prod, [2.0, 3.0, 5.0], [7.0, 11.0], cost=lambda work: work[0])
    assert study.work == [(2.0, 7.0), (2.0, 11.0), (3.0, 7.0), (3.0, 11.0), (5.0, 7.0), (5.0, 11.0)]
    wanted = np.outer([2.0, 3.0, 5.0], [7.0, 11.0])
    # in whatever order the pieces are done, in workers or resumed, rows are in the order of the work
    for processes in (1, 2, 1):
        with Sweep(folder=tmp_path, processes=processes) as sweep:
            assert study.rows(sweep) == list(zip(study.work, wanted.ravel().tolist(), strict=True))
            assert np.array_equal(study.grid(sweep), wanted)
    alone = Study("roots", math.sqrt, [4.0, 9.0])
    assert alone.rows(here(None)) == [(4.0, 2.0), (9.0, 3.0)]


def test_turns_go_round_by_round():
    done = []
    study = Study("turns", lambda name: done.append(name) or len(done), ["a", "b", "c"])
    assert study.by_turns(here(None), 3) == [[1, 4, 7], [2, 5, 8], [3, 6, 9]]
    assert done == ["a", "b", "c"] * 3
    assert study.by_turns(here(None), 0) == [[], [], []]


def test_a_settled_error_is_the_largest_of_all_that_are_as_fine():
    # mesh, step, error, seconds: the coarse mesh cancels its error by chance at one step
    runs = [(8, 0.1, 1e-2, 1.0), (8, 0.05, 1e-6, 2.0), (8, 0.01, 3e-3, 3.0), (16, 0.05, 1e-4, 4.0)]
    result = dict(
        settled(
            runs,
            error=lambda run: run[2],
            kind=lambda run: "same",
            size=lambda run: (1.0 / run[0], run[1]),
        )
    )
    assert [result[run] for run in runs] == [1e-2, 3e-3, 3e-3, 1e-4]
    assert cheapest(result.items(), lambda run: run[3], 5e-3) == runs[1]
    assert cheapest(result.items(), lambda run: run[3], 5e-4) == runs[3]
    assert cheapest(result.items(), lambda run: run[3], 1e-9) is None
    # of another kind it has no say
    apart = dict(settled(runs, lambda run: run[2], lambda run: run[1], lambda run: (1.0 / run[0],)))
    assert [apart[run] for run in runs] == [1e-2, 1e-4, 3e-3, 1e-4]


@pytest.mark.parametrize("records", [[{"a": 1.5, "b": "x"}], []])
def test_a_table_of_records_is_its_columns(records):
    table = Table.of("t", records, [("A", ".2f", "a"), ("B twice", "s", lambda r: 2 * r["b"])], "note")
    assert (table.columns, table.formats, table.note) == (["A", "B twice"], [".2f", "s"], "note")
    assert table.cells() == [["1.50", "xx"]] * len(records)
