//! Tables as CSV and Markdown.

use serde::Serialize;

/// One value of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Cell {
    Text(String),
    Count(u64),
    /// A measured value, in the unit of its column.
    Number(f64),
    /// A fraction [1]; Markdown shows it in per cent.
    Share(f64),
    /// Not measured.
    Empty,
}

impl Cell {
    /// All digits; shares as fractions.
    fn exact(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Count(count) => count.to_string(),
            Self::Number(value) | Self::Share(value) => value.to_string(),
            Self::Empty => String::new(),
        }
    }

    /// Rounded to three digits; shares in per cent.
    pub fn rounded(&self) -> String {
        match self {
            Self::Number(value) => three_digits(*value),
            Self::Share(value) => format!("{} %", three_digits(100.0 * value)),
            _ => self.exact(),
        }
    }

    /// Its numeric value; `None` for text and empty cells.
    pub fn value(&self) -> Option<f64> {
        match self {
            Self::Count(count) => Some(*count as f64),
            Self::Number(value) | Self::Share(value) => Some(*value),
            Self::Text(_) | Self::Empty => None,
        }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<u64> for Cell {
    fn from(count: u64) -> Self {
        Self::Count(count)
    }
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

/// Rows under named columns.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Table {
    /// Names, with units if there are any.
    pub columns: Vec<&'static str>,
    /// Each as long as `columns`.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// Index of a column; `None` if there is none of that name.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| *column == name)
    }

    /// Comma-separated, header first (RFC 4180 except for line ends).
    pub fn csv(&self) -> String {
        let quoted = |field: String| match field.contains([',', '"', '\n', '\r']) {
            true => format!("\"{}\"", field.replace('"', "\"\"")),
            false => field,
        };
        let line = |fields: Vec<String>| fields.into_iter().map(quoted).collect::<Vec<_>>().join(",") + "\n";
        let header = line(self.columns.iter().map(|name| (*name).into()).collect());
        let rows = self.rows.iter().map(|row| row.iter().map(Cell::exact).collect());
        header + &rows.map(line).collect::<String>()
    }

    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let header = line(self.columns.iter().map(|name| (*name).into()).collect());
        let rule = format!("|{}\n", "---|".repeat(self.columns.len()));
        let rows = self
            .rows
            .iter()
            .map(|row| row.iter().map(Cell::rounded).collect());
        header + &rule + &rows.map(line).collect::<String>()
    }
}

/// `123`, `1.23`, `0.00123`, `1.23e6`.
pub(super) fn three_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !(1e-3..1e5).contains(&value.abs()) {
        return format!("{value:.2e}");
    }
    let digits_before = value.abs().log10().floor() as i32 + 1;
    let decimals = usize::try_from(3 - digits_before).unwrap_or(0);
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_is_exact_and_markdown_rounded() {
        let table = Table {
            columns: vec!["name", "error"],
            rows: vec![
                vec!["a, \"b\"\nc".into(), Cell::Share(0.012_345)],
                vec![1234_u64.into(), Cell::Empty],
                vec![56.78.into(), (-1.234e6).into()],
            ],
        };
        assert_eq!(
            table.csv(),
            "name,error\n\"a, \"\"b\"\"\nc\",0.012345\n1234,\n56.78,-1234000\n"
        );
        let text = table.markdown();
        assert!(
            text.contains("| 1.23 % |") && text.contains("| 56.8 | -1.23e6 |"),
            "{text}"
        );
    }
}
