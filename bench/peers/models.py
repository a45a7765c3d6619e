#!/usr/bin/env python3
"""Writes the network of a safetensors file as peers read it: network.tflite (int8) for MicroFlow, network.onnx for burn-onnx,
and emlearn's C.

usage: models.py WEIGHTS.safetensors FOLDER

Packages: emlearn, flatbuffers, numpy, onnx, tflite; versions in bench/src/peers/built.rs.
"""
import json
import struct
import sys
from pathlib import Path

import flatbuffers
import numpy as np
import onnx
import tflite
from emlearn.net import c_generate_net_loadable


def layers(path):
    data = Path(path).read_bytes()
    (length,) = struct.unpack("<Q", data[:8])
    header = json.loads(data[8 : 8 + length])

    def tensor(name):
        start, end = header[name]["data_offsets"]
        return np.frombuffer(data[8 + length + start : 8 + length + end], "<f4").reshape(header[name]["shape"])

    names = sorted({name.split(".")[0] for name in header if name.startswith("fc")})
    return [(tensor(f"{name}.weight"), tensor(f"{name}.bias")) for name in names]


class Model:
    """A .tflite file of fully connected layers."""

    def __init__(self):
        self.builder = flatbuffers.Builder(1 << 16)
        self.tensors, self.operators, self.buffers = [], [], [self.buffer(None)]

    def vector(self, start, values, prepend):
        start(self.builder, len(values))
        for value in reversed(values):
            prepend(self.builder)(value)
        return self.builder.EndVector()

    def offsets(self, start, values):
        return self.vector(start, values, lambda b: b.PrependUOffsetTRelative)

    def buffer(self, data):
        vector = None if data is None else self.builder.CreateByteVector(data)
        tflite.BufferStart(self.builder)
        if vector is not None:
            tflite.BufferAddData(self.builder, vector)
        return tflite.BufferEnd(self.builder)

    def tensor(self, name, shape, kind, scale, zero_point, data=None):
        b = self.builder
        index = 0
        if data is not None:
            index = len(self.buffers)
            self.buffers.append(self.buffer(data))
        scales = self.vector(tflite.QuantizationParametersStartScaleVector, [scale], lambda b: b.PrependFloat32)
        zeros = self.vector(tflite.QuantizationParametersStartZeroPointVector, [zero_point], lambda b: b.PrependInt64)
        tflite.QuantizationParametersStart(b)
        tflite.QuantizationParametersAddScale(b, scales)
        tflite.QuantizationParametersAddZeroPoint(b, zeros)
        quantization = tflite.QuantizationParametersEnd(b)
        text = b.CreateString(name)
        sizes = self.vector(tflite.TensorStartShapeVector, shape, lambda b: b.PrependInt32)
        tflite.TensorStart(b)
        tflite.TensorAddShape(b, sizes)
        tflite.TensorAddType(b, kind)
        tflite.TensorAddBuffer(b, index)
        tflite.TensorAddName(b, text)
        tflite.TensorAddQuantization(b, quantization)
        self.tensors.append(tflite.TensorEnd(b))
        return len(self.tensors) - 1

    def dense(self, inputs, outputs, relu):
        b = self.builder
        tflite.FullyConnectedOptionsStart(b)
        activation = tflite.ActivationFunctionType.RELU if relu else tflite.ActivationFunctionType.NONE
        tflite.FullyConnectedOptionsAddFusedActivationFunction(b, activation)
        options = tflite.FullyConnectedOptionsEnd(b)
        sources = self.vector(tflite.OperatorStartInputsVector, inputs, lambda b: b.PrependInt32)
        sinks = self.vector(tflite.OperatorStartOutputsVector, outputs, lambda b: b.PrependInt32)
        tflite.OperatorStart(b)
        tflite.OperatorAddOpcodeIndex(b, 0)
        tflite.OperatorAddInputs(b, sources)
        tflite.OperatorAddOutputs(b, sinks)
        tflite.OperatorAddBuiltinOptionsType(b, tflite.BuiltinOptions.FullyConnectedOptions)
        tflite.OperatorAddBuiltinOptions(b, options)
        self.operators.append(tflite.OperatorEnd(b))

    def file(self, source, sink):
        b = self.builder
        tensors = self.offsets(tflite.SubGraphStartTensorsVector, self.tensors)
        operators = self.offsets(tflite.SubGraphStartOperatorsVector, self.operators)
        inputs = self.vector(tflite.SubGraphStartInputsVector, [source], lambda b: b.PrependInt32)
        outputs = self.vector(tflite.SubGraphStartOutputsVector, [sink], lambda b: b.PrependInt32)
        tflite.SubGraphStart(b)
        tflite.SubGraphAddTensors(b, tensors)
        tflite.SubGraphAddInputs(b, inputs)
        tflite.SubGraphAddOutputs(b, outputs)
        tflite.SubGraphAddOperators(b, operators)
        graphs = self.offsets(tflite.ModelStartSubgraphsVector, [tflite.SubGraphEnd(b)])
        tflite.OperatorCodeStart(b)
        tflite.OperatorCodeAddDeprecatedBuiltinCode(b, tflite.BuiltinOperator.FULLY_CONNECTED)
        tflite.OperatorCodeAddBuiltinCode(b, tflite.BuiltinOperator.FULLY_CONNECTED)
        tflite.OperatorCodeAddVersion(b, 1)
        codes = self.offsets(tflite.ModelStartOperatorCodesVector, [tflite.OperatorCodeEnd(b)])
        buffers = self.offsets(tflite.ModelStartBuffersVector, self.buffers)
        tflite.ModelStart(b)
        tflite.ModelAddVersion(b, 3)
        tflite.ModelAddOperatorCodes(b, codes)
        tflite.ModelAddSubgraphs(b, graphs)
        tflite.ModelAddBuffers(b, buffers)
        b.Finish(tflite.ModelEnd(b), b"TFL3")
        return bytes(b.Output())


