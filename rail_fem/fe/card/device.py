"""The graphics card: whether there is one, what it is, arrays on it and back, a step's launches recorded as one.

Imported only where a card is asked for. NUMBA_ENABLE_CUDASIM=1 in the environment has the processor simulate one,
thread by thread: for tests.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import config, cuda

SIMULATED = bool(config.ENABLE_CUDASIM)
# the arrays of contact are more than the 4 kB of arguments that older drivers take
HOW_TO_GET = "pip install '.[cuda]' beside an NVIDIA card and a driver of CUDA 12.1 or newer, or device = \"cpu\""
# compute capabilities whose double precision is half of the single; all others have a 32nd or a 64th
FULL_DOUBLE = {(6, 0), (7, 0), (8, 0), (9, 0), (10, 0)}


class CardFacts(NamedTuple):
    """Name, compute capability, release of CUDA that the driver has, memory in all and free [B]."""

    name: str
    capability: tuple
    driver: str
    memory: int
    free: int

    @property
    def double_words(self) -> str:
        """What double precision costs there."""
        if self.capability in FULL_DOUBLE:
            return "double precision at half the single rate"
        return "double precision at 1/64 of the single rate (a consumer card): slow, but as exact"


def missing() -> str:
    """Why there is no card to compute on, a sentence; empty where there is one."""
    if SIMULATED:
        return ""
    try:
        found = cuda.is_available()
    except Exception as error:  # a driver that is broken in whatever way is no driver
        return f"no card: {error}: {HOW_TO_GET}"
    return "" if found else f"no card that CUDA can use was found: {HOW_TO_GET}"


def card_facts() -> CardFacts:
    """Of the card in use. Errors: RuntimeError where there is none."""
    if why := missing():
        raise RuntimeError(why)
    if SIMULATED:
        return CardFacts("simulated on the processor", (0, 0), "none", 0, 0)
    device, version = cuda.get_current_device(), cuda.runtime.get_version()
    free, total = cuda.current_context().get_memory_info()
    name = device.name.decode() if isinstance(device.name, bytes) else str(device.name)
    return CardFacts(name, tuple(device.compute_capability), ".".join(map(str, version)), int(total), int(free))


def up(item: Any) -> Any:
    """A copy on the card of an array, or of all arrays of a NamedTuple of any depth; what else is there stays."""
    if isinstance(item, tuple):
        return type(item)(*map(up, item))
    if not isinstance(item, np.ndarray):
        return item
    array = np.ascontiguousarray(item)
    if SIMULATED:
        return array.copy()
    return cuda.to_device(array if array.size else np.zeros((1, *array.shape[1:]), array.dtype))[: len(array)]


def down(on_card: Any, array: np.ndarray) -> None:
    """The card's array into `array`."""
    if array.size:
        array[...] = on_card if SIMULATED else on_card.copy_to_host()


def put(array: np.ndarray, on_card: Any) -> None:
    """`array` into the card's, of the same shape."""
    if array.size:
        if SIMULATED:
            on_card[...] = array
        else:
            on_card.copy_to_device(np.ascontiguousarray(array))


class Launches:
    """What a step launches, one after another on one stream; recorded once and started as one (a CUDA graph), where the
    driver can. Arguments are the same every time: what changes from step to step lies on the card."""

    records = not SIMULATED  # until a recording fails

    def __init__(self, launch: Callable[[Any], None]):
        self.launch, self.warm = launch, False
        self.graph: Callable[[], None] | None = None
        self.stream: Any = None if SIMULATED else cuda.stream()

    def start(self) -> None:
        """Start a step. The first is launched one by one, which compiles; the second is recorded."""
        if self.warm and self.graph is None and Launches.records:
            try:
                self.graph = recorded(self.stream, self.launch)
            except Exception as error:  # of whatever kind: launched one by one they are as right, and slower
                Launches.records, self.stream = False, cuda.stream()
                warnings.warn(f"steps are launched kernel by kernel: {error}", RuntimeWarning, stacklevel=2)
        if self.graph is None:
            self.launch(self.stream)
        else:
            self.graph()
        self.warm = True

    def wait(self) -> None:
        """Until all is done."""
        if not SIMULATED:
            self.stream.synchronize()


def recorded(stream: Any, launch: Callable[[Any], None]) -> Callable[[], None]:
    """Starts what is launched on this stream, a recorded CUDA graph by cuda-python's driver interface. Errors:
    ImportError without cuda-python, RuntimeError where the driver refuses."""
    from cuda.bindings import driver

    def checked(answer: tuple) -> Any:
        if int(answer[0]) != 0:
            raise RuntimeError(f"the card refused a step: {answer[0]}")
        return answer[-1]

    handle = driver.CUstream(int(getattr(stream.handle, "value", stream.handle)))
    mode = driver.CUstreamCaptureMode.CU_STREAM_CAPTURE_MODE_THREAD_LOCAL
    checked(driver.cuStreamBeginCapture(handle, mode))
    launch(stream)
    graph = checked(driver.cuGraphInstantiate(checked(driver.cuStreamEndCapture(handle)), 0))
    return lambda: checked(driver.cuGraphLaunch(graph, handle))
