//! A common style for all figures: framed axes, ticks inside, few colours, lines that differ in pattern as well as in
//! colour.

mod fold;

pub use fold::{Coordinate, fold, folded};

use kuva::backend::svg::SvgBackend;
use kuva::plot::legend::LegendPosition;
use kuva::plot::{LinePlot, LineStyle, MarkerShape, ScatterPlot};
use kuva::render::figure::{Figure, LabelConfig};
use kuva::render::layout::{Layout, TickAlign, TickFormat, TickPos};
use kuva::render::plots::Plot;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// The style of a curve. The four patterns can be distinguished in black and white, and so can the three markers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Line {
    /// Solid, blue: the result of a discrete Lagrangian.
    Solid,
    /// Dashed, red: the exact result, or a prediction.
    Dashed,
    /// Dotted, grey: a reference.
    Dotted,
    /// Dash-dot, green: a second method.
    DashDot,
    /// Blue discs without a line: single points of a curve.
    Discs,
    /// Small blue discs without a line: thousands of points.
    Dots,
    /// Grey diagonal crosses without a line.
    Crosses,
    /// Green upright crosses without a line.
    Pluses,
    /// One of many curves, where four patterns are too few: colour and pattern both change from one number to the next,
    /// and repeat after 24.
    Coloured(usize),
    /// One of many references, in grey: patterns and widths change, and repeat after 8.
    Grey(usize),
}

/// The colours of `Line::Coloured`: blue, red, green, violet, orange and teal, in the order of the numbers.
const COLOURS: [&str; 6] = [SOLID, "#c1272d", GREEN, "#8e44ad", "#d98200", "#00838f"];

/// The line pattern of a number.
fn pattern(number: usize) -> LineStyle {
    match number % 4 {
        0 => LineStyle::Solid,
        1 => LineStyle::Custom("8 5".into()),
        2 => LineStyle::Custom("2 3".into()),
        _ => LineStyle::Custom("9 3 2 3".into()),
    }
}

impl Line {
    fn plot(self, points: Vec<(f64, f64)>, name: Option<&str>) -> Plot {
        match self {
            Line::Solid => drawn(points, SOLID, 2.0, LineStyle::Solid, name),
            Line::Dashed => drawn(points, "#c1272d", 2.2, LineStyle::Custom("8 5".into()), name),
            Line::Dotted => drawn(points, GREY, 2.2, LineStyle::Custom("2 3".into()), name),
            Line::DashDot => drawn(points, GREEN, 2.2, LineStyle::Custom("9 3 2 3".into()), name),
            Line::Discs => marked(points, SOLID, MarkerShape::Circle, MARKER_SIZE, name),
            Line::Dots => marked(points, SOLID, MarkerShape::Circle, DOT_SIZE, name),
            Line::Crosses => marked(points, GREY, MarkerShape::Cross, MARKER_SIZE, name),
            Line::Pluses => marked(points, GREEN, MarkerShape::Plus, MARKER_SIZE, name),
            Line::Coloured(number) => {
                // In 12 numbers the colours repeat twice and the patterns three times; the shift then gives the other
                // 12 pairs.
                let colour = COLOURS[number % COLOURS.len()];
                drawn(points, colour, 2.0, pattern(number + number / 12), name)
            }
            Line::Grey(number) => drawn(points, GREY, if number % 8 < 4 { 2.6 } else { 1.2 }, pattern(number), name),
        }
    }
}

/// Points joined by a line.
fn drawn(points: Vec<(f64, f64)>, colour: &str, width: f64, pattern: LineStyle, name: Option<&str>) -> Plot {
    let plot = LinePlot::new().with_data(points).with_color(colour).with_stroke_width(width).with_line_style(pattern);
    match name {
        Some(name) => plot.with_legend(name).into(),
        None => plot.into(),
    }
}

/// Points without a line.
fn marked(points: Vec<(f64, f64)>, colour: &str, shape: MarkerShape, size: f64, name: Option<&str>) -> Plot {
    let plot = ScatterPlot::new().with_data(points).with_color(colour).with_size(size).with_marker(shape);
    match name {
        Some(name) => plot.with_legend(name).into(),
        None => plot.into(),
    }
}

/// A curve with its name in the legend.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The name; a curve without one is not in the legend.
    pub name: Option<String>,
    /// The style.
    pub line: Line,
    /// The points.
    pub points: Vec<(f64, f64)>,
}

impl Curve {
    /// A named curve.
    pub fn new(name: &str, line: Line, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Curve { name: Some(name.into()), line, points: points.into_iter().collect() }
    }

    /// A curve without an entry in the legend, for example in the style of another curve that the legend names.
    pub fn unnamed(line: Line, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Curve { name: None, line, points: points.into_iter().collect() }
    }
}

/// The range of an axis and the distance of its ticks, which are chosen by hand for figures in print.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Axis {
    /// A linear axis: from, to, distance of ticks.
    Linear(f64, f64, f64),
    /// A logarithmic axis: the powers of ten between which it extends, and how many of them lie between ticks.
    Logarithmic(i32, i32, u32),
    /// A linear axis of one turn, from -pi to pi.
    Angle,
}

