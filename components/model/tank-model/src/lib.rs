//! Model of a tank with pump, drain and level transmitter, as a component for plants without their hardware.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct TankModel {
    settings: logic::TankSettings,
    tank: logic::Tank,
}

#[latchwork_sdk::block("latchwork:device/tank-model")]
impl TankModel {
    fn defaults() -> Settings {
        let logic::TankSettings { height, area, inflow, outflow, leak, start } = logic::TankSettings::default();
        Settings { height, area, inflow, outflow, leak, start }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        let Settings { height, area, inflow, outflow, leak, start } = settings;
        let settings = logic::TankSettings { height, area, inflow, outflow, leak, start };
        settings.check()?;
        self.settings = settings;
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs) -> Outputs {
        let Inputs { pump, drain, line_break, spike } = inputs;
        let inputs = logic::TankInputs { pump, drain, line_break, spike };
        let logic::TankOutputs { level, level_m, volume, full, empty } =
            self.tank.execute(&self.settings, scan.elapsed, inputs);
        Outputs { level, level_m, volume, full, empty }
    }

    fn save(&self) -> Retained {
        Retained { level_m: self.tank.level.unwrap_or(self.settings.start) }
    }

    fn restore(&mut self, state: Retained) {
        self.tank.level = Some(state.level_m);
    }
}
