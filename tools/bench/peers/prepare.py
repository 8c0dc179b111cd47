"""Writes a network for the peers, and the outputs that they should have: python prepare.py FOLDER.

FOLDER/network.json is of `cargo xtask peers`. All become f32.h. Products with ReLU also become int8.h (a scale a tensor, as CMSIS-NN
4.0.0 has it), model.tflite (the same numbers) and the folders bakenn-TARGET (BakeNN's own quantization). expected.json has the
outputs of each form in f64, with scale and zero point of int8 outputs.
"""

import json
import pathlib
import sys

import numpy as np


def array(kind, name, values):
    text = ",".join(map(repr, np.asarray(values).ravel().tolist()))
    return f"static const {kind} {name}[] = {{{text}}};\n"


def blob(folder, kind, name, values):
    """Like `array`, in a file of its own, because compilers take long for long lists."""
    file = folder / f"{kind}-{name}.bin"
    np.asarray(values, {"float": np.float32, "int8_t": np.int8}[kind]).tofile(file)
    return f'BLOB({kind}, {name}, "{file}")\n'


def range_of(values):
    """Returns scale and zero point of int8 values that hold 0 and all of these."""
    least, most = min(values.min(), 0.0), max(values.max(), 0.0)
    scale = float(np.float32((most - least) / 255))
    return scale, int(np.rint(-128 - least / scale))


def to_int8(values, scale, zero=0, least=-128):
    return np.clip(np.rint(values / scale) + zero, least, 127).astype(np.int8)


def activate(values, function):
    if function == "elu":
        return np.where(values > 0, values, np.expm1(np.minimum(values, 0)))
    return np.maximum(values, 0) if function == "relu" else values


def run(layers, values):
    """Returns the inputs of all layers and the output, in f64."""
    every = [np.asarray(values, np.float64)]
    for weights, bias, function in layers:
        every.append(activate(every[-1] @ np.asarray(weights, np.float64).T + bias, function))
    return every


def int8(layers, calibration):
    """Returns the layers of `struct layer` (peer.h), scales and zero points of all values, and the layers that f64 runs."""
    ranges = [range_of(values) for values in run(layers, calibration)]
    rows, exact = [], []
    for (weights, bias, function), (scale_in, zero_in), (scale_out, zero_out) in zip(layers, ranges, ranges[1:]):
        scale = float(np.float32(np.abs(weights).max() / 127))
        codes, sums = to_int8(weights, scale, least=-127), np.rint(bias / (scale * scale_in)).astype(np.int32)
        fraction, shift = np.frexp(scale * scale_in / scale_out)
        multiplier = min(int(np.rint(fraction * 2.0**31)), 2**31 - 1)
        least = zero_out if function == "relu" else -128
        rows.append((codes, sums, multiplier, int(shift), zero_in, zero_out, least, scale))
        exact.append((codes * scale, sums * (scale * scale_in), function))
    return rows, ranges, exact


def header(folder, rows, inputs):
    text = '#include "peer.h"\n' + array("int8_t", "input", inputs)
    for i, (codes, sums, *_) in enumerate(rows):
        text += blob(folder, "int8_t", f"weights_{i}", codes) + array("int32_t", f"bias_{i}", sums)
    text += "static const struct layer layers[] = {"
    for i, (codes, _, *numbers, _scale) in enumerate(rows):
        text += "{%d, %d, weights_%d, bias_%d, %d, %d, %d, %d, %d}, " % (*codes.shape, i, i, *numbers)
    return text + "};\n"


