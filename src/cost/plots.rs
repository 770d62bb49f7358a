//! Plots as SVG.

use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

/// Points on logarithmic axes.
pub(super) struct Plot {
    pub(super) title: String,
    pub(super) x: &'static str,
    pub(super) y: &'static str,
    /// Draws y = x.
    pub(super) diagonal: bool,
    pub(super) series: Vec<Series>,
}

pub(super) struct Series {
    pub(super) name: String,
    /// Series of one group have one colour.
    pub(super) group: usize,
    pub(super) kind: Kind,
    pub(super) points: Vec<(f64, f64)>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Points joined by a line.
    Line,
    /// Rings joined by a thin line.
    Thin,
    /// One large point.
    Mark,
}

/// Colours that people see apart whatever their eyes (Okabe and Ito 2008).
const COLORS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

impl Plot {
    /// The plot, `None` if there is nothing to be seen on it. What is 0 has no place on a logarithmic axis and is put at its
    /// foot.
    pub(super) fn svg(&self) -> Option<String> {
        let all = || self.series.iter().flat_map(|s| &s.points);
        let range = |of: fn(&(f64, f64)) -> f64| {
            let positive = || all().map(of).filter(|v| *v > 0.0);
            let (low, high) = (positive().fold(f64::INFINITY, f64::min), positive().fold(0.0, f64::max));
            (high > 0.0).then_some((low / 2.0, high * 2.0))
        };
        let (x, y) = (range(|p| p.0)?, range(|p| p.1)?);
        let mut out = String::new();
        let root = SVGBackend::with_string(&mut out, (820, 520)).into_drawing_area();
        let axis = |(low, high): (f64, f64)| (low..high).log_scale();
        // Writing into memory does not fail; if it does, there is no plot.
        self.draw(&root, axis(x), axis(y), [x, y]).ok()?;
        root.present().ok()?;
        drop(root);
        Some(out)
    }

    fn draw<B: DrawingBackend, X, Y>(
        &self,
        root: &DrawingArea<B, plotters::coord::Shift>,
        x: X,
        y: Y,
        [xs, ys]: [(f64, f64); 2],
    ) -> Result<(), DrawingAreaErrorKind<B::ErrorType>>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: ValueFormatter<f64>,
        Y::CoordDescType: ValueFormatter<f64>,
    {
        let font = |size: i32| ("sans-serif", size).into_font();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(root)
            .caption(&self.title, font(22))
            .margin(14)
            .x_label_area_size(52)
            .y_label_area_size(76)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .x_desc(self.x)
            .y_desc(self.y)
            .light_line_style(RGBColor(240, 240, 240))
            .bold_line_style(RGBColor(215, 215, 215))
            .x_label_formatter(&|v| short(*v))
            .y_label_formatter(&|v| short(*v))
            .label_style(font(16))
            .axis_desc_style(font(18))
            .draw()?;
        if self.diagonal {
            let (low, high) = (xs.0.max(ys.0), xs.1.min(ys.1));
            chart
                .draw_series(LineSeries::new([(low, low), (high, high)], BLACK.stroke_width(1)))?
                .label("y = x: the promise")
                .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], BLACK));
        }
        for series in &self.series {
            let color = COLORS[series.group % COLORS.len()];
            let points: Vec<(f64, f64)> = series.points.iter().map(|p| (p.0.max(xs.0), p.1.max(ys.0))).collect();
            let (width, radius) = match series.kind {
                Kind::Line => (2, 3),
                Kind::Thin => (1, 4),
                Kind::Mark => (0, 6),
            };
            let filled = series.kind != Kind::Thin;
            let style = if filled { color.filled() } else { color.stroke_width(1) };
            if series.kind != Kind::Mark {
                chart.draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(width)))?;
            }
            chart
                .draw_series(points.iter().map(|&p| Circle::new(p, radius, style)))?
                .label(series.name.clone())
                .legend(move |(x, y)| Circle::new((x + 9, y), radius, style));
        }
        // Errors grow with what is asked for and fall with what is paid.
        let corner = if self.diagonal { SeriesLabelPosition::UpperLeft } else { SeriesLabelPosition::UpperRight };
        chart
            .configure_series_labels()
            .position(corner)
            .background_style(WHITE.mix(0.85))
            .border_style(RGBColor(215, 215, 215))
            .label_font(font(16))
            .draw()
    }
}

/// A label of an axis.
fn short(value: f64) -> String {
    match value {
        v if v >= 1e6 => format!("{}M", v / 1e6),
        v if v >= 1e4 => format!("{}k", v / 1e3),
        v => format!("{v}"),
    }
}
