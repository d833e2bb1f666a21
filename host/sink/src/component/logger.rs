//! A logger as a sink: thrown away when it fails, made and opened anew at the next write.

use super::bindings::Digits;
use super::grants::Grants;
use super::host::{Host, Running};
use crate::Sink;
use latchwork_record::Record;

/// A sink whose records go into a component.
pub(super) struct Logger {
    // Before the host: what an instance has open is closed while there is something to close it with.
    running: Option<Running>,
    host: Host,
}

impl Logger {
    /// With what the plant file grants. The component is compiled and opened at the first write.
    pub(super) fn new(grants: Grants) -> Result<Self, String> {
        Ok(Self { running: None, host: Host::new(grants)? })
    }
}

impl Sink for Logger {
    fn prepare(&mut self) -> Result<(), String> {
        self.host.compile()
    }

    fn start(&mut self) -> Result<(), String> {
        self.running = None;
        self.running = Some(self.host.start()?);
        Ok(())
    }

    fn close(&mut self) {
        self.running = None;
    }

    fn write(&mut self, batch: &[Record]) -> Result<u64, String> {
        let Some(last) = batch.last().map(|r| r.seq) else { return Ok(0) };
        // Whatever fails from here on leaves no instance behind.
        let mut running = match self.running.take() {
            Some(running) => running,
            None => self.host.start()?,
        };
        let digits = Digits::of(batch);
        let kept = self.host.write(&mut running, &digits.entries(batch))?;
        if kept > last {
            return Err(format!(
                "the logger says that it keeps record {kept}, but {last} is the last that it was offered"
            ));
        }
        self.running = Some(running);
        Ok(kept)
    }
}
