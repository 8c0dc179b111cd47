"""Types of the compiled part. Shapes are in brackets; n is the number of robots."""

import builtins
import os
import pathlib
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, TypedDict, Union

import numpy as np
import numpy.typing as npt
from typing_extensions import final

from ._report import Page, Report

_Path = Union[str, os.PathLike[str]]
_Report = Optional[Callable[[str, float], object]]
_Floats = npt.NDArray[np.float32]

__version__: str

class Error(ValueError):
    """A policy, recording, image, option or controller cannot be used as it is; the text is that of the command `actq`."""

@final
class Policy:
    """A policy in f32, as it was trained. `actq.import_policy` makes one."""

    @property
    def name(self) -> str:
        """Name of the policy."""
    @property
    def obs_len(self) -> int:
        """Values of an observation; of a policy from a deploy bundle, raw values."""
    @property
    def act_len(self) -> int:
        """Values of an action."""
    @property
    def chunk(self) -> int:
        """Actions in the network's output; 1 without action chunks."""
    @property
    def execute(self) -> int:
        """Actions executed of a chunk."""
    @property
    def rate_hz(self) -> float:
        """Control rate in Hz."""
    @property
    def parameters(self) -> int:
        """Number of trained values."""
    @property
    def state_len(self) -> int:
        """Values of the recurrent state; 0 without one."""
    @property
    def ports(self) -> str:
        """Inputs and outputs of its source, as `actq import` prints them: what each is, and those that are left out. Empty for
        other sources than ONNX and modules."""
    @property
    def refused(self) -> list[str]:
        """Outputs of its source that are named action but cannot be a part of it, with the reasons."""
    @property
    def digest(self) -> str:
        """SHA-256 of the policy's files, as `Image.source` has it."""
    def __call__(self, observations: npt.ArrayLike) -> _Floats:
        """Returns the actions in f32 at observations [steps, obs_len] of one episode, from its start, or at one observation
        [obs_len]: the network's outputs with scale, offset and limits, before step limits, smoothing, two-state actions and
        playback. A chunk is one row; a head that denoises takes its noise after the observation. The policy of a deploy bundle
        takes raw values and gives its targets."""

class Cost(TypedDict):
    """The predicted cost of a step that evaluates the network, and the memory that it needs."""

    core: str
    board: Optional[str]
    clock_hz: float
    milliseconds: float
    cycles: int
    instructions: int
    macs: int
    image_bytes: int
    scratch_bytes: int
    scratch_limit: Optional[int]

