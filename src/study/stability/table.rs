//! The catalogue as a table: for people, for the README, for programs.

use serde::Serialize;

use super::bench::BOOKS_BOUND;
use super::{CaseReport, Group};

/// One law of one case, as a line of a table.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What the case is about.
    pub group: Group,
    /// The case's name.
    pub case: &'static str,
    /// The law.
    pub law: String,
    /// How far it was off at worst.
    pub worst: f64,
    /// How far it may be.
    pub bound: f64,
    /// Whether it holds.
    pub holds: bool,
    /// What the case's ledgers and maps leave open at worst; `None` without a bake.
    pub books_open: Option<f64>,
    /// Bakes of the case.
    pub bakes: usize,
    /// Wall-clock time of the case [s].
    pub seconds: f64,
}

/// All laws, case by case.
pub fn rows(reports: &[CaseReport]) -> Vec<Row> {
    let of_case = |report: &CaseReport| -> Vec<Row> {
        let row = |finding: &super::Finding| Row {
            group: report.group,
            case: report.case,
            law: finding.law.clone(),
            worst: finding.worst,
            bound: finding.bound,
            holds: finding.holds() && report.books_open.is_none_or(|open| open <= BOOKS_BOUND),
            books_open: report.books_open,
            bakes: report.bakes,
            seconds: report.seconds,
        };
        report.findings.iter().map(row).collect()
    };
    reports.iter().flat_map(of_case).collect()
}

/// A Markdown table: each law on its line, a case named on the first of its own.
pub fn markdown(reports: &[CaseReport]) -> String {
    let mut text = String::from("| case | law | worst | bound | books |\n|---|---|---|---|---|\n");
    for report in reports {
        for (index, finding) in report.findings.iter().enumerate() {
            let is_first = index == 0;
            let name = if is_first {
                format!("`{}`", report.case)
            } else {
                String::new()
            };
            let books = match report.books_open {
                Some(open) if is_first => number(open),
                _ => String::new(),
            };
            let fails = if finding.holds() { "" } else { " **fails**" };
            let (worst, bound) = (number(finding.worst), number(finding.bound));
            text += &format!(
                "| {name} | {} | {worst}{fails} | {bound} | {books} |\n",
                finding.law
            );
        }
    }
    text
}

/// Two digits: as they are from a thousandth to a thousand, else with a power of ten.
pub fn number(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return "∞".into();
    }
    if !(1e-3..1e3).contains(&magnitude) {
        return format!("{value:.1e}");
    }
    let digits = (1 - magnitude.log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::stability::Finding;

    #[test]
    fn numbers_have_two_digits() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (0.0123, "0.012"),
            (2.5e-7, "2.5e-7"),
            (1234.0, "1.2e3"),
            (f64::INFINITY, "∞"),
            (100.0, "100"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn a_law_that_fails_says_so() {
        let finding = |worst| Finding {
            law: "law".into(),
            worst,
            bound: 0.5,
        };
        let report = CaseReport {
            case: "case",
            group: Group::Laws,
            findings: vec![finding(0.1), finding(f64::INFINITY)],
            bakes: 1,
            books_open: Some(0.0),
            seconds: 1.0,
        };
        assert!(!report.holds());
        let text = markdown(std::slice::from_ref(&report));
        assert!(text.contains("| `case` | law | 0.1 | 0.5 | 0 |"), "{text}");
        assert!(text.contains("|  | law | ∞ **fails** | 0.5 |  |"), "{text}");
        let open = CaseReport {
            findings: vec![finding(0.1)],
            books_open: Some(1e-3),
            ..report
        };
        assert!(!open.holds() && !rows(&[open])[0].holds);
    }
}
