//! SIGKILL in the middle of swaps, of their saves and of retained saves, hundreds of times: the next start runs the old version
//! or the new one, never half of either, and goes on from a state that was kept.
//!
//! Several plants are killed side by side. The moments are drawn from a seed that is printed; `LATCHWORK_KILLS` makes more of
//! them, `LATCHWORK_KILLS_SEED` those of an earlier run.

use crate::support::{LONG, target};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use latchwork_api::client::Client;
use latchwork_block::Component;
use latchwork_record::Record;
use latchwork_record::journal::{Filter, Reader};
use latchwork_retain::{Found, read};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Kills of all plants together.
const KILLS: u64 = 400;
/// Plants that are killed side by side.
const PLANTS: u64 = 4;
/// Time for a kill, of which it needs a third on two cores: a slow machine makes fewer, but no fewer than a quarter.
const EACH: Duration = Duration::from_millis(200);
/// Versions that there are: each is compiled once, as long as the cache is kept.
const VERSIONS: usize = 5;
/// Most executions of a shadow, and of a probation.
const EXECUTIONS: u64 = 6;
/// How often the disk is looked at for the moment to kill.
const LOOK: Duration = Duration::from_micros(200);

/// Xorshift: moments that are spread over the whole way, the same for the same seed.
struct Dice(u64);

impl Dice {
    fn new(seed: u64) -> Self {
        // Neighbours must not begin alike, and none may be 0.
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) % end.max(1)
    }

    fn span(&mut self, end: Duration) -> Duration {
        Duration::from_micros(self.below(end.as_micros() as u64))
    }
}

/// When a plant is killed.
enum Moment {
    /// So long after the order.
    After(Duration),
    /// So long after the first file of a save is there.
    Save(Duration),
    /// So long after the order, then after the next retained save.
    Retain(Duration, Duration),
}

/// What is ordered.
struct Order {
    name: String,
    body: Value,
    save: bool,
}

/// A plant that is killed and comes back.
struct Victim {
    folder: TempDir,
    child: Child,
    client: Client,
    /// Components by name.
    versions: BTreeMap<String, Vec<u8>>,
}

impl Drop for Victim {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn launch(folder: &Path) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_latchwork"));
    command.current_dir(folder).env("LATCHWORK_CACHE", target().join("test-cache"));
    command.args(["run", "plant.toml", "--quiet", "--for", "10m", "--data", "data", "--socket", "run/plant.sock"]);
    let errors = std::fs::File::create(folder.join("errors")).expect("a file");
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(errors).spawn().expect("it starts")
}

/// Waits for something, for a bounded time.
#[track_caller]
fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + LONG;
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(Instant::now() < end, "{what}");
        std::thread::sleep(LOOK);
    }
}

