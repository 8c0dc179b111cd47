"""Runs an ONNX file over observations with onnxruntime: float32 rows on standard input, rows of actions on standard output."""
import json
import sys

try:
    import numpy
    import onnxruntime
except ImportError as error:
    sys.exit(f"{error}: pip install onnxruntime numpy")

path, plan = sys.argv[1], json.loads(sys.argv[2])
options = onnxruntime.SessionOptions()
options.log_severity_level = 3
try:
    session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
except Exception as error:
    sys.exit(f"onnxruntime cannot run this file: {error}")
kinds = {"tensor(float)": numpy.float32, "tensor(double)": numpy.float64, "tensor(int64)": numpy.int64,
         "tensor(int32)": numpy.int32, "tensor(bool)": numpy.bool_}


def zeros(port):
    shape = [n if isinstance(n, int) and n > 0 else 1 for n in port.shape]
    return numpy.zeros(shape, kinds[port.type])


outputs = [plan["output"]] + [output for _, output in plan["states"]]
if not set(outputs) <= {port.name for port in session.get_outputs()}:
    sys.exit(f"{plan['output']} is no output of the file, only a value inside it: onnxruntime cannot show it")
fed = {port.name: zeros(port) for port in session.get_inputs()}
width = sum(length for _, length in plan["inputs"])
for row in numpy.frombuffer(sys.stdin.buffer.read(), "<f4").reshape(-1, width):
    at = 0
    for name, length in plan["inputs"]:
        fed[name] = row[at:at + length].reshape(fed[name].shape).astype(fed[name].dtype)
        at += length
    action, *states = session.run(outputs, fed)
    for (name, _), state in zip(plan["states"], states):
        fed[name] = state.reshape(fed[name].shape)
    sys.stdout.buffer.write(action.astype("<f4").tobytes())
