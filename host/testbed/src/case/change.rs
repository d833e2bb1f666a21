//! What happens between two executions: settings, a restart, the next version.

use super::model::{Step, Subject, Takeover};
use super::run::Run;
use super::verdict::{Trouble, told};
use latchwork_block::Class;
use latchwork_block::upgrade::Transfer;

impl<'a> Run<'a> {
    /// Everything that happens before the execution.
    pub(super) fn change(&mut self, step: &'a Step) -> Result<(), Trouble> {
        match &step.takeover {
            Takeover::None => {}
            Takeover::Restart => self.restart()?,
            Takeover::Swap { to, lossy } => {
                // A version that cannot even start takes nothing over: the one before goes on.
                return self.swap(to, *lossy, &step.settings).map_err(|trouble| match trouble {
                    Trouble::Fault(fault) => Trouble::Refused(told(&fault)),
                    refused => refused,
                });
            }
        }
        if step.settings.is_empty() {
            return Ok(());
        }
        let mut settings = self.settings.clone();
        step.settings.iter().for_each(|(i, cell)| settings[*i] = *cell);
        let Some(instance) = &mut self.instance else { return Ok(()) };
        instance.configure(&settings)?.map_err(Trouble::Refused)?;
        self.settings = settings;
        Ok(())
    }

    /// As when a plant stops and starts: what is retained is kept, all else begins anew.
    fn restart(&mut self) -> Result<(), Trouble> {
        let state = match &mut self.instance {
            Some(instance) => instance.save()?,
            None => None,
        };
        let settings: Vec<_> = self.settings.iter().copied().map(Some).collect();
        let state = state.map(|s| s.into_iter().map(Some).collect::<Vec<_>>());
        self.first = state.is_none();
        self.instance(&settings, state.as_deref())?;
        let results = self.ins.len()..;
        self.cells[results].fill(0);
        self.history.clear();
        (self.last, self.elapsed) = (None, 0);
        Ok(())
    }

    /// The next version takes over between two executions; where a fault has left none before it, it starts cold.
    fn swap(&mut self, to: &'a Subject, lossy: bool, settings: &[(usize, u64)]) -> Result<(), Trouble> {
        let (from, class) = (&self.subject.class, &to.class);
        let saved = match &mut self.instance {
            Some(old) => old.save()?,
            None => None,
        };
        let mut new = to.template.instantiate(&self.limits)?;
        let mut cells = new.defaults()?.unwrap_or_else(|| vec![0; class.settings.len()]);
        carry(&from.settings, &class.settings, lossy, &self.settings, &mut cells, "setting", settings)?;
        settings.iter().for_each(|(i, cell)| cells[*i] = *cell);
        new.configure(&cells)?.map_err(Trouble::Refused)?;
        let carried = match saved.zip(new.save()?) {
            Some((saved, mut state)) => {
                carry(&from.retained, &class.retained, lossy, &saved, &mut state, "retained field", &[])?;
                new.restore(&state)?;
                true
            }
            None => false,
        };
        let arguments = inputs_of(from, class, &self.cells);
        self.close();
        self.history.clear();
        (self.instance, self.settings, self.first) = (Some(new), cells, !carried);
        if !carried {
            (self.last, self.elapsed) = (None, 0);
        }
        self.subject = to;
        self.lay_out();
        self.cells[..arguments.len()].copy_from_slice(&arguments);
        Ok(())
    }
}

/// Cells that go over by name and type. A field that is `given` a value loses nothing.
fn carry(
    from: &[latchwork_block::Port],
    to: &[latchwork_block::Port],
    lossy: bool,
    old: &[u64],
    new: &mut [u64],
    what: &str,
    given: &[(usize, u64)],
) -> Result<(), Trouble> {
    let transfer = Transfer::new(from, to, lossy);
    let given = |name: &str| given.iter().any(|(at, _)| to[*at].path == name);
    let refused: Vec<_> = transfer.refused().filter(|f| !given(&f.name)).map(|f| format!("`{}`", f.name)).collect();
    if !refused.is_empty() {
        let fields = refused.join(", ");
        return Err(Trouble::Refused(format!(
            "{what} {fields} would lose something in its new type; allow-lossy clamps it"
        )));
    }
    transfer.apply(old, new);
    Ok(())
}

/// Inputs go over where name and type are the same; a signal that was none before is good, any other begins with 0.
fn inputs_of(from: &Class, to: &Class, cells: &[u64]) -> Vec<u64> {
    let mut arguments = vec![0; to.argument_cells()];
    let mut at = 0;
    for port in &to.inputs {
        let mut old = 0;
        for other in &from.inputs {
            if other.path == port.path && other.ty == port.ty {
                arguments[at] = cells[old];
                if port.signal && other.signal {
                    arguments[at + 1] = cells[old + 1];
                }
            }
            old += 1 + usize::from(other.signal);
        }
        at += 1 + usize::from(port.signal);
    }
    arguments
}
