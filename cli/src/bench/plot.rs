//! Plots as SVG text that needs nothing else.

use std::fmt::Write;

/// Colours that differ in brightness as well as in hue (Okabe and Ito 2008), for light backgrounds.
const COLOURS: [&str; 8] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56707f", "#b8860b", "#4b3fae", "#7a3b10"];

/// Size and margins of a plot, in user units.
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 16.0;
/// Room for the names of points.
const NAMES: f64 = 150.0;
const NAME_ROW: f64 = 13.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 48.0;
const LEGEND_ROW: f64 = 18.0;
const LEGEND_COLUMNS: usize = 3;

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Style {
    /// Points joined by a line.
    Line,
    /// Points, each with its own label.
    Points,
}

/// Data of one colour.
#[derive(Clone, Debug)]
pub(super) struct Series {
    pub(super) name: String,
    pub(super) style: Style,
    /// x, y and what the point is called.
    pub(super) points: Vec<(f64, f64, String)>,
}

/// One direction of a plot.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub(super) label: String,
    pub(super) is_logarithmic: bool,
    /// Whether the axis begins at 0.
    pub(super) is_from_zero: bool,
}

impl Axis {
    pub(super) fn linear(label: &str) -> Self {
        Self { label: label.to_owned(), is_logarithmic: false, is_from_zero: false }
    }

    pub(super) fn from_zero(label: &str) -> Self {
        Self { is_from_zero: true, ..Self::linear(label) }
    }

    pub(super) fn logarithmic(label: &str) -> Self {
        Self { is_logarithmic: true, ..Self::linear(label) }
    }

    fn place(&self, value: f64) -> f64 {
        if self.is_logarithmic { value.max(1e-12).log10() } else { value }
    }
}

/// A plot.
#[derive(Clone, Debug)]
pub(super) struct Plot {
    pub(super) title: String,
    pub(super) x: Axis,
    pub(super) y: Axis,
    pub(super) series: Vec<Series>,
    /// Named values of y as dashed lines across.
    pub(super) levels: Vec<(String, f64)>,
    /// Named values of x as dashed lines upwards.
    pub(super) marks: Vec<(String, f64)>,
}

/// Text that is safe inside of XML and HTML.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A number in few characters.
pub(super) fn short(value: f64) -> String {
    let magnitude = value.abs();
    let digits = if magnitude >= 100.0 || magnitude == 0.0 {
        0
    } else if magnitude >= 10.0 {
        1
    } else if magnitude >= 1.0 {
        2
    } else if magnitude >= 0.01 {
        3
    } else {
        5
    };
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Round values within a range, in the axis' own scale: place and label.
fn ticks(axis: &Axis, low: f64, high: f64) -> Vec<(f64, String)> {
    if axis.is_logarithmic {
        let decades = (low.floor() as i32..=high.ceil() as i32).flat_map(|decade| {
            let factors: &[f64] = if high - low > 3.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
            factors.iter().map(move |factor| factor * 10f64.powi(decade))
        });
        let in_range = decades.filter(|value| (low..=high).contains(&value.log10()));
        return in_range.map(|value| (value.log10(), short(value))).collect();
    }
    let rough = (high - low) / 5.0;
    let unit = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().find(|s| s * unit >= rough).unwrap_or(10.0) * unit;
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last).map(|i| i as f64 * step).map(|value| (value, short(value))).collect()
}

/// Smallest and largest value with some room around them.
fn range(axis: &Axis, values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (low, high) = values
        .map(|value| axis.place(value))
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    let room = ((high - low) * 0.06).max(high.abs() * 1e-3).max(1e-6);
    let start = if axis.is_from_zero { 0.0 } else { low - room };
    (low <= high).then_some((start, high + room))
}

/// From values in the axes' scales to places in the picture.
struct Frame {
    x: (f64, f64),
    y: (f64, f64),
    /// Where the plot ends, in the picture.
    right: f64,
}

