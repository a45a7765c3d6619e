"""Answers queries about a ReLU network with Marabou: JSON lines in, JSON lines out.

First line: the layers as {"weights": [[...]], "bias": [...], "relu": bool}. Every other line is a query
{"box": [[low, high]], "terms": [[output, factor]], "at_least": x}: is there an input in the box for which the sum of
factor * output is at least x? Answer: the input, or null.
"""

import json
import os
import sys

from maraboupy import MarabouCore


class Network:
    """Equations and pairs of ReLUs, made once."""

    def __init__(self, layers):
        self.inputs = list(range(len(layers[0]["weights"][0])))
        self.equations, self.relus = [], []
        values, self.count = self.inputs, len(self.inputs)
        for layer in layers:
            sums = self.fresh(len(layer["bias"]))
            for row, bias, output in zip(layer["weights"], layer["bias"], sums):
                equation = MarabouCore.Equation(MarabouCore.Equation.EQ)
                for weight, variable in zip(row, values):
                    if weight != 0.0:
                        equation.addAddend(weight, variable)
                equation.addAddend(-1.0, output)
                equation.setScalar(-bias)
                self.equations.append(equation)
            values = sums
            if layer["relu"]:
                values = self.fresh(len(sums))
                self.relus += zip(sums, values)
        self.outputs = values

    def fresh(self, count):
        self.count += count
        return list(range(self.count - count, self.count))

    def query(self, box):
        query = MarabouCore.InputQuery()
        query.setNumberOfVariables(self.count)
        for index, (low, high) in zip(self.inputs, box):
            query.setLowerBound(index, low)
            query.setUpperBound(index, high)
            query.markInputVariable(index, index)
        for equation in self.equations:
            query.addEquation(equation)
        for before, after in self.relus:
            MarabouCore.addReluConstraint(query, before, after)
        for index, output in enumerate(self.outputs):
            query.markOutputVariable(output, index)
        return query


def answer(network, task, options):
    query = network.query(task["box"])
    equation = MarabouCore.Equation(MarabouCore.Equation.GE)
    for output, factor in task["terms"]:
        equation.addAddend(factor, network.outputs[output])
    equation.setScalar(task["at_least"])
    query.addEquation(equation)
    code, values, _ = MarabouCore.solve(query, options, "")
    if code == "unsat":
        return {"found": None}
    if code == "sat":
        return {"found": [values[index] for index in network.inputs]}
    return {"unknown": code}


def main():
    # Marabou prints on the standard output
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    options = MarabouCore.Options()
    options._verbosity = 0
    options._timeoutInSeconds = 60
    network = Network(json.loads(sys.stdin.readline()))
    for line in sys.stdin:
        print(json.dumps(answer(network, json.loads(line), options)), file=answers, flush=True)


main()
