"""Modules of torch: exported by torch, imported, and compared with the policy."""

from __future__ import annotations

import contextlib
import copy
import io
import logging
import warnings
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple
from unittest import mock

import numpy as np
import torch

from . import _actq, _sb3
from ._actq import Error, Policy
from ._functions import HOPELESS, beyond
from ._memory import changed_values, depends_on, kept_tensors, values_of, wrapped
from ._typing import Array, Limits

if TYPE_CHECKING:
    from ._import import Example

Tensors = Tuple[torch.Tensor, ...]

log = logging.getLogger("actq")

#: The operator set of the tracing exporter.
OPSET = 17
#: Largest error of a correct policy, as a share of the largest action.
TOLERANCE = 1e-5
#: Largest error of a correct policy, as a multiple of what roundings of the weights change.
ROUNDINGS = 8.0
#: Names of the states that a module keeps by itself, each with a number.
STATE = "kept_state_"
#: Changes by roundings that are drawn: a value may be sensitive at one observation only.
DRAWS = 16
#: Longest observation that is tried to find the one that a module takes.
LONGEST = 2048


def import_module(
    module: Any,
    example: Example,
    name: str,
    *,
    output: Optional[str],
    states: Sequence[Tuple[str, str]],
    observe: Sequence[str],
    input_names: Optional[Sequence[str]],
    output_names: Optional[Sequence[str]],
    limits: Limits,
    rate_hz: Optional[float],
) -> Policy:
    """Imports one step of a module in evaluation mode. Only copies of the module run.

    Raises `actq.Error` if it cannot be imported, or if policy and module differ on drawn observations.
    """
    inputs = _inputs(example, name)
    tensors = [*module.parameters(), *module.buffers()]
    device = tensors[0].device if tensors else torch.device("cpu")
    inputs = tuple(tensor.to(device) for tensor in inputs)
    with torch.random.fork_rng([device] if device.type == "cuda" else []), torch.no_grad():
        source = Source(module, inputs, name, input_names, output_names, limits, rate_hz)
        try:
            return source.policy(output, states, observe)
        except Memory as error:
            policy = source.policy_with_states(error.changed, output, states, observe)
            if policy is None:
                raise Error(*error.args) from error.__cause__
            return policy


class Memory(Error):
    """A module keeps values from step to step."""

    def __init__(self, name: str, changed: Sequence[str], is_script: bool) -> None:
        remedy = (
            "of TorchScript they cannot be taken; pass the runner or module that it was made of, or an ONNX file that has them as "
            "inputs and outputs"
            if is_script
            else "take them as inputs. States of LSTM and GRU layers are kept, as tensors of a module or with states="
        )
        kept = ", ".join(changed)
        super().__init__(f"{name}: the action depends on values that forward keeps from step to step: {kept}; {remedy}")
        self.changed = changed


