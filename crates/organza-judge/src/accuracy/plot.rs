//! Log-log plots as SVG, in colours that the page sets for light and dark.

use std::fmt::Write;

/// Colours of series, told apart on light and on dark ground.
pub(crate) const COLORS: [&str; 8] =
    ["#4e79a7", "#f28e2b", "#59a14f", "#e15759", "#b07aa1", "#3aa6a0", "#d4a72c", "#9c755f"];

/// How points are joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mark {
    /// Dots alone.
    Dots,
    /// A thin dashed line without dots.
    Dashed,
    /// A broad pale line that comes from above, goes down in steps and on to the right.
    Steps,
    /// A line from each even point to the next one, with a cap at both ends.
    Bars,
}

/// Points of one colour.
pub(crate) struct Series {
    pub(crate) color: String,
    pub(crate) mark: Mark,
    /// x, y, and what is shown when the pointer rests on it.
    pub(crate) points: Vec<([f64; 2], String)>,
}

/// A plot with logarithmic axes.
pub(crate) struct Plot {
    pub(crate) size: [f64; 2],
    pub(crate) x_label: String,
    pub(crate) y_label: String,
    /// A level below which nothing can be shown.
    pub(crate) floor: Option<(f64, String)>,
    pub(crate) series: Vec<Series>,
}

const LEFT: f64 = 58.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 40.0;

/// One axis: values from `low` to `high` on pixels from `from` to `to`.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    /// Covers the values with a margin.
    fn over(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let usable = values.filter(|v| *v > 0.0 && v.is_finite());
        let (low, high) = usable.fold((f64::INFINITY, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = if low <= high { (low, high) } else { (1.0, 10.0) };
        let margin = 1.15 * (high / low).powf(0.04);
        Self { low: low / margin, high: high * margin, from, to }
    }

    fn at(&self, value: f64) -> f64 {
        let share = (value / self.low).ln() / (self.high / self.low).ln();
        self.from + share * (self.to - self.from)
    }

    /// Values with a line, and whether they get a number.
    fn ticks(&self) -> Vec<(f64, bool)> {
        let decades = (self.high / self.low).log10();
        let first = self.low.log10().floor() as i32;
        let ticks = (first..=first + decades.ceil() as i32 + 1).flat_map(|d| (1..10).map(move |m| (d, m)));
        let lettered = |m: i32| m == 1 || decades < 2.2 && matches!(m, 2 | 5) || decades < 0.7;
        ticks
            .map(|(d, m)| (f64::from(m) * 10f64.powi(d), lettered(m)))
            .filter(|(v, lettered)| (self.low..=self.high).contains(v) && (*lettered || decades < 4.0))
            .collect()
    }
}

impl Plot {
    /// The SVG element.
    pub(crate) fn svg(&self) -> String {
        let [width, height] = self.size;
        let points = || self.series.iter().flat_map(|s| s.points.iter().map(|p| p.0));
        let x = Axis::over(points().map(|p| p[0]), LEFT, width - RIGHT);
        let levels = points().map(|p| p[1]).chain(self.floor.as_ref().map(|f| f.0));
        let y = Axis::over(levels, height - BOTTOM, TOP);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             height=\"{height}\" role=\"img\" font-family=\"system-ui, sans-serif\" font-size=\"11\">\n"
        );
        self.axes(&mut svg, &x, &y);
        for series in &self.series {
            draw(&mut svg, series, &x, &y);
        }
        svg += "</svg>\n";
        svg
    }

    fn axes(&self, svg: &mut String, x: &Axis, y: &Axis) {
        let bottom = y.from;
        let top = y.to;
        let left = x.from;
        let right = x.to;
        for (value, lettered) in x.ticks() {
            let at = x.at(value);
            line(svg, [at, top], [at, bottom], if lettered { "var(--grid)" } else { "var(--faint)" }, "");
            if lettered {
                text(svg, [at, bottom + 14.0], "middle", &number(value));
            }
        }
        for (value, lettered) in y.ticks() {
            let at = y.at(value);
            line(svg, [left, at], [right, at], if lettered { "var(--grid)" } else { "var(--faint)" }, "");
            if lettered {
                text(svg, [left - 5.0, at + 4.0], "end", &number(value));
            }
        }
        if let Some((level, label)) = &self.floor {
            let at = y.at(*level);
            line(svg, [left, at], [right, at], "var(--ink)", "2 3");
            text(svg, [right - 3.0, at - 4.0], "end", label);
        }
        text(svg, [0.5 * (left + right), bottom + 32.0], "middle", &self.x_label);
        let middle = 0.5 * (top + bottom);
        let _ = writeln!(
            svg,
            "<text transform=\"translate(13 {middle:.1}) rotate(-90)\" text-anchor=\"middle\" fill=\"var(--ink)\">{}</text>",
            escaped(&self.y_label)
        );
    }
}

