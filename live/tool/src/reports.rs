//! The checks of report pages in a browser: opened as files, without a server.

use crate::axe::Axe;
use crate::browser::Browser;
use crate::pictures;
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};

/// Widths of a window, in CSS pixels.
const WIDTHS: [u32; 2] = [1280, 390];
/// Largest page of a run, in bytes.
const LARGEST_BYTES: u64 = 3_000_000;

/// Points of a curve that are drawn at most: some of each pixel.
const MOST_POINTS: u64 = 10_000;

/// The faults of the page as it is shown: too wide, letters under 11 px, contrast under 4.5 to 1, 3 to 1 of large letters.
const COMPLAINTS: &str = include_str!("reports.js");

/// The plots have the width that the window gives them.
const LAID_OUT: &str = "report.scopes.every(scope => !scope || scope.hosts[0].clientWidth === scope.width)";

/// Checks report pages; with a folder, takes pictures of their first window as well.
pub fn check(pages: &[PathBuf], folder: Option<&Path>, browser: &mut Browser, axe: &Axe) -> Result<()> {
    for page in pages {
        let name = page.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy().into_owned();
        let page = std::path::absolute(page)?;
        let bytes = std::fs::metadata(&page).with_context(|| page.display().to_string())?.len();
        ensure!(bytes <= LARGEST_BYTES, "{}: {bytes} bytes, at most {LARGEST_BYTES}", page.display());
        browser.resize(WIDTHS[0], 900, false)?;
        browser.go(&format!("file://{}", page.display()))?;
        browser.until("the page draws", "!!document.body?.dataset.drawn")?;
        let drawn_ms = browser.evaluate("+document.body.dataset.drawn")?;
        println!("{name}: {bytes} bytes, first plots after {drawn_ms} ms");
        browser.evaluate("report.all().length")?;
        for width in WIDTHS {
            for dark in [false, true] {
                browser.resize(width, 900, dark)?;
                std::thread::sleep(std::time::Duration::from_millis(400));
                let wrong = browser.evaluate(COMPLAINTS)?;
                ensure!(
                    wrong.as_array().is_some_and(Vec::is_empty),
                    "{name} at {width} pixels, dark {dark}: {wrong}"
                );
                if dark == (width == WIDTHS[1]) {
                    axe.check(browser, &format!("{name}, {width} pixels"))?;
                }
                if let Some(out) = folder {
                    let file = out
                        .join(format!("report-{name}-{width}-{}.png", if dark { "dark" } else { "light" }));
                    pictures::save(&browser.picture()?, &file)?;
                }
            }
        }
        browser.resize(WIDTHS[0], 900, false)?;
        browser.until("the plots are as wide as the window", LAID_OUT)?;
        let trace = page.with_file_name("trace.csv");
        // A machine has none, and a talk shows what telemetry told.
        if trace.exists() && !page.with_file_name("telemetry.csv").exists() {
            zooms(browser, &name)?;
            holds_the_trace(browser, &trace, &name)?;
        }
        ensure!(browser.errors.is_empty(), "{name}: errors on the console: {:?}", browser.errors);
    }
    Ok(())
}

