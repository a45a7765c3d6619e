"""What FMPy says of an FMU and how it simulates it: `simulate.py FMU SIGNALS TRAJECTORY [--compile]`.

SIGNALS is a CSV file with a header: time and inputs, a row per communication point. TRAJECTORY is written with one line per
control period: the bits of each duty, then the actions and the status. Exit code 1 if FMPy finds a problem.
"""

import os
import shutil
import struct
import sys

import fmpy
from fmpy.build import build_platform_binary
from fmpy.validation import validate_fmu
import numpy as np


def signals(path, description):
    kinds = {"Real": np.double, "Float64": np.double, "Boolean": np.bool_}
    types = {v.name: kinds.get(v.type, np.int32) for v in description.modelVariables}
    with open(path) as file:
        names = file.readline().strip().split(",")
        columns = [("time", np.double)] + [(name, types[name]) for name in names[1:]]
        rows = [tuple(float(cell) for cell in line.split(",")) for line in file]
    return np.array(rows, dtype=columns)


def main(fmu, inputs, trajectory, *options):
    problems = validate_fmu(fmu)
    description = fmpy.read_model_description(fmu)
    folder = str(fmpy.extract(fmu, unzipdir=os.path.abspath("extracted")))
    if "--compile" in options:
        # the binary must come from the sources
        shutil.rmtree(folder + "/binaries", ignore_errors=True)
        build_platform_binary(folder, all_warnings=True)
    said = []
    table = signals(inputs, description)
    period = description.defaultExperiment.stepSize
    period = float(period)
    outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    duties = outputs[: len(outputs) // 2]
    result = fmpy.simulate_fmu(
        folder,
        fmi_type="CoSimulation",
        start_time=0.0,
        stop_time=len(table) * period,
        step_size=period,
        output_interval=period,
        input=table,
        output=outputs,
        logger=lambda *arguments: said.append(arguments),
    )
    # the first row is from before the first step
    if len(result) != len(table) + 1:
        problems.append(f"{len(result)} rows for {len(table)} steps")
    with open(trajectory, "w") as file:
        for row in result[1:]:
            words = [struct.pack(">d", row[name]).hex() for name in duties]
            words += [str(int(row[name])) for name in outputs[len(duties) :]]
            file.write(" ".join(words) + "\n")
    for problem in problems + said:
        print(problem)
    sys.exit(1 if problems or said else 0)


main(*sys.argv[1:])
