//! One look for all figures: framed axes, ticks inside, few colours, lines that differ in pattern as well as in colour.

use kuva::backend::svg::SvgBackend;
use kuva::plot::legend::LegendPosition;
use kuva::plot::{LinePlot, LineStyle, ScatterPlot};
use kuva::render::figure::Figure;
use kuva::render::layout::{Layout, TickAlign, TickFormat, TickPos};
use kuva::render::plots::Plot;
use std::sync::Arc;

/// How a curve is drawn. The four patterns can be told apart in black and white.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// Solid, blue: what a discrete Lagrangian gives.
    Solid,
    /// Dashed, dark red: what is true.
    Dashed,
    /// Dotted, grey: what has been printed, and is wrong.
    Dotted,
    /// Dash-dot, green: a second method.
    DashDot,
}

impl Line {
    fn plot(self, points: Vec<(f64, f64)>) -> LinePlot {
        let (colour, width, style) = match self {
            Line::Solid => ("#1f5fa8", 2.0, LineStyle::Solid),
            Line::Dashed => ("#c1272d", 2.2, LineStyle::Custom("9 5".into())),
            Line::Dotted => ("#6b6b6b", 2.4, LineStyle::Custom("2 4".into())),
            Line::DashDot => ("#2a7f4f", 2.0, LineStyle::Custom("10 4 2 4".into())),
        };
        LinePlot::new().with_data(points).with_color(colour).with_stroke_width(width).with_line_style(style)
    }
}

/// A curve with its name in the legend.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The name; none where another panel has it.
    pub name: Option<String>,
    /// How it is drawn.
    pub line: Line,
    /// Its points.
    pub points: Vec<(f64, f64)>,
}

impl Curve {
    /// A named curve.
    pub fn new(name: &str, line: Line, points: Vec<(f64, f64)>) -> Self {
        Curve { name: Some(name.into()), line, points }
    }
}

/// The range of an axis and the distance of its ticks, chosen by hand: a figure for print is composed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Axis {
    /// A linear axis: from, to, distance of ticks.
    Linear(f64, f64, f64),
    /// A logarithmic axis: the powers of ten between which it extends.
    Logarithmic(i32, i32),
}

/// The corner in which a panel has room for its legend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Legend {
    /// Top right.
    TopRight,
    /// Top left.
    TopLeft,
    /// Bottom right.
    BottomRight,
    /// Bottom left.
    BottomLeft,
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
    /// Where the legend goes.
    pub legend: Legend,
    /// The curves, the first one drawn first.
    pub curves: Vec<Curve>,
    /// Marked points, such as a centre or a start.
    pub marks: Vec<(f64, f64)>,
}

/// The width of a panel in pixels, and its height.
const SIZE: (f64, f64) = (600.0, 400.0);

/// The factor by which the legend's swatches are longer than kuva draws them: a swatch must show the pattern of its line.
const CHROME: f64 = 2.5;

impl Panel {
    fn plots(&self) -> Vec<Plot> {
        let mut plots: Vec<Plot> = Vec::new();
        for curve in &self.curves {
            let plot = curve.line.plot(curve.points.clone());
            plots.push(match &curve.name {
                Some(name) => plot.with_legend(name).into(),
                None => plot.into(),
            });
        }
        if !self.marks.is_empty() {
            plots.push(ScatterPlot::new().with_data(self.marks.clone()).with_color("black").with_size(4.0).into());
        }
        plots
    }

    fn layout(&self, plots: &[Plot]) -> Layout {
        let position = match self.legend {
            Legend::TopRight => LegendPosition::InsideTopRight,
            Legend::TopLeft => LegendPosition::InsideTopLeft,
            Legend::BottomRight => LegendPosition::InsideBottomRight,
            Legend::BottomLeft => LegendPosition::InsideBottomLeft,
        };
        let mut layout = Layout::auto_from_plots(plots)
            .with_scale(CHROME)
            .with_label_size(7)
            .with_tick_size(6)
            .with_body_size(6)
            .with_axis_line_width(0.45)
            .with_tick_width(0.4)
            .with_tick_length(2.6)
            .with_x_label(&self.x_label)
            .with_y_label(&self.y_label)
            .with_show_grid(false)
            .with_tick_align(TickAlign::Inside)
            .with_tick_pos(TickPos::Both)
            .with_legend_position(position)
            .with_legend_box(false);
        layout = match self.x {
            Axis::Linear(from, to, step) => layout.with_x_axis_min(from).with_x_axis_max(to).with_x_tick_step(step),
            Axis::Logarithmic(from, to) => layout
                .with_log_x()
                .with_x_axis_min(power(from))
                .with_x_axis_max(power(to))
                .with_x_tick_format(TickFormat::Custom(Arc::new(power_of_ten))),
        };
        match self.y {
            Axis::Linear(from, to, step) => layout.with_y_axis_min(from).with_y_axis_max(to).with_y_tick_step(step),
            Axis::Logarithmic(from, to) => layout
                .with_log_y()
                .with_y_axis_min(power(from))
                .with_y_axis_max(power(to))
                .with_y_tick_format(TickFormat::Custom(Arc::new(power_of_ten))),
        }
    }
}

fn power(exponent: i32) -> f64 {
    10f64.powi(exponent)
}

/// The label of a decade's tick.
fn power_of_ten(x: f64) -> String {
    let exponent = x.log10().round();
    let digits = format!("{exponent:.0}");
    let raised: String = digits
        .chars()
        .map(|c| match c {
            '-' => '\u{207b}',
            '1' => '\u{b9}',
            '2' => '\u{b2}',
            '3' => '\u{b3}',
            '0' | '4'..='9' => char::from_u32(0x2070 + u32::from(c) - u32::from('0')).unwrap_or(c),
            c => c,
        })
        .collect();
    format!("10{raised}")
}

/// A figure of one panel, as SVG.
pub fn draw(panel: &Panel) -> String {
    let plots = panel.plots();
    let layout = panel.layout(&plots).with_width(SIZE.0).with_height(SIZE.1);
    kuva::render_to_svg(plots, layout)
}

/// A figure of panels side by side, or one above the other, marked (a), (b), as SVG.
pub fn draw_stack(panels: &[Panel], columns: usize) -> String {
    let rows = panels.len().div_ceil(columns.max(1));
    let plots: Vec<Vec<Plot>> = panels.iter().map(Panel::plots).collect();
    let layouts = panels.iter().zip(&plots).map(|(panel, plots)| panel.layout(plots)).collect();
    let scene = Figure::new(rows, columns.max(1))
        .with_plots(plots)
        .with_layouts(layouts)
        .with_cell_size(SIZE.0, SIZE.1)
        .with_spacing(24.0)
        .with_labels_lowercase()
        .render();
    SvgBackend.render_scene(&scene)
}
