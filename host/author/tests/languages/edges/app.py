"""Whole numbers at their edges."""
from wit_world.exports.edges import Ask, Inputs, Outputs, Retained, Settings, Upper, Whole
from wit_world.imports.types import Scan

LEAST = Whole(b=0, c=-(2**7), d=0, e=-(2**15), f=0, g=-(2**31), h=0, i=-(2**63))
MOST = Whole(
    b=2**8 - 1, c=2**7 - 1, d=2**16 - 1, e=2**15 - 1, f=2**32 - 1, g=2**31 - 1, h=2**64 - 1, i=2**63 - 1
)
TOO_MUCH = Whole(b=0, c=0, d=0, e=0, f=2**32, g=0, h=0, i=0)


class Block:
    def __init__(self) -> None:
        self.settings = Settings(whole=LEAST)
        self.kept = LEAST

    def configure(self, settings: Settings) -> None:
        self.settings = settings

    def execute(self, scan: Scan, inputs: Inputs) -> Outputs:
        w = inputs.whole
        upper = Upper(
            b=w.b >= 2**7, c=w.c < 0, d=w.d >= 2**15, e=w.e < 0, f=w.f >= 2**31, g=w.g < 0, h=w.h >= 2**63, i=w.i < 0
        )
        if inputs.ask == Ask.ECHO:
            self.kept = w
        made = {Ask.LEAST: LEAST, Ask.MOST: MOST, Ask.SETTINGS: self.settings.whole, Ask.TOO_MUCH: TOO_MUCH}
        return Outputs(whole=made.get(inputs.ask, self.kept), upper=upper)

    def save(self) -> Retained:
        return Retained(whole=self.kept)

    def restore(self, state: Retained) -> None:
        self.kept = state.whole