def int8(network):
    """Ranges of activations from random observations, as a converter takes them from a representative data set."""
    x = np.random.default_rng(1).uniform(-1, 1, (4096, network[0][0].shape[1]))
    model = Model()
    scale, zero = 1 / 127, 0
    source = values = model.tensor("observation", [1, x.shape[1]], tflite.TensorType.INT8, scale, zero)
    for index, (weights, bias) in enumerate(network):
        is_last = index + 1 == len(network)
        x = x @ weights.T + bias
        if is_last:
            next_scale, next_zero = float(np.abs(x).max()) / 127, 0
        else:
            x = np.maximum(x, 0)
            next_scale, next_zero = float(x.max()) / 255, -128
        step = float(np.abs(weights).max()) / 127
        held = np.round(weights / step).astype(np.int8)
        held_bias = np.round(bias / (scale * step)).astype("<i4")
        kinds = tflite.TensorType
        w = model.tensor(f"w{index}", list(weights.shape), kinds.INT8, step, 0, held.tobytes())
        b = model.tensor(f"b{index}", [len(bias)], kinds.INT32, scale * step, 0, held_bias.tobytes())
        sink = model.tensor(f"x{index}", [1, len(bias)], kinds.INT8, next_scale, next_zero)
        model.dense([values, w, b], [sink], not is_last)
        values, scale, zero = sink, next_scale, next_zero
    return model.file(source, values)


def real(network):
    """Gemm and Relu. Factors of 1 are not written out: where they are, burn-onnx takes its Linear layers, which are slower."""
    helper, kind = onnx.helper, onnx.TensorProto.FLOAT
    nodes, tensors, values = [], [], "observation"
    for index, (weights, bias) in enumerate(network):
        tensors += [onnx.numpy_helper.from_array(weights, f"w{index}"), onnx.numpy_helper.from_array(bias, f"b{index}")]
        is_last = index + 1 == len(network)
        sink = "q" if is_last else f"sums{index}"
        inputs = [values, f"w{index}", f"b{index}"]
        nodes.append(helper.make_node("Gemm", inputs, [sink], f"gemm{index}", transB=1))
        values = sink
        if not is_last:
            values = f"x{index}"
            nodes.append(helper.make_node("Relu", [sink], [values], f"relu{index}"))
    source = helper.make_tensor_value_info("observation", kind, [1, network[0][0].shape[1]])
    result = helper.make_tensor_value_info("q", kind, [1, network[-1][0].shape[0]])
    graph = helper.make_graph(nodes, "network", [source], [result], tensors)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.checker.check_model(model)
    return model.SerializeToString()


def main():
    network, folder = layers(sys.argv[1]), Path(sys.argv[2])
    (folder / "network.tflite").write_bytes(int8(network))
    (folder / "network.onnx").write_bytes(real(network))
    activations = ["relu"] * (len(network) - 1) + ["identity"]
    weights, biases = [w.T for w, _ in network], [b for _, b in network]
    (folder / "emlearn.h").write_text(c_generate_net_loadable(activations, weights, biases, "network"))


main()
