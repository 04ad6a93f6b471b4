//! Charts: what is drawn, and drawing it.

use super::axis::{Axis, Unit};
use super::svg::{Anchor, Svg};

/// A measured point.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Along the horizontal axis, above 0 (other points are left out).
    pub x: f64,
    /// Along the vertical axis, above 0.
    pub y: f64,
    /// What it is, shown when the pointer rests on it.
    pub tip: String,
    /// A few letters beside it; may be empty.
    pub mark: String,
    /// Whether no other point is better in both.
    pub front: bool,
}

/// Whether points are neighbours on an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Joined {
    /// Joined in order, filled markers.
    Line,
    /// Apart, hollow markers.
    No,
}

/// Points of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// In the legend.
    pub name: String,
    /// Colour and marker, 0..4.
    pub style: usize,
    /// Whether they are joined.
    pub joined: Joined,
    /// The points.
    pub points: Vec<Point>,
}

/// One pair of axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Above it.
    pub title: String,
    /// What is in it; the same names in all panels.
    pub series: Vec<Series>,
}

/// Panels side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// On top.
    pub title: String,
    /// Under the title.
    pub subtitle: String,
    /// Below the panels, and its unit.
    pub x: (String, Unit),
    /// Beside the panels, and its unit.
    pub y: (String, Unit),
    /// The panels.
    pub panels: Vec<Panel>,
}

const PANEL: [f64; 2] = [380.0, 330.0];
const LEFT: f64 = 66.0;
const TOP: f64 = 92.0;
const BELOW: f64 = 50.0;
const COLUMNS: usize = 3;
/// Told apart by the colour-blind too (Okabe and Ito 2008).
const COLOURS: [&str; 4] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"];
/// The front.
const FRONT: &str = "#ffe08a";
const GREY: &str = "#555555";

/// The chart as an SVG file.
pub fn render(chart: &Chart) -> String {
    let columns = chart.panels.len().clamp(1, COLUMNS);
    let rows = chart.panels.len().div_ceil(COLUMNS).max(1);
    let cell = [PANEL[0] + LEFT + 10.0, PANEL[1] + BELOW + 34.0];
    let width = columns as f64 * cell[0] + 16.0;
    let mut svg = Svg::new(width, TOP + rows as f64 * cell[1] + 6.0, &chart.title);
    svg.label([16.0, 24.0], &chart.title, Anchor::Start, "font-size=\"17\" font-weight=\"bold\"");
    svg.label([16.0, 43.0], &chart.subtitle, Anchor::Start, &format!("fill=\"{GREY}\""));
    legend(&mut svg, chart);
    for (i, panel) in chart.panels.iter().enumerate() {
        let corner = [(i % COLUMNS) as f64 * cell[0] + LEFT, TOP + (i / COLUMNS) as f64 * cell[1] + 24.0];
        draw_panel(&mut svg, chart, panel, corner);
    }
    svg.finish()
}

fn legend(svg: &mut Svg, chart: &Chart) {
    let mut x = 22.0;
    let y = 66.0;
    let used = |name: &str| {
        chart.panels.iter().flat_map(|p| &p.series).any(|s| s.name == name && !s.points.is_empty())
    };
    for series in chart.panels.first().map_or(&[][..], |p| &p.series).iter().filter(|s| used(&s.name)) {
        marker(svg, series.style, series.joined, [x, y - 4.0], "");
        svg.label([x + 10.0, y], &series.name, Anchor::Start, "");
        x += 26.0 + 6.6 * series.name.chars().count() as f64;
    }
    if !chart.panels.iter().flat_map(|p| &p.series).flat_map(|s| &s.points).any(|p| p.front) {
        return;
    }
    svg.polyline(&[[x - 6.0, y - 4.0], [x + 14.0, y - 4.0]], FRONT, 7.0);
    svg.circle([x + 4.0, y - 4.0], 7.5, "none", "#000000", "");
    svg.label([x + 20.0, y], "front: nothing is better in both", Anchor::Start, "");
}

