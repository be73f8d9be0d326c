//! The checks of axe-core, the accessibility engine, on a page as it is shown.

use crate::browser::Browser;
use anyhow::{Context, Result, ensure};
use std::path::Path;

/// The program; none where it could not be had.
#[derive(Default)]
pub struct Axe(Option<String>);

/// Every check of WCAG 2.0 to 2.2, levels A and AA; the whole answer would be megabytes.
const RUN: &str = "axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'], resultTypes: ['violations'] })
    .then(({ violations, passes }) => [violations.map(({ id, nodes }) => `${id}: ${nodes.slice(0, 3).map(node => node.html.slice(0, 160)).join('; ')}`), passes.length])";

impl Axe {
    /// Of its file.
    pub fn read(file: Option<&Path>) -> Result<Self> {
        let Some(file) = file else { return Ok(Self(None)) };
        std::fs::read_to_string(file).map(|text| Self(Some(text))).with_context(|| file.display().to_string())
    }

    /// Fails where the page violates a rule.
    pub fn check(&self, browser: &mut Browser, name: &str) -> Result<()> {
        let Some(program) = &self.0 else { return Ok(()) };
        if browser.evaluate("typeof axe")? == "undefined" {
            browser.evaluate(&format!("{program}; 0"))?;
        }
        let found = browser.evaluate(RUN)?;
        let violations = found[0].as_array().context("axe-core: no answer")?;
        ensure!(violations.is_empty(), "{name}: axe-core finds {violations:#?}");
        let kept = found[1].as_u64().unwrap_or(0);
        ensure!(kept > 5, "{name}: axe-core has looked at {kept} rules only");
        println!("{name}: {kept} rules of axe-core kept");
        Ok(())
    }
}
