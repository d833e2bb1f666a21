//! The plots of the page, as SVG that stands in it.
//!
//! Black becomes the colour of the text, so that a plot can be read on light and on dark ground.

use super::super::printable;
use super::words;
use anyhow::{Result, anyhow};
use latchwork_alarm::report::{Bin, DAY, FLOOD_BEGINS, HOUR, Rank, Report, TEN_MINUTES};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Colours of the ranks, the lowest first.
pub(super) const COLOURS: [RGBColor; 4] =
    [RGBColor(70, 130, 190), RGBColor(225, 180, 40), RGBColor(230, 110, 40), RGBColor(190, 40, 90)];
const LIMIT: RGBColor = RGBColor(205, 60, 60);
const WIDTH: u32 = 860;
/// Columns of the plot over time.
const COLUMNS: u64 = 380;
/// Longest name at a bar, in characters.
const NAME: usize = 44;

type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn draw(height: u32, content: impl FnOnce(&Canvas<'_>) -> Result<()>) -> Result<String> {
    let mut svg = String::new();
    let canvas = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
    content(&canvas)?;
    canvas.present().map_err(failed)?;
    drop(canvas);
    Ok(svg)
}

fn failed(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("a plot could not be drawn: {error}")
}

/// A text at a point of the canvas.
fn text(canvas: &Canvas<'_>, words: &str, at: (i32, i32), to: HPos) -> Result<()> {
    let style = ("sans-serif", 14).into_font().color(&BLACK).pos(Pos::new(to, VPos::Center));
    canvas.draw_text(&printable(words), &style, at).map_err(failed)
}

fn bar(canvas: &Canvas<'_>, from: (i32, i32), to: (i32, i32), colour: RGBColor) -> Result<()> {
    canvas.draw(&Rectangle::new([from, to], colour.filled())).map_err(failed)
}

/// Alarms per ten minutes over time, with the limit above which a flood begins.
pub(super) fn over_time(report: &Report) -> Result<String> {
    // A long time has several ten minutes to a column, of which the worst is shown.
    let first = report.from / TEN_MINUTES;
    let per_column = report.periods().div_ceil(COLUMNS);
    let columns = report.periods().div_ceil(per_column);
    let mut worst: Vec<Option<Bin>> = vec![None; columns as usize];
    for bin in &report.bins {
        let column = (bin.start / TEN_MINUTES - first) / per_column;
        if let Some(place) = worst.get_mut(column as usize)
            && place.is_none_or(|w| w.total() < bin.total())
        {
            *place = Some(*bin);
        }
    }
    let most = report.peak().map_or(0, |b| b.total()).max(FLOOD_BEGINS as u64 + 2) as f64;
    draw(300, |canvas| {
        let mut chart = ChartBuilder::on(canvas)
            .margin(10)
            .margin_right(44)
            .x_label_area_size(34)
            .y_label_area_size(58)
            .build_cartesian_2d(0.0..columns as f64, 0.0..most * 1.05)
            .map_err(failed)?;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .x_labels(0)
            .y_labels(6)
            .y_desc("alarms in 10 minutes")
            .y_label_formatter(&|y| format!("{y:.0}"))
            .axis_style(BLACK.mix(0.6))
            .bold_line_style(BLACK.mix(0.15))
            .light_line_style(TRANSPARENT)
            .label_style(("sans-serif", 13))
            .draw()
            .map_err(failed)?;
        for (column, bin) in worst.iter().enumerate() {
            let Some(bin) = bin else { continue };
            let mut base = 0.0;
            for (raised, colour) in bin.raised.into_iter().zip(COLOURS) {
                let top = base + f64::from(raised);
                if raised > 0 {
                    let corners = [(column as f64, base), (column as f64 + 0.9, top)];
                    chart.draw_series([Rectangle::new(corners, colour.filled())]).map_err(failed)?;
                }
                base = top;
            }
        }
        let limit = FLOOD_BEGINS as f64;
        let line = PathElement::new([(0.0, limit), (columns as f64, limit)], LIMIT.stroke_width(1));
        chart.draw_series([line]).map_err(failed)?;
        let width = per_column * TEN_MINUTES;
        let style = ("sans-serif", 13).into_font().color(&BLACK).pos(Pos::new(HPos::Center, VPos::Top));
        for (at, label) in ticks(first * TEN_MINUTES, columns * width) {
            let x = (at - first * TEN_MINUTES) as f64 / width as f64;
            let mark = EmptyElement::at((x, 0.0))
                + PathElement::new([(0, 0), (0, 4)], BLACK)
                + Text::new(label, (0, 8), style.clone());
            chart.draw_series([mark]).map_err(failed)?;
        }
        Ok(())
    })
}

/// Round points of time with their words.
fn ticks(from: u64, length: u64) -> Vec<(u64, String)> {
    let steps = [TEN_MINUTES, HOUR / 2, HOUR, 3 * HOUR, 6 * HOUR, 12 * HOUR, DAY, 2 * DAY, 7 * DAY, 14 * DAY, 30 * DAY];
    let step = steps.into_iter().find(|step| length / step <= 7).unwrap_or_else(|| (length / 7).next_multiple_of(DAY));
    let mut before = String::new();
    (from.div_ceil(step)..=(from + length) / step)
        .map(|n| {
            let words = words::moment(n * step);
            let (day, time) = words.split_at_checked(10).unwrap_or((&words, ""));
            // The day once, then the time alone.
            let label = if step >= DAY || day != before {
                before = day.into();
                if step >= DAY || time.starts_with(" 00:00") { day.into() } else { words[5..16].into() }
            } else {
                time.trim_start()[..5].into()
            };
            (n * step, label)
        })
        .collect()
}

/// The most frequent alarms.
pub(super) fn most_frequent(report: &Report) -> Result<String> {
    const ROW: i32 = 26;
    let (left, right) = (340, WIDTH as i32 - 120);
    let most = report.frequent.first().map_or(1, |f| f.raised) as f64;
    draw(report.frequent.len() as u32 * ROW as u32 + 12, |canvas| {
        for (row, frequent) in (0i32..).zip(&report.frequent) {
            let y = 6 + row * ROW;
            let end = left + ((right - left) as f64 * frequent.raised as f64 / most).round().max(1.0) as i32;
            text(canvas, &short(&frequent.alarm), (left - 8, y + ROW / 2), HPos::Right)?;
            bar(canvas, (left, y + 4), (end, y + ROW - 4), COLOURS[0])?;
            let share = 100.0 * frequent.raised as f64 / report.raised.max(1) as f64;
            let words = format!("{} ({share:.1} %)", frequent.raised);
            text(canvas, &words, (end + 6, y + ROW / 2), HPos::Left)?;
        }
        Ok(())
    })
}

/// The distribution by priority, and the recommended one as a mark.
pub(super) fn by_rank(report: &Report) -> Result<String> {
    const ROW: i32 = 30;
    let (left, right) = (90, WIDTH as i32 - 200);
    draw(Rank::ALL.len() as u32 * ROW as u32 + 12, |canvas| {
        for (row, rank) in (0i32..).zip(Rank::ALL.into_iter().rev()) {
            let (raised, recommended) = (report.by_rank()[rank as usize], rank.recommended());
            let share = 100.0 * raised as f64 / report.raised.max(1) as f64;
            let x = |percent: f64| left + ((right - left) as f64 * percent / 100.0).round() as i32;
            let y = 6 + row * ROW;
            text(canvas, rank.name(), (left - 8, y + ROW / 2), HPos::Right)?;
            bar(canvas, (left, y + 5), (x(share), y + ROW - 5), COLOURS[rank as usize])?;
            let mark = [(x(recommended), y + 2), (x(recommended), y + ROW - 2)];
            canvas.draw(&PathElement::new(mark, BLACK.stroke_width(2))).map_err(failed)?;
            let words = format!("{raised} ({share:.1} %), recommended {recommended} %");
            text(canvas, &words, (x(share.max(recommended)) + 8, y + ROW / 2), HPos::Left)?;
        }
        Ok(())
    })
}

/// A name that fits beside its bar: its beginning and its end.
fn short(name: &str) -> String {
    let count = name.chars().count();
    if count <= NAME {
        return name.into();
    }
    let half = NAME / 2;
    let (begin, end) = (name.chars().take(half), name.chars().skip(count - half + 1));
    begin.chain(std::iter::once('…')).chain(end).collect()
}