class Source:
    """A module, the example of its inputs, and the names of inputs and outputs."""

    def __init__(
        self,
        module: Any,
        inputs: Tensors,
        name: str,
        input_names: Optional[Sequence[str]],
        output_names: Optional[Sequence[str]],
        limits: Limits,
        rate_hz: Optional[float],
    ) -> None:
        self.module, self.inputs, self.name, self.rate_hz = module, inputs, name, rate_hz
        step = self.copied()
        self.is_script = isinstance(step, torch.jit.ScriptModule)
        self.limits = limits if self.is_script else _sb3.limited(step, limits, name)
        self.parts = [] if self.is_script else _sb3.named_parts(step)
        try:
            outputs = step(*inputs)
        except Exception as error:
            raise Error(f"{name}: {self._expected() or f'the module fails on the example: {reason(error)}'}") from error
        found = dict(tensors(outputs, "output", name))
        # A single one keeps the exporter's name.
        self.input_names = list(input_names or [f"input_{i}" for i in range(len(inputs))] * (len(inputs) > 1))
        self.output_names = list(output_names or list(found) * (len(found) > 1))
        if self.output_names and len(self.output_names) != len(found):
            raise Error(f"{name}: output_names has {len(self.output_names)} names for {len(found)} outputs")

    def copied(self) -> Any:
        """Returns a copy in evaluation mode; of a policy of Stable-Baselines3, its deterministic action."""
        module = copied(self.module, self.name)
        return _sb3.Deterministic(module, self.name) if _sb3.is_policy(module) else module

    def _expected(self) -> Optional[str]:
        """Says which length of the observation runs, if the example's does not."""
        if len(self.inputs) > 1 or self.inputs[0].dim() == 0:
            return None
        *first, given = self.inputs[0].shape
        module = self.copied()
        # One value is broadcast to any length.
        for length in [*range(2, LONGEST), 1]:
            with contextlib.suppress(Exception):
                module(self.inputs[0].new_zeros(*first, length))
                return f"the example has {given} values; the module takes {length}" if length != given else None
        return None

    def policy(self, output: Optional[str], states: Sequence[Tuple[str, str]], observe: Sequence[str]) -> Policy:
        """Imports the module, and compares it with the policy."""
        with warnings.catch_warnings(record=True) as caught, silenced():
            # A filter of the caller must not turn them into exceptions.
            warnings.simplefilter("always")
            content = self.onnx_bytes()
        # Torch exports the name without saying so.
        tracer: Any = torch.jit
        branches = [warning for warning in caught if issubclass(warning.category, tracer.TracerWarning)]
        try:
            policy, self.plan = _actq.import_onnx(
                content, name=self.name, output=output, states=list(states), observe=observe, limits=self.limits,
                rate_hz=self.rate_hz, parts=self.parts,
            )  # fmt: skip
        except Error as error:
            changed = self.kept_values()
            raise (Memory(self.name, changed, self.is_script) if changed else error) from error.__cause__
        self.compare(self.plan, branches)
        return policy

    def policy_with_states(
        self, changed: Sequence[str], output: Optional[str], states: Sequence[Tuple[str, str]], observe: Sequence[str]
    ) -> Optional[Policy]:
        """Imports a module that keeps the states of its cells by itself, if these are all that it keeps."""
        used = self.copied()
        found = list(tensors(used(*self.inputs), "output", self.name))
        kept = kept_tensors(used, changed)
        if not kept or self.is_script or isinstance(used, _sb3.Deterministic):
            return None
        held = tuple(torch.zeros_like(value) for values in kept.values() for value in values)
        inputs = self.input_names or ["input_0"]
        outputs = self.output_names or [name for name, _ in found]
        pairs = [(f"{STATE}{i}", f"next_{STATE}{i}") for i in range(len(held))]
        module = Stateless(used, {name: len(values) for name, values in kept.items()}, self.name)
        carried = Source(
            module,
            (*self.inputs, *held),
            self.name,
            [*inputs, *(before for before, _ in pairs)],
            [*outputs, *(after for _, after in pairs)],
            self.limits,
            self.rate_hz,
        )
        try:
            policy = carried.policy(output, [*states, *pairs], observe)
        except Error:
            return None
        # The module itself, from its own first states.
        actions = self.run(self.copied(), carried.plan, carried.plan["probes"])
        return policy if share(carried.beyond_functions(carried.plan, actions), actions) <= TOLERANCE else None

    def onnx_bytes(self) -> bytes:
        """Exports by the tracing exporter, which needs only torch, else by that of torch.export, which knows more
        operators."""
        module: Any = self.copied()
        module = module if len(self.output_names) < 2 else Flat(module, self.name).eval()
        names: Dict[str, Any] = {"input_names": self.input_names or None, "output_names": self.output_names or None}
        file = io.BytesIO()
        try:
            torch.onnx.export(module, self.inputs, file, opset_version=OPSET, dynamo=False, **names)  # type: ignore[arg-type]
            return file.getvalue()
        except Exception as error:
            why = reason(error)
            if not self.is_script and find_spec("onnxscript") is not None:
                try:
                    program = torch.onnx.export(module, self.inputs, dynamo=True, verbose=False, **names)
                    assert program is not None, "without a file torch returns the program"
                    return bytes(program.model_proto.SerializeToString())
                except Exception as newer:
                    why += f"; nor can its newer exporter: {reason(newer)}"
            raise Error(f"{self.name}: torch cannot export the module: {why}") from error

    def run(self, module: Any, plan: Dict[str, Any], probes: Array) -> Array:
        """Runs a copy over observations [block, frame, value], with its states carried on; returns outputs [block, frame,
        value]. Those of a step that raises are not a number."""
        held = self.held(plan)
        rows: List[Array] = []
        failure: Optional[Exception] = None
        for row in torch.from_numpy(probes.reshape(-1, probes.shape[-1])):
            try:
                rows.append(self.step(module, plan, row, held).double().cpu().numpy())
            except Exception as error:
                failure = error
                rows.append(np.full(plan["actions"].shape[-1], np.nan))
        if failure is not None and np.isnan(rows).all():
            raise Error(f"{self.name}: the module fails on drawn observations: {reason(failure)}") from failure
        if any(len(row) != len(rows[0]) for row in rows):
            raise Error(f"{self.name}: the length of the module's action depends on its observation")
        return np.stack(rows).reshape(*probes.shape[:2], -1)

    def held(self, plan: Dict[str, Any]) -> List[torch.Tensor]:
        """Returns a module's inputs at the start of an episode: its states are 0."""
        held = list(self.inputs)
        for i, _ in self.carried(plan):
            held[i] = torch.zeros_like(held[i])
        return held

    def carried(self, plan: Dict[str, Any]) -> List[Tuple[int, int]]:
        """Returns the places of the states in the inputs and outputs. A module that keeps its states by itself has none."""
        positions = {name: i for i, name in enumerate(self.input_names)}
        return [(positions[of], self.output_names.index(to)) for of, to in plan["states"] if of in positions]

    def step(self, module: Any, plan: Dict[str, Any], row: torch.Tensor, held: List[torch.Tensor]) -> torch.Tensor:
        """Makes a step of a module at an observation [value]: replaces the observed ones of its inputs, then the states.
        Returns the action [value]."""
        positions, at = {name: i for i, name in enumerate(self.input_names)}, 0
        for name, length in plan["inputs"]:
            i = positions.get(name, 0)
            # The module may change it in place.
            held[i] = row[at : at + length].clone().reshape(held[i].shape).to(held[i])
            at += length
        outputs = self.outputs(module, held)
        for i, k in self.carried(plan):
            held[i] = outputs[k].reshape(held[i].shape)
        return outputs[self.action(plan)].reshape(-1)

    def outputs(self, module: Any, inputs: Sequence[torch.Tensor]) -> List[torch.Tensor]:
        return [tensor for _, tensor in tensors(module(*inputs), "output", self.name)]

    def action(self, plan: Dict[str, Any]) -> int:
        """Returns the place of the action in the outputs."""
        return self.output_names.index(plan["output"]) if self.output_names else 0

    def beyond_functions(self, plan: Dict[str, Any], found: Array) -> Array:
        """Returns the differences [block, frame, value] of policy and module, less what the errors of actq's functions may
        change: with states, also those of earlier steps."""
        rows = torch.from_numpy(plan["probes"]).reshape(-1, plan["probes"].shape[-1])
        episodes, module = rows[None] if plan["states"] else rows[:, None], self.copied()

        def output(given: Sequence[torch.Tensor]) -> torch.Tensor:
            held = self.held(plan)
            return torch.cat([self.step(module, plan, row, held) for row in given[0]])

        tolerance = np.broadcast_to(TOLERANCE * scale(found), found.shape).reshape(len(episodes), -1)
        difference = np.abs(plan["actions"] - found).reshape(len(episodes), -1)
        # The gradients of an episode take a tenth of a second for each value.
        hopeless = 1.0 if plan["states"] else HOPELESS
        return beyond(difference, tolerance, output, lambda i: [episodes[i]], hopeless).reshape(found.shape)

    def compare(self, plan: Dict[str, Any], branches: Sequence[warnings.WarningMessage]) -> None:
        """Refuses a policy that differs from the module, with the cause."""
        probes, actions = plan["probes"], plan["actions"]
        used = self.copied()
        found = self.run(used, plan, probes)
        _sb3.refuse_other_actions(used, probes, self.name)
        changed = changed_values(self.copied(), used)
        error, difference = share(actions - found, found), np.abs(actions - found)
        # Without states, what a module keeps is an error of its own.
        if error > TOLERANCE and (plan["states"] or not changed):
            difference = self.beyond_functions(plan, found)
        traced = [warning for warning in branches if f"{torch.__path__[0]}/" not in warning.filename]
        if share(difference, found) > TOLERANCE and not self._is_rounding(plan, found, difference):
            raise Memory(self.name, changed, self.is_script) if changed else Error(f"{self.name}: {self._cause(plan, found, error, traced)}")
        if changed and depends_on(used, changed, lambda: self.run(used, plan, probes[:1]), found[:1], share):
            raise Memory(self.name, changed, self.is_script)
        for text in dict.fromkeys(map(branch, traced)):
            log.warning("%s: %s; no drawn observation shows a difference", self.name, text)
        still = [i for i in range(found.shape[-1]) if np.ptp(found[..., i]) == 0]
        if still:
            log.warning("%s: actions %s are constant over all drawn observations; nothing is known of them", self.name, still)

    def kept_values(self) -> List[str]:
        """Names the values that steps have changed, if outputs depend on earlier steps."""
        used, random = self.copied(), torch.Generator().manual_seed(1)
        with contextlib.suppress(Exception):
            for _ in range(8):
                given = [torch.randn(x.shape, generator=random).to(x) for x in self.inputs]
                later = list(tensors(used(*given), "output", self.name))
            first = tensors(self.copied()(*given), "output", self.name)
            if not all(torch.equal(a, b) for (_, a), (_, b) in zip(first, later)):
                return changed_values(self.copied(), used)
        return []

    def _is_rounding(self, plan: Dict[str, Any], found: Array, difference: Array) -> bool:
        """Returns `True` if the policy differs, beyond the errors of its functions, as the module itself does when its weights
        change by a rounding: what float32 loses is no more than that."""
        if share(self.run(self.copied(), plan, plan["probes"]) - found, found) > 0:
            return False
        error, allowed = difference.max(axis=1), TOLERANCE * scale(found)[:, 0]
        random = torch.Generator().manual_seed(1)
        for _ in range(DRAWS):
            module = self.copied()
            for weight in [*module.parameters(), *module.buffers()]:
                if weight.is_floating_point() and not wrapped(weight):
                    sign = torch.randint(2, weight.shape, generator=random).to(weight.device) * 2 - 1
                    weight.mul_(1 + torch.finfo(torch.float32).eps * sign.to(weight.dtype))
            own = np.abs(self.run(module, plan, plan["probes"]) - found).max(axis=1)
            allowed = np.maximum(allowed, ROUNDINGS * own)
            if (error <= allowed).all():
                return True
        return False

    def _cause(self, plan: Dict[str, Any], found: Array, error: float, traced: Sequence[warnings.WarningMessage]) -> str:
        if share(self.run(self.copied(), plan, plan["probes"]) - found, found) > 0:
            return (
                "two runs of the module on the same observations differ, so it draws random numbers, or keeps values outside "
                "of itself; pass a module with the deterministic action"
            )
        off = f"the policy is off by {error:.1e} of the largest action on drawn observations"
        if traced:
            return f"{off}: {branch(traced[0])}; choose by torch.where, or pass a module of one branch"
        return (
            f"{off}, more than roundings explain. If forward computes outside of torch, or reads values from elsewhere, an import makes "
            "them constants: pass a module that takes them as inputs; if it does neither, please report it"
        )


