"""How libcosim, an importer that shares no code with FMPy, steps an FMU: `libcosim.py FMU SIGNALS TRAJECTORY`.

Files as for simulate.py. libcosim counts time in whole nanoseconds.
"""

import struct
import sys

import fmpy
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave


def main(fmu, inputs, trajectory):
    description = fmpy.read_model_description(fmu)
    variables = {v.name: v for v in description.modelVariables}
    period = float(description.defaultExperiment.stepSize)
    execution = CosimExecution.from_step_size(round(period * 1e9))
    slave = execution.add_local_slave(CosimLocalSlave(fmu_path=fmu, instance_name="controller"))
    manipulator = CosimManipulator.create_override()
    observer = CosimObserver.create_last_value()
    execution.add_manipulator(manipulator)
    execution.add_observer(observer)
    duty, action, status = (v.valueReference for v in description.modelVariables if v.causality == "output")
    with open(inputs) as file, open(trajectory, "w") as answers:
        names = file.readline().strip().split(",")[1:]
        for line in file:
            for name, cell in zip(names, line.split(",")[1:]):
                place = {"slave_index": slave, "variable_references": [variables[name].valueReference]}
                if variables[name].type == "Real":
                    manipulator.slave_real_values(values=[float(cell)], **place)
                else:
                    manipulator.slave_integer_values(values=[int(float(cell))], **place)
            assert execution.step()
            value = observer.last_real_values(slave_index=slave, variable_references=[duty])[0]
            rest = observer.last_integer_values(slave_index=slave, variable_references=[action, status])
            answers.write(f"{struct.pack('>d', value).hex()} {rest[0]} {rest[1]}\n")


main(*sys.argv[1:])
