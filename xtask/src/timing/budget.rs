//! The budgets of `budgets.toml`, and how the measured values keep them.

use anyhow::{Context, Result, bail};
use serde::Deserialize;
use std::collections::BTreeMap;

/// The bounds of a value.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// The value that is wanted.
    pub target: f64,
    /// The value that is allowed until then.
    pub ceiling: Option<f64>,
}

/// The verdict on a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    Kept,
    /// Within the ceiling and above the target.
    Short,
    Over,
}

impl Budget {
    /// The bound that fails.
    pub fn bound(&self) -> f64 {
        self.ceiling.unwrap_or(self.target)
    }

    /// The verdict on this value; one that is no number fails.
    pub fn verdict(&self, value: f64) -> Verdict {
        match value {
            _ if value <= self.target => Verdict::Kept,
            _ if value <= self.bound() => Verdict::Short,
            _ => Verdict::Over,
        }
    }
}

impl Verdict {
    /// As in the table.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Kept => "ok",
            Self::Short => "short of target",
            Self::Over => "OVER",
        }
    }
}

/// A value beside its budget.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    pub name: String,
    pub value: f64,
    pub budget: Budget,
}

impl Judged {
    /// The verdict.
    pub fn verdict(&self) -> Verdict {
        self.budget.verdict(self.value)
    }
}

/// Judges the values by the file's text: each has to have a budget, each budget a value.
pub fn judge(text: &str, values: &[(impl AsRef<str>, f64)]) -> Result<Vec<Judged>> {
    let groups: BTreeMap<String, BTreeMap<String, Budget>> = toml::from_str(text).context("budgets.toml")?;
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
    u8::from(judged.iter().any(|judged| judged.verdict() == Verdict::Over))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "[a]\nplain = { target = 10 }\n[b]\nraised = { target = 10, ceiling = 20 }\n";

    fn code(plain: f64, raised: f64) -> u8 {
        exit_code(&judge(TEXT, &[("a.plain", plain), ("b.raised", raised)]).unwrap())
    }

    #[test]
    fn over_budget_exits_with_1() {
        assert_eq!(code(10.0, 10.0), 0);
        assert_eq!(code(10.1, 10.0), 1);
        assert_eq!(code(10.0, 20.0), 0);
        assert_eq!(code(10.0, 20.1), 1);
        assert_eq!(code(f64::NAN, 10.0), 1);
    }

    #[test]
    fn between_target_and_ceiling_it_falls_short() {
        let judged = judge(TEXT, &[("a.plain", 0.0), ("b.raised", 15.0)]).unwrap();
        assert_eq!([judged[0].verdict(), judged[1].verdict()], [Verdict::Kept, Verdict::Short]);
    }

    #[test]
    fn values_and_budgets_belong_together() {
        let message = |values: &[(&str, f64)]| judge(TEXT, values).unwrap_err().to_string();
        assert_eq!(message(&[("a.other", 1.0)]), "budgets.toml: a.other is missing");
        assert_eq!(
            message(&[("a.plain", 1.0)]),
            "budgets.toml: b.raised is a budget for nothing that is measured"
        );
        assert!(judge("[a]\nx = { ceiling = 1 }", &[] as &[(&str, f64)]).is_err());
        assert!(judge("[a]\nx = { target = 1, roof = 2 }", &[] as &[(&str, f64)]).is_err());
    }
}
