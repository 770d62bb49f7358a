//! Two reports held against each other: what became larger, slower or less accurate.
//!
//! Only the shape of `data.json` is known here: numbers in an object `figures` are found again by every run and decide, those
//! in `times` are told but do not; all are better small, but for [`LARGER_IS_BETTER`]. Rows of a list are known by their
//! `name`. So a new section needs nothing here.

use std::collections::BTreeMap;

use serde_json::Value;
use thiserror::Error;

use super::SCHEMA_VERSION;

/// Figures that are better large. Where one is null it is infinite: the pictures are the same.
pub const LARGER_IS_BETTER: [&str; 1] = ["psnr_db"];

/// Part of the largest figure of a name that rounding may add to the others: an exact pick is off by some 10⁻¹² m where a coarse one
/// is by 10 m, and on another processor by some 10⁻¹² m more. Counts are below 2⁴⁰, so one more is always seen.
pub const ROUNDING: f64 = 1.0 / (1u64 << 40) as f64;

/// Why two reports can not be compared.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CompareError {
    /// One is no report, or of another version.
    #[error("the {which} file is no report of schema {SCHEMA_VERSION}: make it again with `seamount cost`")]
    Schema {
        /// "old" or "new".
        which: &'static str,
    },
    /// A figure or time is neither a number nor missing.
    #[error("in the {which} file {name} is {value}: a number has to be there, or null with a reason")]
    NoNumber {
        /// "old" or "new".
        which: &'static str,
        /// Section, row and figure, joined by `/`.
        name: String,
        /// What is there, as JSON.
        value: String,
    },
    /// Two rows of a list have one name, so that the second would hide the first.
    #[error("in the {which} file {name} is there twice: give each row of a list a name of its own")]
    Twice {
        /// "old" or "new".
        which: &'static str,
        /// Section, row and figure, joined by `/`.
        name: String,
    },
}

/// A figure that is not what it was.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Section, row and figure, joined by `/`.
    pub name: String,
    /// What it was; `None`: it was not there.
    pub old: Option<f64>,
    /// What it is; `None`: it is not there any more.
    pub new: Option<f64>,
}

/// What times of one name became, over all rows that have it in both reports.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeChange {
    /// Section and time, joined by `/`.
    pub name: String,
    /// Geometric mean of new over old.
    pub mean_ratio: f64,
    /// Largest of the ratios.
    pub max_ratio: f64,
    /// The row that has it.
    pub slowest: String,
    /// Rows.
    pub rows: usize,
}

/// The differences of two reports.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Comparison {
    /// What was measured otherwise, so that figures may differ for no fault of the program.
    pub notes: Vec<String>,
    /// Figures that became worse by more than the threshold, and those that are gone.
    pub worse: Vec<Change>,
    /// Figures that became better by more than the threshold.
    pub better: Vec<Change>,
    /// Figures that both have and that are within the threshold.
    pub same: usize,
    /// Figures that only the new report has.
    pub added: usize,
    /// Times; they follow the load of the machine and decide nothing.
    pub times: Vec<TimeChange>,
}

impl Comparison {
    /// Whether nothing became worse.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.worse.is_empty()
    }
}

/// Compares two reports as they stand in `data.json`. Figures may grow by `threshold`, a part of the old value (0.05 is 5 %), and by
/// [`ROUNDING`] of the largest figure of the same name in their list.
///
/// # Errors
///
/// [`CompareError`].
///
/// # Example
///
/// ```
/// use seamount::cost::compare::compare;
/// use serde_json::json;
///
/// let report = |triangles: u64| json!({
///     "schema": 1, "about": {},
///     "drawing": { "rows": [{ "name": "above, τ = 1 px", "figures": { "triangles": triangles }, "times": {} }] },
/// });
/// assert!(compare(&report(1000), &report(1010), 0.05)?.passed());
/// let more = compare(&report(1000), &report(1100), 0.05)?;
/// assert_eq!(more.worse[0].name, "drawing/rows/above, τ = 1 px/triangles");
/// # Ok::<(), seamount::cost::compare::CompareError>(())
/// ```
pub fn compare(old: &Value, new: &Value, threshold: f64) -> Result<Comparison, CompareError> {
    for (report, which) in [(old, "old"), (new, "new")] {
        if report.get("schema").and_then(Value::as_u64) != Some(u64::from(SCHEMA_VERSION)) {
            return Err(CompareError::Schema { which });
        }
    }
    let mut found = Comparison::default();
    for key in ["version", "command", "adapter", "driver", "size", "quick", "terrain", "samples"] {
        let of = |report: &Value| report.pointer(&format!("/about/{key}")).cloned().unwrap_or_default();
        if of(old) != of(new) {
            found.notes.push(format!("{key} was {} and is {}", of(old), of(new)));
        }
    }
    for (report, which) in [(old, "old"), (new, "new")] {
        if report.get("complete") == Some(&Value::Bool(false)) {
            found.notes.push(format!("the {which} run did not come to its end"));
        }
    }
    let (before, after) = (Numbers::of(old, "old")?, Numbers::of(new, "new")?);
    for (name, was) in &before.figures {
        let change = |is: Option<f64>| Change { name: name.clone(), old: *was, new: is };
        let Some(is) = after.figures.get(name) else {
            // What could not be measured before is not missed.
            if was.is_some() {
                found.worse.push(change(None));
            }
            continue;
        };
        let larger_is_better = LARGER_IS_BETTER.iter().any(|n| name.ends_with(&format!("/{n}")));
        // As numbers of which the smaller is better.
        let cost = |figure: Option<f64>| match figure {
            Some(value) if larger_is_better => -value,
            Some(value) => value,
            None if larger_is_better => f64::NEG_INFINITY,
            None => f64::INFINITY,
        };
        let (was, is_now) = (cost(*was), cost(*is));
        let rounding = ROUNDING * before.largest.get(&alike(name)).copied().unwrap_or(0.0);
        let room = if was.is_finite() { (was.abs() * threshold).max(rounding) } else { 0.0 };
        if is_now > was + room {
            found.worse.push(change(*is));
        } else if is_now < was - room {
            found.better.push(change(*is));
        } else {
            found.same += 1;
        }
    }
    found.added = after.figures.keys().filter(|name| !before.figures.contains_key(*name)).count();
    found.times = time_changes(&before, &after);
    Ok(found)
}

