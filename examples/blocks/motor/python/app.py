"""A motor with a contactor: started and stopped by command, supervised by its feedback."""
from componentize_py_types import Err
from wit_world.exports.motor import Alarms, Commands, Inputs, Outputs, Retained, Settings
from wit_world.imports.types import Scan


class Block:
    def __init__(self) -> None:
        self.timeout = 0
        self.starts = 0
        self.hours = 0.0
        self.run = False
        self.alarms = Alarms(0)
        # How long the feedback has not been as `run` wants it, ns.
        self.waiting = 0

    def configure(self, settings: Settings) -> None:
        if settings.feedback_timeout.ns == 0:
            raise Err("feedback-timeout must be above 0")
        self.timeout = settings.feedback_timeout.ns

    def execute(self, scan: Scan, inputs: Inputs, commands: Commands) -> tuple[Outputs, Alarms]:
        if Commands.RESET in commands:
            self.alarms = Alarms(0)
        before = self.run
        if Commands.STOP in commands or not inputs.interlock:
            self.run = False
        elif Commands.START in commands and not self.run and not self.alarms:
            self.run = True
            self.starts += 1
        if self.run != before or self.run == inputs.feedback:
            self.waiting = 0
        else:
            self.waiting += scan.elapsed
        if self.waiting >= self.timeout:
            self.alarms |= Alarms.MISS_STARTING if self.run else Alarms.MISS_STOPPING
            self.run = False
            self.waiting = 0
        running = self.run and inputs.feedback
        if running:
            self.hours += scan.elapsed / 3.6e12
        return Outputs(run=self.run, running=running), self.alarms

    def save(self) -> Retained:
        return Retained(starts=self.starts, hours=self.hours)

    def restore(self, state: Retained) -> None:
        self.starts, self.hours = state.starts, state.hours
