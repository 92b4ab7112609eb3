"""The material law of the elements: moment and stretch by strain, strain rate, natural shape.

Every moment is stiffness x (strain - natural + retardation x strain rate), of Kelvin and Voigt, and so is
the tension of a ribbon that stretches.  A stage of a method knows strain rates as (strain - known) / f, so
that the law stays one of two numbers a strain, its stiffness and what it counts from:

    m = stiffness (1 + ratio) (strain - (natural + ratio known) / (1 + ratio)),  ratio = retardation / f
    e = (ratio known + c n.t) / (1 + ratio)                                      the stretch
"""
