"""Examples, one a file: `main(**parameters)` runs the models on one problem, `look(result)` draws the result.

Each is written in the same order: problem, discretisation, solver, run, look.  `main` writes and prints
nothing and returns a frozen result of numbers, so that `look` needs no model; the guide's pictures are
what `look` draws, and `tests/test_examples.py` runs each small.  To begin with one:

    from compare.examples import planar_fold
    result = planar_fold.main(compression=0.2)
    planar_fold.look(result).savefig("fold.png")

The scene files beside them are those of `ribbonfem scenes`.
"""