/// How the times changed; how often something was repeated to find them is none itself.
fn time_changes(before: &Numbers, after: &Numbers) -> Vec<TimeChange> {
    let mut by_name: BTreeMap<String, Vec<(f64, &str)>> = BTreeMap::new();
    for (name, was) in &before.times {
        if let (Some(was), Some(Some(is))) = (was, after.times.get(name))
            && !name.ends_with("/repeats")
            && *was > 0.0
            && *is > 0.0
        {
            let (row, time) = name.rsplit_once('/').unwrap_or(("", name));
            let section = row.split('/').next().unwrap_or("");
            by_name.entry(format!("{section}/{time}")).or_default().push((is / was, row));
        }
    }
    let change = |(name, ratios): (String, Vec<(f64, &str)>)| {
        let slowest = ratios.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((1.0, ""));
        let logs: f64 = ratios.iter().map(|r| r.0.ln()).sum();
        TimeChange {
            name,
            mean_ratio: (logs / ratios.len() as f64).exp(),
            max_ratio: slowest.0,
            slowest: slowest.1.to_owned(),
            rows: ratios.len(),
        }
    };
    by_name.into_iter().map(change).collect()
}

/// All figures and times of a report by their names.
#[derive(Default)]
struct Numbers {
    figures: BTreeMap<String, Option<f64>>,
    times: BTreeMap<String, Option<f64>>,
    /// Of the figures that are alike, the largest amount.
    largest: BTreeMap<String, f64>,
}

/// What figures of the same name in one list have in common: their name without that of the row.
fn alike(name: &str) -> String {
    let (row, figure) = name.rsplit_once('/').unwrap_or(("", name));
    let list = row.rsplit_once('/').map_or("", |(list, _)| list);
    format!("{list}/{figure}")
}

impl Numbers {
    fn of(report: &Value, which: &'static str) -> Result<Self, CompareError> {
        let mut found = Self::default();
        found.collect(report, "", which)?;
        for (name, figure) in &found.figures {
            let largest = found.largest.entry(alike(name)).or_default();
            *largest = largest.max(figure.unwrap_or(0.0).abs());
        }
        Ok(found)
    }

    fn collect(&mut self, value: &Value, path: &str, which: &'static str) -> Result<(), CompareError> {
        let below = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}/{name}") };
        match value {
            Value::Object(fields) => {
                for (name, value) in fields {
                    let into = match name.as_str() {
                        "figures" => &mut self.figures,
                        "times" => &mut self.times,
                        _ => {
                            self.collect(value, &below(name), which)?;
                            continue;
                        }
                    };
                    for (name, value) in value.as_object().into_iter().flatten() {
                        let name = below(name);
                        let number = value.as_f64();
                        if number.is_none() && !value.get("value").is_some_and(Value::is_null) {
                            return Err(CompareError::NoNumber { which, name, value: value.to_string() });
                        }
                        if into.insert(name.clone(), number).is_some() {
                            return Err(CompareError::Twice { which, name });
                        }
                    }
                }
            }
            Value::Array(items) => {
                for (i, item) in items.iter().enumerate() {
                    let name = item.get("name").and_then(Value::as_str).map_or_else(|| i.to_string(), str::to_owned);
                    self.collect(item, &below(&name), which)?;
                }
            }
            _ => {}
        }
        Ok(())
    }
}