impl Victim {
    /// Started, with the first version.
    fn new() -> Self {
        let shipped = target().join("test-components/keeper-probe.wasm");
        let bytes =
            std::fs::read(&shipped).unwrap_or_else(|e| panic!("{}: {e}: run `cargo xtask guests`", shipped.display()));
        let folder = TempDir::new().expect("a folder");
        let versions: BTreeMap<_, _> = (0..VERSIONS)
            .map(|n| {
                let name = format!("keeper-{n}");
                // A section that means nothing makes it another component.
                let section = [&[0, name.len() as u8 + 2, 1, b'v'], name.as_bytes()].concat();
                (name, [bytes.clone(), section].concat())
            })
            .collect();
        let text = "[plant]\nname = \"killed\"\ncomponents = [\"own\"]\n[retain]\nevery = \"20ms\"\n\
                    [journal]\nwithin = \"1ms\"\n[lane.main]\nevery = \"20ms\"\nwatchdog = \"20s\"\n\
                    [block.unit]\ncomponent = \"keeper-0\"\nlane = \"main\"\nbudget = \"5s\"\nretain = true\n\
                    inputs.count = true\n";
        std::fs::write(folder.path().join("plant.toml"), text).expect("the plant file");
        std::fs::create_dir(folder.path().join("own")).expect("a folder");
        std::fs::write(folder.path().join("own/keeper-0.wasm"), &versions["keeper-0"]).expect("a component");
        let client = Client::new(&folder.path().join("run/plant.sock"), "cli").expect("a client");
        let mut victim = Self { child: launch(folder.path()), folder, client, versions };
        victim.until_it_answers();
        // The guest does not take a state of 13 executions, which is another test's matter.
        until("it does not count on", || (victim.count() > 13).then_some(()));
        victim
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn text(&self) -> String {
        std::fs::read_to_string(self.path("plant.toml")).expect("the plant file")
    }

    fn kept(&self) -> Found {
        read(&self.path("data"))
    }

    fn until_it_answers(&mut self) {
        let Self { child, client, folder, .. } = self;
        until("it does not answer", || {
            let status = child.try_wait().expect("its state");
            let errors = || std::fs::read_to_string(folder.path().join("errors")).unwrap_or_default();
            assert!(status.is_none(), "it has ended, {status:?}: {}", errors());
            client.get::<Value>("/v1/status", &[]).ok()
        });
    }

    /// What the status says of the block.
    fn row(&self) -> Value {
        let status: Value = self.client.get("/v1/status", &[]).expect("a status");
        status["blocks"][0].clone()
    }

    /// The first count that it shows: 0 is what stands there before its first execution.
    fn count(&self) -> u64 {
        until("it does not count", || {
            let rows: Value = self.client.get("/v1/tags", &[("match", "unit.outputs.count")]).expect("a tag");
            let value = &rows[0]["value"];
            value.as_u64().or_else(|| value.as_str()?.parse().ok()).filter(|count| *count > 0)
        })
    }

    fn order(&self, dice: &mut Dice, runs: &str, most: bool) -> Order {
        let names: Vec<_> = self.versions.keys().filter(|n| *n != runs).collect();
        let name = names[dice.below(names.len() as u64) as usize].clone();
        let mut some = |end: u64| if most { end } else { dice.below(end + 1) };
        let (save, shadow, probation) = (some(3) > 0, some(EXECUTIONS), some(EXECUTIONS));
        let block = json!({
            "block": "unit", "file": format!("{name}.wasm"), "component": BASE64_STANDARD.encode(&self.versions[&name]),
        });
        let body = json!({ "blocks": [block], "shadow": shadow, "probation": probation, "save": save });
        Order { name, body, save }
    }

    /// How long an order takes that nobody disturbs, at most.
    fn undisturbed(&self, dice: &mut Dice) -> Duration {
        let order = self.order(dice, "keeper-0", true);
        let begun = Instant::now();
        let swap: Value =
            self.client.upload("/v1/swaps", serde_json::to_vec(&order.body).expect("JSON")).expect("a swap");
        let path = format!("/v1/swaps/{}", swap["number"]);
        let end = until("the swap does not end", || {
            let swap: Value = self.client.get(&path, &[]).expect("the swap");
            ["done", "refused", "rolled-back"].contains(&swap["stage"].as_str()?).then_some(swap)
        });
        assert!(end["stage"] == "done" && end["saved"] == true, "{end}");
        let took = begun.elapsed();
        until("it is not on record", || self.records(0).iter().any(|r| r.transition == "saved").then_some(()));
        took
    }

    /// Gives an order and kills the plant at that moment; what was kept just before.
    fn kill(&mut self, order: &Order, moment: &Moment) -> Found {
        let (socket, body) = (self.path("run/plant.sock"), serde_json::to_vec(&order.body).expect("JSON"));
        let before = self.text();
        // It goes down with the plant.
        let sent = std::thread::spawn(move || {
            Client::new(&socket, "cli").is_ok_and(|client| client.upload::<Value>("/v1/swaps", body).is_ok())
        });
        match moment {
            Moment::After(wait) => std::thread::sleep(*wait),
            Moment::Save(wait) => {
                let beside = self.path("own").join(format!(".{}.wasm.saving", order.name));
                let there = self.path("own").join(format!("{}.wasm", order.name));
                let begun = || (beside.exists() || there.exists() || self.text() != before).then_some(());
                until("nothing is saved", begun);
                std::thread::sleep(*wait);
            }
            Moment::Retain(first, then) => {
                std::thread::sleep(*first);
                let last = self.kept().generation;
                until("nothing is retained", || (self.kept().generation > last).then_some(()));
                std::thread::sleep(*then);
            }
        }
        let kept = self.kept();
        self.child.kill().expect("it is ours");
        self.child.wait().expect("it ends");
        let _heard = sent.join().expect("no panic");
        kept
    }

    /// Nothing on the disk is half of anything, and the plant file is one of two; whether it is the new one.
    fn whole(&self, n: u64, order: &Order, old: &str, before: &str) -> bool {
        let after = self.text();
        let of_new = before.replace(&format!("component = \"{old}\""), &format!("component = \"{}\"", order.name));
        let is_new = after == of_new;
        assert!(is_new && order.save || after == before, "{n}: {after}");
        let named = if is_new { order.name.as_str() } else { old };
        assert!(self.path("own").join(format!("{named}.wasm")).exists(), "{n}: {named} is named and not there");
        for file in std::fs::read_dir(self.path("own")).expect("the folder").flatten() {
            let (path, name) = (file.path(), file.file_name().into_string().expect("text"));
            let Some(name) = name.strip_suffix(".wasm") else { continue };
            assert!(std::fs::read(&path).expect("a component") == self.versions[name], "{n}: half of {name}");
            if name != named {
                // So that the next one that brings it writes it.
                std::fs::remove_file(path).expect("it is ours");
            }
        }
        is_new
    }

    fn records(&self, after: u64) -> Vec<Record> {
        let reader = Reader::open(&self.path("data")).expect("the journal");
        reader.records(Filter { after, ..Filter::default() }, 100_000).expect("records")
    }
}

/// The count that was kept; whole.
fn count(found: &Found, n: u64) -> u64 {
    let Some(saved) = found.retained.blocks.get("unit") else { return 0 };
    assert_eq!(saved.cells[0], saved.cells[1], "{n}: half of a state");
    saved.cells[0]
}

/// What the kills have hit, by the journal's records.
#[derive(Debug, Default)]
struct Tally {
    kills: u64,
    saved: u64,
    /// Before the order was on record.
    unheard: u64,
    before: u64,
    on_probation: u64,
    after: u64,
    rolled_back: u64,
}

impl Tally {
    /// Sorts a kill in by what is on record of its swap.
    fn add(&mut self, n: u64, records: &[Record], is_new: bool) {
        let of_swap = records.iter().filter(|r| r.kind.name() == "swap" && r.source == "unit");
        let told: Vec<_> = of_swap.map(|r| &*r.transition).collect();
        let way = ["asked", "shadow", "exchanged", "kept", "saved"];
        let mut rest = way.iter();
        assert!(told.iter().all(|t| *t == "rolled-back" || rest.any(|w| w == t)), "{n}: {told:?}");
        assert!(is_new || !told.contains(&"saved"), "{n}: on record as saved, and it is not: {told:?}");
        self.kills += 1;
        self.saved += u64::from(is_new);
        let kind = match told.last() {
            None => &mut self.unheard,
            Some(&"asked" | &"shadow") => &mut self.before,
            Some(&"exchanged") => &mut self.on_probation,
            Some(&"rolled-back") => &mut self.rolled_back,
            Some(_) => &mut self.after,
        };
        *kind += 1;
    }
}

/// One plant, again and again.
fn kill_often(kills: u64, seed: u64, end: Instant) -> Tally {
    let (mut dice, mut victim, mut tally) = (Dice::new(seed), Victim::new(), Tally::default());
    let longest = victim.undisturbed(&mut dice);
    let mut seen = 0;
    for n in 0..kills {
        if Instant::now() > end {
            break;
        }
        // The journal goes on without a gap; what is in it is from before the order.
        let records = victim.records(seen);
        seen = records.last().map_or(seen, |r| r.seq);
        let before = victim.text();
        let old = victim.row()["component"].as_str().expect("a name").to_owned();
        let order = victim.order(&mut dice, &old, false);
        let moment = match dice.below(4) {
            0 if order.save => Moment::Save(dice.span(Duration::from_millis(4))),
            1 => Moment::Retain(dice.span(longest), dice.span(Duration::from_millis(2))),
            _ => Moment::After(dice.span(longest + longest / 4)),
        };
        let last = victim.kill(&order, &moment);
        let kept = victim.kept();
        let is_new = victim.whole(n, &order, &old, &before);
        victim.child = launch(victim.folder.path());
        victim.until_it_answers();

        let row = victim.row();
        let named = if is_new { &order.name } else { &old };
        let hash = Component::hash_of(&victim.versions[named]);
        assert_eq!(
            (&row["component"], &row["hash"], &row["differs"]),
            (&json!(named), &json!(hash), &json!(false)),
            "{n}"
        );
        let records = victim.records(seen);
        let numbers: Vec<_> = records.iter().map(|r| r.seq).collect();
        assert!(numbers.iter().copied().eq(seen + 1..=seen + numbers.len() as u64), "{n}: {numbers:?}");
        let lost = records.iter().find(|r| r.transition == "not-restored");
        assert_eq!(lost, None, "{n}");
        tally.add(n, &records, is_new);
        // A version that is rolled back takes what it has counted with it.
        if !records.iter().any(|r| r.transition == "rolled-back") {
            assert!(kept.generation >= last.generation, "{n}: the last save is lost");
            assert!(count(&kept, n) >= count(&last, n), "{n}: behind the last save: {kept:?} {last:?}");
        }
        assert!(victim.count() > count(&kept, n), "{n}: it does not go on from what was kept");
    }
    tally
}

fn number(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name} is {text:?}; expected a number")))
}