impl Axis {
    /// The coordinate on the axis; `None` for values that a logarithmic axis cannot show. Logarithms are taken here,
    /// since kuva's own logarithmic axis ends at 1e-10.
    fn place(self, value: f64) -> Option<f64> {
        let coordinate = match self {
            Axis::Linear(..) | Axis::Angle => value,
            Axis::Logarithmic(..) => value.log10(),
        };
        Some(coordinate).filter(|c| c.is_finite())
    }

    /// The ends of the axis and the distance of the ticks, in coordinates on the axis.
    fn range(self) -> (f64, f64, f64) {
        match self {
            Axis::Linear(from, to, step) => (from, to, step),
            Axis::Logarithmic(from, to, step) => (f64::from(from), f64::from(to), f64::from(step)),
            Axis::Angle => (-PI, PI, FRAC_PI_2),
        }
    }

    fn format(self) -> TickFormat {
        match self {
            Axis::Linear(..) => TickFormat::Auto,
            Axis::Logarithmic(..) => TickFormat::Custom(Arc::new(power_of_ten)),
            Axis::Angle => TickFormat::Custom(Arc::new(part_of_a_turn)),
        }
    }
}

/// One pair of axes with its curves.
#[derive(Clone, Debug)]
pub struct Panel {
    /// The quantity on the horizontal axis, with its unit.
    pub x_label: String,
    /// The quantity on the vertical axis, with its unit.
    pub y_label: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The upper left corner of the legend, as fractions of the width and of the height from the lower left corner. If
    /// the first is 1, the legend is to the right of the axes, in a figure of one panel.
    pub legend: (f64, f64),
    /// The curves, in the order in which they are drawn.
    pub curves: Vec<Curve>,
    /// Marked points of a solid curve: the states that it connects.
    pub marks: Vec<(f64, f64)>,
    /// Whether a unit has the same length on both axes, so that circles are round; the axis with more room is extended.
    pub equal_scales: bool,
}

impl Panel {
    /// A panel without marked points, by the quantity and the range of both axes.
    pub fn new((x_label, x): (&str, Axis), (y_label, y): (&str, Axis), legend: (f64, f64), curves: Vec<Curve>) -> Self {
        let (x_label, y_label) = (x_label.into(), y_label.into());
        Panel { x_label, y_label, x, y, legend, curves, marks: Vec::new(), equal_scales: false }
    }
}

/// The colour of solid curves and of their points.
const SOLID: &str = "#1f5fa8";

/// The colour of dotted curves and of diagonal crosses.
const GREY: &str = "#555555";

/// The colour of dash-dot curves and of upright crosses.
const GREEN: &str = "#2a7f4f";

/// The size of markers without a line, in pixels: larger than the width of a line, so that they differ from it.
const MARKER_SIZE: f64 = 3.6;

/// The size of the dots of thousands of points, in pixels: so small that few of them overlap.
const DOT_SIZE: f64 = 1.0;

/// The width and the height of a panel, in pixels, to which the font sizes below are matched.
const PANEL_SIZE: (f64, f64) = (560.0, 400.0);

/// The additional width for a legend to the right of the axes, in pixels: room for a sample of a line and about 25
/// characters.
const LEGEND_WIDTH: f64 = 270.0;

/// The distance between the panels of a figure, in pixels.
const PANEL_SPACING: f64 = 24.0;

/// The factor by which everything but the curves is enlarged. It makes the samples of the legend long enough to show a
/// pattern; the font sizes below are in units of it.
const SCALE: f64 = 1.6;

impl Panel {
    fn plots(&self) -> Vec<Plot> {
        let place = |points: &[(f64, f64)]| -> Vec<(f64, f64)> {
            points.iter().filter_map(|(x, y)| Some((self.x.place(*x)?, self.y.place(*y)?))).collect()
        };
        let mut plots: Vec<Plot> = Vec::new();
        for curve in &self.curves {
            plots.push(curve.line.plot(place(&curve.points), curve.name.as_deref()));
        }
        if !self.marks.is_empty() {
            plots.push(ScatterPlot::new().with_data(place(&self.marks)).with_color(SOLID).with_size(2.6).into());
        }
        plots
    }

    fn legend_is_beside(&self) -> bool {
        self.legend.0 >= 1.0
    }

    fn layout(&self, plots: &[Plot]) -> Layout {
        let ((left, right, x_step), (bottom, top, y_step)) = (self.x.range(), self.y.range());
        let corner = (left + self.legend.0 * (right - left), bottom + self.legend.1 * (top - bottom));
        let legend = if self.legend_is_beside() {
            LegendPosition::OutsideRightTop
        } else {
            LegendPosition::DataCoords(corner.0, corner.1)
        };
        let layout = Layout::auto_from_plots(plots);
        let layout = if self.equal_scales { layout.with_equal_aspect() } else { layout };
        layout
            .with_scale(SCALE)
            .with_label_size(11)
            .with_tick_size(10)
            .with_body_size(10)
            .with_axis_line_width(0.7)
            .with_tick_width(0.6)
            .with_tick_length(4.0)
            .with_x_label(&self.x_label)
            .with_y_label(&self.y_label)
            .with_x_label_offset(0.0, -14.0)
            .with_show_grid(false)
            .with_tick_align(TickAlign::Inside)
            .with_tick_pos(TickPos::Both)
            .with_legend_position(legend)
            .with_legend_box(false)
            .with_x_axis_min(left)
            .with_x_axis_max(right)
            .with_x_tick_step(x_step)
            .with_x_tick_format(self.x.format())
            .with_y_axis_min(bottom)
            .with_y_axis_max(top)
            .with_y_tick_step(y_step)
            .with_y_tick_format(self.y.format())
    }
}