@final
class Image:
    """An image: what a microcontroller runs. `actq.quantize` makes one, `Image.load` reads a file.

    `Image(bytes)` checks an image of `bytes`. Images compare by their bytes, and can be pickled.
    """

    def __new__(cls, bytes: bytes) -> Image: ...
    @staticmethod
    def load(path: _Path) -> Image:
        """Reads and checks the file of an image.

        Raises `actq.Error` if it cannot be read, is damaged, or has another format version.
        """
    def save(self, path: _Path) -> None:
        """Writes the file, whole or not at all. It replaces only an image or an empty file.

        Raises `actq.Error` if the file exists and is something else, or cannot be written.
        """
    def inspect(self, *, clock: float = 168e6, core: Optional[str] = None) -> Report:
        """Returns the report of `actq inspect`: operations, bits, memory, contract, time at `clock` in Hz on a `core` with
        the image's layouts, by default "m4f"."""
    def report(self, policy: Optional[Policy] = None, *, recordings: Sequence[_Path] = ()) -> Page:
        """Returns the page of `actq report`, in which the image runs; a notebook shows it.

        With the `policy` that the image was made from, it compares both on `recordings`, files of observations, or on the
        recording in the policy's folder. Raises `actq.Error` if one of them does not match the image.
        Only the command draws statistics, sweeps and rollouts (--stats, --store, --driven), and arrays must be saved first.
        """
    def cost(self, board: Optional[str] = None, *, clock: float = 168e6, core: Optional[str] = None) -> Cost:
        """Predicts the cost of a step on a board, by default "stm32f405", or on a `core` as "m3", at `clock` in Hz.

        Memory never waits. On a board the model is that of a Cortex-M4 with FPU. Raises `actq.Error` for a board without
        the kernels in assembler, and for a core with other layouts than the image's.
        """
    def export_c(
        self,
        folder: _Path,
        *,
        name: str = "policy",
        golden: Optional[_Path] = None,
        steps: int = 100,
        force: bool = False,
    ) -> List[pathlib.Path]:
        """Writes the image as source code of C into `folder`, as `actq export-c` does; returns the paths.

        golden: a recording; NAME_golden.c gets `steps` of its observations with the bits of this host's actions.
        force: also replaces files that no export wrote; otherwise they raise `actq.Error`, and nothing is written.
        """
    def to_onnx(self, path: _Path) -> None:
        """Writes the image's network as an ONNX file in f32, with dequantized weights.

        Input "obs" [batch, obs_len], output "action" [batch, act_len] or [batch, chunk, act_len]: what the network gives,
        with scale, offset and limits. A recurrent network also takes "state" and gives "next_state", a flow or diffusion
        policy takes "noise". What depends on earlier actions (step limits, smoothing, switches, playback) is not part of
        it, and activations are not rounded.

        It replaces a file only if the name ends in .onnx. Raises `actq.Error` for an image with a description
        (docs/DEPLOY.md), and if the file cannot be written.
        """
    def network(self) -> Dict[str, Any]: ...
    def retrained(self, levels: Dict[str, List[int]], floats: Dict[str, List[float]]) -> Image: ...
    @property
    def bytes(self) -> builtins.bytes:
        """The bytes of the image's file."""
    @property
    def name(self) -> str:
        """Name of the policy."""
    @property
    def obs_len(self) -> int:
        """Values of an observation."""
    @property
    def act_len(self) -> int:
        """Values of an action."""
    @property
    def rate_hz(self) -> float:
        """Control rate in Hz."""
    @property
    def crc32(self) -> int:
        """CRC-32 of the image, as in its header."""
    @property
    def source(self) -> str:
        """SHA-256 of the policy that the image was made from, as hexadecimal digits."""
    @property
    def bits_per_weight(self) -> float:
        """Bits per weight of the original network, with scales and padding; biases and header do not count."""
    @property
    def scratch_bytes(self) -> int:
        """Bytes of scratch memory that a head needs."""
    @property
    def ports(self) -> List[Tuple[str, str, List[str], int]]:
        """Raw inputs in the order of the observation, then targets in the order of the action: kind ("input",
        "position", "velocity", "torque"), name, names of the values, their number. Empty without a description."""
    def __len__(self) -> int: ...
    def __bytes__(self) -> builtins.bytes: ...

@final
class Head:
    """The executor of an image, with n independent states: the bits of the microcontroller, on all cores. Copies and pickles
    have the states.

    image: the image.
    n: number of states; without it, the first observations decide.
    seed: seed of a flow or diffusion policy's noise; state i has the seed plus i.
    """

    def __new__(cls, image: Image, n: Optional[int] = None, *, seed: int = 0) -> Head: ...
    def __call__(self, observations: npt.ArrayLike, reset: Optional[npt.ArrayLike] = None) -> _Floats:
        """Steps every state on its observation and returns the actions, after the action contract.

        observations: [n_obs] for one state, or [n, n_obs]. They are converted to float32.
        reset: array of bool [n]; where it is true, the state is reset before the step.

        Returns [n_act], or [n, n_act]: the bits of `actq serve`. Other threads of Python run meanwhile.

        Raises `actq.Error` for another shape, and for an observation that is not finite: then nothing has changed. Also if a
        value inside the network exceeds float32: then the failed states were reset, and all others have made their step.
        It names the first state that failed.
        """
    def reset(self) -> None:
        """Resets every state: recurrent values, chunks, and the last action."""
    def set_prefix(self, caches: Sequence[Tuple[npt.ArrayLike, npt.ArrayLike]]) -> None:
        """Sets the keys and values that the image's attentions read as a prefix (docs/POLICY.md), until the next call.

        caches: keys and values of each cache in the order of the attentions, each [tokens, heads, elements] of all robots, or
            [n, tokens, heads, elements] of each. They are rounded to int8, as a controller gets them.

        A reset keeps the prefix, and `state` has it. Raises `actq.Error` for an image without a prefix, another shape or
        number, more tokens than the cache has, and values that are not finite: then nothing has changed.
        """
    def clear_prefix(self) -> None:
        """Clears the prefix of all robots: steps that run the network raise `actq.Error` until the next `set_prefix`."""
    def state(self) -> npt.NDArray[np.uint8]:
        """Returns the states of all robots [n, bytes]: a row has everything besides the image that the robot's next actions
        depend on, as recurrent values, chunk, last action and the seed of noise.

        Raises `actq.Error` before the first observations, unless n was given.
        """
    def restore(self, states: npt.ArrayLike) -> None:
        """Restores rows [n, bytes] that `state` of a head of the same image returned, in any order and number: the robots go
        on with the same bits. They also decide how many states a head without n has.

        Raises `actq.Error` for another number of states, and for rows that are damaged or of another image: then nothing has
        changed.
        """
    @property
    def image(self) -> Image:
        """The image."""
    @property
    def n(self) -> Optional[int]:
        """Number of states; `None` before the first observations, unless n was given."""

