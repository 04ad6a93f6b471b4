//! SVG elements as text.

use std::fmt::Write;

/// A picture under construction.
pub struct Svg {
    text: String,
}

/// How text is placed.
#[derive(Clone, Copy)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

impl Svg {
    /// An empty white picture.
    pub fn new(width: f64, height: f64, title: &str) -> Self {
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width:.0} {height:.0}\" font-family=\"sans-serif\" font-size=\"12\">\n"
        );
        let _ = writeln!(text, "<title>{}</title>", escape(title));
        let _ = writeln!(text, "<rect width=\"{width:.0}\" height=\"{height:.0}\" fill=\"#ffffff\"/>");
        Self { text }
    }

    pub fn line(&mut self, [x0, y0]: [f64; 2], [x1, y1]: [f64; 2], colour: &str, width: f64) {
        let _ = writeln!(
            self.text,
            "<line x1=\"{x0:.1}\" y1=\"{y0:.1}\" x2=\"{x1:.1}\" y2=\"{y1:.1}\" stroke=\"{colour}\" \
             stroke-width=\"{width}\"/>"
        );
    }

    pub fn frame(&mut self, [x0, y0]: [f64; 2], [x1, y1]: [f64; 2], colour: &str) {
        let (w, h) = (x1 - x0, y1 - y0);
        let _ = writeln!(
            self.text,
            "<rect x=\"{x0:.1}\" y=\"{y0:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" fill=\"none\" \
             stroke=\"{colour}\"/>"
        );
    }

    pub fn polyline(&mut self, points: &[[f64; 2]], colour: &str, width: f64) {
        let list: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let _ = writeln!(
            self.text,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" \
             stroke-linejoin=\"round\"/>",
            list.join(" ")
        );
    }

    /// A closed shape; `fill` may be "none".
    pub fn polygon(&mut self, points: &[[f64; 2]], fill: &str, stroke: &str, tip: &str) {
        let list: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let _ = writeln!(
            self.text,
            "<polygon points=\"{}\" fill=\"{fill}\" stroke=\"{stroke}\" stroke-width=\"1.4\">\
             <title>{}</title></polygon>",
            list.join(" "),
            escape(tip)
        );
    }

    pub fn circle(&mut self, [x, y]: [f64; 2], r: f64, fill: &str, stroke: &str, tip: &str) {
        let _ = writeln!(
            self.text,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{r:.1}\" fill=\"{fill}\" stroke=\"{stroke}\" \
             stroke-width=\"1.4\"><title>{}</title></circle>",
            escape(tip)
        );
    }

    pub fn label(&mut self, [x, y]: [f64; 2], text: &str, anchor: Anchor, style: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let _ = writeln!(
            self.text,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" {style}>{}</text>",
            escape(text)
        );
    }

    /// The finished text.
    pub fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }
}

/// Text that XML leaves as it is.
fn escape(text: &str) -> String {
    text.chars()
        .filter(|c| !c.is_control())
        .map(|c| match c {
            '&' => "&amp;".to_owned(),
            '<' => "&lt;".to_owned(),
            '>' => "&gt;".to_owned(),
            '"' => "&quot;".to_owned(),
            c => c.to_string(),
        })
        .collect()
}