def tflite(rows, ranges, file):
    import flatbuffers
    import tflite as t

    b = flatbuffers.Builder(1 << 20)

    def vector(start, items):
        start(b, len(items))
        for item in reversed(items):
            b.PrependUOffsetTRelative(item)
        return b.EndVector()

    buffers, tensors, operators = [], [], []

    def tensor(name, values, kind, scale, zero):
        if isinstance(values, tuple):
            shape, data = values, None
        else:
            shape, data = values.shape, b.CreateByteVector(values.tobytes())
        t.BufferStart(b)
        if data is not None:
            t.BufferAddData(b, data)
        buffers.append(t.BufferEnd(b))
        scales, zeros = b.CreateNumpyVector(np.float32([scale])), b.CreateNumpyVector(np.int64([zero]))
        t.QuantizationParametersStart(b)
        t.QuantizationParametersAddScale(b, scales)
        t.QuantizationParametersAddZeroPoint(b, zeros)
        quantization = t.QuantizationParametersEnd(b)
        name, shape = b.CreateString(name), b.CreateNumpyVector(np.int32(shape))
        t.TensorStart(b)
        t.TensorAddName(b, name)
        t.TensorAddShape(b, shape)
        t.TensorAddType(b, kind)
        t.TensorAddBuffer(b, len(buffers) - 1)
        t.TensorAddQuantization(b, quantization)
        tensors.append(t.TensorEnd(b))
        return len(tensors) - 1

    last = first = tensor("input", (1, rows[0][0].shape[1]), t.TensorType.INT8, *ranges[0])
    for i, (codes, sums, *_, zero_out, least, scale) in enumerate(rows):
        inputs = [last, tensor(f"w{i}", codes, t.TensorType.INT8, scale, 0)]
        inputs.append(tensor(f"b{i}", sums, t.TensorType.INT32, scale * ranges[i][0], 0))
        last = tensor(f"y{i}", (1, codes.shape[0]), t.TensorType.INT8, *ranges[i + 1])
        relu = t.ActivationFunctionType.RELU if least == zero_out else t.ActivationFunctionType.NONE
        t.FullyConnectedOptionsStart(b)
        t.FullyConnectedOptionsAddFusedActivationFunction(b, relu)
        options = t.FullyConnectedOptionsEnd(b)
        inputs, outputs = b.CreateNumpyVector(np.int32(inputs)), b.CreateNumpyVector(np.int32([last]))
        t.OperatorStart(b)
        t.OperatorAddInputs(b, inputs)
        t.OperatorAddOutputs(b, outputs)
        t.OperatorAddBuiltinOptionsType(b, t.BuiltinOptions.FullyConnectedOptions)
        t.OperatorAddBuiltinOptions(b, options)
        operators.append(t.OperatorEnd(b))
    t.OperatorCodeStart(b)
    t.OperatorCodeAddDeprecatedBuiltinCode(b, t.BuiltinOperator.FULLY_CONNECTED)
    t.OperatorCodeAddBuiltinCode(b, t.BuiltinOperator.FULLY_CONNECTED)
    codes = vector(t.ModelStartOperatorCodesVector, [t.OperatorCodeEnd(b)])
    tensors, operators = vector(t.SubGraphStartTensorsVector, tensors), vector(t.SubGraphStartOperatorsVector, operators)
    ends = [b.CreateNumpyVector(np.int32([end])) for end in (first, last)]
    t.SubGraphStart(b)
    t.SubGraphAddTensors(b, tensors)
    t.SubGraphAddInputs(b, ends[0])
    t.SubGraphAddOutputs(b, ends[1])
    t.SubGraphAddOperators(b, operators)
    graphs = vector(t.ModelStartSubgraphsVector, [t.SubGraphEnd(b)])
    buffers = vector(t.ModelStartBuffersVector, buffers)
    t.ModelStart(b)
    t.ModelAddVersion(b, 3)
    t.ModelAddOperatorCodes(b, codes)
    t.ModelAddSubgraphs(b, graphs)
    t.ModelAddBuffers(b, buffers)
    b.Finish(t.ModelEnd(b), b"TFL3")
    file.write_bytes(b.Output())


