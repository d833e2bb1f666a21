"""Asks Python's library for the time, and for random numbers."""
import random
import time

from wit_world.exports.asking import Inputs, Outputs
from wit_world.imports.types import Scan


class Block:
    def execute(self, scan: Scan, inputs: Inputs) -> Outputs:
        now = time.time_ns() if inputs.time else 0
        return Outputs(now=now, random=random.getrandbits(32) if inputs.random else 0)