class Status(TypedDict):
    """The state of a controller (docs/LINK.md)."""

    state: str
    fault: Optional[str]
    refusal: Optional[str]
    reset: str
    ticks: int
    image: int
    slot: int
    act_len: int
    obs_len: int
    refused: int

class Timing(TypedDict):
    """The measured times of a controller and its most stack; 0 is not measured."""

    period_ns: int
    worst_tick_ns: int
    worst_jitter_ns: int
    worst_head_us: int
    overruns: int
    stack_bytes: int

@final
class Link:
    """A connection to a motor controller (docs/LINK.md), which is closed at the end of a `with` block.

    port: NAME or NAME@BAUD of a serial port, tcp:HOST:PORT, or unix:PATH.
    timeout: seconds without an answer before a request fails.

    Every method raises `actq.Error` without an answer, and if the controller refuses.
    """

    def __new__(cls, port: str, *, timeout: float = 2.0) -> Link: ...
    def status(self) -> Status:
        """Returns the controller's status."""
    def timing(self) -> Timing:
        """Returns the measured times."""
    def arm(self) -> None:
        """Arms the controller: its outputs follow the head."""
    def disarm(self) -> None:
        """Disarms the controller: its outputs coast."""
    def step(self, observation: npt.ArrayLike, *, timeout: Optional[float] = None) -> _Floats:
        """Sends an observation [n_obs] and returns the head's action for it [n_act].

        If the controller is armed and its safety allows it, the outputs follow the action.
        """
    def push(
        self, image: Image, *, version: int = 0, signature: Optional[builtins.bytes] = None, progress: _Report = None
    ) -> None:
        """Sends an image to the slot that does not run; the controller checks it, tests it, and runs it.

        version: must not be below that of an image that ran before.
        signature: 64 bytes, for controllers that require them. `actq sign` writes JSON: pass
            `bytes.fromhex(json["signature"])`, and its "version" as `version`.
        """
    def close(self) -> None:
        """Closes the port."""
    def __enter__(self) -> Link: ...
    def __exit__(self, *exception: object) -> None: ...

def import_path(
    path: _Path,
    *,
    output: Optional[str],
    states: List[Tuple[str, str]],
    observe: Sequence[str],
    prefix: Sequence[str],
    limits: Tuple[List[float], List[float], List[float]],
    rate_hz: Optional[float],
    accept_profile: bool,
    answers: str,
    profile: Optional[str],
    sampler: Optional[str],
) -> Policy: ...
def import_onnx(
    bytes: bytes,
    *,
    name: str,
    output: Optional[str],
    states: List[Tuple[str, str]],
    observe: Sequence[str],
    limits: Tuple[List[float], List[float], List[float]],
    rate_hz: Optional[float],
    parts: List[Tuple[str, int]],
) -> Tuple[Policy, Dict[str, Any]]: ...
def policy_of_files(json: bytes, weights: bytes, guards: List[str], dir: _Path) -> Policy: ...
def head_of_states(image: Image, seed: int, states: Optional[npt.NDArray[np.uint8]]) -> Head: ...
def bytes_of(text: str) -> int: ...
def write_text(path: _Path, text: str) -> None: ...
def quantize(
    policy: Policy, recordings: Any, heldout: Any, request: Dict[str, Any], progress: _Report
) -> Tuple[Image, Optional[float], List[str], List[str]]: ...
def evaluate(
    image: Image, recordings: Any, policy: Optional[Policy], progress: _Report
) -> Tuple[Dict[str, Any], Optional[str]]: ...
def stand_in(policy: Policy) -> Image: ...
def tune(
    policy: Policy,
    recordings: Any,
    heldout: Any,
    request: Dict[str, Any],
    rounds: int,
    rollout: Callable[[int, Image], Tuple[Any, str]],
    progress: _Report,
) -> Tuple[Image, List[Image], str, str, Optional[int], List[str]]: ...