impl Frame {
    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let along = |value: f64, (low, high): (f64, f64)| (value - low) / (high - low);
        (LEFT + along(x, self.x) * (self.right - LEFT), HEIGHT - BOTTOM - along(y, self.y) * (HEIGHT - TOP - BOTTOM))
    }
}

impl Plot {
    /// The plot as SVG; nothing if there is no data.
    pub(super) fn svg(&self) -> String {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let marks = self.marks.iter().map(|(_, x)| *x);
        let x = range(&self.x, points().map(|p| p.0).chain(marks));
        let Some((low, high)) = range(&self.y, points().map(|p| p.1)) else { return String::new() };
        // Levels far off would leave no room for the points.
        let levels = self.levels.iter().map(|(_, y)| *y).filter(|y| (self.y.place(*y) - high) < 2.0 * (high - low));
        let y = range(&self.y, points().map(|p| p.1).chain(levels));
        let (Some(x), Some(y)) = (x, y) else { return String::new() };
        let has_names = self.series.iter().any(|series| series.style == Style::Points);
        let frame = Frame { x, y, right: WIDTH - if has_names { NAMES } else { RIGHT } };
        let rows = if self.series.len() > 1 { self.series.len().div_ceil(LEGEND_COLUMNS) } else { 0 };
        let height = HEIGHT + rows as f64 * LEGEND_ROW;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" \
             height=\"{height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#ffffff\"/>\n\
             <text x=\"{LEFT}\" y=\"20\" font-size=\"14\" font-weight=\"bold\" fill=\"#111111\">{}</text>\n",
            escape(&self.title)
        );
        self.draw_axes(&mut svg, &frame);
        self.draw_levels(&mut svg, &frame);
        for (index, series) in self.series.iter().enumerate() {
            self.draw_series(&mut svg, &frame, series, COLOURS[index % COLOURS.len()]);
        }
        self.draw_names(&mut svg, &frame);
        if rows > 0 {
            self.draw_legend(&mut svg);
        }
        svg + "</svg>\n"
    }

    fn draw_axes(&self, svg: &mut String, frame: &Frame) {
        let (bottom, right) = (HEIGHT - BOTTOM, frame.right);
        for (value, label) in ticks(&self.x, frame.x.0, frame.x.1) {
            let (x, _) = frame.at(value, frame.y.0);
            let _ = writeln!(
                svg,
                "<path d=\"M{x:.1} {TOP}V{bottom}\" stroke=\"#e4e4e4\"/>\
                 <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#444444\">{label}</text>",
                bottom + 16.0
            );
        }
        for (value, label) in ticks(&self.y, frame.y.0, frame.y.1) {
            let (_, y) = frame.at(frame.x.0, value);
            let _ = writeln!(
                svg,
                "<path d=\"M{LEFT} {y:.1}H{right}\" stroke=\"#e4e4e4\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#444444\">{label}</text>",
                LEFT - 6.0,
                y + 4.0
            );
        }
        let middle = (LEFT + right) / 2.0;
        let centre = (TOP + bottom) / 2.0;
        let _ = writeln!(
            svg,
            "<path d=\"M{LEFT} {TOP}V{bottom}H{right}\" fill=\"none\" stroke=\"#444444\"/>\n\
             <text x=\"{middle:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#111111\">{}</text>\n\
             <text transform=\"translate(15 {centre:.1}) rotate(-90)\" text-anchor=\"middle\" \
             fill=\"#111111\">{}</text>",
            HEIGHT - 12.0,
            escape(&self.x.label),
            escape(&self.y.label)
        );
    }

    fn draw_levels(&self, svg: &mut String, frame: &Frame) {
        for (name, value) in &self.levels {
            let (x, y) = frame.at(frame.x.1, self.y.place(*value));
            if y < TOP {
                let _ = writeln!(
                    svg,
                    "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#555555\">\u{2191} {} {}</text>",
                    TOP + 12.0,
                    escape(name),
                    short(*value)
                );
                continue;
            }
            let _ = writeln!(
                svg,
                "<path d=\"M{LEFT} {y:.1}H{x:.1}\" stroke=\"#777777\" stroke-dasharray=\"5 4\"/>\
                 <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#555555\">{} {}</text>",
                y - 4.0,
                escape(name),
                short(*value)
            );
        }
        for (index, (name, value)) in self.marks.iter().enumerate() {
            let (x, y) = frame.at(self.x.place(*value), frame.y.1);
            let _ = writeln!(
                svg,
                "<path d=\"M{x:.1} {y:.1}V{:.1}\" stroke=\"#777777\" stroke-dasharray=\"5 4\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" fill=\"#555555\" font-size=\"11\">{}</text>",
                HEIGHT - BOTTOM,
                x + 3.0,
                // Neighbours in rows of their own.
                y + 12.0 + (index % 3) as f64 * 13.0,
                escape(name)
            );
        }
    }

    fn draw_series(&self, svg: &mut String, frame: &Frame, series: &Series, colour: &str) {
        let place = |(x, y, _): &(f64, f64, String)| frame.at(self.x.place(*x), self.y.place(*y));
        if series.style == Style::Line {
            let places: Vec<String> = series.points.iter().map(place).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.8\"/>",
                places.join(" ")
            );
        }
        for point in &series.points {
            let (x, y) = place(point);
            let radius = if series.style == Style::Points { 5.0 } else { 2.2 };
            let hint = format!("{}: {}, {}", point.2, short(point.0), short(point.1));
            let _ = writeln!(
                svg,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{colour}\"><title>{}</title></circle>",
                escape(&hint)
            );
        }
    }

    /// Names of points in a column at the right, in their order from top to bottom, each with a line to its point.
    fn draw_names(&self, svg: &mut String, frame: &Frame) {
        let named = self.series.iter().enumerate().filter(|(_, series)| series.style == Style::Points);
        let mut names: Vec<(f64, f64, &str, &str)> = named
            .flat_map(|(index, series)| series.points.iter().map(move |point| (COLOURS[index % COLOURS.len()], point)))
            .map(|(colour, (x, y, name))| {
                let (x, y) = frame.at(self.x.place(*x), self.y.place(*y));
                (x, y, name.as_str(), colour)
            })
            .collect();
        names.sort_by(|a, b| a.1.total_cmp(&b.1));
        let bottom = HEIGHT - BOTTOM;
        let mut at = TOP;
        for (index, (x, y, name, colour)) in names.iter().enumerate() {
            // As near to the point as the names above and below leave room for.
            let below = (names.len() - index - 1) as f64 * NAME_ROW;
            at = y.min(bottom - below).max(at);
            let start = frame.right + 8.0;
            let _ = writeln!(
                svg,
                "<path d=\"M{x:.1} {y:.1}L{:.1} {at:.1}H{start:.1}\" fill=\"none\" stroke=\"{colour}\" \
                 stroke-opacity=\"0.35\"/><text x=\"{:.1}\" y=\"{:.1}\" fill=\"{colour}\" \
                 font-size=\"11\">{}</text>",
                start - 5.0,
                start + 3.0,
                at + 4.0,
                escape(name)
            );
            at += NAME_ROW;
        }
    }

    fn draw_legend(&self, svg: &mut String) {
        let column = (WIDTH - LEFT - RIGHT) / LEGEND_COLUMNS as f64;
        for (index, series) in self.series.iter().enumerate() {
            let x = LEFT + (index % LEGEND_COLUMNS) as f64 * column;
            let y = HEIGHT + (index / LEGEND_COLUMNS) as f64 * LEGEND_ROW + 4.0;
            let colour = COLOURS[index % COLOURS.len()];
            let _ = writeln!(
                svg,
                "<rect x=\"{x:.1}\" y=\"{:.1}\" width=\"12\" height=\"12\" fill=\"{colour}\"/>\
                 <text x=\"{:.1}\" y=\"{y:.1}\" fill=\"#111111\">{}</text>",
                y - 10.0,
                x + 17.0,
                escape(&series.name)
            );
        }
    }
}
