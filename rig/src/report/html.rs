//! The page's text: its headline, what was run, a place for each plot, tables; and the numbers and the script that fill the places.

use super::data::Data;
use super::scope::{Band, Mark, Scope};
use super::table::{escape, tables, verdicts};
use crate::analysis::Figures;
use anyhow::Result;
use serde_json::json;
use std::fmt::Write as _;

const STYLE: &str = include_str!("page/report.css");
const SCRIPT: &str = include_str!("page/report.js");
const CURVES: &str = include_str!("../../../live/vendor/uPlot.iife.min.js");
const CURVES_STYLE: &str = include_str!("../../../live/vendor/uPlot.min.css");

/// A part of the page.
pub enum Block {
    /// Plots that the script draws.
    Plots(Scope),
    /// A picture under a heading.
    Picture(String, String),
}

/// All that a page says and shows.
#[derive(Default)]
pub struct Document {
    /// Name of what was run.
    pub title: String,
    /// The words after it.
    pub about: String,
    /// The words that stand first, if there are any.
    pub headline: Option<String>,
    /// Lines of what was run: what, and its value.
    pub run: Vec<(String, String)>,
    /// The numbers behind the plots.
    pub data: Data,
    /// Plots and pictures, in their order.
    pub blocks: Vec<Block>,
    /// Instants with a name.
    pub marks: Vec<Mark>,
    /// Stretches of time with a name.
    pub bands: Vec<Band>,
}

/// A title, with the paper's figure named before it.
pub fn heading(figure: Option<&str>, title: &str) -> String {
    figure.map_or(title.to_owned(), |figure| format!("The paper's {figure} · {title}"))
}

/// The whole page.
pub fn page(page: &Document, subtitle: &str, figures: &Figures) -> Result<String> {
    let mut body = String::new();
    let title = escape(&page.title);
    let _ = write!(
        body,
        "<header><h1>{title} <span>{}</span></h1><p>{}</p></header><main>",
        escape(&page.about),
        escape(subtitle)
    );
    if let Some(said) = &page.headline {
        let class = if said.starts_with("PASS") { "pass" } else { "short" };
        let (word, rest) = said.split_once(": ").unwrap_or((said, ""));
        let _ = write!(body, "<p class=\"headline {class}\"><b>{}</b> {}</p>", escape(word), escape(rest));
    }
    let verdicts = verdicts(figures);
    if !verdicts.is_empty() {
        let _ = write!(body, "<section class=\"card\"><h2>Verdicts</h2>{verdicts}</section>");
    }
    if !page.run.is_empty() {
        let line = |(what, value): &(String, String)| {
            format!("<div><dt>{}</dt><dd>{}</dd></div>", escape(what), escape(value))
        };
        let lines: String = page.run.iter().map(line).collect();
        let _ = write!(body, "<section class=\"card\"><h2>Run</h2><dl class=\"run\">{lines}</dl></section>");
    }
    plots(&mut body, &page.blocks);
    let tables = tables(figures);
    if !tables.is_empty() {
        let _ = write!(body, "<section class=\"card\"><h2>Figures</h2>{tables}</section>");
    }
    let scopes: Vec<_> = page.blocks.iter().filter_map(Block::scope).collect();
    let over_time = scopes.iter().any(|scope| scope.time);
    let resolution = if scopes.is_empty() { String::new() } else { page.data.resolution(over_time) };
    let model = json!({
        "tables": serde_json::to_value(page.data.tables())?,
        "scopes": serde_json::to_value(scopes)?,
        "marks": serde_json::to_value(&page.marks)?,
        "bands": serde_json::to_value(&page.bands)?,
    });
    // The numbers must not end the element that they stand in.
    let model = model.to_string().replace('<', "\\u003c");
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <title>{title}: {about}</title><style>{CURVES_STYLE}\n{STYLE}</style></head><body>{body}\
         <footer><p>{resolution}</p><noscript><p>A script draws the plots of this page; the browser runs none.</p></noscript></footer></main>\n\
         <script id=\"model\" type=\"application/json\">{model}</script>\n<script id=\"data\" type=\"text/plain\">{data}</script>\n\
         <script>{CURVES}</script>\n<script>{SCRIPT}</script></body></html>\n",
        about = escape(&page.about),
        data = page.data.packed(),
    ))
}

impl Block {
    const fn scope(&self) -> Option<&Scope> {
        match self {
            Self::Plots(scope) => Some(scope),
            Self::Picture(..) => None,
        }
    }
}

/// The places of the plots, in their order; those over a part of a run, and those over their own axes, side by side if there is room.
fn plots(body: &mut String, blocks: &[Block]) {
    let mut number = 0;
    for block in blocks {
        match block {
            Block::Plots(scope) => {
                let wide = if scope.time && scope.span.is_none() { " wide" } else { "" };
                let heading = heading(scope.figure.as_deref(), &scope.heading);
                let _ = write!(
                    body,
                    "<section class=\"card scope{wide}\" data-scope=\"{number}\"><h2>{}</h2><div class=\"bar\"></div>",
                    escape(&heading)
                );
                for panel in &scope.panels {
                    let label = escape(&panel.label);
                    let one = if panel.series.len() == 1 { " one" } else { "" };
                    let _ = write!(
                        body,
                        "<div class=\"panel{one}\"><h3>{label}</h3><div class=\"plot\"></div></div>"
                    );
                }
                if !scope.time {
                    let _ = write!(body, "<p class=\"axis\">{}</p>", escape(&scope.x));
                }
                *body += "</section>";
                number += 1;
            }
            Block::Picture(heading, svg) => {
                let _ = write!(
                    body,
                    "<section class=\"card picture\"><h2>{}</h2><div class=\"sheet\" tabindex=\"0\">{svg}</div></section>",
                    escape(heading)
                );
            }
        }
    }
}