def branch(warning: warnings.WarningMessage) -> str:
    """Says where the result depends on values, in torch's words."""
    text = str(warning.message).split(". ")[0]
    return f"the result depends on values, as by a branch at {warning.filename}:{warning.lineno} ({text})"


def scale(actions: Array) -> Array:
    """Returns the largest value of each block and dimension [block, 1, value]. Of a small one, it is a share of the block's,
    or of the first block's, whose observations have usual magnitudes: float32 rounds values around 1 within the network."""
    largest = np.abs(np.where(np.isfinite(actions), actions, 0.0)).max(axis=1, keepdims=True)
    least = np.maximum(1e-3 * largest.max(axis=2, keepdims=True), 1e-2 * largest[0].max())
    return np.maximum(np.maximum(largest, least), 1e-30)


def share(difference: Array, actions: Array) -> float:
    """Returns the largest difference as a share of the largest action of its block and dimension. Steps that the module
    refuses do not count, nor values that are infinite for both."""
    difference = np.where(np.isfinite(actions), np.abs(difference), 0.0)
    return float((np.where(np.isnan(difference), np.inf, difference) / scale(actions)).max())


@contextlib.contextmanager
def silenced() -> Iterator[None]:
    """Keeps torch from printing whole graphs when an export fails; the error has the reason."""
    switch = getattr(torch._C, "_jit_set_onnx_log_enabled", lambda on: None)
    switch(False)
    # The exporter itself switches its log on, also if it is not asked to.
    off = mock.patch.object(torch._C, "_jit_set_onnx_log_enabled", lambda on: None, create=True)
    with off, contextlib.redirect_stdout(io.StringIO()):
        yield