fn draw(svg: &mut String, series: &Series, x: &Axis, y: &Axis) {
    let shown = series.points.iter().filter(|(p, _)| p.iter().all(|v| *v > 0.0 && v.is_finite()));
    let placed: Vec<([f64; 2], &str)> = shown.map(|(p, t)| ([x.at(p[0]), y.at(p[1])], t.as_str())).collect();
    let color = &series.color;
    let path = |step: bool| {
        let mut d = String::new();
        for (i, ([px, py], _)) in placed.iter().enumerate() {
            let _ = match (i, step) {
                (0, true) => write!(d, "M{px:.1} {:.1}V{py:.1}", y.to),
                (0, false) => write!(d, "M{px:.1} {py:.1}"),
                (_, true) => write!(d, "H{px:.1}V{py:.1}"),
                (_, false) => write!(d, "L{px:.1} {py:.1}"),
            };
        }
        d
    };
    let _ = match series.mark {
        Mark::Steps => {
            // What lies above and to the right of the line is no better than what lies on it.
            let d = if placed.is_empty() { String::new() } else { format!("{}H{:.1}", path(true), x.to) };
            writeln!(
                svg,
                "<path d=\"{d}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"5\" stroke-opacity=\"0.28\"/>"
            )
        }
        Mark::Dashed => {
            let d = path(false);
            writeln!(
                svg,
                "<path d=\"{d}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.2\" stroke-dasharray=\"5 4\"/>"
            )
        }
        Mark::Bars => {
            for pair in placed.chunks_exact(2) {
                let [x, low] = pair[0].0;
                let [_, high] = pair[1].0;
                line(svg, [x, low], [x, high], color, "");
                [low, high].iter().for_each(|y| line(svg, [x - 4.0, *y], [x + 4.0, *y], color, ""));
            }
            Ok(())
        }
        Mark::Dots => {
            for ([px, py], title) in &placed {
                let _ = writeln!(
                    svg,
                    "<circle cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"4.2\" fill=\"{color}\" stroke=\"var(--ground)\"><title>{}\
                     </title></circle>",
                    escaped(title)
                );
            }
            Ok(())
        }
    };
}

fn line(svg: &mut String, a: [f64; 2], b: [f64; 2], color: &str, dash: &str) {
    let dash = if dash.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dash}\"") };
    let _ = writeln!(
        svg,
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{color}\"{dash}/>",
        a[0], a[1], b[0], b[1]
    );
}

fn text(svg: &mut String, at: [f64; 2], anchor: &str, words: &str) {
    let _ = writeln!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\" fill=\"var(--ink)\">{}</text>",
        at[0],
        at[1],
        escaped(words)
    );
}

/// A number as short as it can be read.
pub(super) fn number(value: f64) -> String {
    match value.abs() {
        v if v == 0.0 || (0.01..100_000.0).contains(&v) => format!("{}", (value * 1e4).round() / 1e4),
        _ => format!("{value:.0e}"),
    }
}

/// Text for SVG and HTML.
pub(crate) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\'' => out += "&#39;",
            c if c.is_control() && c != '\n' => {}
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decade_is_as_long_as_the_next() {
        let axis = Axis { low: 1.0, high: 100.0, from: 0.0, to: 200.0 };
        assert_eq!([1.0, 10.0, 100.0].map(|v| axis.at(v).round()), [0.0, 100.0, 200.0]);
        let numbered: Vec<f64> = axis.ticks().into_iter().filter(|t| t.1).map(|t| t.0).collect();
        assert_eq!(numbered, [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]);
    }

    #[test]
    fn labels_cannot_leave_their_element() {
        let points = vec![([1.0, 1.0], "</svg><script>".to_owned()), ([f64::NAN, 0.0], String::new())];
        let series = vec![Series { color: COLORS[0].into(), mark: Mark::Dots, points }];
        let plot = Plot { size: [300.0, 200.0], x_label: "<x>".into(), y_label: "y".into(), floor: None, series };
        let svg = plot.svg();
        assert!(svg.matches("<circle").count() == 1 && !svg.contains("<script") && svg.contains("&lt;x&gt;"));
        assert!(!svg.contains("NaN"));
    }
}