/// The label of a tick at a power of ten.
fn power_of_ten(exponent: f64) -> String {
    let raised = |digit: char| match digit {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        digit => digit.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(digit),
    };
    if exponent == 0.0 {
        "1".into()
    } else {
        format!("10{}", format!("{exponent:.0}").chars().map(raised).collect::<String>())
    }
}

/// The label of a tick at a multiple of a right angle.
fn part_of_a_turn(angle: f64) -> String {
    let label = match (2.0 * angle.abs() / PI).round() as u32 {
        0 => return "0".into(),
        1 => "\u{3c0}/2",
        _ => "\u{3c0}",
    };
    if angle < 0.0 { format!("\u{2212}{label}") } else { label.into() }
}

/// A figure of one panel, as SVG.
pub fn draw(panel: &Panel) -> String {
    let plots = panel.plots();
    let width = PANEL_SIZE.0 + if panel.legend_is_beside() { LEGEND_WIDTH } else { 0.0 };
    let layout = panel.layout(&plots).with_width(width).with_height(PANEL_SIZE.1);
    numbered(&kuva::render_to_svg(plots, layout))
}

/// The same figure with its clip paths numbered from 0: kuva numbers those of the whole process, and a figure should
/// not depend on which others are drawn.
fn numbered(svg: &str) -> String {
    const CLIP: &str = "kuva-clip-";
    let (mut seen, mut parts) = (Vec::new(), svg.split(CLIP));
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (clip, rest) = part.split_at(part.find(|c: char| !c.is_ascii_digit()).unwrap_or(part.len()));
        let place = seen.iter().position(|s| *s == clip).unwrap_or(seen.len());
        if place == seen.len() {
            seen.push(clip);
        }
        out += &format!("{CLIP}{place}{rest}");
    }
    out
}

/// A figure of panels side by side, as SVG; several panels are labelled a, b and so on.
pub fn draw_row(panels: &[Panel]) -> String {
    draw_grid(panels, panels.len())
}

/// A figure of panels in rows of `in_a_row`, as SVG; several panels are labelled a, b and so on.
pub fn draw_grid(panels: &[Panel], in_a_row: usize) -> String {
    let plots: Vec<Vec<Plot>> = panels.iter().map(Panel::plots).collect();
    let layouts = panels.iter().zip(&plots).map(|(panel, plots)| panel.layout(plots)).collect();
    let in_a_row = in_a_row.max(1);
    // Only panels have letters: the last row may have empty places.
    let count = if panels.len() > 1 { panels.len() } else { 0 };
    let letters: Vec<String> = ('a'..='z').take(count).map(String::from).collect();
    let scene = Figure::new(panels.len().div_ceil(in_a_row).max(1), in_a_row)
        .with_plots(plots)
        .with_layouts(layouts)
        .with_cell_size(PANEL_SIZE.0, PANEL_SIZE.1)
        .with_spacing(PANEL_SPACING)
        .with_labels_custom(letters.iter().map(String::as_str).collect(), LabelConfig::default())
        .render();
    numbered(&SvgBackend.render_scene(&scene))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each of several panels has its letter; empty places and a single panel have none.
    #[test]
    fn letters_are_those_of_panels() {
        let panel = Panel::new(
            ("x", Axis::Linear(0.0, 1.0, 0.5)),
            ("y", Axis::Linear(0.0, 1.0, 0.5)),
            (0.0, 1.0),
            vec![Curve::unnamed(Line::Solid, [(0.0, 0.0), (1.0, 1.0)])],
        );
        for (panels, in_a_row) in [(1, 1), (1, 3), (2, 2), (3, 2), (5, 3), (7, 3)] {
            let drawn = draw_grid(&vec![panel.clone(); panels], in_a_row);
            let letters: String = ('a'..='w').filter(|letter| drawn.contains(&format!(">{letter}<"))).collect();
            assert_eq!(letters, "abcdefg"[..if panels > 1 { panels } else { 0 }], "{panels} in rows of {in_a_row}");
        }
    }

    #[test]
    fn clips_are_counted_from_zero() {
        let later = r#"<a id="kuva-clip-17"/><b clip="url(#kuva-clip-17)"/><a id="kuva-clip-3"/> kuva-clip-3"#;
        let found = r#"<a id="kuva-clip-0"/><b clip="url(#kuva-clip-0)"/><a id="kuva-clip-1"/> kuva-clip-1"#;
        assert_eq!(numbered(later), found);
        assert_eq!(numbered("<svg/>"), "<svg/>");
    }
}
