//! The picture: response time over main cycle time, the cyclic path beside the interrupt path.

use super::Measured;
use plotters::prelude::*;
use std::path::Path;

/// Draws both paths, with the range that theory gives the cyclic one.
pub(crate) fn draw(path: &Path, all: &[Measured]) -> Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::new(path, (860, 480)).into_drawing_area();
    root.fill(&WHITE)?;
    let ms = |ns: u64| (ns as f64 / 1e6).max(0.001);
    let mut chart = ChartBuilder::on(&root)
        .margin(12)
        .caption("Response time over main cycle time", ("sans-serif", 18))
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d((0.8f64..1300.0).log_scale(), (0.005f64..5000.0).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("work of the main lane in each scan, ms")
        .y_desc("signal to output, ms")
        .label_style(("sans-serif", 13))
        .draw()?;
    let cycles = || all.iter().map(|m| m.scan_ms as f64);
    // The signal waits for the next scan, and its output for that scan's end.
    let longest = |c: f64| c + super::plants::period_ms(c as u64) as f64;
    let band = cycles().map(|c| (c, c)).chain(cycles().rev().map(|c| (c, longest(c))));
    chart
        .draw_series(std::iter::once(Polygon::new(band.collect::<Vec<_>>(), BLACK.mix(0.10))))?
        .label("cyclic path, in theory")
        .legend(|(x, y)| Rectangle::new([(x, y - 5), (x + 16, y + 5)], BLACK.mix(0.10).filled()));
    let mut series = |name: &str, colour: RGBColor, of: fn(&Measured) -> u64| {
        let points: Vec<_> = all.iter().map(|m| (m.scan_ms as f64, ms(of(m)))).collect();
        chart.draw_series(LineSeries::new(points.clone(), colour.stroke_width(2)))?;
        chart
            .draw_series(points.iter().map(|p| Circle::new(*p, 4, colour.filled())))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2)));
        Ok::<_, DrawingAreaErrorKind<std::io::Error>>(())
    };
    series("cyclic path, median", RGBColor(200, 80, 20), |m| m.cyclic.p50)?;
    series("cyclic path, max", RGBColor(240, 160, 90), |m| m.cyclic.max)?;
    series("interrupt path, p50", RGBColor(20, 90, 180), |m| m.interrupt.p50)?;
    series("interrupt path, p99", RGBColor(90, 160, 230), |m| m.interrupt.p99)?;
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .position(SeriesLabelPosition::UpperLeft)
        .label_font(("sans-serif", 13))
        .draw()?;
    root.present()?;
    Ok(())
}