COPIED_LEAF: Any = torch.Tensor.__deepcopy__


def copied(module: Any, name: str) -> Any:
    """Returns a copy of a module in evaluation mode."""
    try:
        with mock.patch.object(torch.Tensor, "__deepcopy__", copied_tensor):
            return copy.deepcopy(module).eval()
    except Exception as error:
        raise Error(f"{name}: copy.deepcopy cannot copy the module: {reason(error)}") from error


def copied_tensor(tensor: torch.Tensor, memo: Dict[int, Any]) -> Any:
    """Copies a tensor. Those that forward has computed have a history of gradients, which torch's own method refuses."""
    return COPIED_LEAF(tensor, memo) if tensor.is_leaf else tensor.detach().clone()


class Stateless(torch.nn.Module):
    """A module that takes the tensors that it keeps as its last inputs, and returns them after its outputs."""

    def __init__(self, module: Any, kept: Mapping[str, int], name: str) -> None:
        super().__init__()
        self.module, self.kept, self.name = module, kept, name

    def forward(self, *inputs: torch.Tensor) -> Tensors:
        at, places = len(inputs) - sum(self.kept.values()), values_of(self.module)
        given, held = inputs[:at], iter(inputs[at:])
        for name, count in self.kept.items():
            # The module may change them in place.
            values = [next(held).clone() for _ in range(count)]
            part, attribute, before = places[name]
            setattr(part, attribute, type(before)(values) if isinstance(before, (tuple, list)) else values[0])
        outputs = tuple(tensor for _, tensor in tensors(self.module(*given), "output", self.name))
        after = kept_tensors(self.module, list(self.kept)).values()
        return outputs + tuple(value for values in after for value in values)


