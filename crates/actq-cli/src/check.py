"""Runs an ONNX file over observations: float32 rows on standard input, float64 rows of actions on standard output.

Noise follows an observation if the file is the network of a flow or a diffusion policy.

check.py FILE PLAN onnxruntime: run by onnxruntime without its optimizer, which may change roundings when it fuses.
check.py FILE PLAN float64: run by the evaluator of the package onnx, with every float32 of the file widened to float64.
Ends with status 3 if it cannot run this file.
"""
import json
import sys

path, plan, way = sys.argv[1], json.loads(sys.argv[2]), sys.argv[3]
try:
    import numpy
    if way == "float64":
        import onnx
        import onnx.reference
    else:
        import onnxruntime
except ImportError as error:
    sys.exit(f"{error}: pip install onnxruntime onnx numpy")


def by_onnxruntime():
    """Return a function that runs the file, its inputs as zeros, and the names of its outputs."""
    options = onnxruntime.SessionOptions()
    options.log_severity_level = 3
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_DISABLE_ALL
    session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    kinds = {"tensor(float)": "f4", "tensor(double)": "f8", "tensor(int64)": "i8", "tensor(int32)": "i4", "tensor(bool)": "?"}
    inputs = {port.name: zeros(port.shape, kinds[port.type]) for port in session.get_inputs()}
    return session.run, inputs, [port.name for port in session.get_outputs()]


def in_float64():
    """Return the same as by_onnxruntime."""
    model = onnx.load(path)
    for node in model.graph.node:
        is_causal = any(attribute.name == "is_causal" and attribute.i for attribute in node.attribute)
        if node.op_type == "Attention" and is_causal and any(node.input[3:4]):
            # findings/onnx-attention-mask-row.sh
            raise ValueError("the package onnx computes a causal Attention with a mask wrong")
    widen(model)
    evaluator = onnx.reference.ReferenceEvaluator(model)
    constants = {tensor.name for tensor in model.graph.initializer}
    inputs = {}
    for port in model.graph.input:
        tensor = port.type.tensor_type
        if port.name not in constants:
            kind = onnx.helper.tensor_dtype_to_np_dtype(tensor.elem_type)
            inputs[port.name] = zeros([axis.dim_value for axis in tensor.shape.dim], kind)
    return evaluator.run, inputs, evaluator.output_names


def widen(message):
    """Widen every float32 tensor, type, constant and cast inside a protobuf message to float64."""
    single, double = onnx.TensorProto.FLOAT, onnx.TensorProto.DOUBLE
    if isinstance(message, onnx.TensorProto):
        if message.data_type == single:
            message.CopyFrom(wide(onnx.numpy_helper.to_array(message), message.name))
        return
    if isinstance(message, onnx.TypeProto.Tensor) and message.elem_type == single:
        message.elem_type = double
    for attribute in message.attribute if isinstance(message, onnx.NodeProto) else []:
        if message.op_type == "Cast" and attribute.name == "to" and attribute.i == single:
            attribute.i = double
        if message.op_type == "Constant" and attribute.name in ("value_float", "value_floats"):
            value = wide(onnx.helper.get_attribute_value(attribute), "")
            attribute.CopyFrom(onnx.helper.make_attribute("value", value))
    for field, value in message.ListFields():
        if field.type == field.TYPE_MESSAGE:
            for part in [value] if hasattr(value, "ListFields") else value:
                widen(part)


def wide(values, name):
    return onnx.numpy_helper.from_array(numpy.array(values, "f8"), name)


def zeros(shape, kind):
    return numpy.zeros([n if isinstance(n, int) and n > 0 else 1 for n in shape], kind)


def sampled(run, fed, noise, steps):
    """Return the actions that the steps make of noise (docs/POLICY.md, Flow and diffusion policies)."""
    n = steps["values"]
    x = y = noise[:n]
    for i, (time, by) in enumerate(zip(steps["times"], steps["steps"])):
        sample_x, sample_v, keep, direct, sample, sigma, ahead = by
        at, to = fed[steps["iterate"]], fed[steps["time"]]
        fed[steps["iterate"]] = clipped(y, steps["clip_iterate"]).reshape(at.shape).astype(at.dtype)
        fed[steps["time"]] = numpy.full(to.shape, time, to.dtype)
        v = run([plan["output"]], fed)[0].astype("f8").reshape(-1)
        x = keep * x + direct * v + sample * clipped(sample_x * x + sample_v * v, steps["limit"])
        y = x + ahead * v
        if sigma:
            x = y = x + sigma * noise[(1 + i) * n:(2 + i) * n]
    return x


def clipped(values, limit):
    return values if limit is None else values.clip(-limit, limit)


def main():
    run, fed, given = in_float64() if way == "float64" else by_onnxruntime()
    outputs = [plan["output"]] + [output for _, output in plan["states"]]
    if not set(outputs) <= set(given):
        raise ValueError(f"{plan['output']} is a value inside the file, not an output; leave out --check")
    width, sampler = sum(length for _, length in plan["inputs"]), plan["sampler"]
    noise = sampler["noise"] if sampler else 0
    for row in numpy.frombuffer(sys.stdin.buffer.read(), "<f4").reshape(-1, width + noise):
        at = 0
        for name, length in plan["inputs"]:
            fed[name] = row[at:at + length].reshape(fed[name].shape).astype(fed[name].dtype)
            at += length
        if sampler:
            sys.stdout.buffer.write(sampled(run, fed, row[at:].astype("f8"), sampler).astype("<f8").tobytes())
            continue
        action, *states = run(outputs, fed)
        for (name, _), state in zip(plan["states"], states):
            fed[name] = state.reshape(fed[name].shape)
        sys.stdout.buffer.write(action.astype("<f8").tobytes())


try:
    main()
except Exception as error:
    text = str(error).strip() or type(error).__name__
    print(f"{'onnx in float64' if way == 'float64' else way} cannot run this file: {text}", file=sys.stderr)
    sys.exit(3)
