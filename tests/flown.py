"""The WebAssembly module in wasmtime, as a page runs it: it lays out arrays and calls exports."""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
import wasmtime

from dess.analysis.wasm.image import EMPTY, Image, make_image
from dess.analysis.wasm.module import read_module
from dess.analysis.wasm.table import ARRAYS, WORDS
from dess.model.record import Records
from dess.scenario.scenario import ScenarioSpace


@cache
def compiled_module() -> tuple[wasmtime.Engine, wasmtime.Module]:
    """The module, compiled for this computer."""
    engine = wasmtime.Engine()
    return engine, wasmtime.Module(engine, read_module())


class Engine:
    """The module with the arrays of an image."""

    def __init__(self, image: Image):
        engine, module = compiled_module()
        self._store = wasmtime.Store(engine)
        self._exports = wasmtime.Instance(self._store, module, []).exports(self._store)
        self.lay_out(image)

    def call(self, name: str, *arguments: Any) -> Any:
        return self._exports[name](self._store, *arguments)

    def lay_out(self, image: Image) -> None:
        """Put the arrays of an image in the place of those before."""
        self.call("forget")
        self.image, self._places = image, {}
        table = np.zeros((len(ARRAYS), WORDS), np.int64)
        for row, (name, array) in zip(table, image.arrays.items(), strict=True):
            row[0] = self._places[name] = self.call("reserve", float(array.nbytes))
            row[1 : 1 + array.ndim] = array.shape
            if name not in EMPTY or name == "operations":
                self.write(name, array)
        self._exports["memory"].write(self._store, table.tobytes(), self.call("arrays"))
        self.call("prepare")

    def write(self, name: str, array: np.ndarray) -> None:
        self._exports["memory"].write(self._store, array.tobytes(), self._places[name])

    def read(self, name: str) -> np.ndarray:
        like = self.image.arrays[name]
        end = self._places[name] + like.nbytes
        content = self._exports["memory"].read(self._store, self._places[name], end)
        return np.frombuffer(bytes(content), like.dtype).reshape(like.shape)

    def memory_size(self) -> int:
        """The memory of the module [64 KiB]."""
        return self._exports["memory"].size(self._store)

    def records(self) -> Records:
        return Records(*map(self.read, ("mission_records", "uav_records", "operations")))


def fly(space: ScenarioSpace, team: Sequence[str], seed: int, missions: int) -> Records:
    """The records of replications 0, 1, ... as the module writes them."""
    engine = Engine(make_image(space, team, seed, missions))
    assert engine.call("play", 0.0, missions) == missions
    return engine.records()