def bakenn(layers, calibration, inputs, folder):
    """Writes BakeNN's C for each target, its input, and returns scale, zero point and expected outputs."""
    import bakenn as bk

    linear = [bk.FloatLinear(w, b, relu=f == "relu", name=f"l{i}") for i, (w, b, f) in enumerate(layers)]
    graph = bk.quantize_ptq(bk.FloatMLP(tuple(linear)), calibration, name="net")
    for policy, target in (("portable", "portable32"), *(("static_priority", t) for t in
                           ("portable32", "cortex-m0plus", "cortex-m4", "rv32imc"))):
        options = bk.CBackendOptions(kernel_policy=bk.KernelPolicy(policy), target=bk.resolve_target(target))
        out = folder / f"bakenn-{'plain' if policy == 'portable' else target}"
        bk.compile(graph, out, model_name="net", backend_options=options)
    scale, zero = graph.values["input"].qparams.scale, graph.values["input"].qparams.zero_point
    codes = to_int8(inputs, scale, zero)
    (folder / "bakenn_input.h").write_text("#include <stdint.h>\n" + array("int8_t", "input", codes))
    exact = []
    for op, (_, _, function) in zip(graph.ops, layers):
        scales = [np.asarray(graph.values[name].qparams.scales) for name in (op.weight, op.bias)]
        exact.append((graph.constants[op.weight] * scales[0][:, None], graph.constants[op.bias] * scales[1], function))
    last = graph.values[graph.outputs[0]].qparams
    return {"scale": last.scale, "zero": last.zero_point, "values": run(exact, (codes - float(zero)) * scale)[-1].tolist()}


def gru(form, inputs):
    """Returns torch's GRU of one layer in f64 from a state of 0, for each input."""
    (wx, bx), (wh, bh) = [(np.asarray(gate["weights"]), np.asarray(gate["bias"])) for gate in form]
    hidden = len(bx) // 3
    wx, wh = wx.reshape(3 * hidden, -1), wh.reshape(3 * hidden, -1)
    state, states = np.zeros(hidden), []
    for x in inputs:
        a, b = wx @ x + bx, wh @ state + bh
        r, z = np.split(1 / (1 + np.exp(-(a + b)[: 2 * hidden])), 2)
        state = (1 - z) * np.tanh(a[2 * hidden :] + r * b[2 * hidden :]) + z * state
        states.append(state.tolist())
    return states


def main():
    folder = pathlib.Path(sys.argv[1]).absolute()
    network = json.loads((folder / "network.json").read_text())
    inputs, calibration = np.asarray(network["inputs"]), np.asarray(network["calibration"])
    is_gru, function = network["is_gru"], network["function"]

    def layers_of(form):
        layers = [(np.asarray(m["weights"]).reshape(len(m["bias"]), -1), np.asarray(m["bias"]), function) for m in form]
        return [*layers[:-1], (*layers[-1][:2], "none")]

    expected = {}
    for name, form in network["forms"].items():
        values = gru(form, inputs) if is_gru else run(layers_of(form), inputs)[-1].tolist()
        expected[name] = {"values": values}
    form, text = network["forms"]["f32"], '#include "peer.h"\n' + array("float", "input", inputs)
    if is_gru:
        for name, gate in zip("xh", form):
            text += blob(folder, "float", f"w{name}", gate["weights"]) + array("float", f"b{name}", gate["bias"])
    else:
        layers = layers_of(form)
        for i, (weights, bias, _) in enumerate(layers):
            text += blob(folder, "float", f"weights_{i}", weights) + blob(folder, "float", f"transposed_{i}", weights.T)
            text += array("float", f"bias_{i}", bias)
    (folder / "f32.h").write_text(text)
    if not is_gru and function != "elu":
        rows, ranges, exact = int8(layers, calibration)
        codes, (scale, zero), last = to_int8(inputs, *ranges[0]), ranges[0], ranges[-1]
        (folder / "int8.h").write_text(header(folder, rows, codes))
        tflite(rows, ranges, folder / "model.tflite")
        values = run(exact, (codes - float(zero)) * scale)[-1].tolist()
        expected["int8"] = {"scale": last[0], "zero": last[1], "values": values}
        # MicroFlow gives f32.
        expected["int8 to f32"] = {"values": values}
        expected["bakenn"] = bakenn(layers, calibration, inputs, folder)
    (folder / "expected.json").write_text(json.dumps(expected))


main()