/// The first plots show the lowest and the highest value of each curve as a whole, and zoom until each row stands for itself, and where there
/// are edges, until one edge is alone; and back.
fn zooms(browser: &mut Browser, name: &str) -> Result<()> {
    const ZOOM: &str = "(async () => {
        const scope = report.scopes[0], frame = () => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
        const edges = scope.plan.panels.findIndex((p, n) => p.series[0].style === 'edges' && scope.curves[n][0].times.rows > 100);
        const ends = values => values.reduce(([low, high], value) => value == null ? [low, high] : [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
        const found = [];
        for (const panel of new Set([0, Math.max(0, edges)])) {
            const curve = scope.curves[panel][0], [from, to] = scope.full, all = curve.times.rows;
            const k = all >> 1, at = curve.times.of(k), whole = scope.plots[panel].data[0].length;
            const extremes = String(ends(scope.plots[panel].data[1])) === String(ends(curve.values));
            const narrow = Math.min(1e-4, 8 * (curve.times.every || 1));
            let longest = 0, frames = 0;
            for (let width = to - from; width > narrow; width *= 0.7) {
                const began = performance.now();
                scope.shown = [at - width / 2, at + width / 2];
                scope.draw();
                longest = Math.max(longest, performance.now() - began);
                frames += 1;
                await frame();
            }
            const data = scope.plots[panel].data, shown = data[0].length;
            const own = [k - 1, k, k + 1].every(row => data[0].some((t, n) => Math.abs(t - curve.times.of(row)) < 1e-9 && data[1][n] === curve.values[row]));
            scope.show(...scope.home);
            await frame();
            const back = scope.shown[0] === scope.home[0] && scope.plots[panel].data[0].length === whole;
            found.push({ all, whole, shown, extremes, own, back, longest: Math.round(longest), frames });
        }
        return found;
    })()";
    let said = browser.evaluate(ZOOM)?;
    for said in said.as_array().with_context(|| format!("{name}: {said}"))? {
        let number = |field: &str| said[field].as_u64().with_context(|| format!("{name}: {said}"));
        let (all, whole, shown) = (number("all")?, number("whole")?, number("shown")?);
        ensure!(whole <= MOST_POINTS, "{name}: {whole} points are drawn of the whole: {said}");
        ensure!(shown < 40 && shown < all, "{name}: {shown} points of {all} where few are left: {said}");
        ensure!(said["extremes"] == true, "{name}: the whole is without its lowest or highest value: {said}");
        ensure!(said["own"] == true, "{name}: the values in the middle are not their own: {said}");
        ensure!(said["back"] == true, "{name}: the zoom does not return: {said}");
        println!(
            "{name}: {all} values drawn as {whole}; zoomed to {shown} in {} frames, the longest {} ms",
            said["frames"], said["longest"]
        );
    }
    Ok(())
}

/// Curves of the page, and the columns of trace.csv that they show.
const CURVES: [(&str, &str); 7] = [
    ("torque", "te_nm"),
    ("demand", "te_ref_nm"),
    ("ia", "ia_a"),
    ("speed", "speed_rpm"),
    ("udc", "udc_v"),
    ("U_in", "uin_v"),
    ("i_L", "il_a"),
];
/// Rows of the trace between two that are looked at.
const EVERY: usize = 97;

/// The first plots' values are the trace's, to an 8192nd of their span; where a stretch of rows has left its lowest and its highest value, the
/// trace's are between them.
fn holds_the_trace(browser: &mut Browser, trace: &Path, name: &str) -> Result<()> {
    let text = std::fs::read_to_string(trace).with_context(|| trace.display().to_string())?;
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let heads = lines.next().context("an empty trace")?;
    let rows: Vec<_> = lines.step_by(EVERY).collect();
    let [first, second] =
        [0, 1].map(|k| text.lines().nth(k + 1).and_then(|line| line.split(',').next()?.parse::<f64>().ok()));
    let step_s = second.zip(first).map_or(0.0, |(second, first)| second - first);
    let mut looked = 0;
    for (curve, column) in CURVES {
        let Some(place) = heads.iter().position(|head| *head == column) else { continue };
        let wanted: Vec<_> = rows.iter().map(|row| format!("[{},{}]", row[0], row[place])).collect();
        let worst = browser.evaluate(&format!(
            "(() => {{
                const scope = report.scopes[0], all = scope.curves.flat();
                const k = scope.plan.panels.flatMap(panel => panel.series).findIndex(series => series.name === '{curve}');
                if (k < 0) return null;
                const {{ times, values }} = all[k];
                let low = Infinity, high = -Infinity;
                for (const value of values) {{ low = Math.min(low, value); high = Math.max(high, value); }}
                const step = (high - low) / 8192 + 1e-6 * Math.max(Math.abs(low), Math.abs(high));
                const within = [{}].filter(([t]) => t >= times.begin && t <= times.end);
                const stretched = times.every > 1.5 * {step_s};
                const off = ([t, v]) => {{
                    const k = times.row(t + 1e-9), pair = [values[k - k % 2], values[k - k % 2 + 1] ?? values[k]];
                    return stretched ? Math.max(0, v - Math.max(...pair), Math.min(...pair) - v) : Math.abs(values[k] - v);
                }};
                return within.length && Math.max(...within.map(off)) / (step || 1);
            }})()",
            wanted.join(",")
        ))?;
        let Some(worst) = worst.as_f64() else { continue };
        ensure!(worst <= 0.6, "{name}: {curve} is {worst} of its steps off {column} of the trace");
        looked += 1;
    }
    ensure!(looked > 0, "{name}: no curve of the first plots is a column of the trace");
    println!("{name}: {looked} curves are the trace's");
    Ok(())
}
