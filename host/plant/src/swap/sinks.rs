//! Swaps of sinks of kind `component`: their own threads exchange them between two batches; here are orders, records and state.

use super::save::Keep;
use super::saving::{Objection, Saving};
use super::{BlockPlan, Stage, SwapOrder, SwapStatus, Version};
use crate::assemble::Plant;
use crate::operate::{Answer, Operator, Refused};
use latchwork_record::Kind;
use latchwork_sink::{Exchange, Phase, Swapper};

/// Beginning of the names of sinks.
pub(super) const SINK: &str = "sink.";
/// What every logger is.
const CLASS: &str = "latchwork:journal/sink@0.1.0";
/// Priority of the record of a version that has failed.
const FAILED: u8 = 128;

/// A swap of a sink under way.
pub(super) struct SinkSwap {
    pub(super) status: SwapStatus,
    /// `sink.NAME`
    pub(super) name: String,
    operator: Operator,
    exchange: Exchange,
    /// What runs, until there is a plan.
    old: Option<latchwork_sink::Version>,
    /// What is wrong with saving it, if only a plan is wanted.
    note: std::sync::Arc<std::sync::OnceLock<String>>,
    /// Plant time of the order, ns.
    asked: u64,
    /// With `--save`.
    keep: Option<Keep>,
    saving: Option<Saving>,
    /// Only its plan was wanted: nothing of it is on record.
    dry_run: bool,
    /// It takes back another one, which is on probation.
    takes_back: bool,
    /// It brings an earlier version.
    back: bool,
}

impl SinkSwap {
    /// Where it is, as the status of its sink says it.
    pub(super) fn state(&self) -> &'static str {
        match self.status.stage {
            _ if self.saving.is_some() => "saving",
            Stage::Probation => "probation",
            Stage::Exchanging => "exchanging",
            _ => "preparing",
        }
    }
}

impl Plant {
    /// The sinks that swaps may exchange: those that are at work.
    pub fn serve_sinks(&mut self, swapper: Swapper) {
        self.swaps.sinks = Some(swapper);
        self.know_loggers();
    }

    /// Takes an order about a sink.
    pub(super) fn swap_sink(&mut self, order: &SwapOrder, operator: &Operator, now: u64) -> Result<Answer, Refused> {
        let [part] = &order.parts[..] else {
            return Err(Refused::new("value", "a sink is swapped alone, not together with blocks or other sinks"));
        };
        let refused = |what: &str| Err(Refused::new("value", format!("`{}` is a sink: {what}", part.block)));
        if order.shadow > 0 || !order.tolerances.is_empty() {
            return refused("it has no outputs that a shadow could compare; leave --shadow and --tolerance out");
        }
        if !part.settings.is_empty() {
            return refused("its table in the plant file is its configuration; leave --set out");
        }
        let (swapper, sink) = self.sink(&part.block)?;
        let old = swapper.version(sink);
        part.takes_place_of(old.as_ref().map_or("", |v| &v.hash))?;
        part.not_too_large()?;
        self.has_workers()?;
        let (exchange, preparation) = swapper
            .swap(sink, &part.file, &part.bytes, order.probation, order.dry_run)
            .map_err(|why| Refused::new("state", why))?;
        let mut swap = self.sink_swap(&part.block, exchange, operator, now);
        let trial = order.save.then(|| self.trial(vec![Keep::of(part)], order.dry_run));
        let (engine, note) = (self.engine.clone(), std::sync::Arc::clone(&swap.note));
        let work = move || match trial.map(|trial| trial.run(&engine)) {
            Some(Err(Objection::Stops(why))) => preparation.refuse(why),
            Some(Err(Objection::Note(found))) => {
                // It is there before the plan is.
                let _ = note.set(found);
                preparation.run();
            }
            Some(Ok(())) | None => preparation.run(),
        };
        // One that is not taken up ends its exchange.
        self.swaps.workers.spawn(work).map_err(|why| Refused::new("busy", why))?;
        swap.dry_run = order.dry_run;
        swap.old = old;
        if order.save && !order.dry_run {
            swap.keep = Some(Keep::of(part));
        }
        if !order.dry_run {
            let was = version(swap.old.clone()).short();
            self.tell_asked_of_sink(&swap, &format!("{was} → {}", part.file), now);
        }
        Ok(self.follow_sink(swap))
    }