#[test]
fn a_kill_at_any_moment_of_a_swap_and_its_saves_leaves_the_old_version_or_the_new_with_what_it_has_counted() {
    let kills = number("LATCHWORK_KILLS").unwrap_or(KILLS);
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(1, |d| d.as_nanos() as u64);
    let seed = number("LATCHWORK_KILLS_SEED").unwrap_or(now);
    eprintln!("LATCHWORK_KILLS={kills} LATCHWORK_KILLS_SEED={seed}");
    let end = Instant::now() + EACH * u32::try_from(kills).expect("a number of kills");
    let plants = (0..PLANTS).map(|n| {
        let share = kills / PLANTS + u64::from(n < kills % PLANTS);
        std::thread::spawn(move || kill_often(share, seed.wrapping_add(n), end))
    });
    let plants: Vec<_> = plants.collect();
    let tallies: Vec<_> = plants.into_iter().map(|p| p.join().expect("every kill leaves a whole plant")).collect();
    let sum = |of: fn(&Tally) -> u64| tallies.iter().map(of).sum::<u64>();
    let (made, saved, unheard) = (sum(|t| t.kills), sum(|t| t.saved), sum(|t| t.unheard));
    let (before, on_probation, after) = (sum(|t| t.before), sum(|t| t.on_probation), sum(|t| t.after));
    let told = format!(
        "{made} kills: {unheard} before the order was on record, {before} before the exchange, {on_probation} on probation, \
         {after} after it, {} after a way back; {saved} had saved the new version",
        sum(|t| t.rolled_back)
    );
    eprintln!("{told}");
    assert!(made >= kills / 4, "{told}");
    // A handful may hit one moment only.
    if made >= KILLS / 4 {
        assert!(saved > 0 && saved < made, "{told}");
        assert!(before > 0 && on_probation > 0 && after > 0, "{told}");
    }
}
