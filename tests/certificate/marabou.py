"""Answers queries about a ReLU network with Marabou: JSON lines in, JSON lines out.

First line: the layers as {"weights": [[...]], "bias": [...], "relu": bool}. Every other line is a query
{"box": [[low, high]], "terms": [[output, factor]], "at_least": x}: is there an input in the box for which the sum of
factor * output is at least x? Answer: the input, or null.
"""

import json
import os
import sys

from maraboupy import MarabouCore


def network(layers, box):
    query = MarabouCore.InputQuery()
    widths = [len(box)] + [len(layer["bias"]) for layer in layers]
    count = len(box) + sum(len(layer["bias"]) * (2 if layer["relu"] else 1) for layer in layers)
    query.setNumberOfVariables(count)
    for index, (low, high) in enumerate(box):
        query.setLowerBound(index, low)
        query.setUpperBound(index, high)
        query.markInputVariable(index, index)
    inputs, free = list(range(len(box))), len(box)
    for layer, width in zip(layers, widths[1:]):
        sums = list(range(free, free + width))
        free += width
        for row, bias, output in zip(layer["weights"], layer["bias"], sums):
            equation = MarabouCore.Equation(MarabouCore.Equation.EQ)
            for weight, variable in zip(row, inputs):
                if weight != 0.0:
                    equation.addAddend(weight, variable)
            equation.addAddend(-1.0, output)
            equation.setScalar(-bias)
            query.addEquation(equation)
        inputs = sums
        if layer["relu"]:
            inputs = list(range(free, free + width))
            free += width
            for before, after in zip(sums, inputs):
                MarabouCore.addReluConstraint(query, before, after)
    return query, inputs


def answer(layers, task, options):
    query, outputs = network(layers, task["box"])
    for index, output in enumerate(outputs):
        query.markOutputVariable(output, index)
    equation = MarabouCore.Equation(MarabouCore.Equation.GE)
    for output, factor in task["terms"]:
        equation.addAddend(factor, outputs[output])
    equation.setScalar(task["at_least"])
    query.addEquation(equation)
    code, values, _ = MarabouCore.solve(query, options, "")
    if code == "unsat":
        return {"found": None}
    if code == "sat":
        return {"found": [values[index] for index in range(len(task["box"]))]}
    return {"unknown": code}


def main():
    # Marabou prints on the standard output
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    options = MarabouCore.Options()
    options._verbosity = 0
    options._timeoutInSeconds = 60
    layers = json.loads(sys.stdin.readline())
    for line in sys.stdin:
        print(json.dumps(answer(layers, json.loads(line), options)), file=answers, flush=True)


main()