    /// Puts an earlier version of a sink back.
    pub(super) fn rollback_sink(
        &mut self,
        name: &str,
        steps: u64,
        operator: &Operator,
        now: u64,
    ) -> Result<Answer, Refused> {
        let (swapper, sink) = self.sink(name)?;
        let steps = usize::try_from(steps).unwrap_or(usize::MAX);
        let (old, new) = (swapper.version(sink), swapper.earlier(sink, steps));
        let exchange = swapper.rollback(sink, steps).map_err(|why| Refused::new("state", why))?;
        let takes_back = matches!(exchange.phase(), Phase::Probation { .. });
        let mut swap = self.sink_swap(name, exchange, operator, now);
        (swap.takes_back, swap.back) = (takes_back, true);
        let (was, comes) = (version(old.clone()).short(), version(new.clone()).short());
        swap.status.blocks.push(plan(name, old, new, vec!["it goes on where the cursor stands".into()]));
        self.tell_asked_of_sink(&swap, &format!("{was} → {comes}; {}", versions_back(steps)), now);
        Ok(self.follow_sink(swap))
    }

    fn sink<'a>(&self, name: &'a str) -> Result<(Swapper, &'a str), Refused> {
        let sink = name.strip_prefix(SINK).unwrap_or(name);
        let missing =
            || Refused::new("state", "the sinks do not work: they read the journal; run the plant with --data DIR");
        let swapper = self.swaps.sinks.clone().ok_or_else(missing)?;
        if !swapper.names().any(|n| n == sink) {
            let near = latchwork_image::nearest(sink, swapper.names());
            let hint = near.map(|n| format!("; did you mean `{SINK}{n}`?")).unwrap_or_default();
            return Err(Refused::new("unknown", format!("there is no sink `{sink}`{hint}")));
        }
        Ok((swapper, sink))
    }

    fn sink_swap(&mut self, name: &str, exchange: Exchange, operator: &Operator, now: u64) -> SinkSwap {
        let status = self.swap_status(operator, now);
        SinkSwap {
            status,
            name: name.into(),
            operator: operator.clone(),
            exchange,
            old: None,
            note: Default::default(),
            asked: now,
            keep: None,
            saving: None,
            dry_run: false,
            takes_back: false,
            back: false,
        }
    }

    fn follow_sink(&mut self, swap: SinkSwap) -> Answer {
        let answer = Answer::Swap(Box::new(swap.status.clone()));
        self.swaps.of_sinks.push(swap);
        answer
    }

    /// What their threads have done meanwhile.
    pub(super) fn sinks_turn(&mut self, now: u64) {
        for swap in std::mem::take(&mut self.swaps.of_sinks) {
            if let Some(swap) = self.sink_step(swap, now) {
                self.swaps.of_sinks.push(swap);
            }
        }
    }

    fn sink_step(&mut self, mut swap: SinkSwap, now: u64) -> Option<SinkSwap> {
        if swap.saving.is_some() {
            return self.sink_saved(swap, now);
        }
        let phase = swap.exchange.phase();
        let comes = swap.exchange.version().filter(|_| swap.status.blocks.is_empty() && phase != Phase::Preparing);
        if let Some(new) = comes {
            let mut notes = vec!["its cursor stays where it is: each record comes at least once from there".to_owned()];
            notes.extend(swap.note.get().cloned());
            swap.status.blocks.push(plan(&swap.name, swap.old.take(), Some(new), notes));
        }
        if swap.status.stage == Stage::Preparing && phase != Phase::Preparing {
            swap.status.prepare_ns = now.saturating_sub(swap.asked);
        }
        let (stage, why) = match phase {
            Phase::Preparing => (Stage::Preparing, String::new()),
            Phase::Waiting | Phase::Opening => (Stage::Exchanging, String::new()),
            Phase::Probation { .. } if swap.takes_back => (Stage::Exchanging, String::new()),
            Phase::Probation { left } => {
                swap.status.left = left;
                (Stage::Probation, String::new())
            }
            Phase::Planned => (Stage::Planned, String::new()),
            Phase::RolledBack(_) if swap.takes_back => (Stage::Done, String::new()),
            Phase::Done if swap.takes_back => (Stage::Refused, "its probation has ended in the same moment".into()),
            Phase::Done => (Stage::Done, String::new()),
            Phase::Refused(why) => (Stage::Refused, why),
            Phase::RolledBack(why) => (Stage::RolledBack, why),
            Phase::Cancelled => (Stage::Cancelled, format!("called off by {}", swap.operator.user)),
        };
        let went_in = matches!(stage, Stage::Probation | Stage::Done | Stage::RolledBack);
        if went_in && swap.status.exchanged_at == 0 {
            swap.status.exchanged_at = now;
            let hash = swap.status.blocks.first().map(|plan| plan.new.hash.clone()).unwrap_or_default();
            let brought = (!swap.back).then(|| (hash, swap.operator.user.clone()));
            self.logger_changed(&swap.name, brought, now);
            // One that goes back is told of as such, when it is there.
            if !swap.back {
                self.tell_of_sink(&swap, "exchanged", "between two batches", now);
            }
        }
        (swap.status.stage, swap.status.message) = (stage, why);
        if !stage.ended() {
            return Some(swap);
        }
        swap.status.left = 0;
        let why = swap.status.message.clone();
        match stage {
            _ if swap.dry_run => {}
            Stage::Done if swap.back => self.tell_of_sink(&swap, "rolled-back", "between two batches", now),
            Stage::Done => self.tell_of_sink(&swap, "kept", "", now),
            Stage::Refused => self.tell_of_sink(&swap, "refused", &why, now),
            Stage::RolledBack => {
                self.logger_changed(&swap.name, None, now);
                self.tell_of_sink(&swap, "rolled-back", &why, now);
            }
            Stage::Cancelled => self.tell_of_sink(&swap, "cancelled", "called off before the exchange", now),
            _ => {}
        }
        if let (Stage::Done, Some(keep)) = (stage, swap.keep.take()) {
            let (saver, engine) = (self.saver(), self.engine.clone());
            swap.saving = Some(self.swaps.save(saver, engine, vec![keep], self.time));
            swap.status.stage = Stage::Probation;
            return self.sink_saved(swap, now);
        }
        self.swaps.over(swap.status);
        None
    }

    fn sink_saved(&mut self, mut swap: SinkSwap, now: u64) -> Option<SinkSwap> {
        match swap.saving.as_mut().and_then(Saving::result) {
            None => return Some(swap),
            Some(Ok(sentences)) => {
                swap.status.saved = true;
                let hash = swap.status.blocks.first().map(|plan| plan.new.hash.clone()).unwrap_or_default();
                self.logger_saved(&swap.name, hash);
                self.tell_of_sink(&swap, "saved", &sentences.join("; "), now);
            }
            Some(Err(why)) => {
                self.tell_of_sink(&swap, "not-saved", &why, now);
                swap.status.message = format!("the new version stays, but it was not saved: {why}");
            }
        }
        swap.status.stage = Stage::Done;
        self.swaps.over(swap.status);
        None
    }

    /// Calls the swap of a sink off; `None` if it is none.
    pub(super) fn cancel_sink(
        &mut self,
        number: u64,
        operator: &Operator,
        now: u64,
    ) -> Option<Result<Answer, Refused>> {
        let swap = self.swaps.of_sinks.iter_mut().find(|s| s.status.number == number)?;
        let prepares = swap.exchange.phase() == Phase::Preparing;
        Some(if !swap.takes_back && swap.exchange.cancel() {
            swap.operator = operator.clone();
            if prepares {
                self.swaps.workers.leave();
            }
            // Its end is known and on record at once.
            self.sinks_turn(now);
            Ok(Answer::Done { done: vec![format!("swap {number} is called off")] })
        } else {
            let message = format!("swap {number} is in its sink already; take it back with `rollback {}`", swap.name);
            Err(Refused::new("state", message))
        })
    }

    /// An order: what is to run.
    fn tell_asked_of_sink(&mut self, swap: &SinkSwap, what: &str, at: u64) {
        self.tell_text_of_sink(swap, "asked", format!(": {what}"), "", at);
    }

    fn tell_of_sink(&mut self, swap: &SinkSwap, transition: &'static str, what: &str, at: u64) {
        let versions = swap.status.blocks.iter().map(|plan| match plan.new.hash.is_empty() {
            true => format!(": {}", plan.old.short()),
            false => format!(": {} → {}", plan.old.short(), plan.new.short()),
        });
        self.tell_text_of_sink(swap, transition, versions.collect(), what, at);
    }

    fn tell_text_of_sink(&mut self, swap: &SinkSwap, transition: &'static str, head: String, what: &str, at: u64) {
        let mut draft = Self::did(at, Kind::Swap, &swap.name, transition, &swap.operator);
        let remark = std::mem::take(&mut draft.text);
        draft.text = format!("swap {}{head}", swap.status.number);
        for more in [what, &remark].into_iter().filter(|t| !t.is_empty()) {
            draft.text += &format!("; {more}");
        }
        if matches!(swap.status.stage, Stage::RolledBack) {
            draft.priority = FAILED;
        }
        self.tell(draft, Vec::new());
    }
}

fn versions_back(steps: usize) -> String {
    if steps == 1 { "the version before".into() } else { format!("{steps} versions back") }
}

fn version(of: Option<latchwork_sink::Version>) -> Version {
    let of = of.unwrap_or_default();
    Version {
        component: of.component,
        hash: of.hash,
        size: of.size,
        class: CLASS.into(),
        imports: of.imports,
        path: "component".into(),
    }
}

fn plan(
    name: &str,
    old: Option<latchwork_sink::Version>,
    new: Option<latchwork_sink::Version>,
    notes: Vec<String>,
) -> BlockPlan {
    BlockPlan {
        block: name.into(),
        old: version(old),
        new: version(new),
        ports: Vec::new(),
        state: Vec::new(),
        settings: Vec::new(),
        broken: Vec::new(),
        notes,
    }
}
