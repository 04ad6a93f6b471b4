//! How fast a bake is: ratios within one run, because machines differ and are shared.

pub mod bakes;
pub mod ball;
pub mod scaling;
pub mod visibility;

/// One line of the table.
#[derive(Clone, Debug)]
pub struct Line {
    /// What was measured.
    pub what: String,
    /// The figure, with its unit.
    pub figure: String,
}

impl Line {
    /// A line of the table.
    pub fn new(what: impl Into<String>, figure: impl Into<String>) -> Self {
        Self { what: what.into(), figure: figure.into() }
    }
}

/// Lines under each other, figures in one column.
pub fn text(lines: &[Line]) -> String {
    let width = lines.iter().map(|l| l.what.chars().count()).max().unwrap_or(0);
    lines.iter().map(|l| format!("{:<width$}  {}\n", l.what, l.figure)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_stand_in_one_column() {
        let table = text(&[Line::new("depth", "1"), Line::new("winding", "2")]);
        assert_eq!(table, "depth    1\nwinding  2\n");
    }
}
