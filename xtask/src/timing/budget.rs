//! The budgets of `budgets.toml`, and whether the measured values keep within them.

use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;

/// A value beside its budget.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    pub name: String,
    pub value: f64,
    /// The largest value that is allowed.
    pub budget: f64,
}

impl Judged {
    /// `true` for a value within its budget; a NaN is not.
    pub fn kept(&self) -> bool {
        self.value <= self.budget
    }
}

/// Judges the values by the file's text: each value must have a budget, each budget a value.
pub fn judge(text: &str, values: &[(impl AsRef<str>, f64)]) -> Result<Vec<Judged>> {
    let groups: BTreeMap<String, BTreeMap<String, f64>> = toml::from_str(text).context("budgets.toml")?;
    let mut budgets = BTreeMap::new();
    for (group, entries) in groups {
        budgets.extend(entries.into_iter().map(|(name, budget)| (format!("{group}.{name}"), budget)));
    }
    let mut judged = Vec::new();
    for (name, value) in values {
        let name = name.as_ref();
        let budget = budgets.remove(name).with_context(|| format!("budgets.toml: {name} is missing"))?;
        judged.push(Judged { name: name.to_owned(), value: *value, budget });
    }
    if let Some(name) = budgets.keys().next() {
        bail!("budgets.toml: {name} is a budget for nothing that is measured");
    }
    Ok(judged)
}

/// The command's exit code.
pub fn exit_code(judged: &[Judged]) -> u8 {
    u8::from(!judged.iter().all(Judged::kept))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "[a]\nplain = 10\n[b]\nother = 20\n";

    fn code(plain: f64, other: f64) -> u8 {
        exit_code(&judge(TEXT, &[("a.plain", plain), ("b.other", other)]).unwrap())
    }

    #[test]
    fn over_budget_exits_with_1() {
        assert_eq!(code(10.0, 20.0), 0);
        assert_eq!(code(10.1, 20.0), 1);
        assert_eq!(code(10.0, 20.1), 1);
        assert_eq!(code(f64::NAN, 10.0), 1);
    }

    #[test]
    fn values_and_budgets_belong_together() {
        let message = |values: &[(&str, f64)]| judge(TEXT, values).unwrap_err().to_string();
        assert_eq!(message(&[("a.other", 1.0)]), "budgets.toml: a.other is missing");
        assert_eq!(
            message(&[("a.plain", 1.0)]),
            "budgets.toml: b.other is a budget for nothing that is measured"
        );
        assert!(judge("[a]\nx = \"much\"", &[] as &[(&str, f64)]).is_err());
    }
}
