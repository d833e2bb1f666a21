//! The live table on a terminal.

use super::{History, Picture, Screen, Show};
use comfy_table::{Table as Grid, presets};
use latchwork_image::{Quality, format_duration};
use latchwork_plant::assemble::Plant;
use latchwork_plant::lane::LaneState;
use latchwork_record::rfc3339;

/// Time between two pictures, ns.
const PERIOD: u64 = 200_000_000;
/// Lines the newest records take.
const RECORDS: usize = 6;

/// Draws lanes, values, alarms and the newest records five times a second.
pub(crate) struct Table {
    picture: Picture,
    screen: Option<Screen>,
    next: u64,
}

fn paint(text: &str, colour: &str) -> String {
    if std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty()) {
        text.into()
    } else {
        format!("\x1b[{colour}m{text}\x1b[0m")
    }
}

impl Table {
    pub(crate) fn new(plant: &Plant, screen: Screen) -> Self {
        Self { picture: Picture::new(plant), screen: Some(screen), next: 0 }
    }

    fn lines(&self, now: u64, history: &History, columns: u16, rows: u16) -> Vec<String> {
        let columns = usize::from(columns);
        let title = format!("{}   {:.1} s   Ctrl-C stops in order", self.picture.plant, now as f64 / 1e9);
        let mut lines = vec![paint(&title, "1"), String::new()];
        lines.extend(self.lanes(columns));
        lines.push(String::new());
        let alarms: Vec<_> = self.picture.alarms().collect();
        lines.push(if alarms.is_empty() {
            paint("no alarms", "32")
        } else {
            paint(&cut(&format!("ALARMS  {}", alarms.join("  ")), columns), "1;31")
        });
        lines.push(String::new());
        let room = usize::from(rows).saturating_sub(lines.len() + RECORDS + 3);
        lines.extend(self.values(columns, room));
        lines.push(String::new());
        lines.extend(history.recent.iter().rev().take(RECORDS).rev().map(|r| {
            // Hours to milliseconds are what a person at the screen needs.
            let time = rfc3339(r.time);
            let time = time.get(11..23).unwrap_or(&time);
            cut(&format!("{time}  {:<7} {} {}  {}", r.kind.name(), r.source, r.transition, r.text), columns)
        }));
        lines
    }

    fn lanes(&self, columns: usize) -> Vec<String> {
        let mut grid = Grid::new();
        grid.load_style(presets::NOTHING);
        grid.set_header(["lane", "state", "scans", "overruns", "scan", "longest", "latest start", "faults"]);
        for lane in self.picture.lanes() {
            let [scans, overruns, scan, max, jitter, faults] = lane.figures[..] else { continue };
            let time = |ns: u64| format_duration(ns / 1000 * 1000);
            let state = if lane.state == LaneState::Faulted { "FAULTED" } else { lane.state.name() };
            grid.add_row([
                lane.name,
                state.into(),
                scans.to_string(),
                overruns.to_string(),
                time(scan),
                time(max),
                time(jitter),
                faults.to_string(),
            ]);
        }
        grid.lines().map(|l| cut(&l, columns)).collect()
    }

    /// Values in as many columns as fit.
    fn values(&self, columns: usize, room: usize) -> Vec<String> {
        let cells: Vec<_> = self.picture.values().collect();
        if cells.is_empty() || room == 0 {
            return Vec::new();
        }
        let tag = cells.iter().map(|c| c.tag.chars().count()).max().unwrap_or(0);
        let width = tag + 28;
        let side_by_side = (columns / width).max(1);
        let height = cells.len().div_ceil(side_by_side).min(room);
        let mut lines: Vec<String> = vec![String::new(); height];
        for (n, cell) in cells.iter().enumerate().take(height * side_by_side) {
            let text = format!("{:<tag$}  {:>16} {:<7}", cell.tag, cut(&cell.value, 16), quality(cell.quality));
            let text = format!("{:<width$}", cut(&text, width));
            lines[n % height] += &if cell.quality == Quality::Bad { paint(&text, "33") } else { text };
        }
        let hidden = cells.len().saturating_sub(height * side_by_side);
        if hidden > 0 {
            lines.push(format!("… and {hidden} more; see `latchwork tags`"));
        }
        lines
    }
}

fn quality(quality: Quality) -> &'static str {
    if quality == Quality::Good { "" } else { quality.name() }
}

/// At most `width` characters.
pub(crate) fn cut(text: &str, width: usize) -> String {
    match text.char_indices().nth(width) {
        Some((end, _)) => text[..end].to_string(),
        None => text.to_string(),
    }
}

impl Show for Table {
    fn tick(&mut self, now: u64, history: &History) {
        if now < self.next {
            return;
        }
        self.next = now + PERIOD;
        self.picture.refresh();
        let (columns, rows) = Screen::size();
        let lines = self.lines(now, history, columns, rows);
        // A terminal that went away must not stop a plant.
        if let Some(screen) = &mut self.screen {
            let _ = screen.draw(&lines);
        }
    }

    fn end(&mut self, now: u64, history: &History) {
        self.next = 0;
        self.tick(now, history);
        self.screen = None;
    }
}