fn draw_panel(svg: &mut Svg, chart: &Chart, panel: &Panel, [left, top]: [f64; 2]) {
    let (right, bottom) = (left + PANEL[0], top + PANEL[1]);
    let usable = |p: &&Point| p.x > 0.0 && p.y > 0.0 && p.x.is_finite() && p.y.is_finite();
    let all: Vec<&Point> = panel.series.iter().flat_map(|s| &s.points).filter(usable).collect();
    let x = Axis::new(all.iter().map(|p| p.x), [left, right]);
    let y = Axis::new(all.iter().map(|p| p.y), [bottom, top]);
    svg.label([left, top - 8.0], &panel.title, Anchor::Start, "font-weight=\"bold\"");
    for (value, labelled) in x.ticks() {
        let at = x.at(value);
        svg.line([at, top], [at, bottom], if labelled { "#d5d5d5" } else { "#efefef" }, 1.0);
        if labelled {
            svg.label([at, bottom + 16.0], &chart.x.1.label(value), Anchor::Middle, "");
        }
    }
    for (value, labelled) in y.ticks() {
        let at = y.at(value);
        svg.line([left, at], [right, at], if labelled { "#d5d5d5" } else { "#efefef" }, 1.0);
        if labelled {
            svg.label([left - 6.0, at + 4.0], &chart.y.1.label(value), Anchor::End, "");
        }
    }
    svg.frame([left, top], [right, bottom], GREY);
    svg.label([0.5 * (left + right), bottom + 36.0], &chart.x.0, Anchor::Middle, "");
    let (mx, my) = (left - 52.0, 0.5 * (top + bottom));
    svg.label([mx, my], &chart.y.0, Anchor::Middle, &format!("transform=\"rotate(-90 {mx:.1} {my:.1})\""));
    let place = |p: &Point| [x.at(p.x), y.at(p.y)];
    svg.polyline(&staircase(&all, place), FRONT, 7.0);
    for series in &panel.series {
        let points: Vec<&Point> = series.points.iter().filter(usable).collect();
        if series.joined == Joined::Line {
            let line: Vec<[f64; 2]> = points.iter().map(|p| place(p)).collect();
            svg.polyline(&line, COLOURS[series.style % 4], 1.5);
        }
        for p in points {
            let at = place(p);
            if p.front {
                svg.circle(at, 7.5, "none", "#000000", "");
            }
            marker(svg, series.style, series.joined, at, &p.tip);
            if !p.mark.is_empty() {
                let style = format!("font-size=\"10\" fill=\"{}\"", COLOURS[series.style % 4]);
                svg.label([at[0] + 8.0, at[1] - 6.0], &p.mark, Anchor::Start, &style);
            }
        }
    }
}

/// The border of what the front's points beat: down at each point, then on to the next.
fn staircase(points: &[&Point], place: impl Fn(&Point) -> [f64; 2]) -> Vec<[f64; 2]> {
    let mut front: Vec<[f64; 2]> = points.iter().filter(|p| p.front).map(|p| place(p)).collect();
    front.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let mut line = Vec::new();
    for (i, p) in front.iter().enumerate() {
        if i > 0 {
            line.push([p[0], front[i - 1][1]]);
        }
        line.push(*p);
    }
    line
}

/// A disk, triangle, square or diamond.
fn marker(svg: &mut Svg, style: usize, joined: Joined, [x, y]: [f64; 2], tip: &str) {
    let colour = COLOURS[style % 4];
    let fill = if joined == Joined::Line { colour } else { "#ffffff" };
    let shape =
        |offsets: &[[f64; 2]]| -> Vec<[f64; 2]> { offsets.iter().map(|[dx, dy]| [x + dx, y + dy]).collect() };
    match style % 4 {
        0 => svg.circle([x, y], 4.0, fill, colour, tip),
        1 => svg.polygon(&shape(&[[-4.5, 4.0], [4.5, 4.0], [0.0, -4.5]]), fill, colour, tip),
        2 => svg.polygon(&shape(&[[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]]), fill, colour, tip),
        _ => svg.polygon(&shape(&[[-5.0, 0.0], [0.0, -5.0], [5.0, 0.0], [0.0, 5.0]]), fill, colour, tip),
    }
}
