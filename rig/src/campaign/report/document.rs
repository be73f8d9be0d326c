//! The generated part of a document.

use super::{SYSTEMS, sentences, text, total};
use crate::campaign::Outcome;
use crate::files::write_text;
use anyhow::{Context, Result, bail};
use std::fmt::Write as _;
use std::path::Path;

/// The part that is written into a document.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The tables of the fast campaign.
    Tables,
    /// The results of the full campaign, in sentences.
    Sentences,
    /// The coverage of the random campaign.
    Coverage,
    /// The same with the optimised patterns.
    OptimalCoverage,
}

impl Part {
    /// The marks of its beginning and its end.
    const fn markers(self) -> [&'static str; 2] {
        match self {
            Self::Tables => ["<!-- campaign: begin -->\n", "<!-- campaign: end -->"],
            Self::Sentences => ["<!-- full campaign: begin -->\n", "<!-- full campaign: end -->"],
            Self::Coverage => ["<!-- random campaign: begin -->\n", "<!-- random campaign: end -->"],
            Self::OptimalCoverage => [
                "<!-- random campaign, optimised patterns: begin -->\n",
                "<!-- random campaign, optimised patterns: end -->",
            ],
        }
    }

    fn text(self, outcomes: &[Outcome]) -> String {
        if self == Self::Tables {
            return text(outcomes, None);
        }
        let mut out = String::new();
        for (system, heading) in SYSTEMS {
            let Some(total) = total(outcomes, system) else { continue };
            let _ = write!(out, "\n{heading}: {}", sentences(&total));
        }
        out
    }
}

/// The document with its generated part replaced. Fails without its markers.
pub fn document(text: &str, outcomes: &[Outcome], part: Part) -> Result<String> {
    replaced(text, part, &part.text(outcomes))
}

fn replaced(text: &str, part: Part, new: &str) -> Result<String> {
    let [begin, end] = part.markers();
    let (Some(from), Some(to)) = (text.find(begin), text.find(end)) else {
        bail!("must have the lines {} and {end}", begin.trim());
    };
    let before = text.get(..from + begin.len()).unwrap_or_default();
    let after = text.get(to..).unwrap_or_default();
    Ok(format!("{before}{new}\n{after}"))
}

/// Renews the generated part of a document, or says whether it is up to date.
pub fn renew(path: &Path, outcomes: &[Outcome], part: Part, only_check: bool) -> Result<bool> {
    renew_with(path, part, &part.text(outcomes), only_check)
}

/// The same with a text that is already made.
pub fn renew_with(path: &Path, part: Part, text: &str, only_check: bool) -> Result<bool> {
    let named = || path.display().to_string();
    let before = std::fs::read_to_string(path).with_context(named)?;
    let after = replaced(&before, part, text).with_context(named)?;
    let same = before == after;
    if !only_check && !same {
        write_text(path, &after)?;
    }
    Ok(same)
}