class Flat(torch.nn.Module):
    """A module whose outputs are one tuple."""

    def __init__(self, module: Any, name: str) -> None:
        super().__init__()
        self.module, self.name = module, name

    def forward(self, *inputs: torch.Tensor) -> Tensors:
        return tuple(tensor for _, tensor in tensors(self.module(*inputs), "output", self.name))


def tensors(value: Any, at: str, name: str) -> Iterator[Tuple[str, torch.Tensor]]:
    """Yields the tensors of a module's result, named by the keys of mappings and named tuples, or by place."""
    if isinstance(value, torch.Tensor):
        yield at, value
    elif isinstance(value, (Mapping, tuple, list)):
        keys = value if isinstance(value, Mapping) else getattr(value, "_fields", None)
        items = value.values() if isinstance(value, Mapping) else value
        for key, item in zip(keys or (f"{at}_{i}" for i in range(len(value))), items):
            yield from tensors(item, str(key), name)
    elif value is not None:
        raise Error(f"{name}: forward returns a {type(value).__name__}; pass a module that returns the action as a tensor")


def reason(error: BaseException) -> str:
    """Returns the first line of the first cause."""
    while error.__cause__ is not None:
        error = error.__cause__
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[0][:300] if lines else type(error).__name__


def _inputs(example: Any, name: str) -> Tensors:
    inputs = tuple(example) if isinstance(example, (tuple, list)) else (example,)
    wrong = [type(value).__name__ for value in inputs if not isinstance(value, torch.Tensor)]
    if wrong or not inputs:
        found = wrong[0] if wrong else "an empty tuple"
        raise Error(f"{name}: the example is of type {found}; pass a tensor [1, n_obs], or a tuple of tensors")
    return tuple(value.detach() for value in inputs)
