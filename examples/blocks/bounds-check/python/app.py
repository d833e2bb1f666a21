"""Bounds check with hysteresis."""
from math import isfinite, isnan

from componentize_py_types import Err
from wit_world.exports.bounds_check import Inputs, Outputs, Retained, Settings
from wit_world.imports.types import Scan


class Block:
    def __init__(self) -> None:
        self.settings = self.defaults()
        self.high = False
        self.low = False

    def defaults(self) -> Settings:
        return Settings(low_limit=10.0, high_limit=50.0, hysteresis=1.0)

    def configure(self, settings: Settings) -> None:
        if not isfinite(settings.low_limit):
            raise Err("low-limit must be a finite number")
        if not isfinite(settings.high_limit):
            raise Err("high-limit must be a finite number")
        if settings.low_limit >= settings.high_limit:
            raise Err("low-limit must be below high-limit")
        if not isfinite(settings.hysteresis) or settings.hysteresis < 0:
            raise Err("hysteresis must be a finite number, 0 or more")
        self.settings = settings

    def execute(self, scan: Scan, inputs: Inputs) -> Outputs:
        signal, s = inputs.signal, self.settings
        error = isnan(signal)
        if not error:
            above, below = signal > s.high_limit, signal < s.low_limit
            # Beyond one limit, the other flag goes whatever the hysteresis.
            self.high = above or (self.high and not below and signal >= s.high_limit - s.hysteresis)
            self.low = below or (self.low and not above and signal <= s.low_limit + s.hysteresis)
        return Outputs(high=self.high, low=self.low, error=error)

    def save(self) -> Retained:
        return Retained(high=self.high, low=self.low)

    def restore(self, state: Retained) -> None:
        self.high, self.low = state.high, state.low
